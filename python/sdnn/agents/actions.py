"""Actions of a Gymnasium space as the numbers that the core's agents work with."""

from __future__ import annotations

import abc
from typing import Any, TypeAlias

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from sdnn import _core

__all__ = ["Actions", "ContinuousActions", "IndexedActions"]

Numbers: TypeAlias = list[Any]
"""A number per dimension: an index, or a number in [-1, 1]."""


def _bytes_of(action: Any) -> tuple[Any, bytes] | None:
    """Give the type and bytes of what NumPy holds, as elements of spaces are; None of others."""
    is_numpy = isinstance(action, np.ndarray | np.generic)
    return (action.dtype, action.tobytes()) if is_numpy else None


class Actions(abc.ABC):
    """Actions of a space as the core has them, a number for each dimension, and back.

    The action taken last in each environment is remembered with what it was in the core; only
    other ones are looked up. What is remembered are its bytes, not the array given away, which
    others may change.

    Parameters
    ----------
    space : gymnasium.Space
        Box with finite bounds, Discrete, MultiDiscrete or MultiBinary.

    Raises
    ------
    TypeError, ValueError
        For other spaces.

    Attributes
    ----------
    low, high : ndarray, shape (n_dimensions,)
        Of a Box: its bounds.
    start : ndarray, shape (n_dimensions,)
        Of the others: the first action.
    """

    def __init__(self, space: gym.Space[Any]) -> None:
        self.space = space
        self._taken: dict[int, tuple[Any, Numbers]] = {}
        self.is_box = isinstance(space, gym.spaces.Box)
        if isinstance(space, gym.spaces.Box):
            self.low, self.high = _finite_bounds(space)
            self.n_dimensions = self.low.size
        elif isinstance(space, gym.spaces.Discrete):
            self._sizes, self.start = [int(space.n)], np.array([int(space.start)])
        elif isinstance(space, gym.spaces.MultiDiscrete):
            self._sizes = [int(n) for n in space.nvec.reshape(-1)]
            self.start = np.asarray(space.start, np.int64).reshape(-1)
        elif isinstance(space, gym.spaces.MultiBinary):
            self._sizes = [2] * int(np.prod(space.shape))
            self.start = np.zeros(len(self._sizes), np.int64)
        else:
            raise TypeError(
                "action_space must be a Box, Discrete, MultiDiscrete or MultiBinary,"
                f" got {type(space).__name__}"
            )
        if not self.is_box:
            self.n_dimensions = len(self._sizes)
            _check_sizes(self._sizes, self.start)
        if not 0 < self.n_dimensions <= _MOST_DIMENSIONS:
            raise ValueError(
                f"action_space must have 1 to {_MOST_DIMENSIONS} dimensions, got {space}"
            )

    def take(self, numbers: Numbers, environment: int = 0) -> Any:
        """Make the element of the space, and remember it."""
        action = self.element(numbers)
        self._taken[environment] = (_bytes_of(action), numbers)
        return action

    def numbers(self, action: Any, environment: int = 0) -> Numbers:
        """Find what an element of the space is in the core; ValueError if it is none."""
        taken = self._taken.get(environment)
        if taken is None:
            return self._find(self.vector(action))
        known, numbers = taken
        if known == _bytes_of(action):
            return numbers
        values = self.vector(action)
        if np.array_equal(values, self.vector(self.element(numbers))):
            return numbers  # as a list, or in another type
        return self._find(values)

    def forget(self, n_environments: int) -> None:
        """Forget what was taken in environments that are no more."""
        for environment in [i for i in self._taken if i >= n_environments]:
            del self._taken[environment]

    def unclear(self) -> dict[int, Numbers]:
        """Give those taken last that an element of the space does not tell, by environment."""
        return {}

    def check(self, numbers: Numbers) -> None:
        """Raise ValueError or TypeError unless these are the numbers of an action."""
        self.vector(self._make(numbers))

    def element(self, numbers: Numbers) -> Any:
        """Make the element of the space."""
        return self._make(numbers)

    @abc.abstractmethod
    def _make(self, numbers: Numbers) -> Any:
        """Make the element of the space."""

    @abc.abstractmethod
    def random(self, generator: np.random.Generator) -> Numbers:
        """Draw an action."""

    @abc.abstractmethod
    def _find(self, values: NDArray[np.float64]) -> Numbers:
        """Find what an action that was not taken last is in the core."""

    def vector(self, action: Any) -> NDArray[np.float64]:
        """Read an element of the space, shape (n_dimensions,); ValueError if it is none."""
        try:
            values = np.asarray(action)
        except ValueError:  # lists of several lengths
            values = np.empty(0)
        fits = values.size == self.n_dimensions and values.dtype.kind in "biuf"
        if fits:
            values = values.reshape(-1).astype(np.float64)
            if self.is_box:
                fits = bool(((values >= self.low) & (values <= self.high)).all())
            else:
                at = values - self.start
                fits = bool(((at >= 0) & (at < self._sizes) & (at % 1 == 0)).all())
        if not fits:
            raise ValueError(f"action must be in {self.space}, got {action!r}")
        return values

    def _boxed(self, values: NDArray[np.float64]) -> NDArray[Any]:
        """Give numbers between the bounds the shape and type of the space."""
        space = self.space
        # Rounding to the type of the space must not leave it.
        rounded = self._rounded(values).astype(space.dtype).reshape(space.shape or ())
        boxed: NDArray[Any] = np.clip(rounded, space.low, space.high)  # type: ignore[attr-defined]
        return boxed

    @property
    def is_whole(self) -> bool:
        """Whether actions of a Box are whole numbers: the nearest ones, halves upwards."""
        return self.is_box and np.dtype(self.space.dtype).kind != "f"

    def _rounded(self, values: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.floor(values + 0.5) if self.is_whole else values


class IndexedActions(Actions):
    """Actions with an index in each dimension: a ``Box`` is cut evenly, others are as they are.

    Parameters
    ----------
    space : gymnasium.Space
        See `Actions`.
    n_actions : int
        Actions in each dimension of a ``Box``; other actions in it are the nearest ones.
    """

    def __init__(self, space: gym.Space[Any], n_actions: int) -> None:
        super().__init__(space)
        self.n_actions = [n_actions] * self.n_dimensions if self.is_box else self._sizes
        self._made: dict[tuple[int, ...], Any] = {}

    def values(self, dimension: int) -> NDArray[Any]:
        """Give the actions of a dimension in order, shape (n_actions[dimension],)."""
        n = self.n_actions[dimension]
        if not self.is_box:
            return np.arange(n) + int(self.start[dimension])
        return self._rounded(np.array([self._value(dimension, index) for index in range(n)]))

    def element(self, numbers: Numbers) -> Any:
        """Make the element of the space, or copy one that was made before."""
        key = tuple(numbers)
        if key not in self._made:
            if len(self._made) == _MOST_REMEMBERED:
                self._made.clear()
            self._made[key] = self._make(numbers)
        return self._made[key].copy()

    def _make(self, numbers: Numbers) -> Any:
        if self.is_box:
            values = [self._value(dimension, index) for dimension, index in enumerate(numbers)]
            return self._boxed(np.array(values))
        if isinstance(self.space, gym.spaces.Discrete):
            return self.space.start + numbers[0]
        indices = np.asarray(numbers, np.int64) + self.start
        return indices.astype(self.space.dtype).reshape(self.space.shape or ())

    def unclear(self) -> dict[int, Numbers]:
        """Give those taken last of which several are one element: whole numbers are rounded to."""
        return {
            environment: numbers
            for environment, (_, numbers) in self._taken.items()
            if self._find(self.vector(self.element(numbers))) != list(numbers)
        }

    def remember(self, environment: int, indices: NDArray[Any]) -> None:
        """Take up what `unclear` gave; ValueError if it is none."""
        fits = indices.shape == (self.n_dimensions,) and indices.dtype.kind in "iu"
        if not fits or not ((indices >= 0) & (indices < self.n_actions)).all():
            raise ValueError(f"the action taken must be {self.n_dimensions} indices, got {indices}")
        self.take(indices.tolist(), environment)

    def random(self, generator: np.random.Generator) -> Numbers:
        """Draw an index in each dimension."""
        return [int(generator.integers(n)) for n in self.n_actions]

    def _find(self, values: NDArray[np.float64]) -> Numbers:
        if not self.is_box:
            return [int(index) for index in values - self.start]
        positions = (values - self.low) / (self.high - self.low)
        return [
            round(position * (n - 1))
            for position, n in zip(positions.tolist(), self.n_actions, strict=True)
        ]

    def _value(self, dimension: int, index: int) -> float:
        low, high = float(self.low[dimension]), float(self.high[dimension])
        return _core.action_value(index, self.n_actions[dimension], low, high)


class ContinuousActions(Actions):
    """A ``Box`` of continuous actions, of which the one taken last is the only one known."""

    def __init__(self, space: gym.Space[Any]) -> None:
        super().__init__(space)
        if not self.is_box:
            raise TypeError(f"action_space must be a Box, got {type(space).__name__}")

    def _make(self, numbers: Numbers) -> Any:
        """Of numbers in [-1, 1]."""
        middle, half = 0.5 * (self.low + self.high), 0.5 * (self.high - self.low)
        values = np.clip(middle + half * np.asarray(numbers), self.low, self.high)
        return self._boxed(values)

    def random(self, generator: np.random.Generator) -> Numbers:
        """Draw a number in [-1, 1] in each dimension."""
        return [float(x) for x in generator.uniform(-1.0, 1.0, self.n_dimensions)]

    def _find(self, values: NDArray[np.float64]) -> Numbers:
        raise ValueError(f"action must be that of the last exploring act, got {values.tolist()}")


_MOST_DIMENSIONS = 1024
_MOST_REMEMBERED = 1024
_MOST_ACTIONS = 2**20
_FURTHEST = 1e300
"""Of bounds: what lies between them, times the number of an action, must stay finite."""
_LARGEST_WHOLE = 2**53
"""Up to which doubles are whole numbers."""


def _check_sizes(sizes: list[int], start: NDArray[np.int64]) -> None:
    if max(sizes, default=0) > _MOST_ACTIONS:
        raise ValueError(
            f"action_space must have at most {_MOST_ACTIONS} actions in each dimension,"
            f" got {max(sizes)}"
        )
    if (np.abs(start.astype(np.float64)) > _LARGEST_WHOLE - _MOST_ACTIONS).any():
        raise ValueError(f"action_space must begin within +-(2**53 - 2**20), got {start}")


def _finite_bounds(space: gym.spaces.Box) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    low, high = (end.astype(np.float64).reshape(-1) for end in (space.low, space.high))
    furthest = _FURTHEST if space.dtype.kind == "f" else float(_LARGEST_WHOLE)
    is_bounded = (np.maximum(np.abs(low), np.abs(high)) <= furthest).all()
    if not (is_bounded and (low < high).all()):
        raise ValueError(
            f"action_space must have finite bounds within {furthest:.3g}, low < high,"
            f" got {low} to {high}; "
            "pass a Box with the range that matters, and gymnasium's RescaleAction or ClipAction"
        )
    return low, high
