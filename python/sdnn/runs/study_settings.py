"""Settings in a study file: where each stands, what it may be, and configurations made of them."""

from __future__ import annotations

import json
import re
import sys
from collections.abc import Collection, Iterable, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, TypeAlias, TypeVar

from sdnn.runs.errors import StudyError
from sdnn.runs.settings import kinds_of
from sdnn.toml_lines import KeyPath, key_lines, line_of
from sdnn.typed_values import convert, hints_of, possible_words, words_of

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

Config = TypeVar("Config")


@dataclass(frozen=True)
class Setting:
    """A value of a study file.

    Parameters
    ----------
    value
        As TOML has it.
    where
        Its place in the file.
    """

    value: Any
    where: KeyPath


Settings: TypeAlias = dict[tuple[str, ...], Setting]
"""Settings by their names: ``("learning", "discount")``."""


@dataclass(frozen=True)
class StudyFile:
    """The text of a study, and errors about its places.

    Parameters
    ----------
    path
        Its file.
    text
        Its content.
    content
        The values in it.
    """

    path: Path
    text: str
    content: dict[str, Any]

    @classmethod
    def read(cls, path: Path) -> StudyFile:
        """Read a file.

        Raises
        ------
        StudyError
            If it cannot be read or is no TOML.
        """
        try:
            text = path.read_bytes().decode()
            content = tomllib.loads(text)
        except OSError as error:
            raise StudyError(f"{path}: {error.strerror}") from error
        except UnicodeDecodeError as error:
            raise StudyError(f"{path}: must be UTF-8: {error}") from error
        except tomllib.TOMLDecodeError as error:
            line = re.search(r"at line (\d+)", str(error))
            place = f"{path}:{line[1]}" if line else str(path)
            raise StudyError(f"{place}: must be TOML: {error}") from error
        return cls(path, text, content)

    @cached_property
    def _lines(self) -> dict[KeyPath, int]:
        return key_lines(self.text)

    def error(self, where: KeyPath, message: str) -> StudyError:
        """Make the error that names file, line and key."""
        line = line_of(self._lines, where)
        place = str(self.path) if line is None else f"{self.path}:{line}"
        return StudyError(
            f"{place}: {dotted(where)}: {message}" if where else f"{place}: {message}"
        )

    def table(self, where: KeyPath, value: Any) -> dict[str, Any]:
        """Check that a value is a table.

        Raises
        ------
        StudyError
            If it is none.
        """
        if not isinstance(value, dict):
            raise self.error(where, f"must be a table, got {words_of(value)}")
        return value

    def check_keys(self, where: KeyPath, table: Mapping[str, Any], known: Iterable[str]) -> None:
        """Check that a table has no other keys.

        Raises
        ------
        StudyError
            If it has; possible ones are named, the most similar first.
        """
        for key in table:
            if key not in (possible := tuple(known)):
                raise self.error((*where, key), f"unknown key; {possible_words(key, possible)}")

    def value(self, where: KeyPath, kind: Any, value: Any) -> Any:
        """Convert a value to a type.

        Raises
        ------
        StudyError
            If it does not fit.
        """
        try:
            return convert(kind, value)
        except ValueError as error:
            raise self.error(where, str(error)) from error

    def settings(self, where: KeyPath, table: Mapping[str, Any]) -> Settings:
        """Read a table of settings: nested, with dotted keys, or with quoted dotted keys.

        Raises
        ------
        StudyError
            If a setting is there twice.
        """
        found: Settings = {}
        self._collect(where, table, (), found)
        return found

    def _collect(
        self, where: KeyPath, table: Mapping[str, Any], prefix: tuple[str, ...], found: Settings
    ) -> None:
        for key, value in table.items():
            name, place = (*prefix, *key.split(".")), (*where, key)
            if isinstance(value, dict) and len(name) < _depth(name):
                self._collect(place, value, name, found)
                continue
            if len(name) > _depth(name):
                words = "SECTION.NAME, or environment.kwargs.NAME"
                raise self.error(place, f"must be {words}, got {'.'.join(name)}")
            if name == ("environment",):
                name = ("environment", "id")
            if name in found:
                raise self.error(place, f"{'.'.join(name)} is set twice")
            found[name] = Setting(value, place)


def _depth(name: tuple[str, ...]) -> int:
    """Count the words in the name of a setting; deeper tables are values."""
    return 3 if name[:2] == ("environment", "kwargs") else 2


def blamed(settings: Settings, text: str) -> KeyPath | None:
    """Find the setting that a text mentions first."""
    mentions = [
        (found.start(), setting.where)
        for name, setting in settings.items()
        if (found := re.search(rf"\b{re.escape(name[-1])}\b", text)) and name[-1] not in ("id",)
    ]
    return min(mentions, key=lambda m: m[0])[1] if mentions else None


def place_of(settings: Settings, *name: str) -> KeyPath | None:
    """Give the place of a setting, if it was set."""
    return settings[name].where if name in settings else None


def dotted(where: KeyPath) -> str:
    """Write a place as TOML would.

    Examples
    --------
    >>> dotted(("axes", "learning.tie_rule", 1))
    'axes."learning.tie_rule"[1]'
    """
    text = ""
    for key in where:
        if isinstance(key, int):
            text += f"[{key}]"
        else:
            bare = key.replace("-", "").replace("_", "").isalnum() and key.isascii()
            text += ("." if text else "") + (key if bare else f'"{key}"')
    return text


def build(
    file: StudyFile,
    section: str,
    defaults: Config | type[Config],
    settings: Settings,
    given: Collection[str],
    hint: str = "",
) -> Config:
    """Make a configuration of the settings of a section.

    Parameters
    ----------
    file
        Where they stand.
    section
        First word of their names.
    defaults
        A frozen dataclass: what is not set stays as it is here; or the class, for its own defaults.
    settings
        Settings of all sections.
    given
        Names of the values that follow from others and may not be set.
    hint
        Said about unknown settings.

    Raises
    ------
    StudyError
        If a setting is unknown, follows from others or has the wrong type.
    """
    kind = defaults if isinstance(defaults, type) else type(defaults)
    hints = hints_of(kind)
    possible = [name for name in kinds_of(kind) if name not in given]
    values: dict[str, Any] = {}
    for name, setting in settings.items():
        if name[0] != section:
            continue
        if len(name) == 1:
            raise file.error(
                setting.where, f"must be a table of settings, got {words_of(setting.value)}"
            )
        key = name[1]
        if key in given:
            raise file.error(
                setting.where,
                f"follows from the observations ({getattr(defaults, key)}): omit it",
            )
        if key not in possible:
            raise file.error(
                setting.where,
                f"{kind.__name__} has no such setting; {possible_words(key, possible)}{hint}",
            )
        if len(name) > 2:
            try:
                json.dumps(setting.value, allow_nan=False)
            except (TypeError, ValueError):
                raise file.error(
                    setting.where,
                    f"must be data that JSON has, numbers finite, got {setting.value!r}",
                ) from None
            values.setdefault(key, {})[name[2]] = setting.value
        else:
            values[key] = file.value(setting.where, hints.get(key, Any), setting.value)
    try:
        if isinstance(defaults, type):
            return defaults(**values)
        return replace(defaults, **values)  # type: ignore[type-var]
    except Exception as error:  # of whatever settings an agent has
        of_section = {name: one for name, one in settings.items() if name[0] == section}
        text = str(error) or type(error).__name__
        where = blamed(of_section, text)
        if where is None and of_section:
            where = next(iter(of_section.values())).where
        raise file.error(() if where is None else where, text) from error
