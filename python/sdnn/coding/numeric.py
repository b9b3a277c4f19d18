"""Codings of numbers: random-inverse, anchor interpolation, and its circular form for angles."""

from __future__ import annotations

import dataclasses
import math
import warnings
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.arguments import one_of, real, whole
from sdnn.coding.base import Coding, known
from sdnn.coding.ranges import (
    Knots,
    bins_of_positions,
    checked_knots,
    learned_range,
    positions,
    quantile_knots,
)

__all__ = ["Anchor", "Circular", "CoarseCodeWarning", "RandomInverse"]

MAX_BINS = 65535
FINE = 1000
"""Bins from which on more of them make no visible difference."""
LONGEST = 1000.0
"""The largest length_scale: all values would look alike beyond."""
FEW_BINS = 8


class CoarseCodeWarning(UserWarning):
    """A length scale leaves few bins, because neighbouring patterns differ in a unit at least."""


def numbers(column: NDArray[Any]) -> NDArray[np.float64]:
    """Return the column as numbers.

    Raises
    ------
    ValueError
        If a value is not a number, or NaN.
    """
    if np.iscomplexobj(column):
        raise ValueError("Complex data not supported")
    values = np.asarray(column, dtype=np.float64)
    if np.isnan(values).any():
        raise ValueError("Input contains NaN")
    return values


@dataclasses.dataclass(frozen=True, kw_only=True)
class RandomInverse(Coding):
    """The first pattern is random; each next one flips a few units of each sign of its neighbour.

    The correlation of two patterns falls exponentially with the distance of their bins,
    ``(1 - 4 * n_flipped / n_units) ** distance``.

    Attributes
    ----------
    length_scale : float
        Distance, as a share of the range, at which the correlation has fallen to 1/e. It sets
        what is None of ``n_bins`` and ``n_flipped``.
    n_bins, n_flipped : int, optional
        q and r of the method: number of bins, and units of each sign that flip from bin to bin.
    spacing : {"even", "quantile"}
        Bins of equal width, or of equal share of the training sample (robust to outliers and
        skew; a range cannot be given then, but with knots).
    low, high : float, optional
        The range; values beyond it count as its ends. Learned from the sample where None.
    knots : tuple of (value, position), optional
        Learned by ``spacing="quantile"``; learned with the range, or given with it.
    """

    name: ClassVar[str] = "random-inverse"
    length_scale: float = 0.5
    n_bins: int | None = None
    n_flipped: int | None = None
    spacing: Literal["even", "quantile"] = "even"
    low: float | None = None
    high: float | None = None
    knots: Knots | None = None

    def fit(self, column: NDArray[Any], n_units: int) -> RandomInverse:
        """Return a copy with range, ``n_bins`` and ``n_flipped`` known; see `Coding.fit`."""
        one_of("spacing", self.spacing, ("even", "quantile"))
        is_learned = self.knots is not None and not self.learns
        has_range = not (self.low is None and self.high is None)
        if self.spacing == "quantile" and has_range and not is_learned:
            raise ValueError("low and high cannot be given with spacing='quantile'")
        if not 0 < real("length_scale", self.length_scale) <= LONGEST:
            raise ValueError(f"length_scale must be in (0, {LONGEST}], got {self.length_scale!r}")
        values = numbers(column)
        low, high = learned_range(values, self.low, self.high)
        n_bins, n_flipped = self._bins_and_flips(n_units)
        knots = None
        if self.spacing == "quantile":
            knots = checked_knots(self.knots, low, high) if is_learned else quantile_knots(values)
        return dataclasses.replace(
            self, n_bins=n_bins, n_flipped=n_flipped, low=low, high=high, knots=knots
        )

    def _bins_and_flips(self, n_units: int) -> tuple[int, int]:
        most = n_units // 2
        if self.n_flipped is not None:
            flipped = whole("n_flipped", self.n_flipped, 1, most)
        elif self.n_bins is not None:
            q = whole("n_bins", self.n_bins, 2, MAX_BINS)
            kept = math.exp(-1 / (q * self.length_scale))
            flipped = min(most, max(1, round(n_units * (1 - kept) / 4)))
        else:
            flipped = max(1, math.ceil(n_units / (4 * self.length_scale * FINE)))
            if flipped > most:
                raise ValueError(
                    f"length_scale must be at least {1 / (2 * FINE)}, got {self.length_scale!r}"
                )
        if self.n_bins is not None:
            return whole("n_bins", self.n_bins, 2, MAX_BINS), flipped
        per_length = n_units / (4 * flipped)
        n_bins = min(MAX_BINS, max(2, round(per_length / self.length_scale)))
        if n_bins < FEW_BINS and self.n_flipped is None:
            warnings.warn(
                f"length_scale={self.length_scale} with patterns of {n_units} units leaves "
                f"{n_bins} bins of the range; more n_pattern_units or a shorter length_scale "
                "tell more values apart",
                CoarseCodeWarning,
                stacklevel=2,
            )
        return n_bins, flipped

    @property
    def learns(self) -> bool:
        """Whether ``fit`` learns from the sample."""
        return self.low is None or self.high is None

    @property
    def size(self) -> int:
        """The number of bins."""
        return known(self.n_bins)

    def bins(self, column: NDArray[Any]) -> NDArray[np.int32]:
        """Return the bin of each value; see `Coding.bins`."""
        where = positions(numbers(column), known(self.low), known(self.high), self.knots)
        return bins_of_positions(where, self.size)

    def ends(self) -> tuple[float, float]:
        """Return the range; see `Coding.ends`."""
        return known(self.low), known(self.high)

    def even_range(self) -> tuple[float, float] | None:
        """Return the range unless bins are quantiles; see `Coding.even_range`."""
        return self.ends() if self.knots is None else None

    def patterns(self, n_units: int, seed: int) -> NDArray[np.int8]:
        """Draw the patterns; see `Coding.patterns`."""
        return _core.random_inverse_patterns(n_units, self.size, known(self.n_flipped), seed)

    def correlations(self, n_units: int) -> NDArray[np.float64]:
        """``(1 - 4 r / n) ** |i - j|``; see `Coding.correlations`."""
        distance = np.abs(np.subtract.outer(np.arange(self.size), np.arange(self.size)))
        return np.power(1 - 4 * known(self.n_flipped) / n_units, distance)


def interpolated_correlations(
    n_stretches: int, n_portions: int, circular: bool
) -> NDArray[np.float64]:
    """Return the expected correlations of interpolated patterns, whose anchors are independent.

    Within a stretch between two anchors they fall linearly; in neighbouring stretches they are
    the product of the shares that both patterns have of the anchor between them.
    """
    stretch, portion = np.divmod(np.arange(n_stretches * n_portions), n_portions)
    share = portion / n_portions
    step = np.subtract.outer(stretch, stretch)
    same = 1 - np.abs(np.subtract.outer(share, share))
    across = np.multiply.outer(1 - share, share)
    if circular and n_stretches == 1:
        return np.ones_like(same)  # both ends are the same anchor
    following = step % n_stretches == 1 if circular else step == 1
    result: NDArray[np.float64] = (step == 0) * same + following * across + following.T * across.T
    return result


@dataclasses.dataclass(frozen=True, kw_only=True)
class Anchor(Coding):
    """Independent random anchor patterns at even distances, interpolated between.

    The correlation of two patterns falls about linearly with their distance and is zero beyond
    two stretches.

    Attributes
    ----------
    n_anchor_patterns, n_interpolated : int
        Anchors, and patterns between neighbouring ones;
        ``(n_anchor_patterns - 1) * (n_interpolated + 1)`` bins.
    low, high : float, optional
        The range; values beyond it count as its ends. Learned from the sample where None.
    """

    name: ClassVar[str] = "anchor"
    n_anchor_patterns: int = 9
    n_interpolated: int = 44
    low: float | None = None
    high: float | None = None

    def fit(self, column: NDArray[Any], n_units: int) -> Anchor:
        """Return a copy with the range known; see `Coding.fit`."""
        check_anchors(self.n_anchor_patterns, self.n_interpolated)
        low, high = learned_range(numbers(column), self.low, self.high)
        return dataclasses.replace(self, low=low, high=high)

    @property
    def learns(self) -> bool:
        """Whether ``fit`` learns from the sample."""
        return self.low is None or self.high is None

    @property
    def size(self) -> int:
        """The number of bins."""
        return (self.n_anchor_patterns - 1) * (self.n_interpolated + 1)

    def bins(self, column: NDArray[Any]) -> NDArray[np.int32]:
        """Return the bin of each value; see `Coding.bins`."""
        where = positions(numbers(column), known(self.low), known(self.high), None)
        return bins_of_positions(where, self.size)

    def ends(self) -> tuple[float, float]:
        """Return the range; see `Coding.ends`."""
        return known(self.low), known(self.high)

    def even_range(self) -> tuple[float, float]:
        """Return the range; see `Coding.even_range`."""
        return self.ends()

    def patterns(self, n_units: int, seed: int) -> NDArray[np.int8]:
        """Draw the patterns; see `Coding.patterns`."""
        return _core.anchor_patterns(
            n_units, self.n_anchor_patterns, self.n_interpolated, False, seed
        )

    def correlations(self, n_units: int) -> NDArray[np.float64]:
        """Piecewise linear and bilinear; see `Coding.correlations`."""
        return interpolated_correlations(
            self.n_anchor_patterns - 1, self.n_interpolated + 1, circular=False
        )


@dataclasses.dataclass(frozen=True, kw_only=True)
class Circular(Coding):
    """Anchor interpolation on a circle: the last anchor is the first.

    Attributes
    ----------
    period, origin : float
        Values a period apart are the same; bins begin at the origin.
    n_anchor_patterns, n_interpolated : int
        As of `Anchor`; the last anchor, which is the first again, counts.
    """

    name: ClassVar[str] = "circular"
    period: float = 2 * math.pi
    origin: float = 0.0
    n_anchor_patterns: int = 9
    n_interpolated: int = 44

    def fit(self, column: NDArray[Any], n_units: int) -> Circular:
        """Return itself, checked: nothing is learned; see `Coding.fit`."""
        check_anchors(self.n_anchor_patterns, self.n_interpolated)
        numbers(column)
        if not 0 < real("period", self.period) < math.inf or not math.isfinite(
            real("origin", self.origin)
        ):
            raise ValueError(
                f"period must be positive and origin finite, got {self.period!r} and "
                f"{self.origin!r}"
            )
        return self

    @property
    def learns(self) -> bool:
        """Whether ``fit`` learns from the sample."""
        return False

    @property
    def size(self) -> int:
        """The number of bins."""
        return (self.n_anchor_patterns - 1) * (self.n_interpolated + 1)

    def bins(self, column: NDArray[Any]) -> NDArray[np.int32]:
        """Return the bin of each value; see `Coding.bins`."""
        values = numbers(column)
        if np.isinf(values).any():
            raise ValueError("Input contains infinity, which has no place on a circle")
        turns = (values - self.origin) / self.period
        return bins_of_positions(turns - np.floor(turns), self.size)

    def patterns(self, n_units: int, seed: int) -> NDArray[np.int8]:
        """Draw the patterns; see `Coding.patterns`."""
        return _core.anchor_patterns(
            n_units, self.n_anchor_patterns, self.n_interpolated, True, seed
        )

    def correlations(self, n_units: int) -> NDArray[np.float64]:
        """Those of `Anchor`, and across the seam; see `Coding.correlations`."""
        return interpolated_correlations(
            self.n_anchor_patterns - 1, self.n_interpolated + 1, circular=True
        )


def check_anchors(n_anchor_patterns: int, n_interpolated: int) -> None:
    """ValueError if the numbers are impossible."""
    whole("n_anchor_patterns", n_anchor_patterns, 2, 10000)
    whole("n_interpolated", n_interpolated, 0, 10000)
    size = (n_anchor_patterns - 1) * (n_interpolated + 1)
    whole("(n_anchor_patterns - 1) * (n_interpolated + 1)", size, 1, MAX_BINS)
