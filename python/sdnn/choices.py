"""Words of a configuration as members of the core's enumerations."""

from __future__ import annotations

from typing import TypeVar

__all__ = ["choice"]

Member = TypeVar("Member")


def choice(members: dict[str, Member], name: str, word: str) -> Member:
    """Find the member called ``word``; ValueError naming the argument and the words if none is.

    >>> choice({"up": 1, "down": -1}, "direction", "left")
    Traceback (most recent call last):
    ValueError: direction must be one of 'up', 'down', got 'left'
    """
    try:
        return members[word]
    except (KeyError, TypeError):
        words = ", ".join(repr(member) for member in members)
        raise ValueError(f"{name} must be one of {words}, got {word!r}") from None
