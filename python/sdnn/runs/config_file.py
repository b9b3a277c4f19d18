"""Files of settings, in TOML or JSON: their values, and where each key is."""

from __future__ import annotations

import bisect
import json
import re
from collections.abc import Collection
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeAlias

import msgspec

from sdnn.files import read_bytes
from sdnn.runs.errors import ConfigError
from sdnn.runs.spec import RunSpec

FORMAT = "sdnn-run-2"
"""Format of the configuration in a run's folder."""

MOST_BYTES = 2**20
"""Largest file of settings."""
MOST_LEVELS = 32
"""Most levels of tables and arrays within each other."""
_TOO_DEEP = f"must have at most {MOST_LEVELS} tables and arrays within each other"
_MOST_PARSED = 2**21
"""Bytes that are parsed to find a line; in larger files errors name no line."""


KeyPath: TypeAlias = tuple[str | int, ...]
"""Keys from the top of a document to a value; elements of arrays are numbers from 0."""


@dataclass(frozen=True)
class ConfigFile:
    """A file of settings, in TOML or JSON by its name's ending: its text, and the values in it."""

    path: Path
    text: str
    values: dict[str, Any]

    @classmethod
    def read(cls, path: str | Path) -> ConfigFile:
        """Read a file; ConfigError that names it, and the line, if it holds no table."""
        path = Path(path)
        if path.suffix not in (".toml", ".json"):
            raise ConfigError("", "must be a file whose name ends in .toml or .json", str(path))
        is_toml = path.suffix == ".toml"
        try:
            text = read_bytes(path, MOST_BYTES).decode()
            values = _parsed_toml(text) if is_toml else json.loads(text)
        except RecursionError:
            raise ConfigError("", _TOO_DEEP, str(path)) from None
        except OSError as error:
            raise ConfigError("", error.strerror or str(error), str(path)) from error
        except (ValueError, msgspec.DecodeError) as error:
            line = re.search(r"(?:at )?line (\d+)", str(error))
            place = f"{path}:{line[1]}" if line else str(path)
            kind = "TOML" if is_toml else "JSON"
            raise ConfigError("", f"must be {kind}: {error}", place) from error
        if not isinstance(values, dict):
            raise ConfigError("", f"must hold a table, got {values!r:.80}", str(path))
        if deep := _deep_key(values):
            raise ConfigError(dotted(deep[:3]), _TOO_DEEP, str(path))
        return cls(path, text, values)

    def specification(self) -> dict[str, Any]:
        """Return the values of a specification: all but what only a run's configuration has.

        ConfigError if it is the configuration of a run of another format.
        """
        if (found := self.values.get("format", FORMAT)) != FORMAT:
            raise ConfigError("format", f"must be {FORMAT}, got {found!r}: begin a new run")
        others = ("format", "version", "goals")
        return {name: value for name, value in self.values.items() if name not in others}

    def located(self, error: ConfigError, options: Collection[str] = ()) -> ConfigError:
        """Add file and line to an error, unless it is about one of the options, given by keys."""
        key = tuple(error.key.partition("[")[0].split("."))
        for name in (error.key, key[0] if key[0] not in self.values else error.key):
            if any(f"{name}.".startswith(f"{o}.") or o.startswith(f"{name}.") for o in options):
                return error
        return error if error.place else ConfigError(error.key, error.problem, self.place(key))

    def place(self, key: KeyPath) -> str:
        """Return the file and, in TOML, the line of a key, or of the nearest table around it.

        It is the first line with which the file's beginning has the key.
        """
        lines = self.text.splitlines()
        n_left = _MOST_PARSED

        def begins(last: int) -> bool:
            """Return whether the first lines, with the rest of their last value, have the key."""
            nonlocal n_left
            for end in range(last + 1, len(lines) + 1):
                text = "\n".join(lines[:end])
                n_left -= len(text)
                if n_left < 0:
                    raise OverflowError
                with suppress(msgspec.DecodeError):
                    return _has(msgspec.toml.decode(text), key)
            return True

        with suppress(OverflowError):
            while key and self.path.suffix == ".toml":
                found = bisect.bisect_left(range(len(lines)), True, key=begins)
                if found < len(lines):
                    return f"{self.path}:{found + 1}"
                key = key[:-1]
        return str(self.path)

    def error(self, key: KeyPath, problem: str) -> ConfigError:
        """Make the error that names file, line and key."""
        return ConfigError(dotted(key), problem, self.place(key))


def read_spec(path: str | Path) -> RunSpec:
    """Read a specification from a TOML or JSON file.

    ConfigError that names file, line (of TOML) and key if something is unknown or impossible.
    """
    file = ConfigFile.read(path)
    try:
        return RunSpec.from_values(file.specification())
    except ConfigError as error:
        raise file.located(error) from error


def _parsed_toml(text: str) -> dict[str, Any]:
    """Parse TOML; ValueError for a key of many parts, which would take time without end."""
    for part in re.split(r"[={},\n]", text):
        if part.count(".") > MOST_LEVELS:
            raise ValueError(f"a key must have at most {MOST_LEVELS} parts, got {part[:40]!r}...")
    values: dict[str, Any] = msgspec.toml.decode(text)
    return values


def _deep_key(values: dict[str, Any]) -> KeyPath | None:
    """Return the key of a value that is too deep, if there is one."""
    level: list[tuple[KeyPath, Any]] = [((), values)]
    for _ in range(MOST_LEVELS):
        items = (
            (key, value.items() if isinstance(value, dict) else enumerate(value))
            for key, value in level
        )
        level = [
            ((*key, name), inner)
            for key, pairs in items
            for name, inner in pairs
            if isinstance(inner, dict | list)
        ]
    return level[0][0] if level else None


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
