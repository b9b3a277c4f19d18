"""Observations of a Gymnasium space as the vectors of variables that the core takes."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any, Literal, TypeAlias

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn.arguments import whole
from sdnn.bounds import flat_bounds, with_infinities

__all__ = ["AnglePairs", "Observations", "Ranges"]

AnglePairs: TypeAlias = Literal["none", "find"] | Sequence[tuple[int, int]]
"""Which variables are the cosine and the sine of one angle."""

Ranges: TypeAlias = Literal["adaptive"] | tuple[ArrayLike, ArrayLike]
"""Lowest and highest values, a number for all variables or one for each; or adaptive ones."""


class Observations:
    """The variables of an observation space, flattened as Gymnasium does it.

    Parameters
    ----------
    space : gymnasium.Space
        That Gymnasium can flatten to a vector: Box, Discrete, MultiDiscrete, MultiBinary, Dict,
        Tuple.

    Raises
    ------
    TypeError, ValueError
        For a space that is no vector when flattened, or has no variable.

    Attributes
    ----------
    n_variables : int
    """

    def __init__(self, space: gym.Space[Any]) -> None:
        self._space = space
        self._shape = space.shape if isinstance(space, gym.spaces.Box) else None
        self._low, self._high = flat_bounds(space)
        self.n_variables = self._low.size
        if self.n_variables == 0:
            raise ValueError(f"observation_space must have a variable, got {space}")

    def config(
        self, ranges: Ranges | None, angles: Sequence[int], angle_pairs: AnglePairs
    ) -> dict[str, Any]:
        """Return the fields of the core's ``ObservationConfig``; see `sdnn.agents.Agent`.

        Raises
        ------
        TypeError, ValueError
            For ranges, angles or pairs that do not fit.
        """
        is_adaptive = isinstance(ranges, str) and ranges == "adaptive"
        low, high = _ranges(self._low, self._high, None if is_adaptive else ranges)
        finds_pairs = isinstance(angle_pairs, str) and angle_pairs == "find"
        if isinstance(angle_pairs, str) and angle_pairs not in ("none", "find"):
            raise ValueError(
                f"angle_pairs must be 'none', 'find' or pairs of variables, got {angle_pairs!r}"
            )
        pairs = () if isinstance(angle_pairs, str) else _listed("angle_pairs", angle_pairs)
        return {
            "low": [None if np.isnan(x) else x for x in low.tolist()],
            "high": [None if np.isnan(x) else x for x in high.tolist()],
            "adaptive": is_adaptive,
            "angles": [self._variable("angles", one) for one in _listed("angles", angles)],
            "angle_pairs": [self._pair(pair) for pair in pairs],
            "find_angle_pairs": finds_pairs,
            "symbols": [list(symbol) for symbol in _symbols_of(self._space)],
        }

    def vector(self, name: str, observation: Any) -> NDArray[np.float64]:
        """Return the variables of an observation, in any shape; ValueError if it is none."""
        if self._shape is None:
            try:
                _check_parts(self._space, observation)
                return np.asarray(gym.spaces.flatten(self._space, observation), np.float64)
            except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
                raise ValueError(f"{name} must be of {self._space}, got {observation!r}") from error
        values = _numbers(name, observation)
        if values.shape != self._shape:
            raise ValueError(f"{name} must have shape {self._shape}, got {values.shape}")
        return values

    def _variable(self, name: str, number: Any) -> int:
        try:
            return whole(name, number, 0, self.n_variables - 1)
        except ValueError:
            last = self.n_variables - 1
            raise ValueError(f"{name} must be variables from 0 to {last}, got {number!r}") from None

    def _pair(self, pair: Any) -> list[int]:
        if isinstance(pair, str) or not isinstance(pair, Sequence) or len(pair) != 2:
            raise ValueError(f"angle_pairs must be pairs (cosine, sine) of variables, got {pair!r}")
        return [self._variable("angle_pairs", variable) for variable in pair]


def _check_parts(space: gym.Space[Any], observation: Any) -> None:
    """Refuse what Gymnasium flattens to something else: ValueError, or what looking raises."""
    if isinstance(space, gym.spaces.Dict):
        for key, part in space.spaces.items():
            _check_parts(part, observation[key])
    elif isinstance(space, gym.spaces.Tuple):
        for part, one in zip(space.spaces, observation, strict=True):
            _check_parts(part, one)
    elif isinstance(space, gym.spaces.Discrete):
        if not 0 <= observation - space.start < space.n:
            raise ValueError(f"must be in {space}")
    elif isinstance(space, gym.spaces.MultiDiscrete):
        steps = np.asarray(observation) - space.start
        if steps.shape != space.shape or not ((steps >= 0) & (steps < space.nvec)).all():
            raise ValueError(f"must be in {space}")
    elif (
        isinstance(space, gym.spaces.Box | gym.spaces.MultiBinary)
        and np.shape(observation) != space.shape
    ):
        raise ValueError(f"must have shape {space.shape}")


def _symbols_of(space: gym.Space[Any], first: int = 0) -> Iterator[tuple[int, int]]:
    """Find what tells symbols in a flattened space: first variables and how many there are."""
    if isinstance(space, gym.spaces.Discrete):
        counts = [int(space.n)]
    elif isinstance(space, gym.spaces.MultiDiscrete):
        counts = [int(n) for n in space.nvec.reshape(-1)]
    elif isinstance(space, gym.spaces.Dict | gym.spaces.Tuple):
        parts = space.spaces.values() if isinstance(space, gym.spaces.Dict) else space.spaces
        for part in parts:
            yield from _symbols_of(part, first)
            first += gym.spaces.flatdim(part)
        return
    else:
        return
    for n in counts:
        yield first, n
        first += n


def _numbers(name: str, values: Any) -> NDArray[np.float64]:
    try:
        array = np.asarray(values)
    except ValueError as error:  # lists of several lengths
        raise ValueError(f"{name} must be numbers, got {values!r}") from error
    if array.dtype.kind not in "fiub":
        raise ValueError(f"{name} must be numbers, got {values!r}")
    return array.astype(np.float64, copy=False)


def _listed(name: str, values: Any) -> tuple[Any, ...]:
    try:
        return tuple(values)
    except TypeError:
        raise TypeError(f"{name} must be a list, got {values!r}") from None


def _ranges(
    low: NDArray[np.float64], high: NDArray[np.float64], ranges: Any
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Lowest and highest values of each variable, those given or the bounds; NaN: not known."""
    if ranges is not None:
        if not isinstance(ranges, Sequence) or isinstance(ranges, str) or len(ranges) != 2:
            raise ValueError(f"observation_range must be (low, high) or 'adaptive', got {ranges!r}")
        try:
            low, high = (
                with_infinities(
                    np.broadcast_to(_numbers("observation_range", end).reshape(-1), low.shape)
                )
                for end in ranges
            )
        except ValueError:
            raise ValueError(
                f"observation_range must be two numbers or two times {low.size}, got {ranges!r}"
            ) from None
    known = np.isfinite(low) & np.isfinite(high)
    for i in np.flatnonzero(known & (low >= high)):
        name, way_out = "observation_range", ""
        if ranges is None:
            name = "observation_space"
            way_out = (
                f"; give observation_range (--range {i}=LOW:HIGH) where the variable is constant"
            )
        raise ValueError(
            f"{name} must have low < high, got {low[i]} to {high[i]} of variable {i}{way_out}"
        )
    return np.where(known, low, np.nan), np.where(known, high, np.nan)
