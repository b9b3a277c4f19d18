"""The SQLite file that holds the rows of all runs, and measurements.

Finished trials and measurements are stored in one transaction each, and so are the rows of a run in
progress with every checkpoint. The file survives a kill at any instant (SQLite's rollback journal,
full synchronization). Runs under different settings live side by side under different keys.
"""

from __future__ import annotations

import json
import sqlite3
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing, contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from sdnn.runs.errors import StoreError
from sdnn.runs.trial import ROW, TrialKey, TrialRecord, TrialRows, TrialTime

STORE_NAME = "results.sqlite"
SCHEMA_VERSION = 5
APPLICATION_ID = int.from_bytes(b"sdnn", "big")
"""Marks a SQLite file as ours (SQLite's header field of that name)."""
BUSY_SECONDS = 60.0
"""How long to wait for another process that writes the same file."""

_SCHEMA = """
CREATE TABLE runs (
  id INTEGER PRIMARY KEY,
  case_id TEXT NOT NULL, agent TEXT NOT NULL, trial INTEGER NOT NULL, seed INTEGER NOT NULL,
  config_hash TEXT NOT NULL, config TEXT NOT NULL, version TEXT NOT NULL,
  n_decisions INTEGER NOT NULL, seconds REAL NOT NULL,
  finished_at TEXT, checksum TEXT, -- NULL while it is in progress
  UNIQUE (case_id, agent, trial, seed, config_hash)
);
CREATE TABLE rows (
  run_id INTEGER NOT NULL REFERENCES runs (id),
  number INTEGER NOT NULL, part INTEGER NOT NULL, kind TEXT NOT NULL, episode INTEGER NOT NULL,
  step INTEGER, length INTEGER NOT NULL, "return" REAL NOT NULL, terminated INTEGER NOT NULL,
  environment INTEGER,
  PRIMARY KEY (run_id, number, part)
) WITHOUT ROWID;
CREATE VIEW labelled_rows AS
  SELECT case_id, agent, trial, seed, config_hash, version, kind, episode, part, step, length,
         "return", terminated, environment
  FROM rows JOIN runs ON runs.id = rows.run_id;
CREATE TABLE measurements (
  kind TEXT NOT NULL, key TEXT NOT NULL, content TEXT NOT NULL,
  PRIMARY KEY (kind, key)
) WITHOUT ROWID;
"""

_KEY = "case_id = ? AND agent = ? AND trial = ? AND seed = ? AND config_hash = ?"
_KEY_COLUMNS = "case_id, agent, trial, seed, config_hash"
_ROW_COLUMNS = (
    'number, part, kind, episode, ifnull(step, -1), length, "return", terminated,'
    " ifnull(environment, -1)"
)


class ResultStore:
    """The result file of a folder, made if it is not there; with ``read_only``, nothing is made.

    Raises
    ------
    StoreError
        If the folder is a file, or the file in it is damaged, of another program or of another
        version of this one's schema. Such a file is left as it is.
    """

    def __init__(self, folder: str | Path, *, read_only: bool = False) -> None:
        folder = Path(folder)
        self.path = folder / STORE_NAME
        if folder.exists() and not folder.is_dir():
            raise StoreError(f"the output must be a folder, but {folder} is a file")
        with _as_store_error(self.path):
            if not read_only:
                folder.mkdir(parents=True, exist_ok=True)
            is_new = _inspect(self.path)
            if read_only and not is_new:
                self._connection = _connect_to_read(self.path)
                return
            place = ":memory:" if read_only else self.path
            self._connection = sqlite3.connect(place, timeout=BUSY_SECONDS)
            try:
                self._prepare(is_new)
            except BaseException:
                self._connection.close()
                raise

    def _prepare(self, is_new: bool) -> None:
        connection = self._connection
        connection.execute("PRAGMA journal_mode = DELETE")
        connection.execute("PRAGMA synchronous = FULL")
        connection.execute("PRAGMA foreign_keys = ON")
        if is_new:
            # One transaction: a killed process leaves an empty file or a whole schema.
            try:
                connection.executescript(
                    f"BEGIN IMMEDIATE; {_SCHEMA} PRAGMA application_id = {APPLICATION_ID};"
                    f"PRAGMA user_version = {SCHEMA_VERSION}; COMMIT;"
                )
            except sqlite3.OperationalError:
                connection.rollback()
                if _inspect(self.path):  # else another process has just made it
                    raise

    def __enter__(self) -> ResultStore:
        return self

    def __exit__(self, *_error: object) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    def add(self, record: TrialRecord, *, is_exact: bool = True) -> None:
        """Store a finished trial, or finish a run in progress, as a whole or not at all.

        Storing the same trial again (another process was quicker) changes nothing. With
        ``is_exact``, as for compiled trials, it must have the same rows each time.

        Raises
        ------
        StoreError
            If the file cannot be written, or holds other rows of an exact trial.
        """
        rows = record.rows
        with self._writing() as connection:
            known = self._find(record.key, "id, checksum")
            if known is not None and known[1] is not None:
                if is_exact and known[1] != rows.checksum():
                    raise StoreError(
                        f"{self.path} already holds other rows for {record.key}:"
                        " the same trial gave two results"
                    )
                return
            run_id = self._run_id(record.key, record.config, record.version)
            self._insert(run_id, rows)
            whole = rows if known is None else self._rows(run_id)
            connection.execute(
                "UPDATE runs SET version = ?, n_decisions = ?, seconds = seconds + ?,"
                " finished_at = ?, checksum = ? WHERE id = ?",
                (record.version, record.n_decisions, record.seconds, record.finished_at,
                 whole.checksum(), run_id),
            )  # fmt: skip

    def extend(
        self, key: TrialKey, rows: TrialRows, first: int, *, config: str, version: str,
        seconds: float = 0.0,
    ) -> None:  # fmt: skip
        """Store rows of a run in progress; they replace those from the number `first` on.

        ``seconds`` is the processor time since rows were stored last. A finished run is in progress
        again.
        """
        with self._writing() as connection:
            run_id = self._run_id(key, config, version)
            connection.execute(
                "UPDATE runs SET finished_at = NULL, checksum = NULL, seconds = seconds + ?"
                " WHERE id = ?", (seconds, run_id),
            )  # fmt: skip
            connection.execute("DELETE FROM rows WHERE run_id = ? AND number >= ?", (run_id, first))
            self._insert(run_id, rows)

    def rows(self, key: TrialKey) -> TrialRows:
        """Return the rows of a run, finished or in progress; none if it is not stored."""
        with _as_store_error(self.path):
            found = self._find(key, "id")
            return TrialRows(np.zeros(0, ROW)) if found is None else self._rows(found[0])

    def keys(self, *, unfinished: bool = False) -> set[TrialKey]:
        """Return the keys of all finished trials, and if wanted of those in progress."""
        with _as_store_error(self.path):
            found = self._connection.execute(
                f"SELECT {_KEY_COLUMNS} FROM runs WHERE ? OR checksum IS NOT NULL", (unfinished,)
            )
            return {_key_of(row) for row in found}

    def times(self) -> tuple[TrialTime, ...]:
        """Return how long the finished trials took, without reading their rows."""
        with _as_store_error(self.path):
            found = self._connection.execute(
                f"SELECT {_KEY_COLUMNS}, seconds, n_decisions,"
                " (SELECT max(episode) FROM rows WHERE run_id = runs.id)"
                " FROM runs WHERE checksum IS NOT NULL ORDER BY id"
            ).fetchall()
        return tuple(
            TrialTime(key=_key_of(row), seconds=row[5], n_decisions=row[6], n_episodes=row[7] or 0)
            for row in found
        )

    def load(self, keys: Iterable[TrialKey] | None = None) -> tuple[TrialRecord, ...]:
        """Return the finished trials of the given keys (default: all), sorted by key.

        Keys that are not stored are left out.

        Raises
        ------
        StoreError
            If the rows of a trial are not the ones that were stored.
        """
        wanted = sorted(self.keys() if keys is None else self.keys() & set(keys))
        with _as_store_error(self.path):
            return tuple(self._load_one(key) for key in wanted)

    def _load_one(self, key: TrialKey) -> TrialRecord:
        names = ("config", "version", "n_decisions", "seconds", "finished_at")
        run_id, checksum, *values = self._find(key, ", ".join(("id", "checksum", *names)))
        rows = self._rows(run_id)
        if rows.checksum() != checksum:
            raise StoreError(f"{self.path} is damaged: the rows of {key} have changed")
        return TrialRecord(key=key, rows=rows, **dict(zip(names, values, strict=True)))

    @contextmanager
    def _writing(self) -> Iterator[sqlite3.Connection]:
        with _as_store_error(self.path), self._connection as connection:
            connection.execute("BEGIN IMMEDIATE")
            yield connection

    def _find(self, key: TrialKey, columns: str) -> Any:
        return self._connection.execute(
            f"SELECT {columns} FROM runs WHERE {_KEY}", _stored(key)
        ).fetchone()

    def _run_id(self, key: TrialKey, config: str, version: str) -> int:
        """Return the id of a run, which is begun if it is not there."""
        self._connection.execute(
            f"INSERT OR IGNORE INTO runs ({_KEY_COLUMNS}, config, version, n_decisions, seconds)"
            " VALUES (?, ?, ?, ?, ?, ?, ?, 0, 0.0)",
            (*_stored(key), config, version),
        )
        run_id: int = self._find(key, "id")[0]
        return run_id

    def _insert(self, run_id: int, rows: TrialRows) -> None:
        self._connection.executemany(
            "INSERT INTO rows VALUES (?, ?, ?, ?, ?, nullif(?, -1), ?, ?, ?, nullif(?, -1))",
            ((run_id, *row) for row in rows.table.tolist()),
        )

    def _rows(self, run_id: int) -> TrialRows:
        found = self._connection.execute(
            f"SELECT {_ROW_COLUMNS} FROM rows WHERE run_id = ? ORDER BY number, part", (run_id,)
        ).fetchall()
        return TrialRows(np.array(found, ROW))

    def put(self, kind: str, key: str, content: Mapping[str, Any]) -> None:
        """Store a measurement as JSON; one that another process stored first stays."""
        with self._writing() as connection:
            connection.execute(
                "INSERT OR IGNORE INTO measurements VALUES (?, ?, ?)",
                (kind, key, json.dumps(content)),
            )

    def measurements(self, kind: str) -> dict[str, Any]:
        """Return the contents of all measurements of a kind, by their keys, which are sorted."""
        with _as_store_error(self.path):
            found = self._connection.execute(
                "SELECT key, content FROM measurements WHERE kind = ? ORDER BY key", (kind,)
            )
            return {key: json.loads(content) for key, content in found}


def _stored(key: TrialKey) -> TrialKey:
    """Return a key as it is stored: SQLite's integers have a sign."""
    return key._replace(seed=key.seed - 2**64 if key.seed >= 2**63 else key.seed)


def _key_of(row: tuple[Any, ...]) -> TrialKey:
    key = TrialKey(*row[:5])
    return key._replace(seed=key.seed % 2**64)


@contextmanager
def _as_store_error(path: Path) -> Iterator[None]:
    """Turn errors of SQLite and the file system into one that names the file."""
    try:
        yield
    except (sqlite3.DatabaseError, OSError, ValueError, TypeError, OverflowError) as error:
        if isinstance(error, sqlite3.OperationalError | OSError):
            raise StoreError(f"cannot use {path}: {error}") from error
        raise StoreError(
            f"{path} is damaged or not a result file of sdnn ({error});"
            " move it away or choose another output folder"
        ) from error


def _inspect(path: Path) -> bool:
    """Return whether the file has yet to be made; refuse damaged and foreign ones.

    The file is opened for reading only: what is not ours stays as it is, to the byte. Only what a
    killed process left half written is rolled back first, by SQLite's own journal.
    """
    if path.with_name(f"{path.name}-journal").exists():
        with closing(sqlite3.connect(path, timeout=BUSY_SECONDS)) as connection:
            connection.execute("SELECT count(*) FROM sqlite_master").fetchone()
    if not path.exists() or path.stat().st_size == 0:
        return True
    with path.open("rb") as file:
        if file.read(16) != b"SQLite format 3\0":
            raise sqlite3.DatabaseError("no SQLite file")
    with closing(_connect_to_read(path)) as connection:
        application_id = connection.execute("PRAGMA application_id").fetchone()[0]
        version = connection.execute("PRAGMA user_version").fetchone()[0]
        n_objects = connection.execute("SELECT count(*) FROM sqlite_master").fetchone()[0]
        if application_id == 0 and n_objects == 0:
            return True  # killed before the schema was written
        if application_id != APPLICATION_ID:
            raise StoreError(
                f"{path} is a SQLite file of another program; choose another output folder"
            )
        if version != SCHEMA_VERSION:
            raise StoreError(
                f"{path} has schema version {version}, and this version of sdnn reads"
                f" {SCHEMA_VERSION}: choose another output folder"
            )
        findings = connection.execute("PRAGMA integrity_check").fetchall()
        if findings != [("ok",)]:
            raise sqlite3.DatabaseError(str(findings[0][0]))
        return False


def _connect_to_read(path: Path) -> sqlite3.Connection:
    return sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True, timeout=BUSY_SECONDS)
