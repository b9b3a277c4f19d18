"""Batches of observations, as vector environments give them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import gymnasium as gym
import numpy as np


def unbatched(space: gym.Space[Any], observation: Any) -> Sequence[Any] | None:
    """Return the elements of a batch of observations; None if it is no batch."""
    if isinstance(space, gym.spaces.Dict):
        if not isinstance(observation, Mapping) or set(observation) != set(space):
            return None
        columns = _columns((space[name], observation[name]) for name in space)
        if columns is None:
            return None
        return [dict(zip(space, row, strict=True)) for row in zip(*columns, strict=True)]
    if isinstance(space, gym.spaces.Tuple):
        if not isinstance(observation, tuple) or len(observation) != len(space):
            return None
        columns = _columns(zip(space, observation, strict=True))
        return None if columns is None else list(zip(*columns, strict=True))
    is_array = isinstance(observation, np.ndarray) and space.shape is not None
    is_batch = is_array and observation.ndim == len(space.shape or ()) + 1
    return observation if is_batch else None


def _columns(parts: Iterable[tuple[gym.Space[Any], Any]]) -> list[Sequence[Any]] | None:
    """Return the elements of each part of a batch; None if these are not equally many."""
    columns = [unbatched(space, part) for space, part in parts]
    present = [column for column in columns if column is not None]
    is_batch = len(present) == len(columns) and len({len(column) for column in present}) == 1
    return present if is_batch else None
