"""How the agents and their rivals do on Gymnasium's tasks: clean, with noise, with more sensors.

    python bench/other_tasks/run.py [--seeds 10] [--tasks CartPole,...] [--agents sdnn,...]
        [--conditions clean,...] [--jobs 2] [--only-table]

A trial is a training that is looked at 20 times: 20 greedy episodes each time, 100 at the end. They
take no part in its processor time. Its rows go to docs/other-tasks.csv when it is done, and it is
not run again. At the end the tables are printed and docs/other-tasks.png is drawn from the rows.
Rivals need `pip install stable-baselines3 streaming-deep-rl`, LunarLanderContinuous `box2d`.
"""

from __future__ import annotations

import argparse
from pathlib import Path
from typing import Any

from agents import CONTENDERS
from looks import Looks
from report import draw, tables
from rows import Work, read_rows, run_missing
from tasks import CONDITIONS, TASKS

DOCS = Path(__file__).parents[2] / "docs"
FIELDS = ("task", "condition", "agent", "seed", "steps", "cpu_seconds", "mean_return", "bytes")


def trial(work: Work) -> list[dict[str, Any]]:
    """Train and look."""
    name, condition, kind, seed = work
    task, contender = TASKS[name], CONTENDERS[kind]
    make = task.make_unscaled if contender.in_own_units else task.make
    steps = contender.steps.get(name, task.steps)
    looks = Looks(make(condition, evaluation=True), steps, seed)
    contender.learn(name, condition, steps, seed, looks)
    own = {"task": name, "condition": condition, "agent": kind, "seed": seed}
    return [{**own, **row} for row in looks.rows]


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
        asked = [
            (name, condition, kind, seed)
            for seed in range(options.seeds)
            for condition in options.conditions.split(",")
            for kind in options.agents.split(",")
            for name in options.tasks.split(",")
            if name in CONTENDERS[kind].tasks
        ]
        run_missing(trial, asked, path, FIELDS, options.jobs)
    rows = read_rows(path)
    print(tables(rows))
    draw(rows, options.folder / "other-tasks.png")


if __name__ == "__main__":
    main()
