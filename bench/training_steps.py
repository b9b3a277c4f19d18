"""How long a step of training takes in Python, and what of it is the environment and the core.

    python bench/training_steps.py [--tasks CartPole-v1 ...] [--agents q-lambda ...]

In turn, a hundred rounds or so each: a training, the environment alone with random actions, and the
calls of the core that act and learn, minus such calls for no environment. Of each the quickest
twentieth counts: other work on the machine can only add to it. "beside" is the training minus the
environment, "of it" that against the environment, and "ratio" the training against environment and
core together.
"""

from __future__ import annotations

import argparse
import itertools
import time
from collections.abc import Callable, Iterator
from typing import Any

import gymnasium as gym
import numpy as np
from page import markdown

import sdnn.environments  # noqa: F401  (registers the acrobot)
from sdnn.agents import SDNNQLambda, SDNNQLearning, Training

AGENTS = {kind.kind: kind for kind in (SDNNQLambda, SDNNQLearning)}
HEADER = (
    "task", "agent", "environments", "training", "environment", "core", "beside", "of it", "ratio",
)  # fmt: skip
SECONDS = 2e-3
ROUNDS = 100
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
    actions = [env.action_space.sample() for _ in range(ROUNDS)]
    n_steps = 0
    while True:
        for action in actions:
            _, _, terminated, truncated, _ = env.step(action)
            if n_envs == 1 and (terminated or truncated):
                env.reset()
        n_steps += n_envs * ROUNDS
        yield n_steps


def training(learner: Any, env: Any) -> Iterator[int]:
    """Train for ever; yield the steps so far."""
    endless = Training(learner, env, steps=10**9, seed=1)
    for _ in endless.pieces(SECONDS):
        yield endless.n_steps


def slices(
    steps: Iterator[int], clock: Callable[[], float] = time.thread_time
) -> Callable[[], float]:
    """Return a function that takes some steps and returns the microseconds of one."""
    done = next(steps)

    def take() -> float:
        nonlocal done
        before, began = done, clock()
        done = next(steps)
        return (clock() - began) * 1e6 / (done - before)

    return take


def core_slices(
    learner: Any, task: str, n_envs: int, environments: list[int]
) -> Callable[[], float]:
    """Return a function that has the core act and learn in some environments of n.

    It returns the microseconds of a step, of which there are n in each round.
    """
    core, read, batch, _ = learner.core_parts()
    core.n_environments = n_envs
    env = gym.make_vec(task, num_envs=n_envs, vectorization_mode="sync")
    latest = read("observation", env.reset(seed=0)[0])
    every = list(range(n_envs))

    def rounds() -> Iterator[tuple[Any, ...]]:
        nonlocal latest
        for _ in range(ROUNDS):
            before, actions = latest, batch([None] * n_envs)
            core.act_each(latest, every, actions)
            observations, rewards, terminated, _, _ = env.step(actions)
            latest = read("next_observation", observations)
            ends = terminated.tolist()
            yield before, actions, rewards.tolist(), latest, ends, [False] * n_envs

    def take() -> float:
        steps = list(rounds())
        began = time.thread_time()
        for step in steps:
            core.act_each(step[0], environments, step[1])
            core.learn_each(*step, environments, n_envs, 0, None)
        return (time.thread_time() - began) * 1e6 / (ROUNDS * n_envs)

    return take


def main() -> None:
    """Print a table, in microseconds."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--tasks", nargs="+", default=["CartPole-v1", "Pendulum-v1"])
    parser.add_argument("--agents", nargs="+", choices=AGENTS, default=list(AGENTS))
    parser.add_argument("--n-envs", nargs="+", type=int, default=[1, 8])
    parser.add_argument("--repeats", type=int, default=500)
    options = parser.parse_args()
    rows = []
    for task, agent, n_envs in itertools.product(options.tasks, options.agents, options.n_envs):
        env = make(task, 1)
        learners = [
            AGENTS[agent](env.observation_space, env.action_space, seed=1) for _ in range(2)
        ]
        for learner in learners:
            learner.train(env, steps=WARM_UP)
        parts = (
            slices(training(learners[0], make(task, n_envs))),
            slices(stepping(make(task, n_envs), n_envs)),
            core_slices(learners[1], task, n_envs, list(range(n_envs))),
            core_slices(learners[1], task, n_envs, []),
        )
        times = [[take() for take in parts] for _ in range(options.repeats)]
        trained, alone, core, calls = np.percentile(times, PERCENT, axis=0)
        core -= calls
        cells = (f"{us:.1f}" for us in (trained, alone, core, trained - alone))
        ratios = (f"{x:.2f}" for x in (trained / alone - 1, trained / (alone + core)))
        rows.append((task, agent, str(n_envs), *cells, *ratios))
    print(markdown(HEADER, rows))


if __name__ == "__main__":
    main()
