"""Observations of any range, brought into [0, 1]."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn.bounds import with_infinities

__all__ = ["UnitSensors"]


class UnitSensors(
    gym.ObservationWrapper[NDArray[np.float64], Any, NDArray[Any]], gym.utils.RecordConstructorArgs
):
    """Scales every observed variable to [0, 1]; values outside its range saturate.

    With it, `NoisySensors` fits any environment: its sigma then is in parts of each range.

    Parameters
    ----------
    env : gymnasium.Env
        With a one-dimensional ``Box`` of observations, shape (l,).
    observation_low, observation_high : array_like, shape (l,), optional
        The ranges; by default the bounds of the observation space.

    Attributes
    ----------
    observation_low, observation_high : numpy.ndarray, shape (l,)
        As used.

    Raises
    ------
    ValueError
        For observations of another kind, ranges of another length or without an extent, and
        infinite bounds for which no range is given.

    Examples
    --------
    >>> import gymnasium as gym
    >>> env = UnitSensors(gym.make("Pendulum-v1"))
    >>> env.observation_space
    Box(0.0, 1.0, (3,), float64)
    """

    def __init__(
        self,
        env: gym.Env[NDArray[Any], Any],
        observation_low: ArrayLike | None = None,
        observation_high: ArrayLike | None = None,
    ) -> None:
        gym.utils.RecordConstructorArgs.__init__(
            self, observation_low=observation_low, observation_high=observation_high
        )
        super().__init__(env)
        space = env.observation_space
        if not isinstance(space, gym.spaces.Box) or len(space.shape) != 1:
            raise ValueError(f"env must have a one-dimensional Box of observations, got {space}")
        self.observation_low = _ends("observation_low", observation_low, space.low)
        self.observation_high = _ends("observation_high", observation_high, space.high)
        if not (self.observation_low < self.observation_high).all():
            raise ValueError(
                "observation_low must be below observation_high,"
                f" got {self.observation_low} and {self.observation_high}"
            )
        self.observation_space = gym.spaces.Box(0.0, 1.0, space.shape, np.float64)

    def observation(self, observation: NDArray[Any]) -> NDArray[np.float64]:
        """Scale an observation, shape (l,)."""
        values = np.asarray(observation, np.float64)
        low, high = self.observation_low, self.observation_high
        return np.clip((values - low) / (high - low), 0.0, 1.0)


def _ends(name: str, given: ArrayLike | None, bounds: NDArray[Any]) -> NDArray[np.float64]:
    """Lower or upper ends of all ranges, shape (l,)."""
    ends = with_infinities(np.asarray(bounds if given is None else given, np.float64))
    if ends.shape != bounds.shape:
        raise ValueError(
            f"{name} must have {bounds.size} numbers, one per observed variable, got {given!r}"
        )
    is_bounded = np.isfinite(ends)
    if not is_bounded.all():
        unbounded = ", ".join(str(i) for i in np.flatnonzero(~is_bounded))
        raise ValueError(
            f"{name} must be given where observations are unbounded (variables {unbounded} of"
            f" {bounds.size}, from 0): one finite number per variable; values outside saturate"
        )
    return ends
