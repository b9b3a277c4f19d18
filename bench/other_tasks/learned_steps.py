"""The time of a learned step of SDNNActorCritic beside stream AC's, without the environment's.

    python bench/other_tasks/learned_steps.py [--tasks Hopper-v5 ...]

Both train in the library's loop, by turns of some milliseconds in one process, after 5,000 steps. A
wrapper measures the processor time of the environment, which is subtracted. Prints medians of the
turns, and of their ratios. Needs `gymnasium[mujoco]`.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import gymnasium as gym
import numpy as np
from page import markdown
from streaming import NetworksConfig, StreamAC, StreamingConfig
from training_steps import WARM_UP, training

from sdnn.agents import SDNNActorCritic, Training

TASKS = ("Reacher-v5", "Hopper-v5", "HalfCheetah-v5", "Walker2d-v5", "Swimmer-v5")


class Clocked(gym.Wrapper):
    """An environment that measures its own time."""

    seconds = 0.0

    def reset(self, **options):
        """Begin an episode."""
        began = time.thread_time()
        result = self.env.reset(**options)
        self.seconds += time.thread_time() - began
        return result

    def step(self, action):
        """Step."""
        began = time.thread_time()
        result = self.env.step(action)
        self.seconds += time.thread_time() - began
        return result


def turns(agent, task: str):
    """Train on, and yield the microseconds of a step without the environment's of each turn."""
    env = Clocked(gym.make(task))
    steps = training(agent, env)
    before = next(steps)
    while True:
        began = time.thread_time() - env.seconds
        after = next(steps)
        yield (time.thread_time() - env.seconds - began) * 1e6 / (after - before)
        before = after


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--tasks", nargs="+", default=TASKS)
    parser.add_argument("--turns", type=int, default=100)
    options = parser.parse_args()
    rows = []
    for task in options.tasks:
        env = gym.make(task)
        baseline = StreamAC(
            env.observation_space,
            env.action_space,
            approximator=NetworksConfig(),
            learning=StreamingConfig(),
            seed=1,
        )
        agents = SDNNActorCritic(env, seed=1, history="none"), baseline
        for agent in agents:
            Training(agent, env, steps=WARM_UP, seed=1).run()
        pair = [turns(agent, task) for agent in agents]
        times = np.array([[next(turn) for turn in pair] for _ in range(options.turns)])
        ours, theirs = np.median(times, axis=0)
        ratio = np.median(times[:, 0] / times[:, 1])
        rows.append((task, f"{ours:.0f}", f"{theirs:.0f}", f"{ratio:.2f}"))
    print(markdown(("task", "SDNNActorCritic, us", "stream AC, us", "ratio"), rows))


if __name__ == "__main__":
    main()
