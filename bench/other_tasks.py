"""How the agents do on Gymnasium's tasks, with one set of defaults.

    python bench/other_tasks.py [--seeds 10] [--tasks CartPole,...] [--jobs 2] [--folder DIR]

Each trial is a training and a greedy evaluation of 100 episodes; its row goes to
docs/other-tasks.csv when it is done, and is not run again. At the end the table of
docs/benchmarks.md is printed from the rows of the tasks and agents that were asked for.
"""

from __future__ import annotations

import argparse
import csv
import resource
import time
from collections.abc import Iterable
from concurrent.futures import ProcessPoolExecutor
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np

from sdnn.agents import RBFQLearning, SDNNQLearning, evaluate
from sdnn.agents.presets import PRESETS
from sdnn.approximators import RBFNetworkConfig
from sdnn.experiments.statistics import estimate_median

DOCS = Path(__file__).parents[1] / "docs"
N_EVALUATION_EPISODES = 100
FIELDS = ("task", "agent", "seed", "steps", "mean_return", "cpu_seconds", "us_per_step")


@dataclass(frozen=True, kw_only=True)
class Task:
    """An environment, and what counts as having learned it."""

    id: str
    steps: int
    solved: float
    options: dict[str, Any] = field(default_factory=dict)


TASKS = {
    "CartPole": Task(id="CartPole-v1", steps=200_000, solved=475.0),
    "Pendulum": Task(id="Pendulum-v1", steps=200_000, solved=-200.0),
    "MountainCar": Task(id="MountainCar-v0", steps=200_000, solved=-110.0),
    "MountainCarContinuous": Task(id="MountainCarContinuous-v0", steps=200_000, solved=90.0),
    "Acrobot": Task(id="Acrobot-v1", steps=200_000, solved=-100.0),
    "AcrobotAngles": Task(
        id="Acrobot-v1",
        steps=200_000,
        solved=-100.0,
        options={"angle_pairs": [(0, 1), (2, 3)]},
    ),
}


def sdnn(env, options, seed):
    """SDNN-C as it comes."""
    return SDNNQLearning(env.observation_space, env.action_space, seed=seed, **options)


def small(env, options, seed):
    """SDNN-C for small processors."""
    return SDNNQLearning(
        env.observation_space, env.action_space, preset="small", seed=seed, **options
    )


def rbf(env, options, seed):
    """The RBF network with the same learning."""
    sizes = RBFNetworkConfig(n_actions=PRESETS["general"].approximator.n_actions)
    return RBFQLearning(
        env.observation_space,
        env.action_space,
        approximator=sizes,
        learning=PRESETS["general"].learning,
        seed=seed,
        **options,
    )


AGENTS = {"sdnn": sdnn, "sdnn-small": small, "rbf": rbf}


def cpu_seconds() -> float:
    """Processor time of this process."""
    used = resource.getrusage(resource.RUSAGE_SELF)
    return used.ru_utime + used.ru_stime


def trial(work: tuple[str, str, int]) -> dict[str, Any]:
    """Train and evaluate."""
    name, kind, seed = work
    task = TASKS[name]
    env = gym.make(task.id)
    agent = AGENTS[kind](env, task.options, seed)
    began, wall = cpu_seconds(), time.perf_counter()
    agent.train(env, steps=task.steps)
    used, passed = cpu_seconds() - began, time.perf_counter() - wall
    found = evaluate(agent, gym.make(task.id), N_EVALUATION_EPISODES, seed=10**6 + seed)
    return {
        "task": name,
        "agent": kind,
        "seed": seed,
        "steps": task.steps,
        "mean_return": round(found.mean_return, 2),
        "cpu_seconds": round(used, 2),
        "us_per_step": round(1e6 * passed / task.steps, 1),
    }


def read_rows(path: Path) -> list[dict[str, str]]:
    """Rows of trials that are done."""
    if not path.exists():
        return []
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def table(rows: Iterable[dict[str, str]]) -> str:
    """The rows as a table: medians with 95 % bootstrap intervals over seeds."""
    lines = [
        "| task | agent | seeds | return | solved at | seeds that solve it | processor time |",
        "|---|---|---|---|---|---|---|",
    ]
    rows = list(rows)
    for name, task in TASKS.items():
        for kind in AGENTS:
            own = [r for r in rows if (r["task"], r["agent"]) == (name, kind)]
            if not own:
                continue
            returns = np.array([float(row["mean_return"]) for row in own])
            found = estimate_median(returns)
            seconds = np.median([float(row["cpu_seconds"]) for row in own])
            cells = [
                name,
                kind,
                str(len(own)),
                f"{found.value:.1f} [{found.lower:.1f}, {found.upper:.1f}]",
                f"{task.solved:g}",
                str((returns >= task.solved).sum()),
                f"{seconds:.1f} s",
            ]
            lines.append("| " + " | ".join(cells) + " |")
    return "\n".join(lines) + "\n"


def main() -> None:
    """Run what is missing and write the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--seeds", type=int, default=10)
    parser.add_argument("--tasks", default=",".join(TASKS))
    parser.add_argument("--agents", default=",".join(AGENTS))
    parser.add_argument("--jobs", type=int, default=2)
    parser.add_argument("--folder", type=Path, default=DOCS)
    options = parser.parse_args()
    tasks, agents = options.tasks.split(","), options.agents.split(",")
    path = options.folder / "other-tasks.csv"
    done = {(r["task"], r["agent"], int(r["seed"])) for r in read_rows(path)}
    missing = [
        (name, kind, seed)
        for seed in range(options.seeds)
        for name in tasks
        for kind in agents
        if (name, kind, seed) not in done
    ]
    is_new = not path.exists()
    with path.open("a", newline="") as file, ProcessPoolExecutor(options.jobs) as pool:
        writer = csv.DictWriter(file, FIELDS, lineterminator="\n")
        if is_new:
            writer.writeheader()
        for row in pool.map(trial, missing):
            writer.writerow(row)
            file.flush()
            print(*row.values())
    print(table(r for r in read_rows(path) if r["task"] in tasks and r["agent"] in agents))


if __name__ == "__main__":
    main()
