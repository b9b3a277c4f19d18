"""Lines of the keys of a TOML text; the standard library's reader gives values only."""

from __future__ import annotations

import re
import sys
from typing import TypeAlias

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

KeyPath: TypeAlias = tuple[str | int, ...]
"""Keys from the top of a document to a value; elements of arrays are numbers from 0."""

_BLANK = re.compile(r"(?:[ \t\r\n]|#[^\n]*)*")
_SPACE = re.compile(r"[ \t]*")
_STRING = re.compile(
    r'"""(?:\\.|[^\\])*?"""(?:"{0,2})'
    r"|'''.*?'''(?:'{0,2})"
    r'|"(?:\\.|[^"\\\n])*"'
    r"|'[^'\n]*'",
    re.DOTALL,
)
_BARE_KEY = re.compile(r"[^\s.=\[\]\"'#]+")
_BARE_VALUE = re.compile(r"[^,\]}\n#]+")


def key_lines(text: str) -> dict[KeyPath, int]:
    r"""Find the line, from 1, on which each key of a valid TOML document first stands.

    Parts of dotted keys and headers of tables count too, and elements of arrays.

    Examples
    --------
    >>> key_lines("[a]\nb.c = 1\nd = [\n  2,\n]")[("a", "b", "c")]
    2
    >>> key_lines("[a]\nb.c = 1\nd = [\n  2,\n]")[("a", "d", 0)]
    4
    """
    return _Scanner(text).lines


def line_of(lines: dict[KeyPath, int], path: KeyPath) -> int | None:
    """Return the line of a key, else that of the nearest table around it; None if there is none."""
    while path:
        if path in lines:
            return lines[path]
        path = path[:-1]
    return None


class _Scanner:
    """Walks once through a text that `tomllib` has accepted."""

    def __init__(self, text: str) -> None:
        self._text = text
        self._at = 0
        self.lines: dict[KeyPath, int] = {}
        table: KeyPath = ()
        while self._skip(_BLANK):
            if self._next() == "[":
                self._at += 1 + self._text.startswith("[[", self._at)
                table = self._key(())
                self._at = self._text.index("]", self._at)
                self._at += 1 + self._text.startswith("]]", self._at)
            else:
                self._pair(table)

    def _next(self) -> str:
        return self._text[self._at : self._at + 1]

    def _skip(self, pattern: re.Pattern[str]) -> bool:
        """Step over what matches here; whether text is left."""
        if found := pattern.match(self._text, self._at):
            self._at = found.end()
        return self._at < len(self._text)

    def _note(self, path: KeyPath) -> None:
        self.lines.setdefault(path, self._text.count("\n", 0, self._at) + 1)

    def _key(self, table: KeyPath) -> KeyPath:
        """Read a dotted key."""
        path = table
        while True:
            self._skip(_SPACE)
            pattern = _STRING if self._next() in ('"', "'") else _BARE_KEY
            found = pattern.match(self._text, self._at)
            if found is None:
                raise ValueError(f"no key at character {self._at}")
            word = found.group()
            path = (*path, tomllib.loads(f"key = {word}")["key"] if word[0] in "\"'" else word)
            self._note(path)
            self._at = found.end()
            self._skip(_SPACE)
            if self._next() != ".":
                return path
            self._at += 1

    def _pair(self, table: KeyPath) -> None:
        path = self._key(table)
        self._at += 1  # the equals sign
        self._value(path)

    def _value(self, path: KeyPath) -> None:
        self._skip(_SPACE)
        start = self._next()
        if start == "[":
            self._list("]", path)
        elif start == "{":
            self._list("}", path)
        else:
            self._skip(_STRING if start in ('"', "'") else _BARE_VALUE)

    def _list(self, end: str, path: KeyPath) -> None:
        """Read an array or an inline table to its end."""
        self._at += 1
        number = 0
        while self._skip(_BLANK) and self._next() != end:
            if end == "}":
                self._pair(path)
            else:
                self._note((*path, number))
                self._value((*path, number))
                number += 1
            self._skip(_BLANK)
            if self._next() == ",":
                self._at += 1
        self._at += 1
