"""The one format of files of agents, trainings and estimators.

The C++ core reads and writes the format, too. A file is a safetensors file whose metadata has one
key, ``"sdnn"``: a JSON object of the kind, the format's number, the library's version, a
description and a checksum at a fixed place, which covers every other byte. The checksum is a
CRC-32: it detects every error that spans at most 32 bits, and others but for one in 2**32. It
protects against accidents. Files are data: reading a file runs no code.
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
from sdnn.support.files import open_regular, write_whole

FORMAT = 1
MAX_BYTES = 2**34
MOST_EMPTY_ARRAYS = 1024
"""Arrays that a file may have beyond one for two bytes of all of them."""

_BEGINNING = b'{"__metadata__":{"sdnn":"{\\"checksum\\":\\"'
"""Start of the header, which follows 8 bytes that hold its length."""
_CHECKSUM = slice(8 + len(_BEGINNING), 16 + len(_BEGINNING))

_TYPES = ("BOOL", "I8", "I16", "I32", "I64", "U8", "U16", "U32", "U64", "F16", "F32", "F64")
"""Types of arrays, as safetensors names them: those of NumPy."""

Array = NDArray[Any]
Arrays = dict[str, Array]
Description = dict[str, Any]


def write_file(
    path: Path, content: str, arrays: Mapping[str, Array], description: Mapping[str, object]
) -> None:
    """Write a file of an ``"agent"``, ``"training"`` or ``"estimator"``, whole or not at all.

    ``arrays`` are stored by name; ``description`` is all else, as data that JSON can hold. OSError
    if it cannot be written.
    """
    from safetensors.numpy import save

    about = {
        "checksum": "00000000",
        "description": description,
        "format": FORMAT,
        "kind": content,
        "version": __version__,
    }
    text = json.dumps(about, sort_keys=True, separators=(",", ":"))
    contiguous = {name: np.asarray(array, order="C") for name, array in arrays.items()}
    data = memoryview(save(contiguous, metadata={"sdnn": text}))
    if data[8 : _CHECKSUM.start] != _BEGINNING:
        raise RuntimeError("not saved: this version of safetensors orders its header otherwise")
    before, after = data[: _CHECKSUM.start], data[_CHECKSUM.stop :]
    write_whole(path, [before, _checksum(data), after])


def read_file(path: Path, *contents: str) -> tuple[Description, Arrays]:
    """Read the description and the arrays of a file that holds one of these contents.

    OSError as of `open_regular`; ValueError if it is damaged, of another program or kind, or of
    another version of the format.
    """
    from safetensors import SafetensorError
    from safetensors.numpy import load

    with open_regular(path, MAX_BYTES) as file:
        if file.read(_CHECKSUM.start)[8:] != _BEGINNING:
            raise ValueError(f"{path} is not a file of sdnn, or is damaged")
        file.seek(0)
        data = file.read(os.fstat(file.fileno()).st_size)
    if data[_CHECKSUM] != _checksum(memoryview(data)):
        raise ValueError(f"{path} is damaged: its checksum does not fit its content")
    end = 8 + int.from_bytes(data[:8], "little")
    n_arrays, n_bytes = data.count(b'"dtype"', 8, end), max(len(data) - end, 0)
    if n_arrays > MOST_EMPTY_ARRAYS + n_bytes // 2:
        raise ValueError(f"{path} is damaged: it has {n_arrays} arrays in {n_bytes} bytes")
    try:
        header = json.loads(data[8:end])
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


def _checksum(data: memoryview) -> bytes:
    """Return the CRC-32 of all bytes but the checksum's own, as 8 digits."""
    crc = zlib.crc32(data[_CHECKSUM.stop :], zlib.crc32(data[: _CHECKSUM.start]))
    return f"{crc:08x}".encode()
