"""A study: cases, variants, and the specification of each variant in each case, from a file."""

from __future__ import annotations

import itertools
from collections.abc import Collection, Mapping
from pathlib import Path
from typing import NamedTuple

from sdnn.runs.engine import PlannedTrial, plan_of
from sdnn.runs.errors import ConfigError
from sdnn.runs.settings import possible_words
from sdnn.runs.spec import RunSpec
from sdnn.runs.study_file import (
    BASE,
    MOST_COMBINATIONS,
    MOST_TRIALS,
    KnownCase,
    Layer,
    StudyCase,
    StudyFile,
    StudyVariant,
)
from sdnn.runs.trial import TrialKey, opened

DEFAULT = "default"
"""The variant that others are compared with unless the file names another, if there is one."""


class Combination(NamedTuple):
    """A variant in a case, what is run of it, and the settings that made it."""

    case: StudyCase
    variant: StudyVariant
    spec: RunSpec
    settings: Layer
    trials: tuple[PlannedTrial, ...]


class Study(StudyFile):
    """A study, read from a file; modules that it imports are looked for beside it, too.

    ConfigError if the file cannot be read, or has something unknown or impossible; the message
    names file, line and key. What only agents and environments refuse is found by `check`.

    Parameters
    ----------
    path
        A TOML file; ``docs/how-to/studies.md`` describes it.
    known_cases
        Cases that the file may name, by their ids.
    n_trials, seed
        Trials of each variant in each case, and the root of all seeds, instead of the file's. The
        seed of a trial depends on the root, its case and its number only, so that variants can be
        compared trial by trial.

    Attributes
    ----------
    reference : str
        Id of the variant that the others are compared with.
    cases, variants : tuple
        In the order of the file, but for the reference, which comes first.
    combinations : dict
        Every variant in every case in which it runs, by their ids (case, variant).
    """

    def __init__(
        self,
        path: Path,
        *,
        known_cases: Mapping[str, KnownCase] | None = None,
        n_trials: int | None = None,
        seed: int | None = None,
    ) -> None:
        super().__init__(path, known_cases or {})
        header = self.header
        self.title = header.title or path.stem
        self.n_trials = header.trials if n_trials is None else n_trials
        self.seed = header.seed if seed is None else seed
        known = [variant.id for variant in self.variants]
        default = next((name for name in (DEFAULT, BASE) if name in known), known[0])
        self.reference = default if header.reference is None else header.reference
        if self.reference not in known:
            words = f"no variant {self.reference!r}; {possible_words(self.reference, known)}"
            raise self.file.error(("study", "reference"), words)
        self.variants = tuple(sorted(self.variants, key=lambda one: one.id != self.reference))
        n_combinations = sum(len(variant.only or self.cases) for variant in self.variants)
        if n_combinations > MOST_COMBINATIONS:
            problem = f"must be at most {MOST_COMBINATIONS} in all cases, got {n_combinations}"
            raise self.file.error(("variants",), problem)
        if self.n_trials * n_combinations > MOST_TRIALS:
            given = f"{self.n_trials} of {n_combinations} each"
            problem = f"must be at most {MOST_TRIALS} in all, got {given}"
            raise self.file.error(("study", "trials"), problem)
        self.combinations: dict[tuple[str, str], Combination] = {}
        for case, variant in itertools.product(self.cases, self.variants):
            if case.id in (variant.only or [case.id]):
                spec, settings = self.spec(case, variant)
                trials = plan_of([(case.id, spec)], self.n_trials, self.seed)
                made = Combination(case, variant, spec, settings, trials)
                self.combinations[case.id, variant.id] = made

    def keys(self, case_id: str, variant_id: str) -> tuple[TrialKey, ...]:
        """List where the results of the trials of a variant in a case are stored."""
        return tuple(planned.key for planned in self.combinations[case_id, variant_id].trials)

    def chosen(self, only: Collection[str] = ()) -> tuple[tuple[str, str], ...]:
        """List the ids of case and variant of some variants (default: all); ValueError if none."""
        known = [variant.id for variant in self.variants]
        for name in only:
            if name not in known:
                raise ValueError(f"no variant {name!r}; {possible_words(name, known)}")
        return tuple(pair for pair in self.combinations if not only or pair[1] in only)

    def plan(self, only: Collection[str] = ()) -> tuple[PlannedTrial, ...]:
        """List the trials of some variants (default: all), each once; see `chosen`."""
        specs = ((pair[0], self.combinations[pair].spec) for pair in self.chosen(only))
        return plan_of(specs, self.n_trials, self.seed)

    def same_as(self, variant_id: str) -> str | None:
        """Return the first variant before another one that is the same in every case."""

        def hashes(variant: str) -> list[TrialKey]:
            return [self.keys(case, name)[0] for case, name in self.combinations if name == variant]

        mine = hashes(variant_id)
        first = next(variant.id for variant in self.variants if hashes(variant.id) == mine)
        return None if first == variant_id else first

    def check(self, stored: Collection[TrialKey] = ()) -> None:
        """Make a trial of every specification once, so that nothing is run that could not be.

        Those of which all trials are stored are not tried. ConfigError that names the place of the
        setting if one is refused.
        """
        tried: set[str] = set()
        for (case_id, variant_id), one in self.combinations.items():
            keys = self.keys(case_id, variant_id)
            if keys[0].config_hash in tried or all(key in stored for key in keys):
                continue
            tried.add(keys[0].config_hash)
            try:
                with opened(one.spec.make_trial(keys[0].seed)):
                    _require_comparable(one.spec)
            except Exception as error:  # of whatever agent or environment
                refusal = one.spec.refusal(error)
                raise self.refusal(one.settings, one.case, one.variant, refusal) from error


def _require_comparable(spec: RunSpec) -> None:
    """Check that all trials have the same number of evaluations, at least one."""
    if spec.budget.target_return is not None:
        raise ConfigError("budget.target_return", "must be omitted in a study")
    unit = "episodes" if spec.budget.steps is None else "steps"
    name = "evaluate_every_episodes" if unit == "episodes" else "evaluate_every"
    budget, every = getattr(spec.budget, unit), getattr(spec.protocol, name)
    if not 1 <= (every or 0) <= budget:
        raise ConfigError(
            f"protocol.{name}",
            f"a study with budget.{unit} needs protocol.{name} from 1 to {budget}, got {every}",
        )
