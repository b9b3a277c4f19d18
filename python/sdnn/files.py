"""The one file format of agents, trainings and estimators, which the C++ core reads and writes too.

A file is a safetensors file whose metadata has one key, ``"sdnn"``: a JSON object of the kind,
the format's number, the library's version, a description and a checksum. The checksum stands at a
fixed place and covers every other byte. It is a CRC-32, which `zlib` has and C++ needs a table for:
it notices every error that spans at most 32 bits, and others but for one in 2**32. It protects
against accidents. Files are data and run no code, whoever wrote them.
"""

from __future__ import annotations

import json
import os
import zlib
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdnn._core import __version__
from sdnn.whole_files import open_regular, write_whole

__all__ = ["Arrays", "Description", "read_file", "write_file"]

FORMAT = 1
MAX_BYTES = 2**34

_BEGINNING = b'{"__metadata__":{"sdnn":"{\\"checksum\\":\\"'
"""Of the header, which follows 8 bytes that hold its length."""
_CHECKSUM = slice(8 + len(_BEGINNING), 16 + len(_BEGINNING))

Arrays = dict[str, NDArray[Any]]
Description = dict[str, Any]


def write_file(
    path: Path, kind: str, arrays: Mapping[str, NDArray[Any]], description: Mapping[str, Any]
) -> None:
    """Write a file, as a whole or not at all.

    Parameters
    ----------
    path
        Of the file.
    kind
        ``"agent"``, ``"training"`` or ``"estimator"``.
    arrays
        By name.
    description
        All else, as data that JSON can hold.

    Raises
    ------
    OSError
        If it cannot be written.
    """
    from safetensors.numpy import save

    about = {
        "checksum": "00000000",
        "description": description,
        "format": FORMAT,
        "kind": kind,
        "version": __version__,
    }
    text = json.dumps(about, sort_keys=True, separators=(",", ":"))
    contiguous = {name: np.asarray(array, order="C") for name, array in arrays.items()}
    data = memoryview(save(contiguous, metadata={"sdnn": text}))
    before, after = data[: _CHECKSUM.start], data[_CHECKSUM.stop :]
    write_whole(path, [before, _checksum(data), after])


def read_file(path: Path, *kinds: str) -> tuple[Description, Arrays]:
    """Read the description and the arrays of a file of one of these kinds.

    Raises
    ------
    OSError
        If it cannot be read or is not a regular file.
    ValueError
        If it is damaged, of another program or kind, or of another version of the format.
    """
    from safetensors import SafetensorError
    from safetensors.numpy import load

    with open_regular(path, MAX_BYTES) as file:
        if file.read(_CHECKSUM.start)[8:] != _BEGINNING:
            raise ValueError(
                f"{path} is not a file of sdnn, is damaged, or was written before files of sdnn had"
                " a checksum"
            )
        file.seek(0)
        data = file.read(os.fstat(file.fileno()).st_size)
    if data[_CHECKSUM] != _checksum(memoryview(data)):
        raise ValueError(f"{path} is damaged: its checksum does not fit its content")
    try:
        header = json.loads(data[8 : 8 + int.from_bytes(data[:8], "little")])
        about = json.loads(header["__metadata__"]["sdnn"])
        number, kind, version = (about[key] for key in ("format", "kind", "version"))
        description = dict(about["description"])
    except (LookupError, RecursionError, TypeError, ValueError) as error:
        raise ValueError(f"{path} is damaged: {error!r}") from None
    if number != FORMAT:
        raise ValueError(
            f"{path} has format {number}, written by sdnn {version}; this is sdnn {__version__},"
            f" which reads format {FORMAT}"
        )
    if kind not in kinds:
        raise ValueError(f"{path} is a file of kind {kind!r}, expected {' or '.join(kinds)}")
    try:
        return description, load(data)
    except (LookupError, SafetensorError, ValueError) as error:
        raise ValueError(f"{path} is damaged: {error}") from None


def _checksum(data: memoryview) -> bytes:
    """Return the CRC-32 of all bytes but the checksum's own, as 8 digits."""
    crc = zlib.crc32(data[_CHECKSUM.stop :], zlib.crc32(data[: _CHECKSUM.start]))
    return f"{crc:08x}".encode()
