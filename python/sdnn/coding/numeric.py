"""Codings of numbers."""

from __future__ import annotations

import contextlib
import dataclasses
import math
import warnings
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.coding.base import Coding, Column, fitted_field
from sdnn.support.arguments import array_of, one_of, real, require, shown, whole

# Chosen constants.
MAX_BINS = 65535
FINE = 1000  # most bins by default; longer patterns flip more units per bin instead
LONGEST = 1000.0  # the largest length_scale
FEW_BINS = 8  # fewer cause a `CoarseCodeWarning`
MAX_KNOTS = 129  # more knots of a column's distribution hardly change the codes

Knots = tuple[tuple[float, float], ...]


class CoarseCodeWarning(UserWarning):
    """A length scale gives few bins, because neighbouring patterns differ in at least one unit."""


def numbers(column: Column) -> NDArray[np.float64]:
    """Return the column as floats; ValueError for NaN or complex numbers."""
    if np.iscomplexobj(column):
        raise ValueError("Complex data not supported")
    values = array_of("column", column, "fiubO").astype(np.float64, copy=False)
    if np.isnan(values).any():
        raise ValueError("Input contains NaN")
    return values


def quantile_knots(column: NDArray[np.float64]) -> Knots:
    """Return at most `MAX_KNOTS` pairs of a value and its mean rank in the column, in [0, 1].

    >>> quantile_knots(np.array([1.0, 2.0, 2.0, 50.0]))
    ((1.0, 0.0), (2.0, 0.5), (50.0, 1.0))
    """
    values, counts = np.unique(column, return_counts=True)
    if len(values) == 1:
        return ((float(values[0]), 0.0),)
    ranks = np.cumsum(counts) - counts / 2
    levels = (ranks - ranks[0]) / (ranks[-1] - ranks[0])
    if len(values) > MAX_KNOTS:
        chosen = np.unique(np.searchsorted(levels, np.linspace(0, 1, MAX_KNOTS)))
        values, levels = values[chosen], levels[chosen]
    return tuple(zip(values.tolist(), levels.tolist(), strict=True))


def checked_knots(knots: object, low: float, high: float) -> Knots:
    """Return knots as floats; ValueError unless they rise from (low, 0) to (high, 1)."""
    last = 1.0 if low < high else 0.0
    with contextlib.suppress(IndexError, TypeError, ValueError):
        values, levels = array_of("knots", knots).astype(np.float64).T
        is_rising = np.all(values[1:] > values[:-1]) and np.all(levels[1:] > levels[:-1])
        if is_rising and (values[0], levels[0], values[-1], levels[-1]) == (low, 0.0, high, last):
            return tuple(zip(values.tolist(), levels.tolist(), strict=True))
    raise ValueError(
        f"knots must be (value, position) in rising order from ({low}, 0) to ({high}, 1), "
        f"got {shown(knots)}"
    )


def _interpolated(
    values: NDArray[np.float64], knots: NDArray[np.float64], levels: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Return the levels of values between knots, linearly interpolated."""
    positions = np.interp(values, knots, levels)
    is_infinite = np.isinf(positions)
    if is_infinite.any():  # the slope between subnormal knots overflows
        positions[is_infinite] = levels[np.searchsorted(knots, values[is_infinite])]
    return positions


class Ranged(Coding):
    """Coding of numbers within a range, given or learned."""

    low: float | None
    high: float | None
    knots: Knots | None = None

    @property
    def learns(self) -> bool:
        return self.low is None or self.high is None

    def ends(self) -> tuple[float, float]:
        return fitted_field(self.low), fitted_field(self.high)

    def even_range(self) -> tuple[float, float] | None:
        return self.ends() if self.knots is None else None

    def bins(self, column: Column) -> NDArray[np.int32]:
        """Return the bin of each value: equal parts of the range, or between quantiles (knots)."""
        values, (low, high) = numbers(column), self.ends()
        if not low / 2 < high / 2:  # a column with a single value, or values next to 0
            positions = np.zeros(len(values))
        elif self.knots is not None:
            positions = _interpolated(values, *np.array(self.knots).T)
        else:  # halves, because the width of the widest range would overflow
            positions = (np.clip(values, low, high) / 2 - low / 2) / (high / 2 - low / 2)
        # Bins are equal half-open parts of [0, 1]; the last one includes 1.
        return np.minimum((positions * self.size).astype(np.int32), np.int32(self.size - 1))

    def _learned_range(self, column: NDArray[np.float64]) -> tuple[float, float]:
        """Return the given limits, or the column's where they are None.

        A range of a single value is possible only for a column that has no other value.
        """
        low = float(np.min(column)) if self.low is None else real("low", self.low)
        high = float(np.max(column)) if self.high is None else real("high", self.high)
        is_constant = low == high and bool(np.all(column == low))
        is_finite = math.isfinite(low) and math.isfinite(high)
        if not is_finite or (not self.learns and low >= high and not is_constant):
            raise ValueError(f"low and high must be finite, low < high, got {low} and {high}")
        return low, max(low, high)


@dataclasses.dataclass(frozen=True, kw_only=True)
class RandomInverse(Ranged):
    """A random first pattern, and further patterns that each flip a few units of each sign.

    The correlation falls exponentially with the distance of the bins,
    ``(1 - 4 * n_flipped / n_units) ** distance``.

    Attributes
    ----------
    length_scale : float
        Share of the range over which the correlation falls to 1/e; used where ``n_bins`` or
        ``n_flipped`` is None.
    n_bins, n_flipped : int, optional
        q and r of the method: number of bins, and units of each sign flipped from bin to bin.
    spacing : {"even", "quantile"}
        Bins of equal width, or with equal numbers of training samples (robust to outliers).
    low, high : float, optional
        The range, learned where None; values outside are clipped. Not with "quantile".
    knots : tuple of (value, position), optional
        Learned by ``spacing="quantile"``; if given, then together with the range.
    """

    name: ClassVar[str] = "random-inverse"
    length_scale: float = 0.5
    n_bins: int | None = None
    n_flipped: int | None = None
    spacing: Literal["even", "quantile"] = "even"
    low: float | None = None
    high: float | None = None
    knots: Knots | None = None

    def fit(self, column: Column, n_units: int) -> RandomInverse:
        """Return a copy with the range, bins and knots that the column and `n_units` determine."""
        one_of("spacing", self.spacing, ("even", "quantile"))
        is_learned = self.knots is not None and not self.learns
        has_range = not (self.low is None and self.high is None)
        if self.spacing == "quantile" and has_range and not is_learned:
            raise ValueError("low and high cannot be given with spacing='quantile'")
        is_length = 0 < real("length_scale", self.length_scale) <= LONGEST
        require(is_length, "length_scale", f"be in (0, {LONGEST}]", self.length_scale)
        fits = self.knots is None or (is_learned and self.spacing == "quantile")
        expected = "be given with spacing='quantile' and the range, low and high"
        require(fits, "knots", expected, self.knots)
        values = numbers(column)
        low, high = self._learned_range(values)
        n_bins, n_flipped = self._bins_and_flips(n_units)
        knots = None
        if self.spacing == "quantile":
            knots = checked_knots(self.knots, low, high) if is_learned else quantile_knots(values)
        return dataclasses.replace(
            self, n_bins=n_bins, n_flipped=n_flipped, low=low, high=high, knots=knots
        )

    def _bins_and_flips(self, n_units: int) -> tuple[int, int]:
        """Return the numbers of bins and of units flipped per bin, given or by the length scale."""
        most_flipped = n_units // 2
        n_bins = None if self.n_bins is None else whole("n_bins", self.n_bins, 2, MAX_BINS)
        if self.n_flipped is not None:
            flipped = whole("n_flipped", self.n_flipped, 1, most_flipped)
        elif n_bins is not None:
            # Flipping f units of each sign a bin takes 4 f / n from the correlation of neighbours.
            correlation = math.exp(-1 / (n_bins * self.length_scale))
            flipped = min(most_flipped, max(1, round(n_units * (1 - correlation) / 4)))
        else:
            flipped = max(1, math.ceil(n_units / (4 * self.length_scale * FINE)))
            expected = f"be at least {1 / (2 * FINE)}"
            require(flipped <= most_flipped, "length_scale", expected, self.length_scale)
        if n_bins is not None:
            return n_bins, flipped
        bins_per_length_scale = n_units / (4 * flipped)
        n_bins = min(MAX_BINS, max(2, round(bins_per_length_scale / self.length_scale)))
        if n_bins < FEW_BINS and self.n_flipped is None:
            warnings.warn(
                f"length_scale={self.length_scale} with patterns of {n_units} units leaves "
                f"{n_bins} bins of the range; more n_pattern_units or a shorter length_scale "
                "distinguish more values",
                CoarseCodeWarning,
                stacklevel=2,
            )
        return n_bins, flipped

    @property
    def size(self) -> int:
        return fitted_field(self.n_bins)

    def patterns(self, n_units: int, seed: int) -> NDArray[np.int8]:
        return _core.random_inverse_patterns(n_units, self.size, fitted_field(self.n_flipped), seed)

    def correlations(self, n_units: int) -> NDArray[np.float64]:
        """Return how patterns of two bins correlate: a constant to the power of their distance."""
        of_neighbours = 1 - 4 * fitted_field(self.n_flipped) / n_units
        of_distances = np.power(of_neighbours, np.arange(self.size))
        # A strided view: all entries of a diagonal are equal.
        both_ways = np.concatenate([of_distances[:0:-1], of_distances])
        return np.lib.stride_tricks.sliding_window_view(both_ways, self.size)[::-1]


class Anchored(Coding):
    """Patterns interpolated between independent random anchors."""

    n_anchor_patterns: int
    n_interpolated: int
    is_circular: ClassVar[bool]

    def _check_anchors(self) -> None:
        """Check the numbers of patterns, and that of bins, which follows from them."""
        whole("n_anchor_patterns", self.n_anchor_patterns, 2, 10000)
        whole("n_interpolated", self.n_interpolated, 0, 10000)
        whole("(n_anchor_patterns - 1) * (n_interpolated + 1)", self.size, 1, MAX_BINS)

    @property
    def size(self) -> int:
        return (self.n_anchor_patterns - 1) * (self.n_interpolated + 1)

    def patterns(self, n_units: int, seed: int) -> NDArray[np.int8]:
        return _core.anchor_patterns(
            n_units, self.n_anchor_patterns, self.n_interpolated, self.is_circular, seed
        )

    def correlations(self, n_units: int) -> NDArray[np.float64]:
        """Return how patterns of two bins correlate, by the anchors between which they lie."""
        # A stretch reaches from an anchor to the next one. Within it the correlation falls linearly
        # with the distance. Patterns on two sides of an anchor correlate by the product of their
        # shares of that anchor.
        n_stretches, n_bins = self.n_anchor_patterns - 1, self.n_interpolated + 1
        stretch, number = np.divmod(np.arange(self.size), n_bins)  # number: within the stretch
        share = number / n_bins  # share of the next anchor in the bin's pattern
        step = np.subtract.outer(stretch, stretch)
        within = 1 - np.abs(np.subtract.outer(share, share))
        across = np.multiply.outer(1 - share, share)
        if self.is_circular and n_stretches == 1:
            return np.ones_like(within)  # a circle with a single anchor: all patterns are equal
        is_next = step % n_stretches == 1 if self.is_circular else step == 1
        result: NDArray[np.float64] = (step == 0) * within + is_next * across + is_next.T * across.T
        return result


@dataclasses.dataclass(frozen=True, kw_only=True)
class Anchor(Anchored, Ranged):
    """Independent random anchor patterns at equal distances, interpolated between.

    The correlation falls about linearly with the distance and is zero beyond two stretches.

    Attributes
    ----------
    n_anchor_patterns, n_interpolated : int
        Anchors, and patterns between neighbouring ones;
        ``(n_anchor_patterns - 1) * (n_interpolated + 1)`` bins.
    low, high : float, optional
        The range, learned where None; values outside are clipped.
    """

    name: ClassVar[str] = "anchor"
    is_circular: ClassVar[bool] = False
    n_anchor_patterns: int = 9
    n_interpolated: int = 44
    low: float | None = None
    high: float | None = None

    def fit(self, column: Column, n_units: int) -> Anchor:
        self._check_anchors()
        low, high = self._learned_range(numbers(column))
        return dataclasses.replace(self, low=low, high=high)


@dataclasses.dataclass(frozen=True, kw_only=True)
class Circular(Anchored):
    """Anchor interpolation on a circle: the last anchor is the first.

    Attributes
    ----------
    period, origin : float
        Values a period apart are equal; bins begin at the origin.
    n_anchor_patterns, n_interpolated : int
        As for `Anchor`; the repeated first anchor counts.
    """

    name: ClassVar[str] = "circular"
    is_circular: ClassVar[bool] = True
    period: float = 2 * math.pi
    origin: float = 0.0
    n_anchor_patterns: int = 9
    n_interpolated: int = 44
    learns: ClassVar[bool] = False

    def fit(self, column: Column, n_units: int) -> Circular:
        """Check the parameters; nothing is learned from the column."""
        self._check_anchors()
        numbers(column)
        is_period = 0 < real("period", self.period) < math.inf
        require(is_period, "period", "be positive and finite", self.period)
        require(math.isfinite(real("origin", self.origin)), "origin", "be finite", self.origin)
        return self

    def bins(self, column: Column) -> NDArray[np.int32]:
        """Return the bin of each value: equal parts of a turn of the circle."""
        values = numbers(column)
        if np.isinf(values).any():
            raise ValueError("Input contains infinity, which has no place on a circle")
        turns = (values - self.origin) / self.period
        # Rounding to 9 digits puts values a period apart into the same bin, also at bins' limits.
        positions = np.round((turns - np.floor(turns)) * self.size, 9)
        return positions.astype(np.int32) % np.int32(self.size)
