"""How agents and baselines do on Gymnasium's tasks: clean, with noise, with more sensors.

    python bench/other_tasks/run.py [--seeds 10] [--only WORD ...] [--jobs 2]
        [--folder docs/evidence] [--redraw] [--until-solved]

The study is study.toml; --only chooses by the words of case and variant: `--only sdnn-c CartPole`.
With --until-solved a training is evaluated every 1,000 steps by 100 episodes and ends when these
solve the task; use one job, so that what else the machine does meets all alike. At the end the
tables are printed and put into benchmarks.md, and other-tasks.png is drawn, all from the store.
SAC, TD3 and PPO need `pip install stable-baselines3`, LunarLanderContinuous `box2d`.
"""

from __future__ import annotations

import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from figure import draw
from measured import options
from page import show
from report import tables, until_solved_table
from studies import curves, run_study
from tasks import TASKS, parts_of

from sdnn.runs import RunSpec
from sdnn.runs.study import Study

STUDY = Path(__file__).with_name("study.toml")
KIND, SOLVED_KIND = "other tasks", "until solved"


def until_solved(spec: RunSpec, case: str) -> RunSpec:
    """Let a training end when it solves its task."""
    target = TASKS[parts_of(case)[0]].solved
    return spec.replace(
        budget=spec.budget.replace(target_return=target),
        protocol=spec.protocol.replace(evaluate_every=1000, evaluation_episodes=100),
    )


def main() -> None:
    """Run what is missing, then write tables and figure."""
    parser = options(__doc__ or "", seeds=10, jobs=2)
    parser.add_argument("--until-solved", action="store_true")
    given = parser.parse_args()
    study = Study(STUDY, n_trials=given.seeds)
    if given.until_solved:
        run_study(SOLVED_KIND, study, given, until_solved)
    else:
        run_study(KIND, study, given)
    if given.only:
        return
    found = curves(KIND, study, given)
    shown = tables(study, found)
    shown["until solved"] = until_solved_table(
        study, curves(SOLVED_KIND, study, given, until_solved)
    )
    show(shown, given.folder / "benchmarks.md")
    draw(study, found, given.folder / "other-tasks.png")


if __name__ == "__main__":
    main()
