"""Files that are there as a whole or not at all, also after a kill."""

from __future__ import annotations

import csv
import os
from collections.abc import Iterable, Sequence
from io import StringIO
from pathlib import Path

PARTIAL_SUFFIX = ".partial"
"""Of a file under way."""


def write_whole(path: Path, content: bytes) -> None:
    """Write a file under another name, then give it its own.

    Raises
    ------
    OSError
        If the file cannot be written; one that was there before stays as it was.
    """
    partial = path.with_name(path.name + PARTIAL_SUFFIX)
    try:
        with partial.open("wb") as file:
            file.write(content)
            file.flush()
            os.fsync(file.fileno())
        partial.replace(path)
    except BaseException:
        partial.unlink(missing_ok=True)
        raise


def csv_bytes(header: Sequence[str], rows: Iterable[Sequence[object]]) -> bytes:
    """Return a table as comma-separated values, UTF-8, one line feed after each row."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    writer.writerows(rows)
    return text.getvalue().encode()


def remove_partial_files(folder: Path) -> None:
    """Remove what a killed process left under way in a folder."""
    for path in folder.glob(f"*{PARTIAL_SUFFIX}"):
        path.unlink(missing_ok=True)
