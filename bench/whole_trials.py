"""Whole trials of 15,000 episodes against dense products: the table in docs/performance.md.

python bench/whole_trials.py [trials per case], about five minutes for 10; they go to
the store docs/benchmarks.sqlite.xz, and what is there is not run again. Processor time of the
trial's own thread, two trials at a time; the dense
product of each network's size is measured between the trials, in the same process.
"""

from __future__ import annotations

import sys
import time
from typing import Any

import numpy as np
from measured import DOCS, Work, measure_missing, measured

from sdnn import _core
from sdnn.environments import SensorConfig
from sdnn.runs import RunSpec
from sdnn.runs.engine import trial_seed

KIND = "whole trials"
CASES = {"s4": (4, 0.0), "s6": (6, 0.0), "s4-noise": (4, 0.02), "s6-noise": (6, 0.02)}


def dense_microseconds(n_inputs: int) -> float:
    product = _core.DenseProduct(900, 200 * n_inputs * (n_inputs - 1), 1)
    return float(np.median(product.run(40)[10:])) / 1000


def measure(work: Work) -> dict[str, Any]:
    case, number = work
    n_inputs, noise = CASES[case]
    dense = dense_microseconds(n_inputs)
    sensors = SensorConfig(n_sensors=n_inputs, noise=noise)
    trial = RunSpec(sensors=sensors).make_trial(trial_seed(0, case, number))
    start = time.thread_time()
    trial.advance(15_000)
    seconds = time.thread_time() - start
    dense = float(np.median([dense, dense_microseconds(n_inputs)]))
    counts = trial.cache_counts()
    n = trial.n_decisions
    return {
        "decisions": n,
        "seconds": round(seconds, 3),
        "us_per_decision": round(seconds / n * 1e6, 2),
        "dense_us": round(dense, 1),
        "dense_over_decision": round(dense * n / seconds / 1e6, 2),
        "full_passes": round(counts["full"] / n, 3),
        "from_neighbours": round(counts["neighbour"] / n, 3),
        "columns_per_decision": round(counts["columns"] / n),
    }


def main(n_trials: int) -> None:
    asked = [(case, number) for number in range(n_trials) for case in CASES]
    measure_missing(KIND, measure, asked, DOCS, 2)
    trials = measured(KIND, DOCS)
    for case in CASES:
        of = [found for (name, _), found in trials.items() if name == case]
        ratio = [row["dense_over_decision"] for row in of]
        seconds = [row["seconds"] for row in of]
        per_decision = {
            key: np.average([row[key] for row in of], weights=[row["decisions"] for row in of])
            for key in ("us_per_decision", "full_passes", "columns_per_decision")
        }
        print(
            f"| {case} | {len(of)} | {sum(row['decisions'] for row in of):,}",
            f"{np.median(seconds):.1f} ({min(seconds):.1f} - {max(seconds):.1f})",
            f"{per_decision['us_per_decision']:.1f}",
            f"{np.median(ratio):.1f} ({min(ratio):.1f} - {max(ratio):.1f})",
            f"{per_decision['full_passes']:.2f}",
            f"{per_decision['columns_per_decision']:.0f} |",
            sep=" | ",
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 4)
