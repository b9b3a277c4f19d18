"""Files of settings, in TOML or JSON: their values, and where each key is."""

from __future__ import annotations

import bisect
import json
import re
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

from sdnn.files import read_bytes
from sdnn.runs.errors import ConfigError

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

__all__ = ["ConfigFile", "KeyPath", "dotted"]

MOST_BYTES = 2**20
"""Of a file of settings."""

KeyPath: TypeAlias = tuple[str | int, ...]
"""Keys from the top of a document to a value; elements of arrays are numbers from 0."""


@dataclass(frozen=True)
class ConfigFile:
    """A file of settings.

    Parameters
    ----------
    path
        TOML if its name ends in ``.toml``, else JSON.
    text
        Its content.
    values
        The values in it.
    """

    path: Path
    text: str
    values: dict[str, Any]

    @classmethod
    def read(cls, path: str | Path) -> ConfigFile:
        """Read a file.

        Raises
        ------
        ConfigError
            If it cannot be read, or holds no table; file and line are named.
        """
        path = Path(path)
        is_toml = path.suffix == ".toml"
        try:
            text = read_bytes(path, MOST_BYTES).decode()
            values = tomllib.loads(text) if is_toml else json.loads(text)
        except RecursionError:
            raise ConfigError("", "must be nested less deeply", str(path)) from None
        except OSError as error:
            raise ConfigError("", error.strerror or str(error), str(path)) from error
        except ValueError as error:
            line = re.search(r"(?:at )?line (\d+)", str(error))
            place = f"{path}:{line[1]}" if line else str(path)
            kind = "TOML" if is_toml else "JSON"
            raise ConfigError("", f"must be {kind}: {error}", place) from error
        if not isinstance(values, dict):
            raise ConfigError("", f"must hold a table, got {values!r}", str(path))
        return cls(path, text, values)

    def place(self, key: KeyPath) -> str:
        """Return the file and, in TOML, the line of a key, or of the nearest table around it.

        It is the first line with which the file's beginning has the key.
        """
        lines = self.text.splitlines()
        while key and self.path.suffix == ".toml":
            found = bisect.bisect_left(
                range(len(lines)), True, key=lambda last: _begins(lines, last + 1, key)
            )
            if found < len(lines):
                return f"{self.path}:{found + 1}"
            key = key[:-1]
        return str(self.path)

    def error(self, key: KeyPath, problem: str) -> ConfigError:
        """Make the error that names file, line and key."""
        return ConfigError(dotted(key), problem, self.place(key))


def _begins(lines: list[str], n: int, key: KeyPath) -> bool:
    """Whether the first lines of a file, with the rest of their last value, have a key."""
    for last in range(n, len(lines) + 1):
        try:
            value = tomllib.loads("\n".join(lines[:last]))
        except tomllib.TOMLDecodeError:
            continue
        return _has(value, key)
    return True


def _has(value: Any, key: KeyPath) -> bool:
    for name in key:
        try:
            value = value[name]
        except (IndexError, KeyError, TypeError):
            return False
    return True


def dotted(key: KeyPath) -> str:
    """Write a key as TOML would.

    Examples
    --------
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
