"""Files that are written as a whole or not at all, also after a kill."""

from __future__ import annotations

import csv
import os
import re
import secrets
import stat
import time
import zlib
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager, suppress
from io import StringIO
from pathlib import Path
from typing import BinaryIO

try:
    import fcntl
except ImportError:  # not on this system
    fcntl = None  # type: ignore[assignment]

PARTIAL_SUFFIX = ".partial"
"""Of a file under way."""
_NAME_OF_PARTIAL = re.compile(r"\.[0-9a-f]{16}\.partial$")
_ABANDONED_SECONDS = 60
"""After which a file under way is nobody's, where files cannot be locked."""

_PIECE_CHARACTERS = 2**20
_GZIP = 31
"""A window of 2**15 bytes, with the header of gzip."""


@contextmanager
def whole_file(path: Path) -> Iterator[BinaryIO]:
    """Open a new file in the same folder; at the end it takes the place of ``path``.

    Its name is one that nobody can foresee. A link stays one, to the new file. A device or a pipe
    is written to, under its own name.

    Raises
    ------
    OSError
        If the file cannot be written; one that was there before stays as it was.
    """
    if path.exists() and not (path.is_file() or path.is_dir()):
        with path.open("wb") as device:
            yield device
        return
    path = Path(os.path.realpath(path)) if path.is_symlink() else path
    file = _new_file(path)
    partial = Path(file.name)
    try:
        with file:
            yield file
            file.flush()
            os.fsync(file.fileno())
            if fcntl is None:  # where an open file cannot be given another name
                file.close()
            partial.replace(path)
        _sync_folder(path.parent)
    finally:
        partial.unlink(missing_ok=True)


def write_whole(path: Path, content: bytes | Iterable[bytes | memoryview]) -> None:
    """Write a file as a whole or not at all; ``content`` may be made while it is written.

    Raises
    ------
    OSError
        If the file cannot be written; one that was there before stays as it was.
    """
    with whole_file(path) as file:
        file.writelines([content] if isinstance(content, bytes) else content)


def open_regular(path: Path, max_bytes: int) -> BinaryIO:
    """Open a regular file for reading; never wait for the writer of a pipe.

    Raises
    ------
    OSError
        If it cannot be opened, or is a folder, a device, a pipe or larger than ``max_bytes``.
    """
    file: BinaryIO = open(path, "rb", opener=_open_at_once)  # noqa: SIM115
    status = os.fstat(file.fileno())
    if stat.S_ISREG(status.st_mode) and status.st_size <= max_bytes:
        return file
    file.close()
    if stat.S_ISREG(status.st_mode):
        raise OSError(f"{path} has {status.st_size} bytes, expected at most {max_bytes}")
    raise OSError(f"{path} is not a regular file")


def _open_at_once(name: str, flags: int) -> int:
    return os.open(name, flags | getattr(os, "O_NONBLOCK", 0))


def lock(descriptor: int) -> bool | None:
    """Lock an open file for this process; a killed process loses its locks.

    Returns whether it is locked now: False if another process holds it, None where files cannot be
    locked.
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


def _new_file(path: Path) -> BinaryIO:
    """Create the file under way, locked while it is open, so that nobody thinks it abandoned."""
    while True:
        name = f"{path.name}.{secrets.token_hex(8)}{PARTIAL_SUFFIX}"
        file = path.with_name(name).open("xb")  # O_EXCL, which follows no link either
        # Another process may have removed it before it was locked.
        if lock(file.fileno()) is not False and os.path.exists(file.name):
            return file
        file.close()


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
    for path in folder.glob(f"*{PARTIAL_SUFFIX}"):
        if not _NAME_OF_PARTIAL.search(path.name):
            continue
        with suppress(OSError):  # another process may have removed it, or given it its own name
            with path.open("rb+") as file:
                is_abandoned = lock(file.fileno())
                if is_abandoned:
                    path.unlink()
            age = time.time() - path.stat().st_mtime if is_abandoned is None else 0.0
            if age > _ABANDONED_SECONDS:
                path.unlink()
