"""Steps and processor time until a task is solved, agents side by side.

    python bench/other_tasks/until_solved.py [--seeds 10] [--tasks Pendulum,...]
        [--agents sdnn-c,...] [--only-table]

Every 1,000 steps a training is looked at; when 100 greedy episodes have the mean return that solves
the task, it ends. Looks take no part in its processor time. One trial at a time, the agents of a
seed one after the other, so that what else the machine does meets all alike. Trials go to the
store docs/benchmarks.sqlite.xz, what is there is not run again, and the table is put into
docs/benchmarks.md.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from agents import CONTENDERS, Trial, trials_of
from looks import UntilSolved
from measured import DOCS, measure_missing, measured
from page import interval, markdown, show
from report import OURS, Trials, by_kind
from tasks import TASKS

from sdnn.runs.results import estimate_median

KIND = "until solved"
INTERVAL = 1000


def measure(trial: Trial) -> dict[str, Any]:
    """Train until the task is solved, or to the end."""
    name, condition, kind, seed = trial
    spec = CONTENDERS[kind].spec(name, condition, seed)
    return UntilSolved(spec, INTERVAL, TASKS[name].solved).learn()


def _until_solved(trials: Sequence[Mapping[str, Any]], field: str) -> np.ndarray:
    """Steps or seconds by seed, infinite where the task was not solved."""
    return np.array([trial[field] if trial["solved"] else np.inf for trial in trials], float)


def _times(ratio: float) -> str:
    return f"{ratio:,.{0 if ratio >= 10 else 1}f}x" if np.isfinite(ratio) else ""


def _table_rows(trials: Trials) -> Iterator[Sequence[str]]:
    for name in TASKS:
        for kind, contender in CONTENDERS.items():
            own = trials.get((name, "clean", kind))
            if not own:
                continue
            steps, seconds = _until_solved(own, "steps"), _until_solved(own, "cpu_seconds")
            ours = np.median(_until_solved(trials[name, "clean", OURS], "cpu_seconds"))
            spent = [trial["cpu_seconds"] / trial["steps"] for trial in own]
            yield (
                name,
                contender.title,
                f"{np.isfinite(steps).sum()} of {steps.size}",
                interval(estimate_median(steps), 0),
                f"{1000 * np.median(spent):.3g} ms",
                interval(estimate_median(seconds), 1) + " s",
                _times(float(np.median(seconds) / ours)),
            )


def table(trials: Trials) -> str:
    """Medians over seeds, with bootstrap intervals; a seed that never solves counts as never."""
    header = (
        "task", "agent", "seeds that solve it", "steps until then", "a step", "processor time",
        "of SDNN-C's",
    )  # fmt: skip
    return markdown(header, _table_rows(trials))


def main() -> None:
    """Run what is missing, then show the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--tasks", default="CartPole,Pendulum,MountainCarContinuous")
    parser.add_argument("--agents", default="sdnn-c,tiles,sac,td3,ppo")
    parser.add_argument("--folder", type=Path, default=DOCS)
    parser.add_argument("--only-table", action="store_true")
    options = parser.parse_args()
    if not options.only_table:
        lists = (options.tasks.split(","), options.agents.split(","))
        asked = trials_of(options.seeds, ["clean"], *lists)
        measure_missing(KIND, measure, asked, options.folder)
    show({"until solved": table(by_kind(measured(KIND, options.folder)))}, options.folder)


if __name__ == "__main__":
    main()
