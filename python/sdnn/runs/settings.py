"""Settings: declared once as fields of a class, checked wherever they come from."""

from __future__ import annotations

import dataclasses
import difflib
import functools
import math
import typing
from collections.abc import Iterable, Iterator, Mapping
from contextlib import contextmanager
from typing import Annotated, Any, Literal, TypeVar, get_args, get_origin

import msgspec
import numpy as np

from sdnn.config import Field, fields_of
from sdnn.runs.errors import ConfigError

__all__ = ["Settings", "changed", "checked", "kinds_of", "possible_words", "read", "values_of"]

AnySettings = TypeVar("AnySettings", bound="Settings")

_WORDS = {
    " | null": "",
    "`int`": "a whole number",
    "`float`": "a number",
    "`bool`": "true or false",
    "`str`": "a text",
    "`array`": "an array",
    "`object`": "a table",
    ">=": "of at least",
    "<=": "of at most",
    ">": "greater than",
    "<": "less than",
    "Expected ": "",
}


class Settings(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A table of settings: frozen, checked when it is made.

    A subclass declares each setting as a field: its type with bounds and a description, and its
    default. Constructor, files, command-line options, JSON Schema and the documentation follow.

    Raises
    ------
    ConfigError
        If a value is of another type or out of its range; ``key`` names the field.
    """

    def __post_init__(self) -> None:
        for name, kind in kinds_of(type(self)).items():
            value = getattr(self, name)
            with within(name):
                made = checked(kind, value)
            if made is not value:
                msgspec.structs.force_setattr(self, name, made)

    def replace(self: AnySettings, **changes: Any) -> AnySettings:
        """Return a copy with other values of some fields."""
        return msgspec.structs.replace(self, **changes)


def kinds_of(kind: Any) -> Mapping[str, Any]:
    """Return the types of the fields of a class of settings, with their bounds."""
    return _kinds_of(kind)


@functools.cache
def _kinds_of(kind: Any) -> Mapping[str, Any]:
    if fields := fields_of(kind):
        return {field.name: _kind_of(field) for field in fields}
    try:
        hints = typing.get_type_hints(kind, include_extras=True)
    except (NameError, TypeError):  # an agent from elsewhere: its values are taken as they are
        hints = {}
    if issubclass(kind, msgspec.Struct):
        return {name: hints.get(name, Any) for name in kind.__struct_fields__}
    return {one.name: hints.get(one.name, Any) for one in dataclasses.fields(kind) if one.init}


def _kind_of(field: Field) -> Any:
    """Return the type of a setting of the core; the core itself checks its bounds."""
    return Annotated[field.type, msgspec.Meta(description=field.doc)]


def checked(kind: Any, value: Any, key: str = "") -> Any:
    """Return a value as its type has it: arrays as tuples, 1 as 1.0.

    Raises
    ------
    ConfigError
        If it does not fit.
    """
    if isinstance(value, np.generic | np.ndarray):
        value = value.tolist()
    try:
        made = msgspec.convert(value, kind)
    except msgspec.ValidationError as error:
        text, _, path = str(error).partition(" - at `$")
        raise ConfigError((key + path[:-1]).lstrip("."), _problem(kind, text, value)) from None
    if isinstance(made, float) and not math.isfinite(made):
        raise ConfigError(key, f"must be finite, got {made}")
    return made


def _problem(kind: Any, text: str, value: Any) -> str:
    words = _literals(kind)
    if words:
        return f"must be one of {', '.join(map(repr, words))}, got {value!r}"
    expected = text.partition(", got")[0]
    for name, word in _WORDS.items():
        expected = expected.replace(name, word)
    given = "a table" if isinstance(value, Mapping) else repr(value)
    return f"must be {expected[:1].lower() + expected[1:]}, got {given}"


def _literals(kind: Any) -> tuple[Any, ...]:
    """Return the words that a type consists of, without None; none for other types."""
    if get_origin(kind) is Literal:
        return get_args(kind)
    return tuple(word for inner in get_args(kind) for word in _literals(inner))


def possible_words(word: str, possible: Iterable[str]) -> str:
    """List what is possible, the most similar to a word first.

    Examples
    --------
    >>> possible_words("discont", ("epsilon", "discount"))
    'possible: discount, epsilon'
    """
    known = tuple(possible)
    near = difflib.get_close_matches(word, known, n=3, cutoff=0.5)
    return "possible: " + (", ".join([*near, *(w for w in known if w not in near)]) or "none")


def table(values: Any, where: str) -> Mapping[str, Any]:
    """Check that a value is a table; ConfigError if it is none."""
    if not isinstance(values, Mapping):
        raise ConfigError(where, f"must be a table, got {values!r}")
    return values


def check_names(values: Any, possible: Iterable[str], where: str = "", hint: str = "") -> None:
    """Check that a table has no other keys than the possible ones.

    Raises
    ------
    ConfigError
        If it has, or is no table; the most similar possible keys come first.
    """
    known = tuple(possible)
    for name in table(values, where):
        if name not in known:
            words = possible_words(str(name), known)
            raise ConfigError(_path(where, name), f"unknown key; {words}{hint}")


def read(kind: type[AnySettings], values: Any, where: str = "") -> AnySettings:
    """Make settings of a table as JSON or TOML has it, with the tables in it.

    Parameters
    ----------
    kind
        The class.
    values
        The table; what is missing has its default.
    where
        The key of the table.

    Raises
    ------
    ConfigError
        If a key is unknown or missing, or a value does not fit.
    """
    kinds = kinds_of(kind)
    with within(where):
        check_names(values, kinds)
        for field in msgspec.structs.fields(kind):
            if field.required and field.name not in values:
                raise ConfigError(field.name, "must be given")
        return kind(**{name: _part(kinds[name], value, name) for name, value in values.items()})


def _part(kind: Any, value: Any, name: str) -> Any:
    """Return the value of a field: settings, where its type is a class of them."""
    inner = _settings_in(kind)
    if inner is None or value is None or isinstance(value, inner):
        return value
    return read(inner, value, name)


def changed(base: Any, values: Any, where: str, hint: str = "") -> Any:
    """Return settings with other values of some fields.

    Parameters
    ----------
    base
        Settings of an agent's part: those of the core, or a frozen dataclass.
    values
        A table of the changes.
    where
        Its key.
    hint
        What to say about unknown keys.

    Raises
    ------
    ConfigError
        If a key is unknown, follows from others, or a value does not fit.
    """
    kinds = kinds_of(type(base))
    if "n_inputs" in table(values, where):
        raise ConfigError(f"{where}.n_inputs", "follows from the observations: omit it")
    check_names(values, (name for name in kinds if name != "n_inputs"), where, hint)
    made = {name: checked(kinds[name], v, f"{where}.{name}") for name, v in values.items()}
    try:
        return dataclasses.replace(base, **made)
    except Exception as error:  # of whatever settings an agent has
        key = argument_of(error)
        raise ConfigError(
            f"{where}.{key}" if key in kinds else where, str(error) or type(error).__name__
        ) from error


def values_of(config: Any) -> dict[str, Any]:
    """Return the values of settings by their names, those of their parts as well."""
    made = {}
    for name in kinds_of(type(config)):
        value = getattr(config, name)
        is_part = dataclasses.is_dataclass(value) or isinstance(value, msgspec.Struct)
        made[name] = values_of(value) if is_part else msgspec.to_builtins(value)
    return made


def argument_of(error: BaseException) -> str:
    """Return the name of the argument that an error is about: else its message's first word."""
    name = getattr(error, "argument", None)
    return name if isinstance(name, str) else str(error).partition(" ")[0].partition("[")[0]


@contextmanager
def within(table: str) -> Iterator[None]:
    """Put the key of a table before the keys of errors about its values."""
    try:
        yield
    except ConfigError as error:
        raise ConfigError(_path(table, error.key), error.problem, error.place) from error


def _settings_in(kind: Any) -> type[Settings] | None:
    """Return the class of settings that a type is, or may be; None for other types."""
    if isinstance(kind, type):
        return kind if issubclass(kind, Settings) else None
    return next(filter(None, map(_settings_in, get_args(kind))), None)


def _path(table: str, name: str) -> str:
    return f"{table}{'.' * bool(table and name and name[0] != '[')}{name}"
