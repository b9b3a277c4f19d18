"""Runs the measurements in a process of their own."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from sdnn.benchmarks.results import Results

ONE_THREAD = {
    name: "1"
    for name in (
        "OPENBLAS_NUM_THREADS",
        "MKL_NUM_THREADS",
        "OMP_NUM_THREADS",
        "BLIS_NUM_THREADS",
        "VECLIB_MAXIMUM_THREADS",
    )
}
"""What makes NumPy's linear algebra use one thread; it is read when NumPy is loaded."""


class BenchmarkError(Exception):
    """The measuring process failed; the message is its last line."""


def run_benchmarks(*, quick: bool = False) -> Results:
    """Measure everything and return the results.

    A new process does it, in which NumPy's linear algebra has one thread and nothing else has
    touched the memory.

    Parameters
    ----------
    quick : bool
        Few repetitions: to see that it works, not how quick it is.

    Raises
    ------
    BenchmarkError
        If the process fails.
    """
    command = [sys.executable, "-m", "sdnn.benchmarks", *(["--quick"] if quick else [])]
    done = subprocess.run(
        command, env=os.environ | ONE_THREAD, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        lines = done.stderr.strip().splitlines() or [f"exit code {done.returncode}"]
        raise BenchmarkError(lines[-1])
    results: Results = json.loads(done.stdout)
    return results
