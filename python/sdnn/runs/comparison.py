"""What the trials of a study say: measures of each variant, and differences from the reference."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdnn.runs.measures import RETURN_MEASURES, SHARE_STABLE, STEP_MEASURES, MeasureName
from sdnn.runs.records import TrialRecord
from sdnn.runs.results import CaseResult, measure, on_equal_terms
from sdnn.runs.statistics import Estimate, estimate_mean
from sdnn.runs.study import Combination, Study
from sdnn.runs.study_file import StudyCase, StudyVariant

MIN_TRIALS_TO_DIFFER = 6
"""Fewer paired trials are all on one side by chance more often than once in twenty times."""


@dataclass(frozen=True)
class Measured:
    """A variant in a case, measured.

    `differences` are means over trials of a measure minus that of the reference's trial of the same
    number, with censored values as the last episode of the shorter one; there are none for the
    reference itself and without it.
    """

    combination: Combination
    result: CaseResult
    differences: Mapping[MeasureName, Estimate]

    @property
    def variant(self) -> StudyVariant:
        """The variant."""
        return self.combination.variant

    def differs(self, name: MeasureName) -> bool:
        """Whether a measure differs from the reference's by more than chance.

        That is where the interval of the difference leaves 0 out, over at least
        `MIN_TRIALS_TO_DIFFER` trials.
        """
        difference = self.differences.get(name)
        if difference is None or self.result.n_trials < MIN_TRIALS_TO_DIFFER:
            return False
        return difference.lower > 0 or difference.upper < 0

    @property
    def solved_at_end(self) -> NDArray[np.bool_] | None:
        """Which trials end solved, (n_trials,); None where tasks are judged by their return."""
        shares = self.result.values.get("final_share_solved")
        return None if shares is None else shares >= SHARE_STABLE

    @property
    def end_solved(self) -> str:
        """How many trials end solved, such as ``"18 of 20"``; ``"-"`` if that is not measured."""
        solved = self.solved_at_end
        return "-" if solved is None else f"{int(solved.sum())} of {solved.size}"


@dataclass(frozen=True)
class Comparison:
    """What is complete of a study: by ids of case and variant, those that have every trial."""

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
        pairs = ((case_id, variant.id) for variant in self.study.variants)
        return tuple(self.measured[pair] for pair in pairs if pair in self.measured)


def compare(study: Study, records: Iterable[TrialRecord]) -> Comparison:
    """Measure every variant of a study in every case of which all trials are among the records."""
    by_key = {record.key: record for record in records}
    results = {}
    for pair, combination in study.combinations.items():
        keys = study.keys(*pair)
        if by_key.keys() >= set(keys):
            has_returns = combination.spec.environment is not None
            names = RETURN_MEASURES if has_returns else STEP_MEASURES
            results[pair] = measure(combination.case.title, [by_key[key] for key in keys], names)
    return Comparison(
        study,
        {
            (case, variant): Measured(
                study.combinations[case, variant],
                result,
                {}
                if variant == study.reference
                else _differences(result, results.get((case, study.reference))),
            )
            for (case, variant), result in results.items()
        },
    )


def _differences(result: CaseResult, reference: CaseResult | None) -> dict[MeasureName, Estimate]:
    """Compare trial by trial: those of one number have the same seed."""
    if reference is None:
        return {}
    return {
        name: estimate_mean(np.subtract(*on_equal_terms(name, result, reference)))
        for name in result.values
        if name in reference.values
    }
