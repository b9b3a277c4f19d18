"""How the agents and their rivals do on Gymnasium's tasks: clean, with noise, with more sensors.

    python bench/other_tasks/run.py [--seeds 10] [--tasks CartPole,...] [--agents sdnn,...]
        [--conditions clean,...] [--jobs 2] [--folder docs] [--only-table]

A trial is a training that is looked at 20 times: 20 greedy episodes each time, 100 at the end. They
take no part in its processor time. Its rows go to docs/other-tasks.csv when it is done, and it is
not run again. At the end the tables are printed and put into docs/benchmarks.md, and
docs/other-tasks.png is drawn, all from the rows. In another --folder nothing of docs/ changes.
SAC, TD3 and PPO need `pip install stable-baselines3`, LunarLanderContinuous `box2d`.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from agents import CONTENDERS, train, work_for
from figure import draw
from looks import Looks
from page import show
from report import by_trial, tables
from rows import Work, read_rows, run_missing
from tasks import CONDITIONS, TASKS

DOCS = Path(__file__).parents[2] / "docs"
FIELDS = ("task", "condition", "agent", "seed", "steps", "cpu_seconds", "mean_return", "bytes")


def trial(work: Work) -> list[dict[str, Any]]:
    """Train and look."""
    rows: list[dict[str, Any]] = []
    train(work, lambda env, _, steps, seed: Looks(env, steps, seed, rows))
    own = dict(zip(FIELDS, work, strict=False))
    return [{**own, **row} for row in rows]


def main() -> None:
    """Run what is missing, then write table and figure."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--tasks", default=",".join(TASKS))
    parser.add_argument("--agents", default=",".join(CONTENDERS))
    parser.add_argument("--conditions", default=",".join(CONDITIONS))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--folder", type=Path, default=DOCS)
    parser.add_argument("--only-table", action="store_true")
    options = parser.parse_args()
    path = options.folder / "other-tasks.csv"
    if not options.only_table:
        asked = work_for(
            options.seeds,
            options.conditions.split(","),
            options.tasks.split(","),
            options.agents.split(","),
        )
        run_missing(trial, asked, path, FIELDS, options.jobs)
    trials = by_trial(read_rows(path))
    show(tables(trials), options.folder)
    draw(trials, options.folder / "other-tasks.png")


if __name__ == "__main__":
    main()
