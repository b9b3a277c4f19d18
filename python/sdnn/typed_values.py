"""Values as files and command lines have them, converted to the types of configurations."""

from __future__ import annotations

import difflib
import math
import types
from collections.abc import Iterable, Mapping
from typing import Any, Literal, Union, get_args, get_origin, get_type_hints

__all__ = ["convert", "hints_of", "possible_words", "words_of"]


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


def hints_of(kind: type[Any]) -> dict[str, Any]:
    """Give the types of a dataclass's fields; empty if they cannot be found."""
    try:
        return get_type_hints(kind)
    except (NameError, TypeError):
        return {}  # an agent from elsewhere: its values are taken as they are


def convert(kind: Any, value: Any) -> Any:
    """Convert a value of TOML to a type as configurations have: arrays to tuples, 1 to 1.0.

    Parameters
    ----------
    kind
        A type: bool, int, float, str, a Literal, a tuple, a mapping, or a union of these.
    value
        What TOML has.

    Raises
    ------
    ValueError
        If it does not fit; the message says what would.

    Examples
    --------
    >>> convert(tuple[bool, ...], [True, False])
    (True, False)
    """
    origin, inner = get_origin(kind), get_args(kind)
    if origin is Literal:
        if isinstance(value, str | int) and value in inner:
            return value
        words = ", ".join(map(repr, inner))
        raise ValueError(f"must be one of {words}, got {words_of(value)}")
    if origin in (Union, types.UnionType):
        return _convert_to_one_of(tuple(k for k in inner if k is not type(None)), value)
    if kind is float and isinstance(value, int | float) and not isinstance(value, bool):
        if not math.isfinite(value):
            raise ValueError(f"must be a finite number, got {value}")
        return float(value)
    if kind is int and isinstance(value, int) and not isinstance(value, bool):
        return value
    if kind in (bool, str) and isinstance(value, kind):
        return value
    if (origin or kind) is tuple and isinstance(value, list):
        return _convert_array(inner, value)
    if isinstance(origin or kind, type) and issubclass(origin or kind, Mapping):
        if isinstance(value, dict):
            return value
    elif kind not in (float, int, bool, str) and (origin or kind) is not tuple:
        return tuple(value) if isinstance(value, list) else value  # any type
    raise ValueError(f"must be {_type_words(kind)}, got {words_of(value)}")


def _convert_to_one_of(kinds: tuple[Any, ...], value: Any) -> Any:
    messages = []
    for kind in kinds:
        try:
            return convert(kind, value)
        except ValueError as error:
            messages.append(str(error))
    raise ValueError(" or ".join(dict.fromkeys(messages)))


def _convert_array(kinds: tuple[Any, ...], value: list[Any]) -> tuple[Any, ...]:
    if not kinds:
        return tuple(value)
    if len(kinds) == 2 and kinds[1] is Ellipsis:
        kinds = kinds[:1] * len(value)
    if len(kinds) != len(value):
        raise ValueError(f"must be an array of {len(kinds)}, got {len(value)}")
    converted = []
    for number, (kind, item) in enumerate(zip(kinds, value, strict=True)):
        try:
            converted.append(convert(kind, item))
        except ValueError as error:
            raise ValueError(f"number {number + 1} of the array {error}") from error
    return tuple(converted)


def _type_words(kind: Any) -> str:
    words = {bool: "true or false", int: "a whole number", float: "a number", str: "a text"}
    if kind in words:
        return words[kind]
    if (get_origin(kind) or kind) is tuple:
        inner = get_args(kind)
        return f"an array, each {_type_words(inner[0])}" if inner else "an array"
    return "a table"


def words_of(value: Any) -> str:
    """Write a value of TOML for a reader."""
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "a table"
    return repr(value)
