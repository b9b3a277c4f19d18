"""Files that are written whole or not at all, files that are safe to open, and agents' format.

The C++ core reads and writes the one format of agents, trainings and estimators, too. A file is a
safetensors file whose metadata has one key, ``"sdnn"``: a JSON object of the kind, the format's
number, the library's version, a description and a checksum at a fixed place, which covers every
other byte. The checksum is a CRC-32: it detects every error that spans at most 32 bits, and others
but for one in 2**32. It protects against accidents. Files are data: reading a file runs no code.
"""

from __future__ import annotations

import errno
import json
import os
import re
import secrets
import stat
import time
import zlib
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any, BinaryIO, TextIO

import numpy as np
from numpy.typing import NDArray

from sdnn._core import __version__

PARTIAL_SUFFIX = ".partial"  # suffix of a file that is being written
_NAME_OF_PARTIAL = re.compile(r"\.[0-9a-f]{16}\.partial$")
_ABANDONED_SECONDS = 60
"""Age of a partial file that counts as abandoned, on file systems without locks; chosen."""

_FOLDERS_OF_DEVICES = tuple(map(Path, ("/dev", "/dev/fd", "/proc/self/fd")))
"""Names in these folders, such as ``/dev/stdout``, are written to and never replaced."""

FORMAT = 1
MAX_BYTES = 2**34  # largest file of an agent, as in core/safetensors.hpp
MOST_EMPTY_ARRAYS = 1024
"""Number of arrays that a file may have in addition to one per two bytes of content.

It is a chosen limit, the same as in core/safetensors.hpp.
"""

_LENGTH_BYTES = 8
_BEGINNING = b'{"__metadata__":{"sdnn":"{\\"checksum\\":\\"'
"""Start of the header, behind the bytes that hold the header's length."""
_CHECKSUM = slice(_LENGTH_BYTES + len(_BEGINNING), _LENGTH_BYTES + len(_BEGINNING) + 8)

_TYPES = ("BOOL", "I8", "I16", "I32", "I64", "U8", "U16", "U32", "U64", "F16", "F32", "F64")
"""Types of arrays, as safetensors names them: those of NumPy."""

Array = NDArray[Any]
Arrays = dict[str, Array]
Description = dict[str, Any]

_NO_LINK = getattr(os, "O_NOFOLLOW", 0)
_NO_WAITING = getattr(os, "O_NONBLOCK", 0)


@contextmanager
def whole_file(path: Path) -> Iterator[BinaryIO]:
    """Open a temporary file in the same folder; at the end of the block it replaces ``path``.

    Its name is unpredictable. A link or a pipe called ``path`` is replaced, and its target stays
    unchanged. OSError if the file cannot be written; an earlier file then stays unchanged.
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
            if os.name == "nt":  # Windows cannot rename an open file
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

    OSError if the file cannot be written; an earlier file then stays unchanged.
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
    """Open a file, perhaps the target of a link; never wait for the writer of a pipe."""
    return os.open(name, flags | _NO_WAITING)


def read_bytes(path: Path, max_bytes: int) -> bytes:
    """Read a regular file; OSError if it cannot be opened, is not regular or is too large."""
    with open_regular(path, max_bytes) as file:
        return file.read(os.fstat(file.fileno()).st_size)


def open_to_append(path: Path) -> TextIO:
    """Open a regular file to append lines; create it if missing.

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
    import filelock  # slow to import

    try:
        return filelock.lock_descriptor(descriptor, blocking=False)
    except OSError:  # the folder's file system has no locks
        return None


def _new_file(path: Path) -> BinaryIO:
    """Create the partial file; its lock shows other processes that it is not abandoned."""
    while True:
        name = f"{path.name}.{secrets.token_hex(8)}{PARTIAL_SUFFIX}"
        try:
            file = path.with_name(name).open("xb")  # O_EXCL follows no link
        except OSError as error:
            error.filename = str(path)  # the one that the caller knows
            raise
        # Another process may have removed the file before it was locked.
        if lock(file.fileno()) is not False and os.path.exists(file.name):
            return file
        file.close()


def _sync_folder(folder: Path) -> None:
    """Write the names in a folder to disk, if the system and the folder's permissions allow it."""
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
        with suppress(OSError):  # another process may have removed or renamed it
            with open(path, "rb+", opener=_open_itself) as file:
                is_locked = lock(file.fileno())
                if is_locked is False:  # its writer is alive
                    continue
                if is_locked and os.name != "nt":
                    path.unlink()
                    continue
            # Windows cannot remove an open file, and files without locks show their age only.
            if time.time() - path.stat().st_mtime > _ABANDONED_SECONDS:
                path.unlink()


def write_file(
    path: Path, kind: str, arrays: Mapping[str, Array], description: Mapping[str, object]
) -> None:
    """Write a file of an ``"agent"``, ``"training"`` or ``"estimator"``, whole or not at all.

    ``arrays`` are stored by name; ``description`` is all else, as data that JSON can hold. OSError
    if it cannot be written.
    """
    from safetensors.numpy import save

    about = {
        "checksum": "00000000",  # its place, replaced below
        "description": description,
        "format": FORMAT,
        "kind": kind,
        "version": __version__,
    }
    text = json.dumps(about, sort_keys=True, separators=(",", ":"))
    contiguous = {name: np.asarray(array, order="C") for name, array in arrays.items()}
    data = memoryview(save(contiguous, metadata={"sdnn": text}))
    if data[_LENGTH_BYTES : _CHECKSUM.start] != _BEGINNING:
        raise RuntimeError("not saved: this version of safetensors orders its header otherwise")
    before, after = data[: _CHECKSUM.start], data[_CHECKSUM.stop :]
    write_whole(path, [before, _checksum(data), after])


def read_file(path: Path, *contents: str) -> tuple[Description, Arrays]:
    """Read the description and the arrays of a file whose content is one of ``contents``.

    These are kinds as of `write_file`. OSError if the file cannot be opened or is not a regular
    file; ValueError if it is damaged, of another program, or has another content or format.
    """
    from safetensors import SafetensorError
    from safetensors.numpy import load

    data = _intact_bytes(path)
    end = _LENGTH_BYTES + int.from_bytes(data[:_LENGTH_BYTES], "little")
    # A header that lists far more arrays than the content can hold would take long to read.
    n_arrays, n_bytes = data.count(b'"dtype"', _LENGTH_BYTES, end), max(len(data) - end, 0)
    if n_arrays > MOST_EMPTY_ARRAYS + n_bytes // 2:
        raise ValueError(f"{path} is damaged: it has {n_arrays} arrays in {n_bytes} bytes")
    try:
        header = json.loads(data[_LENGTH_BYTES:end])
        about = json.loads(header["__metadata__"]["sdnn"])
        number, content, version = (about[key] for key in ("format", "kind", "version"))
        description = dict(about["description"])
        types = {name: header[name]["dtype"] for name in header.keys() - {"__metadata__"}}
    except (LookupError, RecursionError, TypeError, ValueError) as error:
        raise ValueError(f"{path} is damaged: {error!r}") from None
    if number != FORMAT:
        raise ValueError(
            f"{path} has format {number}, written by sdnn {version}; this is sdnn {__version__},"
            f" which reads format {FORMAT}"
        )
    if content not in contents:
        raise ValueError(f"{path} is a file of kind {content!r}, expected {' or '.join(contents)}")
    for name, array_type in types.items():
        if array_type not in _TYPES:
            problem = f"must have one of the types {', '.join(_TYPES)}, got {array_type!r}"
            raise ValueError(f"{path} is damaged: array {name} {problem}")
    try:
        return description, load(data)
    except (LookupError, SafetensorError, ValueError) as error:
        raise ValueError(f"{path} is damaged: {error}") from None


def _intact_bytes(path: Path) -> bytes:
    """Read a file of this format; ValueError if its beginning or its checksum does not fit."""
    with open_regular(path, MAX_BYTES) as file:
        if file.read(_CHECKSUM.start)[_LENGTH_BYTES:] != _BEGINNING:
            raise ValueError(f"{path} is not a file of sdnn, or is damaged")
        file.seek(0)
        data = file.read(os.fstat(file.fileno()).st_size)
    if data[_CHECKSUM] != _checksum(memoryview(data)):
        raise ValueError(f"{path} is damaged: its checksum does not fit its content")
    return data


def _checksum(data: memoryview) -> bytes:
    """Return the CRC-32 of all bytes but the checksum's own, as 8 digits."""
    crc = zlib.crc32(data[_CHECKSUM.stop :], zlib.crc32(data[: _CHECKSUM.start]))
    return f"{crc:08x}".encode()
