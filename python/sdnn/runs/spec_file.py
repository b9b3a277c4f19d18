"""Specifications in files, with options that override them."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from sdnn.runs.config_file import ConfigFile
from sdnn.runs.errors import ConfigError
from sdnn.runs.spec import RunSpec

__all__ = ["FORMAT", "SpecSource", "read_spec"]

FORMAT = "sdnn-run-2"
"""Of the configuration in a run's folder."""

_OTHERS = {
    "budget.steps": "budget.episodes",
    "budget.episodes": "budget.steps",
    "protocol.evaluate_every": "protocol.evaluate_every_episodes",
    "protocol.evaluate_every_episodes": "protocol.evaluate_every",
    "agent.name": "agent.preset",
}
"""What an option takes the place of, besides its own key."""


class SpecSource:
    """A TOML or JSON file of a specification, with options that override it.

    Parameters
    ----------
    path
        The file, such as ``config.json`` of a run's folder; None: options only.
    options
        Values by their keys, with dots between tables.

    Raises
    ------
    ConfigError
        If the file cannot be read.
    """

    def __init__(self, path: str | Path | None, options: Mapping[str, Any] | None = None) -> None:
        self._file = None if path is None else ConfigFile.read(path)
        self._options = dict(options or {})

    def read(self) -> RunSpec:
        """Make the specification; a `ConfigError` if something is unknown or impossible."""
        values: dict[str, Any] = {} if self._file is None else dict(self._file.values)
        if (found := values.pop("format", FORMAT)) != FORMAT:
            raise ConfigError("format", f"must be {FORMAT}, got {found!r}: begin a new run")
        for name in ("version", "goals"):
            values.pop(name, None)
        for name, key in (("environment", "id"), ("agent", "name")):
            if isinstance(values.get(name), str):
                values[name] = {key: values[name]}
        for key in self._options:
            _remove(values, _OTHERS.get(key, ""))
        for key, value in self._options.items():
            _set(values, key.split("."), value)
        return RunSpec.from_values(values)

    def located(self, error: ConfigError) -> ConfigError:
        """Add the file, and the line in TOML, to an error about a value that the file has."""
        key = tuple(error.key.partition("[")[0].split("."))
        if self._file is None or error.place or _is_of_option(error.key, self._options):
            return error
        if key[0] not in self._file.values and _is_of_option(key[0], self._options):
            return error
        return ConfigError(error.key, error.problem, self._file.place(key))


def read_spec(path: str | Path) -> RunSpec:
    """Read a specification from a TOML or JSON file.

    Raises
    ------
    ConfigError
        If something is unknown or impossible; the message names file, line (of TOML) and key.
    """
    source = SpecSource(path)
    try:
        return source.read()
    except ConfigError as error:
        raise source.located(error) from error


def _is_of_option(key: str, options: Mapping[str, Any]) -> bool:
    return any(f"{key}.".startswith(f"{one}.") or one.startswith(f"{key}.") for one in options)


def _set(values: dict[str, Any], names: list[str], value: Any) -> None:
    for name in names[:-1]:
        inner = values.get(name)
        values[name] = dict(inner) if isinstance(inner, Mapping) else {}
        values = values[name]
    values[names[-1]] = value


def _remove(values: dict[str, Any], key: str) -> None:
    table, _, name = key.partition(".")
    if isinstance(values.get(table), Mapping):
        values[table] = {one: value for one, value in values[table].items() if one != name}
