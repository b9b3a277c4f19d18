"""The machine, and the vector instructions that the core uses on it.

The core picks the best level that the processor offers when it is first used. The environment
variable ``SDNN_INSTRUCTION_SET`` (``portable``, ``neon``, ``avx2`` or ``avx512``) or
`set_instruction_set` choose another one, for the whole process. Results have the same bits on all
levels; only the time differs.
"""

from __future__ import annotations

import os
import re
from contextlib import suppress
from pathlib import Path

from sdnn import _core
from sdnn.support.arguments import require

_PROCESSOR_FILE = Path("/proc/cpuinfo")


def processor() -> str:
    """Return the name of the processor, or "unknown"."""
    with suppress(OSError):
        if model := re.search(r"^model name\s*:(.*)", _PROCESSOR_FILE.read_text(), re.MULTILINE):
            return model[1].strip()
    import platform

    return platform.processor() or "unknown"


def n_cores() -> int:
    """Count the cores that this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def description() -> str:
    """Return processor and instruction set in use, the label of measured times."""
    return f"{processor()}, {instruction_set()}"


def build() -> dict[str, str]:
    """Return facts for bug reports: versions, compiler, platform, instruction sets."""
    import platform

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
    """Return the version of an installed package, or "missing"."""
    from importlib import metadata

    try:
        return metadata.version(package)
    except metadata.PackageNotFoundError:
        return "missing"


def instruction_set() -> str:
    """Return the vector instruction set in use, such as ``avx2``.

    Raises
    ------
    ValueError
        If SDNN_INSTRUCTION_SET names one that does not exist, or that this processor lacks.
    """
    return _core.instruction_set()


def available_instruction_sets() -> tuple[str, ...]:
    """Return the levels that can be chosen here, the best one last.

    >>> available_instruction_sets()[0]
    'portable'
    """
    return tuple(_core.available_instruction_sets())


def set_instruction_set(name: str) -> None:
    """Force a level of `available_instruction_sets`, for the whole process.

    Raises
    ------
    ValueError
        If there is no such level, or this processor does not offer it.

    Examples
    --------
    >>> before = instruction_set()
    >>> set_instruction_set("portable")
    >>> instruction_set()
    'portable'
    >>> set_instruction_set(before)
    """
    require(isinstance(name, str), "name", "be that of an instruction set", name, TypeError)
    _core.set_instruction_set(name)
