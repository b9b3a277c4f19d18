"""Observations of a Gymnasium space as what networks take: numbers in [0, 1]."""

from __future__ import annotations

import itertools
import random
from collections import deque
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal, TypeAlias

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn import _core
from sdnn.bounds import flat_bounds, with_infinities

__all__ = ["AnglePairs", "RangeUse", "Ranges", "UnitObservations", "without_repeats"]

AnglePairs: TypeAlias = Literal["none", "find"] | Sequence[tuple[int, int]]
"""Which variables are the cosine and the sine of one angle."""

Ranges: TypeAlias = Literal["seen"] | tuple[ArrayLike, ArrayLike]
"""Lowest and highest values, a number for all variables or one for each; or what is seen."""

_HEADROOM = 0.25
"""How much wider than what was seen a range is made at each end, in parts of it."""

_RARE = 20
"""One in so many observations is left out at each end, where ranges are asked for that are seen."""

_NOTED_EVERY = 8
"""One in so many observations is noted in the mean, to tell how ranges are used."""

_MOST_NOTED = 256
_MOST_NOTED_VALUES = 2**20

_ON_THE_CIRCLE = 1e-3
"""How far cos^2 + sin^2 may be from 1, for numbers in single precision and some rounding."""


@dataclass(frozen=True, kw_only=True)
class RangeUse:
    """How much of its range an observed variable has used of late.

    Parameters
    ----------
    share_used
        The part of the range in which it was for nine tenths of the time.
    share_beyond
        How often it was outside the range.
    """

    share_used: float
    share_beyond: float


def without_repeats(listed: Iterable[Any]) -> list[Any]:
    """Give a list without what only repeats the one before, as inputs of one variable are."""
    return [one for one, _ in itertools.groupby(listed)]


class UnitObservations:
    """From an observation to the inputs of a network, each in [0, 1].

    Observations are flattened as Gymnasium does it. Each observed variable then is an input, scaled
    by its range and clipped; two that are the cosine and the sine of an angle are one input, the
    angle; one declared to be an angle wraps around in its range. Variables of which one is 1, as a
    Discrete is flattened, can be one input, a symbol. Ranges that are not known are taken from
    observations given to `settle`.

    Parameters
    ----------
    space : gymnasium.Space
        That Gymnasium can flatten to a vector: Box, Discrete, MultiDiscrete, MultiBinary, Dict,
        Tuple.
    ranges : (low, high) or "seen", optional
        Of the variables; by default the bounds of the space. NaN, and bounds that are infinite:
        not known. ``"seen"``: of numbers where most given to `settle` are, within the bounds.
    angles : sequence of int
        Variables that are angles: the ends of their ranges are the same.
    angle_pairs : "none", "find" or sequence of (int, int)
        Pairs of variables that are a cosine and a sine. ``"find"``: those that lie on the unit
        circle in all observations given to `settle`.
    symbols : bool
        Whether a Discrete, also in a MultiDiscrete, Dict or Tuple, is one input: symbol k of n is
        ``(k + 0.5) / n``. Otherwise it is n inputs, of which one is 1.
    least_inputs : int
        Inputs are repeated to give at least so many: a network may need two.

    Raises
    ------
    TypeError
        For a space that is no vector when flattened.
    ValueError
        For ranges, angles or pairs that do not fit.
    """

    def __init__(
        self,
        space: gym.Space[Any],
        *,
        ranges: Ranges | None = None,
        angles: Sequence[int] = (),
        angle_pairs: AnglePairs = "none",
        symbols: bool = False,
        least_inputs: int = 1,
    ) -> None:
        self._space = space
        self._shape = space.shape if isinstance(space, gym.spaces.Box) else None
        low, high = flat_bounds(space)
        self.n_variables = low.size
        if self.n_variables == 0:
            raise ValueError(f"observation_space must have a variable, got {space}")
        self._sees_ranges = isinstance(ranges, str) and ranges == "seen"
        self.low, self.high = _ranges(low, high, None if self._sees_ranges else ranges)
        self._least_inputs = least_inputs
        self._symbols = dict(_symbols_of(space)) if symbols else {}
        self._angles = tuple(self._variable("angles", one) for one in _listed("angles", angles))
        self._finds_pairs = isinstance(angle_pairs, str) and angle_pairs == "find"
        self._pairs: tuple[tuple[int, int], ...] = ()
        if not isinstance(angle_pairs, str):
            self._pairs = tuple(self._pair(one) for one in _listed("angle_pairs", angle_pairs))
        elif angle_pairs not in ("none", "find"):
            raise ValueError(
                f"angle_pairs must be 'none', 'find' or pairs of variables, got {angle_pairs!r}"
            )
        used = [*self._angles, *(variable for pair in self._pairs for variable in pair)]
        if len(set(used)) != len(used):
            raise ValueError(
                f"angles and angle_pairs must name each variable once, got {list(self._angles)}"
                f" and {list(self._pairs)}"
            )
        of_symbols = sorted(set(used) & self._of_symbols())
        if of_symbols:
            raise ValueError(
                f"angles and angle_pairs must name numbers, got variable {of_symbols[0]}, which is"
                " of a Discrete"
            )
        self._bounds = self.low.copy(), self.high.copy()
        if self._sees_ranges:
            seen = np.ones(self.n_variables, bool)
            seen[[*self._angles, *self._of_symbols()]] = False
            self.low[seen] = self.high[seen] = np.nan
        self._is_settled = False
        self._converted: tuple[tuple[Any, NDArray[np.float64]], ...] = ((None, np.empty(0)),) * 2
        n_noted = max(_RARE, min(_MOST_NOTED, _MOST_NOTED_VALUES // self.n_variables))
        self._noted: deque[NDArray[np.float64]] = deque(maxlen=n_noted)
        self._gaps = random.Random(0)
        self._n_until_noted = self._gap()
        if not self._finds_pairs and not self._unknown().any():
            self._settled()

    @property
    def is_settled(self) -> bool:
        """Whether all ranges are known: before, no observation can be converted."""
        return self._is_settled

    @property
    def n_inputs(self) -> int:
        """Inputs of the network, once settled."""
        return len(self.inputs)

    @property
    def circular(self) -> tuple[bool, ...]:
        """Which inputs are angles, once settled."""
        return tuple("angle" in one or "circular" in one for one in self.inputs)

    @property
    def n_symbols(self) -> tuple[int, ...]:
        """How many symbols each input may be, 0 for a number, once settled."""
        return tuple(one["symbol"][1] if "symbol" in one else 0 for one in self.inputs)

    def flat(self, name: str, observation: Any) -> NDArray[np.float64]:
        """Flatten an observation, shape (n_variables,); ValueError if it is none, or has NaN."""
        values = self._vector(name, observation)
        _check_no_nan(name, values)
        return values

    def _vector(self, name: str, observation: Any) -> NDArray[np.float64]:
        if self._shape is None:
            try:
                _check_parts(self._space, observation)
                values = np.asarray(gym.spaces.flatten(self._space, observation), np.float64)
            except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
                raise ValueError(f"{name} must be of {self._space}, got {observation!r}") from error
        else:
            values = _numbers(name, observation)
            if values.shape != self._shape:
                raise ValueError(f"{name} must have shape {self._shape}, got {values.shape}")
            values = values.reshape(-1)
        return values

    def __call__(self, name: str, observation: Any) -> NDArray[np.float64]:
        """Convert an observation; ValueError with its ``name`` for another shape or NaN."""
        fits = isinstance(observation, np.ndarray) and observation.shape == self._shape
        values = observation if fits else self._vector(name, observation)
        key = values.dtype, values.tobytes()  # not the array, which others may change
        for known, state in self._converted:  # a step asks for each one three times
            if key == known:
                return state
        flat = self._vector(name, observation)
        state = self.unit(flat, name)
        self._converted = (self._converted[1], (key, state))
        self._n_until_noted -= 1
        if not self._n_until_noted:
            self._n_until_noted = self._gap()
            self._noted.append(flat.copy())  # may be the caller's
        return state

    def _gap(self) -> int:
        """Draw how many observations until one is noted: even gaps meet episodes in step."""
        return self._gaps.randint(1, 2 * _NOTED_EVERY - 1)

    def range_use(self) -> list[RangeUse | None]:
        """Tell of each variable how it used its range in the last 2,048 observations or so.

        None for parts of angles and symbols, and for all before there were about 160 observations.
        """
        use: list[RangeUse | None] = [None] * self.n_variables
        if len(self._noted) < _RARE:
            return use
        noted = np.sort(self._noted, axis=0)
        beyond = ((noted < self.low) | (noted > self.high)).mean(axis=0)
        noted = np.clip(noted, self.low, self.high)
        n_rare = len(noted) // _RARE
        used = (noted[-1 - n_rare] - noted[n_rare]) / self._width
        for variable in (one["variable"] for one in self.inputs if "variable" in one):
            use[variable] = RangeUse(
                share_used=float(used[variable]), share_beyond=float(beyond[variable])
            )
        return use

    def unit(self, values: NDArray[np.float64], name: str = "observation") -> NDArray[np.float64]:
        """Convert what `flat` gave, shape (n_inputs,); ValueError if it is no state."""
        state = self._scale(values)
        if state is None:
            _check_no_nan(name, values)
            raise ValueError(f"{name} must be finite where it has angles, got {values}")
        return state

    def settle(self, seen: NDArray[np.float64]) -> None:
        """Take what is not known from flattened observations, shape (n, n_variables)."""
        if self._finds_pairs:
            self._pairs = self._pairs_of(seen)
        unknown = self._unknown()
        low, high = _widened(seen.min(axis=0), seen.max(axis=0))
        if self._sees_ranges:
            low, high = self._mostly(seen, low, high)
        self.low = np.where(unknown, low, self.low)
        self.high = np.where(unknown, high, self.high)
        self._settled()

    def _mostly(
        self, seen: NDArray[np.float64], low: NDArray[np.float64], high: NDArray[np.float64]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Find where variables mostly are; what hardly moves has its bounds, or low and high."""
        n_rare = len(seen) // _RARE
        ordered = np.sort(seen, axis=0)
        first, last = ordered[n_rare], ordered[-1 - n_rare]
        bounded = ~np.isnan(self._bounds[0])
        low = np.where(bounded, self._bounds[0], low)
        high = np.where(bounded, self._bounds[1], high)
        wide_low, wide_high = _widened(first, last)
        moves = last > first
        return (
            np.where(moves, np.maximum(wide_low, np.minimum(low, first)), low),
            np.where(moves, np.minimum(wide_high, np.maximum(high, last)), high),
        )

    def asked(self) -> dict[str, Any]:
        """Give what was asked for, as data that JSON can hold: to go on before `settle`."""
        ends = (self.low, self.high)
        low, high = ([None if np.isnan(x) else float(x) for x in end] for end in ends)
        pairs = "find" if self._finds_pairs else [list(pair) for pair in self._pairs]
        return {
            "angles": list(self._angles),
            "angle_pairs": pairs,
            "symbols": bool(self._symbols),
            "sees_ranges": self._sees_ranges,
            "low": low,
            "high": high,
        }

    def description(self) -> dict[str, Any]:
        """Give what `settled_as` takes, as data that JSON can hold."""
        return {
            "low": self.low.tolist(),
            "high": self.high.tolist(),
            "inputs": [dict(one) for one in self.inputs],
        }

    def settled_as(self, description: Mapping[str, Any]) -> None:
        """Take the ranges and inputs that `description` gave; ValueError if they do not fit."""
        low = np.asarray(description["low"], np.float64)
        high = np.asarray(description["high"], np.float64)
        shape = (self.n_variables,)
        if low.shape != shape or high.shape != shape or not (low < high).all():
            raise ValueError(f"observation ranges must be {self.n_variables} of low < high")
        if not np.isfinite(high - low).all():
            raise ValueError("observation ranges must be finite")
        self.low, self.high = low, high
        inputs = without_repeats(description["inputs"])
        self._angles = tuple(
            self._variable("circular", one["circular"]) for one in inputs if "circular" in one
        )
        self._pairs = tuple(self._pair(one["angle"]) for one in inputs if "angle" in one)
        told = dict(_symbols_of(self._space))
        firsts = [one["symbol"][0] for one in inputs if "symbol" in one]
        self._symbols = {first: told[first] for first in firsts if first in told}
        self._settled()
        if [dict(one) for one in self.inputs] != [dict(one) for one in description["inputs"]]:
            raise ValueError(f"observation inputs must be {self.inputs}")

    def _settled(self) -> None:
        pairs = dict(self._pairs)
        belong_to_others = self._of_symbols().union(pairs.values())
        inputs: list[dict[str, Any]] = []
        for variable in range(self.n_variables):
            if variable in self._symbols:
                inputs.append({"symbol": [variable, self._symbols[variable]]})
            elif variable in belong_to_others:
                continue
            elif variable in pairs:
                inputs.append({"angle": [variable, pairs[variable]]})
            elif variable in self._angles:
                inputs.append({"circular": variable})
            else:
                inputs.append({"variable": variable})
        while len(inputs) < self._least_inputs:
            inputs.append(dict(inputs[-1]))
        self._converted = ((None, np.empty(0)),) * 2
        self._width = self.high - self.low
        self.inputs = inputs
        self._scale = _core.ObservationScale(self.low.tolist(), self.high.tolist(), _kinds(inputs))
        self._is_settled = True

    def _unknown(self) -> NDArray[np.bool_]:
        """Which variables need a range and have none; the others get one that is not used."""
        unknown: NDArray[np.bool_] = np.isnan(self.low) | np.isnan(self.high)
        for variable in (variable for pair in self._pairs for variable in pair):
            self.low[variable], self.high[variable] = -1.0, 1.0
            unknown[variable] = False
        for variable in self._angles:
            if unknown[variable]:
                raise ValueError(
                    f"observation_range must be given for variable {variable}, which is an angle"
                    " without bounds: -pi to pi, for example"
                )
        return unknown

    def _of_symbols(self) -> set[int]:
        """Find the variables that tell symbols."""
        return {first + k for first, n in self._symbols.items() for k in range(n)}

    def _variable(self, name: str, number: Any) -> int:
        is_whole = isinstance(number, int | np.integer) and not isinstance(number, bool)
        if not is_whole or not 0 <= number < self.n_variables:
            raise ValueError(
                f"{name} must be variables from 0 to {self.n_variables - 1}, got {number!r}"
            )
        return int(number)

    def _pair(self, pair: Any) -> tuple[int, int]:
        if isinstance(pair, str) or not isinstance(pair, Sequence) or len(pair) != 2:
            raise ValueError(f"angle_pairs must be pairs (cosine, sine) of variables, got {pair!r}")
        return self._variable("angle_pairs", pair[0]), self._variable("angle_pairs", pair[1])

    def _pairs_of(self, seen: NDArray[np.float64]) -> tuple[tuple[int, int], ...]:
        """Neighbouring variables that lie on the unit circle and move on it."""
        pairs = []
        taken = self._of_symbols().union(self._angles)
        variable = 0
        while variable + 1 < self.n_variables:
            cosine, sine = seen[:, variable], seen[:, variable + 1]
            on_circle = np.abs(cosine * cosine + sine * sine - 1.0).max() < _ON_THE_CIRCLE
            moves = np.ptp(cosine) > _ON_THE_CIRCLE and np.ptp(sine) > _ON_THE_CIRCLE
            is_free = not {variable, variable + 1} & taken
            if on_circle and moves and is_free:
                pairs.append((variable, variable + 1))
                variable += 1
            variable += 1
        return tuple(pairs)


def _kinds(inputs: list[dict[str, Any]]) -> list[tuple[str, int, int]]:
    """Give each input as the core takes it: its kind, and one or two numbers."""
    kinds = []
    for one in inputs:
        ((kind, made_of),) = one.items()
        first, second = made_of if isinstance(made_of, list) else (made_of, 0)
        kinds.append((kind, first, second))
    return kinds


def _check_no_nan(name: str, values: NDArray[np.float64]) -> None:
    if np.isnan(values).any():
        raise ValueError(f"{name} must not hold NaN, got {values}")


_LARGEST = 1e300


def _widened(
    low: NDArray[np.float64], high: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    low, high = np.maximum(low, -_LARGEST), np.minimum(high, _LARGEST)
    width = np.where(high > low, high - low, np.maximum(np.abs(high), 1.0))
    return low - _HEADROOM * width, high + _HEADROOM * width


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
            raise ValueError(f"observation_range must be (low, high) or 'seen', got {ranges!r}")
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
