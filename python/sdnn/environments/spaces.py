"""Gymnasium's interface: spaces as numbers for the core, in files, and compared."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from typing import Any, Literal, TypeAlias

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn import _core
from sdnn.environments.space_kinds import flat_bounds, in_a_line, integer_bounds, with_infinities
from sdnn.environments.types import Array, Element, Elements, Space
from sdnn.support.arguments import argument_error, array_of, blamed, require, shown

Inputs: TypeAlias = Literal["all", "relevant"] | Sequence[int]
"""The inputs of a state: all, or the relevant ones and always those of the list."""

AnglePairs: TypeAlias = Literal["none", "find"] | Sequence[tuple[int, int]]
"""Pairs of variables that are the cosine and the sine of one angle."""

Ranges: TypeAlias = Literal["adaptive", "running"] | tuple[ArrayLike, ArrayLike]
"""Ranges: a rule, or lowest and highest values, a number for all variables or one for each."""

Missing: TypeAlias = Literal["error", "hold", "code"]
"""The treatment of missing readings."""

History: TypeAlias = Literal["none", "differences", "averages", "observer", "auto"]
"""The part of earlier observations in states."""

_MANY_VARIABLES = 16


class Observations:
    """The variables of an observation space, flattened as Gymnasium does it.

    It may be a Box, Discrete, MultiDiscrete, MultiBinary, Dict or Tuple. TypeError or ValueError if
    it is no vector when flattened, or has no variable.
    """

    def __init__(self, space: Space) -> None:
        self.space = space
        self._shape = space.shape if isinstance(space, gym.spaces.Box) else None
        self._low, self._high = flat_bounds(space)
        self.n_variables = self._low.size
        if self.n_variables == 0:
            raise ValueError(f"observation_space must have a variable, got {space}")

    def config(
        self,
        ranges: Ranges | None,
        angles: Sequence[int],
        angle_pairs: AnglePairs,
        inputs: Inputs,
        *,
        missing: Missing = "error",
        history: History = "none",
        narrows: bool = False,
    ) -> _core.ObservationConfig:
        """Return the core's settings for these arguments of `sdnn.agents.Agent`.

        ``narrows``: the warm-up replaces bounds of the space that are far wider than observations.
        """
        rule = ranges if isinstance(ranges, str) and ranges in ("adaptive", "running") else None
        low, high = self._low, self._high
        if rule == "running":  # bounds have no effect, and equal bounds would be refused
            is_range = low < high
            low, high = (np.where(is_range, bound, np.nan) for bound in (low, high))
        low, high = _ranges(low, high, None if rule else ranges)
        pairs: Any = angle_pairs
        if isinstance(angle_pairs, str):
            pairs, expected = (), "be 'none', 'find' or pairs of variables"
            require(angle_pairs in ("none", "find"), "angle_pairs", expected, angle_pairs)
        is_list = not isinstance(inputs, str)
        expected = "be 'all', 'relevant' or a list of variables"
        require(is_list or inputs in ("all", "relevant"), "inputs", expected, inputs)
        return _core.ObservationConfig(
            low=[None if np.isnan(x) else x for x in low.tolist()],
            high=[None if np.isnan(x) else x for x in high.tolist()],
            adaptive=rule == "adaptive",
            running=rule == "running",
            narrowed=narrows and ranges is None,
            angles=angles,
            angle_pairs=pairs,
            find_angle_pairs=isinstance(angle_pairs, str) and angle_pairs == "find",
            symbols=list(_symbols_of(self.space)),
            relevant_only=is_list or inputs == "relevant",
            inputs=() if isinstance(inputs, str) else inputs,
            missing=missing,
            history=history,
        )

    def vector(self, name: str, observation: Element) -> Array:
        """Return the variables of an observation as an array; ValueError if it does not fit.

        Masked ones are NaN.
        """
        if self._shape is None:
            try:
                parts = list(_flat_parts(self.space, observation))
                return np.concatenate(parts).astype(np.float64, copy=False)
            except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
                problem = f"must be of {self.space}, got {shown(observation)}"
                raise argument_error(name, problem) from error
        is_plain = type(observation) is np.ndarray and observation.dtype.kind in "fiub"
        values = observation if is_plain else _readings(name, observation)
        if values.shape != self._shape:
            raise ValueError(f"{name} must have shape {self._shape}, got {values.shape}")
        return values

    def rows(self, name: str, observations: Any) -> NDArray[np.float64]:
        """Copy several observations, (n, n_variables); ValueError if one of them does not fit."""
        if self._shape is not None:
            rows = _core.observation_rows(observations, self._shape)
            if rows is not None:
                return rows
        vectors = [self.vector(name, observation) for observation in observations]
        return np.array(vectors, np.float64).reshape(-1, self.n_variables)


def has_mask(space: Space, observation: Element) -> bool:
    """Return whether an observation of a space, or a part of it, is a masked array."""
    if isinstance(space, gym.spaces.Dict) and isinstance(observation, Mapping):
        return any(has_mask(part, observation.get(key)) for key, part in space.spaces.items())
    if isinstance(space, gym.spaces.Tuple) and isinstance(observation, tuple):
        return any(map(has_mask, space.spaces, observation))
    rows = observation if isinstance(observation, list | tuple) else [observation]
    return any(isinstance(row, np.ma.MaskedArray) for row in rows)


def _readings(name: str, values: Any) -> Array:
    """Return numbers as an array, with NaN for masked ones; ValueError for others."""
    rows = values if isinstance(values, list | tuple) else [values]
    if not any(isinstance(row, np.ma.MaskedArray) for row in rows):
        return array_of(name, values)
    masked: Any = np.ma.array(values)
    require(masked.dtype.kind in "fiub", name, "be numbers", values)
    is_complete = not np.ma.is_masked(masked)
    readings: Array = masked.data if is_complete else masked.astype(np.float64).filled(np.nan)
    return readings


def _flat_parts(space: Space, observation: Element) -> Iterator[Array]:
    """Yield the variables of each part of an observation as Gymnasium flattens them.

    Missing symbols become NaN. An observation that is not of the space raises ValueError, or
    another error of the attempt to read it.
    """
    if isinstance(space, gym.spaces.Dict):
        for key, part in space.spaces.items():
            yield from _flat_parts(part, observation[key])
    elif isinstance(space, gym.spaces.Tuple):
        for part, item in zip(space.spaces, observation, strict=True):
            yield from _flat_parts(part, item)
    else:
        values = _readings("a part", observation)
        if values.shape != space.shape:
            raise ValueError(f"must have shape {space.shape}")
        if isinstance(space, gym.spaces.Discrete | gym.spaces.MultiDiscrete):
            yield from _one_hot_parts(space, values)
            return
        # Cast as Gymnasium does, except that missing readings would be lost in integers.
        space_dtype = np.dtype(space.dtype)
        is_cast = space_dtype.kind == "f" or np.isfinite(values).all()
        yield (values.astype(space_dtype) if is_cast else values).reshape(-1)


def _one_hot_parts(space: Any, values: Array) -> Iterator[Array]:
    """Yield a one-hot vector for each symbol of a Discrete or MultiDiscrete space.

    A missing symbol has NaN. ValueError for symbols outside the space.
    """
    is_read = np.isfinite(values)
    if is_read.all() and values.dtype.kind == "f":
        raise ValueError("must be whole numbers")
    sizes = space.n if isinstance(space, gym.spaces.Discrete) else space.nvec
    symbols = np.where(is_read, values, space.start) - space.start  # from 0
    if not ((symbols >= 0) & (symbols < sizes) & (symbols == np.floor(symbols))).all():
        raise ValueError(f"must be in {space}")
    triples = zip(np.ravel(symbols), np.ravel(is_read), np.ravel(sizes), strict=True)
    for symbol, was_read, size in triples:
        yield np.eye(1, size, int(symbol))[0] if was_read else np.full(size, np.nan)


def _symbols_of(space: Space, first: int = 0) -> Iterator[tuple[int, int]]:
    """Yield the first variable and the length of each one-hot group of a flattened space."""
    if isinstance(space, gym.spaces.Dict | gym.spaces.Tuple):
        for part in space.spaces.values() if isinstance(space, gym.spaces.Dict) else space.spaces:
            yield from _symbols_of(part, first)
            first += gym.spaces.flatdim(part)
    elif isinstance(space, gym.spaces.Discrete | gym.spaces.MultiDiscrete):
        for low, high in integer_bounds(space) or ():
            n = high - low + 1
            yield first, n
            first += n


def _ranges(
    low: NDArray[np.float64], high: NDArray[np.float64], ranges: Any
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Return the range of each variable, from the argument or the bounds; NaN if unknown."""
    if ranges is not None:
        is_pair = isinstance(ranges, Sequence) and not isinstance(ranges, str) and len(ranges) == 2
        require(is_pair, "observation_range", "be (low, high), 'adaptive' or 'running'", ranges)
        try:
            ends = [array_of("observation_range", end).reshape(-1) for end in ranges]
            low, high = (with_infinities(np.broadcast_to(end, low.shape)) for end in ends)
        except ValueError:
            raise ValueError(
                f"observation_range must be two numbers or two times {low.size},"
                f" got {shown(ranges)}"
            ) from None
    has_range = np.isfinite(low) & np.isfinite(high)
    for i in np.flatnonzero(has_range & (low >= high)):
        name, way_out = "observation_range", ""
        if ranges is None:
            name = "observation_space"
            way_out = (
                f"; give observation_range (environment.ranges.{i} of a run) where it is constant"
            )
        raise ValueError(
            f"{name} must have low < high, got {low[i]} to {high[i]} of variable {i}{way_out}"
        )
    return np.where(has_range, low, np.nan), np.where(has_range, high, np.nan)


class Actions:
    """The numbers of an action space: a row of them for each action.

    The space is a Box with finite bounds, Discrete, MultiDiscrete or MultiBinary; TypeError for
    others. ``n_actions`` are those of each dimension, if the space is no Box, ``config`` are the
    core's settings. ``has_masks`` is whether an agent explored or learned with a mask.
    """

    def __init__(self, space: Space) -> None:
        self.space = space
        self.has_masks = False
        self.is_box = isinstance(space, gym.spaces.Box)
        bounds = integer_bounds(space)
        self.n_actions = [last - first + 1 for first, last in bounds or ()]
        if isinstance(space, gym.spaces.Box):
            low, high = np.ravel(space.low), np.ravel(space.high)
        elif bounds is not None:
            low, high = np.array(bounds, np.float64).reshape(-1, 2).T
        else:
            raise TypeError(
                "action_space must be a Box, Discrete, MultiDiscrete or MultiBinary,"
                f" got {type(space).__name__}"
            )
        if not np.isfinite([low, high]).all():
            problem = f"must have finite bounds, got {in_a_line(space)}"
            remedy = (
                "gymnasium.wrappers.TransformAction(env, lambda action: action,"
                " gymnasium.spaces.Box(low, high)) gives it such"
            )
            raise argument_error("action_space", f"{problem}: {remedy}")
        self._dtype = np.dtype(space.dtype)
        self._shape = space.shape or ()
        number: Any = "whole"
        if self._dtype.kind == "f":
            number = {2: "float16", 4: "float32"}.get(self._dtype.itemsize, "float64")
        self.config = _core.ActionConfig(
            low=low.astype(np.float64).tolist(),
            high=high.astype(np.float64).tolist(),
            discrete=not self.is_box,
            number=number,
        )

    def elements(self, numbers: NDArray[np.float64]) -> Array:
        """Make an element of the space from each row of numbers."""
        return numbers.astype(self._dtype).reshape((-1, *self._shape))

    def element(self, numbers: NDArray[np.float64]) -> Array:
        """Make an element of the space; of a Box always an array."""
        element = self.elements(numbers)[0]
        return np.asarray(element) if self.is_box else element

    def batch(self, elements: Elements) -> Array:
        """Make an array of elements of the space, with zeros for None."""
        actions = np.zeros((len(elements), *self._shape), self._dtype)
        for i, element in enumerate(elements):
            actions[i] = 0 if element is None else element
        return actions

    def hold(self, rows: Array) -> bool:
        """Return whether all rows of an array are elements of the space."""
        if rows.ndim == 0 or rows.shape[1:] != self._shape:
            return False
        is_alike = rows.dtype.kind == self._dtype.kind or np.can_cast(rows.dtype, self._dtype)
        values = rows.reshape(len(rows), len(self.config.low))
        are_within = (self.config.low <= values) & (values <= self.config.high)
        return len(rows) == 0 or (is_alike and bool(are_within.all()))

    def mask(self, name: str, mask: Any) -> NDArray[np.uint8] | None:
        """Convert a mask to a flat array, with 1 for allowed actions; ValueError if it is none.

        One array of all actions, or one for each dimension; None: all actions are allowed.
        """
        if mask is None:
            return None
        require(not self.is_box, name, "be None where actions are a Box", mask)
        is_of_parts = isinstance(mask, tuple | list) and any(hasattr(x, "__len__") for x in mask)
        parts = [
            array_of(name, part, "fbiu", "0 or 1 per action").reshape(-1)
            for part in (mask if is_of_parts else (mask,))
        ]
        sizes = self.n_actions if is_of_parts else [sum(self.n_actions)]
        expected = f"have {' and '.join(map(str, sizes))} numbers"
        require([part.size for part in parts] == sizes, name, expected, mask)
        allowed = np.concatenate(parts)
        require(((allowed == 0) | (allowed == 1)).all(), name, "be 0 or 1 per action", mask)
        return allowed.astype(np.uint8)

    def learned_mask(self, name: str, mask: Any) -> NDArray[np.uint8] | None:
        """Convert a mask of an agent that learns; see `mask`."""
        allowed = self.mask(name, mask)
        self.has_masks |= allowed is not None
        return allowed

    def numbers(self, action: Element) -> Array:
        """Return the numbers of an element as an array; ValueError if it has other values."""
        if type(action) is np.ndarray and action.dtype is self._dtype:
            return action
        try:
            return array_of("action", action)
        except ValueError:
            raise ValueError(f"action must be in {self.space}, got {shown(action)}") from None


def allows_no_action(space: Space, name: str, mask: Any) -> bool:
    """Return whether a mask forbids all actions of a dimension, so that no action can follow.

    ValueError, which names the argument, if it is no mask of the discrete actions of ``space``.
    """
    if mask is None or integer_bounds(space) is None:  # spaces of real numbers have no masks
        return False
    actions = Actions(space)
    allowed: Any = actions.mask(name, mask)
    dimensions = np.split(allowed, np.cumsum(actions.n_actions)[:-1])
    return not all(dimension.any() for dimension in dimensions)


def controller_error(error: ValueError, observations: Observations, actions: Actions) -> Exception:
    """Return an error of the core about a setting, or about a size that follows from a space."""
    argument, problem = blamed(error)
    if argument == "n_units":  # of the core's patterns
        return argument_error("n_pattern_units", problem)
    reason = _space_of_size(argument, error, observations, actions)
    return argument_error(argument, f"{problem} ({reason})") if reason else error


def _space_of_size(
    argument: str, error: ValueError, observations: Observations, actions: Actions
) -> str:
    """Return a remark that names the space from which the size in an error follows, or ""."""
    reasons = {"n_inputs": "n_inputs follows from observation_space"}
    if observations.n_variables > _MANY_VARIABLES:
        reasons["n_inputs"] += (
            "; gymnasium.wrappers.TransformObservation can make fewer variables of it, such as"
            " features of a picture"
        )
    if not actions.is_box:
        reasons["n_actions"] = "n_actions follows from action_space"
    if len(actions.config.low) > 1:
        reasons["max_table_bytes"] = "for each dimension of action_space"
    if argument.startswith("action."):
        return "of action_space"
    matches = [reason for word, reason in reasons.items() if word in str(error)]
    return ", ".join(matches if argument else ())


def observation_space_of(config: _core.ObservationConfig) -> Space:
    """Make the observation space of an agent that was made in C++: real numbers."""
    low = np.array([-np.inf if x is None else x for x in config.low], np.float64)
    high = np.array([np.inf if x is None else x for x in config.high], np.float64)
    return gym.spaces.Box(low, high, dtype=np.float64)


def action_space_of(config: _core.ActionConfig) -> Space:
    """Make the action space of an agent that was made in C++: Box, Discrete or MultiDiscrete."""
    low, high = np.array(config.low, np.float64), np.array(config.high, np.float64)
    if not config.discrete:
        dtype = np.int64 if config.number == "whole" else np.dtype(config.number).type
        return gym.spaces.Box(low.astype(dtype), high.astype(dtype), dtype=dtype)
    start, n = low.astype(np.int64), (high - low + 1).astype(np.int64)
    if start.size == 1:
        return gym.spaces.Discrete(int(n[0]), start=int(start[0]))
    return gym.spaces.MultiDiscrete(n, start=start)
