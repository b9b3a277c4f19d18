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
import csv
import time
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

import numpy as np
from agents import CONTENDERS
from report import draw, read_rows, tables
from tasks import CONDITIONS, TASKS

DOCS = Path(__file__).parents[2] / "docs"
N_LOOKS = 20
N_EPISODES, N_LAST_EPISODES = 20, 100
FIELDS = ("task", "condition", "agent", "seed", "steps", "cpu_seconds", "mean_return", "bytes")

Work = tuple[str, str, str, int]


class Looks:
    """Looks at a learner from time to time, and keeps its own time out of the learner's."""

    def __init__(self, env, steps: int, seed: int) -> None:
        self.rows: list[dict[str, Any]] = []
        self._env, self._seed = env, seed
        self._due = [steps * (i + 1) // N_LOOKS for i in range(N_LOOKS)]
        self._began = time.process_time()

    def __call__(self, n_steps, policy, memory) -> None:
        """Evaluate where it is due."""
        if not self._due or n_steps < self._due[0]:
            return
        paused = time.process_time()
        while self._due and n_steps >= self._due[0]:
            self._due.pop(0)
        n_episodes = N_EPISODES if self._due else N_LAST_EPISODES
        returns = [self._episode(policy, number) for number in range(n_episodes)]
        self.rows.append(
            {
                "steps": n_steps,
                "cpu_seconds": round(paused - self._began, 2),
                "mean_return": round(float(np.mean(returns)), 2),
                "bytes": memory() if not self._due else "",
            }
        )
        self._began += time.process_time() - paused

    def _episode(self, policy, number: int) -> float:
        observation, _ = self._env.reset(seed=10**6 * (self._seed + 1) + number)
        total, is_over = 0.0, False
        while not is_over:
            observation, reward, terminated, truncated, _ = self._env.step(policy(observation))
            total += float(reward)
            is_over = terminated or truncated
        return total


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
        done = {(r["task"], r["condition"], r["agent"], int(r["seed"])) for r in read_rows(path)}
        asked: list[Work] = [
            (name, condition, kind, seed)
            for seed in range(options.seeds)
            for condition in options.conditions.split(",")
            for kind in options.agents.split(",")
            for name in options.tasks.split(",")
            if name in CONTENDERS[kind].tasks
        ]
        run([work for work in asked if work not in done], path, options.jobs)
    rows = read_rows(path)
    print(tables(rows))
    draw(rows, options.folder / "other-tasks.png")


def run(missing: list[Work], path: Path, n_jobs: int) -> None:
    """Run trials side by side; those that are done are kept, whatever happens to others."""
    is_new = not path.exists()
    with (
        path.open("a", newline="") as file,
        ProcessPoolExecutor(n_jobs, max_tasks_per_child=1) as pool,
    ):
        writer = csv.DictWriter(file, FIELDS, lineterminator="\n")
        if is_new:
            writer.writeheader()
        for future in as_completed([pool.submit(trial, work) for work in missing]):
            rows = future.result()
            writer.writerows(rows)
            file.flush()
            print(*rows[-1].values(), flush=True)


if __name__ == "__main__":
    main()
