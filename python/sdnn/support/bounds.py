"""The bounds of observations."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from sdnn.support.arguments import shown

Array = NDArray[Any]
Space = gym.Space[Any]
_MOST_VARIABLES = 2**20
_LEAST_INTEGER_BYTES = 4
"""Least size of whole numbers whose limits are those of the type, not of the observations."""


def with_infinities(bounds: Array) -> NDArray[np.float64]:
    """Replace the largest float, which some environments write for infinity, by infinity.

    >>> with_infinities(np.array([1.0, -3.4028235e38]))
    array([  1., -inf])
    """
    values = bounds.astype(np.float64)
    is_bounded = np.abs(values) < np.finfo(np.float32).max
    return np.where(is_bounded | np.isnan(values), values, np.copysign(np.inf, values))


def flat_bounds(space: Space) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the bounds of the vector to which Gymnasium flattens a space, perhaps infinite.

    TypeError if Gymnasium does not flatten the space to a vector; ValueError for more than 2**20
    variables.
    """
    n_variables = _n_variables(space)
    if n_variables == 0:
        return np.empty(0), np.empty(0)
    if n_variables > _MOST_VARIABLES:  # before memory is allocated
        raise ValueError(
            f"observation_space must have at most {_MOST_VARIABLES} variables, got {n_variables}"
        )
    if not isinstance(gym.spaces.flatten_space(space), gym.spaces.Box):
        raise TypeError(_no_vector(space))
    low, high = map(np.concatenate, zip(*_bounds_of_parts(space), strict=True))
    return low, high


def _bounds_of_parts(space: Space) -> Iterator[tuple[Array, Array]]:
    """Yield the bounds of the parts in the order in which Gymnasium flattens them."""
    if isinstance(space, gym.spaces.Dict | gym.spaces.Tuple):
        parts = space.spaces.values() if isinstance(space, gym.spaces.Dict) else space.spaces
        for part in parts:
            yield from _bounds_of_parts(part)
        return
    flat: Any = gym.spaces.flatten_space(space)
    low, high = with_infinities(flat.low), with_infinities(flat.high)
    if flat.dtype.kind in "iu" and flat.dtype.itemsize >= _LEAST_INTEGER_BYTES:
        # Gymnasium writes infinity as the last integer of the type, or up to two before it.
        limits = np.iinfo(flat.dtype)
        high[flat.high >= limits.max - 2] = np.inf
        if limits.min < 0:
            low[flat.low <= limits.min + 2] = -np.inf
    yield low, high


def _n_variables(space: Space) -> int:
    if not isinstance(space, gym.Space):
        raise TypeError(
            f"observation_space must be a Gymnasium space, such as env.observation_space, got"
            f" {shown(space)}"
        )
    try:
        return gym.spaces.flatdim(space)
    except (NotImplementedError, ValueError):
        raise TypeError(_no_vector(space)) from None


def _no_vector(space: Space) -> str:
    return (
        "observation_space must be a space that Gymnasium flattens to a vector,"
        f" got {type(space).__name__}"
    )
