"""The tasks of the comparison, clean, with noisy and with redundant sensors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import gymnasium as gym
import numpy as np
import two_torques
from numpy.typing import NDArray

from sdnn.runs import EnvironmentSpec

CONDITIONS: dict[str, dict[str, Any]] = {
    "clean": {},
    "noise": {"noise": 0.02},
    "redundant": {"redundant": 2},
}
"""What is done to the sensors: noise in parts of their ranges, means of neighbouring variables."""


@dataclass(frozen=True, kw_only=True)
class Task:
    """An environment and what counts as having learned it.

    Parameters
    ----------
    id
        Gymnasium's.
    steps
        Transitions that an agent may learn from.
    solved
        Mean return that solves it.
    random
        Mean return of random actions.
    kwargs
        Arguments of the environment.
    ranges
        Of variables for which the environment gives none, or ends that no policy comes near, as
        `EnvironmentSpec` takes them.
    options
        What a user of our agents would say of the task.
    """

    id: str
    steps: int = 200_000
    solved: float
    random: float
    kwargs: Mapping[str, Any] = field(default_factory=dict)
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    options: Mapping[str, Any] = field(default_factory=dict)

    def score(self, mean_return: float) -> float:
        """Put a return on a scale: 0 is that of random actions, 1 solves the task."""
        return (mean_return - self.random) / (self.solved - self.random)

    def make(self, condition: str, evaluation: bool = False) -> gym.Env[Any, Any]:
        """Make the environment; under all conditions but "clean" observations are in [0, 1]."""
        environment = self._environment(condition)
        return environment.make("evaluation_sensor_noise" if evaluation else "sensor_noise")

    def ends(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Give the lowest and highest values of the variables, shape (l,)."""
        env = self.make("clean")
        env.close()
        return self._environment("clean").ends(env)

    def _environment(self, condition: str) -> EnvironmentSpec:
        return EnvironmentSpec(
            id=self.id, kwargs=self.kwargs, ranges=self.ranges, **CONDITIONS[condition]
        )

    def make_unscaled(self, condition: str, evaluation: bool = False) -> gym.Env[Any, Any]:
        """Make it with observations in their own units, for agents that were tuned to these.

        A redundant variable then is the mean of two that were scaled to [-1, 1].
        """
        env = self.make(condition, evaluation)
        if condition == "clean":
            return env
        low, high = self.ends()
        n_redundant = env.observation_space.shape[0] - low.size
        low = np.append(low, np.full(n_redundant, -1.0))
        high = np.append(high, np.full(n_redundant, 1.0))
        # A Box's ends have its type: those of float32 are what the clean task has.
        space = gym.spaces.Box(low.astype(np.float32), high.astype(np.float32))
        return gym.wrappers.TransformObservation(env, partial(_between, low, high), space)


def _between(low, high, observation):
    return (low + observation * (high - low)).astype(np.float32)


# What a landing goes through; the space has speeds up to 10 and turns of 2 pi.
_LANDING = ((-1, 1), (-0.2, 1.6), (-1, 1), (-1.5, 0.5), (-1, 1), (-1.5, 1.5), (0, 1), (0, 1))

TASKS = {
    "CartPole": Task(
        id="CartPole-v1",
        solved=475.0,
        random=22.4,
        ranges={"0": (-2.4, 2.4), "1": (-3.0, 3.0), "2": (-0.21, 0.21), "3": (-3.5, 3.5)},
    ),
    "Pendulum": Task(
        id="Pendulum-v1", solved=-200.0, random=-1208.0, options={"angle_pairs": [(0, 1)]}
    ),
    "MountainCar": Task(id="MountainCar-v0", solved=-110.0, random=-200.0),
    "MountainCarContinuous": Task(id="MountainCarContinuous-v0", solved=90.0, random=-33.1),
    "Acrobot": Task(
        id="Acrobot-v1",
        solved=-100.0,
        random=-486.5,
        options={"angle_pairs": [(0, 1), (2, 3)]},
    ),
    "LunarLanderContinuous": Task(
        id="LunarLander-v3",
        kwargs={"continuous": True},
        steps=300_000,
        solved=200.0,
        random=-210.4,
        ranges={str(i): ends for i, ends in enumerate(_LANDING)},
        options={"observation_range": tuple(zip(*_LANDING, strict=True))},
    ),
    # Solved is what comes near the best of some hundred proportional controllers: -13.6 and -23.6.
    "Reaching": Task(id=two_torques.REACHING, steps=60_000, solved=-20.0, random=-112.2),
    "Wheels": Task(
        id=two_torques.WHEELS,
        steps=60_000,
        solved=-30.0,
        random=-92.7,
        options={"angle_pairs": [(1, 2)]},
    ),
}
