"""Reads a study from its TOML file: layers of settings, each with its place."""

from __future__ import annotations

import importlib
import itertools
import json
import math
from collections import Counter
from collections.abc import Collection, Iterator, Mapping, Sequence
from contextlib import suppress
from pathlib import Path
from typing import Annotated, ClassVar, Literal, TypeAlias

import msgspec
from msgspec import Meta

from sdnn.agents.registry import labels, split_label
from sdnn.runs.config_file import ConfigFile
from sdnn.runs.environment import find_module, search_folder
from sdnn.runs.errors import ConfigError
from sdnn.runs.report import Content
from sdnn.runs.settings import (
    DEFAULT_AGENT,
    SHORTHANDS,
    Settings,
    Values,
    check_names,
    convert_value,
    doc,
    overridden,
    read_table,
)
from sdnn.runs.spec import RunSpec
from sdnn.runs.store import ResultStore
from sdnn.runs.study import Comparison, Layer, Setting, Study, StudyCase, StudyVariant
from sdnn.runs.sweep import Addition, study_content
from sdnn.support.habits import advice
from sdnn.support.toml import KeyPath, dotted

DEFAULT = "default"
"""The variant that others are compared with, if it exists and the file names no other."""
BASE = "base"  # name of the variant without overrides, if axes vary one at a time or nothing varies

MOST_TRIALS = 100_000
MOST_COMBINATIONS = 5_000  # most combinations of a variant and a case
MOST_SETTINGS = 5_000  # most settings of a table

_DEPTHS: dict[tuple[str, ...], int] = {("environment", "kwargs"): 4, ("environment", "ranges"): 3}
"""Number of parts of keys in tables whose keys are not fixed; elsewhere keys have two parts."""


class StudyHeader(Settings, frozen=True):
    """Title of a study, number of trials and what is compared."""

    title: Annotated[str | None, doc("For a reader. By default the file's name.")] = None
    trials: Annotated[int, Meta(ge=1), doc("Trials of each variant in each case.")] = 10
    seed: Annotated[
        int,
        Meta(ge=0),
        doc(
            "Root of all seeds; that of a trial follows from it, the case's name and the "
            "trial's number."
        ),
    ] = 0
    cases: Annotated[
        tuple[str, ...] | None,
        doc(
            "Names of cases: the paper's, or those of `[cases]`. By default all of `[cases]`;"
            " without these, the environment of `[base]`."
        ),
    ] = None
    reference: Annotated[
        str | None,
        doc(
            "The variant that others are compared with. By default `default` or `base` if "
            "there is one, else the first."
        ),
    ] = None
    imports: Annotated[
        tuple[str, ...], doc("Modules to import, which may register agents and environments.")
    ] = ()


_Table: TypeAlias = dict[str, object]


class StudyTables(Settings, frozen=True):
    """The tables of a study's file."""

    study: StudyHeader = StudyHeader()
    base: _Table = msgspec.field(default_factory=dict)
    agents: dict[str, _Table] = msgspec.field(default_factory=dict)
    cases: dict[str, _Table] = msgspec.field(default_factory=dict)
    variants: dict[str, _Table] = msgspec.field(default_factory=dict)
    axes: _Table = msgspec.field(default_factory=dict)


class StudyFile(Study):
    """A study, read from a file; modules that it imports are looked for beside it, too.

    ConfigError if the file cannot be read, or has something unknown or impossible; the message
    names file, line and key. What only agents and environments refuse is found by `check`.

    ``path`` is a TOML file, which ``docs/how-to/studies.md`` describes; ``n_trials`` and ``seed``
    replace the file's. ``only`` are ids of the variants to run, by default all; ValueError for an
    unknown one.
    """

    known_cases: ClassVar[Mapping[str, StudyCase]] = {}
    """Cases that the file may name, by their ids; it cannot change their settings."""

    def __init__(
        self,
        path: Path,
        *,
        n_trials: int | None = None,
        seed: int | None = None,
        only: Collection[str] = (),
    ) -> None:
        self.file = ConfigFile.read(path)
        self.source, self.text = path.name, self.file.text
        try:
            self.tables = read_table(StudyTables, self.file.values)
            header = self.tables.study
            self._import_modules()
            self.base = self._layer((BASE,), self.tables.base)
            self.agents = dict(self._read_agents())
            cases = self._read_cases()
            variants = self._read_variants(cases)
        except ConfigError as error:
            raise self.file.located(error) from error
        known = [variant.id for variant in variants]
        reference = self._reference(known)
        variants = tuple(sorted(variants, key=lambda v: v.id != reference))  # it is the first
        pairs = [
            (case, variant)
            for case, variant in itertools.product(cases, variants)
            if not variant.only or case.id in variant.only
        ]
        if len(pairs) > MOST_COMBINATIONS:
            problem = f"must be at most {MOST_COMBINATIONS} in all cases, got {len(pairs)}"
            raise self.file.error(("variants",), problem)
        n_trials = header.trials if n_trials is None else n_trials
        if n_trials * len(pairs) > MOST_TRIALS:
            problem = f"must be at most {MOST_TRIALS} in all, got {n_trials} of {len(pairs)} each"
            raise self.file.error(("study", "trials"), problem)
        super().__init__(
            header.title or path.stem,
            ((*pair, *self.spec(*pair)) for pair in pairs),
            n_trials=n_trials,
            seed=header.seed if seed is None else seed,
            reference=reference,
        )
        self.cases, self.variants = cases, variants
        for name in only:
            if name not in known:
                raise ValueError(f"no variant {name!r}; {advice(name, known)}")
        self.pairs = tuple(pair for pair in self.pairs if not only or pair[1] in only)

    def _reference(self, known: Sequence[str]) -> str:
        """Return the id of the variant that others are compared with; ConfigError if unknown."""
        reference = self.tables.study.reference
        if reference is None:
            return next((name for name in (DEFAULT, BASE) if name in known), known[0])
        if reference not in known:
            problem = f"no variant {reference!r}; {advice(reference, known)}"
            raise self.file.error(("study", "reference"), problem)
        return reference

    def additions(self, comparison: Comparison) -> Addition:
        """Make the additions to the report."""
        return (), {}

    def report(self, comparison: Comparison, store: ResultStore) -> Content | None:
        """Make the report of the variants that are complete."""
        return study_content(comparison, self.additions(comparison))

    def file_name(self, name: str) -> str:
        """Return a name that begins with that of the study's file."""
        return f"{self.file.path.stem}-{name}"

    def spec(self, case: StudyCase, variant: StudyVariant) -> tuple[RunSpec, Layer]:
        """Return the specification of a variant in a case, and the merged settings that made it.

        ConfigError if a setting is unknown, has the wrong type or conflicts with another.
        """
        layers = case.settings | variant.settings | variant.case_settings.get(case.id, {})
        settings = self.base | layers
        try:
            # These settings name the agent, whose table [agents.LABEL] comes before them.
            label = self._values(case, settings).get("agent", {}).get("name", DEFAULT_AGENT)
            with suppress(ValueError):  # an unknown agent: the specification raises a clearer error
                agent_id, _ = split_label(label)
                of_agent = self.agents.get(agent_id, {}) | self.agents.get(label, {})
                settings = self.base | of_agent | layers
            return RunSpec.from_values(self._values(case, settings)), settings
        except ConfigError as error:
            raise self.refusal(case, variant, settings, error) from error

    def _values(self, case: StudyCase, settings: Layer) -> Values:
        """Return settings as the tables of a specification, with the defaults of the case."""
        values = {".".join(name): setting.value for name, setting in settings.items()}
        return self.completed(case, overridden({}, values))

    def completed(self, case: StudyCase, values: Values) -> Values:
        """Return the values of a specification with the defaults of its case filled in."""
        return values

    def refusal(
        self, case: StudyCase, variant: StudyVariant, settings: Layer, error: ConfigError
    ) -> ConfigError:
        """Make the error about a variant in a case, at the setting that has the error's key."""
        text = f"{error.problem} (case {case.id}, variant {variant.id})"
        name = tuple(error.key.partition("[")[0].split("."))
        if name in settings:
            return self.file.error(settings[name].where, text)
        for key, setting in settings.items():  # within the key, or a table around it
            if key[: len(name)] == name or name[: len(key)] == key:
                return self.file.error(setting.where, text)
        same_table = (setting.where for key, setting in settings.items() if key[0] == name[0])
        where = next(same_table, variant.where or case.where)
        return ConfigError(error.key, text, self.file.place(where))

    def _layer(
        self, where: KeyPath, table: Mapping[str, object], prefix: tuple[str, ...] = (),
        layer: Layer | None = None,
    ) -> Layer:  # fmt: skip
        """Return the settings of a table, whose keys may be nested, dotted, or quoted with dots.

        ``where`` is the table's place in the file. Nested tables are added to ``layer`` by calls of
        this function, under the keys that begin with ``prefix``.
        """
        layer = {} if layer is None else layer
        for key, value in table.items():
            name, place = (*prefix, *key.split(".")), (*where, key)
            depth = _DEPTHS.get(name[:2], 2)
            if isinstance(value, dict) and len(name) < depth:
                self._layer(place, value, name, layer)
                continue
            if len(name) > depth:
                expected = "SECTION.NAME, or environment.kwargs.NAME"
                raise self.file.error(place, f"must be {expected}, got {'.'.join(name)}")
            if name[0] in ("seed", "output"):
                raise self.file.error(place, "is no setting of a study: see [study]")
            if len(name) == 1:
                if name[0] not in SHORTHANDS:
                    raise self.file.error(place, f"must be a table, got {value!r}")
                name = (*name, SHORTHANDS[name[0]])
            if name in layer:
                raise self.file.error(place, f"{'.'.join(name)} is set twice")
            if len(layer) == MOST_SETTINGS:
                raise self.file.error(where, f"must have at most {MOST_SETTINGS} settings")
            layer[name] = Setting(value, place)
        return layer

    def _import_modules(self) -> None:
        """Import the modules that ``imports`` lists; they register environments and agents."""
        search_folder(self.file.path.resolve().parent)
        for number, module in enumerate(self.tables.study.imports):
            find_module(module)
            try:
                importlib.import_module(module)
            except Exception as error:
                problem = f"importing {module} failed: {type(error).__name__}: {error}"
                raise self.file.error(("study", "imports", number), problem) from error

    def _read_agents(self) -> Iterator[tuple[str, Layer]]:
        """Yield (label, settings) of the tables ``[agents.LABEL]``."""
        for agent, table in self.tables.agents.items():
            if agent not in labels():
                hint = advice(agent, labels())
                raise self.file.error(("agents", agent), f"no such agent; {hint}")
            layer = self._layer(("agents", agent), table)
            if ("agent", "name") in layer:
                place = layer["agent", "name"].where
                raise self.file.error(place, "settings of an agent cannot choose another one")
            yield agent, layer

    def _read_cases(self) -> tuple[StudyCase, ...]:
        """Return the cases of the file; without any, one for the environment of [base]."""
        tables, listed = self.tables.cases, self.tables.study.cases
        known = list(dict.fromkeys([*tables, *self.known_cases]))
        for number, case_id in enumerate(listed or ()):
            if case_id not in known:
                missing = f"neither a table [cases.{case_id}] nor a case of the paper"
                problem = f"no case {case_id!r}: {missing}; {advice(case_id, known)}"
                raise self.file.error(("study", "cases", number), problem)
        ids = tables if listed is None else listed
        for case_id in tables:
            if case_id not in ids:
                raise self.file.error(("cases", case_id), "is not among the cases of [study]")
        if ids:
            return tuple(map(self._read_case, dict.fromkeys(ids)))
        if ("environment", "id") in self.base:
            # A case without settings of its own: [base] has the environment.
            name = str(self.base["environment", "id"].value)
            return (StudyCase(name, name),)
        raise self.file.error(
            (),
            'no cases: give some of the paper\'s, [study] cases = ["s4", ...], tables [cases.ID]'
            ' of your own, or [base] environment = "a Gymnasium id"',
        )

    def _read_case(self, case_id: str) -> StudyCase:
        """Return the case of ``[cases.ID]``; those of the paper have fixed settings."""
        where: KeyPath = ("cases", case_id)
        table = dict(self.tables.cases.get(case_id, {}))
        known = self.known_cases.get(case_id, StudyCase(case_id, case_id))
        title = convert_value(str, table.pop("title", known.title), dotted((*where, "title")))
        settings, fixed = self._layer(where, table), known.settings
        for name, setting in settings.items():
            if name in fixed and setting.value != fixed[name].value:
                texts = (f"{'.'.join(key)} = {value}" for key, (value, _) in fixed.items())
                problem = f"is a case with {', '.join(texts)}: give another one another name"
                raise self.file.error(setting.where, f"{case_id} {problem}")
        return StudyCase(case_id, title, fixed | settings, where)

    def _read_variants(self, cases: Sequence[StudyCase]) -> tuple[StudyVariant, ...]:
        """Return the variants of ``[variants.NAME]``, then those of the axes."""
        variants: dict[str, StudyVariant] = {}
        known = [case.id for case in cases]
        for name, values in self.tables.variants.items():
            where, table = ("variants", name), dict(values)
            key_of_cases = dotted((*where, "cases"))
            tables = convert_value(dict[str, _Table], table.pop("cases", {}), key_of_cases)
            only = convert_value(tuple[str, ...], table.pop("only", ()), dotted((*where, "only")))
            for number, case_id in enumerate(only):
                if case_id not in known:
                    problem = f"no case {case_id!r}; {advice(case_id, known)}"
                    raise self.file.error((*where, "only", number), problem)
            check_names(tables, only or known, key_of_cases)
            in_cases = {
                case_id: self._layer((*where, "cases", case_id), table_of_case)
                for case_id, table_of_case in tables.items()
            }
            title = convert_value(str, table.pop("title", name), dotted((*where, "title")))
            settings = self._layer(where, table)
            variants[name] = StudyVariant(name, title, settings, where, in_cases, only)
        for variant in self._axis_variants():
            if variant.id in variants:
                problem = f"there is a variant {variant.id!r} already"
                raise self.file.error(variant.where, problem)
            variants[variant.id] = variant
        return tuple(variants.values()) or (StudyVariant(BASE, BASE),)

    def _axis_variants(self) -> Iterator[StudyVariant]:
        """Make the variants of the axes: the base and every value alone, or all combinations."""
        table = dict(self.tables.axes)
        ways = Literal["one_at_a_time", "product"]
        combine = convert_value(ways, table.pop("combine", "one_at_a_time"), "axes.combine")
        axes = self._layer(("axes",), table)
        if not axes:
            return
        n_axes_by_name = Counter(name[-1] for name in axes)
        values = [
            list(self._axis_values(axis, name, is_ambiguous=n_axes_by_name[name[-1]] > 1))
            for name, axis in axes.items()
        ]
        if combine == "product":
            if math.prod(map(len, values)) > MOST_COMBINATIONS:
                problem = f"must give at most {MOST_COMBINATIONS} combinations"
                raise self.file.error(("axes", "combine"), problem)
            for chosen in itertools.product(*values):
                layer = {name: setting for _, axis in chosen for name, setting in axis.items()}
                label = ", ".join(axis_label for axis_label, _ in chosen)
                yield StudyVariant(label, label, layer, ("axes",))
            return
        yield StudyVariant(BASE, BASE, {}, ("axes",))
        for label, layer in itertools.chain.from_iterable(values):
            (setting,) = layer.values()
            yield StudyVariant(label, label, layer, setting.where)

    def _axis_values(
        self, axis: Setting, name: tuple[str, ...], *, is_ambiguous: bool
    ) -> Iterator[tuple[str, Layer]]:
        """Yield a label, such as ``"discount=0.9"``, and the setting for each value of an axis.

        Where the last part of its name ``is_ambiguous``, labels have the whole name.
        """
        if not isinstance(axis.value, list) or not axis.value:
            raise self.file.error(axis.where, f"must be an array of values, got {axis.value!r}")
        path = name[:1] if name == ("agent", "name") else name  # "agent=..." is the usual name
        short_name = ".".join(path) if is_ambiguous else path[-1]
        texts = (v if isinstance(v, str) else json.dumps(v, default=str) for v in axis.value)
        labels = [f"{short_name}={text}" for text in texts]
        if len(set(labels)) < len(labels):
            raise self.file.error(axis.where, f"must be different values, got {axis.value!r}")
        for number, value in enumerate(axis.value):
            yield labels[number], {name: Setting(value, (*axis.where, number))}
