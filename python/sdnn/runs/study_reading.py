"""Reads a study from its TOML file."""

from __future__ import annotations

import importlib
import itertools
import json
import sys
from collections.abc import Collection, Iterator, Mapping
from contextlib import closing
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

from sdnn.config import ProtocolConfig
from sdnn.environments import AcrobotConfig, GoalScheduleConfig, SensorConfig
from sdnn.runs.environment_trial import EnvironmentConfig, EnvironmentTrialConfig
from sdnn.runs.errors import StudyError
from sdnn.runs.preset_agents import PRESET_AGENTS
from sdnn.runs.registry import AGENTS, agent_entry
from sdnn.runs.study import (
    Combination,
    KnownCase,
    Study,
    StudyCase,
    StudyVariant,
)
from sdnn.runs.study_settings import (
    Setting,
    Settings,
    StudyFile,
    blamed,
    build,
    place_of,
)
from sdnn.runs.trial_config import TrialConfig
from sdnn.toml_lines import KeyPath
from sdnn.typed_values import possible_words

BASE = "base"
"""The variant without overrides, where axes are varied one at a time or nothing varies."""

DEFAULT = "default"
"""The variant that others are compared with unless the file says otherwise, if there is one."""

_ACROBOT = ("acrobot", "goal", "sensors")
_SECTIONS = ("approximator", "learning", *_ACROBOT, "environment", "protocol")
_COMBINATIONS = ("one_at_a_time", "product")


@dataclass(frozen=True, kw_only=True)
class _Header:
    """The table [study]."""

    title: str = ""
    trials: int = 10
    seed: int = 0
    reference: str | None = None
    imports: tuple[str, ...] = ()
    cases: tuple[str, ...] | None = field(default=None)


def read_study(
    path: Path,
    *,
    n_trials: int | None = None,
    seed: int | None = None,
    known_cases: Mapping[str, KnownCase] | None = None,
) -> Study:
    """Read a study.

    Modules that it imports are looked for beside the file, too.

    Parameters
    ----------
    path
        A TOML file; ``docs/sweep.md`` describes it.
    n_trials, seed
        Instead of the file's.
    known_cases
        Cases of the acrobot that a study may name, by their ids.

    Raises
    ------
    StudyError
        If the file cannot be read, or says something unknown or impossible; the message names
        file, line and key. Numbers that only the core refuses are found by `Study.check`.
    """
    file = StudyFile.read(path)
    content = file.content
    file.check_keys((), content, ("study", "base", "agents", "cases", "variants", "axes"))
    for key, value in content.items():
        file.table((key,), value)
    header = _header(file)
    _import(file, header.imports)
    base = file.settings((BASE,), content.get(BASE, {}))
    agents = _agents(file)
    cases = _cases(file, header, base, known_cases or {})
    variants = _variants(file, [case.id for case in cases])
    reader = _Reader(file, base, agents)
    reference = _reference(file, header, variants)
    variants = tuple(sorted(variants, key=lambda variant: variant.id != reference))
    return Study(
        file=file,
        title=header.title or path.stem,
        n_trials=header.trials if n_trials is None else n_trials,
        seed=header.seed if seed is None else seed,
        reference=reference,
        cases=cases,
        variants=variants,
        combinations={
            (case.id, variant.id): reader.combine(case, variant)
            for case in cases
            for variant in variants
        },
    )


def _header(file: StudyFile) -> _Header:
    table = file.content.get("study", {})
    names = ("title", "trials", "seed", "reference", "imports", "cases")
    file.check_keys(("study",), table, names)
    kinds: dict[str, Any] = {
        "trials": int, "seed": int, "imports": tuple[str, ...], "cases": tuple[str, ...]
    }  # fmt: skip
    header = _Header(
        **{k: file.value(("study", k), kinds.get(k, str), value) for k, value in table.items()}
    )
    for name, least in (("trials", 1), ("seed", 0)):
        if getattr(header, name) < least:
            raise file.error(
                ("study", name), f"must be at least {least}, got {getattr(header, name)}"
            )
    return header


def _import(file: StudyFile, modules: tuple[str, ...]) -> None:
    folder = str(file.path.resolve().parent)
    if folder not in sys.path:
        sys.path.append(folder)  # last, so that it hides nothing
    for number, module in enumerate(modules):
        try:
            importlib.import_module(module)
        except Exception as error:
            raise file.error(
                ("study", "imports", number),
                f"importing {module} failed: {type(error).__name__}: {error}",
            ) from error


def _agents(file: StudyFile) -> dict[str, Settings]:
    agents: dict[str, Settings] = {}
    for agent, table in file.content.get("agents", {}).items():
        where = ("agents", agent)
        if agent not in AGENTS:
            raise file.error(where, f"no such agent; {possible_words(agent, AGENTS)}")
        agents[agent] = file.settings(where, file.table(where, table))
        if ("agent",) in agents[agent]:
            raise file.error((*where, "agent"), "settings of an agent cannot choose another one")
    return agents


def _cases(
    file: StudyFile, header: _Header, base: Settings, known_cases: Mapping[str, KnownCase]
) -> tuple[StudyCase, ...]:
    tables = file.content.get("cases", {})
    ids: Collection[str] = tables if header.cases is None else header.cases
    known = list(dict.fromkeys([*tables, *known_cases]))
    for number, case_id in enumerate(header.cases or ()):
        if case_id not in known:
            raise file.error(
                ("study", "cases", number),
                f"no case {case_id!r}: neither a table [cases.{case_id}] nor a known case;"
                f" {possible_words(case_id, known)}",
            )
    for case_id in tables:
        if case_id not in ids:
            raise file.error(("cases", case_id), "is not among the cases that [study] lists")
    if ids:
        return tuple(_case(file, one, known_cases.get(one)) for one in dict.fromkeys(ids))
    if ("environment", "id") in base:
        # A place for the only task there is.
        name = str(base["environment", "id"].value)
        return (StudyCase(name, name, {}, ()),)
    raise file.error(
        (),
        f"no cases: give some of {', '.join(known_cases) or 'known ones'}, [study] cases = [...],"
        ' tables [cases.ID] of your own, or [base] environment = "a Gymnasium id"',
    )


def _case(file: StudyFile, case_id: str, known: KnownCase | None) -> StudyCase:
    where: KeyPath = ("cases", case_id)
    table = dict(file.table(where, file.content.get("cases", {}).get(case_id, {})))
    title = file.value(
        (*where, "title"), str, table.pop("title", known.title if known else case_id)
    )
    settings = file.settings(where, table)
    if known is None:
        return StudyCase(case_id, title, settings, where)
    observed = {"n_sensors": known.n_sensors, "noise": known.noise}
    for name, setting in settings.items():
        if name[0] == "environment" or (
            name[0] == "sensors" and setting.value != observed.get(name[-1], setting.value)
        ):
            raise file.error(
                setting.where,
                f"{case_id} is the known case of {known.n_sensors} sensors with noise"
                f" {known.noise:g}: give a case that observes something else another name",
            )
    sensors = {("sensors", key): Setting(value, where) for key, value in observed.items()}
    return StudyCase(case_id, title, sensors | settings, where)


def _variants(file: StudyFile, case_ids: Collection[str]) -> tuple[StudyVariant, ...]:
    variants: dict[str, StudyVariant] = {}
    for name, value in file.content.get("variants", {}).items():
        where: KeyPath = ("variants", name)
        table = dict(file.table(where, value))
        title = file.value((*where, "title"), str, table.pop("title", name))
        in_cases = file.table((*where, "cases"), table.pop("cases", {}))
        file.check_keys((*where, "cases"), in_cases, case_ids)
        variants[name] = StudyVariant(
            id=name,
            title=title,
            settings=file.settings(where, table),
            case_settings={
                case_id: file.settings(
                    (*where, "cases", case_id),
                    file.table((*where, "cases", case_id), in_cases[case_id]),
                )
                for case_id in in_cases
            },
            where=where,
        )
    for variant in _axis_variants(file):
        if variant.id in variants:
            raise file.error(variant.where, f"there is a variant {variant.id!r} already")
        variants[variant.id] = variant
    if not variants:
        variants[BASE] = StudyVariant(BASE, BASE, {}, {}, ())
    return tuple(variants.values())


def _axis_variants(file: StudyFile) -> Iterator[StudyVariant]:
    """Variants of the axes: the base and every value alone, or all combinations."""
    table = dict(file.content.get("axes", {}))
    combine = file.value(
        ("axes", "combine"),
        Literal[_COMBINATIONS],
        table.pop("combine", "one_at_a_time"),
    )
    axes = file.settings(("axes",), table)
    if not axes:
        return
    lasts = [name[-1] for name in axes]
    words: list[list[tuple[str, Settings]]] = []
    for name, axis in axes.items():
        if not isinstance(axis.value, list) or not axis.value:
            raise file.error(axis.where, f"must be an array of values, got {axis.value!r}")
        word = name[-1] if lasts.count(name[-1]) == 1 else ".".join(name)
        values = [
            (f"{word}={_value_words(value)}", {name: Setting(value, (*axis.where, number))})
            for number, value in enumerate(axis.value)
        ]
        if len({variant for variant, _ in values}) < len(values):
            raise file.error(axis.where, f"must be different values, got {axis.value!r}")
        words.append(values)
    if combine == "product":
        for chosen in itertools.product(*words):
            settings: Settings = {}
            for _, part in chosen:
                settings |= part
            name_of_all = ", ".join(word for word, _ in chosen)
            yield StudyVariant(name_of_all, name_of_all, settings, {}, ("axes",))
        return
    yield StudyVariant(BASE, BASE, {}, {}, ("axes",))
    for word, settings in itertools.chain.from_iterable(words):
        (setting,) = settings.values()
        yield StudyVariant(word, word, settings, {}, setting.where)


def _value_words(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value, default=str)


def _reference(file: StudyFile, header: _Header, variants: tuple[StudyVariant, ...]) -> str:
    known = [variant.id for variant in variants]
    if header.reference is None:
        return next((name for name in (DEFAULT, BASE) if name in known), known[0])
    if header.reference not in known:
        raise file.error(
            ("study", "reference"),
            f"no variant {header.reference!r}; {possible_words(header.reference, known)}",
        )
    return header.reference


class _Reader:
    """Puts the layers of settings together.

    Parameters
    ----------
    file
        Where they stand.
    base
        Settings of all trials.
    agents
        Settings of all trials of an agent.
    """

    def __init__(self, file: StudyFile, base: Settings, agents: Mapping[str, Settings]) -> None:
        self._file = file
        self._base = base
        self._agents = agents
        self._n_observed: dict[str, int] = {}

    def combine(self, case: StudyCase, variant: StudyVariant) -> Combination:
        """Make the configuration of a variant in a case.

        Raises
        ------
        StudyError
            If a setting is unknown, has the wrong type or does not go with another.
        """
        own = (case.settings, variant.settings, variant.case_settings.get(case.id, {}))
        layers = (self._base, *own)
        elsewhere = any(name[0] == "environment" for layer in layers for name in layer)
        chosen = Setting(PRESET_AGENTS["general" if elsewhere else "paper"], ())
        for layer in layers:
            chosen = layer.get(("agent",), chosen)
        if not isinstance(chosen.value, str) or chosen.value not in AGENTS:
            raise self._file.error(
                chosen.where,
                f"no agent {chosen.value!r}; {possible_words(str(chosen.value), AGENTS)}",
            )
        settings: Settings = {}
        for layer in (self._base, self._agents.get(chosen.value, {}), *own):
            settings |= layer
        self._check_names(settings)
        make = self._in_environment if self._is_environment(settings) else self._on_acrobot
        return Combination(case, variant, make(chosen.value, settings), settings)

    def _check_names(self, settings: Settings) -> None:
        for name, setting in settings.items():
            if name[0] not in _SECTIONS and name != ("agent",):
                known = ("agent", *_SECTIONS)
                raise self._file.error(
                    setting.where, f"no such setting; {possible_words(name[0], known)}"
                )

    def _is_environment(self, settings: Settings) -> bool:
        others = [setting for name, setting in settings.items() if name[0] == "environment"]
        if not others:
            return False
        for name, setting in settings.items():
            if name[0] in _ACROBOT:
                raise self._file.error(
                    setting.where, f"{name[0]} is the acrobot's: it does not go with an environment"
                )
        if ("environment", "id") not in settings:
            raise self._file.error(others[0].where, "an environment needs an id")
        return True

    def _build(self, section: str, kind: type[Any], settings: Settings) -> Any:
        return build(self._file, section, kind, settings, ())

    def _agent_parts(self, agent: str, settings: Settings, n_inputs: int) -> dict[str, Any]:
        entry, file = agent_entry(agent), self._file
        hint = f" (agent {agent}; what only one agent has belongs into a table [agents.ID])"
        approximator = entry.approximator_settings(n_inputs)
        return {
            "agent": agent,
            "approximator": build(
                file, "approximator", approximator, settings, ("n_inputs",), hint
            ),
            "learning": build(file, "learning", entry.learning_settings(), settings, (), hint),
            "protocol": self._protocol(settings),
        }

    def _protocol(self, settings: Settings) -> ProtocolConfig:
        protocol: ProtocolConfig = self._build("protocol", ProtocolConfig, settings)
        if protocol.n_learning_episodes < protocol.test_interval:
            where = place_of(settings, "protocol", "n_learning_episodes")
            raise self._file.error(
                where or place_of(settings, "protocol", "test_interval") or (),
                f"n_learning_episodes must be at least test_interval ({protocol.test_interval}),"
                f" got {protocol.n_learning_episodes}",
            )
        return protocol

    def _on_acrobot(self, agent: str, settings: Settings) -> TrialConfig:
        sensors: SensorConfig = self._build("sensors", SensorConfig, settings)
        return TrialConfig(
            **self._agent_parts(agent, settings, sensors.n_inputs),
            acrobot=self._build("acrobot", AcrobotConfig, settings),
            goal=self._build("goal", GoalScheduleConfig, settings),
            sensors=sensors,
        )

    def _in_environment(self, agent: str, settings: Settings) -> EnvironmentTrialConfig:
        try:
            environment: EnvironmentConfig = self._build("environment", EnvironmentConfig, settings)
            key = repr(environment)
            if key not in self._n_observed:
                with closing(environment.make()) as made:
                    shape = made.observation_space.shape
                self._n_observed[key] = int((shape or (0,))[0])
        except StudyError:
            raise
        except Exception as error:  # of whatever environment
            text = str(error) or type(error).__name__
            where = blamed(settings, text) or place_of(settings, "environment", "id") or ()
            raise self._file.error(where, text) from error
        return EnvironmentTrialConfig(
            **self._agent_parts(agent, settings, self._n_observed[key]), environment=environment
        )
