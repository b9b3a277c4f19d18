"""Files that are there as a whole or not at all, also after a kill."""

from __future__ import annotations

import csv
import os
import re
import time
import zlib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from io import StringIO
from itertools import count
from pathlib import Path

try:
    import fcntl
except ImportError:  # not on this system
    fcntl = None  # type: ignore[assignment]

PARTIAL_SUFFIX = ".partial"
"""Of a file under way."""

_ABANDONED_SECONDS = 60
"""After which a file under way is nobody's, where files cannot be locked."""
_numbers = count()

_PIECE_CHARACTERS = 2**20
_GZIP = 31
"""A window of 2**15 bytes, with the header of gzip."""


@contextmanager
def whole_file(path: Path) -> Iterator[Path]:
    """Give another name in the same folder to write to; at the end the file gets its own.

    Each call gives a name that no other process or thread has. A link stays one, to the new file.
    What is no file but a device or a pipe is written to, under its own name.

    Parameters
    ----------
    path
        Its own name.

    Raises
    ------
    OSError
        If the file cannot be written; one that was there before stays as it was.
    """
    if path.exists() and not (path.is_file() or path.is_dir()):
        yield path
        return
    path = Path(os.path.realpath(path)) if path.is_symlink() else path
    partial = path.with_name(f"{path.name}.{os.getpid()}.{next(_numbers)}{PARTIAL_SUFFIX}")
    try:
        with _held(partial):
            yield partial
            with partial.open("rb+") as file:
                os.fsync(file.fileno())
            partial.replace(path)
        _sync_folder(path.parent)
    finally:
        partial.unlink(missing_ok=True)


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
    with whole_file(path) as partial, partial.open("wb") as file:
        file.writelines([content] if isinstance(content, bytes) else content)


def lock(descriptor: int) -> bool | None:
    """Lock an open file for this process alone; the lock of a killed process is gone with it.

    Returns
    -------
    bool or None
        Whether the file is locked now: False if another process holds it, None where files cannot
        be locked.
    """
    if fcntl is None:
        return None
    try:
        fcntl.flock(descriptor, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except BlockingIOError:
        return False
    except OSError:  # not in this folder
        return None
    return True


@contextmanager
def _held(partial: Path) -> Iterator[None]:
    """Make a file under way and keep it locked, so that nobody takes it for an abandoned one."""
    if fcntl is None:  # where, too, an open file cannot be given another name
        yield
        return
    while True:
        descriptor = os.open(partial, os.O_RDWR | os.O_CREAT, 0o666)
        # Between these two lines another process may have removed it.
        if lock(descriptor) is not False and partial.exists():
            break
        os.close(descriptor)
    try:
        yield
    finally:
        os.close(descriptor)


def _sync_folder(folder: Path) -> None:
    """Put names on the disk, where the system and the folder's rights allow it."""
    if not hasattr(os, "O_DIRECTORY"):
        return
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def _is_partial(path: Path) -> bool:
    """Whether `whole_file` gave the name."""
    return re.search(r"\.\d+\.\d+$", path.name.removesuffix(PARTIAL_SUFFIX)) is not None


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


def remove_abandoned_files(folder: Path) -> None:
    """Remove what killed processes left under way in a folder."""
    for path in filter(_is_partial, folder.glob(f"*{PARTIAL_SUFFIX}")):
        with suppress(OSError):  # another process may have removed it, or given it its own name
            with path.open("rb+") as file:
                is_abandoned = lock(file.fileno())
                if is_abandoned:
                    path.unlink()
            age = time.time() - path.stat().st_mtime if is_abandoned is None else 0.0
            if age > _ABANDONED_SECONDS:
                path.unlink()
