"""TOML and JSON from untrusted sources: parsing within limits, and the lines of keys."""

from __future__ import annotations

import bisect
import functools
import json
import operator
import re
from collections.abc import Iterator, Mapping
from contextlib import suppress
from typing import TypeAlias, cast

import msgspec

MOST_LEVELS = 32  # largest depth of nested tables and arrays; chosen
TOO_DEEP = f"must have at most {MOST_LEVELS} tables and arrays within each other"
_MOST_PARSED = 2**21  # characters that are parsed to find a line before the search is given up

KeyPath: TypeAlias = tuple[str | int, ...]
"""Keys from the top of a document to a value; elements of arrays are numbers from 0."""


def line_of(text: str, key: KeyPath) -> int | None:
    """Return the line, from 1, of a key in TOML, or of the nearest table around it.

    None if not even its table is there, or too much would have to be parsed. The parser reports no
    positions. So the result is the smallest number of lines that, parsed alone, contain the key. A
    binary search finds it: once the key is there, more lines leave it there.
    """
    lines = text.splitlines()
    n_left = _MOST_PARSED

    def has_key(last: int) -> bool:
        """Return whether the lines up to index ``last`` have the key.

        Where they end within a value, such as a list of several lines, its other lines are added.
        """
        nonlocal n_left
        for end in range(last + 1, len(lines) + 1):
            beginning = "\n".join(lines[:end])
            n_left -= len(beginning)
            if n_left < 0:
                raise OverflowError  # ends the search, below
            try:
                functools.reduce(operator.getitem, key, msgspec.toml.decode(beginning))
                return True
            except msgspec.DecodeError:
                continue
            except (IndexError, KeyError, TypeError):
                return False
        return True

    with suppress(OverflowError):
        while key:
            index = bisect.bisect_left(range(len(lines)), True, key=has_key)
            if index < len(lines):
                return index + 1
            key = key[:-1]  # look for the table around it
    return None


def parse_toml(text: str) -> dict[str, object]:
    """Parse TOML; ValueError for keys of many parts, whose parsing takes quadratic time.

    Every key lies between two of the characters at which the text is split.
    """
    for piece in re.split(r"[={},\n]", text):
        if piece.count(".") > MOST_LEVELS:
            raise ValueError(f"a key must have at most {MOST_LEVELS} parts, got {piece[:40]!r}...")
    values: dict[str, object] = msgspec.toml.decode(text)
    return values


def deep_key(value: object, key: KeyPath = ()) -> KeyPath | None:
    """Return the key of a table or array nested deeper than `MOST_LEVELS`, or None."""
    if len(key) == MOST_LEVELS:
        return key
    items = value.items() if isinstance(value, dict) else enumerate(cast("list[object]", value))
    for name, item in items:
        if isinstance(item, dict | list) and (deep := deep_key(item, (*key, name))):
            return deep
    return None


def leaves(table: Mapping[str, object], prefix: str = "") -> Iterator[tuple[str, object]]:
    """Yield (dotted key, value) of a table and the tables in it; empty tables are values.

    >>> dict(leaves({"agent": {"name": "rbf", "angles": {}}, "seed": 1}))
    {'agent.name': 'rbf', 'agent.angles': {}, 'seed': 1}
    """
    for name, value in table.items():
        if isinstance(value, Mapping) and value:
            yield from leaves(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value


def dotted(key: KeyPath) -> str:
    """Write a key as TOML would.

    >>> dotted(("axes", "learning.tie_rule", 1))
    'axes."learning.tie_rule"[1]'
    """
    text = ""
    for name in key:
        if isinstance(name, int):
            text += f"[{name}]"
        else:
            bare = name.replace("-", "").replace("_", "").isalnum() and name.isascii()
            text += ("." if text else "") + (name if bare else json.dumps(name))
    return text
