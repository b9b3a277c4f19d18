"""Connections to the SQLite file of a store, and the journal that a killed process leaves."""

from __future__ import annotations

import os
import sqlite3
from collections.abc import Iterator
from contextlib import closing, contextmanager, suppress
from pathlib import Path

from sdnn.runs.errors import StoreError
from sdnn.support.files import is_there

BUSY_SECONDS = 60.0
"""Seconds to wait for another process that writes the same file."""
MOST_BYTES_OF_VALUE = 2**24
"""Longest text in the file."""


def connect(path: Path | None, *, read_only: bool = False) -> sqlite3.Connection:
    """Open a file, or a database in memory, in which nothing but its data counts."""
    place = ":memory:"
    if path is not None:
        place = f"{path.absolute().as_uri()}?mode={'ro' if read_only else 'rwc'}"
    connection = sqlite3.connect(place, uri=path is not None, timeout=BUSY_SECONDS)
    for setting in (
        "trusted_schema = OFF", "cell_size_check = ON", "mmap_size = 0",
        f"query_only = {int(read_only)}",
    ):  # fmt: skip
        connection.execute(f"PRAGMA {setting}")
    connection.setlimit(sqlite3.SQLITE_LIMIT_LENGTH, MOST_BYTES_OF_VALUE)
    connection.setlimit(sqlite3.SQLITE_LIMIT_ATTACHED, 0)
    return connection


def is_hot(path: Path, journal: Path) -> bool:
    """Return whether a journal is of a transaction that no process continues.

    One that names another file, which SQLite would remove, is refused; ours never do.
    """
    # Another process may have finished with it.
    with suppress(FileNotFoundError), journal.open("rb") as file:
        file.seek(max(0, file.seek(0, os.SEEK_END) - len(_MAGIC_OF_JOURNAL)))
        if file.read() == _MAGIC_OF_JOURNAL:
            raise foreign_journal(journal)
    try:
        with closing(connect(path, read_only=True)) as connection:
            connection.execute("PRAGMA user_version").fetchone()
    except sqlite3.OperationalError as error:
        if error.sqlite_errorcode == sqlite3.SQLITE_READONLY_ROLLBACK:
            return True
        if is_there(path):
            raise
    return False


def has_rows(path: Path) -> bool:
    """Return whether a file holds a run or a measurement, without its journal."""
    place = f"{path.absolute().as_uri()}?mode=ro&immutable=1"
    with suppress(sqlite3.DatabaseError), closing(sqlite3.connect(place, uri=True)) as connection:
        tables = ("runs", "measurements")
        return any(connection.execute(f"SELECT 1 FROM {name}").fetchone() for name in tables)
    return False


def foreign_journal(journal: Path) -> sqlite3.OperationalError:
    """Return the error about a journal that belongs to another file."""
    return sqlite3.OperationalError(
        f"{journal.name} is not the journal of this file, whose content it would change or remove:"
        " move it away"
    )


@contextmanager
def as_store_error(path: Path) -> Iterator[None]:
    """Turn errors of SQLite and the file system into one that names the file."""
    try:
        yield
    except MemoryError as error:
        raise StoreError(f"cannot use {path}: out of memory") from error
    except (
        sqlite3.DatabaseError, OSError, ValueError, TypeError, OverflowError, RecursionError,
    ) as error:  # fmt: skip
        if isinstance(error, sqlite3.OperationalError | OSError):
            raise StoreError(f"cannot use {path}: {error}") from error
        raise StoreError(
            f"{path} is damaged or not a result file of sdnn ({error});"
            " move it away or choose another output folder"
        ) from error


_MAGIC_OF_JOURNAL = bytes.fromhex("d9d505f920a163d7")
"""A journal begins with it, and ends with it if it names another file."""
