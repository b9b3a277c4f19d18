"""Benchmarks: how long the parts of a decision take here, and what this machine allows.

``sdnn bench`` on the command line; `run_benchmarks` from Python.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import Any

__all__ = ["BenchmarkError", "run_benchmarks"]

# NumPy's linear algebra reads these when it is loaded.
_ONE_THREAD = {
    f"{name}_THREADS": "1"
    for name in ("OPENBLAS_NUM", "MKL_NUM", "OMP_NUM", "BLIS_NUM", "VECLIB_MAXIMUM")
}


class BenchmarkError(Exception):
    """The measuring process failed; the message is its last line."""


def run_benchmarks(*, quick: bool = False) -> dict[str, Any]:
    """Measure everything in a new process and return the results as ``sdnn bench --json`` does.

    In that process NumPy's linear algebra has one thread, and nothing else has touched the memory.
    With `quick` there are few repetitions: to see that it works, not how quick it is.

    Raises
    ------
    BenchmarkError
        If the process fails.
    """
    command = [sys.executable, "-m", "sdnn.benchmarks.measurements", *(["--quick"] * quick)]
    done = subprocess.run(
        command, env=os.environ | _ONE_THREAD, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        lines = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
        raise BenchmarkError(lines[-1])
    results: dict[str, Any] = json.loads(done.stdout)
    return results
