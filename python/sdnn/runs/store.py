"""One SQLite file that holds every finished trial and measurement, each in one transaction.

The file survives a kill at any instant (write-ahead log, full synchronization): a trial is in it
as a whole or not at all. Trials under different settings live side by side under different keys.
"""

from __future__ import annotations

import json
import math
import os
import sqlite3
import time
from collections.abc import Iterable, Iterator
from contextlib import closing, contextmanager
from pathlib import Path
from types import TracebackType

import numpy as np

from sdnn.runs.errors import StoreError
from sdnn.runs.records import (
    CostKey,
    CostRecord,
    StepTimes,
    TrialKey,
    TrialRecord,
    TrialRows,
    TrialTime,
)

STORE_NAME = "results.sqlite"
SCHEMA_VERSION = 3
APPLICATION_ID = int.from_bytes(b"sdnn", "big")
"""Marks a SQLite file as ours (SQLite's header field of that name)."""
BUSY_SECONDS = 60.0
"""How long to wait for another process that writes the same file."""

EMPTIED_EVERY = 1.0
"""Seconds between two times that SQLite's log is emptied, which takes some hundredths of one."""

_LOG_HEAD_BYTES, _FRAME_HEAD_BYTES = 32, 24
"""Of the log that SQLite keeps beside a file, by its file format."""

_SCHEMA = """
CREATE TABLE trials (
  id INTEGER PRIMARY KEY,
  case_id TEXT NOT NULL, agent TEXT NOT NULL, trial INTEGER NOT NULL, seed INTEGER NOT NULL,
  config_hash TEXT NOT NULL, config TEXT NOT NULL, version TEXT NOT NULL,
  n_decisions INTEGER NOT NULL, seconds REAL NOT NULL, finished_at TEXT NOT NULL,
  rows_digest TEXT NOT NULL,
  UNIQUE (case_id, agent, trial, seed, config_hash)
);
CREATE TABLE rows (
  trial_id INTEGER NOT NULL REFERENCES trials (id),
  episode INTEGER NOT NULL, steps INTEGER NOT NULL, episode_return REAL NOT NULL,
  solved INTEGER NOT NULL,
  PRIMARY KEY (trial_id, episode)
) WITHOUT ROWID;
CREATE VIEW labelled_rows AS
  SELECT case_id, agent, trial, seed, config_hash, version,
         episode, steps, episode_return, solved
  FROM rows JOIN trials ON trials.id = rows.trial_id;
CREATE TABLE costs (
  series TEXT NOT NULL, n_inputs INTEGER NOT NULL, config_hash TEXT NOT NULL,
  version TEXT NOT NULL, machine TEXT NOT NULL, finished_at TEXT NOT NULL,
  n_steps INTEGER NOT NULL, table_bytes INTEGER NOT NULL, microseconds TEXT NOT NULL,
  PRIMARY KEY (series, n_inputs, config_hash)
) WITHOUT ROWID;
"""


class ResultStore:
    """The result file of a folder, made if it is not there.

    Parameters
    ----------
    folder
        Folder of the file, made if missing.
    read_only
        Whether it is only looked at: then nothing is made, and the folder may be one that cannot be
        written.

    Raises
    ------
    StoreError
        If the folder is a file, or the file in it is damaged, of another program or of another
        version of this one's schema. Such a file is left as it is.
    """

    def __init__(self, folder: str | Path, *, read_only: bool = False) -> None:
        folder = Path(folder)
        self.path = folder / STORE_NAME
        self._emptied_at = -math.inf
        if folder.exists() and not folder.is_dir():
            raise StoreError(f"the output must be a folder, but {folder} is a file")
        with _as_store_error(self.path):
            if not read_only:
                folder.mkdir(parents=True, exist_ok=True)
            is_new = _inspect(self.path)
            if read_only and not is_new and not _is_writable(folder):
                self._connection = _connect_to_read(self.path)
                return
            place = ":memory:" if read_only and is_new else self.path
            self._connection = sqlite3.connect(place, timeout=BUSY_SECONDS)
            try:
                self._prepare(is_new)
            except BaseException:
                self._connection.close()
                raise

    def _prepare(self, is_new: bool) -> None:
        connection = self._connection
        connection.execute("PRAGMA journal_mode = WAL")
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

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self.close()

    def close(self) -> None:
        """Close the file."""
        self._connection.close()

    def add(self, record: TrialRecord, *, is_exact: bool = True) -> None:
        """Store a finished trial, as a whole or not at all.

        Storing the same trial again (another process was quicker) changes nothing.

        Parameters
        ----------
        record
            The trial.
        is_exact
            Whether it owes the same rows each time, as compiled trials do. The first rows stay
            where it does not.

        Raises
        ------
        StoreError
            If the file cannot be written, or holds other rows of an exact trial.
        """
        rows = record.rows
        digest = rows.digest()
        with _as_store_error(self.path), self._connection as connection:
            connection.execute("BEGIN IMMEDIATE")
            known = connection.execute(
                "SELECT rows_digest FROM trials WHERE case_id = ? AND agent = ? AND trial = ?"
                " AND seed = ? AND config_hash = ?",
                record.key,
            ).fetchone()
            if known is not None:
                if is_exact and known[0] != digest:
                    raise StoreError(
                        f"{self.path} already holds other rows for {record.key}:"
                        " the same trial gave two results"
                    )
                return
            cursor = connection.execute(
                "INSERT INTO trials (case_id, agent, trial, seed, config_hash, config, version,"
                " n_decisions, seconds, finished_at, rows_digest)"
                " VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?, ?, ?)",
                (
                    *record.key,
                    record.config,
                    record.version,
                    record.n_decisions,
                    record.seconds,
                    record.finished_at,
                    digest,
                ),
            )
            trial_id = cursor.lastrowid
            columns = (rows.episode, rows.steps, rows.episode_return, rows.solved.astype(int))
            connection.executemany(
                "INSERT INTO rows VALUES (?, ?, ?, ?, ?)",
                ((trial_id, *row) for row in zip(*(c.tolist() for c in columns), strict=True)),
            )
        self._empty_log()

    def _empty_log(self) -> None:
        """Bring what SQLite keeps beside the file into it, so that it is whole if it is copied.

        And so that a killed process leaves nothing that would be taken for part of another file in
        its place. While others read or write it has to wait for the next time, as it does where
        trials come quickly.
        """
        now = time.monotonic()
        if now - self._emptied_at < EMPTIED_EVERY:
            return
        self._emptied_at = now
        with _as_store_error(self.path):
            self._connection.execute("PRAGMA busy_timeout = 0")
            self._connection.execute("PRAGMA wal_checkpoint(TRUNCATE)").fetchall()
            self._connection.execute(f"PRAGMA busy_timeout = {int(1000 * BUSY_SECONDS)}")

    def keys(self) -> set[TrialKey]:
        """Return the keys of all stored trials."""
        with _as_store_error(self.path):
            return {
                TrialKey(*row)
                for row in self._connection.execute(
                    "SELECT case_id, agent, trial, seed, config_hash FROM trials"
                )
            }

    def times(self) -> tuple[TrialTime, ...]:
        """Return how long the stored trials took, without reading their rows."""
        with _as_store_error(self.path):
            found = self._connection.execute(
                "SELECT case_id, agent, trial, seed, config_hash, seconds, n_decisions,"
                " (SELECT max(episode) FROM rows WHERE trial_id = trials.id)"
                " FROM trials ORDER BY id"
            ).fetchall()
        return tuple(
            TrialTime(
                key=TrialKey(*row[:5]),
                seconds=row[5],
                n_episodes=row[7] or 0,
                n_decisions=row[6],
            )
            for row in found
        )

    def load(self, keys: Iterable[TrialKey] | None = None) -> tuple[TrialRecord, ...]:
        """Return the stored trials of the given keys (default: all), sorted by key.

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
        (trial_id, config, version, n_decisions, seconds, finished_at, digest) = (
            self._connection.execute(
                "SELECT id, config, version, n_decisions, seconds, finished_at, rows_digest"
                " FROM trials WHERE case_id = ? AND agent = ? AND trial = ? AND seed = ?"
                " AND config_hash = ?",
                key,
            ).fetchone()
        )
        found = self._connection.execute(
            "SELECT episode, steps, episode_return, solved FROM rows WHERE trial_id = ?"
            " ORDER BY episode",
            (trial_id,),
        ).fetchall()
        names = ("episode", "steps", "episode_return", "solved")
        rows = TrialRows.from_arrays(
            {name: np.array([row[i] for row in found]) for i, name in enumerate(names)}
        )
        if rows.digest() != digest:
            raise StoreError(f"{self.path} is damaged: the rows of {key} have changed")
        return TrialRecord(
            key=key,
            config=config,
            version=version,
            n_decisions=n_decisions,
            seconds=seconds,
            finished_at=finished_at,
            rows=rows,
        )

    def add_cost(self, record: CostRecord) -> None:
        """Store a measurement; one that another process stored first stays.

        Raises
        ------
        StoreError
            If the file cannot be written.
        """
        times = record.times
        with _as_store_error(self.path), self._connection as connection:
            connection.execute(
                "INSERT OR IGNORE INTO costs (series, n_inputs, config_hash, version, machine,"
                " finished_at, n_steps, table_bytes, microseconds)"
                " VALUES (?, ?, ?, ?, ?, ?, ?, ?, ?)",
                (
                    *record.key,
                    record.version,
                    record.machine,
                    record.finished_at,
                    times.n_steps,
                    times.table_bytes,
                    json.dumps(times.microseconds.tolist()),
                ),
            )
        self._empty_log()

    def load_costs(self, config_hash: str) -> tuple[CostRecord, ...]:
        """Return the measurements under the given settings, sorted by key."""
        with _as_store_error(self.path):
            found = self._connection.execute(
                "SELECT series, n_inputs, config_hash, version, machine, finished_at, n_steps,"
                " table_bytes, microseconds FROM costs WHERE config_hash = ?"
                " ORDER BY series, n_inputs",
                (config_hash,),
            ).fetchall()
            return tuple(_cost_record(*row) for row in found)


def _cost_record(
    series: str, n_inputs: int, config_hash: str, version: str, machine: str, finished_at: str,
    n_steps: int, table_bytes: int, microseconds: str,
) -> CostRecord:  # fmt: skip
    times = StepTimes(
        microseconds=np.array(json.loads(microseconds), np.float64),
        n_steps=n_steps,
        table_bytes=table_bytes,
    )
    return CostRecord(
        key=CostKey(series, n_inputs, config_hash),
        version=version,
        machine=machine,
        finished_at=finished_at,
        times=times,
    )


@contextmanager
def _as_store_error(path: Path) -> Iterator[None]:
    """Turn errors of SQLite and the file system into one that names the file."""
    try:
        yield
    except (sqlite3.DatabaseError, OSError, ValueError, OverflowError) as error:
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
    _refuse_other_log(path)
    with path.open("rb") as file:
        if file.read(16) != b"SQLite format 3\0":
            raise sqlite3.DatabaseError("no SQLite file")
    connection = _connect_to_read(path)
    try:
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
    finally:
        connection.close()


def _refuse_other_log(path: Path) -> None:
    """Refuse a file beside which lies the log of another one, which SQLite would write into it.

    As where a file was copied to the place of one whose process was killed. Files only grow here,
    so one that has more pages than its log knows of is not the log's.
    """
    log = path.with_name(f"{path.name}-wal")
    n_bytes = path.stat().st_size  # before the log is read: others may write to both
    if not log.exists():
        return
    with log.open("rb") as file:
        head = file.read(_LOG_HEAD_BYTES)
        if len(head) < _LOG_HEAD_BYTES:
            return
        page_bytes, salts = int.from_bytes(head[8:12], "big"), head[16:24]
        n_pages = 0
        while len(frame := file.read(_FRAME_HEAD_BYTES)) == _FRAME_HEAD_BYTES:
            if frame[8:16] != salts:
                break
            n_pages = int.from_bytes(frame[4:8], "big") or n_pages  # 0 but at a commit
            file.seek(page_bytes, os.SEEK_CUR)
    if 0 < n_pages * page_bytes < n_bytes:
        raise StoreError(
            f"{log} is the log of another file than {path}, which it would overwrite: if you have"
            f" copied the file there, remove {log.name} and {path.name}-shm"
        )


def _is_writable(folder: Path) -> bool:
    return os.access(folder, os.W_OK)


def _connect_to_read(path: Path) -> sqlite3.Connection:
    """Open a file for reading, also in a folder that cannot be written.

    There SQLite cannot make what it keeps beside a file for those who write it at the same time. It
    needs none of that unless a log is there, which holds what is not yet in the file.
    """
    log = path.with_name(f"{path.name}-wal")
    has_log = log.exists() and log.stat().st_size > 0
    is_fixed = not has_log and not _is_writable(path.parent)
    uri = f"{path.absolute().as_uri()}?mode=ro" + ("&immutable=1" if is_fixed else "")
    return sqlite3.connect(uri, uri=True, timeout=BUSY_SECONDS)
