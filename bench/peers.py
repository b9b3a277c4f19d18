"""Measure a step of our agents and of others, and our estimators beside boosting, in one run.

    python bench/peers.py                  # writes docs/evidence/peers.json, a minute or two
    python bench/performance_tables.py

Agents, with the settings of other_tasks/study.toml, and environments with random actions take
turns. The time of a step is processor time without the environment's: the median of the turns.
EnvPool, whose threads count, is measured if it can be imported.
"""

from __future__ import annotations

import json
import os
import sys
import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

BENCH = Path(__file__).parent
sys.path[:0] = [str(BENCH / "other_tasks"), str(BENCH / "estimators")]

import large  # noqa: E402  (leaves libraries one thread, before they are imported)
import numpy as np  # noqa: E402
from training_steps import ROUNDS, make, slices, stepping, training  # noqa: E402

from sdnn.runs.study_file import StudyFile  # noqa: E402
from sdnn.support.machine import description  # noqa: E402

EVIDENCE = BENCH.parent / "docs" / "evidence"
TASKS = {"CartPole": "CartPole-v1", "Pendulum": "Pendulum-v1"}
AGENTS = (
    "q-lambda", "actor-critic", "sdnn-c", "rbf", "tiles", "tiles-pairs", "swift-sarsa",
    "stream-ac", "stream-q",
)  # fmt: skip
N_ENVS = 8
WARM_UP_SLICES = 400
TURNS = 100


def pooled(task: str, n_envs: int) -> Iterator[int]:
    """Step environments of EnvPool with random actions; yield the steps so far."""
    import envpool

    env = envpool.make_gymnasium(TASKS[task], num_envs=n_envs, num_threads=1)
    env.reset()
    actions = [np.stack([env.action_space.sample()] * n_envs) for _ in range(ROUNDS)]
    n_steps = 0
    while True:
        for action in actions:
            env.step(action)
        n_steps += n_envs * ROUNDS
        yield n_steps


def learner(study: StudyFile, task: str, variant: str) -> Iterator[int]:
    """Train an agent of the study for ever; yield the steps so far."""
    spec = study.combinations[task, variant].spec
    trial = spec.make_trial(1)
    return training(trial.training.agent, trial.training.env)


def steps(task: str) -> dict[str, float]:
    """Return microseconds of a step by what takes it; agents' without the environment's."""
    study = StudyFile(BENCH / "other_tasks" / "study.toml", n_trials=1)
    parts: dict[str, Callable[[], float]] = {
        f"Gymnasium, {n}": slices(stepping(make(TASKS[task], n), n)) for n in (1, N_ENVS)
    }
    try:
        parts |= {f"EnvPool, {n}": slices(pooled(task, n), time.process_time) for n in (1, N_ENVS)}
    except ImportError:
        print("EnvPool is not installed", file=sys.stderr)
    agents = {name: slices(learner(study, task, name)) for name in AGENTS}
    for take in agents.values():
        for _ in range(WARM_UP_SLICES):
            take()
    parts |= agents
    turns = [{name: take() for name, take in parts.items()} for _ in range(TURNS)]
    alone = "Gymnasium, 1"
    return {
        name: round(
            float(
                np.median([turn[name] - (turn[alone] if name in agents else 0) for turn in turns])
            ),
            2,
        )
        for name in parts
    }


def estimators() -> dict[str, Any]:
    """Return times of estimators on 1,000 rows of Friedman's problem."""
    return large.measure("Friedman 1", 1_000, 0)


def main() -> None:
    """Measure and store."""
    results = {
        "machine": description(),
        "load": round(os.getloadavg()[0], 1),
        "date": f"{datetime.now(UTC):%Y-%m-%d}",
        "steps": {task: steps(task) for task in TASKS},
        "estimators": estimators(),
    }
    text = json.dumps(results, indent=2) + "\n"
    (EVIDENCE / "peers.json").write_text(text)
    print(text)


if __name__ == "__main__":
    main()
