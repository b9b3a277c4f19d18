"""A study: cases, variants, and the configuration of each variant in each case, from a file."""

from __future__ import annotations

from collections.abc import Collection, Mapping
from dataclasses import dataclass
from typing import Protocol

import gymnasium as gym

from sdnn.runs.records import TrialKey
from sdnn.runs.study_settings import Settings, StudyFile, blamed, place_of
from sdnn.runs.trial import opened
from sdnn.runs.trial_config import PlannedTrial, TrialSettings, trial_seed
from sdnn.toml_lines import KeyPath
from sdnn.typed_values import possible_words


class KnownCase(Protocol):
    """A case of the acrobot that studies may name."""

    @property
    def title(self) -> str:
        """For a reader."""

    @property
    def n_sensors(self) -> int:
        """Number of observed variables."""

    @property
    def noise(self) -> float:
        """Standard deviation of the sensor noise."""


@dataclass(frozen=True)
class StudyCase:
    """What is observed, with settings of its own.

    Parameters
    ----------
    id
        The word used in the result file; seeds are derived from it.
    title
        For a reader.
    settings
        Override those of the base and of the agent.
    where
        Its place in the file.
    """

    id: str
    title: str
    settings: Settings
    where: KeyPath


@dataclass(frozen=True)
class StudyVariant:
    """A named set of overrides.

    Parameters
    ----------
    id
        Its name.
    title
        For a reader.
    settings
        Override all others.
    case_settings
        Override even these, in single cases, by their ids.
    where
        Its place in the file.
    """

    id: str
    title: str
    settings: Settings
    case_settings: Mapping[str, Settings]
    where: KeyPath


@dataclass(frozen=True)
class Combination:
    """A variant in a case.

    Parameters
    ----------
    case, variant
        Which.
    config
        What is run.
    settings
        Those of the file that made it, with their places.
    """

    case: StudyCase
    variant: StudyVariant
    config: TrialSettings
    settings: Settings


@dataclass(frozen=True, kw_only=True)
class Study:
    """A study, read from a file.

    Parameters
    ----------
    file
        Its text.
    title
        For a reader.
    n_trials
        Trials of each variant in each case.
    seed
        Root of all seeds. That of a trial depends on this, its case and its number only, so that
        variants can be compared trial by trial.
    reference
        Id of the variant that the others are compared with.
    cases, variants
        In the order of the file, but for the reference, which comes first.
    combinations
        Every variant in every case, by their ids (case, variant).
    """

    file: StudyFile
    title: str
    n_trials: int
    seed: int
    reference: str
    cases: tuple[StudyCase, ...]
    variants: tuple[StudyVariant, ...]
    combinations: Mapping[tuple[str, str], Combination]

    def keys(self, case_id: str, variant_id: str) -> tuple[TrialKey, ...]:
        """List the trials of a variant in a case."""
        config = self.combinations[case_id, variant_id].config
        config_hash = config.config_hash
        return tuple(
            TrialKey(case_id, config.agent, n, trial_seed(self.seed, case_id, n), config_hash)
            for n in range(self.n_trials)
        )

    def plan(self, only: Collection[str] = ()) -> tuple[PlannedTrial, ...]:
        """List the trials of some variants (default: all), each once.

        The first trial of every combination comes first, so an interrupted run covers all evenly.

        Raises
        ------
        ValueError
            If there is no such variant.
        """
        known = [variant.id for variant in self.variants]
        for name in only:
            if name not in known:
                raise ValueError(f"no variant {name!r}; {possible_words(name, known)}")
        wanted = [
            (self.combinations[case.id, variant.id].config, self.keys(case.id, variant.id))
            for case in self.cases
            for variant in self.variants
            if not only or variant.id in only
        ]
        plan: dict[TrialKey, PlannedTrial] = {}
        for number in range(self.n_trials):
            for config, keys in wanted:
                plan.setdefault(keys[number], PlannedTrial(keys[number], config))
        return tuple(plan.values())

    def same_as(self, variant_id: str) -> str | None:
        """Return the first variant before another one that is the same in every case."""
        mine = [self.combinations[case.id, variant_id].config for case in self.cases]
        for variant in self.variants:
            if variant.id == variant_id:
                return None
            if [self.combinations[case.id, variant.id].config for case in self.cases] == mine:
                return variant.id
        return None

    def check(self, stored: Collection[TrialKey] = ()) -> None:
        """Make a trial of every configuration once, so that nothing is run that could not be.

        Parameters
        ----------
        stored
            Trials that need not be run: configurations of which all are stored are not tried.

        Raises
        ------
        StudyError
            If one is refused; it names the place of the setting.
        """
        tried: set[str] = set()
        for (case_id, variant_id), combination in self.combinations.items():
            config = combination.config
            keys = self.keys(case_id, variant_id)
            if config.config_hash in tried or all(key in stored for key in keys):
                continue
            tried.add(config.config_hash)
            try:
                with opened(config.make_trial(keys[0].seed)):
                    pass
            except Exception as error:  # of whatever agent or environment
                raise _refusal(self.file, combination, error) from error


def _refusal(file: StudyFile, combination: Combination, error: Exception) -> Exception:
    """Make the error for a configuration that was refused, at the setting that its text names."""
    text = str(error) or type(error).__name__
    where = blamed(combination.settings, text)
    if where is None and isinstance(error, gym.error.Error | ImportError):
        where = place_of(combination.settings, "environment", "id")
    return file.error(
        combination.variant.where or combination.case.where if where is None else where,
        f"{text} (case {combination.case.id}, variant {combination.variant.id},"
        f" agent {combination.config.agent})",
    )
