"""What `sdnn.machine` tells, with what else bears on these times: caches, Python, NumPy."""

from __future__ import annotations

import platform
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from sdnn.machine import n_cores, processor

if TYPE_CHECKING:
    from sdnn.benchmarks.results import Machine

_CACHE_FOLDER = Path("/sys/devices/system/cpu/cpu0/cache")
_MULTIPLES = {"K": 2**10, "M": 2**20, "G": 2**30}


def describe_machine() -> Machine:
    """Describe this machine; what cannot be found out is "unknown" or left out."""
    return {
        "processor": processor(),
        "system": f"{platform.system()} {platform.machine()}",
        "n_cores": n_cores(),
        "caches": _caches(_CACHE_FOLDER),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "blas": _blas(),
    }


def _caches(folder: Path) -> dict[str, int]:
    """Bytes of the first core's caches by name, such as L1d, L2."""
    caches = {}
    try:
        for index in sorted(folder.glob("index*")):
            kind = (index / "type").read_text().strip()
            if kind == "Instruction":
                continue
            name = f"L{(index / 'level').read_text().strip()}{'d' if kind == 'Data' else ''}"
            caches[name] = _bytes((index / "size").read_text().strip())
    except (OSError, ValueError):
        pass
    return caches


def _bytes(size: str) -> int:
    """Read a size such as 512K."""
    return int(size.rstrip("KMG")) * _MULTIPLES.get(size[-1:], 1)


def _blas() -> str:
    try:
        blas = np.show_config(mode="dicts")["Build Dependencies"]["blas"]
        return f"{blas['name']} {blas['version']}"
    except (KeyError, TypeError):
        return "unknown"
