"""Gymnasium spaces as the numbers that the core's agents work with."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn import _core

__all__ = ["BoxRange", "DiscreteActions", "EvenActions", "UnitObservations", "discrete_actions"]


class UnitObservations:
    """Observations scaled to [0, 1] by the bounds of their space; values outside saturate."""

    def __init__(self, space: gym.Space[Any]) -> None:
        self._low, self._high = _finite_bounds("observation_space", space)

    @property
    def n_inputs(self) -> int:
        """Number of observed variables."""
        return self._low.size

    def __call__(self, name: str, observation: ArrayLike) -> NDArray[np.float64]:
        """Scale an observation; ValueError with its ``name`` for another shape or NaN."""
        values = np.asarray(observation, dtype=np.float64)
        if values.shape != self._low.shape:
            raise ValueError(f"{name} must have shape {self._low.shape}, got {values.shape}")
        if np.isnan(values).any():
            raise ValueError(f"{name} must not hold NaN, got {values}")
        return np.clip((values - self._low) / (self._high - self._low), 0.0, 1.0)


class BoxRange:
    """A ``Box`` of shape (1,): the range of one continuous action."""

    def __init__(self, space: gym.Space[Any]) -> None:
        low, high = _finite_bounds("action_space", space)
        if low.size != 1:
            raise ValueError(f"action_space must have 1 dimension, got {low.size}")
        self.low, self.high = float(low[0]), float(high[0])
        self._dtype = space.dtype

    def action(self, value: float) -> NDArray[Any]:
        """Make the element of the space, shape (1,)."""
        return np.array([value], dtype=self._dtype)

    def number(self, action: Any) -> float:
        """Read an action; ValueError unless it is one number in the range."""
        value = np.asarray(action)
        is_number = value.size == 1 and value.dtype.kind in "biuf"
        if not is_number or not self.low <= value.item() <= self.high:
            raise ValueError(
                f"action must be one number in [{self.low}, {self.high}], got {action!r}"
            )
        return float(value.item())


class EvenActions:
    """A ``Box`` of shape (1,) cut evenly into ``n_actions``."""

    def __init__(self, space: gym.Space[Any], n_actions: int) -> None:
        self._range = BoxRange(space)
        self.n_actions = n_actions

    @property
    def values(self) -> NDArray[np.float64]:
        """The actions in order, shape (n_actions,)."""
        return np.array([self._value(index) for index in range(self.n_actions)])

    def action(self, index: int) -> NDArray[Any]:
        """Make the element of the space, shape (1,)."""
        return self._range.action(self._value(index))

    def index(self, action: Any) -> int:
        """Find the nearest action's number; ValueError if it is outside the range."""
        share = (self._range.number(action) - self._range.low) / (
            self._range.high - self._range.low
        )
        return round(share * (self.n_actions - 1))

    def _value(self, index: int) -> float:
        return _core.action_value(index, self.n_actions, self._range.low, self._range.high)


class DiscreteActions:
    """The actions of a ``Discrete`` space."""

    def __init__(self, space: gym.spaces.Discrete) -> None:
        self._space = space
        self.n_actions = int(space.n)

    @property
    def values(self) -> NDArray[Any]:
        """The actions in order, shape (n_actions,)."""
        return np.arange(self.n_actions) + int(self._space.start)

    def action(self, index: int) -> Any:
        """Make the element of the space."""
        return self._space.start + index

    def index(self, action: Any) -> int:
        """Find the action's number; ValueError if the space does not hold it."""
        value = np.asarray(action)
        start = int(self._space.start)
        is_whole = value.size == 1 and value.dtype.kind in "biuf" and value.item() % 1 == 0
        if not is_whole or not 0 <= int(value.item()) - start < self.n_actions:
            raise ValueError(f"action must be in {self._space}, got {action!r}")
        return int(value.item()) - start


def discrete_actions(space: gym.Space[Any], n_actions: int) -> DiscreteActions | EvenActions:
    """Choose how actions are numbered: a ``Discrete`` space as it is, a ``Box`` cut evenly."""
    if isinstance(space, gym.spaces.Discrete):
        return DiscreteActions(space)
    if not isinstance(space, gym.spaces.Box):
        raise TypeError(f"action_space must be a Box or Discrete, got {type(space).__name__}")
    return EvenActions(space, n_actions)


def _finite_bounds(
    name: str, space: gym.Space[Any]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Read a one-dimensional Box's bounds as doubles; an error that names the argument if not."""
    if not isinstance(space, gym.spaces.Box):
        raise TypeError(f"{name} must be a Box, got {type(space).__name__}")
    if len(space.shape) != 1:
        raise ValueError(f"{name} must have shape (n,), got {space.shape}")
    low, high = space.low.astype(np.float64), space.high.astype(np.float64)
    if not (np.isfinite(low).all() and np.isfinite(high).all() and (low < high).all()):
        raise ValueError(
            f"{name} must have finite bounds, low < high, got {low} to {high}; "
            "pass a Box with the range that matters: values outside saturate"
        )
    return low, high
