"""Settings: declared once as fields of a class, checked wherever they come from."""

from __future__ import annotations

import copy
import dataclasses
import functools
import math
import types
import typing
from collections.abc import Collection, Iterable, Mapping
from typing import Annotated, Any, Literal, Protocol, TypeAlias, TypeVar, get_args, get_origin

import msgspec
import numpy as np
from msgspec import Meta

from sdnn.agents.registry import AGENTS
from sdnn.config import WARM_UP, ProtocolConfig, fields_of
from sdnn.runs.errors import ConfigError, UnknownKeyError
from sdnn.support.arguments import blamed, shown
from sdnn.support.habits import advice

Values: TypeAlias = dict[str, Any]
"""A table as JSON and TOML have it."""

AnySettings = TypeVar("AnySettings", bound="Settings")
AnyPart = TypeVar("AnyPart", bound="PartSettings")

DEFAULT_AGENT = "q-lambda"

SHORTHANDS = {"environment": "id", "agent": "name"}
"""Tables that may be given as the value of one of their keys."""

_WORDS = {
    " | null": "",
    "`int`": "a whole number",
    "`float`": "a number",
    "`bool`": "true or false",
    "`str`": "a text",
    "`array`": "an array",
    "`object`": "a table",
    "of length >= 1": "that is not empty",
    ">=": "of at least",
    "<=": "of at most",
    ">": "greater than",
    "<": "less than",
    "Expected ": "",
}
"""Replacements for type names in msgspec's messages, made in this order: ">=" before ">"."""


class PartSettings(Protocol):
    """The settings of a part of an agent: a frozen dataclass, or a class of the core."""

    __dataclass_fields__: typing.ClassVar[dict[str, dataclasses.Field[Any]]]


@dataclasses.dataclass(frozen=True)
class PresetSettings:
    """Placeholder for the settings of an agent's preset."""


def doc(text: str) -> Meta:
    """Return the annotation of a setting that describes it."""
    return Meta(description=text)


class Settings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A table of settings: frozen, checked when it is made.

    A subclass declares each setting as a field: its type with bounds and `doc`, and its default.
    Constructor, files, command-line options, JSON Schema and the documentation follow.
    Tables in it may be given as settings or as mappings. A `ConfigError`, whose ``key`` names the
    field, says that a value is of another type or out of its range.
    """

    def __post_init__(self) -> None:
        """Check the value of each field, and convert it to the field's type."""
        for name, field_type in _types_of_fields(type(self)).items():
            value = getattr(self, name)
            converted = convert_value(field_type, value, name)
            if converted is not value:
                msgspec.structs.force_setattr(self, name, converted)

    def replace(self: AnySettings, **changes: object) -> AnySettings:
        """Return a copy with other values of some fields, which are checked."""
        return type(self)(**{**msgspec.structs.asdict(self), **changes})


@functools.cache
def _types_of_fields(settings_class: type[object]) -> Mapping[str, Any]:
    """Return the annotation of each field of a table of settings."""
    try:
        hints = typing.get_type_hints(settings_class, include_extras=True)
    except (NameError, TypeError):  # annotations of a user's agent: accept any value
        hints = {}
    return {name: hints.get(name, Any) for name in names_of(settings_class)}


def schemas_of(*classes: object) -> Values:
    """Return JSON Schemas of classes and nested ones, by name. `PartSettings` are any tables."""
    _, schemas = msgspec.json.schema_components(
        classes, ref_template="#/$defs/{name}", schema_hook=lambda _: {"type": "object"}
    )
    return schemas


def names_of(settings_class: type[Any]) -> tuple[str, ...]:
    """Return the names of the fields of a class of settings, or of another dataclass."""
    if issubclass(settings_class, msgspec.Struct):
        return settings_class.__struct_fields__
    return tuple(field.name for field in dataclasses.fields(settings_class) if field.init)


def convert_value(value_type: object, value: object, key: str) -> Any:
    """Convert a value to a type: arrays to tuples, 1 to 1.0, tables to settings.

    ConfigError if that is impossible.
    """
    if _alternatives(value_type) == (PartSettings,):
        return value  # the agent decides about the type: see `with_changes`
    if isinstance(value, np.generic | np.ndarray):
        if isinstance(value, np.ma.MaskedArray) or value.dtype.kind not in "biufU":
            raise ConfigError(key, f"must be numbers or texts, got {shown(value)}")
        value = value.tolist()
    if isinstance(value, Mapping):
        for form in _alternatives(value_type):
            if isinstance(form, type) and issubclass(form, Settings):
                return read_table(form, value, key)
            if get_origin(form) is dict:  # an error of an item names its key
                for name, item in value.items():
                    convert_value(get_args(form)[1], item, f"{key}.{name}")
    try:
        converted = msgspec.convert(value, value_type)
    except (msgspec.ValidationError, UnicodeEncodeError) as error:  # a command line has any bytes
        text, _, path = str(error).partition(" - at `$")
        problem = _expected_value(_alternatives(value_type) if not path else (), text)
        raise ConfigError(key + path[:-1], f"{problem}, got {shown(value)}") from None
    if isinstance(converted, float) and not math.isfinite(converted):
        raise ConfigError(key, f"must be finite, got {converted}")
    return converted


def _alternatives(value_type: object) -> tuple[object, ...]:
    """Return the members of a union, or the type itself, without `Annotated`."""
    origin, inner = get_origin(value_type), get_args(value_type)
    if origin is Annotated:
        return _alternatives(inner[0])
    if origin in (typing.Union, types.UnionType):
        return tuple(form for part in inner for form in _alternatives(part))
    return (value_type,)


def _expected_value(possible: Iterable[object], text: str) -> str:
    """Return "must be ..." for one of the possible types, from the text of msgspec's error."""
    literals = [form for form in possible if get_origin(form) is Literal]
    if literals:  # msgspec does not list them
        choices = ", ".join(repr(word) for literal in literals for word in get_args(literal))
        or_array = " or an array" if any(get_origin(form) is tuple for form in possible) else ""
        return f"must be one of {choices}{or_array}"
    expected = text.partition(", got")[0].replace("Object missing required field", "a table with")
    for name, word in _WORDS.items():
        expected = expected.replace(name, word)
    return f"must be {expected[:1].lower() + expected[1:]}"


def check_names(
    values: object, possible: Iterable[str], where: str = "", hint: str = ""
) -> Mapping[str, Any]:
    """Check that a table has only possible keys, and return it; ConfigError if not."""
    if not isinstance(values, Mapping):
        raise ConfigError(where, f"must be a table, got {shown(values)}")
    known = tuple(possible)
    for name in values:
        if name not in known:
            path = _path(where, str(name))
            # Do not suggest the unknown key itself: other agents may have it.
            others = {last: key for last, key in KEYS_BY_NAME.items() if not path.endswith(key)}
            raise UnknownKeyError(path, f"unknown key; {advice(str(name), known, others)}{hint}")
    return values


def read_table(settings_class: type[AnySettings], values: object, where: str = "") -> AnySettings:
    """Make settings from a table of JSON or TOML, including its nested tables.

    Missing keys have their defaults; ``where`` is the table's key. ConfigError if a key is unknown
    or missing, or a value does not fit.
    """
    values = check_names(values, settings_class.__struct_fields__, where)
    try:
        for field in msgspec.structs.fields(settings_class):
            if field.required and field.name not in values:
                raise ConfigError(field.name, "must be given")
        return settings_class(**values)
    except ConfigError as error:
        raise type(error)(_path(where, error.key), error.problem, error.place) from error


def with_changes(base: AnyPart, values: object, where: str, hint: str = "") -> AnyPart:
    """Return settings of an agent's part with the values of a table replaced.

    ``where`` is the table's key. ``base`` is of a class of the core, which checks its values, or a
    frozen dataclass. ``values`` of its class are returned unchanged. ConfigError if a key is
    unknown, follows from others, or a value does not fit; ``hint`` is added for unknown keys.
    """
    if isinstance(values, type(base)):
        return values
    if not isinstance(values, Mapping):
        expected = f"must be a table or {type(base).__name__}{hint}"
        raise ConfigError(where, f"{expected}, got {shown(values)}")
    names = names_of(type(base))
    if "n_inputs" in values:
        raise ConfigError(f"{where}.n_inputs", "follows from the observations: omit it")
    values = check_names(values, [name for name in names if name != "n_inputs"], where, hint)
    if not fields_of(type(base)):  # a dataclass, which does not check its values
        types_by_name = _types_of_fields(base.__class__)
        values = {
            name: convert_value(types_by_name[name], value, f"{where}.{name}")
            for name, value in values.items()
        }
    try:
        return dataclasses.replace(base, **values)
    except Exception as error:  # settings of a user's agent may raise anything
        name, problem = blamed(error)
        raise ConfigError(f"{where}.{name}" if name in names else where, problem) from error


def differences(
    values: Mapping[str, object], defaults: Mapping[str, object], always: Collection[str] = ()
) -> Values:
    """Return the values that differ from the default, also in tables, and names in ``always``.

    >>> differences({"a": 1, "b": {"c": 2, "d": 3}}, {"a": 1, "b": {"c": 2, "d": 4}})
    {'b': {'d': 3}}
    """
    changes: Values = {}
    for name, value in values.items():
        default = defaults.get(name)
        if isinstance(value, Mapping) and isinstance(default, Mapping):
            if table := differences(value, default, always):
                changes[name] = table
        elif name in always or value != default:
            changes[name] = value
    return changes


def with_n_inputs(approximator: PartSettings, n_inputs: int) -> PartSettings:
    """Return the settings of an approximator with ``n_inputs`` replaced, if it has that field."""
    if "n_inputs" not in names_of(type(approximator)):
        return approximator
    return dataclasses.replace(approximator, n_inputs=n_inputs)


def _path(table: str, name: str) -> str:
    """Join the key of a table and a name, or an index such as "[0]"; either may be empty."""
    return f"{table}.{name}" if table and name and name[0] != "[" else table + name


# The tables of a specification but those of the core and the environment.

Count = Annotated[int, Meta(ge=1, le=2**53)]
Index = Annotated[int, Meta(ge=0)]

_CORE = {field.name: field for field in fields_of(ProtocolConfig)}


class AgentSpec(Settings, frozen=True):
    """Agent that learns."""

    name: Annotated[
        str | None,
        doc(
            "The agent: `q-lambda`, `actor-critic`, `sdnn-c`, `rbf`, `fuzzy`, or one that was"
            " registered. By default `q-lambda`."
        ),
    ] = None
    preset: Annotated[
        str | None,
        doc(
            "Named settings: `general`, the default, or `paper`; of `sdnn-c` also `robust` or"
            " `small`. `rbf` and `fuzzy` have none."
        ),
    ] = None
    observation_range: Annotated[
        Literal["adaptive", "running"] | None,
        doc(
            "`adaptive`: ranges of the observed variables come from a warm-up; `running`: they"
            " follow what is observed, the default of `actor-critic`."
        ),
    ] = None
    angles: Annotated[
        tuple[Index, ...],
        doc("Observed variables, from 0, that are angles: their ranges wrap around."),
    ] = ()
    angle_pairs: Annotated[
        Literal["none", "find"] | tuple[tuple[Index, Index], ...] | None,
        doc(
            "Which cosines and sines of an angle become one input: pairs of observed "
            "variables, from 0 (`--set agent.angle_pairs=[[0,1]]`), or those that the warm-up "
            "finds. By default `none`; of "
            "`q-lambda`, `find`, unless observations are scaled."
        ),
    ] = None
    inputs: Annotated[
        Literal["all", "relevant"] | tuple[Index, ...] | None,
        doc(
            "Which observed variables are inputs: `all`; those that the warm-up finds "
            "`relevant`; or a list, from 0, of some that are inputs in any case, beside the "
            "relevant ones (`--set agent.inputs=[0,1]`). By default `all`; of `q-lambda`, "
            "`relevant`."
        ),
    ] = None
    warm_up_steps: Annotated[
        int, Meta(ge=int(WARM_UP.low), le=int(WARM_UP.high)), doc(WARM_UP.doc)
    ] = WARM_UP.default
    missing: Annotated[
        Literal["error", "hold", "code"],
        doc(
            "Readings that are NaN, infinite or masked: `error` refuses them, `hold` uses the "
            "variable's last reading, `code` has a pattern for them in each input (`q-lambda`, "
            "`actor-critic` and `sdnn-c`)."
        ),
    ] = "error"
    history: Annotated[
        Literal["none", "differences", "averages", "observer", "auto"] | None,
        doc(
            "What states have of earlier observations: `none`; `differences` from the last one, "
            "for tasks whose observations lack velocities; running `averages`; estimates of an "
            "`observer` in place of the inputs, for noisy sensors; `auto`, what a warm-up finds, "
            "the default of `q-lambda` and `actor-critic`. By default `none` in others."
        ),
    ] = None


class ProtocolSpec(Settings, frozen=True):
    """Schedule of learning and evaluation."""

    n_envs: Annotated[
        int,
        Meta(ge=1, le=4096),
        doc("Environments to learn in, in turn; steps are counted over all."),
    ] = 1
    evaluate_every: Annotated[
        Annotated[int, Meta(ge=0, le=2**53)] | None,
        doc(
            "Steps between evaluations; 0: none. By default 10,000, or none if "
            "`evaluate_every_episodes` is given."
        ),
    ] = None
    evaluate_every_episodes: Annotated[
        Count | None, doc("Learning episodes between evaluations, instead of steps.")
    ] = None
    evaluation_episodes: Annotated[
        int, Meta(ge=1, le=10**9), doc("Greedy episodes in each evaluation.")
    ] = 10
    seeded_episodes: Annotated[
        bool,
        doc(
            "Whether each episode's reset has a seed of its own. If not, only the first has one,"
            " and random streams run on from episode to episode, as in the paper."
        ),
    ] = True
    limit_bootstraps: Annotated[bool, doc(_CORE["limit_bootstraps"].doc)] = _CORE[
        "limit_bootstraps"
    ].default
    noisy_evaluations: Annotated[bool, doc(_CORE["noisy_evaluations"].doc)] = _CORE[
        "noisy_evaluations"
    ].default

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.evaluate_every is not None and self.evaluate_every_episodes is not None:
            problem = "must not be given together with evaluate_every"
            raise ConfigError("evaluate_every_episodes", problem)


class BudgetSpec(Settings, frozen=True):
    """Length of the learning."""

    steps: Annotated[
        Count | None, doc("Steps to learn. By default 200,000, or none if `episodes` is given.")
    ] = None
    episodes: Annotated[
        Annotated[int, Meta(ge=1, le=2**30)] | None, doc("Episodes to learn, instead of steps.")
    ] = None
    target_return: Annotated[float | None, doc("Stop when an evaluation has this mean return.")] = (
        None
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.steps is not None and self.episodes is not None:
            raise ConfigError("episodes", "must not be given together with steps")


class OutputSpec(Settings, frozen=True):
    """Output besides the rows; it changes none of them."""

    checkpoint_every: Annotated[Count, doc("Steps between checkpoints.")] = 10_000
    keep_best: Annotated[
        bool, doc("Keep the agent of the best evaluation, as ``best.safetensors``.")
    ] = False
    tensorboard: Annotated[bool, doc("Write the numbers for TensorBoard, too.")] = False


_TABLES: dict[str, tuple[type[object], ...]] = {
    "approximator": tuple(entry.approximator for entry in AGENTS.values()),
    "learning": tuple(entry.learning for entry in AGENTS.values()),
    "agent": (AgentSpec,), "protocol": (ProtocolSpec,), "budget": (BudgetSpec,),
    "output": (OutputSpec,),
}  # fmt: skip

KEYS_BY_NAME = {"environment": "environment", "agent": "agent", "seed": "seed"} | {
    name: f"{table}.{name}"
    for table, classes in _TABLES.items()
    for settings_class in classes
    for name in names_of(settings_class)
}
"""The keys of a specification, with dots between tables, by their last part."""

_REPLACED = {
    "budget.steps": "budget.episodes",
    "budget.episodes": "budget.steps",
    "protocol.evaluate_every": "protocol.evaluate_every_episodes",
    "protocol.evaluate_every_episodes": "protocol.evaluate_every",
    "agent.name": "agent.preset",
}
"""The key of a file, by the key of the option that removes it, since the two conflict."""


def overridden(values: Mapping[str, object], options: Mapping[str, object]) -> Values:
    """Return the values of a file with those of options, by dotted keys, in their place."""
    settings: Values = copy.deepcopy(dict(values))
    for name, key in SHORTHANDS.items():
        if isinstance(settings.get(name), str):
            settings[name] = {key: settings[name]}
    for key in options:  # remove keys of the file that conflict with an option
        table, _, name = _REPLACED.get(key, "").partition(".")
        if isinstance(settings.get(table), dict):
            settings[table].pop(name, None)
    for key, value in options.items():
        *parents, last = key.split(".")
        inner = settings
        for parent in parents:
            if not isinstance(inner.get(parent), dict):
                inner[parent] = {}
            inner = inner[parent]
        inner[last] = value
    return settings
