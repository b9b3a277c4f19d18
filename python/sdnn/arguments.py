"""Checks of arguments: each message names the argument, what it must be, and what came."""

from __future__ import annotations

import os
from collections.abc import Mapping
from numbers import Integral, Real
from pathlib import Path
from typing import Any, TypeVar

__all__ = ["choice", "flag", "has_methods", "one_of", "path_of", "real", "seed_of", "whole"]

Member = TypeVar("Member")


def choice(name: str, word: Any, members: Mapping[str, Member]) -> Member:
    """Find the member called ``word``; ValueError if none is.

    >>> choice("direction", "left", {"up": 1, "down": -1})
    Traceback (most recent call last):
    ValueError: direction must be one of 'up', 'down', got 'left'
    """
    try:
        return members[word]
    except (KeyError, TypeError):
        words = ", ".join(repr(member) for member in members)
        raise ValueError(f"{name} must be one of {words}, got {word!r}") from None


def one_of(name: str, word: Any, words: tuple[str, ...]) -> str:
    """Check that an argument is one of some words; ValueError if not.

    >>> one_of("direction", "up", ("up", "down"))
    'up'
    """
    return choice(name, word, {member: member for member in words})


def whole(name: str, value: Any, low: int, high: int) -> int:
    """Check that an argument is a whole number within bounds; ValueError if not.

    >>> whole("n_bins", 1, 2, 65535)
    Traceback (most recent call last):
    ValueError: n_bins must be a whole number in [2, 65535], got 1
    """
    is_whole = isinstance(value, Integral) and not isinstance(value, bool)
    if not is_whole or not low <= value <= high:
        raise ValueError(f"{name} must be a whole number in [{low}, {high}], got {value!r}")
    return int(value)


def seed_of(value: Any) -> int:
    """Check that a seed is one that the core takes, in [0, 2**64); ValueError if not."""
    return whole("seed", value, 0, 2**64 - 1)


def real(name: str, value: Any) -> float:
    """Check that an argument is a number, perhaps NaN or infinite; ValueError if not.

    >>> real("period", "a day")
    Traceback (most recent call last):
    ValueError: period must be a number, got 'a day'
    """
    if type(value) is float:
        return value
    if not isinstance(value, Real) or isinstance(value, bool):
        raise ValueError(f"{name} must be a number, got {value!r}")
    try:
        return float(value)
    except OverflowError:
        raise OverflowError(f"{name} must be a number of less than 1.8e308, got more") from None


def flag(name: str, value: Any) -> bool:
    """Check that an argument is true or false, NumPy's too; TypeError if not.

    >>> flag("explore", "no")
    Traceback (most recent call last):
    TypeError: explore must be True or False, got 'no'
    """
    if value is True or value is False:
        return bool(value)
    kind = getattr(getattr(value, "dtype", None), "kind", "")
    if kind != "b" or value.size != 1:
        raise TypeError(f"{name} must be True or False, got {value!r}")
    return bool(value)


def path_of(name: str, value: Any) -> Path:
    """Check that an argument can name a file; TypeError or ValueError if not.

    >>> path_of("path", None)
    Traceback (most recent call last):
    TypeError: path must be the name of a file, got None
    """
    if not isinstance(value, str | os.PathLike):
        raise TypeError(f"{name} must be the name of a file, got {value!r}")
    text = os.fspath(value)
    if not isinstance(text, str) or not text or "\0" in text:
        raise ValueError(f"{name} must be the name of a file, got {value!r}")
    return Path(text)


def has_methods(name: str, value: Any, what: str, *methods: str) -> None:
    """Check that an argument has some methods; TypeError if not.

    >>> has_methods("env", 5, "a Gymnasium environment", "reset", "step")
    Traceback (most recent call last):
    TypeError: env must be a Gymnasium environment, got 5
    """
    is_object = not isinstance(value, type)
    if not (is_object and all(callable(getattr(value, method, None)) for method in methods)):
        raise TypeError(f"{name} must be {what}, got {value!r}")
