"""The tasks of the comparison, clean, with noisy and with redundant sensors."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import two_torques

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
    angle_pairs
        Cosines and sines, as a user of our agents would say.
    declares_ranges
        Whether that user would tell the ranges too.
    """

    id: str
    steps: int = 200_000
    solved: float
    random: float
    kwargs: Mapping[str, Any] = field(default_factory=dict)
    ranges: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    angle_pairs: tuple[tuple[int, int], ...] = ()
    declares_ranges: bool = False

    def score(self, mean_return: float) -> float:
        """Put a return on a scale: 0 is that of random actions, 1 solves the task."""
        return (mean_return - self.random) / (self.solved - self.random)

    def environment(
        self, condition: str, *, own_units: bool = False, with_ranges: bool = True
    ) -> EnvironmentSpec:
        """Specify the environment.

        Parameters
        ----------
        condition
            One of `CONDITIONS`; under all but "clean" observations are in [0, 1].
        own_units
            Whether they are in their own units there too, for what was tuned to these.
        with_ranges
            Whether a learner is told the ranges where observations are as the environment has them.
        """
        ranges = self.ranges if with_ranges or condition != "clean" else {}
        return EnvironmentSpec(
            id=self.id,
            kwargs=self.kwargs,
            ranges=ranges,
            own_units=own_units and condition != "clean",
            **CONDITIONS[condition],
        )


# What a landing goes through; the space has speeds up to 10 and turns of 2 pi.
_LANDING = ((-1, 1), (-0.2, 1.6), (-1, 1), (-1.5, 0.5), (-1, 1), (-1.5, 1.5), (0, 1), (0, 1))

TASKS = {
    "CartPole": Task(
        id="CartPole-v1",
        solved=475.0,
        random=22.4,
        ranges={"0": (-2.4, 2.4), "1": (-3.0, 3.0), "2": (-0.21, 0.21), "3": (-3.5, 3.5)},
    ),
    "Pendulum": Task(id="Pendulum-v1", solved=-200.0, random=-1208.0, angle_pairs=((0, 1),)),
    "MountainCar": Task(id="MountainCar-v0", solved=-110.0, random=-200.0),
    "MountainCarContinuous": Task(id="MountainCarContinuous-v0", solved=90.0, random=-33.1),
    "Acrobot": Task(
        id="Acrobot-v1",
        solved=-100.0,
        random=-486.5,
        angle_pairs=((0, 1), (2, 3)),
    ),
    "LunarLanderContinuous": Task(
        id="LunarLander-v3",
        kwargs={"continuous": True},
        steps=300_000,
        solved=200.0,
        random=-210.4,
        ranges={str(i): ends for i, ends in enumerate(_LANDING)},
        declares_ranges=True,
    ),
    # Solved is what comes near the best of some hundred proportional controllers: -13.6 and -23.6.
    "Reaching": Task(id=two_torques.REACHING, steps=60_000, solved=-20.0, random=-112.2),
    "Wheels": Task(
        id=two_torques.WHEELS,
        steps=60_000,
        solved=-30.0,
        random=-92.7,
        angle_pairs=((1, 2),),
    ),
}
