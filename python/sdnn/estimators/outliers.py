"""Outliers: values so far from all others that a range with them hides differences of these."""

from __future__ import annotations

import sys
import warnings

import numpy as np

from sdnn.coding import Coding
from sdnn.coding.symbols import missing_as_nan, present
from sdnn.estimators.columns import Array, Floats

# Chosen constants.
TAIL = 0.025  # share of values at either end that may be outliers
FAR = 2.0  # gap beyond which values are outliers, in widths of the middle values
FEWEST = 10  # values; smaller samples have no outliers


class OutlierWarning(UserWarning):
    """A warning that a range is learned from values of which some are far from all others."""


def usual_range(values: Floats) -> tuple[float, float]:
    """Return the smallest and largest value that are no outliers.

    Outliers are at most a fortieth of the values at either end, beyond a gap of twice the width of
    the middle 95 %. If more than half of the values are equal, this width includes their value and
    the middle 95 % of the others.

    >>> usual_range(np.append(np.arange(100.0), 1e6))
    (0.0, 99.0)
    """
    ordered = np.sort(values)
    low, high = middle_of(ordered)
    median = ordered[len(ordered) // 2]
    others = ordered[ordered != median]
    if 0 < len(others) < len(ordered) / 2:
        low, high = middle_of(others)
        low, high = min(low, float(median)), max(high, float(median))
    with np.errstate(over="ignore"):
        # Entry i tells whether a gap parts the values i and i + 1.
        gaps = np.diff(ordered) > FAR * (high - low)
    if len(ordered) < FEWEST or not gaps.any():
        return float(ordered[0]), float(ordered[-1])
    below = np.flatnonzero(gaps & (ordered[1:] <= low))
    above = np.flatnonzero(gaps & (ordered[:-1] >= high))
    first = below[-1] + 1 if len(below) else 0
    last = above[0] if len(above) else -1
    return float(ordered[first]), float(ordered[last])


def middle_of(ordered: Floats) -> tuple[float, float]:
    """Return the limits of the middle 95 % of sorted values."""
    n_tail = min(int(np.ceil(TAIL * len(ordered))), (len(ordered) - 1) // 2)
    return float(ordered[n_tail]), float(ordered[-1 - n_tail])


def numbers_to_range(coding: Coding, column: Array) -> Floats | None:
    """Return the numbers whose range a coding learns, NaN where missing; None without a range."""
    base = present(coding)
    if not (base.is_numeric and base.learns) or getattr(base, "spacing", "even") == "quantile":
        return None
    return missing_as_nan(column) if base is not coding else column.astype(np.float64)


def warn_caller(message: str, category: type[Warning]) -> None:
    """Warn at the calling line outside this package and scikit-learn."""
    level, frame = 1, sys._getframe()
    while frame.f_back and frame.f_globals.get("__name__", "").startswith(("sdnn.", "sklearn.")):
        level, frame = level + 1, frame.f_back
    warnings.warn(message, category, stacklevel=level)
