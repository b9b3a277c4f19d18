"""Reported trials are run again: what is equal, what was changed, and what may not run."""

import json
import shutil
import signal
import socket
import sys
from dataclasses import replace
from pathlib import Path

import gymnasium as gym
import pytest

from made_records import execute
from refusals import refuses
from sdnn.reproduction import plan_trials
from sdnn.reproduction.cases import PAPER_CASES
from sdnn.reproduction.reference import differences_from_paper
from sdnn.runs import ConfigError, ResultStore, RunError, StoreError, run_trials
from sdnn.runs.certificates import CertifiedReports, certify, write_certificate
from sdnn.runs.engine import Finished, ThreadExecutor
from sdnn.runs.reported import Consent, ReportedTrial, StoredReports
from sdnn.runs.trial import TrialRows, canonical_json, config_hash, records_digest
from sdnn.runs.verification import choose_trials, row_words, verify

TRUSTED = Consent(("drifting_env",))
SMALL = (
    "--agent", "sdnn-c", "--set", "approximator.n_hidden_units=60",
    "--set", "approximator.n_active_units=20", "--set", "approximator.n_pattern_units=20",
    "--set", "agent.warm_up_steps=60", "--evaluate-every", 70, "--evaluation-episodes", 2,
)  # fmt: skip


@pytest.fixture(scope="module")
def real_records(tmp_path_factory):
    """Two short trials in C++ of each of the two agents of the case s4."""
    plan = plan_trials([PAPER_CASES["s4"]], n_trials=2, root_seed=0, n_episodes=30)
    with ResultStore(tmp_path_factory.mktemp("real")) as store:
        run_trials(plan, store)
        return store.load()


@pytest.fixture
def fake_store(run, tmp_path):
    """A folder with six fake trials, of two cases."""
    folder = tmp_path / "results"
    run(folder)
    return folder


def stored(folder, records):
    """Store records in a folder, and return it."""
    with ResultStore(folder) as store:
        for record in records:
            store.add(record)
    return folder


def with_value(record, column, row, value):
    """Return the record with another value in a row; its checksum fits, as it is made of rows."""
    table = record.rows.table.copy()
    table[column][row] = value
    return replace(record, rows=TrialRows(table))


def with_config(record, change):
    """Return the record with a changed configuration whose hash is right."""
    values = json.loads(record.config)
    change(values)
    text = canonical_json(values)
    return replace(record, config=text, key=record.key._replace(config_hash=config_hash(text)))


def verify_folder(folder, consent=None, **options):
    """Verify the stored trials of a folder, by default without code of other modules."""
    consent = consent or Consent()
    return verify(StoredReports(folder, consent), consent=consent, **options)


def only_difference(verification):
    """Return the trial that differs, which must be the only one."""
    (difference,) = verification.differences
    assert not verification.is_equal
    return difference


def test_equal_trials_are_counted_and_the_folder_stays_as_it_is(fake_store):
    before = {path: path.read_bytes() for path in fake_store.iterdir()}
    verification = verify_folder(fake_store, n_trials=4)
    assert verification.is_equal
    assert len(verification.equal) == 4
    assert str(verification).startswith("4 of 6 trials recomputed here on ")
    assert {path: path.read_bytes() for path in fake_store.iterdir()} == before
    assert len(verify_folder(fake_store, n_trials=None).equal) == 6


def test_trials_are_drawn_evenly_over_cases_and_the_same_by_a_seed(fake_store):
    keys = StoredReports(fake_store, Consent()).keys
    drawn = choose_trials(keys, 2, seed=1)
    assert {key.case_id for key in drawn} == {"s4", "s6"}
    assert choose_trials(keys, 2, seed=1) == drawn
    assert len({tuple(choose_trials(keys, 2, seed=seed)) for seed in range(20)}) > 1
    assert {key.case_id for key in choose_trials(keys, None, cases=["s6"])} == {"s6"}
    assert choose_trials(keys, None) == keys
    refuses("s9", choose_trials, keys, 1, cases=["s9"], error=ConfigError)


@pytest.mark.parametrize("n_trials", [None, 1])
def test_a_changed_byte_of_a_row_is_found_in_any_trial(fake_store, n_trials):
    # Rows of a trial have the numbers 0 to 29.
    change = "UPDATE rows SET length = 49 WHERE run_id = 3 AND number = 4"
    execute(fake_store / "results.sqlite", change)
    for seed in range(4):  # whether or not the trial is drawn
        verification = verify_folder(fake_store, n_trials=n_trials, seed=seed)
        difference = only_difference(verification)
        assert "row 5 of 30" in difference.problem
        assert "checksum" in difference.problem
        assert "length 49" in difference.details[0]
        assert "length 49" not in difference.details[1]


def test_a_changed_row_with_a_right_checksum_is_found_by_running_the_trial(tmp_path, real_records):
    row = real_records[1].rows.table[2]
    changed = with_value(real_records[1], "return", 2, row["return"] + 1e-9)
    stored(tmp_path / "out", [real_records[0], changed, *real_records[2:]])
    verification = verify_folder(tmp_path / "out")
    difference = only_difference(verification)
    assert difference.key == changed.key
    assert "row 3 of 3" in difference.problem
    assert difference.details[:2] == (
        f"reported: {row_words(changed.rows.table[2])}",
        f"here:     {row_words(row)}",
    )
    assert "3 equal" in str(verification)


def test_missing_rows_and_wrong_counts_of_decisions_are_found(tmp_path, real_records):
    record = real_records[0]
    shorter = replace(record, rows=TrialRows(record.rows.table[:-1]))
    problem = only_difference(verify_folder(stored(tmp_path / "shorter", [shorter]))).problem
    assert f"{len(record.rows.table)} rows" in problem, "of the trial that is run here"
    miscounted = replace(record, n_decisions=record.n_decisions + 1)
    problem = only_difference(verify_folder(stored(tmp_path / "more", [miscounted]))).problem
    assert f"{miscounted.n_decisions}" in problem


def test_a_changed_setting_gives_other_rows(tmp_path, real_records):
    changed = with_config(real_records[2], lambda v: v["learning"].update(discount=0.5))
    difference = only_difference(verify_folder(stored(tmp_path / "out", [changed])))
    assert difference.was_run
    assert f"configuration: {changed.key.config_hash}" in "\n".join(difference.details)


def test_a_setting_that_does_not_fit_its_hash_is_found(tmp_path, real_records):
    folder = stored(tmp_path / "out", real_records)
    change = "UPDATE runs SET config = replace(config, '0.9', '0.8') WHERE id = 2"  # the discount
    execute(folder / "results.sqlite", change)
    error = refuses("runs", verify_folder, folder, error=StoreError)
    assert "id 2" in str(error)


@pytest.mark.parametrize(
    ("change", "name"),
    [
        (lambda v: v["learning"].update(unknown=1), "learning.unknown"),
        (lambda v: v["agent"].update(name="rbf"), "agent.name"),
        (lambda v: v["agent"].update(version="2"), "agent.version"),
        (lambda v: v["budget"].update(episodes=10**9), "budget.episodes"),
        (lambda v: v["protocol"].update(evaluation_episodes=10**9), "protocol.evaluation_episodes"),
        (lambda v: v["approximator"].update(max_table_bytes=2**40), "approximator.max_table_bytes"),
        (lambda v: v["environment"].pop("redundant"), "environment.redundant"),
        (lambda v: v.pop("environment"), "environment.id"),
        (lambda v: v.update(agent=3), "agent"),
    ],
)
def test_foreign_configurations_are_named_and_not_run(tmp_path, real_records, change, name):
    record = next(r for r in real_records if r.key.agent == "fuzzy")
    if "table_bytes" in name:
        record = next(r for r in real_records if r.key.agent == "sdnn-c")
    verification = verify_folder(stored(tmp_path / "out", [with_config(record, change)]))
    difference = only_difference(verification)
    assert f": {name}: " in difference.problem
    assert not difference.was_run
    assert str(verification).startswith("0 of 1 trial ")


def test_unknown_agents_are_named(tmp_path, real_records):
    record = with_config(real_records[0], lambda v: v["agent"].update(name="mine"))
    record = replace(record, key=record.key._replace(agent="mine"))
    assert "mine" in only_difference(verify_folder(stored(tmp_path / "out", [record]))).problem


def test_rows_of_a_paper_case_with_another_configuration_are_named(tmp_path, invoke, real_records):
    foreign = with_config(
        real_records[0], lambda v: v["environment"]["kwargs"]["sensors"].update(n_sensors=6)
    )
    trial = ReportedTrial.of_record(foreign)
    name = "environment.kwargs.sensors.n_sensors"
    assert differences_from_paper(trial) == {name: ("6", "4")}  # here, and in the paper
    assert differences_from_paper(ReportedTrial.of_record(real_records[0])) == {}
    plan = plan_trials([PAPER_CASES["s6"]], n_trials=1, root_seed=0, n_episodes=30)
    with ResultStore(tmp_path / "mine") as store:
        run_trials([planned for planned in plan if planned.key.agent == "sdnn-c"], store)
        (record,) = store.load()
    renamed = replace(record, key=record.key._replace(case_id="s4"))
    result = invoke("verify", stored(tmp_path / "renamed", [renamed]))
    assert result.exit_code == 0
    assert name in result.stderr


MARKED = """
import gymnasium as gym, pathlib
from drifting_env import DriftingEnv
pathlib.Path(__file__).with_suffix(".imported").touch()
gym.register("mine/Env-v0", entry_point=DriftingEnv, max_episode_steps=40)
"""


@pytest.fixture
def own_module(tmp_path, monkeypatch):
    """Write my_envs.py, a module that leaves a file when it is imported; return the file's path."""
    monkeypatch.setattr(sys, "path", [*sys.path])
    (tmp_path / "my_envs.py").write_text(MARKED)
    yield tmp_path / "my_envs.imported"
    sys.modules.pop("my_envs", None)


def test_modules_are_imported_with_consent_only(invoke, output_of, own_module):
    output_of("train", "my_envs:mine/Env-v0", "--steps", 100, *SMALL, "--out", "run")
    own_module.unlink()
    del sys.modules["my_envs"]
    assert invoke("verify", "run", "--case", "nowhere").exit_code == 2
    result = invoke("verify", "run")
    assert (result.exit_code, result.stdout) == (2, "")
    assert "--import my_envs" in result.stderr
    assert not own_module.exists()
    del gym.registry["mine/Env-v0"]
    # Once the environment is registered, its id without a module needs consent, too.
    output_of("verify", "run", "--import", "my_envs")
    assert own_module.exists()
    refuses("my_envs", Consent().require, "my_envs:mine/Env-v0", error=RunError)
    refuses("drifting_env", Consent().require, "mine/Env-v0", error=RunError)
    for module in ("sdnn.__main__", "gymnasium.utils.play", "antigravity"):
        refuses(module, Consent().require, f"{module}:x/Y-v0", error=RunError)
    Consent().require("CartPole-v1")
    Consent().require("sdnn.environments:sdnn/AcrobotSwingUp-v0")
    Consent().require("sdnn/PaperAcrobot-v0")


def test_a_store_with_environments_of_modules_runs_the_others(tmp_path, invoke, real_records):
    record = with_config(
        real_records[0], lambda v: v["environment"].update(id="no_such_module:x/Y-v0", kwargs={})
    )
    folder = stored(tmp_path / "out", [record, *real_records])
    result = invoke("verify", folder)
    assert result.exit_code == 1
    assert "--import no_such_module" in result.stdout
    assert result.stdout.splitlines()[-1].startswith("4 of 5 trials recomputed here on ")
    assert "no_such_module" not in sys.modules
    result = invoke("verify", folder, "--import", "no_such_module")
    assert (result.exit_code, result.stdout) == (1, "")


def test_runs_are_repeated_with_the_goals_that_were_set_later(invoke, output_of):
    options = ("--steps", 150, *SMALL, "--seed", 3)
    train = ("train", "drifting_env:tests/Drifting-v0", *options)
    verified = ("verify", "--import", "drifting_env")
    for name, more in (("one", ()), ("several", ("--n-envs", 3))):  # environments
        output_of(*train, *more, "--out", name)
        output_of(*verified, name)
        output_of("resume", name, "--steps", 250)
        output_of("resume", name, "--episodes", 12)
        output_of(*verified, name, "--certificate", f"{name}.json")
        assert "all digests equal" in output_of(*verified, f"{name}.json")
    certificate = json.loads(Path("one.json").read_text())
    certificate["trials"][0]["goals"][-1]["episodes"] = 10**6
    Path("long.json").write_text(json.dumps(certificate))
    result = invoke(*verified, "long.json")
    assert (result.exit_code, "goals" in result.stdout) == (1, True)
    values = json.loads(output_of(*verified, "one", "--json"))
    assert (values["n_reported"], len(values["equal"]), values["differences"]) == (1, 1, [])
    with ResultStore("one", read_only=True) as store:
        assert values["digest"] == records_digest(store.load())


def test_an_edited_configuration_of_a_run_is_named(invoke, output_of, tmp_path):
    output_of("train", "CartPole-v1", "--steps", 150, *SMALL, "--out", "run")
    path = tmp_path / "run" / "config.json"
    values = json.loads(path.read_text())
    path.write_text(json.dumps(values | {"learning": {"discount": 0.5}}))
    result = invoke("verify", "run")
    assert result.exit_code == 1
    assert "learning.discount is 0.5" in result.stdout


def test_environments_that_do_not_repeat_themselves_are_named(invoke, output_of):
    task = "drifting_env:tests/Restless-v0"
    output_of("train", task, "--steps", 150, *SMALL, "--out", "run")
    result = invoke("verify", "run", "--import", "drifting_env")
    assert result.exit_code == 1
    assert "does not repeat itself" in result.stdout


def test_a_trial_that_fails_here_is_named(output_of):
    task = "drifting_env:tests/Broken-v0"
    train = ("train", task, "--steps", 150, *SMALL, "--env-arg", "bad_step=10000", "--out", "run")
    output_of(*train)
    with ResultStore("run") as store:
        (record,) = store.load()
    broken = with_config(record, lambda v: v["environment"]["kwargs"].update(bad_step=50))
    difference = only_difference(verify_folder(stored(Path("out"), [broken]), TRUSTED))
    assert "fails here" in difference.problem
    assert not difference.was_run


def test_folders_without_finished_trials_are_refused(tmp_path, invoke, refused):
    (tmp_path / "empty").mkdir()
    assert "results.sqlite" in refused("verify", "empty", code=1)
    with ResultStore(tmp_path / "none"):
        pass
    assert "none" in refused("verify", "none", code=1)


def test_files_of_a_folder_are_refused_with_its_name(tmp_path, refused, real_records):
    folder = stored(tmp_path, real_records)
    for name in ("results.sqlite", "config.json"):
        (folder / name).touch()
        assert f"give {folder}" in refused("verify", folder / name, code=2)
    other = tmp_path / "other" / "rows.txt"
    other.parent.mkdir()
    other.touch()
    assert "must be a folder, or a file .json or .csv" in refused("verify", other, code=2)


def test_trials_of_too_many_decisions_are_not_run(tmp_path, real_records):
    record = replace(real_records[0], n_decisions=10**12)  # trials of up to 10**9 are run
    difference = only_difference(verify_folder(stored(tmp_path / "out", [record])))
    assert "budget.episodes" in difference.problem
    assert not difference.was_run


def test_unfinished_runs_are_left_out(tmp_path, real_records):
    record = real_records[0]
    rows = record.rows
    with ResultStore(tmp_path / "out") as store:
        metadata = {"config": record.config, "version": record.version}
        store.extend(record.key, TrialRows(rows.table[:1]), 0, **metadata)
    error = refuses("1", verify_folder, tmp_path / "out", error=RunError)  # the number of them
    assert "unfinished" in str(error)
    stored(tmp_path / "out", real_records[1:])
    verification = verify_folder(tmp_path / "out")
    assert (verification.n_unfinished, len(verification.equal)) == (1, 3)


class OneByOne(ThreadExecutor):
    """Executor that begins a trial after the one before was observed, so that counts are fixed."""

    def run(self, planned, stop):
        for trial in planned:
            if not stop.is_set():
                yield from super().run([trial], stop)


def test_an_interrupt_ends_with_what_is_done(fake_store):
    def interrupt(message):
        if isinstance(message, Finished):
            signal.raise_signal(signal.SIGINT)

    verification = verify_folder(
        fake_store, n_trials=None, executor=OneByOne(1), observer=interrupt
    )
    assert verification.signal == signal.SIGINT
    assert not verification.is_equal
    assert len(verification.equal) == 1


@pytest.fixture
def certificate(tmp_path, real_records):
    """A certificate of four trials, as values and as a file."""
    verification = verify_folder(stored(tmp_path / "certified", real_records))
    path = tmp_path / "certificate.json"
    write_certificate(certify(verification.equal), path)
    return json.loads(path.read_text()), path


def test_a_certificate_can_be_verified_and_names_no_computer(certificate):
    values, path = certificate
    verification = verify(CertifiedReports(path))
    assert (verification.is_equal, verification.has_rows) == (True, False)
    assert len(verification.equal) == len(values["trials"]) == 4  # two trials of two agents
    assert socket.gethostname() not in path.read_text()
    assert set(values) == {
        "format", "version", "packages", "instruction_set", "platform", "configurations", "trials"
    }  # fmt: skip


def test_a_changed_digest_of_a_certificate_is_shown_beside_that_here(certificate):
    values, path = certificate
    digest = values["trials"][2]["digest"]
    values["trials"][2]["digest"] = f"{int(digest[0], 16) ^ 1:x}{digest[1:]}"  # one bit flipped
    values |= {"instruction_set": "elsewhere"}
    path.write_text(json.dumps(values))
    difference = only_difference(verify(CertifiedReports(path)))
    assert values["trials"][2]["digest"][:16] in difference.details[0]
    assert digest[:16] in difference.details[1]
    assert "elsewhere" in "\n".join(difference.details)


@pytest.mark.parametrize(
    ("change", "name"),
    [
        (lambda v: v["trials"][0].update(seed=-1), "seed"),
        (lambda v: v["trials"][0].update(digest="0" * 63), "digest"),
        (lambda v: v["trials"][0].update(more=1), "more"),
        (lambda v: v["trials"].append(v["trials"][0]), "trials"),
        (lambda v: v["trials"][0].update(config_hash="0" * 16), "configurations"),
        (lambda v: next(iter(v["configurations"].values()))["learning"].update(discount=0.5),
         "configurations"),
        (lambda v: v.update(format="sdnn-certificate-9"), "format"),
        (lambda v: v["trials"][0].update(goals=[{"at_step": 3}]), "steps"),
    ],
)  # fmt: skip
def test_certificates_that_cannot_be_right_are_refused(certificate, change, name):
    values, path = certificate
    change(values)
    path.write_text(json.dumps(values))
    error = refuses(path.name, CertifiedReports, path, error=RunError)
    assert name in str(error)


@pytest.mark.parametrize("content", [b"", b"[" * 10**6, b"\xff", b"{}", b"null"])
def test_files_that_are_no_certificates_are_refused(tmp_path, content):
    path = tmp_path / "other.json"
    path.write_bytes(content)
    refuses("other.json", CertifiedReports, path, error=RunError)


def test_no_certificate_is_written_of_trials_that_differ(invoke, tmp_path, real_records):
    changed = with_value(real_records[0], "length", 0, 7)
    folder = stored(tmp_path / "out", [changed])
    result = invoke("verify", folder, "--certificate", "made.json")
    assert result.exit_code == 1
    assert not (tmp_path / "made.json").exists()
    assert invoke("verify", folder, "--certificate", "made.txt").exit_code == 2


def test_a_certificate_without_a_folder_is_refused_before_trials_are_run(
    invoke, tmp_path, real_records
):
    folder = stored(tmp_path / "out", [real_records[0]])
    result = invoke("verify", folder, "--certificate", "missing/made.json")
    assert result.exit_code == 2
    assert "--certificate must be in a folder that exists" in result.output
    assert "recomputed" not in result.output


def test_verifying_leaves_a_run_as_it_is(output_of, tmp_path):
    output_of("train", "CartPole-v1", "--steps", 150, *SMALL, "--out", "run")
    folder = tmp_path / "run"
    shutil.copytree(folder, tmp_path / "before")
    output_of("verify", "run")
    names = sorted(path.name for path in folder.iterdir())
    assert names == sorted(path.name for path in (tmp_path / "before").iterdir())
    for name in names:
        assert (folder / name).read_bytes() == (tmp_path / "before" / name).read_bytes()
