"""Trials of an agent in a case, and what is measured on them."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdnn.runs.measures import (
    CENSORED_MEASURES,
    DEFAULT_MEASURES,
    MEASURES,
    STEP_MEASURES,
    MeasureConfig,
    MeasureName,
    episodes_to_learn,
)
from sdnn.runs.records import TrialRecord
from sdnn.runs.statistics import Estimate, FloatArray, estimate_median, json_number


@dataclass(frozen=True, kw_only=True)
class TrialMeasures:
    """Measures of the trials of an agent in a case, whether or not their rows are at hand.

    `last_episode` are the learning episodes of a trial; `values` are arrays (n_trials,).
    """

    case_id: str
    agent: str
    last_episode: int
    values: dict[MeasureName, FloatArray]

    @property
    def n_trials(self) -> int:
        """Number of trials."""
        return len(next(iter(self.values.values())))

    @cached_property
    def medians(self) -> dict[MeasureName, Estimate]:
        """Medians over trials, with intervals."""
        return {name: estimate_median(values) for name, values in self.values.items()}

    def uncensored(self, measure: MeasureName, last_episode: int | None = None) -> FloatArray:
        """Return a measure of each trial, (n_trials,), censored ones as the last episode.

        With another last episode it is as if the trials had ended there.
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
    def episode(self) -> NDArray[np.int32]:
        """Learning episodes done before each test, (n_tests,)."""
        return self.records[0].rows.episode

    @cached_property
    def steps(self) -> NDArray[np.int32]:
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

    def to_json(self) -> dict[str, Any]:
        """Return it as values that JSON can hold; censored ones are ``">last_episode"``."""
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
    title: str,
    records: Sequence[TrialRecord],
    names: Iterable[MeasureName] = STEP_MEASURES,
    config: MeasureConfig = DEFAULT_MEASURES,
) -> CaseResult:
    """Measure the trials of an agent in a case of some title.

    Raises
    ------
    ValueError
        If there are no trials, or they were run under different settings.
    """
    settings = {(r.key.case_id, r.key.agent, r.key.config_hash) for r in records}
    if len(settings) != 1:
        raise ValueError(f"trials of {title} must share one configuration, got {len(settings)}")
    ((case_id, agent, _),) = settings
    return CaseResult(
        case_id=case_id,
        agent=agent,
        last_episode=int(records[0].rows.episode[-1]),
        values={name: np.array([MEASURES[name][1](r.rows, config) for r in records])
                for name in names},
        title=title,
        records=tuple(records),
    )  # fmt: skip


def on_equal_terms(name: MeasureName, *measured: TrialMeasures) -> tuple[FloatArray, ...]:
    """Return a measure of each trial of several, censored where the shortest trials end.

    Otherwise what only lasts longer would seem to differ.
    """
    last_episode = min(one.last_episode for one in measured)
    return tuple(one.uncensored(name, last_episode) for one in measured)
