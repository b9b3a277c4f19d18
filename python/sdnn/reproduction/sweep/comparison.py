"""What the trials of a study say: measures of each variant, differences, verdicts about claims."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sdnn.reproduction.cases import PAPER_TRIALS, Case
from sdnn.reproduction.chances import TenTrials
from sdnn.reproduction.claims import SHARE_STABLE, Claim
from sdnn.reproduction.results import CaseResult, CaseSummary, on_equal_terms, summarize
from sdnn.reproduction.sweep.study import PAPER_CASES, Combination, Study, StudyCase, StudyVariant
from sdnn.reproduction.verdicts import ClaimOutcome, Verdict, judge_claims
from sdnn.runs.environment_trial import EnvironmentTrialConfig
from sdnn.runs.measures import RETURN_MEASURES, STEP_MEASURES, MeasureName
from sdnn.runs.records import TrialKey, TrialRecord
from sdnn.runs.statistics import Estimate, estimate_mean
from sdnn.runs.trial_config import TrialConfig

MIN_TRIALS_TO_DIFFER = 6
"""Fewer paired trials are all on one side by chance more often than once in twenty times."""

MIN_TRIALS_TO_DRAW = 2 * PAPER_TRIALS
"""Fewer trials are too few to draw ten from."""


@dataclass(frozen=True)
class Measured:
    """A variant in a case, measured.

    Parameters
    ----------
    combination
        Which.
    summary
        Its measures over trials.
    differences
        Mean over trials of what a measure is more than in the reference's trial of the same number,
        censored values as the last episode of the shorter one; empty for the reference itself and
        without it.
    """

    combination: Combination
    summary: CaseSummary
    differences: Mapping[MeasureName, Estimate]

    @property
    def measures(self) -> tuple[MeasureName, ...]:
        """What is measured in a task of this kind."""
        return tuple(self.summary.values)

    def differs(self, measure: MeasureName) -> bool:
        """Whether a measure differs from the reference's by more than chance.

        That is where the interval of the difference leaves 0 out, over at least
        `MIN_TRIALS_TO_DIFFER` trials.
        """
        difference = self.differences.get(measure)
        if difference is None or self.summary.result.n_trials < MIN_TRIALS_TO_DIFFER:
            return False
        return difference.lower > 0 or difference.upper < 0

    @property
    def solved_at_end(self) -> NDArray[np.bool_] | None:
        """Which trials end solved, (n_trials,); None where tasks are judged by their return."""
        shares = self.summary.values.get("final_share_solved")
        return None if shares is None else shares >= SHARE_STABLE


@dataclass(frozen=True)
class VariantClaim:
    """A claim of the paper about a variant.

    Parameters
    ----------
    outcome
        The verdict and the quantities behind it.
    moved
        Whether the verdict about the reference is another one; None where there is none.
    chance
        In which share of draws of ten of its trials the claim is shown; None where there are fewer
        than `MIN_TRIALS_TO_DRAW`.
    """

    outcome: ClaimOutcome
    moved: bool | None
    chance: Estimate | None = None


@dataclass(frozen=True)
class Comparison:
    """Everything that is complete of a study.

    Parameters
    ----------
    study
        The study.
    measured
        By ids of case and variant, those of which every trial is there.
    """

    study: Study
    measured: Mapping[tuple[str, str], Measured]

    @property
    def cases(self) -> tuple[StudyCase, ...]:
        """Cases of which something is there."""
        shown = {case for case, _ in self.measured}
        return tuple(case for case in self.study.cases if case.id in shown)

    @property
    def variants(self) -> tuple[StudyVariant, ...]:
        """Variants of which something is there."""
        shown = {variant for _, variant in self.measured}
        return tuple(variant for variant in self.study.variants if variant.id in shown)

    def of_case(self, case_id: str) -> tuple[Measured, ...]:
        """List what is measured in a case, in the order of the variants."""
        return tuple(
            self.measured[case_id, variant.id]
            for variant in self.study.variants
            if (case_id, variant.id) in self.measured
        )

    @cached_property
    def claims(self) -> Mapping[str, Mapping[int, VariantClaim]]:
        """Claims of which every quantity is measured, by variant and number of the claim.

        A case counts as the paper's by its id, an agent by its own: what a variant has changed is
        what is judged.
        """
        outcomes = {v.id: self._outcomes(v.id) for v in self.variants}
        reference = outcomes.get(self.study.reference, {})
        return {
            variant: {
                number: VariantClaim(
                    outcome,
                    _moved(outcome, reference.get(number))
                    if variant != self.study.reference
                    else None,
                    self._chance(variant, outcome.claim),
                )
                for number, outcome in of_variant.items()
            }
            for variant, of_variant in outcomes.items()
        }

    @property
    def claims_shown(self) -> tuple[Claim, ...]:
        """The claims about any variant."""
        found = {n: c.outcome.claim for of in self.claims.values() for n, c in of.items()}
        return tuple(found[number] for number in sorted(found))

    def chance_of_all(self, variant_id: str) -> Estimate | None:
        """In which share of draws of ten trials a variant shows all claims about it together.

        None where there are none, or fewer than `MIN_TRIALS_TO_DRAW` trials.
        """
        claims = [one.outcome.claim for one in self.claims[variant_id].values()]
        return self._chance(variant_id, *claims) if claims else None

    def _chance(self, variant_id: str, *claims: Claim) -> Estimate | None:
        if self.study.n_trials < MIN_TRIALS_TO_DRAW:
            return None
        return self._ten_trials[variant_id].chance(*claims)

    @cached_property
    def _ten_trials(self) -> dict[str, TenTrials]:
        return {variant.id: TenTrials(self._papers(variant.id)) for variant in self.variants}

    def _papers(self, variant_id: str) -> list[CaseSummary]:
        """Give what is measured of a variant in the paper's cases."""
        return [
            measured.summary
            for (_, variant), measured in self.measured.items()
            if variant == variant_id
            and measured.combination.case.id in PAPER_CASES
            and isinstance(measured.combination.config, TrialConfig)
        ]

    def _outcomes(self, variant_id: str) -> dict[int, ClaimOutcome]:
        return {
            outcome.claim.number: outcome
            for outcome in judge_claims(self._papers(variant_id), ())
            if outcome.verdict is not Verdict.NOT_RUN
            and all(checked.estimate is not None for checked in outcome.checks)
        }


def _moved(outcome: ClaimOutcome, reference: ClaimOutcome | None) -> bool | None:
    if reference is None or Verdict.NOT_JUDGED in (outcome.verdict, reference.verdict):
        return None
    return outcome.verdict is not reference.verdict


def compare(study: Study, records: Iterable[TrialRecord]) -> Comparison:
    """Measure every variant in every case of which all trials are there.

    Parameters
    ----------
    study
        What was to be run.
    records
        Its trials.
    """
    by_key = {record.key: record for record in records}
    summaries = {
        pair: _summary(combination, study.keys(*pair), by_key)
        for pair, combination in study.combinations.items()
        if by_key.keys() >= set(study.keys(*pair))
    }
    return Comparison(
        study,
        {
            (case, variant): Measured(
                study.combinations[case, variant],
                summary,
                {}
                if variant == study.reference
                else _differences(summary, summaries.get((case, study.reference))),
            )
            for (case, variant), summary in summaries.items()
        },
    )


def _summary(
    combination: Combination,
    keys: Iterable[TrialKey],
    records: Mapping[TrialKey, TrialRecord],
) -> CaseSummary:
    config = combination.config
    if isinstance(config, EnvironmentTrialConfig):
        n_sensors, noise = config.approximator.n_inputs, config.environment.noise
        names = RETURN_MEASURES
    else:
        assert isinstance(config, TrialConfig)
        n_sensors, noise, names = config.sensors.n_sensors, config.sensors.noise, STEP_MEASURES
    case = Case(combination.case.id, combination.case.title, n_sensors, noise, (config.agent,), "")
    result = CaseResult(case, config.agent, tuple(records[key] for key in keys))
    return summarize(result, names=names)


def _differences(
    summary: CaseSummary, reference: CaseSummary | None
) -> dict[MeasureName, Estimate]:
    """Compare trial by trial: those of one number have the same seed."""
    if reference is None:
        return {}
    return {
        name: estimate_mean(np.subtract(*on_equal_terms(name, summary, reference)))
        for name in summary.values
        if name in reference.values
    }
