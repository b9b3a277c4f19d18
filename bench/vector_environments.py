"""What several environments at once do to learning, per transition and per second.

    python bench/vector_environments.py [--seeds 10] [--tasks CartPole-v1,...] [--folder DIR]

Each trial is a training with evaluations of 10 greedy episodes; its rows go to
docs/vector-environments.csv when it is done, and is not run again. At the end a table is printed
from the rows.
"""

from __future__ import annotations

import argparse
import csv
import resource
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from sdnn.agents import Callback, SDNNQLearning, Training, evaluate
from sdnn.runs.statistics import estimate_median

DOCS = Path(__file__).parents[1] / "docs"
FIELDS = ("task", "n_environments", "seed", "step", "mean_return", "us_per_step")
TASKS = ("CartPole-v1", "Pendulum-v1")
SIZES = (1, 4, 16)
STEPS, EVERY = 15_000, 5_000


def cpu_seconds() -> float:
    """Processor time of this process."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


class Evaluations(Callback):
    """Greedy episodes now and then, whose time is not counted."""

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        self._env = env
        self.seconds = 0.0
        self.returns: dict[int, float] = {}

    def on_step(self, training: Training) -> None:
        """Evaluate where it is due."""
        if training.n_steps % EVERY == 0:
            began = cpu_seconds()
            self.returns[training.n_steps] = evaluate(training.agent, self._env, 10).mean_return
            self.seconds += cpu_seconds() - began


def trial(task: str, n: int, seed: int) -> list[dict[str, Any]]:
    """Train with so many environments; rows of the evaluations, and the time of a step."""
    envs = gym.vector.SyncVectorEnv([lambda: gym.make(task)] * n)
    agent = SDNNQLearning(envs.single_observation_space, envs.single_action_space, seed=seed)
    evaluations = Evaluations(gym.make(task))
    began = cpu_seconds()
    agent.train(envs, steps=STEPS, callbacks=[evaluations])
    used = cpu_seconds() - began - evaluations.seconds
    return [
        {
            "task": task,
            "n_environments": n,
            "seed": seed,
            "step": step,
            "mean_return": round(mean_return, 2),
            "us_per_step": round(1e6 * used / STEPS, 1),
        }
        for step, mean_return in evaluations.returns.items()
    ]


def read_rows(path: Path) -> list[dict[str, str]]:
    """Rows of trials that are done."""
    if not path.exists():
        return []
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def table(rows: list[dict[str, str]]) -> str:
    """Medians over the seeds, with 95 % bootstrap intervals."""
    steps = range(EVERY, STEPS + 1, EVERY)
    heads = [f"after {step:,} steps" for step in steps]
    lines = [
        "| task | environments | seeds | " + " | ".join(heads) + " | us per step |",
        "|---" * (len(heads) + 4) + "|",
    ]
    for task in TASKS:
        for n in SIZES:
            own = [r for r in rows if (r["task"], r["n_environments"]) == (task, str(n))]
            if not own:
                continue
            cells = []
            for step in steps:
                found = [float(r["mean_return"]) for r in own if r["step"] == str(step)]
                middle = estimate_median(np.array(found))
                cells.append(f"{middle.value:.0f} ({middle.lower:.0f} to {middle.upper:.0f})")
            seeds = {row["seed"] for row in own}
            cost = float(np.median([float(row["us_per_step"]) for row in own]))
            lines.append(f"| {task} | {n} | {len(seeds)} | {' | '.join(cells)} | {cost:.0f} |")
    return "\n".join(lines)


def main() -> None:
    """Run what is missing, then print the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--tasks", default=",".join(TASKS))
    parser.add_argument("--folder", type=Path, default=DOCS)
    options = parser.parse_args()
    path = options.folder / "vector-environments.csv"
    done = {(r["task"], r["n_environments"], r["seed"]) for r in read_rows(path)}
    for seed in range(options.seeds):
        for task in options.tasks.split(","):
            for n in SIZES:
                if (task, str(n), str(seed)) in done:
                    continue
                rows = trial(task, n, seed)
                is_new = not path.exists()
                with path.open("a", newline="") as file:
                    writer = csv.DictWriter(file, FIELDS)
                    if is_new:
                        writer.writeheader()
                    writer.writerows(rows)
    print(table(read_rows(path)))


if __name__ == "__main__":
    main()
