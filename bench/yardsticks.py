"""Runs ``sdnn bench``, and the dense product that a pass is compared with.

    python bench/yardsticks.py > docs/evidence/performance.json
    python bench/performance_tables.py

NumPy's linear algebra has one thread.
"""

from __future__ import annotations

import json
import os
import sys
import time
from pathlib import Path

# Read when NumPy is loaded.
for name in ("OPENBLAS_NUM", "MKL_NUM", "OMP_NUM", "BLIS_NUM", "VECLIB_MAXIMUM"):
    os.environ[f"{name}_THREADS"] = "1"

import numpy as np  # noqa: E402

from sdnn import _core  # noqa: E402
from sdnn.benchmarks.measurements import (  # noqa: E402
    QUICK,
    SEED,
    Effort,
    at_level,
    in_turns,
    network_parts,
    run_benchmarks,
    spread,
)
from sdnn.support.machine import available_instruction_sets  # noqa: E402

CACHE_FOLDER = Path("/sys/devices/system/cpu/cpu0/cache")
MULTIPLES = {"K": 2**10, "M": 2**20, "G": 2**30}


def of_network(network, effort):
    """Compare passes of a network that `measure_network` has measured with dense products.

    Spreads are those of ``dense``, a float32 product of n_hidden_units x n_columns weights by who
    computes it, in turns with passes. ``ratio_to_dense`` is the time of ``values`` over that of the
    quickest.
    """
    size = network["n_hidden_units"], network["n_columns"]
    parts = network_parts(network["n_inputs"], effort)
    levels = available_instruction_sets()
    dense = {"numpy": numpy_product(*size), "core": _core.DenseProduct(*size, SEED).run}
    passes = {level: at_level(level, parts.time_values) for level in levels}
    times = {name: spread(turns) for name, turns in in_turns({**passes, **dense}, effort).items()}
    least_dense = min(times[name]["median"] for name in dense)
    return {
        "values": {level: times[level] for level in levels},
        "dense": {name: times[name] for name in dense},
        "ratio_to_dense": {level: times[level]["median"] / least_dense for level in levels},
    }


def numpy_product(n_rows, n_columns):
    """Return the run of NumPy's product; calling it from here costs less than a microsecond."""
    generator = np.random.default_rng(SEED)
    weights = generator.random((n_rows, n_columns), dtype=np.float32)
    vector = generator.random(n_columns, dtype=np.float32)
    out = np.empty(n_rows, dtype=np.float32)

    def run(n):
        times = np.empty(n, dtype=np.int64)
        for i in range(n):
            begin = time.perf_counter_ns()
            np.dot(weights, vector, out=out)
            times[i] = time.perf_counter_ns() - begin
        return times

    return run


def caches(folder=CACHE_FOLDER):
    """Return the bytes of the first core's caches by name, such as L1d, L2."""
    measured = {}
    try:
        for index in sorted(folder.glob("index*")):
            kind, level, size = (
                (index / name).read_text().strip() for name in ("type", "level", "size")
            )
            if kind != "Instruction":
                name = f"L{level}{'d' if kind == 'Data' else ''}"
                measured[name] = int(size.rstrip("KMG")) * MULTIPLES.get(size[-1:], 1)
    except (OSError, ValueError):
        pass
    return measured


def blas():
    """Return the name and version of the library that computes NumPy's product."""
    try:
        measured = np.show_config(mode="dicts")["Build Dependencies"]["blas"]
    except (KeyError, TypeError):
        return "unknown"
    return f"{measured['name']} {measured['version']}"


def measure(*, quick=False):
    """Return the results of ``sdnn bench --json``, with the yardsticks of each network."""
    results = run_benchmarks(quick=quick)
    effort = QUICK if quick else Effort()
    machine = {**results["machine"], "caches": caches(), "blas": blas()}
    networks = [{**network, **of_network(network, effort)} for network in results["networks"]]
    return {**results, "machine": machine, "networks": networks}


if __name__ == "__main__":
    json.dump(measure(quick="--quick" in sys.argv[1:]), sys.stdout, indent=2)
