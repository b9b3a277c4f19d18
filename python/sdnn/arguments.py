"""Checks of arguments: each message names the argument, what it must be, and what came."""

from __future__ import annotations

from collections.abc import Mapping
from numbers import Integral, Real
from typing import Any, TypeVar

__all__ = ["choice", "one_of", "real", "seed_of", "whole"]

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
    if not isinstance(value, Real) or isinstance(value, bool):
        raise ValueError(f"{name} must be a number, got {value!r}")
    return float(value)
