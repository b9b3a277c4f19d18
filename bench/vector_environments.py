"""What several environments at once do to learning, per transition and per second.

    python bench/vector_environments.py [--seeds 10] [--tasks CartPole-v1,...] [--folder docs]

Each trial is a training with evaluations of 10 greedy episodes; it goes to the store
docs/benchmarks.sqlite.xz when it is done, and is not run again. At the end a table is printed.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from looks import Looks
from measured import DOCS, Work, measure_missing, measured
from page import markdown

from sdnn.agents import Training
from sdnn.runs import BudgetSpec, EnvironmentSpec, ProtocolSpec, RunSpec
from sdnn.runs.results import estimate_median

KIND = "vector environments"
TASKS = ("CartPole-v1", "Pendulum-v1")
SIZES = (1, 4, 16)
STEPS, EVERY = 15_000, 5_000
DUE = range(EVERY, STEPS + 1, EVERY)


class Returns(Looks):
    """Mean returns, and the time of a step until the last of them."""

    def look(self, training: Training, seconds: float) -> None:
        """Note one."""
        self.found.setdefault("step", []).append(training.n_steps)
        self.found.setdefault("mean_return", []).append(self.mean_return(training, 10))
        self.found["us_per_step"] = round(1e6 * seconds / training.n_steps, 1)


def measure(work: Work) -> dict[str, Any]:
    """Train with so many environments."""
    task, n_environments, seed = work
    spec = RunSpec(
        environment=EnvironmentSpec(id=task),
        protocol=ProtocolSpec(n_envs=int(n_environments), evaluate_every=0),
        budget=BudgetSpec(steps=STEPS),
        seed=seed,
    )
    return Returns(spec, DUE).learn()


def table_rows(folder: Path) -> Iterator[Sequence[str]]:
    """Medians over the seeds, with 95 % bootstrap intervals."""
    trials = measured(KIND, folder)
    for task in TASKS:
        for n in map(str, SIZES):
            own = [found for (*which, _), found in trials.items() if which == [task, n]]
            if own:
                middles = map(estimate_median, np.array([t["mean_return"] for t in own]).T)
                returns = (f"{m.value:.0f} ({m.lower:.0f} to {m.upper:.0f})" for m in middles)
                cost = np.median([trial["us_per_step"] for trial in own])
                yield task, n, str(len(own)), *returns, f"{cost:.0f}"


def main() -> None:
    """Run what is missing, then print the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--tasks", default=",".join(TASKS))
    parser.add_argument("--folder", type=Path, default=DOCS)
    options = parser.parse_args()
    asked = [
        (task, str(n), seed)
        for seed in range(options.seeds)
        for task in options.tasks.split(",")
        for n in SIZES
    ]
    measure_missing(KIND, measure, asked, options.folder)
    heads = (f"after {step:,} steps" for step in DUE)
    print(
        markdown(
            ("task", "environments", "seeds", *heads, "us per step"), table_rows(options.folder)
        )
    )


if __name__ == "__main__":
    main()
