"""Whole trials of 15,000 episodes beside dense products: a table of docs/evidence/performance.md.

    python bench/whole_trials.py [--seeds 10] [--jobs 2] [--redraw]

Some minutes for ten trials of a case. Processor time of a trial's own process, two at a time; the
dense product of each network's size is measured before and after the trial.
"""

from __future__ import annotations

import time
from collections.abc import Mapping
from typing import Any

import numpy as np
from measured import Key, grouped, measure_missing, options
from page import markdown, show

from sdnn import _core
from sdnn.reproduction import paper_spec
from sdnn.runs.trial import trial_seed

KIND = "whole trials"
CASES = {"s4": (4, 0.0), "s6": (6, 0.0), "s4-noise": (4, 0.02), "s6-noise": (6, 0.02)}
N_EPISODES = 15_000


def dense_microseconds(n_inputs: int) -> float:
    """Return the median time of a dense product of the network's size, after 10 that warm up."""
    product = _core.DenseProduct(900, 200 * n_inputs * (n_inputs - 1), 1)
    return float(np.median(product.run(40)[10:])) / 1000


def measure(case: str, number: int) -> dict[str, Any]:
    n_inputs, noise = CASES[case]
    dense = dense_microseconds(n_inputs)
    sensors = {"n_sensors": n_inputs, "noise": noise}
    spec = paper_spec(environment={"kwargs": {"sensors": sensors}})
    trial = spec.make_trial(trial_seed(0, case, number))
    start = time.thread_time()
    trial.advance(N_EPISODES)
    seconds = time.thread_time() - start
    dense = float(np.median([dense, dense_microseconds(n_inputs)]))
    counts, n = trial.cache_counts(), trial.n_decisions
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


def table(groups: Mapping[Key, list[dict[str, Any]]]) -> str:
    """Return the table of trials, which are grouped by case."""

    def cells(case):
        """Return the row of a case: medians and ranges of its trials, means over decisions."""

        def column(name):
            return np.array([row[name] for row in groups[case,]])

        def spread(name):
            values = column(name)
            return f"{np.median(values):.1f} ({values.min():.1f} - {values.max():.1f})"

        def mean(name, digits):
            return f"{np.average(column(name), weights=column('decisions')):.{digits}f}"

        return (
            case, spread("seconds"), mean("us_per_decision", 1), spread("dense_over_decision"),
            mean("full_passes", 2),
        )  # fmt: skip

    header = (
        "case", "seconds a trial", "us a decision", "times faster than a dense product",
        "full passes a decision",
    )  # fmt: skip
    return markdown(header, [cells(case) for case in CASES if (case,) in groups])


def main() -> None:
    arguments = options(__doc__ or "", seeds=10, jobs=2).parse_args()
    keys = [(case, number) for number in range(arguments.seeds) for case in CASES]
    measure_missing(KIND, measure, keys, arguments, apart=True)
    groups = grouped(KIND, arguments.folder)
    show({"whole trials": table(groups)}, arguments.folder / "performance.md")


if __name__ == "__main__":
    main()
