"""Reads a study from its TOML file: layers of settings, each with its place."""

from __future__ import annotations

import importlib
import itertools
import json
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Literal, NamedTuple, TypeAlias

from msgspec import Meta

from sdnn.runs.config_file import ConfigFile, KeyPath
from sdnn.runs.errors import ConfigError
from sdnn.runs.registry import AGENTS, split_label
from sdnn.runs.settings import Settings, check_names, possible_words, read
from sdnn.runs.spec import RunSpec

BASE = "base"
"""The variant without overrides, where axes are varied one at a time or nothing varies."""

TABLES = ("study", "base", "agents", "cases", "variants", "axes")
_NAMED_VALUES = (("environment", "kwargs"), ("environment", "ranges"))
_SHORTHANDS = {("environment",): "id", ("agent",): "name"}


class StudyHeader(Settings, frozen=True):
    """What a study is called, how many trials it has, and what is compared."""

    title: Annotated[str | None, Meta(description="For a reader. By default the file's name.")] = (
        None
    )
    trials: Annotated[
        Annotated[int, Meta(ge=1)], Meta(description="Trials of each variant in each case.")
    ] = 10
    seed: Annotated[
        Annotated[int, Meta(ge=0)],
        Meta(
            description="Root of all seeds; that of a trial follows from it, the case's name and"
            " the trial's number."
        ),
    ] = 0
    cases: Annotated[
        tuple[str, ...] | None,
        Meta(
            description="Names of cases: the paper's, or those of `[cases]`. By default all of"
            " `[cases]`; without these, the environment of `[base]`."
        ),
    ] = None
    reference: Annotated[
        str | None,
        Meta(
            description="The variant that others are compared with. By default `default` or `base`"
            " if there is one, else the first."
        ),
    ] = None
    imports: Annotated[
        tuple[str, ...],
        Meta(description="Modules to import, which may register agents and environments."),
    ] = ()


class _Axes(Settings, frozen=True):
    combine: Literal["one_at_a_time", "product"] = "one_at_a_time"


class _Only(Settings, frozen=True):
    only: tuple[str, ...] = ()


class Setting(NamedTuple):
    """A value of a study file, and its place in the file."""

    value: Any
    where: KeyPath


Layer: TypeAlias = dict[tuple[str, ...], Setting]
"""Settings by their names: ``("learning", "discount")``."""


class KnownCase(NamedTuple):
    """A case that studies may name: its title and settings, which a study cannot change."""

    title: str
    settings: Mapping[str, Any]


@dataclass(frozen=True)
class StudyCase:
    """A task, with settings of its own.

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
    settings: Layer
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
    only
        Ids of the cases in which it runs; none: all.
    """

    id: str
    title: str
    settings: Layer
    case_settings: Mapping[str, Layer]
    where: KeyPath
    only: tuple[str, ...] = ()


class StudyReader:
    """Reads the tables of a study.

    Parameters
    ----------
    path
        A TOML file. Modules that it imports are looked for beside it, too.
    known_cases
        Cases that the file may name.

    Raises
    ------
    ConfigError
        If the file cannot be read, or says something unknown or impossible; the message names
        file, line and key.
    """

    def __init__(self, path: Path, known_cases: Mapping[str, KnownCase]) -> None:
        self.file = ConfigFile.read(path)
        values = self.file.values
        with self._placed(()):
            check_names(values, TABLES)
        for name, value in values.items():
            self._table((name,), value)
        with self._placed(("study",)):
            self.header = read(StudyHeader, values.get("study", {}))
        self._import()
        self.base = self._layer((BASE,), values.get(BASE, {}))
        self.agents = dict(self._read_agents())
        self.cases = self._read_cases(known_cases)
        self.variants = self._read_variants()

    def spec(self, case: StudyCase, variant: StudyVariant) -> tuple[RunSpec, Layer]:
        """Put the layers of a variant in a case together; returns the settings as well.

        Raises
        ------
        ConfigError
            If a setting is unknown, has the wrong type or does not go with another.
        """
        own = (case.settings, variant.settings, variant.case_settings.get(case.id, {}))
        layers = [self.base, *own]
        label = next(
            (layer["agent", "name"] for layer in reversed(layers) if ("agent", "name") in layer),
            Setting("sdnn-c", ()),
        )
        name = str(label.value)
        try:
            of_agent = [self.agents.get(one, {}) for one in (split_label(name)[0], name)]
        except ValueError:
            words = possible_words(name, AGENTS)
            raise self.file.error(label.where, f"no agent {name!r}; {words}") from None
        settings: Layer = {}
        for layer in (self.base, *of_agent, *own):
            settings |= layer
        try:
            return RunSpec.from_values(nested(settings)), settings
        except ConfigError as error:
            raise self.refusal(settings, case, variant, error) from error

    def refusal(
        self, settings: Layer, case: StudyCase, variant: StudyVariant, error: ConfigError
    ) -> ConfigError:
        """Make the error about a variant in a case, at the setting that has the error's key."""
        where = _place_in(settings, error.key)
        if where is None:
            where = variant.where or case.where
        text = f"{error.problem} (case {case.id}, variant {variant.id})"
        return self.file.error(where, text)

    def _placed(self, table: KeyPath) -> _Placed:
        return _Placed(self.file, table)

    def _table(self, where: KeyPath, value: Any) -> dict[str, Any]:
        if not isinstance(value, dict):
            raise self.file.error(where, f"must be a table, got {value!r}")
        return value

    def _layer(self, where: KeyPath, table: Mapping[str, Any]) -> Layer:
        """Read a table of settings: nested, with dotted keys, or with quoted dotted keys."""
        found: Layer = {}
        self._collect(where, table, (), found)
        return found

    def _collect(
        self, where: KeyPath, table: Mapping[str, Any], prefix: tuple[str, ...], found: Layer
    ) -> None:
        for key, value in table.items():
            name, place = (*prefix, *key.split(".")), (*where, key)
            depth = 3 if name[:2] in _NAMED_VALUES else 2
            if isinstance(value, dict) and len(name) < depth:
                self._collect(place, value, name, found)
                continue
            if len(name) > depth:
                words = "SECTION.NAME, or environment.kwargs.NAME"
                raise self.file.error(place, f"must be {words}, got {'.'.join(name)}")
            if name[0] in ("seed", "output"):
                raise self.file.error(place, "is no setting of a study: see [study]")
            if name in _SHORTHANDS:
                name = (*name, _SHORTHANDS[name])
            if name in found:
                raise self.file.error(place, f"{'.'.join(name)} is set twice")
            found[name] = Setting(value, place)

    def _import(self) -> None:
        folder = str(self.file.path.resolve().parent)
        if folder not in sys.path:
            sys.path.append(folder)  # last, so that it hides nothing
        for number, module in enumerate(self.header.imports):
            try:
                importlib.import_module(module)
            except Exception as error:
                raise self.file.error(
                    ("study", "imports", number),
                    f"importing {module} failed: {type(error).__name__}: {error}",
                ) from error

    def _read_agents(self) -> Iterator[tuple[str, Layer]]:
        for agent, table in self.file.values.get("agents", {}).items():
            where = ("agents", agent)
            try:
                split_label(agent)
            except ValueError:
                words = possible_words(agent, AGENTS)
                raise self.file.error(where, f"no such agent; {words}") from None
            layer = self._layer(where, self._table(where, table))
            if ("agent", "name") in layer:
                place = layer["agent", "name"].where
                raise self.file.error(place, "settings of an agent cannot choose another one")
            yield agent, layer

    def _read_cases(self, known_cases: Mapping[str, KnownCase]) -> tuple[StudyCase, ...]:
        tables = self.file.values.get("cases", {})
        listed = self.header.cases
        known = list(dict.fromkeys([*tables, *known_cases]))
        for number, case_id in enumerate(listed or ()):
            if case_id not in known:
                raise self.file.error(
                    ("study", "cases", number),
                    f"no case {case_id!r}: neither a table [cases.{case_id}] nor a case of the"
                    f" paper; {possible_words(case_id, known)}",
                )
        ids = tables if listed is None else listed
        for case_id in tables:
            if case_id not in ids:
                raise self.file.error(("cases", case_id), "is not among the cases of [study]")
        if ids:
            return tuple(self._read_case(one, known_cases.get(one)) for one in dict.fromkeys(ids))
        if ("environment", "id") in self.base:
            # A place for the only task there is.
            name = str(self.base["environment", "id"].value)
            return (StudyCase(name, name, {}, ()),)
        raise self.file.error(
            (),
            'no cases: give some of the paper\'s, [study] cases = ["s4", ...], tables [cases.ID]'
            ' of your own, or [base] environment = "a Gymnasium id"',
        )

    def _read_case(self, case_id: str, known: KnownCase | None) -> StudyCase:
        where: KeyPath = ("cases", case_id)
        table = self._table(where, self.file.values.get("cases", {}).get(case_id, {}))
        title, settings = self._titled(where, table, known.title if known else case_id)
        if known is None:
            return StudyCase(case_id, title, settings, where)
        fixed = {tuple(name.split(".")): value for name, value in known.settings.items()}
        for name, setting in settings.items():
            if name[0] == "environment" or setting.value != fixed.get(name, setting.value):
                words = ", ".join(f"{key} = {value}" for key, value in known.settings.items())
                raise self.file.error(
                    setting.where,
                    f"{case_id} is a case with {words}: give another one another name",
                )
        own = {name: Setting(value, where) for name, value in fixed.items()}
        return StudyCase(case_id, title, own | settings, where)

    def _titled(self, where: KeyPath, table: Mapping[str, Any], title: str) -> tuple[str, Layer]:
        table = dict(table)
        title = table.pop("title", title)
        if not isinstance(title, str):
            raise self.file.error((*where, "title"), f"must be a text, got {title!r}")
        return title, self._layer(where, table)

    def _read_variants(self) -> tuple[StudyVariant, ...]:
        variants: dict[str, StudyVariant] = {}
        for name, value in self.file.values.get("variants", {}).items():
            where: KeyPath = ("variants", name)
            table = dict(self._table(where, value))
            known = [case.id for case in self.cases]
            with self._placed(where):
                only = read(_Only, {"only": table.pop("only", ())}).only
            for number, case_id in enumerate(only):
                if case_id not in known:
                    words = f"no case {case_id!r}; {possible_words(case_id, known)}"
                    raise self.file.error((*where, "only", number), words)
            of_cases = self._table((*where, "cases"), table.pop("cases", {}))
            with self._placed((*where, "cases")):
                check_names(of_cases, only or known)
            in_cases = {
                case_id: self._layer(
                    (*where, "cases", case_id),
                    self._table((*where, "cases", case_id), of_cases[case_id]),
                )
                for case_id in of_cases
            }
            title, settings = self._titled(where, table, name)
            variants[name] = StudyVariant(name, title, settings, in_cases, where, only)
        for variant in self._axis_variants():
            if variant.id in variants:
                words = f"there is a variant {variant.id!r} already"
                raise self.file.error(variant.where, words)
            variants[variant.id] = variant
        if not variants:
            variants[BASE] = StudyVariant(BASE, BASE, {}, {}, ())
        return tuple(variants.values())

    def _axis_variants(self) -> Iterator[StudyVariant]:
        """Make the variants of the axes: the base and every value alone, or all combinations."""
        table = dict(self.file.values.get("axes", {}))
        with self._placed(("axes",)):
            combine = read(
                _Axes, {"combine": table.pop("combine")} if "combine" in table else {}
            ).combine
        axes = self._layer(("axes",), table)
        if not axes:
            return
        values = [list(self._axis_values(axes, name)) for name in axes]
        if combine == "product":
            for chosen in itertools.product(*values):
                layer = {name: setting for _, part in chosen for name, setting in part.items()}
                words = ", ".join(word for word, _ in chosen)
                yield StudyVariant(words, words, layer, {}, ("axes",))
            return
        yield StudyVariant(BASE, BASE, {}, {}, ("axes",))
        for word, layer in itertools.chain.from_iterable(values):
            (setting,) = layer.values()
            yield StudyVariant(word, word, layer, {}, setting.where)

    def _axis_values(self, axes: Layer, name: tuple[str, ...]) -> Iterator[tuple[str, Layer]]:
        axis = axes[name]
        if not isinstance(axis.value, list) or not axis.value:
            raise self.file.error(axis.where, f"must be an array of values, got {axis.value!r}")
        shown = name[:1] if name[0] in ("agent",) and name[1] == "name" else name
        lasts = [one[-1] for one in axes]
        word = shown[-1] if lasts.count(name[-1]) == 1 else ".".join(shown)
        words = [f"{word}={_value_words(value)}" for value in axis.value]
        if len(set(words)) < len(words):
            raise self.file.error(axis.where, f"must be different values, got {axis.value!r}")
        for number, value in enumerate(axis.value):
            yield words[number], {name: Setting(value, (*axis.where, number))}


class _Placed:
    """Gives errors about the values of a table their places in the file."""

    def __init__(self, file: ConfigFile, table: KeyPath) -> None:
        self._file = file
        self._table = table

    def __enter__(self) -> None:
        pass

    def __exit__(self, _kind: Any, error: BaseException | None, _trace: Any) -> None:
        if isinstance(error, ConfigError) and not error.place:
            key: list[str | int] = []
            for word in error.key.replace("[", ".[").split(".") if error.key else []:
                key.append(int(word[1:-1]) if word.startswith("[") else word)
            raise self._file.error((*self._table, *key), error.problem) from error


def _value_words(value: Any) -> str:
    return value if isinstance(value, str) else json.dumps(value, default=str)


def nested(settings: Layer) -> dict[str, Any]:
    """Return settings as the tables of a specification."""
    tables: dict[str, Any] = {}
    for name, setting in settings.items():
        table = tables
        for word in name[:-1]:
            table = table.setdefault(word, {})
            if not isinstance(table, dict):
                break
        else:
            table[name[-1]] = setting.value
    return tables


def _place_in(settings: Layer, key: str) -> KeyPath | None:
    """Find the setting with the key of an error, or the nearest one; None if there is none."""
    name = tuple(key.partition("[")[0].split("."))
    if name in settings:
        return settings[name].where
    for length in range(len(name), 0, -1):
        for own, setting in settings.items():
            if own[:length] == name[:length] or own == name[:length]:
                return setting.where
    return None
