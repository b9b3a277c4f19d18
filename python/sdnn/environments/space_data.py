"""Spaces as data for files: described by `space_data`, made again by `space_of`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium as gym
import numpy as np

from sdnn.environments.types import Array, Data, Space
from sdnn.support.arguments import require, shown


def space_data(space: Space) -> Data:
    """Return a space as data that JSON can hold; TypeError for other kinds of spaces."""
    dtype = np.dtype(space.dtype).str
    if isinstance(space, gym.spaces.Box):
        ends = [_finite(space.low), _finite(space.high)]
        return {"box": ends, "shape": list(space.shape), "dtype": dtype}
    if isinstance(space, gym.spaces.Discrete):
        return {"discrete": int(space.n), "start": int(space.start), "dtype": dtype}
    if isinstance(space, gym.spaces.MultiDiscrete):
        n, start = space.nvec.tolist(), space.start.tolist()
        return {"multi_discrete": n, "start": start, "dtype": dtype}
    if isinstance(space, gym.spaces.MultiBinary):
        return {"multi_binary": list(space.shape)}
    if isinstance(space, gym.spaces.Dict):
        return {"dict": [[_key(key), space_data(part)] for key, part in space.spaces.items()]}
    if isinstance(space, gym.spaces.Tuple):
        return {"tuple": [space_data(part) for part in space.spaces]}
    raise TypeError(
        "must be a Box, Discrete, MultiDiscrete or MultiBinary, or a Dict or Tuple of such,"
        f" got {space}"
    )


def _key(key: Any) -> Any:
    """Return a key of a Dict as JSON has it: a tuple as a list; TypeError for others."""
    if type(key) is tuple:
        return [_key(part) for part in key]
    if type(key) not in (str, int, bool):
        raise TypeError(
            "must have keys that are texts, whole numbers or tuples of such, got the key"
            f" {shown(key)}"
        )
    return key


def _key_of(data: Any) -> Any:
    return tuple(map(_key_of, data)) if isinstance(data, list) else data


_TYPES = ["|b1", "|i1", "<i2", "<i4", "<i8", "|u1", "<u2", "<u4", "<u8", "<f2", "<f4", "<f8"]
_MOST_VALUES = 2**20
"""Most values of a space in a file: more would only take memory."""


def _finite(values: Array) -> list[Any]:
    """Return numbers in a row, infinite ones as words: JSON has none."""
    return [str(x) if np.isinf(x) else x for x in values.reshape(-1).tolist()]


def space_of(data: Mapping[str, Any]) -> Space:
    """Make the space that `space_data` described; ValueError if there is none."""
    kind = data.get("dtype", "<f4")
    require(kind in _TYPES, "dtype", "be that of numbers", kind)
    sizes = [data.get("discrete", 0), *np.ravel(data.get("multi_discrete", 0)).tolist()]
    sizes += [int(np.prod(data.get("multi_binary", 0)))]
    if not all(isinstance(size, int) and 0 <= size <= _MOST_VALUES for size in sizes):
        raise ValueError(f"a space must have at most {_MOST_VALUES} values, got {sizes}")
    dtype: Any = np.dtype(kind)
    if "box" in data:
        low, high = (
            np.array([float(x) if isinstance(x, str) else x for x in end], dtype).reshape(
                data["shape"]
            )
            for end in data["box"]
        )
        return gym.spaces.Box(low, high, dtype=dtype.type)
    if "discrete" in data:
        options = {} if dtype == np.int64 else {"dtype": dtype.type}  # Gymnasium 1.1 has no dtype
        return gym.spaces.Discrete(data["discrete"], start=data["start"], **options)
    if "multi_discrete" in data:
        n, start = np.array(data["multi_discrete"]), np.array(data["start"])
        return gym.spaces.MultiDiscrete(n, dtype=dtype.type, start=start)
    if "multi_binary" in data:
        return gym.spaces.MultiBinary(data["multi_binary"])
    if "dict" in data:
        return gym.spaces.Dict([(_key_of(key), space_of(part)) for key, part in data["dict"]])
    return gym.spaces.Tuple([space_of(part) for part in data["tuple"]])
