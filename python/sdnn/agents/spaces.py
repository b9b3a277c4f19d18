"""Gymnasium spaces: whether those of agent and environment fit, and as data that JSON can hold."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, TypeAlias

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from sdnn.arguments import has_methods

__all__ = [
    "action_space_of",
    "observation_space_of",
    "require_same_kind",
    "require_single",
    "space_data",
    "space_of",
]


def require_single(name: str, env: Any) -> None:
    """Check that a value is one environment; TypeError that names the argument."""
    has_methods(name, env, "a Gymnasium environment", "reset", "step")
    if isinstance(env, gym.vector.VectorEnv):
        raise TypeError(
            f"{name} must be a single environment, got a vector of them, {type(env).__name__}"
        )


def require_same_kind(agent: Any, env: Any) -> None:
    """Check that an environment, or each of a vector, is one that an agent was made for.

    What it observes must be possible in the agent's space, but for bounds, and its actions must be
    as many. What tells no spaces is not checked.

    Where the agent's run scaled its observations, the environment must have scaled ones, too.

    Raises
    ------
    ValueError
        If it does not fit.
    """
    scaling = getattr(agent, "scaling", None)
    if scaling is not None and not _is_unit(_space_of(env, "observation_space")):
        raise ValueError(
            "env must give observations scaled to [0, 1], as the agent's run did"
            f" ({scaling.words() or 'from which ranges is not known'}): UnitSensors(env,"
            " *agent.scaling.ends) of sdnn.environments, or Run.open(folder).config.environment"
            " of sdnn.runs"
        )
    for name, fits in (("observation_space", _can_observe), ("action_space", _acts_alike)):
        own = getattr(agent, name, None)
        found = _space_of(env, name)
        if own is not None and found is not None and not fits(own, found):
            raise ValueError(f"env must have the agent's {name}, {_line(own)}, got {_line(found)}")


def _space_of(env: Any, name: str) -> Any:
    return getattr(env, f"single_{name}", getattr(env, name, None))


def _is_unit(space: Any) -> bool:
    """Whether all that is observed lies in [0, 1]; what tells no space is not checked."""
    if not isinstance(space, gym.spaces.Box):
        return space is None
    return bool((space.low >= 0.0).all() and (space.high <= 1.0).all())


_NUMBERS = (
    gym.spaces.Box,
    gym.spaces.Discrete,
    gym.spaces.MultiDiscrete,
    gym.spaces.MultiBinary,
)


def _can_observe(own: gym.Space[Any], found: gym.Space[Any]) -> bool:
    if isinstance(own, gym.spaces.Dict) and isinstance(found, gym.spaces.Dict):
        return own.keys() == found.keys() and all(_can_observe(own[key], found[key]) for key in own)
    if isinstance(own, gym.spaces.Tuple) and isinstance(found, gym.spaces.Tuple):
        return len(own) == len(found) and all(map(_can_observe, own, found))
    if isinstance(own, gym.spaces.Box):
        return isinstance(found, _NUMBERS) and own.shape == found.shape
    return own.shape == found.shape and _is_within(_wholes(found), _wholes(own))


def _acts_alike(own: gym.Space[Any], found: gym.Space[Any]) -> bool:
    if isinstance(own, gym.spaces.Box) and isinstance(found, gym.spaces.Box):
        return own.low.size == found.low.size
    return _wholes(own) is not None and _wholes(own) == _wholes(found)


_Wholes: TypeAlias = "list[tuple[int, int]] | None"
"""The first and the last whole number of each dimension; None of other spaces."""


def _wholes(space: gym.Space[Any]) -> _Wholes:
    if isinstance(space, gym.spaces.Discrete):
        return [(int(space.start), int(space.start + space.n - 1))]
    if isinstance(space, gym.spaces.MultiDiscrete):
        first, n = np.ravel(space.start).tolist(), np.ravel(space.nvec).tolist()
        return [(a, a + k - 1) for a, k in zip(first, n, strict=True)]
    if isinstance(space, gym.spaces.MultiBinary):
        return [(0, 1)] * int(np.prod(space.shape))
    return None


def _is_within(found: _Wholes, own: _Wholes) -> bool:
    if found is None or own is None or len(found) != len(own):
        return False
    pairs = zip(found, own, strict=True)
    return all(mine[0] <= one[0] and one[1] <= mine[1] for one, mine in pairs)


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
        dtype = np.dtype(data["dtype"])
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


def observation_space_of(config: Mapping[str, Any]) -> gym.Space[Any]:
    """Make the space of an agent that was made in C++, which observes real numbers."""
    low = np.array([-np.inf if x is None else x for x in config["low"]], np.float64)
    high = np.array([np.inf if x is None else x for x in config["high"]], np.float64)
    return gym.spaces.Box(low, high, dtype=np.float64)


def action_space_of(config: Mapping[str, Any]) -> gym.Space[Any]:
    """Make the space of an agent that was made in C++: a Box, a button or several."""
    low, high = np.array(config["low"], np.float64), np.array(config["high"], np.float64)
    if not config["discrete"]:
        dtype = np.int64 if config["number"] == "whole" else np.dtype(config["number"]).type
        return gym.spaces.Box(low.astype(dtype), high.astype(dtype), dtype=dtype)
    start, n = low.astype(np.int64), (high - low + 1).astype(np.int64)
    if start.size == 1:
        return gym.spaces.Discrete(int(n[0]), start=int(start[0]))
    return gym.spaces.MultiDiscrete(n, start=start)
