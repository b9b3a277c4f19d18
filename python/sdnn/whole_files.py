"""Files that are there as a whole or not at all, also after a kill."""

from __future__ import annotations

import csv
import os
import zlib
from collections.abc import Iterable, Iterator, Sequence
from io import StringIO
from pathlib import Path

PARTIAL_SUFFIX = ".partial"
"""Of a file under way."""

_PIECE_CHARACTERS = 2**20
_GZIP = 31
"""A window of 2**15 bytes, with the header of gzip."""


def write_whole(path: Path, content: bytes | Iterable[bytes]) -> None:
    """Write a file under another name, then give it its own.

    Parameters
    ----------
    path
        Its name.
    content
        All of it, or pieces that are made while it is written.

    Raises
    ------
    OSError
        If the file cannot be written; one that was there before stays as it was.
    """
    partial = path.with_name(path.name + PARTIAL_SUFFIX)
    try:
        with partial.open("wb") as file:
            file.writelines([content] if isinstance(content, bytes) else content)
            file.flush()
            os.fsync(file.fileno())
        partial.replace(path)
    except BaseException:
        partial.unlink(missing_ok=True)
        raise


def csv_bytes(header: Sequence[str], rows: Iterable[Sequence[object]]) -> bytes:
    """Return a table as comma-separated values, UTF-8, one line feed after each row."""
    return b"".join(csv_pieces(header, rows))


def csv_pieces(header: Sequence[str], rows: Iterable[Sequence[object]]) -> Iterator[bytes]:
    """Give the same in pieces, for tables that fill the memory."""
    text = StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(header)
    for row in rows:
        writer.writerow(row)
        if text.tell() >= _PIECE_CHARACTERS:
            yield text.getvalue().encode()
            text.seek(0)
            text.truncate()
    yield text.getvalue().encode()


def gzip_pieces(pieces: Iterable[bytes]) -> Iterator[bytes]:
    """Compress pieces as gzip does, quickly; equal pieces give equal bytes at any time."""
    compressor = zlib.compressobj(level=1, wbits=_GZIP)
    for piece in pieces:
        yield compressor.compress(piece)
    yield compressor.flush()


def remove_partial_files(folder: Path) -> None:
    """Remove what a killed process left under way in a folder."""
    for path in folder.glob(f"*{PARTIAL_SUFFIX}"):
        path.unlink(missing_ok=True)
