"""Malicious and damaged files: readers refuse them by name, and leave all other files alone."""

import os
import sqlite3
import stat
import struct
import zlib
from dataclasses import replace

import numpy as np
import pytest

from made_records import hash_of, hot_journal, make_record
from processes import python
from refusals import refuses
from sdnn.agents import load_agent
from sdnn.runs import EnvironmentSpec, ResultStore, Run, RunSpec, StoreError, TrialRows
from sdnn.runs.curves import curves_of, write_curves
from sdnn.runs.errors import RunError
from sdnn.runs.run import tensorboard_in
from sdnn.runs.store import STORE_NAME
from sdnn.support.files import write_file, write_whole

RUN = RunSpec(
    environment=EnvironmentSpec(id="Pendulum-v1"),
    agent="sdnn-c",
    approximator={"n_pattern_units": 12, "n_hidden_units": 24, "n_active_units": 8},
    budget={"steps": 20},
    protocol={"evaluate_every": 10, "evaluation_episodes": 1},
)

ROWS_IN_PROGRESS = [
    {"kind": "episode", "step": 3 * n, "episode": n, "return": -1.5, "length": 3,
     "terminated": True}
    for n in range(40)
]  # fmt: skip


KEY_IN_PROGRESS = make_record(7).key


def make_store(folder):
    """Make a store of 4 trials, a training in progress and a measurement; return its path."""
    with ResultStore(folder) as store:
        for trial in range(4):
            store.add(make_record(trial, steps=range(1, 40)))
        rows = TrialRows.from_training(ROWS_IN_PROGRESS)
        store.extend(KEY_IN_PROGRESS, rows, 0, config="{}", version="0.1")
        store.put("cost", "a", {"value": [1, None]})
        return store.path


def content_of(folder, **options):
    """Return all that can be read from a store."""
    with ResultStore(folder, **options) as store:
        records = store.load()
        return (
            [replace(record, rows=None) for record in records],
            [record.rows.table.tolist() for record in records],
            store.rows(KEY_IN_PROGRESS).table.tolist(),
            store.keys(),
            store.seconds(),
            store.measurements("cost"),
        )


def test_a_flipped_bit_of_a_store_is_noticed_or_changes_nothing_that_is_read(tmp_path):
    path = make_store(tmp_path)
    content, expected = path.read_bytes(), content_of(tmp_path)
    rng = np.random.default_rng(5)
    errors = []
    for position in rng.integers(0, len(content), 300):
        flipped = bytearray(content)
        flipped[position] ^= 1 << int(rng.integers(8))
        path.write_bytes(flipped)
        try:
            assert content_of(tmp_path) == expected
        except StoreError as error:
            errors.append(str(error))
    assert len(errors) > 50, "of 300 bits, many of which lie in unused parts of pages"
    assert all(str(path) in error for error in errors)


def test_half_a_store_is_refused_as_damaged(tmp_path):
    path = make_store(tmp_path)
    content = path.read_bytes()
    path.write_bytes(content[: len(content) // 2])
    refuses("damaged", ResultStore, tmp_path, error=StoreError)


def execute_sql(path, *statements):
    """Execute statements as another program would."""
    connection = sqlite3.connect(path)
    connection.executescript(";".join(statements))
    connection.close()


ENDLESS = "WITH RECURSIVE n(x) AS (SELECT 1 UNION ALL SELECT x + 1 FROM n) SELECT"
"""The beginning of a query whose rows never end."""


@pytest.mark.parametrize(
    "statements",
    [
        ("ALTER TABLE measurements RENAME TO old",
         f"CREATE VIEW measurements AS {ENDLESS} 'cost' AS kind, x AS key, x AS content, x FROM n"),
        ("ALTER TABLE rows RENAME TO old",
         f"CREATE VIEW rows AS {ENDLESS} 1 AS run_id, x AS number, 0 AS part FROM n"),
        ("CREATE TRIGGER t AFTER INSERT ON runs BEGIN DELETE FROM runs; END",),
        ("CREATE TRIGGER t INSTEAD OF INSERT ON labelled_rows BEGIN DELETE FROM rows; END",),
        ("CREATE VIRTUAL TABLE more USING fts5(x)",),
        ("CREATE INDEX more ON rows (length)",),
        ("CREATE TABLE more (x)",),
        ("ALTER TABLE runs ADD COLUMN more AS (hex(zeroblob(1000000000)))",),
        ("PRAGMA journal_mode = WAL",),
    ],
)  # fmt: skip
def test_a_store_with_another_schema_is_refused_before_any_query(tmp_path, statements):
    path = make_store(tmp_path)
    execute_sql(path, *statements)
    content = path.read_bytes()
    for read_only in (False, True):
        with pytest.raises(StoreError, match=r"results\.sqlite"):
            ResultStore(tmp_path, read_only=read_only)
    assert path.read_bytes() == content


@pytest.mark.parametrize(
    ("statement", "column"),
    [
        ("UPDATE runs SET seconds = 'long'", "seconds"),
        ("UPDATE runs SET n_decisions = x'00ff'", "n_decisions"),
        ("UPDATE runs SET trial = 1.5 WHERE id = 1", "trial"),
        ("UPDATE runs SET version = x'00'", "version"),
        ("UPDATE runs SET finished_at = x'00'", "finished_at"),
        ("UPDATE runs SET n_decisions = 58", "crc"),  # a possible number, but not the stored 57
        ("UPDATE rows SET length = 'long'", "length"),
        ("UPDATE rows SET \"return\" = x'00'", "return"),
        ("UPDATE rows SET kind = x'00'", "kind"),
        ("UPDATE rows SET step = 0.5", "step"),
        ("UPDATE rows SET length = length + 1", "rows"),
        ("DELETE FROM rows WHERE number = 39", "rows"),  # the last of the training in progress
        ("UPDATE measurements SET content = 5", "measurements"),
        ("UPDATE measurements SET content = x'00'", "content"),
    ],
)
def test_invalid_values_in_a_store_are_refused_with_their_column(tmp_path, statement, column):
    path = make_store(tmp_path)
    execute_sql(path, statement)
    with pytest.raises(StoreError, match=rf"results\.sqlite.*{column}"):
        content_of(tmp_path)


@pytest.mark.parametrize("config", ["", "[]", "nothing", "[" * 100_000, '{"a":' * 100_000])
def test_a_stored_configuration_must_be_a_json_object(tmp_path, config):
    record = make_record(config=config)
    assert record.key.config_hash == hash_of(config), "only the text is wrong"
    with ResultStore(tmp_path) as store:
        store.add(record)
        with pytest.raises(StoreError, match=r"results\.sqlite.*config"):
            store.load()


def test_a_stored_configuration_must_have_its_hash(tmp_path):
    record = make_record()
    with ResultStore(tmp_path) as store:
        store.add(replace(record, key=record.key._replace(config_hash="0" * 16)))
        with pytest.raises(StoreError, match=r"results\.sqlite.*config_hash"):
            store.load()


def test_a_journal_cannot_make_sqlite_remove_another_file(tmp_path):
    path, other_file = make_store(tmp_path), tmp_path / "mine.txt"
    other_file.write_bytes(b"mine")
    journal = hot_journal(path)
    content = journal.read_bytes()
    # SQLite removes the file that a journal names as that of a transaction over several databases.
    # Its record at the end has the number of the page at 1 GiB, the file's name, its length, the
    # sum of its bytes, and the 8 bytes with which a journal begins.
    name = os.fsencode(other_file)
    checksum = sum(struct.unpack(f"{len(name)}b", name)) % 2**32
    page = struct.pack(">I", 2**30 // 4096 + 1)
    record = page + name + struct.pack(">II", len(name), checksum) + content[:8]
    journal.write_bytes(content + record)
    for read_only in (True, False):
        with pytest.raises(StoreError, match="journal"):
            ResultStore(tmp_path, read_only=read_only)
    assert other_file.read_bytes() == b"mine"


def emptying_journal(path):
    """Make the journal of a transaction before which the store was empty: SQLite would empty it."""
    journal = path.with_name(f"{path.name}-journal")
    # SQLite's journal header: its magic number; 0 records, a nonce, 0 pages of the database before
    # the transaction, the bytes of a sector and of a page.
    head = bytes.fromhex("d9d505f920a163d7") + struct.pack(">5I", 0, 1, 0, 512, 4096)
    journal.write_bytes(head.ljust(512, b"\0"))
    return journal


@pytest.mark.parametrize("read_only", [True, False])
def test_a_refused_store_leaves_no_connection_open(tmp_path, monkeypatch, read_only):
    emptying_journal(make_store(tmp_path))
    connections, real_connect = [], sqlite3.connect

    def connect(*arguments, **options):
        connections.append(real_connect(*arguments, **options))
        return connections[-1]

    monkeypatch.setattr(sqlite3, "connect", connect)
    with pytest.raises(StoreError, match="move it away"):
        ResultStore(tmp_path, read_only=read_only)
    assert len(connections) > 0
    for connection in connections:
        with pytest.raises(sqlite3.ProgrammingError, match="closed"):
            connection.execute("SELECT 1")


@pytest.mark.parametrize("read_only", [True, False])
def test_a_journal_that_would_empty_a_store_is_refused(tmp_path, read_only):
    path = make_store(tmp_path)
    content = path.read_bytes()
    emptying_journal(path)
    with pytest.raises(StoreError, match="move it away"):
        ResultStore(tmp_path, read_only=read_only)
    assert path.read_bytes() == content


@pytest.mark.parametrize("read_only", [True, False])
def test_reading_rolls_back_the_transaction_of_a_killed_process(tmp_path, read_only):
    path = make_store(tmp_path)
    expected = content_of(tmp_path)
    journal = hot_journal(path)
    half_written = path.read_bytes()
    assert content_of(tmp_path, read_only=read_only) == expected
    # A read-only store is copied, and the copy is rolled back; the files stay as they are.
    assert journal.exists() == read_only
    assert (path.read_bytes() == half_written) == read_only


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs a system of POSIX")
@pytest.mark.parametrize("end", ["", "-journal", "-wal"])
@pytest.mark.parametrize("target_type", ["link", "pipe", "folder", "dangling"])
def test_a_store_and_its_journals_must_be_regular_files(tmp_path, end, target_type):
    folder, other = tmp_path / "run", tmp_path / "other"
    folder.mkdir()
    other.mkdir()
    target = make_store(other)
    content = target.read_bytes()
    if end:
        make_store(folder)
    path = folder / (STORE_NAME + end)
    if target_type == "pipe":
        os.mkfifo(path)
    elif target_type == "folder":
        path.mkdir()
    else:
        path.symlink_to(target if target_type == "link" else tmp_path / "nothing")
    for read_only in (True, False):
        with pytest.raises(StoreError, match=path.name):
            ResultStore(folder, read_only=read_only)
    assert target.read_bytes() == content
    assert not (tmp_path / "nothing").exists()


def test_a_stored_measurement_must_be_json(tmp_path):
    with ResultStore(tmp_path) as store:
        store.put("cost", "b", {})
        content = "[" * 100_000
        crc = zlib.crc32(repr(("cost", "b", content)).encode())  # the store's checksum of a row
        execute_sql(store.path, f"UPDATE measurements SET content = '{content}', crc = {crc}")
        with pytest.raises(StoreError, match=r"results\.sqlite"):
            store.measurements("cost")


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="needs a system of POSIX")
@pytest.mark.parametrize("target_type", ["link", "pipe", "device"])
def test_files_of_a_run_replace_links_pipes_and_devices_and_keep_their_targets(
    tmp_path, target_type
):
    folder, elsewhere = tmp_path / "run", tmp_path / "elsewhere"
    Run.create(folder, RUN)
    Run.open(folder).train()
    elsewhere.mkdir()
    read_names = ("config.json", "checkpoint.safetensors")
    written_names = ("agent.safetensors", "curves.png", "curves.csv", "results.md")
    for name in read_names:
        (folder / name).rename(elsewhere / name)
    for name in written_names:
        (folder / name).unlink(missing_ok=True)
        (elsewhere / name).write_bytes(b"mine")
    names = read_names + written_names
    for name in names:
        if target_type == "pipe":
            os.mkfifo(folder / name)
        else:
            target = elsewhere / name if target_type == "link" else "/dev/null"
            (folder / name).symlink_to(target)
    contents = {name: (elsewhere / name).read_bytes() for name in names}
    if target_type != "link":  # a run is read from regular files, or links to them, only
        for name in read_names:
            with pytest.raises((OSError, RunError), match=name):
                Run.open(folder).train(steps=30)
            (folder / name).unlink()
            (folder / name).write_bytes(contents[name])
    run = Run.open(folder)
    run.train(steps=30)
    write_curves(curves_of([run])[0], folder / "curves.png")
    write_whole(folder / "results.md", b"new")
    for name in names:
        assert (elsewhere / name).read_bytes() == contents[name], name
        assert stat.S_ISREG((folder / name).lstat().st_mode), name
    load_agent(folder / "agent.safetensors")


@pytest.mark.parametrize("name", [".lock", "tensorboard", STORE_NAME])
def test_links_at_names_that_are_written_in_place_are_refused(tmp_path, name):
    folder, other = tmp_path / "run", tmp_path / "other"
    run = Run.create(folder, RUN)
    other.mkdir()
    path = folder / name
    path.unlink(missing_ok=True)
    if name == "tensorboard":
        path.symlink_to(other)
        with pytest.raises(RunError, match=name):
            tensorboard_in(folder)
    else:
        path.symlink_to(other / "made")
        with pytest.raises((OSError, RunError), match=name):
            run.train()
    assert list(other.iterdir()) == []


READ_WHILE_TRUNCATED = """
import sys
from pathlib import Path
from sdnn.support import files

path, real = Path(sys.argv[1]), files.os.fstat

def truncated(descriptor):
    status = real(descriptor)
    with open(path, "r+b") as file:  # as another process, after the size was asked for
        file.truncate(status.st_size // 2)
    return status

files.os.fstat = truncated
try:
    files.read_file(path, "agent")
except ValueError as error:
    print(error)
"""


def test_a_file_truncated_while_it_is_read_is_reported_as_damaged(tmp_path):
    path = tmp_path / "file"
    write_file(path, "agent", {"a": np.zeros(2**20)}, {})
    process = python("-c", READ_WHILE_TRUNCATED, path)
    assert process.returncode == 0, process.stderr
    assert f"{path} is damaged" in process.stdout
