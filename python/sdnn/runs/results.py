"""Measures of the trials of an agent in a case.

Measures give a number for each trial, from its test episodes alone. They were fixed before the data
of the noisy cases were seen. Their arrays hold one value per test episode, (n_tests,): ``episode``
the learning episodes done before it, ``steps`` its steps, ``solved`` whether it reached the goal,
``episode_return`` its sum of rewards.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal

import numpy as np
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import ArrayLike

from sdnn.reports.statistics import Estimate, FloatArray, estimate_median, json_number
from sdnn.runs.trial import Column, TrialRecord, TrialRows

MeasureName = Literal[
    "episodes_to_learn",
    "early_steps",
    "episode_of_collapse",
    "final_steps",
    "final_share_solved",
    "final_return",
    "mean_return",
]

SHARE_STABLE = 0.9  # share of test episodes that an agent must solve at the end to be called stable
GOOD_STEPS = 10.0  # most steps of a good test episode: the paper's "within 10 steps"
LEARNED_WINDOW, STABLE_WINDOW = 10, 50
"""Tests in a row whose median must be good for the task to count as learned, and as mastered."""
EARLY_EPISODES = 2_500  # a third of the way to the paper's 7,500
FINAL_WINDOW = 50  # tests at the end of a trial that are measured


def episodes_to_learn(episode: ArrayLike, steps: ArrayLike) -> float:
    """Return the learning episodes until the task is learned; infinite if it never is (censored).

    The task is learned at the first test episode that (1) takes at most `GOOD_STEPS` steps
    and (2) begins `LEARNED_WINDOW` consecutive test episodes whose median is at most
    `GOOD_STEPS`. The result is the number of learning episodes done before that test.

    (1) keeps failed tests just before the first good one from counting as learned already;
    (2) keeps a single lucky test from counting. A later relapse does not undo learning. A window
    that the trial's end cuts off does not count.

    >>> episode = 10 * np.arange(1, 13)
    >>> episodes_to_learn(episode, [50, 50] + 10 * [7])
    30.0
    >>> episodes_to_learn(episode, 12 * [50])
    inf
    """
    medians = _medians_of_windows(steps, LEARNED_WINDOW)
    first = np.asarray(steps, np.float64)[: medians.size]
    good = (medians <= GOOD_STEPS) & (first <= GOOD_STEPS)
    return float(np.asarray(episode)[int(np.argmax(good))]) if good.any() else math.inf


def episode_of_collapse(episode: ArrayLike, steps: ArrayLike, window: int = STABLE_WINDOW) -> float:
    """Return the number of learning episodes after which the task is no longer mastered.

    The task is mastered in every run of `window` consecutive test episodes whose median is
    at most `GOOD_STEPS`. The result is the number of learning episodes done before the last test of
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
    mastered = _medians_of_windows(steps, window) <= GOOD_STEPS
    if not mastered.any():
        return 0.0 if mastered.size else math.nan
    last = int(np.flatnonzero(mastered)[-1])
    if last == mastered.size - 1:
        return math.inf
    return float(np.asarray(episode)[last + window - 1])


def final_share_solved(solved: ArrayLike) -> float:
    """Return the share of solved tests among the last `FINAL_WINDOW`, or all if there are fewer.

    >>> final_share_solved([False, True, True, True])
    0.75
    """
    return float(np.mean(np.asarray(solved, np.float64)[-FINAL_WINDOW:]))


def _medians_of_windows(steps: ArrayLike, window: int) -> FloatArray:
    """Return the medians of all windows of consecutive tests, (n_tests - window + 1,), or (0,)."""
    numbers = np.asarray(steps, np.float64)
    if numbers.size < window:
        return np.empty(0)
    return np.asarray(np.median(sliding_window_view(numbers, window), axis=1))


_GOOD = f"{GOOD_STEPS:g}"

MEASURES: dict[MeasureName, tuple[str, Callable[[TrialRows], float]]] = {
    "episodes_to_learn": (
        f"learning episodes before the first test of at most {_GOOD} steps that begins"
        f" {LEARNED_WINDOW} tests in a row with a median of at most {_GOOD}",
        lambda rows: episodes_to_learn(rows.episode, rows.steps),
    ),
    "early_steps": (
        f"median steps of the tests in the first {EARLY_EPISODES:,} learning episodes",
        lambda rows: float(np.median(rows.steps[rows.episode <= EARLY_EPISODES])),
    ),
    "episode_of_collapse": (
        f"learning episodes before the end of the last {STABLE_WINDOW} tests in a row with"
        f" a median of at most {_GOOD} steps: until then the agent can do the task; censored (> the"
        " last episode) if it still can at the end",
        lambda rows: episode_of_collapse(rows.episode, rows.steps),
    ),
    "final_steps": (
        f"median steps of the last {FINAL_WINDOW} tests",
        lambda rows: float(np.median(rows.steps[-FINAL_WINDOW:])),
    ),
    "final_share_solved": (
        f"share of the last {FINAL_WINDOW} tests that reach the goal",
        lambda rows: final_share_solved(rows.solved),
    ),
    "final_return": (
        "mean return of the last tenth of the tests",
        lambda rows: float(np.mean(rows.episode_return[-max(1, rows.episode.size // 10) :])),
    ),
    "mean_return": (
        "mean return of all tests: the area under the learning curve",
        lambda rows: float(np.mean(rows.episode_return)),
    ),
}
"""Meaning of each measure, and the function that takes it from the rows of a trial."""

RETURN_MEASURES: tuple[MeasureName, ...] = ("final_return", "mean_return")  # measures of any task

STEP_MEASURES: tuple[MeasureName, ...] = tuple(n for n in MEASURES if n not in RETURN_MEASURES)
"""Measures of tasks to be solved in few steps, such as the acrobot's."""

CENSORED_MEASURES: tuple[MeasureName, ...] = ("episodes_to_learn", "episode_of_collapse")
"""Measures that are infinite if they lie beyond the last episode."""


@dataclass(frozen=True, kw_only=True)
class TrialMeasures:
    """Measures of the trials of an agent in a case, with or without their rows."""

    case_id: str
    agent: str
    last_episode: int  # learning episodes of a trial
    values: dict[MeasureName, FloatArray]  # arrays (n_trials,)

    @property
    def n_trials(self) -> int:
        """Number of trials."""
        return len(next(iter(self.values.values())))

    @cached_property
    def medians(self) -> dict[MeasureName, Estimate]:
        """Medians over trials, with intervals."""
        return {name: estimate_median(values) for name, values in self.values.items()}

    def uncensored(self, measure: MeasureName, last_episode: int | None = None) -> FloatArray:
        """Return a measure of each trial, (n_trials,); censored values become the last episode.

        With an earlier ``last_episode``, values are computed as if the trials had ended there.
        """
        values = self.values[measure]
        if measure not in CENSORED_MEASURES:
            return values
        return np.minimum(values, self.last_episode if last_episode is None else last_episode)


@dataclass(frozen=True, kw_only=True)
class CaseResult(TrialMeasures):
    """The trials of an agent in a case, all under the same settings, with their measures."""

    title: str
    records: tuple[TrialRecord, ...]

    @property
    def config_hash(self) -> str:
        """Hash of the settings."""
        return self.records[0].key.config_hash

    @property
    def episode(self) -> Column:
        """Learning episodes done before each test, (n_tests,)."""
        return self.records[0].rows.episode

    @cached_property
    def steps(self) -> Column:
        """Steps of the test episodes, (n_trials, n_tests)."""
        return np.stack([record.rows.steps for record in self.records])

    @cached_property
    def quartiles(self) -> FloatArray:
        """Lower quartile, median and upper quartile of the steps over trials, (3, n_tests)."""
        return np.percentile(self.steps.astype(np.float64), (25, 50, 75), axis=0)

    @property
    def n_decisions(self) -> int:
        """Decisions of all trials."""
        return sum(record.n_decisions for record in self.records)

    @property
    def microseconds_per_decision(self) -> float:
        """Processor time per decision: sensing, choosing, the environment's step, learning."""
        seconds = sum(record.seconds for record in self.records)
        return 1e6 * seconds / self.n_decisions if self.n_decisions else math.nan

    def to_json(self) -> dict[str, object]:
        """Return the result as values that JSON can hold; censored ones are ``">last_episode"``."""
        last = self.last_episode
        of_median = episodes_to_learn(self.episode, self.quartiles[1])
        return {
            "agent": self.agent,
            "config_hash": self.config_hash,
            "versions": sorted({record.version for record in self.records}),
            "seeds": [record.key.seed for record in self.records],
            "n_trials": self.n_trials,
            "last_episode": last,
            "measures": {
                name: {
                    "trials": [json_number(float(value), last) for value in values],
                    "median": self.medians[name].to_json(last),
                }
                for name, values in self.values.items()
            },
            "median_curve_episodes_to_learn": json_number(of_median, last),
            "n_decisions": self.n_decisions,
            "microseconds_per_decision": json_number(self.microseconds_per_decision, None),
        }


def measure(
    title: str, records: Sequence[TrialRecord], names: Iterable[MeasureName] = STEP_MEASURES
) -> CaseResult:
    """Measure the trials of an agent in a case with this title.

    Raises ValueError if there are no trials, or if their settings differ.
    """
    settings = {(r.key.case_id, r.key.agent, r.key.config_hash) for r in records}
    if len(settings) != 1:
        raise ValueError(f"trials of {title} must share one configuration, got {len(settings)}")
    ((case_id, agent, _),) = settings
    return CaseResult(
        case_id=case_id,
        agent=agent,
        last_episode=int(records[0].rows.episode[-1]),
        values={name: np.array([MEASURES[name][1](r.rows) for r in records])
                for name in names},
        title=title,
        records=tuple(records),
    )  # fmt: skip


def records_of(results: Iterable[CaseResult]) -> tuple[TrialRecord, ...]:
    """Return the trials of all results, sorted and without duplicates."""
    records = {record.key: record for result in results for record in result.records}
    return tuple(records[key] for key in sorted(records))


def on_equal_terms(name: MeasureName, *measured: TrialMeasures) -> tuple[FloatArray, ...]:
    """Return a measure of the trials of each group, as if all had ended with the shortest trial.

    Otherwise groups would seem to differ where those of one are only longer.
    """
    last_episode = min(result.last_episode for result in measured)
    return tuple(result.uncensored(name, last_episode) for result in measured)
