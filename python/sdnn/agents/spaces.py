"""Gymnasium spaces as the numbers that the core's agents work with."""

from __future__ import annotations

import abc
from typing import Any, Generic, TypeVar

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn import _core

__all__ = [
    "ContinuousActions",
    "DiscreteActions",
    "EvenActions",
    "UnitObservations",
    "discrete_actions",
]

CoreAction = TypeVar("CoreAction", int, float)
"""An action as an agent of the core has it: its index, or a number in [-1, 1]."""


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


class _Actions(abc.ABC, Generic[CoreAction]):
    """Actions of a space as the core has them, and back.

    The action taken last is remembered with what it was in the core; only other ones are looked
    up. What is remembered is its number, not the array given away, which others may change.
    """

    _taken: tuple[float, CoreAction] | None = None

    def take(self, core_action: CoreAction) -> Any:
        """Make the element of the space, and remember it."""
        action = self.element(core_action)
        self._taken = (np.asarray(action).item(), core_action)
        return action

    def core_action(self, action: Any) -> CoreAction:
        """Find what an element of the space is in the core; ValueError if it is none."""
        number = self._number(action)
        if self._taken is not None and number == self._taken[0]:
            return self._taken[1]
        return self._find(number)

    @abc.abstractmethod
    def element(self, core_action: CoreAction) -> Any:
        """Make the element of the space."""

    @abc.abstractmethod
    def _number(self, action: Any) -> float:
        """Read an element of the space; ValueError if it is none."""

    @abc.abstractmethod
    def _find(self, number: float) -> CoreAction:
        """Find what an action that was not taken last is in the core."""


class _BoxActions(_Actions[CoreAction]):
    """Actions of a ``Box`` of shape (1,)."""

    def __init__(self, space: gym.Space[Any]) -> None:
        low, high = _finite_bounds("action_space", space)
        if low.size != 1:
            raise ValueError(f"action_space must have 1 dimension, got {low.size}")
        self._low, self._high = float(low[0]), float(high[0])
        self._dtype = space.dtype

    def element(self, core_action: CoreAction) -> NDArray[Any]:
        """Make the element of the space, shape (1,)."""
        return np.array([self._value(core_action)], dtype=self._dtype)

    def _number(self, action: Any) -> float:
        value = np.asarray(action)
        is_number = value.size == 1 and value.dtype.kind in "biuf"
        if not is_number or not self._low <= value.item() <= self._high:
            raise ValueError(
                f"action must be one number in [{self._low}, {self._high}], got {action!r}"
            )
        return float(value.item())

    @abc.abstractmethod
    def _value(self, core_action: CoreAction) -> float:
        """Convert an action to the units of the space."""


class EvenActions(_BoxActions[int]):
    """A ``Box`` of shape (1,) cut evenly into ``n_actions``; other actions are the nearest one."""

    def __init__(self, space: gym.Space[Any], n_actions: int) -> None:
        super().__init__(space)
        self.n_actions = n_actions

    @property
    def values(self) -> NDArray[np.float64]:
        """The actions in order, shape (n_actions,)."""
        return np.array([self._value(index) for index in range(self.n_actions)])

    def _find(self, number: float) -> int:
        position = (number - self._low) / (self._high - self._low)
        return round(position * (self.n_actions - 1))

    def _value(self, core_action: int) -> float:
        return _core.action_value(core_action, self.n_actions, self._low, self._high)


class ContinuousActions(_BoxActions[float]):
    """A ``Box`` of shape (1,), of which the action taken last is the only one known."""

    def _find(self, number: float) -> float:
        raise ValueError(f"action must be that of the last exploring act, got {number}")

    def _value(self, core_action: float) -> float:
        low, high = self._low, self._high
        return min(max(0.5 * (low + high) + 0.5 * (high - low) * core_action, low), high)


class DiscreteActions(_Actions[int]):
    """The actions of a ``Discrete`` space."""

    def __init__(self, space: gym.spaces.Discrete) -> None:
        self._space = space
        self.n_actions = int(space.n)

    @property
    def values(self) -> NDArray[Any]:
        """The actions in order, shape (n_actions,)."""
        return np.arange(self.n_actions) + int(self._space.start)

    def element(self, core_action: int) -> Any:
        """Make the element of the space."""
        return self._space.start + core_action

    def _number(self, action: Any) -> float:
        value = np.asarray(action)
        start = int(self._space.start)
        is_whole = value.size == 1 and value.dtype.kind in "biuf" and value.item() % 1 == 0
        if not is_whole or not 0 <= int(value.item()) - start < self.n_actions:
            raise ValueError(f"action must be in {self._space}, got {action!r}")
        return int(value.item())

    def _find(self, number: float) -> int:
        return int(number) - int(self._space.start)


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
