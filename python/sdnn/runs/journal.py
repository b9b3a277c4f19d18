"""Journals that killed processes leave beside the SQLite file of a store."""

from __future__ import annotations

import os
import sqlite3
from contextlib import closing, suppress
from pathlib import Path

from sdnn.support.files import is_there

BUSY_SECONDS = 60.0  # seconds to wait for another process that writes the same file

_MAGIC_OF_JOURNAL = bytes.fromhex("d9d505f920a163d7")
"""First bytes of a journal; also its last bytes if it names a super-journal."""


def is_hot(path: Path, journal: Path) -> bool:
    """Return whether a journal holds a transaction that a killed process left unfinished.

    An error is raised for a journal that names another file, which SQLite would delete: this
    library never writes such journals.
    """
    # Another process may have finished its transaction meanwhile.
    with suppress(FileNotFoundError), journal.open("rb") as file:
        file.seek(max(0, file.seek(0, os.SEEK_END) - len(_MAGIC_OF_JOURNAL)))
        if file.read() == _MAGIC_OF_JOURNAL:
            raise foreign_journal(journal)
    place = f"{path.absolute().as_uri()}?mode=ro"
    try:
        with closing(sqlite3.connect(place, uri=True, timeout=BUSY_SECONDS)) as connection:
            connection.execute("PRAGMA user_version").fetchone()
    except sqlite3.OperationalError as error:
        if error.sqlite_errorcode == sqlite3.SQLITE_READONLY_ROLLBACK:
            return True  # SQLite would have to write: to roll the transaction back
        if is_there(path):
            raise
    return False


def has_rows(path: Path) -> bool:
    """Return whether a file holds a run or a measurement; its journal is not applied."""
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
