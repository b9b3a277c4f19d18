"""Measures of one trial: a number for each, from its test episodes alone.

Arrays hold one value per test episode, (n_tests,): ``episode`` the learning episodes done before
it, ``steps`` its steps, ``solved`` whether it reached the goal, ``episode_return`` its sum of
rewards. The measures were fixed before the data of the noisy cases were seen.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike, NDArray

from sdnn.arguments import real, whole
from sdnn.runs.records import TrialRows

MeasureName = Literal[
    "episodes_to_learn",
    "early_steps",
    "episode_of_collapse",
    "final_steps",
    "final_share_solved",
    "final_return",
    "mean_return",
]

SHARE_STABLE = 0.9
"""Share of test episodes that an agent must solve at the end to be called stable."""

FINAL_PART = 10
"""The last return is measured over one in so many of the tests, the last ones."""


@dataclass(frozen=True, kw_only=True)
class MeasureConfig:
    """Constants of the measures.

    A test episode of at most `good_steps` is good: the paper's "within 10 steps". The median of
    `learned_window` consecutive tests must be good for the task to count as learned, and of
    `stable_window` as mastered. `early_episodes` are a third of the way to the paper's 7,500.
    """

    good_steps: float = 10.0
    learned_window: int = 10
    early_episodes: int = 2_500
    stable_window: int = 50
    final_window: int = 50

    def __post_init__(self) -> None:
        if math.isnan(real("good_steps", self.good_steps)):
            raise ValueError(f"good_steps must be a number, got {self.good_steps!r}")
        whole("early_episodes", self.early_episodes, 0, 2**62)
        for name in ("learned_window", "stable_window", "final_window"):
            whole(name, getattr(self, name), 1, 2**62)


DEFAULT_MEASURES = MeasureConfig()


def episodes_to_learn(
    episode: ArrayLike, steps: ArrayLike, config: MeasureConfig = DEFAULT_MEASURES
) -> float:
    """Learning episodes until the task is learned; infinite if it never is (censored).

    The task is learned at the first test episode that (1) takes at most `good_steps` steps
    and (2) begins `learned_window` consecutive test episodes whose median is at most
    `good_steps`. The result is the number of learning episodes done before that test.

    (1) keeps failed tests just before the first good one from counting as learned already;
    (2) keeps a single lucky test from counting. A later relapse does not undo learning. A window
    that the trial's end cuts off does not count.

    >>> episode = 10 * np.arange(1, 13)
    >>> episodes_to_learn(episode, [50, 50] + 10 * [7])
    30.0
    >>> episodes_to_learn(episode, 12 * [50])
    inf
    """
    medians = _medians_of_windows(steps, config.learned_window)
    first = np.asarray(steps, np.float64)[: medians.size]
    good = (medians <= config.good_steps) & (first <= config.good_steps)
    return float(np.asarray(episode)[int(np.argmax(good))]) if good.any() else math.inf


def early_steps(
    episode: ArrayLike, steps: ArrayLike, config: MeasureConfig = DEFAULT_MEASURES
) -> float:
    """Median steps over the test episodes after at most `early_episodes` learning episodes.

    >>> early_steps([1000, 2000, 3000], [4, 6, 50])
    5.0
    """
    early = np.asarray(episode) <= config.early_episodes
    return float(np.median(np.asarray(steps, np.float64)[early]))


def episode_of_collapse(
    episode: ArrayLike, steps: ArrayLike, config: MeasureConfig = DEFAULT_MEASURES
) -> float:
    """Learning episodes after which the task is not mastered any more; infinite if it still is.

    The task is mastered in every run of `stable_window` consecutive test episodes whose median is
    at most `good_steps`. The result is the number of learning episodes done before the last test of
    the last such run. It is infinite (censored) if that is the trial's last test: the trial ended
    before a collapse. It is 0 if there is no such run: there was nothing to collapse; NaN if there
    are fewer tests than in a run. Relapses from which the agent recovers do not count.

    >>> episode = 10 * np.arange(1, 201)
    >>> episode_of_collapse(episode, 100 * [4] + 100 * [50])
    1240.0
    >>> episode_of_collapse(episode, 100 * [50] + 100 * [4])
    inf
    >>> episode_of_collapse(episode, 200 * [50])
    0.0
    """
    mastered = _medians_of_windows(steps, config.stable_window) <= config.good_steps
    if mastered.size == 0:
        return math.nan
    if not mastered.any():
        return 0.0
    last = int(np.flatnonzero(mastered)[-1])
    if last == mastered.size - 1:
        return math.inf
    return float(np.asarray(episode)[last + config.stable_window - 1])


def final_steps(steps: ArrayLike, config: MeasureConfig = DEFAULT_MEASURES) -> float:
    """Median steps over the last `final_window` test episodes, or over all if there are fewer.

    >>> final_steps(100 * [50] + 50 * [4])
    4.0
    """
    return float(np.median(np.asarray(steps, np.float64)[-config.final_window :]))


def final_share_solved(solved: ArrayLike, config: MeasureConfig = DEFAULT_MEASURES) -> float:
    """Share solved of the last `final_window` test episodes, or of all if there are fewer.

    >>> final_share_solved([False, True, True, True])
    0.75
    """
    return float(np.mean(np.asarray(solved, np.float64)[-config.final_window :]))


def final_return(episode_return: ArrayLike) -> float:
    """Mean return of the last tenth of the test episodes, at least of one.

    >>> final_return(18 * [-20.0] + [8.0, 9.0])
    8.5
    """
    returns = np.asarray(episode_return, np.float64)
    return float(np.mean(returns[-max(1, returns.size // FINAL_PART) :]))


def mean_return(episode_return: ArrayLike) -> float:
    """Mean return of all test episodes: the area under the learning curve, per episode.

    >>> mean_return([-20.0, 8.0])
    -6.0
    """
    return float(np.mean(np.asarray(episode_return, np.float64)))


def _medians_of_windows(steps: ArrayLike, window: int) -> NDArray[np.float64]:
    """Medians of all runs of `window` tests, (n_tests - window + 1,), or (0,) if there are none."""
    taken = np.asarray(steps, np.float64)
    if taken.size < window:
        return np.empty(0)
    return np.asarray(np.median(sliding_window_view(taken, window), axis=1))


_GOOD = f"{DEFAULT_MEASURES.good_steps:g}"

MEASURES: dict[MeasureName, tuple[str, Callable[[TrialRows, MeasureConfig], float]]] = {
    "episodes_to_learn": (
        f"learning episodes before the first test of at most {_GOOD} steps that begins"
        f" {DEFAULT_MEASURES.learned_window} tests in a row with a median of at most {_GOOD}",
        lambda rows, config: episodes_to_learn(rows.episode, rows.steps, config),
    ),
    "early_steps": (
        "median steps of the tests in the first"
        f" {DEFAULT_MEASURES.early_episodes:,} learning episodes",
        lambda rows, config: early_steps(rows.episode, rows.steps, config),
    ),
    "episode_of_collapse": (
        f"learning episodes before the end of the last {DEFAULT_MEASURES.stable_window} tests in a"
        f" row with a median of at most {_GOOD} steps: until then the agent can do the task;"
        " censored (> the last episode) if it still can at the end",
        lambda rows, config: episode_of_collapse(rows.episode, rows.steps, config),
    ),
    "final_steps": (
        f"median steps of the last {DEFAULT_MEASURES.final_window} tests",
        lambda rows, config: final_steps(rows.steps, config),
    ),
    "final_share_solved": (
        f"share of the last {DEFAULT_MEASURES.final_window} tests that reach the goal",
        lambda rows, config: final_share_solved(rows.solved, config),
    ),
    "final_return": (
        "mean return of the last tenth of the tests",
        lambda rows, _: final_return(rows.episode_return),
    ),
    "mean_return": (
        "mean return of all tests: the area under the learning curve",
        lambda rows, _: mean_return(rows.episode_return),
    ),
}
"""What each measure means, for a reader, and how it is taken from the rows of a trial."""

RETURN_MEASURES: tuple[MeasureName, ...] = ("final_return", "mean_return")
"""Of any task."""

STEP_MEASURES: tuple[MeasureName, ...] = tuple(n for n in MEASURES if n not in RETURN_MEASURES)
"""Of tasks that are to be solved in few steps, as the acrobot's."""

CENSORED_MEASURES: tuple[MeasureName, ...] = ("episodes_to_learn", "episode_of_collapse")
"""Of which it may only be known that they are beyond the last episode: then they are infinite."""
