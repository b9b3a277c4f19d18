"""Compare the variants of a study: measures, and differences trial by trial."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdnn.reports.statistics import Estimate, estimate_mean
from sdnn.runs.results import (
    RETURN_MEASURES,
    SHARE_STABLE,
    STEP_MEASURES,
    CaseResult,
    MeasureName,
    measure,
    on_equal_terms,
    records_of,
)
from sdnn.runs.study import Combination, Pair, Study, StudyCase, StudyVariant
from sdnn.runs.trial import TrialRecord

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
        """Return whether the interval excludes 0, over at least `MIN_TRIALS_TO_DIFFER` trials."""
        difference = self.differences.get(name)
        if difference is None or self.result.n_trials < MIN_TRIALS_TO_DIFFER:
            return False
        return difference.lower > 0 or difference.upper < 0

    @property
    def solved_at_end(self) -> NDArray[np.bool_] | None:
        """Whether each trial ends solved, (n_trials,); None where tasks are judged by return."""
        shares = self.result.values.get("final_share_solved")
        return None if shares is None else shares >= SHARE_STABLE

    @property
    def end_solved(self) -> str:
        """Number of trials that end solved: ``"18 of 20"``, or ``"-"`` if not measured."""
        solved = self.solved_at_end
        return "-" if solved is None else f"{int(solved.sum())} of {solved.size}"


@dataclass(frozen=True)
class Comparison:
    """Complete parts of a study, by ids of case and variant: those that have every trial."""

    study: Study
    measured: Mapping[Pair, Measured]

    @property
    def records(self) -> tuple[TrialRecord, ...]:
        """All trials; see `records_of`."""
        return records_of(m.result for m in self.measured.values())

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
        return tuple(m for (case, _), m in self.measured.items() if case == case_id)


def compare(study: Study, records: Iterable[TrialRecord]) -> Comparison:
    """Measure every variant of a study in every case of which all trials are among the records."""
    by_key = {record.key: record for record in records}
    results = {}
    for pair, combination in study.combinations.items():
        keys = study.keys(*pair)
        if by_key.keys() >= set(keys):
            records_of_pair = [by_key[key] for key in keys]
            is_paper_acrobot = combination.spec.environment.is_paper_acrobot
            names = STEP_MEASURES if is_paper_acrobot else RETURN_MEASURES
            results[pair] = measure(combination.case.title, records_of_pair, names)
    measured = {}
    for (case, variant), result in results.items():
        reference = None if variant == study.reference else results.get((case, study.reference))
        # Trials of one number have the same seed.
        differences = {
            name: estimate_mean(np.subtract(*on_equal_terms(name, result, reference)))
            for name in result.values
            if reference is not None and name in reference.values
        }
        combination = study.combinations[case, variant]
        measured[case, variant] = Measured(combination, result, differences)
    return Comparison(study, measured)
