"""Files that are written whole or not at all, and files that are safe to open."""

from __future__ import annotations

import errno
import os
import re
import secrets
import stat
import time
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import BinaryIO, TextIO

from filelock import lock_descriptor

PARTIAL_SUFFIX = ".partial"
"""Suffix of a file that is being written."""
_NAME_OF_PARTIAL = re.compile(r"\.[0-9a-f]{16}\.partial$")
_ABANDONED_SECONDS = 60
"""Age from which a partial file counts as abandoned, where files cannot be locked."""

_FOLDERS_OF_DEVICES = tuple(map(Path, ("/dev", "/dev/fd", "/proc/self/fd")))
"""Names in these folders, such as ``/dev/stdout``, are written to and never replaced."""

_NO_LINK = getattr(os, "O_NOFOLLOW", 0)
_NO_WAITING = getattr(os, "O_NONBLOCK", 0)


@contextmanager
def whole_file(path: Path) -> Iterator[BinaryIO]:
    """Open a new file in the same folder; at the end it takes the place of ``path``.

    Its name is unpredictable. A link or a pipe of the name ``path`` is replaced:
    its target stays as it was. OSError if the file cannot be written; one that was there
    before stays as it was.
    """
    if path.absolute().parent in _FOLDERS_OF_DEVICES:
        with naming(path), path.open("wb") as device:
            yield device
        return
    file = _new_file(path)
    partial = Path(file.name)
    try:
        with naming(path), file:
            yield file
            file.flush()
            os.fsync(file.fileno())
            if os.name == "nt":  # where an open file cannot be given another name
                file.close()
            partial.replace(path)
        _sync_folder(path.parent)
    finally:
        partial.unlink(missing_ok=True)


@contextmanager
def naming(path: Path) -> Iterator[None]:
    """Add the name of the file to errors of writing, such as for a full disk."""
    try:
        yield
    except OSError as error:
        if error.errno is not None and error.filename is None:
            error.filename = str(path)
        raise


def write_whole(path: Path, content: bytes | Iterable[bytes | memoryview]) -> None:
    """Write a file whole or not at all; ``content`` may be made while it is written.

    OSError if the file cannot be written; one that was there before stays as it was.
    """
    with whole_file(path) as file:
        file.writelines([content] if isinstance(content, bytes) else content)


def open_regular(path: Path, max_bytes: int) -> BinaryIO:
    """Open a regular file for reading; never wait for the writer of a pipe.

    OSError if it cannot be opened, or is a folder, a device, a pipe or larger than ``max_bytes``.
    """
    file: BinaryIO = open(path, "rb", opener=_open_at_once)  # noqa: SIM115
    status = os.fstat(file.fileno())
    if stat.S_ISREG(status.st_mode) and status.st_size <= max_bytes:
        return file
    file.close()
    if stat.S_ISREG(status.st_mode):
        problem = f"must have at most {max_bytes} bytes, has {status.st_size}"
        raise OSError(errno.EFBIG, problem, str(path))
    raise OSError(errno.EINVAL, "must be a regular file", str(path))


def _open_at_once(name: str, flags: int) -> int:
    return os.open(name, flags | _NO_WAITING)


def read_bytes(path: Path, max_bytes: int) -> bytes:
    """Read a regular file of limited size; OSError as of `open_regular`."""
    with open_regular(path, max_bytes) as file:
        return file.read(os.fstat(file.fileno()).st_size)


def open_to_append(path: Path) -> TextIO:
    """Open a regular file, made if it is not there, for lines at its end.

    OSError if it cannot be opened, or is a link, a folder, a device or a pipe.
    """
    file: TextIO = open(  # noqa: SIM115
        path, "a", opener=_open_itself, encoding="utf-8", newline="\n", buffering=1
    )
    if stat.S_ISREG(os.fstat(file.fileno()).st_mode):
        return file
    file.close()
    raise OSError(errno.EINVAL, "must be a regular file", str(path))


def _open_itself(name: str, flags: int) -> int:
    """Open a file, but not the target of a link; never wait for the reader of a pipe."""
    return os.open(name, flags | _NO_LINK | _NO_WAITING, 0o666)


def is_there(path: Path) -> bool:
    """Return whether a regular file has this name; OSError for a link, folder, device or pipe."""
    try:
        mode = path.lstat().st_mode
    except FileNotFoundError:
        return False
    if not stat.S_ISREG(mode):
        raise OSError(errno.EINVAL, "must be a regular file, not even a link", str(path))
    return True


def lock(descriptor: int) -> bool | None:
    """Lock an open file for this process; a killed process loses its locks.

    Returns whether it is locked now: False if another process holds it, None where files cannot be
    locked.
    """
    try:
        return lock_descriptor(descriptor, blocking=False)
    except OSError:  # not in this folder
        return None


def _new_file(path: Path) -> BinaryIO:
    """Create the partial file, locked while it is open: it does not count as abandoned."""
    while True:
        name = f"{path.name}.{secrets.token_hex(8)}{PARTIAL_SUFFIX}"
        try:
            file = path.with_name(name).open("xb")  # O_EXCL, which follows no link
        except OSError as error:
            error.filename = str(path)  # the one that the caller knows
            raise
        # Another process may have removed it before it was locked.
        if lock(file.fileno()) is not False and os.path.exists(file.name):
            return file
        file.close()


def _sync_folder(folder: Path) -> None:
    """Synchronize the names in a folder, if the system and the folder's rights allow it."""
    if not hasattr(os, "O_DIRECTORY"):
        return
    with suppress(OSError):
        descriptor = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
        try:
            os.fsync(descriptor)
        finally:
            os.close(descriptor)


def remove_abandoned_files(folder: Path) -> None:
    """Remove the partial files of killed processes from a folder."""
    for path in folder.glob(f"*{PARTIAL_SUFFIX}"):
        if not _NAME_OF_PARTIAL.search(path.name):
            continue
        with suppress(OSError):  # another process may have removed it, or given it its own name
            with open(path, "rb+", opener=_open_itself) as file:
                is_abandoned = lock(file.fileno())
                if is_abandoned and os.name != "nt":  # where an open file cannot be removed
                    path.unlink()
            age = 0.0 if is_abandoned is False else time.time() - path.stat().st_mtime
            if age > _ABANDONED_SECONDS:
                path.unlink()
