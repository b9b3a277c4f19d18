"""The SQLite store of trials: exact rows, digests, and recovery after a kill."""

import os
import shutil
import signal
import subprocess
import sys
from dataclasses import replace

import numpy as np
import pytest

import fake_trial
from made_records import execute, hot_journal, make_record
from processes import environment
from refusals import refuses
from sdnn.runs import ResultStore, StoreError, TrialRows
from sdnn.runs.trial import records_digest


def filled(folder, n_trials):
    """Store made-up trials in a folder; return the path of the database and the rows' digest."""
    with ResultStore(folder) as store:
        for trial in range(n_trials):
            store.add(make_record(trial, steps=range(1, 60)))
        return store.path, records_digest(store.load())


def test_a_stored_trial_is_loaded_exactly(tmp_path):
    with ResultStore(tmp_path / "new" / "folder") as store:
        store.add(make_record())
    with ResultStore(tmp_path / "new" / "folder") as store:
        (loaded,) = store.load()
    expected = make_record()
    assert replace(loaded, rows=expected.rows) == expected
    for name in ("episode", "steps", "episode_return", "solved"):
        column = getattr(loaded.rows, name)
        np.testing.assert_array_equal(column, getattr(expected.rows, name))
        assert column.dtype == getattr(expected.rows, name).dtype


def test_times_are_read_without_rows(tmp_path):
    with ResultStore(tmp_path) as store:
        assert store.seconds() == {}
        store.add(make_record(0))
        store.add(make_record(1, steps=(), seconds=2.0))
        assert store.seconds() == {make_record(0).key: 0.5, make_record(1).key: 2.0}


def test_the_view_labelled_rows_joins_rows_with_their_trial(tmp_path):
    path, _ = filled(tmp_path, 2)
    row = execute(
        path,
        "SELECT case_id, agent, trial, seed, config_hash, version, episode, length, terminated"
        " FROM labelled_rows ORDER BY trial, episode",
    )
    episode, length, solved = 10, 1, 1  # of the first evaluation of the first trial
    assert row == (*make_record().key, "0.1", episode, length, solved)


def test_numpy_numbers_are_stored_as_numbers(tmp_path):
    with ResultStore(tmp_path) as store:
        store.add(make_record(seconds=np.float64(0.5), n_decisions=np.int64(57)))
        assert store.load()[0].seconds == 0.5


def test_trials_of_different_configurations_are_stored_separately(tmp_path):
    with ResultStore(tmp_path) as store:
        store.add(make_record(steps=(50, 50)))
        store.add(make_record(config='{"a":1}', steps=(3, 3)))
        (record,) = store.load([make_record(config='{"a":1}').key])
        assert record.rows.steps.tolist() == [3, 3]
        assert len(store.keys()) == 2


def test_reading_a_store_changes_no_file(tmp_path):
    path, digest = filled(tmp_path / "full", 3)
    (tmp_path / "empty").mkdir()
    (tmp_path / "empty" / path.name).touch()
    content = path.read_bytes()
    with ResultStore(path.parent, read_only=True) as store:
        assert records_digest(store.load()) == digest
        assert len(store.seconds()) == 3
        assert list(path.parent.iterdir()) == [path]
        refuses("readonly", store.add, make_record(7), error=StoreError)
    assert list(path.parent.iterdir()) == [path]
    assert path.read_bytes() == content
    for folder in (tmp_path / "empty", tmp_path / "none"):
        with ResultStore(folder, read_only=True) as store:
            assert store.keys() == set()
            assert (store.seconds(), store.measurements("cost")) == ({}, {})
    assert (tmp_path / "empty" / path.name).stat().st_size == 0
    assert not (tmp_path / "none").exists()


READING = """
import sys
from sdnn.runs import ResultStore
with ResultStore(sys.argv[1], read_only=True) as store:
    print(len(store.keys()), len(store.load()))
"""


def test_a_store_on_a_read_only_file_system_can_be_read(tmp_path):
    path, _ = filled(tmp_path / "out", 2)
    # Within a separate namespace of mounts, mount the folder $1 on itself, read-only.
    mount = 'mount --bind "$1" "$1" && mount -o remount,ro,bind "$1" && ! touch "$1/x" && shift'
    unshare = ("unshare", "--map-root-user", "--mount", "sh", "-c")
    if (
        shutil.which("unshare") is None
        or subprocess.run([*unshare, mount, "sh", path.parent], capture_output=True).returncode
    ):
        pytest.skip("needs the right to mount a folder read-only")
    read = (sys.executable, "-c", READING, path.parent)
    command = [*unshare, f'{mount} && exec "$@"', "sh", path.parent, *read]
    process = subprocess.run(command, capture_output=True, text=True, env=environment())
    assert (process.returncode, process.stdout) == (0, "2 2\n"), process.stderr  # keys, records


def test_after_each_trial_a_copy_of_the_file_is_complete(tmp_path):
    with ResultStore(tmp_path / "out") as store:
        for trial in range(3):
            store.add(make_record(trial, steps=range(1, 60)))
            copied = tmp_path / str(trial)
            copied.mkdir()
            shutil.copy(store.path, copied)
            assert os.listdir(tmp_path / "out") == [store.path.name]
            with ResultStore(copied) as other:
                assert len(other.load()) == trial + 1


TRAINED = [
    {"kind": "episode", "step": 3, "episode": 0, "return": -1.5, "length": 3, "terminated": True},
    {
        "kind": "evaluation", "step": 4, "episode": 1, "mean_return": 1.5, "returns": [1.0, 2.0],
        "mean_length": 5.5, "lengths": [5, 6], "share_terminated": 0.5,
        "terminated": [True, False],
    },
    {"kind": "episode", "step": 9, "episode": 1, "return": 2.0, "length": 6, "terminated": False},
]  # fmt: skip


def test_rows_of_a_run_are_appended_until_it_is_finished(tmp_path):
    key = make_record().key._replace(seed=2**64 - 1)
    metadata = {"config": "{}", "version": "0.1", "seconds": 1.5}
    with ResultStore(tmp_path) as store:
        store.extend(key, TrialRows.from_training(TRAINED[:2]), first=0, **metadata)
        assert (store.keys(), store.load()) == (set(), ()), "no result before the run is finished"
        assert store.rows(key).to_training() == TRAINED[:2]
        # After a kill, the rows since the last checkpoint, here from number 1 on, are replaced.
        store.extend(key, TrialRows.from_training(TRAINED[1:], first=1), first=1, **metadata)
        assert store.rows(key).to_training() == TRAINED
        nothing = TrialRows.from_training([])
        store.add(replace(make_record(seconds=2.0), key=key, rows=nothing))
        assert store.keys() == {key}
        (record,) = store.load()
        assert record.seconds == 1.5 + 1.5 + 2.0, "of all parts"
        assert record.rows.to_training() == TRAINED
        # The only evaluation: its episode, and the means over its two episodes.
        assert record.rows.episode.tolist() == [1]
        assert record.rows.steps.tolist() == [5.5]
        assert record.rows.episode_return.tolist() == [1.5]
        assert record.rows.solved.tolist() == [0.5]
        store.extend(key, nothing, first=3, **metadata)
        assert store.keys() == set(), "the run is in progress again"


def test_rows_keep_the_number_of_their_environment():
    rows = [{**TRAINED[0], "environment": 2}]
    assert TrialRows.from_training(rows).to_training() == rows


def test_adding_a_trial_again_is_ignored_and_with_other_rows_refused(tmp_path):
    with ResultStore(tmp_path) as store:
        store.add(make_record())
        store.add(make_record(seconds=9.0))
        assert len(store.load()) == 1
        refuses("results", store.add, make_record(steps=(50, 8)), error=StoreError)
        store.add(make_record(steps=(50, 8)), is_exact=False)
        assert store.load()[0].rows.steps.tolist() == [50, 7]


def test_the_digest_depends_on_rows_and_keys_only(tmp_path):
    def digest(name, records):
        with ResultStore(tmp_path / name) as store:
            for record in records:
                store.add(record)
            return records_digest(store.load())

    base = digest("1", [make_record(0), make_record(1)])
    other = make_record(1, seconds=3.0, finished_at="later", version="0.2")
    assert digest("2", [other, make_record(0)]) == base
    assert digest("3", [make_record(0), make_record(1, steps=(50, 8))]) != base
    assert digest("4", [make_record(0), make_record(2)]) != base


def test_an_error_while_a_trial_is_written_leaves_no_rows(tmp_path):
    with ResultStore(tmp_path) as store:
        bad = make_record()
        bad.rows.table["number"][:] = 10  # breaks the primary key at the second row
        with pytest.raises(StoreError):
            store.add(bad)
        assert store.load() == ()
        store.add(make_record())


def test_the_store_flushes_every_transaction_to_disk(tmp_path):
    with ResultStore(tmp_path) as store:
        assert store._connection.execute("PRAGMA journal_mode").fetchone() == ("delete",)
        full = 2
        assert store._connection.execute("PRAGMA synchronous").fetchone() == (full,)


def test_a_folder_that_is_a_file_is_refused_and_kept(tmp_path):
    (tmp_path / "out").write_text("mine")
    refuses("out", ResultStore, tmp_path / "out", error=StoreError)
    assert (tmp_path / "out").read_text() == "mine"


@pytest.mark.parametrize("content", [b"my notes", b"SQLite format 3\0" + bytes(200)])
def test_files_that_are_no_database_are_refused_and_kept(tmp_path, content):
    path = tmp_path / "results.sqlite"
    path.write_bytes(content)
    refuses("results.sqlite", ResultStore, tmp_path, error=StoreError)
    assert path.read_bytes() == content


def test_databases_of_other_programs_are_refused_and_kept(tmp_path):
    path = tmp_path / "results.sqlite"
    execute(path, "CREATE TABLE trials (recipe TEXT)")
    content = path.read_bytes()
    refuses("results.sqlite", ResultStore, tmp_path, error=StoreError)
    assert path.read_bytes() == content
    assert os.listdir(tmp_path) == ["results.sqlite"]


def test_other_versions_of_the_schema_are_refused(tmp_path):
    path, _ = filled(tmp_path, 1)
    for version in (99, 1):
        execute(path, f"PRAGMA user_version = {version}")
        with pytest.raises(StoreError, match=rf"version {version}\b"):
            ResultStore(tmp_path)


def test_a_database_without_a_schema_is_used(tmp_path):
    path = tmp_path / "results.sqlite"
    execute(path, "VACUUM")
    assert path.stat().st_size > 0
    assert filled(tmp_path, 1)


def test_a_killed_run_of_trials_resumes_to_the_same_rows(tmp_path, run):
    child = subprocess.Popen(
        [sys.executable, fake_trial.__file__, str(tmp_path / "killed")],
        stdout=subprocess.PIPE,
        text=True,
        env=environment(),
    )
    for _ in range(3):
        assert child.stdout.readline() == "stored\n"
    child.send_signal(signal.SIGKILL)
    child.wait()
    child.stdout.close()
    plan = fake_trial.make_plan(6, 100)
    outcome, resumed = run(tmp_path / "killed", plan)
    assert outcome.n_reused >= 3
    assert outcome.n_reused + outcome.n_run == len(plan)
    assert resumed == run(tmp_path / "whole", plan)[1]


def test_a_database_killed_in_its_first_transaction_is_created_again(tmp_path):
    path = tmp_path / "results.sqlite"
    assert hot_journal(path).stat().st_size > 0, "a journal that has to be rolled back"
    assert path.stat().st_size > 0
    with ResultStore(tmp_path) as store:
        store.add(make_record())
        assert len(store.keys()) == 1


def test_a_stored_measurement_is_not_replaced(tmp_path):
    with ResultStore(tmp_path) as store:
        for value in (1.5, 2.5):
            store.put("cost", "b", {"value": value})
        store.put("cost", "a", {"value": [1, None]})
        store.put("other", "a", {})
        assert list(store.measurements("cost").items()) == [
            ("a", {"value": [1, None]}), ("b", {"value": 1.5}),
        ]  # fmt: skip
