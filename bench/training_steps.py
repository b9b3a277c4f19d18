"""How long a step of training takes in Python, beside the environment's own.

    python bench/training_steps.py [--tasks CartPole-v1 ...] [--agents sdnn-linear ...]

Twenty steps of a training and twenty of the environment alone, with random actions, in turn. Of
each the quickest twentieth counts: other work on the machine can only add to it. The difference is
what the agent takes, with all that Python does around it.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable, Iterator
from typing import Any

import gymnasium as gym
import numpy as np
from page import markdown

import sdnn.environments  # noqa: F401  (registers the acrobot)
from sdnn.agents import SDNNQLearning, SDNNSarsa, Training

AGENTS = {kind.kind: kind for kind in (SDNNSarsa, SDNNQLearning)}
HEADER = ("task", "agent", "environments", "training", "environment alone", "difference", "ratio")
CALLS = 20
PERCENT = 5
WARM_UP = 5_000


def make(task: str, n_envs: int) -> Any:
    """Make one environment, or a vector."""
    if n_envs == 1:
        return gym.make(task)
    return gym.make_vec(task, num_envs=n_envs, vectorization_mode="sync")


def stepping(env: Any, n_envs: int) -> Iterator[int]:
    """Step an environment with random actions; yield the steps so far."""
    env.reset(seed=0)
    env.action_space.seed(0)
    actions = [env.action_space.sample() for _ in range(1_000)]
    n_steps = 0
    while True:
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action)
            if n_envs == 1 and (terminated or truncated):
                env.reset()
            n_steps += n_envs
            yield n_steps


def training(learner: Any, env: Any) -> Iterator[int]:
    """Train for ever; yield the steps so far."""
    endless = Training(learner, env, steps=10**9, seed=1)
    for _ in endless.pieces(0.0):
        yield endless.n_steps


def slices(steps: Iterator[int]) -> Callable[[], float]:
    """Return a function that takes some steps and returns the microseconds of one."""
    done = next(steps)

    def take() -> float:
        nonlocal done
        before, began = done, time.thread_time()
        for _ in range(CALLS):
            done = next(steps)
        return (time.thread_time() - began) * 1e6 / (done - before)

    return take


def main() -> None:
    """Print a table, in microseconds."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--tasks", nargs="+", default=["CartPole-v1", "Pendulum-v1"])
    parser.add_argument("--agents", nargs="+", choices=AGENTS, default=list(AGENTS))
    parser.add_argument("--n-envs", nargs="+", type=int, default=[1, 8])
    parser.add_argument("--repeats", type=int, default=500)
    given = parser.parse_args()
    rows = []
    for task in given.tasks:
        for agent in given.agents:
            for n_envs in given.n_envs:
                env = make(task, 1)
                learner = AGENTS[agent](env.observation_space, env.action_space, seed=1)
                learner.train(env, steps=WARM_UP)
                both = (
                    slices(training(learner, make(task, n_envs))),
                    slices(stepping(make(task, n_envs), n_envs)),
                )
                times = [[take() for take in both] for _ in range(given.repeats)]
                trained, alone = np.percentile(times, PERCENT, axis=0)
                cells = (f"{us:.1f}" for us in (trained, alone, trained - alone))
                rows.append((task, agent, str(n_envs), *cells, f"{trained / alone:.2f}"))
    print(markdown(HEADER, rows))


if __name__ == "__main__":
    main()
