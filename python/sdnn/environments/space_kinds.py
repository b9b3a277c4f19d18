"""Kinds of spaces: their bounds, their data in files, and which of them are alike."""

from __future__ import annotations

import textwrap
from collections.abc import Iterable, Iterator, Mapping
from contextlib import closing, contextmanager
from typing import Any, TypeAlias

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from sdnn.environments.types import AnyEnv, Array, Data, Element, Elements, Env, Space
from sdnn.support.arguments import has_methods, require, shown

_MOST_VARIABLES = 2**20
_LEAST_INTEGER_BYTES = 4
"""From this size on, bounds equal to the limits of an integer type mean that it is unbounded."""


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
    if n_variables > _MOST_VARIABLES:  # checked before memory is allocated
        raise ValueError(
            f"observation_space must have at most {_MOST_VARIABLES} variables, got {n_variables}"
        )
    if not isinstance(gym.spaces.flatten_space(space), gym.spaces.Box):
        raise TypeError(_problem_of_space(space))
    low, high = map(np.concatenate, zip(*_bounds_of_parts(space), strict=True))
    return low, high


def _bounds_of_parts(space: Space) -> Iterator[tuple[Array, Array]]:
    """Yield the bounds of the parts in the order in which Gymnasium flattens them."""
    if isinstance(space, gym.spaces.Dict | gym.spaces.Tuple):
        for part in space.spaces.values() if isinstance(space, gym.spaces.Dict) else space.spaces:
            yield from _bounds_of_parts(part)
        return
    flat: Any = gym.spaces.flatten_space(space)
    low, high = with_infinities(flat.low), with_infinities(flat.high)
    if flat.dtype.kind in "iu" and flat.dtype.itemsize >= _LEAST_INTEGER_BYTES:
        # Gymnasium writes infinity as the type's largest integer, minus at most two.
        limits = np.iinfo(flat.dtype)
        high[flat.high >= limits.max - 2] = np.inf
        if limits.min < 0:
            low[flat.low <= limits.min + 2] = -np.inf
    yield low, high


def _n_variables(space: Space) -> int:
    """Return the number of a space's variables; TypeError for a space that cannot be flattened."""
    if not isinstance(space, gym.Space):
        raise TypeError(
            f"observation_space must be a Gymnasium space, such as env.observation_space, got"
            f" {shown(space)}"
        )
    try:
        return gym.spaces.flatdim(space)
    except (NotImplementedError, ValueError):
        raise TypeError(_problem_of_space(space)) from None


def _problem_of_space(space: Space) -> str:
    """Return the error message for a space that cannot be flattened to numbers."""
    return (
        "observation_space must be a space that Gymnasium flattens to a vector,"
        f" got {type(space).__name__}"
    )


def integer_bounds(space: Space) -> list[tuple[int, int]] | None:
    """Return the smallest and largest integer of each dimension; None for spaces of reals."""
    if isinstance(space, gym.spaces.Discrete):
        return [(int(space.start), int(space.start) + int(space.n) - 1)]
    if isinstance(space, gym.spaces.MultiDiscrete):
        firsts, sizes = np.ravel(space.start).tolist(), np.ravel(space.nvec).tolist()
        return [(first, first + size - 1) for first, size in zip(firsts, sizes, strict=True)]
    if isinstance(space, gym.spaces.MultiBinary):
        return [(0, 1)] * int(np.prod(space.shape))
    return None


def in_a_line(space: Space) -> str:
    """Return the text of a space in one line, for a message."""
    return " ".join(str(space).split())


def space_data(space: Space) -> Data:
    """Return a space as data that JSON can hold; TypeError for other kinds of spaces."""
    dtype = np.dtype(space.dtype).str
    if isinstance(space, gym.spaces.Box):
        bounds = [_finite_or_text(space.low), _finite_or_text(space.high)]
        return {"box": bounds, "shape": list(space.shape), "dtype": dtype}
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
    """Convert a key of a Dict to JSON data: tuples become lists; TypeError for other types."""
    if type(key) is tuple:
        return [_key(part) for part in key]
    if type(key) not in (str, int, bool):
        raise TypeError(
            "must have keys that are texts, whole numbers or tuples of such, got the key"
            f" {shown(key)}"
        )
    return key


def _key_of(data: object) -> Any:
    """Return the key of a Dict that `_key` converted: lists become tuples again."""
    return tuple(map(_key_of, data)) if isinstance(data, list) else data


_TYPES = ["|b1", "|i1", "<i2", "<i4", "<i8", "|u1", "<u2", "<u4", "<u8", "<f2", "<f4", "<f8"]
_MOST_VALUES = 2**20
"""Largest number of values of a space in a file, so that a damaged file takes no memory."""


def _finite_or_text(values: Array) -> list[Any]:
    """Return numbers as a flat list, with infinite ones as texts, which JSON lacks."""
    return [str(x) if np.isinf(x) else x for x in values.reshape(-1).tolist()]


def space_of(data: Mapping[str, Any]) -> Space:
    """Make the space that `space_data` described; ValueError if the data is invalid."""
    type_code = data.get("dtype", "<f4")
    require(type_code in _TYPES, "dtype", "be that of numbers", type_code)
    sizes = [data.get("discrete", 0), *np.ravel(data.get("multi_discrete", 0)).tolist()]
    sizes += [int(np.prod(data.get("multi_binary", 0)))]
    if not all(isinstance(size, int) and 0 <= size <= _MOST_VALUES for size in sizes):
        raise ValueError(f"a space must have at most {_MOST_VALUES} values, got {sizes}")
    dtype: Any = np.dtype(type_code)
    if "box" in data:
        try:
            with np.errstate(over="raise"):
                low, high = (
                    np.array([float(x) if isinstance(x, str) else x for x in end], dtype)
                    for end in data["box"]
                )
        except FloatingPointError:
            raise ValueError(f"box must be of bounds that fit into {dtype}") from None
        shape = data["shape"]
        return gym.spaces.Box(low.reshape(shape), high.reshape(shape), dtype=dtype.type)
    if "discrete" in data:
        options = {} if dtype == np.int64 else {"dtype": dtype.type}  # missing in Gymnasium 1.1
        return gym.spaces.Discrete(data["discrete"], start=data["start"], **options)
    if "multi_discrete" in data:
        n, start = np.array(data["multi_discrete"]), np.array(data["start"])
        return gym.spaces.MultiDiscrete(n, dtype=dtype.type, start=start)
    if "multi_binary" in data:
        return gym.spaces.MultiBinary(data["multi_binary"])
    if "dict" in data:
        return gym.spaces.Dict([(_key_of(key), space_of(part)) for key, part in data["dict"]])
    return gym.spaces.Tuple([space_of(part) for part in data["tuple"]])


Observed: TypeAlias = Space | AnyEnv
"""An observation space, or an environment that has one."""

_WAYS_OUT = {
    "observation_space": "wrap env as in the training; where the units are the same, set"
    " agent.observation_space = env.observation_space (of a vector, single_observation_space)",
    "action_space": "gymnasium.wrappers.RescaleAction(env, agent.action_space.low,"
    " agent.action_space.high) scales them; where the units are the same,"
    " gymnasium.wrappers.TransformAction(env, lambda action: action, agent.action_space)",
}
_ROUNDING = 1e-5  # largest relative difference of bounds that counts as rounding; chosen
_MOST_SHOWN = 3  # largest number of variables that a message lists
_MOST_CHARACTERS = 60  # the longest description of a space


def made(name: str, env_id: str) -> Env:
    """Make an environment; ValueError that names the argument for an id that is not known."""
    try:
        return gym.make(env_id)
    except (gym.error.Error, ImportError) as error:
        expected = f"{name} must be an environment, or the id of one"
        raise ValueError(f"{expected}, got {shown(env_id)}: {error}") from error


@contextmanager
def opened(name: str, env: AnyEnv | str) -> Iterator[AnyEnv]:
    """Yield an environment; one that is named by its id is made, and closed at the end."""
    if not isinstance(env, str):
        yield env
        return
    with closing(made(name, env)) as env_of_id:
        yield env_of_id


def spaces_of(observed: Observed | str, actions: Space | None) -> tuple[Space, Space]:
    """Return the observation and action space, of an environment or id if ``observed`` is one."""
    if isinstance(observed, str) and actions is None:
        with opened("observation_space", observed) as env:
            return spaces_of(env, None)
    has_spaces = _space_of(observed, "observation_space") is not None
    expected = "be a Gymnasium space, or in its place an environment or its id"
    if isinstance(actions, gym.Space) and (has_spaces or isinstance(observed, str)):
        expected = "be omitted where observation_space is an environment or its id"
        require(False, "action_space", expected, actions, TypeError)
    if isinstance(observed, str):  # as before an environment in other libraries
        expected += ", which come first, without a policy: SDNNQLambda(env)"
    is_space = isinstance(observed, gym.Space) or (has_spaces and actions is None)
    require(is_space, "observation_space", expected, observed, TypeError)
    if isinstance(observed, gym.Space):
        require(isinstance(actions, gym.Space), "action_space", "be a Gymnasium space", actions,
                TypeError)  # fmt: skip
        return observed, actions  # type: ignore[return-value]
    return _space_of(observed, "observation_space"), _space_of(observed, "action_space")


def require_unbatched(observations: Space, actions: Space) -> None:
    """Check that spaces are not the batched ones of a vector environment; ValueError if they are.

    These are a Box with rows of equal bounds, one for each environment, and as many actions.
    """
    n = observations.shape[0] if observations.shape else 0
    is_batched = _has_equal_rows(observations) and (
        _has_equal_rows(actions)
        or (isinstance(actions, gym.spaces.MultiDiscrete) and len(set(actions.nvec.flat)) == 1)
    )
    if is_batched and actions.shape is not None and actions.shape[0] == n:
        raise ValueError(
            "observation_space and action_space must be those of one environment, got those of"
            f" {n}: a vector has them as single_observation_space and single_action_space; where"
            " rows are no environments, gymnasium.wrappers.FlattenObservation flattens them"
        )


def _has_equal_rows(space: Space) -> bool:
    """Return whether a space is a Box of rows with equal bounds, as of a vector environment."""
    if not isinstance(space, gym.spaces.Box) or len(space.shape) < 2:
        return False
    return bool((space.low == space.low[:1]).all() and (space.high == space.high[:1]).all())


def require_single(name: str, env: object) -> None:
    """Check that a value is one environment; TypeError that names the argument."""
    has_methods(name, env, "an environment, as of gymnasium.make(id)", "reset", "step")
    if isinstance(env, gym.vector.VectorEnv):
        raise TypeError(
            f"{name} must be a single environment, got a vector of them, {type(env).__name__}"
        )


def require_same_kind(agent: object, env: object, argument: str = "env") -> None:
    """Check that an agent can learn in an environment, or in each of a vector.

    Observations must be possible in the agent's space, and there must be as many actions. Bounds of
    a Box are the same but for rounding, as other bounds are other units; types are not compared.
    Where the agent's run scaled its observations, the environment must scale them, too. An
    environment without spaces is not checked, nor are bounds for an agent made in C++, whose spaces
    are its ranges. ValueError if it does not fit, with the name ``argument`` for the environment.
    """
    scaling = getattr(agent, "scaling", None)
    if scaling is not None and not _is_unit(_space_of(env, "observation_space")):
        raise ValueError(
            f"{argument} must give observations scaled to [0, 1], as the agent's run did"
            f" ({scaling.words() or 'from which ranges is not known'}): UnitSensors(env,"
            " *agent.scaling.ends) of sdnn.environments, or, with sdnn.runs,"
            " Run.open(folder).spec.environment.make()"
        )
    for name, fits in (("observation_space", _can_observe), ("action_space", _has_equal_actions)):
        space, other_space = getattr(agent, name, None), _space_of(env, name)
        if space is not None and other_space is not None and not fits(space, other_space):
            raise ValueError(
                f"{argument} must have the agent's {name}, {in_a_line(space)},"
                f" got {in_a_line(other_space)}"
            )
        if space is None or other_space is None or not getattr(agent, "has_bounds", True):
            continue
        if differences := list(_other_bounds(space, other_space)):
            more = ", ..." * (len(differences) > _MOST_SHOWN)
            raise ValueError(
                f"{argument} must have the bounds of the agent's {name}, got others of"
                f" {', '.join(differences[:_MOST_SHOWN])}{more}; {_WAYS_OUT[name]}"
            )


def _other_bounds(space: Any, other_space: Any, part: str = "") -> Iterator[str]:
    """Yield a text with both bounds for each variable whose bounds differ.

    ``part`` is the place of the spaces in a Dict or Tuple, such as "['arm'][0]".
    """
    if isinstance(space, gym.spaces.Dict | gym.spaces.Tuple):
        keys: Any = space.keys() if isinstance(space, gym.spaces.Dict) else range(len(space))
        for key in keys:
            yield from _other_bounds(space.spaces[key], other_space.spaces[key], f"{part}[{key!r}]")
    if not isinstance(space, gym.spaces.Box):
        return
    bounds, other = _bounds(space), _bounds(other_space)
    types = [np.dtype(box.dtype) for box in (space, other_space)]
    rounding = max(_ROUNDING, *(np.finfo(t).eps for t in types if t.kind == "f"), 0.0)
    size = np.where(np.isfinite(bounds), np.abs(bounds), 0.0).max(axis=1, keepdims=True)
    with np.errstate(invalid="ignore", over="ignore"):  # inf - inf is NaN: `==` decides then
        is_alike = (bounds == other) | (np.abs(bounds - other) <= rounding * size)
    for i in np.flatnonzero(~is_alike.all(axis=1)):
        variable = f"variable {i} of {part}" if part else f"variable {i}"
        ranges = [f"{low:.6g} to {high:.6g}" for low, high in (other[i], bounds[i])]
        yield f"{variable} ({' instead of '.join(ranges)})"


def _bounds(space: Any) -> NDArray[np.float64]:
    """Return the lowest and the highest value of each variable, shape (n, 2)."""
    bounds = integer_bounds(space)
    if bounds is not None:
        return np.array(bounds, np.float64).reshape(-1, 2)
    return np.stack([with_infinities(np.ravel(end)) for end in (space.low, space.high)], axis=1)


def require_same_variables(space: Space, other_space: Space) -> None:
    """Check that a space can replace an agent's: all but bounds are the same; else ValueError."""
    are_same = _can_observe(space, other_space) and _can_observe(other_space, space)
    expected = f"have the variables of {in_a_line(space)}"
    require(are_same, "observation_space", expected, other_space)


def _space_of(env: object, name: str) -> Any:
    """Return a space of an environment, or of each in a vector; None if it has none."""
    return getattr(env, f"single_{name}", getattr(env, name, None))


def _is_unit(space: Space | None) -> bool:
    """Return whether a space is a Box within [0, 1], or not known."""
    if not isinstance(space, gym.spaces.Box):
        return space is None
    return bool((space.low >= 0.0).all() and (space.high <= 1.0).all())


def _can_observe(space: Space, other_space: Space) -> bool:
    """Return whether an agent of a space can read the observations of another space."""
    if isinstance(space, gym.spaces.Dict) and isinstance(other_space, gym.spaces.Dict):
        return space.keys() == other_space.keys() and all(
            _can_observe(space[key], other_space[key]) for key in space
        )
    if isinstance(space, gym.spaces.Tuple) and isinstance(other_space, gym.spaces.Tuple):
        return len(space) == len(other_space) and all(map(_can_observe, space, other_space))
    other_bounds, bounds = integer_bounds(other_space), integer_bounds(space)
    if isinstance(space, gym.spaces.Box):
        has_numbers = isinstance(other_space, gym.spaces.Box) or other_bounds is not None
        return has_numbers and space.shape == other_space.shape
    if space.shape != other_space.shape or other_bounds is None or bounds is None:
        return False
    pairs = zip(other_bounds, bounds, strict=True)
    return all(
        low <= other_low and other_high <= high for (other_low, other_high), (low, high) in pairs
    )


def _has_equal_actions(space: Space, other_space: Space) -> bool:
    """Return whether spaces have the same discrete actions, or as many continuous dimensions."""
    if isinstance(space, gym.spaces.Box) and isinstance(other_space, gym.spaces.Box):
        return space.low.size == other_space.low.size
    bounds = integer_bounds(space)
    return bounds is not None and bounds == integer_bounds(other_space)


def space_words(space: Space) -> str:
    """Describe a space in a line: a Box by its shape, others as they are, shortened.

    >>> space_words(gym.spaces.Box(-1.0, 1.0, (20,)))
    'Box(20,)'
    """
    if isinstance(space, gym.spaces.Box):
        return f"Box{space.shape}"
    return textwrap.shorten(repr(space), _MOST_CHARACTERS, placeholder=" ...")


def unbatched(space: Space, observation: Element) -> Elements | None:
    """Split a batch of observations into its elements; None if it is a single observation."""
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


def _columns(parts: Iterable[tuple[Space, Element]]) -> list[Elements] | None:
    """Split each part of a batch into its elements; None if the parts differ in length."""
    columns = [unbatched(space, part) for space, part in parts]
    present = [column for column in columns if column is not None]
    is_batch = len(present) == len(columns) and len({len(column) for column in present}) == 1
    return present if is_batch else None
