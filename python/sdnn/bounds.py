"""The bounds of what is observed."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

__all__ = ["flat_bounds", "with_infinities"]

_MOST_VARIABLES = 2**20


def with_infinities(ends: NDArray[Any]) -> NDArray[np.float64]:
    """Read ends of ranges, of which some environments write the largest float for infinity.

    >>> with_infinities(np.array([1.0, -3.4028235e38]))
    array([  1., -inf])
    """
    values = ends.astype(np.float64)
    is_bounded = np.abs(values) < np.finfo(np.float32).max
    return np.where(is_bounded | np.isnan(values), values, np.copysign(np.inf, values))


def flat_bounds(space: gym.Space[Any]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Give the bounds of the vector to which Gymnasium flattens a space; infinite: it has none.

    Raises
    ------
    TypeError
        If it is none that Gymnasium flattens to a vector.
    ValueError
        If that has more than 2**20 variables.
    """
    n_variables = _n_variables(space)
    if n_variables == 0:
        return np.empty(0), np.empty(0)
    if n_variables > _MOST_VARIABLES:  # asked before memory is
        raise ValueError(
            f"observation_space must have at most {_MOST_VARIABLES} variables, got {n_variables}"
        )
    flat = gym.spaces.flatten_space(space)
    if not isinstance(flat, gym.spaces.Box):
        raise TypeError(_no_vector(space))
    return with_infinities(flat.low), with_infinities(flat.high)


def _n_variables(space: gym.Space[Any]) -> int:
    if not isinstance(space, gym.Space):
        raise TypeError(f"observation_space must be a Gymnasium space, got {space!r}")
    try:
        return gym.spaces.flatdim(space)
    except (NotImplementedError, ValueError):
        raise TypeError(_no_vector(space)) from None


def _no_vector(space: gym.Space[Any]) -> str:
    return (
        "observation_space must be a space that Gymnasium flattens to a vector,"
        f" got {type(space).__name__}"
    )
