"""Gymnasium spaces as data that JSON can hold."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

__all__ = ["require_same_kind", "space_data", "space_of"]


def require_same_kind(agent: Any, env: Any) -> None:
    """Check that an environment, or each of a vector, is one that an agent was made for.

    Bounds and types of numbers may differ; what tells no spaces is not checked.

    Raises
    ------
    ValueError
        If observations or actions are of another kind or shape.
    """
    for name in ("observation_space", "action_space"):
        own = getattr(agent, name, None)
        found = getattr(env, f"single_{name}", getattr(env, name, None))
        if own is not None and found is not None and not _is_of_kind(found, own):
            raise ValueError(f"env must have the agent's {name}, {_line(own)}, got {_line(found)}")


def _is_of_kind(found: gym.Space[Any], own: gym.Space[Any]) -> bool:
    if isinstance(own, gym.spaces.Dict) and isinstance(found, gym.spaces.Dict):
        return own.keys() == found.keys() and all(_is_of_kind(found[key], own[key]) for key in own)
    if isinstance(own, gym.spaces.Tuple) and isinstance(found, gym.spaces.Tuple):
        return len(own) == len(found) and all(map(_is_of_kind, found, own))
    if own.shape != found.shape:
        return False
    if isinstance(own, gym.spaces.Discrete) and isinstance(found, gym.spaces.Discrete):
        return bool(own.n == found.n and own.start == found.start)
    if isinstance(own, gym.spaces.MultiDiscrete) and isinstance(found, gym.spaces.MultiDiscrete):
        return bool((own.nvec == found.nvec).all() and (own.start == found.start).all())
    kinds = (gym.spaces.Box, gym.spaces.MultiBinary)
    return any(isinstance(own, kind) and isinstance(found, kind) for kind in kinds)


def _line(space: gym.Space[Any]) -> str:
    return " ".join(str(space).split())


def space_data(space: gym.Space[Any]) -> dict[str, Any]:
    """Write a space down as data that JSON can hold; TypeError for kinds that are not known."""
    if isinstance(space, gym.spaces.Box):
        return {
            "box": [_finite(space.low), _finite(space.high)],
            "shape": list(space.shape),
            "dtype": np.dtype(space.dtype).str,
        }
    if isinstance(space, gym.spaces.Discrete):
        return {
            "discrete": int(space.n),
            "start": int(space.start),
            "dtype": np.dtype(space.dtype).str,
        }
    if isinstance(space, gym.spaces.MultiDiscrete):
        return {
            "multi_discrete": space.nvec.tolist(),
            "start": space.start.tolist(),
            "dtype": np.dtype(space.dtype).str,
        }
    if isinstance(space, gym.spaces.MultiBinary):
        return {"multi_binary": list(space.shape)}
    if isinstance(space, gym.spaces.Dict):
        return {"dict": [[key, space_data(part)] for key, part in space.spaces.items()]}
    if isinstance(space, gym.spaces.Tuple):
        return {"tuple": [space_data(part) for part in space.spaces]}
    raise TypeError(
        "must be a Box, Discrete, MultiDiscrete or MultiBinary, or a Dict or Tuple of such,"
        f" got {space}"
    )


_TYPES = {
    np.dtype(letters).str for letters in ("b1", *(f"{k}{n}" for k in "iu" for n in (1, 2, 4, 8)))
}
_TYPES |= {np.dtype(f"f{n}").str for n in (2, 4, 8)}
_MOST_VALUES = 2**20
"""Of a space that is read: more would ask for memory without need."""


def _finite(values: NDArray[Any]) -> list[Any]:
    """Give numbers in a row, infinite ones as words: JSON has none."""
    return [str(x) if np.isinf(x) else x for x in values.reshape(-1).tolist()]


def space_of(data: Mapping[str, Any]) -> gym.Space[Any]:
    """Make the space that `space_data` wrote down; ValueError if it cannot have."""
    if data.get("dtype", "<f4") not in _TYPES:
        raise ValueError(f"dtype must be that of numbers, got {data['dtype']!r}")
    sizes = [data.get("discrete", 0), *np.ravel(data.get("multi_discrete", 0)).tolist()]
    sizes += [int(np.prod(data.get("multi_binary", 0)))]
    if not all(isinstance(size, int) and 0 <= size <= _MOST_VALUES for size in sizes):
        raise ValueError(f"a space must have at most {_MOST_VALUES} values, got {sizes}")
    if "box" in data:
        dtype = np.dtype(data["dtype"])
        low, high = (
            np.array([float(x) if isinstance(x, str) else x for x in end], dtype)
            for end in data["box"]
        )
        low, high = low.reshape(data["shape"]), high.reshape(data["shape"])
        return gym.spaces.Box(low, high, dtype=dtype.type)
    if "discrete" in data:
        dtype = np.dtype(data.get("dtype", np.int64))  # older files do not say it
        if dtype == np.int64:
            return gym.spaces.Discrete(data["discrete"], start=data["start"])
        return gym.spaces.Discrete(data["discrete"], start=data["start"], dtype=dtype.type)
    if "multi_discrete" in data:
        return gym.spaces.MultiDiscrete(
            np.array(data["multi_discrete"]),
            dtype=np.dtype(data["dtype"]).type,
            start=np.array(data["start"]),
        )
    if "multi_binary" in data:
        return gym.spaces.MultiBinary(data["multi_binary"])
    if "dict" in data:
        return gym.spaces.Dict([(key, space_of(part)) for key, part in data["dict"]])
    return gym.spaces.Tuple([space_of(part) for part in data["tuple"]])
