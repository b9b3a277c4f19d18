"""Statistics over trials.

The spread that matters is the one between trials, so every interval here is a bootstrap over
whole trials. Arrays of curves have the shape (n_trials, n_tests).
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
    """Constants of the intervals.

    Parameters
    ----------
    confidence
        Share of the bootstrap distribution inside an interval.
    n_resamples
        Resamples of the bootstrap.
    seed
        Seed of the bootstrap's own generator.
    """

    confidence: float = 0.95
    n_resamples: int = 10_000
    seed: int = 2015


DEFAULT_BOOTSTRAP = BootstrapConfig()


def json_number(value: float, last_episode: int | None) -> float | str | None:
    """Return a number as JSON can hold it: NaN is null, infinity ``">last_episode"`` or null.

    Examples
    --------
    >>> json_number(math.inf, 15000)
    '>15000'
    """
    if math.isnan(value) or (math.isinf(value) and last_episode is None):
        return None
    return f">{last_episode}" if math.isinf(value) else value


@dataclass(frozen=True)
class Estimate:
    """A statistic over trials with its bootstrap interval.

    Parameters
    ----------
    value
        The statistic of the trials; infinite where it is censored.
    lower, upper
        Ends of the interval; NaN where there are fewer than two trials.
    """

    value: float
    lower: float
    upper: float

    def to_json(self, last_episode: int) -> dict[str, float | str | None]:
        """Return it as values that JSON can hold; see `json_number`."""
        ends = {"value": self.value, "lower": self.lower, "upper": self.upper}
        return {name: json_number(value, last_episode) for name, value in ends.items()}


@dataclass(frozen=True)
class Curve:
    """Statistics over trials at each test episode.

    Parameters
    ----------
    episode : (n_tests,)
        Learning episodes done before the test.
    median, lower, upper : (n_tests,)
        Median and quartiles over trials.
    """

    episode: NDArray[np.int32]
    median: FloatArray
    lower: FloatArray
    upper: FloatArray


def learning_curve(episode: NDArray[np.int32], steps: ArrayLike) -> Curve:
    """Median and quartiles over trials of the steps at each test episode.

    Quartiles are interpolated linearly between trials, as `numpy.percentile` does.

    Parameters
    ----------
    episode : (n_tests,)
        Learning episodes done before the test.
    steps : (n_trials, n_tests)
        Steps of each test episode.

    Examples
    --------
    >>> learning_curve(np.array([10], np.int32), [[3], [5], [50]]).median
    array([5.])
    """
    lower, median, upper = np.percentile(np.asarray(steps, np.float64), (25, 50, 75), axis=0)
    return Curve(episode, median, lower, upper)


def running_median(values: ArrayLike, window: int) -> FloatArray:
    """Median of each value with its neighbours, `window` of them in all; fewer at both ends.

    Parameters
    ----------
    values : (n,)
        A curve.
    window
        Odd number of values.

    Examples
    --------
    >>> running_median([1, 9, 2, 3, 8], 3)
    array([5. , 2. , 3. , 3. , 5.5])
    """
    half = window // 2
    padded = np.pad(np.asarray(values, np.float64), half, constant_values=np.nan)
    return np.asarray(np.nanmedian(sliding_window_view(padded, window), axis=1))


def estimate_median(values: ArrayLike, config: BootstrapConfig = DEFAULT_BOOTSTRAP) -> Estimate:
    """Return the median over trials with its percentile bootstrap interval.

    Trials are drawn with replacement `n_resamples` times by a generator of its own, seeded anew
    at each call, so the interval depends on the values and `config` alone. Its ends are values
    of the bootstrap distribution (never interpolated), so censored, infinite trials are allowed.

    Parameters
    ----------
    values : (n_trials,)
        One value per trial.
    config
        Constants.

    Raises
    ------
    ValueError
        If there are no values.

    Examples
    --------
    >>> estimate_median([4.0, 4.0, 4.0])
    Estimate(value=4.0, lower=4.0, upper=4.0)
    """
    sample = _sample(values)
    value = float(_median(sample))
    if sample.size == 1:
        return Estimate(value, math.nan, math.nan)
    generator = np.random.default_rng(config.seed)
    return _with_interval(value, _median(_resampled(sample, generator, config)), config)


def estimate_mean(values: ArrayLike, config: BootstrapConfig = DEFAULT_BOOTSTRAP) -> Estimate:
    """Return the mean over trials with its percentile bootstrap interval; as `estimate_median`.

    Parameters
    ----------
    values : (n_trials,)
        One value per trial, none of them infinite; NaN gives NaN.
    config
        Constants.

    Raises
    ------
    ValueError
        If there are no values, or an infinite one.

    Examples
    --------
    >>> estimate_mean([3.0, 3.0])
    Estimate(value=3.0, lower=3.0, upper=3.0)
    """
    sample = _sample(values)
    if np.isinf(sample).any():
        raise ValueError("averaged values must not be infinite; cap censored ones first")
    value = float(np.mean(sample))
    if sample.size == 1:
        return Estimate(value, math.nan, math.nan)
    generator = np.random.default_rng(config.seed)
    return _with_interval(value, np.mean(_resampled(sample, generator, config), axis=-1), config)


def estimate_contrast(
    values: ArrayLike,
    others: ArrayLike,
    contrast: Callable[[FloatArray, FloatArray], FloatArray] = np.subtract,
    config: BootstrapConfig = DEFAULT_BOOTSTRAP,
) -> Estimate:
    """Compare the medians of two groups of trials; both are resampled, each for itself.

    Parameters
    ----------
    values : (n_trials,)
        One value per trial of the first group, none of them infinite; NaN gives NaN.
    others : (n_other_trials,)
        One value per trial of the second group, likewise.
    contrast
        What is made of both medians: their difference, or another function of two arrays.
    config
        Constants.

    Raises
    ------
    ValueError
        If a group has no values or an infinite one.

    Examples
    --------
    >>> estimate_contrast([7.0, 7.0], [4.0, 4.0, 4.0])
    Estimate(value=3.0, lower=3.0, upper=3.0)
    """
    first, second = _sample(values), _sample(others)
    if np.isinf(first).any() or np.isinf(second).any():
        raise ValueError("compared values must not be infinite; cap censored ones first")
    value = float(contrast(_median(first), _median(second)))
    if min(first.size, second.size) == 1:
        return Estimate(value, math.nan, math.nan)
    generator = np.random.default_rng(config.seed)
    resampled = [_median(_resampled(sample, generator, config)) for sample in (first, second)]
    return _with_interval(value, contrast(*resampled), config)


def _sample(values: ArrayLike) -> FloatArray:
    sample = np.asarray(values, np.float64)
    if sample.ndim != 1 or sample.size == 0:
        raise ValueError(f"values must be one per trial, got shape {sample.shape}")
    return sample


def _median(values: FloatArray) -> FloatArray:
    """Medians over the last axis, the mean of the middle two for an even number of values."""
    return np.asarray(np.median(values, axis=-1))


def _resampled(
    sample: FloatArray, generator: np.random.Generator, config: BootstrapConfig
) -> FloatArray:
    """Resamples of a group, (n_resamples, n_trials)."""
    return sample[generator.integers(sample.size, size=(config.n_resamples, sample.size))]


def _with_interval(value: float, distribution: FloatArray, config: BootstrapConfig) -> Estimate:
    lower, upper = tails(distribution, config.confidence)
    return Estimate(value, float(lower), float(upper))


def tails(distribution: FloatArray, confidence: float) -> FloatArray:
    """Return the ends of the middle part of distributions over the last axis, values of theirs.

    Examples
    --------
    >>> tails(np.arange(101.0), 0.9)
    array([ 5., 95.])
    """
    tail = (1 - confidence) / 2
    ends = np.quantile(distribution, (tail, 1 - tail), axis=-1, method="inverted_cdf")
    return np.asarray(ends, np.float64)
