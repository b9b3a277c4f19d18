"""Where a number lies in its input's range, from 0 to 1."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdnn.arguments import real

__all__ = [
    "MAX_KNOTS",
    "bins_of_positions",
    "checked_knots",
    "learned_range",
    "positions",
    "quantile_knots",
]

MAX_KNOTS = 129
"""Knots that hold a column's distribution; beyond so many the codes hardly differ."""

Knots = tuple[tuple[float, float], ...]


def learned_range(
    column: NDArray[Any], low: float | None, high: float | None
) -> tuple[float, float]:
    """Return the given ends, or the column's where they are None.

    Raises
    ------
    ValueError
        If the ends are not finite or in the wrong order. Equal ends are those of a column that
        has one value only.
    """
    ends = (
        float(np.min(column)) if low is None else real("low", low),
        float(np.max(column)) if high is None else real("high", high),
    )
    given = low is not None and high is not None
    is_constant = ends[0] == ends[1] and bool(np.all(column == ends[0]))
    if not all(map(math.isfinite, ends)) or (given and ends[0] >= ends[1] and not is_constant):
        raise ValueError(f"low and high must be finite, low < high, got {ends[0]} and {ends[1]}")
    return ends[0], max(ends)


def quantile_knots(column: NDArray[Any]) -> Knots:
    """Values and their mean ranks, scaled to [0, 1]: at most `MAX_KNOTS` of them.

    >>> quantile_knots(np.array([1.0, 2.0, 2.0, 50.0]))
    ((1.0, 0.0), (2.0, 0.5), (50.0, 1.0))
    """
    values, counts = np.unique(np.asarray(column, dtype=np.float64), return_counts=True)
    if len(values) == 1:
        return ((float(values[0]), 0.0),)
    ranks = np.cumsum(counts) - counts / 2
    levels = (ranks - ranks[0]) / (ranks[-1] - ranks[0])
    if len(values) > MAX_KNOTS:
        kept = np.unique(np.searchsorted(levels, np.linspace(0, 1, MAX_KNOTS)))
        values, levels = values[kept], levels[kept]
    return tuple(zip(values.tolist(), levels.tolist(), strict=True))


def checked_knots(knots: Any, low: float, high: float) -> Knots:
    """Return knots that an earlier fit has learned.

    Raises
    ------
    ValueError
        Unless values and positions rise, from (low, 0) to (high, 1).
    """
    ends: tuple[float, ...] = ()
    is_rising = False
    try:
        values, levels = np.array(knots, dtype=np.float64).T
        ends = (values[0], levels[0], values[-1], levels[-1])
        is_rising = bool(np.all(values[1:] > values[:-1]) and np.all(levels[1:] > levels[:-1]))
    except (IndexError, TypeError, ValueError):
        pass
    if not is_rising or ends != (low, 0.0, high, 1.0 if low < high else 0.0):
        raise ValueError(
            f"knots must be (value, position) in rising order from ({low}, 0) to ({high}, 1), "
            f"got {knots!r}"
        )
    return tuple(zip(values.tolist(), levels.tolist(), strict=True))


def positions(
    column: NDArray[np.float64], low: float, high: float, knots: Knots | None
) -> NDArray[np.float64]:
    """Scale values to [0, 1], saturating; a range without width puts every value at 0.

    >>> positions(np.array([0.0, 4.0, 9.0]), 2.0, 6.0, None)
    array([0. , 0.5, 1. ])
    """
    if not low < high:
        return np.zeros(len(column))
    if knots is not None:
        values, levels = np.array(knots).T
        between: NDArray[np.float64] = np.interp(column, values, levels)
        return between
    # Halves, so that the width of the widest range is still a number.
    inside = np.clip(column, low, high)
    where: NDArray[np.float64] = (inside / 2 - low / 2) / (high / 2 - low / 2)
    return where


def bins_of_positions(where: NDArray[np.float64], n_bins: int) -> NDArray[np.int32]:
    """Return the bin among equal half-open parts of [0, 1]; 1 falls into the last."""
    return np.minimum((where * n_bins).astype(np.int32), np.int32(n_bins - 1))
