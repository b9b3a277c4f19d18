"""The machine: as much about it as the operating system tells."""

from __future__ import annotations

import os
import platform
from importlib import metadata
from pathlib import Path

from sdnn import _core
from sdnn.instruction_sets import available_instruction_sets, instruction_set

_PROCESSOR_FILE = Path("/proc/cpuinfo")


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


def n_cores() -> int:
    """Count the cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def description() -> str:
    """Name the processor and the instruction set in use, as results of times are labelled."""
    return f"{processor()}, {instruction_set()}"


def build() -> dict[str, str]:
    """Tell what a report about a problem needs: versions, compiler, platform, instruction sets."""
    names = ("numpy", "gymnasium", "scikit-learn", "safetensors")
    available = ", ".join(available_instruction_sets())
    return {
        "sdnn": _core.__version__,
        "compiler": _core.compiler,
        "python": f"{platform.python_version()} ({platform.python_implementation()})",
        "platform": platform.platform(),
        "processor": f"{processor()}, {n_cores()} cores",
        "instruction sets": f"{available} (in use: {instruction_set()})",
        "packages": ", ".join(f"{name} {_version_of(name)}" for name in names),
    }


def _version_of(package: str) -> str:
    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "missing"
