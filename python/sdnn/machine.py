"""The machine: as much about it as the operating system tells."""

from __future__ import annotations

import os
import platform
from pathlib import Path

from sdnn.instruction_sets import instruction_set

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
