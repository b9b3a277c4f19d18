"""Statistics over trials.

The spread that matters is the one between trials, so every interval here is a percentile bootstrap
over whole trials. Each call draws from a generator of its own with a fixed seed: an interval
depends on the values alone. Its ends are values of the bootstrap distribution, never interpolated,
so censored, infinite trials are allowed.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class BootstrapConfig:
    """Share of the distribution inside an interval, number of resamples, and their seed."""

    confidence: float = 0.95
    n_resamples: int = 10_000
    seed: int = 2015


DEFAULT_BOOTSTRAP = BootstrapConfig()


def json_number(value: float, last_episode: int | None) -> float | str | None:
    """Return a number as JSON can hold it: NaN is null, infinity ``">last_episode"`` or null.

    >>> json_number(math.inf, 15000)
    '>15000'
    """
    if math.isnan(value) or (math.isinf(value) and last_episode is None):
        return None
    return f">{last_episode}" if math.isinf(value) else value


@dataclass(frozen=True)
class Estimate:
    """A statistic over trials, infinite where it is censored, with its interval.

    The ends are NaN where there are fewer than two trials.
    """

    value: float
    lower: float
    upper: float

    def to_json(self, last_episode: int) -> dict[str, float | str | None]:
        """Return it as values that JSON can hold; see `json_number`."""
        return {name: json_number(value, last_episode) for name, value in vars(self).items()}


def running_median(values: ArrayLike, window: int) -> FloatArray:
    """Return the median of each value with its neighbours, fewer at both ends; the window is odd.

    >>> running_median([1, 9, 2, 3, 8], 3)
    array([5. , 2. , 3. , 3. , 5.5])
    """
    half = window // 2
    padded = np.pad(np.asarray(values, np.float64), half, constant_values=np.nan)
    return np.asarray(np.nanmedian(sliding_window_view(padded, window), axis=1))


def estimate_median(values: ArrayLike, config: BootstrapConfig = DEFAULT_BOOTSTRAP) -> Estimate:
    """Return the median of the values of trials, (n_trials,), with its interval.

    >>> estimate_median([4.0, 4.0, 4.0])
    Estimate(value=4.0, lower=4.0, upper=4.0)
    """
    return _estimate(_median, (values,), config)


def estimate_mean(values: ArrayLike, config: BootstrapConfig = DEFAULT_BOOTSTRAP) -> Estimate:
    """Return the mean of the values of trials, (n_trials,), with its interval; NaN gives NaN.

    >>> estimate_mean([3.0, 3.0])
    Estimate(value=3.0, lower=3.0, upper=3.0)
    """
    _check_finite("averaged", values)
    return _estimate(lambda sample: np.asarray(np.mean(sample, axis=-1)), (values,), config)


def estimate_contrast(
    values: ArrayLike,
    others: ArrayLike,
    contrast: Callable[[FloatArray, FloatArray], FloatArray] = np.subtract,
    config: BootstrapConfig = DEFAULT_BOOTSTRAP,
) -> Estimate:
    """Compare the medians of two groups of trials; each group is resampled by itself.

    NaN gives NaN; a ValueError says that a group has no values or an infinite one.

    >>> estimate_contrast([7.0, 7.0], [4.0, 4.0, 4.0])
    Estimate(value=3.0, lower=3.0, upper=3.0)
    """
    _check_finite("compared", values, others)
    return _estimate(
        lambda first, second: contrast(_median(first), _median(second)), (values, others), config
    )


def tails(distribution: FloatArray, confidence: float) -> FloatArray:
    """Return the ends of the middle part of distributions over the last axis, values of theirs.

    >>> tails(np.arange(101.0), 0.9)
    array([ 5., 95.])
    """
    tail = (1 - confidence) / 2
    ends = np.quantile(distribution, (tail, 1 - tail), axis=-1, method="inverted_cdf")
    return np.asarray(ends, np.float64)


def _estimate(
    statistic: Callable[..., FloatArray], groups: tuple[ArrayLike, ...], config: BootstrapConfig
) -> Estimate:
    samples = [np.asarray(values, np.float64) for values in groups]
    for sample in samples:
        if sample.ndim != 1 or sample.size == 0:
            raise ValueError(f"values must be one per trial, got shape {sample.shape}")
    value = float(statistic(*samples))
    if min(sample.size for sample in samples) == 1:
        return Estimate(value, math.nan, math.nan)
    generator = np.random.default_rng(config.seed)
    drawn = [
        sample[generator.integers(sample.size, size=(config.n_resamples, sample.size))]
        for sample in samples
    ]
    lower, upper = tails(statistic(*drawn), config.confidence)
    return Estimate(value, float(lower), float(upper))


def _median(values: FloatArray) -> FloatArray:
    return np.asarray(np.median(values, axis=-1))


def _check_finite(done: str, *groups: ArrayLike) -> None:
    if any(np.isinf(np.asarray(values, np.float64)).any() for values in groups):
        raise ValueError(f"{done} values must not be infinite; cap censored ones first")
