"""Files of settings, in TOML or JSON: their values, and where each key is."""

from __future__ import annotations

import json
import re
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path

import msgspec

from sdnn.runs.errors import ConfigError
from sdnn.runs.settings import Values
from sdnn.runs.spec import RunSpec
from sdnn.support.files import read_bytes
from sdnn.support.toml import TOO_DEEP, KeyPath, deep_key, dotted, line_of, parse_toml

FORMAT = "sdnn-run-2"
"""Format of the configuration in a run's folder."""

MOST_BYTES = 2**20
"""Largest file of settings."""


@dataclass(frozen=True)
class ConfigFile:
    """A file of settings, in TOML or JSON by its name's ending: its text, and the values in it."""

    path: Path
    text: str
    values: Values

    @classmethod
    def read(cls, path: str | Path) -> ConfigFile:
        """Read a file; ConfigError that names it, and the line, if it holds no table."""
        path = Path(path)
        if path.suffix not in (".toml", ".json"):
            raise ConfigError("", "must be a file whose name ends in .toml or .json", str(path))
        is_toml = path.suffix == ".toml"
        try:
            text = read_bytes(path, MOST_BYTES).decode()
            values = parse_toml(text) if is_toml else json.loads(text)
        except RecursionError:
            raise ConfigError("", TOO_DEEP, str(path)) from None
        except OSError as error:
            raise ConfigError("", error.strerror or str(error), str(path)) from error
        except (ValueError, msgspec.DecodeError) as error:
            line = re.search(r"(?:at )?line (\d+)", str(error))
            place = f"{path}:{line[1]}" if line else str(path)
            kind = "TOML" if is_toml else "JSON"
            raise ConfigError("", f"must be {kind}: {error}", place) from error
        if not isinstance(values, dict):
            raise ConfigError("", f"must hold a table, got {values!r:.80}", str(path))
        if deep := deep_key(values):
            raise ConfigError(dotted(deep[:3]), TOO_DEEP, str(path))
        return cls(path, text, values)

    def specification(self) -> dict[str, object]:
        """Return the values of a specification: all but what only a run's configuration has.

        ConfigError if it is the configuration of a run of another format.
        """
        if (version := self.values.get("format", FORMAT)) != FORMAT:
            raise ConfigError("format", f"must be {FORMAT}, got {version!r}: begin a new run")
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
        """Return the file and, in TOML, the line of a key, or of the nearest table around it."""
        line = line_of(self.text, key) if self.path.suffix == ".toml" else None
        return str(self.path) if line is None else f"{self.path}:{line}"

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
