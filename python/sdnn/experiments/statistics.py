"""Measures of a trial and statistics over trials.

The spread that matters is the one between trials, so every interval here is a bootstrap over
whole trials. Arrays of curves have the shape (n_trials, n_tests).
"""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike, NDArray

FloatArray = NDArray[np.float64]


@dataclass(frozen=True, kw_only=True)
class MeasureConfig:
    """Constants of the measures and intervals.

    Parameters
    ----------
    learned_steps
        A test episode of at most this many steps is good: the paper's "within 10 steps".
    learned_window
        Consecutive test episodes whose median must be good for the task to count as learned.
    final_window
        Test episodes at the end of a trial over which its final state is measured.
    confidence
        Share of the bootstrap distribution inside an interval.
    n_resamples
        Resamples of the bootstrap.
    bootstrap_seed
        Seed of the bootstrap's own generator.
    """

    learned_steps: float = 10.0
    learned_window: int = 10
    final_window: int = 50
    confidence: float = 0.95
    n_resamples: int = 10_000
    bootstrap_seed: int = 2015


DEFAULT_MEASURES = MeasureConfig()


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


def episodes_to_learn(
    episode: ArrayLike, steps: ArrayLike, config: MeasureConfig = DEFAULT_MEASURES
) -> float:
    """Learning episodes until the task is learned; infinite if it never is (censored).

    The task is learned at the first test episode that (1) takes at most `learned_steps` steps
    and (2) begins `learned_window` consecutive test episodes whose median is at most
    `learned_steps`. The result is the number of learning episodes done before that test.

    (1) keeps failed tests just before the first good one from counting as learned already;
    (2) keeps a single lucky test from counting. A later relapse does not undo learning. A window
    that the trial's end cuts off does not count. The median of an even number of steps is the
    mean of the middle two.

    Parameters
    ----------
    episode : (n_tests,)
        Learning episodes done before each test.
    steps : (n_tests,)
        Steps of each test episode.
    config
        Constants.

    Examples
    --------
    >>> episode = 10 * np.arange(1, 13)
    >>> episodes_to_learn(episode, [50, 50] + 10 * [7])
    30.0
    >>> episodes_to_learn(episode, 12 * [50])
    inf
    """
    taken = np.asarray(steps, np.float64)
    if taken.size < config.learned_window:
        return math.inf
    windows = sliding_window_view(taken, config.learned_window)
    good = (np.median(windows, axis=1) <= config.learned_steps) & (
        windows[:, 0] <= config.learned_steps
    )
    return float(np.asarray(episode)[int(np.argmax(good))]) if good.any() else math.inf


def final_steps(steps: ArrayLike, config: MeasureConfig = DEFAULT_MEASURES) -> float:
    """Median steps over the last `final_window` test episodes, or over all if there are fewer.

    Parameters
    ----------
    steps : (n_tests,)
        Steps of each test episode.
    config
        Constants.

    Examples
    --------
    >>> final_steps(100 * [50] + 50 * [4])
    4.0
    """
    return float(np.median(np.asarray(steps, np.float64)[-config.final_window :]))


def final_share_solved(solved: ArrayLike, config: MeasureConfig = DEFAULT_MEASURES) -> float:
    """Share solved of the last `final_window` test episodes, or of all if there are fewer.

    Parameters
    ----------
    solved : (n_tests,)
        Whether each test episode reached the goal.
    config
        Constants.

    Examples
    --------
    >>> final_share_solved([False, True, True, True])
    0.75
    """
    return float(np.mean(np.asarray(solved, np.float64)[-config.final_window :]))


def interquartile_mean(values: ArrayLike, axis: int = -1) -> FloatArray:
    """Mean of the middle half: floor(n / 4) values are dropped at each end.

    Source: Agarwal et al. 2021; equal to ``scipy.stats.trim_mean(values, 0.25)``.

    Parameters
    ----------
    values : (..., n)
        One value per trial.
    axis
        Axis of the trials.

    Examples
    --------
    >>> float(interquartile_mean([1, 2, 4, 1000]))
    3.0
    """
    ordered = np.sort(np.moveaxis(np.asarray(values, np.float64), axis, -1), axis=-1)
    n_values = ordered.shape[-1]
    n_cut = n_values // 4
    return np.asarray(ordered[..., n_cut : n_values - n_cut].mean(axis=-1))


def median(values: ArrayLike, axis: int = -1) -> FloatArray:
    """Median, the mean of the middle two for an even number of values.

    Parameters
    ----------
    values : (..., n)
        One value per trial; infinite values are allowed.
    axis
        Axis of the trials.
    """
    return np.asarray(np.median(np.asarray(values, np.float64), axis=axis))


_STATISTICS = {"median": median, "iqm": interquartile_mean}


def estimate(
    values: ArrayLike, statistic: str = "median", config: MeasureConfig = DEFAULT_MEASURES
) -> Estimate:
    """Return a statistic over trials with its percentile bootstrap interval.

    Trials are drawn with replacement `n_resamples` times by a generator of its own, seeded anew
    at each call, so the interval depends on the values and `config` alone. Its ends are values
    of the bootstrap distribution (never interpolated), so censored, infinite trials are allowed.

    Parameters
    ----------
    values : (n_trials,)
        One value per trial.
    statistic
        ``"median"`` or ``"iqm"``.
    config
        Constants.

    Raises
    ------
    ValueError
        If there are no values or the statistic is unknown.

    Examples
    --------
    >>> estimate([4.0, 4.0, 4.0])
    Estimate(value=4.0, lower=4.0, upper=4.0)
    """
    sample = np.asarray(values, np.float64)
    if sample.ndim != 1 or sample.size == 0:
        raise ValueError(f"values must be one per trial, got shape {sample.shape}")
    if statistic not in _STATISTICS:
        raise ValueError(f"statistic must be one of {list(_STATISTICS)}, got {statistic!r}")
    function = _STATISTICS[statistic]
    value = float(function(sample))
    if sample.size == 1:
        return Estimate(value, math.nan, math.nan)
    generator = np.random.default_rng(config.bootstrap_seed)
    chosen = generator.integers(sample.size, size=(config.n_resamples, sample.size))
    tail = (1 - config.confidence) / 2
    lower, upper = np.quantile(function(sample[chosen]), (tail, 1 - tail), method="inverted_cdf")
    return Estimate(value, float(lower), float(upper))
