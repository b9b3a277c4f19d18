"""A study: the specification of each variant in each case, and their results side by side."""

from __future__ import annotations

from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import NamedTuple, TypeAlias

import numpy as np
from numpy.typing import NDArray

from sdnn.reports.statistics import Estimate, estimate_mean
from sdnn.runs.engine import Observer, PlannedTrial
from sdnn.runs.errors import ConfigError
from sdnn.runs.report import Content
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
from sdnn.runs.spec import RunSpec
from sdnn.runs.store import ResultStore
from sdnn.runs.trial import TrialKey, TrialRecord, opened, trial_seed
from sdnn.support.arguments import whole
from sdnn.support.toml import KeyPath

MIN_TRIALS_TO_DIFFER = 6
"""Pairs of trials without which no difference is claimed.

If variants are equal, all of n differences have the same sign with probability 2 * 0.5**n: 6 % of 5
pairs, 3 % of 6.
"""


class Setting(NamedTuple):
    """A value of a study file, and its place in the file."""

    value: object
    where: KeyPath


Layer: TypeAlias = dict[tuple[str, ...], Setting]
"""Settings by the parts of their keys, such as ``("learning", "discount")``."""

Pair: TypeAlias = tuple[str, str]
"""Ids of a case and of a variant."""


@dataclass(frozen=True)
class StudyCase:
    """A task, with settings that override those of the base and of the agent."""

    id: str  # name in the result file; seeds are derived from it
    title: str
    settings: Layer = field(default_factory=dict)
    where: KeyPath = ()


@dataclass(frozen=True)
class StudyVariant:
    """A named set of settings that override all others."""

    id: str
    title: str
    settings: Layer = field(default_factory=dict)
    where: KeyPath = ()
    case_settings: Mapping[str, Layer] = field(default_factory=dict)  # overrides by case id
    only: tuple[str, ...] = ()  # ids of the cases in which it runs; empty: all


class Combination(NamedTuple):
    """A variant in a case: the specification that is run, and the settings that made it."""

    case: StudyCase
    variant: StudyVariant
    spec: RunSpec
    settings: Layer
    trials: tuple[PlannedTrial, ...]


class Study:
    """Variants in cases; `sdnn.runs.study_file.StudyFile` reads one from its file.

    ``specs`` lists each variant in each case in which it runs, with the specification that is run
    and the settings of a file that made it. The seed of a trial depends on the root ``seed``, its
    case and its number only, so that variants can be compared trial by trial, with the variant
    whose id is ``reference``.

    ``combinations`` holds them by their ids (case, variant). ``pairs`` are the ids of those that
    are to be run, by default all; the report shows stored trials of others, too. ``cases`` and
    ``variants`` are in the order in which they are first named.
    """

    source, text = "", ""  # name and content of the study's file

    def __init__(
        self,
        title: str,
        specs: Iterable[tuple[StudyCase, StudyVariant, RunSpec, Layer]],
        *,
        n_trials: int,
        seed: int,
        reference: str = "",
    ) -> None:
        self.title, self.n_trials, self.seed = title, n_trials, seed
        self.reference = reference
        self.combinations: dict[Pair, Combination] = {}
        whole("n_trials", n_trials, 0, 10**6)
        for case, variant, spec, settings in specs:
            label, config_hash = spec.label, spec.config_hash
            trials = []
            for number in range(n_trials):
                seed_of_trial = trial_seed(seed, case.id, number)
                key = TrialKey(case.id, label, number, seed_of_trial, config_hash)
                trials.append(PlannedTrial(key, spec))
            combination = Combination(case, variant, spec, settings, tuple(trials))
            self.combinations.setdefault((case.id, variant.id), combination)
        self.pairs = tuple(self.combinations)
        combinations = self.combinations.values()
        self.cases = tuple({c.case.id: c.case for c in combinations}.values())
        self.variants = tuple({c.variant.id: c.variant for c in combinations}.values())

    def keys(self, case_id: str, variant_id: str) -> tuple[TrialKey, ...]:
        """Return the keys of the trials of a variant in a case in the store."""
        return tuple(planned.key for planned in self.combinations[case_id, variant_id].trials)

    def variants_of(self, key: TrialKey) -> tuple[str, ...]:
        """Return the ids of the variants that a trial belongs to: equal variants share trials."""
        return tuple(variant for case, variant in self.pairs if key in self.keys(case, variant))

    def plan(self) -> tuple[PlannedTrial, ...]:
        """Return the trials of `pairs`, without duplicates.

        The first trials of all variants come first, so an interrupted run covers all evenly.
        """
        rounds = zip(*(self.combinations[pair].trials for pair in self.pairs), strict=True)
        return tuple({trial.key: trial for trials in rounds for trial in trials}.values())

    def other_work(self, out: Path) -> dict[str, object]:
        """Return counts of work other than trials, such as measurements, as values for JSON."""
        return {}

    def measure(self, store: ResultStore, observe: Observer) -> None:
        """Do and store the work other than trials, such as measurements."""

    def report(self, comparison: Comparison, store: ResultStore) -> Content | None:
        """Make the report of the complete parts; None if nothing is complete."""
        return None

    def file_name(self, name: str) -> str:
        """Return the name of a file of the report, unique in a folder shared by studies."""
        return name

    def copies(self) -> dict[str, str]:
        """Map each variant that equals an earlier one in every case to the first equal one."""
        # Variants are equal whose first trials have equal keys in every case.
        keys_of: dict[str, list[TrialKey]] = {variant.id: [] for variant in self.variants}
        for case, variant in self.combinations:
            keys_of[variant].append(self.keys(case, variant)[0])
        copies: dict[str, str] = {}
        first_by_keys: dict[tuple[TrialKey, ...], str] = {}
        for variant, keys in keys_of.items():
            first = first_by_keys.setdefault(tuple(keys), variant)
            if first != variant:
                copies[variant] = first
        return copies

    def check(self, stored: Collection[TrialKey] = ()) -> None:
        """Make a trial of every specification, so that an impossible one is found before any runs.

        Specifications whose trials are all stored are skipped. ConfigError names the place of the
        setting if one is refused.
        """
        tried: set[str] = set()
        for case, variant, spec, settings, trials in self.combinations.values():
            first = trials[0].key
            if first.config_hash in tried or all(trial.key in stored for trial in trials):
                continue
            tried.add(first.config_hash)
            try:
                with opened(spec.make_trial(first.seed)):
                    _require_comparable(spec)
            except Exception as error:  # a user's agent or environment may raise anything
                raise self.refusal(case, variant, settings, spec.refusal(error)) from error

    def refusal(
        self, case: StudyCase, variant: StudyVariant, settings: Layer, error: ConfigError
    ) -> ConfigError:
        """Return the error about a variant in a case, with the file and line of the setting."""
        return error


def _require_comparable(spec: RunSpec) -> None:
    """Raise ConfigError unless every trial is as long as the others, and is evaluated."""
    if spec.budget.target_return is not None:
        raise ConfigError("budget.target_return", "must be omitted in a study")
    unit = "episodes" if spec.budget.steps is None else "steps"
    name = "evaluate_every_episodes" if unit == "episodes" else "evaluate_every"
    budget, every = getattr(spec.budget, unit), getattr(spec.protocol, name)
    if not 1 <= (every or 0) <= budget:
        expected = f"a study with budget.{unit} needs protocol.{name} from 1 to {budget}"
        raise ConfigError(f"protocol.{name}", f"{expected}, got {every}")


@dataclass(frozen=True)
class Measured:
    """The measures of a variant in a case.

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
    """The complete parts of a study, by ids of case and variant: all their trials are stored."""

    study: Study
    measured: Mapping[Pair, Measured]

    @property
    def records(self) -> tuple[TrialRecord, ...]:
        """All trials; see `records_of`."""
        return records_of(m.result for m in self.measured.values())

    @property
    def cases(self) -> tuple[StudyCase, ...]:
        """Cases with at least one complete variant."""
        shown = {case for case, _ in self.measured}
        return tuple(case for case in self.study.cases if case.id in shown)

    @property
    def variants(self) -> tuple[StudyVariant, ...]:
        """Variants that are complete in at least one case."""
        shown = {variant for _, variant in self.measured}
        return tuple(variant for variant in self.study.variants if variant.id in shown)

    def of_case(self, case_id: str) -> tuple[Measured, ...]:
        """Return the measured variants of a case, in the order of the study."""
        return tuple(m for (case, _), m in self.measured.items() if case == case_id)


def compare(study: Study, records: Iterable[TrialRecord]) -> Comparison:
    """Measure each variant in each case of a study whose trials are all among the records."""
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
        # Trials with the same number have the same seed, so their differences are paired.
        differences = {
            name: estimate_mean(np.subtract(*on_equal_terms(name, result, reference)))
            for name in result.values
            if reference is not None and name in reference.values
        }
        combination = study.combinations[case, variant]
        measured[case, variant] = Measured(combination, result, differences)
    return Comparison(study, measured)
