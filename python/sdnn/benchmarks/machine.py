"""The machine: as much about it as the operating system tells."""

from __future__ import annotations

import os
import platform
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

if TYPE_CHECKING:
    from sdnn.benchmarks.results import Machine

_PROCESSOR_FILE = Path("/proc/cpuinfo")
_CACHE_FOLDER = Path("/sys/devices/system/cpu/cpu0/cache")
_MULTIPLES = {"K": 2**10, "M": 2**20, "G": 2**30}


def describe_machine() -> Machine:
    """Describe this machine; what cannot be found out is "unknown" or left out."""
    return {
        "processor": processor(),
        "system": f"{platform.system()} {platform.machine()}",
        "n_cores": _n_cores(),
        "caches": _caches(_CACHE_FOLDER),
        "python": platform.python_version(),
        "numpy": np.__version__,
        "blas": _blas(),
    }


def processor() -> str:
    """Name of the processor, or "unknown"."""
    try:
        for line in _PROCESSOR_FILE.read_text().splitlines():
            name, _, value = line.partition(":")
            if name.strip() == "model name":
                return value.strip()
    except OSError:
        pass
    return platform.processor() or "unknown"


def _n_cores() -> int:
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


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
