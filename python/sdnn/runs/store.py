"""The SQLite file that holds the rows of all runs, and measurements.

Trials that finish together are stored in one transaction, and so are a measurement and the rows of
a run in progress with every checkpoint. The file survives a kill at any instant (SQLite's rollback
journal, full synchronization). Runs under other settings live side by side under other keys.
"""

from __future__ import annotations

import json
import shutil
import sqlite3
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import AbstractContextManager, ExitStack, closing, contextmanager
from functools import cache
from importlib.resources import files
from pathlib import Path
from tempfile import TemporaryDirectory
from typing import NamedTuple, TypeAlias, TypeVar

import msgspec
import numpy as np

from sdnn.runs.errors import ChangedRowsError, StoreError
from sdnn.runs.journal import BUSY_SECONDS, foreign_journal, has_rows, is_hot
from sdnn.runs.trial import ROW, Hash, TrialKey, TrialRecord, TrialRows, problem_of_config
from sdnn.support.files import is_there, open_regular

Rows = TypeVar("Rows")

STORE_NAME = "results.sqlite"
SCHEMA_VERSION = 6
APPLICATION_ID = int.from_bytes(b"sdnn", "big")
"""Value of SQLite's header field ``application_id`` in files of this library."""
MOST_BYTES = 2**37  # largest file: SQLite's integrity check needs memory, a bit for each page
MOST_BYTES_OF_VALUE = 2**24  # longest text in the file
MOST_MEASUREMENTS = 10**5  # a report has only some hundreds
_SCHEMA = files("sdnn.runs").joinpath("schema.sql").read_text("utf-8")

_KEY = "case_id = ? AND agent = ? AND trial = ? AND seed = ? AND config_hash = ?"
_ROW_COLUMNS = (
    'number, part, kind, episode, ifnull(step, -1), length, "return", terminated,'
    " ifnull(environment, -1)"
)
_Rows: TypeAlias = list[tuple[int, int, str, int, int, int, float, int, int]]


class _Run(NamedTuple):
    """A row of the table of runs."""

    id: int
    case_id: str
    agent: str
    trial: int
    seed: int
    config_hash: str
    config: str
    version: str
    n_decisions: int
    seconds: float
    finished_at: str | None
    checksum: str
    crc: int

    @property
    def key(self) -> TrialKey:
        """The key of the run, with the seed as an unsigned number."""
        key = TrialKey(self.case_id, self.agent, self.trial, self.seed, self.config_hash)
        return key._replace(seed=key.seed % 2**64)


class ResultStore(AbstractContextManager["ResultStore"]):
    """The result file of a folder, created if missing; with ``read_only``, nothing is written.

    Everything read is checked: the schema is that of this version, values have the type of their
    column, rows match the stored checksum, and configurations match their hash.

    StoreError if the folder is a file, or the file in it is a link, damaged, of another program or
    of another version of the schema. Such a file is left unchanged.
    """

    def __init__(self, folder: str | Path, *, read_only: bool = False) -> None:
        folder = Path(folder)
        self.path = folder / STORE_NAME
        if folder.exists() and not folder.is_dir():
            raise StoreError(f"the output must be a folder, but {folder} is a file")
        self._hashes: dict[int, Hash] = {}  # of the rows that `extend` has stored, by run id
        with as_store_error(self.path):
            if not read_only:
                folder.mkdir(parents=True, exist_ok=True)
            self._connection = self._open(read_only)

    def _open(self, read_only: bool) -> sqlite3.Connection:
        """Connect to the file, or to a database in memory where reading would have to write it."""
        recovered = self._recovered()
        if recovered is not None and read_only:
            return recovered
        if recovered is not None:
            recovered.close()  # its making has shown that the journal belongs to the file
            with closing(connect(self.path)) as connection:
                connection.execute("PRAGMA user_version").fetchone()  # rolls the transaction back
        is_new = _inspect(self.path)
        if read_only and not is_new:
            return connect(self.path, read_only=True)
        connection = connect(None if read_only else self.path)
        try:
            self._prepare(connection, is_new)
        except BaseException:
            connection.close()
            raise
        return connection

    def _recovered(self) -> sqlite3.Connection | None:
        """Return a copy in memory with an unfinished transaction rolled back; None without one."""
        journal, log = (self.path.with_name(self.path.name + end) for end in ("-journal", "-wal"))
        if is_there(log):
            raise sqlite3.DatabaseError(f"there is a log of another program, {log.name}")
        if not is_there(journal) or not is_hot(self.path, journal):
            return None
        with ExitStack() as on_error, TemporaryDirectory() as folder:
            recovered = on_error.enter_context(closing(connect(None)))
            for path in (self.path, journal):
                shutil.copyfile(path, Path(folder, path.name))
            copy = Path(folder, self.path.name)
            try:
                with closing(connect(copy)) as connection:  # rolls the transaction back
                    connection.backup(recovered)
                is_empty = _inspect(copy)
            except (sqlite3.DatabaseError, StoreError) as error:
                raise foreign_journal(journal) from error
            # No transaction of this library makes both the schema and rows.
            if is_empty and has_rows(self.path):
                raise foreign_journal(journal)
            if is_empty:  # the unfinished transaction was that of the schema
                self._prepare(recovered, is_new=True)
            on_error.pop_all()
        return recovered

    def _prepare(self, connection: sqlite3.Connection, is_new: bool) -> None:
        """Set how the file is written; a new one gets the schema."""
        for setting in ("journal_mode = DELETE", "synchronous = FULL", "foreign_keys = ON"):
            connection.execute(f"PRAGMA {setting}")
        if is_new:
            # In a single transaction, a killed process leaves an empty file or the whole schema.
            try:
                connection.executescript(
                    f"BEGIN IMMEDIATE; {_SCHEMA} PRAGMA application_id = {APPLICATION_ID};"
                    f"PRAGMA user_version = {SCHEMA_VERSION}; COMMIT;"
                )
            except sqlite3.OperationalError:
                connection.rollback()
                if _inspect(self.path):  # else another process has just made it
                    raise

    def close(self, *_error: object) -> None:
        """Close the file."""
        self._connection.close()

    __exit__ = close

    def add(self, record: TrialRecord, *, is_exact: bool = True) -> None:
        """Store a finished trial, or finish a run in progress, in one transaction.

        Storing the same trial again (after another process) changes nothing. With
        ``is_exact``, as for compiled trials, it must have the same rows each time.

        StoreError if the file cannot be written, or holds other rows of an exact trial.
        """
        with self.together():
            run = self._run_in_progress(record.key, record.config, record.version)
            if run.finished_at is not None:
                if is_exact and run.checksum != record.rows.checksum():
                    problem = f"other rows for {record.key}: the same trial gave two results"
                    raise StoreError(f"{self.path} already holds {problem}")
                return
            checksum = self._rows(run).hashed()
            self._insert(run.id, record.rows)
            self._update(
                run._replace(
                    version=record.version,
                    n_decisions=record.n_decisions,
                    seconds=run.seconds + record.seconds,
                    finished_at=record.finished_at,
                    checksum=record.rows.hashed(checksum).hexdigest(),
                )
            )

    def extend(
        self, key: TrialKey, rows: TrialRows, first: int, *, config: str, version: str,
        seconds: float = 0.0,
    ) -> None:  # fmt: skip
        """Store rows of a run in progress; they replace those from the number `first` on.

        ``seconds`` is the processor time since rows were stored last. A finished run is in progress
        again.
        """
        with self.together():
            run = self._run_in_progress(key, config, version)
            hashed = rows.hashed(self._delete_from(run, first))
            self._insert(run.id, rows)
            seconds, checksum = seconds + run.seconds, hashed.hexdigest()
            self._update(run._replace(seconds=seconds, finished_at=None, checksum=checksum))
            self._hashes[run.id] = hashed

    def rows(self, key: TrialKey) -> TrialRows:
        """Return the rows of a run, finished or in progress; none if it is not stored."""
        with as_store_error(self.path):
            runs = self._runs(key)
            return self._rows(runs[0]) if runs else TrialRows(np.zeros(0, ROW))

    def keys(self, *, unfinished: bool = False) -> set[TrialKey]:
        """Return the keys of all finished trials; with ``unfinished``, also of runs in progress."""
        with as_store_error(self.path):
            return {run.key for run in self._runs() if unfinished or run.finished_at is not None}

    def seconds(self) -> dict[TrialKey, float]:
        """Return the processor times of the finished trials, without reading their rows."""
        with as_store_error(self.path):
            return {run.key: run.seconds for run in self._runs() if run.finished_at is not None}

    def load(self, keys: Iterable[TrialKey] | None = None) -> tuple[TrialRecord, ...]:
        """Return the finished trials of the given keys (default: all), sorted by key.

        Keys that are not stored are left out.

        StoreError if the rows of a trial are not the ones that were stored.
        """
        with as_store_error(self.path):
            finished = {run.key: run for run in self._runs() if run.finished_at is not None}
            wanted = sorted(finished if keys is None else finished.keys() & set(keys))
            return tuple(self._make_record(finished[key]) for key in wanted)

    def _make_record(self, run: _Run, rows: TrialRows | None = None) -> TrialRecord:
        """Return a run as a record; its rows are read unless they are passed."""
        return TrialRecord(
            key=run.key,
            config=run.config,
            version=run.version,
            n_decisions=run.n_decisions,
            seconds=run.seconds,
            finished_at=str(run.finished_at),
            rows=self._rows(run) if rows is None else rows,
        )

    @contextmanager
    def together(self) -> Iterator[None]:
        """Write everything in a block in one transaction, which waits for the disk once."""
        if self._connection.in_transaction:
            yield
            return
        with as_store_error(self.path), self._connection as connection:
            connection.execute("BEGIN IMMEDIATE")
            yield

    def _read(
        self, row_type: type[Rows], columns: str, table: str, rest: str, *arguments: object
    ) -> Rows:
        """Read columns of a table as a list of tuples, with a type for each column."""
        cursor = self._connection.execute(f"SELECT {columns} FROM {table} {rest}", arguments)
        try:
            return msgspec.convert(cursor.fetchall(), row_type)
        except msgspec.ValidationError as error:
            problem, _, place = str(error).partition(" - at ")  # `$[row][column]`
            column = cursor.description[int(place.rpartition("[")[2].rstrip("]`"))][0]
            raise StoreError(f"{self.path} is damaged: {table}.{column}: {problem}") from None

    def _runs(self, key: TrialKey | None = None) -> list[_Run]:
        """Read all runs, or that of a key; StoreError if one does not fit its checksum or hash."""
        rest = "ORDER BY id" if key is None else f"WHERE {_KEY}"
        runs = self._read(list[_Run], "*", "runs", rest, *([] if key is None else _stored(key)))
        for run in runs:
            problem = problem_of_config(run.config, run.config_hash)
            if run.crc != _crc(run[:-1]):
                problem = "a value does not fit its checksum, crc"
            if problem:
                raise StoreError(f"{self.path} is damaged: runs, id {run.id}: {problem}")
        return runs

    def _run_in_progress(self, key: TrialKey, config: str, version: str) -> _Run:
        """Return the stored run of a key, or insert one without rows."""
        if runs := self._runs(key):
            return runs[0]
        checksum = TrialRows(np.zeros(0, ROW)).checksum()
        values = (*_stored(key), config, version, 0, 0.0, None, checksum)
        marks = ", ".join("?" * len(_Run._fields))
        cursor = self._connection.execute(f"INSERT INTO runs VALUES ({marks})", (None, *values, 0))
        run = _Run(cursor.lastrowid or 0, *values, crc=0)
        self._update(run)
        return run

    def _update(self, run: _Run) -> None:
        """Update the columns of a run that may change, and their checksum."""
        # SQLite stores Python's numbers only, not those of NumPy.
        run = run._replace(n_decisions=int(run.n_decisions), seconds=float(run.seconds))
        values = (run.version, run.n_decisions, run.seconds, run.finished_at, run.checksum)
        self._connection.execute(
            "UPDATE runs SET version = ?, n_decisions = ?, seconds = ?, finished_at = ?,"
            " checksum = ?, crc = ? WHERE id = ?",
            (*values, _crc(run[:-1]), run.id),
        )

    def _insert(self, run_id: int, rows: TrialRows) -> None:
        """Add rows of a run; an unknown step or environment, -1, becomes NULL."""
        self._connection.executemany(
            "INSERT INTO rows VALUES (?, ?, ?, ?, ?, nullif(?, -1), ?, ?, ?, nullif(?, -1))",
            ((run_id, *row) for row in rows.table.tolist()),
        )

    def _rows(self, run: _Run) -> TrialRows:
        """Read the rows of a run; ChangedRowsError if they do not fit its checksum."""
        order = "WHERE run_id = ? ORDER BY number, part"
        rows = TrialRows(np.array(self._read(_Rows, _ROW_COLUMNS, "rows", order, run.id), ROW))
        if rows.checksum() != run.checksum:
            raise ChangedRowsError(self.path, run.key, self._make_record(run, rows))
        return rows

    def _delete_from(self, run: _Run, first: int) -> Hash:
        """Delete a run's rows from number ``first`` on; return the hash of the remaining rows.

        The remaining rows are read only where their hash is not at hand: after the run was resumed,
        or if another process has stored rows.
        """
        hashed = self._hashes.get(run.id)
        later = "FROM rows WHERE run_id = ? AND number >= ?"
        count = self._connection.execute(f"SELECT count(*) {later}", (run.id, first))
        (n_later,) = count.fetchone()
        if n_later == 0 and hashed is not None and hashed.hexdigest() == run.checksum:
            return hashed
        rows = self._rows(run).table  # raises if they have changed
        self._connection.execute(f"DELETE {later}", (run.id, first))
        return TrialRows(rows[rows["number"] < first]).hashed()

    def put(self, kind: str, key: str, content: Mapping[str, object]) -> None:
        """Store a measurement as JSON; one that another process stored first stays."""
        values = (kind, key, json.dumps(content))
        with self.together():
            self._connection.execute(
                "INSERT OR IGNORE INTO measurements VALUES (?, ?, ?, ?)", (*values, _crc(values))
            )

    def measurements(self, kind: str) -> dict[str, object]:
        """Return the contents of all measurements of a kind, by their sorted keys."""
        with as_store_error(self.path):
            (n,) = self._connection.execute("SELECT count(*) FROM measurements").fetchone()
            if n > MOST_MEASUREMENTS:
                raise StoreError(f"{self.path} holds {n} measurements, over {MOST_MEASUREMENTS}")
            row_type = list[tuple[str, str, str, int]]
            rows = self._read(row_type, "*", "measurements", "ORDER BY kind, key")
            for row in rows:
                if row[-1] != _crc(row[:-1]):
                    place = f"measurements, kind {row[0]}, key {row[1]}"
                    raise StoreError(
                        f"{self.path} is damaged: {place}: a value does not fit its checksum, crc"
                    )
            return {key: json.loads(text) for row_kind, key, text, _ in rows if row_kind == kind}


def _crc(values: tuple[object, ...]) -> int:
    """Return the checksum of a row's other columns, which shows damage to any of them."""
    return zlib.crc32(repr(values).encode("utf-8", "surrogatepass"))


def _stored(key: TrialKey) -> TrialKey:
    """Return a key with the seed as a signed integer, the only integers that SQLite stores."""
    return key._replace(seed=key.seed - 2**64 if key.seed >= 2**63 else key.seed)


def _inspect(path: Path) -> bool:
    """Return whether a file is missing or empty, without changing it.

    StoreError or DatabaseError if it is damaged, or of another program or version.
    """
    if not is_there(path) or path.stat().st_size == 0:
        return True
    with open_regular(path, MOST_BYTES) as file:
        header = file.read(20)  # bytes 18 and 19 are 1 with a rollback journal
    if header[:16] != b"SQLite format 3\0":
        raise sqlite3.DatabaseError("no SQLite file")
    if header[18:] != b"\1\1":
        raise sqlite3.DatabaseError("a SQLite file of another journal mode")
    with closing(connect(path, read_only=True)) as connection:
        application_id = connection.execute("PRAGMA application_id").fetchone()[0]
        version = connection.execute("PRAGMA user_version").fetchone()[0]
        objects = _objects(connection)
        if application_id == 0 and not objects:
            return True  # the process was killed before it wrote the schema
        if application_id != APPLICATION_ID:
            raise StoreError(
                f"{path} is a SQLite file of another program; choose another output folder"
            )
        if version != SCHEMA_VERSION:
            raise StoreError(
                f"{path} has schema version {version}, and this version of sdnn reads"
                f" {SCHEMA_VERSION}: choose another output folder"
            )
        # Views and triggers could change the result of any query, so refuse them first.
        if objects != _own_objects():
            raise sqlite3.DatabaseError("it has other tables, views or triggers")
        (finding,) = connection.execute("PRAGMA integrity_check(1)").fetchone()
        if finding != "ok":
            raise sqlite3.DatabaseError(finding)
        return False


def _objects(connection: sqlite3.Connection) -> set[tuple[str | None, ...]]:
    """Return what a database has in its schema: tables, indices, views and triggers."""
    return set(connection.execute("SELECT type, name, tbl_name, sql FROM sqlite_master").fetchall())


@cache
def _own_objects() -> set[tuple[str | None, ...]]:
    """Return what the schema of this version has, which every file must have."""
    with closing(sqlite3.connect(":memory:")) as connection:
        connection.executescript(_SCHEMA)
        return _objects(connection)


def connect(path: Path | None, *, read_only: bool = False) -> sqlite3.Connection:
    """Open a file, or a database in memory, with SQLite's protection against hostile schemas."""
    place = ":memory:"
    if path is not None:
        place = f"{path.absolute().as_uri()}?mode={'ro' if read_only else 'rwc'}"
    connection = sqlite3.connect(place, uri=path is not None, timeout=BUSY_SECONDS)
    try:
        for setting in ("trusted_schema = OFF", "cell_size_check = ON", "mmap_size = 0"):
            connection.execute(f"PRAGMA {setting}")
        connection.execute(f"PRAGMA query_only = {int(read_only)}")
        connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MOST_BYTES_OF_VALUE)
        connection.setlimit(sqlite3.SQLITE_LIMIT_ATTACHED, 0)
    except BaseException:
        connection.close()
        raise
    return connection


@contextmanager
def as_store_error(path: Path) -> Iterator[None]:
    """Turn errors of SQLite and the file system into a StoreError that names the file."""
    try:
        yield
    except MemoryError as error:
        raise StoreError(f"cannot use {path}: out of memory") from error
    except (sqlite3.OperationalError, OSError) as error:
        raise StoreError(f"cannot use {path}: {error}") from error
    except (sqlite3.DatabaseError, ValueError, TypeError, OverflowError, RecursionError) as error:
        raise StoreError(
            f"{path} is damaged or not a result file of sdnn ({error});"
            " move it away or choose another output folder"
        ) from error
