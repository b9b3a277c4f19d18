"""Results that were reported, to be run again: the trials of stores and of runs' folders.

Nothing in them is trusted: counts and sizes are limited, configurations must fit their hashes, and
code is imported only where `Consent` allows it.
"""

from __future__ import annotations

import importlib
import json
from collections.abc import Collection, Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Protocol

import gymnasium as gym

from sdnn.agents.registry import agent_entry, split_label
from sdnn.runs.config_file import ConfigFile
from sdnn.runs.environment import find_module
from sdnn.runs.errors import ChangedRowsError, ConfigError, RunError
from sdnn.runs.run import CONFIG, Goal, Run
from sdnn.runs.spec import RunSpec
from sdnn.runs.store import STORE_NAME, ResultStore
from sdnn.runs.study_file import MOST_TRIALS
from sdnn.runs.trial import TrialKey, TrialRecord, TrialRows
from sdnn.support.arguments import shown
from sdnn.support.toml import leaves

MOST_TABLE_BYTES = 2**33
"""Largest limit of an agent's tables that a reported configuration may set, in bytes."""

MOST_DECISIONS = 10**9  # largest number of decisions of a trial that is run again

_TRUSTED = frozenset({"gymnasium", "sdnn"})
"""Packages whose registered environments need no consent."""
_TRUSTED_MODULES = frozenset({"gymnasium", "sdnn", "sdnn.environments"})
"""Modules that an environment's id may name without consent."""


@dataclass(frozen=True)
class Consent:
    """The modules whose code may run; environments of Gymnasium and of this library always may."""

    modules: tuple[str, ...] = ()

    def import_modules(self) -> None:
        """Import the modules, which may register agents and environments; RunError if one fails."""
        for module in self.modules:
            try:
                find_module(module)
                importlib.import_module(module)
            except Exception as error:  # a user's module may raise anything
                raise RunError(
                    f"importing {module} failed: {type(error).__name__}: {error}"
                ) from error

    def require(self, environment_id: str) -> None:
        """Check that the code of an environment may run; ConfigError that names its module."""
        module = environment_id.rpartition(":")[0]
        if module in _TRUSTED_MODULES:
            return
        allowed = {name.partition(".")[0] for name in self.modules}
        if not module:  # else the id imports the module, whatever is registered
            allowed |= _TRUSTED
            registered = gym.registry.get(environment_id)
            entry_point = registered.entry_point if registered else None
            if isinstance(entry_point, str):
                module = entry_point.partition(":")[0]
            elif entry_point is not None:
                module = entry_point.__module__
        package = module.partition(".")[0]
        if package and package not in allowed:
            problem = f"is code of the module {module}, which runs only if you trust it"
            raise ConfigError("environment.id", f"{environment_id} {problem}: --import {module}")


@dataclass(frozen=True, kw_only=True)
class ReportedTrial:
    """A trial as it was reported, to be run again.

    ``digest`` is the beginning of a SHA-256: of all rows, or where ``covers_tests`` of the test
    episodes. ``rows`` and ``n_decisions`` are None where they were not reported. ``goals`` are
    those of a run that was resumed. ``problem`` is what is wrong with the report itself.
    """

    key: TrialKey
    config: str
    version: str
    digest: str
    covers_tests: bool = False
    rows: TrialRows | None = None
    n_decisions: int | None = None
    goals: tuple[Goal, ...] = ()
    problem: str = ""

    @classmethod
    def of_record(
        cls, record: TrialRecord, goals: tuple[Goal, ...] = (), problem: str = ""
    ) -> ReportedTrial:
        """Make it from a stored trial."""
        return cls(
            key=record.key,
            config=record.config,
            version=record.version,
            digest=record.rows.checksum(),
            rows=record.rows,
            n_decisions=record.n_decisions,
            goals=goals,
            problem=problem,
        )

    def digest_of(self, rows: TrialRows) -> str:
        """Return the digest of other rows, as long as the reported one."""
        digest = rows.digest() if self.covers_tests else rows.checksum()
        return digest[: len(self.digest)]

    def spec(self, consent: Consent) -> RunSpec:
        """Return the specification in the configuration; it is the same on every machine.

        ConfigError if it is one of another agent, cannot be used by this version, needs code
        without consent, or is larger than what was reported.
        """
        values = json.loads(self.config)
        environment, agent = values.get("environment"), values.get("agent")
        if not (isinstance(environment, dict) and isinstance(environment.get("id"), str)):
            raise ConfigError("environment.id", "is missing in the configuration")
        consent.require(environment["id"])
        if not isinstance(agent, dict):
            raise ConfigError("agent", "is missing in the configuration")
        label = self.key.agent
        try:
            name, preset = split_label(label)
        except ValueError as error:
            hint = "a module that registers it can be given by --import"
            raise ConfigError("agent.name", f"{error}; {hint}") from None
        if agent.get("name") != name:
            problem = (
                f"must be {name!r}, as the rows are of {label}, got {shown(agent.get('name'))}"
            )
            raise ConfigError("agent.name", problem)
        entry = agent_entry(name)
        if preset is None and "paper" in entry.presets:
            preset = "paper"
        agent = {"history": "none", **agent, "preset": preset}
        version = agent.pop("version", "")
        if version != entry.version:
            problem = f"must be {entry.version!r}, as of the agent here, got {shown(version)}"
            raise ConfigError("agent.version", problem)
        spec = RunSpec.from_values({**values, "agent": agent, "seed": self.key.seed})
        if changes := changed_settings(self.config, spec.canonical_json()):
            key, (reported, here) = next(iter(changes.items()))
            raise ConfigError(key, f"is {reported} in the configuration, which gives {here} here")
        self._require_size(spec)
        return spec

    def _require_size(self, spec: RunSpec) -> None:
        """Check that the specification means no more work than was reported; ConfigError."""
        n_bytes = getattr(spec.approximator, "max_table_bytes", 0)
        if n_bytes > MOST_TABLE_BYTES:
            problem = f"must be at most {MOST_TABLE_BYTES}, got {n_bytes}"
            raise ConfigError("approximator.max_table_bytes", problem)
        n_decisions, protocol = self.n_decisions, spec.protocol
        unit = "steps" if spec.budget.steps is not None else "episodes"
        if n_decisions is None:
            return
        if n_decisions > MOST_DECISIONS:
            problem = f"must need at most {MOST_DECISIONS} decisions, got {n_decisions}"
            raise ConfigError(f"budget.{unit}", problem)
        goal = self.goals[-1] if self.goals else None
        if goal is not None and (goal.steps or goal.episodes or 0) > n_decisions:
            length = goal.steps or goal.episodes
            problem = f"must fit the {n_decisions} reported decisions, got {length}"
            raise ConfigError("goals", problem)
        if spec.budget.target_return is not None or goal is not None:
            return  # the run may have ended before its budget
        by_steps, by_episodes = protocol.evaluate_every, protocol.evaluate_every_episodes
        interval = by_steps if unit == "steps" else by_episodes
        n_evaluations = spec.length // interval if interval else 0
        n_evaluated = n_evaluations * protocol.evaluation_episodes
        # Every step, and every episode of learning or evaluation, has a decision at least.
        for key, needed in (
            (f"budget.{unit}", spec.length),
            ("protocol.evaluation_episodes", spec.length + n_evaluated),
        ):
            if needed > n_decisions:
                problem = f"needs {needed} decisions, more than the {n_decisions} reported ones"
                raise ConfigError(key, problem)


def changed_settings(before: str, after: str) -> dict[str, tuple[str, str]]:
    """Return the settings that differ between two configurations in JSON, by their dotted keys.

    >>> changed_settings('{"a":{"b":1,"c":2}}', '{"a":{"b":1,"c":3}}')
    {'a.c': ('2', '3')}
    """
    old, new = (
        {key: json.dumps(value) for key, value in leaves(json.loads(text))}
        for text in (before, after)
    )
    keys = dict.fromkeys((*old, *new))
    texts = {key: (old.get(key, "missing"), new.get(key, "missing")) for key in keys}
    return {key: pair for key, pair in texts.items() if pair[0] != pair[1]}


class Reports(Protocol):
    """A source of reported trials.

    ``title`` names it, ``keys`` are those of all its finished trials. ``machine`` describes where
    they were run, if that is known; ``n_unfinished`` counts trials that cannot be compared.
    """

    title: str
    keys: list[TrialKey]
    machine: str
    n_unfinished: int

    def load(self, keys: Collection[TrialKey]) -> Iterable[ReportedTrial]:
        """Return the trials of the given keys."""

    def check(self, keys: Iterable[TrialKey]) -> Iterator[bool]:
        """Yield for each key whether the trial's rows fit their checksum, if they have one."""


class StoredReports:
    """The finished trials in a folder of `sdnn reproduce`, `sweep` or `train`; nothing is written.

    RunError if the folder has no results, or its files are damaged.
    """

    machine = ""

    def __init__(self, folder: Path, consent: Consent) -> None:
        self.title, self._folder = str(folder), folder
        if not (folder / STORE_NAME).exists():
            raise RunError(f"{folder} holds no results: there is no {folder / STORE_NAME}")
        with ResultStore(folder, read_only=True) as store:
            finished = store.keys()
            self.n_unfinished = len(store.keys(unfinished=True)) - len(finished)
        if len(finished) > MOST_TRIALS:
            raise RunError(f"{folder} must hold at most {MOST_TRIALS} trials, got {len(finished)}")
        self.keys = sorted(finished)
        self._run = self._open_run(consent) if (folder / CONFIG).exists() else None

    def _open_run(self, consent: Consent) -> Run:
        """Open the run of the folder, once the code that its configuration names is allowed."""
        file = ConfigFile.read(self._folder / CONFIG)
        environment = file.values.get("environment")
        named = environment.get("id") if isinstance(environment, dict) else environment
        try:
            consent.require(str(named))
        except ConfigError as error:
            raise file.located(error) from error
        return Run.open(self._folder)

    def load(self, keys: Collection[TrialKey]) -> Iterator[ReportedTrial]:
        """Return the trials of the given keys."""
        with ResultStore(self._folder, read_only=True) as store:
            try:
                records = [(record, "") for record in store.load(keys)]
            except ChangedRowsError:
                records = [self._load(store, key) for key in sorted(keys)]
        for record, problem in records:
            run = self._run
            if run is not None and run.key.config_hash != record.key.config_hash:
                changes = changed_settings(record.config, run.spec.canonical_json())
                problem = problem or f"{self._folder / CONFIG} has another configuration" + "".join(
                    f"; {key} is {here}, of the rows {stored}"
                    for key, (stored, here) in changes.items()
                )
            yield ReportedTrial.of_record(record, () if run is None else run.goals, problem)

    def _load(self, store: ResultStore, key: TrialKey) -> tuple[TrialRecord, str]:
        """Return the record of a trial, and the problem of its rows or an empty text."""
        try:
            return store.load([key])[0], ""
        except ChangedRowsError as error:
            return error.record, "the stored rows do not fit their checksum"

    def check(self, keys: Iterable[TrialKey]) -> Iterator[bool]:
        """Yield for each key whether the trial's rows fit their checksum."""
        with ResultStore(self._folder, read_only=True) as store:
            for key in keys:
                try:
                    store.rows(key)
                except ChangedRowsError:
                    yield False
                else:
                    yield True
