"""Steps and processor time until a task is solved, agents side by side.

    python bench/other_tasks/until_solved.py [--seeds 10] [--tasks Pendulum,...] [--agents sdnn,...]
        [--only-table]

Every 1,000 steps a training is looked at; when 100 greedy episodes have the mean return that solves
the task, it ends. Looks take no part in its processor time. One trial at a time, the agents of a
seed one after the other, so that what else the machine does meets all alike. Rows go to
docs/until-solved.csv, what is there is not run again, and the table is put into docs/benchmarks.md.
"""

from __future__ import annotations

import argparse
import contextlib
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from agents import CONTENDERS, train, work_for
from looks import SolvedError, UntilSolved
from page import interval, markdown, show
from rows import Row, Work, read_rows, run_missing

from sdnn.runs.statistics import estimate_median

DOCS = Path(__file__).parents[2] / "docs"
FIELDS = ("task", "condition", "agent", "seed", "steps", "cpu_seconds", "mean_return", "solved")
INTERVAL = 1000
OURS = "sdnn"


def trial(work: Work) -> list[dict[str, Any]]:
    """Train until the task is solved, or to the end."""
    row: dict[str, Any] = dict(zip(FIELDS, work, strict=False))
    with contextlib.suppress(SolvedError):
        train(work, lambda env, task, _, seed: UntilSolved(env, INTERVAL, task.solved, seed, row))
    return [row]


def _until_solved(rows: Sequence[Row], name: str, kind: str, field: str) -> np.ndarray:
    """Steps or seconds by seed, infinite where the task was not solved."""
    return np.array(
        [
            float(row[field]) if row["solved"] == "1" else np.inf
            for row in rows
            if row["task"] == name and row["agent"] == kind
        ]
    )


def _times(ratio: float) -> str:
    return f"{ratio:,.{0 if ratio >= 10 else 1}f}x" if np.isfinite(ratio) else ""


def _table_rows(rows: Sequence[Row]) -> Iterator[Sequence[str]]:
    for name in dict.fromkeys(row["task"] for row in rows):
        ours = np.median(_until_solved(rows, name, OURS, "cpu_seconds"))
        for kind, contender in CONTENDERS.items():
            steps = _until_solved(rows, name, kind, "steps")
            if not steps.size:
                continue
            seconds = _until_solved(rows, name, kind, "cpu_seconds")
            spent = [float(r["cpu_seconds"]) / float(r["steps"]) for r in rows
                     if r["task"] == name and r["agent"] == kind]  # fmt: skip
            yield (
                name,
                contender.title,
                f"{np.isfinite(steps).sum()} of {steps.size}",
                interval(estimate_median(steps), 0),
                f"{1000 * np.median(spent):.3g} ms",
                interval(estimate_median(seconds), 1) + " s",
                _times(float(np.median(seconds) / ours)),
            )


def table(rows: Sequence[Row]) -> str:
    """Medians over seeds, with bootstrap intervals; a seed that never solves counts as never."""
    header = (
        "task", "agent", "seeds that solve it", "steps until then", "a step", "processor time",
        "of SDNN-C's",
    )  # fmt: skip
    return markdown(header, _table_rows(rows))


def main() -> None:
    """Run what is missing, then show the table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--tasks", default="CartPole,Pendulum,MountainCarContinuous")
    parser.add_argument("--agents", default="sdnn,tiles,sac,td3,ppo")
    parser.add_argument("--folder", type=Path, default=DOCS)
    parser.add_argument("--only-table", action="store_true")
    options = parser.parse_args()
    path = options.folder / "until-solved.csv"
    if not options.only_table:
        asked = work_for(
            options.seeds, ["clean"], options.tasks.split(","), options.agents.split(",")
        )
        run_missing(trial, asked, path, FIELDS, 1)
    show({"until solved": table(read_rows(path))}, options.folder)


if __name__ == "__main__":
    main()
