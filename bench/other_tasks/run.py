"""How agents and baselines do on Gymnasium's tasks: clean, and with other sensors.

    python bench/other_tasks/run.py [--seeds 10] [--only WORD ...] [--jobs 2]
        [--folder docs/evidence] [--redraw] [--full]

The study is study.toml; --only chooses by the words of case and variant: `--only sdnn-c CartPole`.
At the end the tables are printed and put into benchmarks.md, the figures are drawn, and the
medians of baselines are written for `sdnn plot --baseline`, all from the store; --full prints every
case and agent along the way, too. SAC, TD3 and PPO need `pip install stable-baselines3`,
LunarLander `box2d`, Hopper and others `mujoco`.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

from figure import draw, draw_overview
from measured import options
from page import show
from report import along_the_way, stored_returns, tables
from studies import curves, run_study

from sdnn.runs.study_file import StudyFile
from sdnn.support.files import write_whole

STUDY = Path(__file__).with_name("study.toml")
KIND = "other tasks"
BASELINES = Path(__file__).parents[2] / "python" / "sdnn" / "runs" / "baselines.json"


def main() -> None:
    """Run what is missing, then write tables and figure."""
    arguments = options(__doc__ or "", seeds=10, jobs=2).parse_args()
    study = StudyFile(STUDY, n_trials=arguments.seeds)
    run_study(KIND, study, arguments)
    if arguments.only:
        return
    results = curves(KIND, study, arguments)
    show(tables(study, results), arguments.folder / "benchmarks.md")
    if arguments.full:
        print(along_the_way(study, results))
    draw(study, results, arguments.folder / "other-tasks.png")
    draw_overview(study, results, arguments.folder / "tasks-overview.png")
    content = json.dumps(stored_returns(study, results), indent=1) + "\n"
    write_whole(BASELINES, content.encode())


if __name__ == "__main__":
    main()
