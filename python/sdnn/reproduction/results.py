"""Stored trials of one case and agent, and what is measured on them."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdnn.reproduction.cases import PAPER_EPISODES, PAPER_TRIALS, Case, Experiment
from sdnn.runs import measures, statistics
from sdnn.runs.measures import (
    CENSORED_MEASURES,
    DEFAULT_MEASURES,
    STEP_MEASURES,
    MeasureConfig,
    MeasureName,
)
from sdnn.runs.records import TrialRecord, TrialRows
from sdnn.runs.statistics import Curve, Estimate, json_number


@dataclass(frozen=True)
class CaseResult:
    """The trials of an agent in a case, all under the same settings.

    Parameters
    ----------
    case
        What was observed.
    agent
        Id of the agent.
    records
        Its trials, at least one.

    Raises
    ------
    ValueError
        If there are no trials, or they were run under different settings.
    """

    case: Case
    agent: str
    records: tuple[TrialRecord, ...]

    def __post_init__(self) -> None:
        hashes = {record.key.config_hash for record in self.records}
        if len(hashes) != 1:
            raise ValueError(
                f"trials of {self.agent} in {self.case.id} must share one configuration,"
                f" got {len(hashes)}"
            )

    @property
    def n_trials(self) -> int:
        """Number of trials."""
        return len(self.records)

    @property
    def config_hash(self) -> str:
        """Hash of the settings."""
        return self.records[0].key.config_hash

    @property
    def episode(self) -> NDArray[np.int32]:
        """Learning episodes done before each test, (n_tests,)."""
        return self.records[0].rows.episode

    @property
    def last_episode(self) -> int:
        """Learning episodes of a trial."""
        return int(self.episode[-1])

    @cached_property
    def steps(self) -> NDArray[np.int32]:
        """Steps of the test episodes, (n_trials, n_tests)."""
        return np.stack([record.rows.steps for record in self.records])

    @property
    def n_decisions(self) -> int:
        """Decisions of all trials."""
        return sum(record.n_decisions for record in self.records)

    @property
    def microseconds_per_decision(self) -> float:
        """Processor time per decision with everything it needs, in microseconds.

        That is sensing, choosing, the second of physics that follows, and learning.
        """
        seconds = sum(record.seconds for record in self.records)
        return 1e6 * seconds / self.n_decisions if self.n_decisions else math.nan

    @cached_property
    def curve(self) -> Curve:
        """Median and quartiles of the steps over trials."""
        return statistics.learning_curve(self.episode, self.steps)


@dataclass(frozen=True)
class TrialMeasures:
    """What was measured on the trials of an agent in a case, however they are kept.

    Parameters
    ----------
    case_id, agent
        Ids of both.
    last_episode
        Learning episodes of a trial.
    values
        Measures of each trial, arrays (n_trials,).
    """

    case_id: str
    agent: str
    last_episode: int
    values: dict[MeasureName, NDArray[np.float64]]

    @property
    def n_trials(self) -> int:
        """Number of trials."""
        return len(next(iter(self.values.values())))

    @property
    def is_paper_scale(self) -> bool:
        """Whether there are as many trials and episodes as in the paper: else nothing is judged."""
        return self.n_trials >= PAPER_TRIALS and self.last_episode >= PAPER_EPISODES

    @cached_property
    def medians(self) -> dict[MeasureName, Estimate]:
        """Medians over trials, with intervals."""
        return {name: statistics.estimate_median(values) for name, values in self.values.items()}

    def uncensored(
        self, measure: MeasureName, last_episode: int | None = None
    ) -> NDArray[np.float64]:
        """Return a measure of each trial, (n_trials,), censored ones as the last episode.

        With another last episode it is as if the trials had ended there.
        """
        values = self.values[measure]
        if measure not in CENSORED_MEASURES:
            return values
        return np.minimum(values, self.last_episode if last_episode is None else last_episode)


@dataclass(frozen=True)
class CaseSummary(TrialMeasures):
    """The measures of a case and agent, with the trials that were measured.

    Parameters
    ----------
    result
        The trials.
    median_curve_episodes_to_learn
        `episodes_to_learn` of the median curve: what a reader sees in the paper's figure.
    """

    result: CaseResult
    median_curve_episodes_to_learn: float

    def to_json(self) -> dict[str, Any]:
        """Return it as values that JSON can hold."""
        result = self.result
        last = result.last_episode
        return {
            "case": result.case.id,
            "title": result.case.title,
            "paper_figure": result.case.paper_figure,
            "agent": result.agent,
            "config_hash": result.config_hash,
            "versions": sorted({record.version for record in result.records}),
            "seeds": [record.key.seed for record in result.records],
            "n_trials": result.n_trials,
            "last_episode": last,
            "measures": {
                name: {
                    "trials": [json_number(float(value), last) for value in self.values[name]],
                    "median": self.medians[name].to_json(last),
                }
                for name in self.values
            },
            "median_curve_episodes_to_learn": json_number(
                self.median_curve_episodes_to_learn, last
            ),
            "n_decisions": result.n_decisions,
            "microseconds_per_decision": json_number(result.microseconds_per_decision, None),
        }


def on_equal_terms(
    measure: MeasureName, *measured: TrialMeasures
) -> tuple[NDArray[np.float64], ...]:
    """Return a measure of each trial of several, censored where the shortest trials end.

    Else what only lasts longer would seem to differ.
    """
    last_episode = min(one.last_episode for one in measured)
    return tuple(one.uncensored(measure, last_episode) for one in measured)


def collect(experiment: Experiment, records: Iterable[TrialRecord]) -> tuple[CaseResult, ...]:
    """Sort trials into one result for each case and agent of an experiment.

    Parameters
    ----------
    experiment
        Its cases and agents.
    records
        Trials of the plan, in the order in which they are to be shown; those of other experiments
        are passed over.
    """
    by_pair: dict[tuple[str, str], list[TrialRecord]] = {}
    for record in records:
        by_pair.setdefault((record.key.case_id, record.key.agent), []).append(record)
    return tuple(
        CaseResult(case, agent, tuple(by_pair.get((case.id, agent), ())))
        for case in experiment.cases
        for agent in case.agents
    )


def summarize(
    result: CaseResult,
    config: MeasureConfig = DEFAULT_MEASURES,
    names: Iterable[MeasureName] = STEP_MEASURES,
) -> CaseSummary:
    """Measure every trial of a result, then take medians over trials.

    Parameters
    ----------
    result
        The trials.
    config
        Constants of the measures.
    names
        Which measures.
    """
    return CaseSummary(
        case_id=result.case.id,
        agent=result.agent,
        last_episode=result.last_episode,
        values={
            name: np.array([_MEASURE[name](record.rows, config) for record in result.records])
            for name in names
        },
        result=result,
        median_curve_episodes_to_learn=measures.episodes_to_learn(
            result.episode, result.curve.median, config
        ),
    )


_MEASURE: dict[MeasureName, Callable[[TrialRows, MeasureConfig], float]] = {
    "episodes_to_learn": lambda rows, config: measures.episodes_to_learn(
        rows.episode, rows.steps, config
    ),
    "early_steps": lambda rows, config: measures.early_steps(rows.episode, rows.steps, config),
    "episode_of_collapse": lambda rows, config: measures.episode_of_collapse(
        rows.episode, rows.steps, config
    ),
    "final_steps": lambda rows, config: measures.final_steps(rows.steps, config),
    "final_share_solved": lambda rows, config: measures.final_share_solved(rows.solved, config),
    "final_return": lambda rows, _config: measures.final_return(rows.episode_return),
    "mean_return": lambda rows, _config: measures.mean_return(rows.episode_return),
}
