"""Prediction intervals from errors of predictions that had not learned the samples.

A new error is below the k-th smallest of n such errors with a probability of about k / (n + 1), if
it is drawn like them. Source: Vovk, V., Gammerman, A., Shafer, G. (2005), Algorithmic learning in a
random world; Barber, R., Candes, E., Ramdas, A., Tibshirani, R. (2021), Predictive inference with
the jackknife+, Annals of Statistics 49 (the jackknife, of which this is the plain form).
"""

from __future__ import annotations

import bisect
import collections
import math

import numpy as np

from sdnn.estimators.columns import Floats
from sdnn.support.arguments import real

# Chosen constants.
N_ERRORS = 300  # errors of a stream that are remembered
STEP = 0.02  # change of the level of a stream's intervals after an error

ROUNDED_DOWN = 1.0 - 1e-12  # factor against rounding, as 0.9 * 10 may be more than 9

LEAST_SHARE = 0.01
"""Least size of an error for a model of sizes, as a share of the root mean square error."""


def coverage_of(coverage: float) -> float:
    """Check the share of targets that intervals are to contain; TypeError or ValueError."""
    value = real("coverage", coverage)
    if not 0.0 < value < 1.0:
        raise ValueError(f"coverage must be above 0 and below 1, such as 0.9, got {value:g}")
    return value


def error_bounds(sizes: Floats, counts: Floats, coverage: float) -> Floats:
    """Return the size of errors that a new error does not exceed with a probability of `coverage`.

    Shapes: sizes (n_samples, n_outputs), counts (n_samples,), above 0; returns (n_outputs,). A
    sample of count 2 counts as two samples. ValueError if there are too few samples.
    """
    total = float(counts.sum())
    needed = coverage * (total + 1.0) * ROUNDED_DOWN
    if needed > total:
        least = math.ceil(coverage / (1.0 - coverage) * ROUNDED_DOWN)
        raise ValueError(
            f"coverage must be at most {total / (total + 1.0)} with the errors of {total:g} samples"
            f" (the sum of their weights), got {coverage}, which needs {least} samples"
        )
    bounds = []
    for column in sizes.T:
        order = np.argsort(column, kind="stable")
        rank = int(np.searchsorted(np.cumsum(counts[order]), needed))
        bounds.append(column[order[min(rank, len(order) - 1)]])  # sums may be rounded
    return np.array(bounds)


def log_sizes(errors: Floats) -> Floats:
    """Return logarithms of the sizes of errors, as targets of a model; shape as `errors`.

    Each is at least `LEAST_SHARE` of their root mean square: an error of 0 has no logarithm.
    """
    sizes = np.abs(errors)
    unit = sizes.max(axis=0)
    unit[unit == 0.0] = 1.0
    shares = sizes / unit  # whose squares stay finite
    least = LEAST_SHARE * np.sqrt(np.square(shares).mean(axis=0))
    logarithms: Floats = np.log(unit) + np.log(np.maximum(shares, np.where(least > 0, least, 1.0)))
    return logarithms


class FollowedErrors:
    """Half widths of intervals from the last errors of a stream.

    They are a quantile of the last 300 errors, whose level rises after each target outside its
    interval, and falls a little after each other one, so that the coverage stays as the errors
    change. Source: Gibbs, I., Candes, E. (2021), Adaptive conformal inference under distribution
    shift, NeurIPS 34. ``coverage`` is the share of targets that intervals are to contain.
    """

    def __init__(self, coverage: float) -> None:
        self.coverage = coverage
        self.level = coverage
        self.last: collections.deque[float] = collections.deque(maxlen=N_ERRORS)
        self.ordered: list[float] = []

    def half_width(self) -> float:
        """Return the half width of the next interval; 0 before the first error.

        >>> errors = FollowedErrors(0.5)
        >>> for error in (3.0, 1.0, 2.0):
        ...     errors.learn(error)
        >>> errors.half_width()
        2.0
        """
        n_errors = len(self.ordered)
        if n_errors == 0:
            return 0.0
        rank = math.ceil(self.level * (n_errors + 1) * ROUNDED_DOWN) - 1
        return self.ordered[min(max(rank, 0), n_errors - 1)]

    def learn(self, error: float) -> None:
        """Learn the size of an error, which the next half width was to exceed."""
        if self.ordered:
            is_outside = error > self.half_width()
            self.level += STEP * (is_outside - (1.0 - self.coverage))
        if len(self.last) == N_ERRORS:
            self.ordered.pop(bisect.bisect_left(self.ordered, self.last[0]))
        self.last.append(error)
        bisect.insort(self.ordered, error)
