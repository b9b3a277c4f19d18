"""How the agents and their rivals do on Gymnasium's tasks: clean, with noise, with more sensors.

    python bench/other_tasks/run.py [--seeds 10] [--tasks CartPole,...] [--agents sdnn-c,...]
        [--conditions clean,...] [--jobs 2] [--folder docs] [--only-table]

A trial is a training that is looked at 20 times: 20 greedy episodes each time, 100 at the end. They
take no part in its processor time. It goes to the store docs/benchmarks.sqlite.xz when it is done,
and is not run again. At the end the tables are printed and put into docs/benchmarks.md, and
docs/other-tasks.png is drawn, all from the store. In another --folder nothing of docs/ changes.
SAC, TD3 and PPO need `pip install stable-baselines3`, LunarLanderContinuous `box2d`.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[1]))

from agents import CONTENDERS, Trial, trials_of
from figure import draw
from looks import Curve
from measured import DOCS, measure_missing, measured
from page import show
from report import by_kind, tables
from tasks import CONDITIONS, TASKS

KIND = "other tasks"


def measure(trial: Trial) -> dict[str, Any]:
    """Train and look."""
    name, condition, kind, seed = trial
    return Curve(CONTENDERS[kind].spec(name, condition, seed)).learn()


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
    if not options.only_table:
        lists = (getattr(options, name).split(",") for name in ("conditions", "tasks", "agents"))
        asked = trials_of(options.seeds, *lists)
        measure_missing(KIND, measure, asked, options.folder, options.jobs)
    trials = by_kind(measured(KIND, options.folder))
    show(tables(trials), options.folder)
    draw(trials, options.folder / "other-tasks.png")


if __name__ == "__main__":
    main()
