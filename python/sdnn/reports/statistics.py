"""Statistics over trials.

The relevant spread is that between trials, so every interval is a percentile bootstrap over
whole trials. Each call draws from a new generator with a fixed seed: an interval depends on the
values alone. Its limits are values of the bootstrap distribution, never interpolated, so censored,
infinite trials are allowed.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]

CONFIDENCE, BOOTSTRAP_SEED = 0.95, 2015
_N_RESAMPLES = 10_000


def json_number(value: float, last_episode: int | None) -> float | str | None:
    """Return a number for JSON: NaN is null, infinity ``">last_episode"`` or null.

    >>> json_number(math.inf, 15000)
    '>15000'
    """
    if math.isnan(value) or (math.isinf(value) and last_episode is None):
        return None
    return f">{last_episode}" if math.isinf(value) else value


@dataclass(frozen=True)
class Estimate:
    """A statistic over trials, infinite where it is censored, with its interval.

    The limits are NaN for fewer than two trials.
    """

    value: float
    lower: float
    upper: float

    def to_json(self, last_episode: int) -> dict[str, float | str | None]:
        """Return the values for JSON; a censored value is ``">last_episode"``."""
        return {name: json_number(value, last_episode) for name, value in vars(self).items()}


def running_median(values: ArrayLike, window: int) -> FloatArray:
    """Return the median of each value and its neighbours within an odd window.

    >>> running_median([1, 9, 2, 3, 8], 3)
    array([5. , 2. , 3. , 3. , 5.5])
    """
    padded = np.pad(np.asarray(values, np.float64), window // 2, constant_values=np.nan)
    return np.asarray(np.nanmedian(sliding_window_view(padded, window), axis=1))


def estimate_median(values: ArrayLike) -> Estimate:
    """Return the median of the values of trials, (n_trials,), with its interval.

    >>> estimate_median([4.0, 4.0, 4.0])
    Estimate(value=4.0, lower=4.0, upper=4.0)
    """
    return _bootstrap(_median, values)


def estimate_mean(values: ArrayLike) -> Estimate:
    """Return the mean of the values of trials, (n_trials,), with its interval; NaN gives NaN.

    Raises ValueError if there are no values or an infinite one.

    >>> estimate_mean([3.0, 3.0])
    Estimate(value=3.0, lower=3.0, upper=3.0)
    """
    _check_finite("averaged", values)
    return _bootstrap(lambda sample: np.asarray(np.mean(sample, axis=-1)), values)


def estimate_contrast(
    values: ArrayLike,
    others: ArrayLike,
    contrast: Callable[[FloatArray, FloatArray], FloatArray] = np.subtract,
) -> Estimate:
    """Return the contrast of two groups' medians with its interval; each group is resampled.

    NaN gives NaN; ValueError if a group has no values or an infinite one.

    >>> estimate_contrast([7.0, 7.0], [4.0, 4.0, 4.0])
    Estimate(value=3.0, lower=3.0, upper=3.0)
    """
    _check_finite("compared", values, others)
    return _bootstrap(
        lambda first, second: contrast(_median(first), _median(second)), values, others
    )


def interval_limits(distribution: FloatArray) -> FloatArray:
    """Return the limits of the middle 95 % of distributions over the last axis: lower, upper.

    >>> interval_limits(np.arange(201.0))
    array([  5., 195.])
    """
    tail = (1 - CONFIDENCE) / 2
    limits = np.quantile(distribution, (tail, 1 - tail), axis=-1, method="inverted_cdf")
    return np.asarray(limits, np.float64)


def _bootstrap(statistic: Callable[..., FloatArray], *groups: ArrayLike) -> Estimate:
    """Return a statistic of groups of trials, with its interval over resamples of each group."""
    samples = [np.asarray(values, np.float64) for values in groups]
    for sample in samples:
        if sample.ndim != 1 or sample.size == 0:
            raise ValueError(f"values must be one per trial, got shape {sample.shape}")
    value = float(statistic(*samples))
    if min(sample.size for sample in samples) == 1:
        return Estimate(value, math.nan, math.nan)
    generator = np.random.default_rng(BOOTSTRAP_SEED)
    drawn = [s[generator.integers(s.size, size=(_N_RESAMPLES, s.size))] for s in samples]
    lower, upper = interval_limits(statistic(*drawn))
    return Estimate(value, float(lower), float(upper))


def _median(values: FloatArray) -> FloatArray:
    return np.asarray(np.median(values, axis=-1))


def _check_finite(use: str, *groups: ArrayLike) -> None:
    """Raise ValueError for infinite values; ``use`` is "averaged" or "compared"."""
    if any(np.isinf(np.asarray(values, np.float64)).any() for values in groups):
        raise ValueError(f"{use} values must not be infinite; cap censored ones first")
