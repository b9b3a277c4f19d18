"""Files of settings, in TOML or JSON: their values, where each key is, and their JSON Schema."""

from __future__ import annotations

import itertools
import json
import math
import re
from collections.abc import Collection
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, get_type_hints

import msgspec

from sdnn.agents.registry import AGENTS
from sdnn.config import Field, fields_of
from sdnn.environments.paper_acrobot import PAPER_ACROBOT
from sdnn.runs.environment import PaperSettings
from sdnn.runs.errors import ConfigError
from sdnn.runs.settings import Values, schemas_of
from sdnn.runs.spec import RunSpec
from sdnn.support.files import read_bytes
from sdnn.support.toml import TOO_DEEP, KeyPath, deep_key, dotted, line_of, parse_toml

FORMAT = "sdnn-run-2"  # format of the configuration in a run's folder

MOST_BYTES = 2**20  # largest file of settings


@dataclass(frozen=True)
class ConfigFile:
    """A file of settings, its text and its values; TOML or JSON by its suffix."""

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
            name = "TOML" if is_toml else "JSON"
            raise ConfigError("", f"must be {name}: {error}", place) from error
        if not isinstance(values, dict):
            raise ConfigError("", f"must hold a table, got {values!r:.80}", str(path))
        if deep := deep_key(values):
            raise ConfigError(dotted(deep[:3]), TOO_DEEP, str(path))
        return cls(path, text, values)

    def specification(self) -> dict[str, object]:
        """Return the values of a specification, without the keys that only a run's file has.

        ConfigError if it is the configuration of a run of another format.
        """
        if (version := self.values.get("format", FORMAT)) != FORMAT:
            raise ConfigError("format", f"must be {FORMAT}, got {version!r}: begin a new run")
        others = ("format", "version", "goals")
        return {name: value for name, value in self.values.items() if name not in others}

    def located(self, error: ConfigError, options: Collection[str] = ()) -> ConfigError:
        """Add file and line to an error, unless a command-line option has set its key."""
        key = tuple(error.key.partition("[")[0].split("."))
        # A table that the file lacks can only come from options.
        names = {error.key} if key[0] in self.values else {error.key, key[0]}
        for name, option in itertools.product(names, options):
            # It sets the key, a table that holds it, or a key within it.
            if f"{name}.".startswith(f"{option}.") or option.startswith(f"{name}."):
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


# The JSON Schema of such files, for editors and documentation.

PAPER_ARGUMENTS: dict[str, type[object]] = get_type_hints(PaperSettings)
"""The core's settings that are arguments of the paper's acrobot."""


def core_parts() -> dict[str, tuple[type[object], ...]]:
    """Return the classes of settings in the core, by the table of a specification."""
    compiled = [entry for entry in AGENTS.values() if entry.core_trial]
    return {
        "approximator": tuple(dict.fromkeys(entry.approximator for entry in compiled)),
        "learning": tuple(dict.fromkeys(entry.learning for entry in compiled)),
    }


def spec_schema() -> Values:
    """Return the JSON Schema of a specification.

    >>> spec_schema()["$defs"]["QLearningConfig"]["properties"]["epsilon"]["maximum"]
    1.0
    """
    parts = core_parts()
    configs = (*parts["approximator"], *parts["learning"], *PAPER_ARGUMENTS.values())
    structs = []  # the core's classes as msgspec's, for its JSON Schema
    for config in configs:
        fields = [(f.name, _schema_of_type(f), f.default) for f in fields_of(config)]
        fields = [field for field in fields if field[0] != "n_inputs"]
        structs.append(msgspec.defstruct(config.__name__, fields, forbid_unknown_fields=True))
    components = schemas_of(RunSpec, *structs)
    properties = components["RunSpec"]["properties"]
    for table, core in parts.items():
        properties[table]["anyOf"] = [
            *({"$ref": f"#/$defs/{config.__name__}"} for config in core),
            {"type": "object"},  # settings of an agent that a user has registered
        ]
    # Arguments of the paper's acrobot, in the schema of its environment alone.
    arguments = {name: {"$ref": f"#/$defs/{c.__name__}"} for name, c in PAPER_ARGUMENTS.items()}
    components["EnvironmentSpec"]["if"] = {"properties": {"id": {"const": PAPER_ACROBOT}}}
    components["EnvironmentSpec"]["then"] = {"properties": {"kwargs": {"properties": arguments}}}
    for table in ("environment", "agent"):  # a text may replace these tables: an id or a name
        inner = {
            name: properties[table].pop(name)
            for name in ("anyOf", "$ref")
            if name in properties[table]
        }
        properties[table]["anyOf"] = [*inner.get("anyOf", [inner]), {"type": "string"}]
    return {"$schema": "https://json-schema.org/draft/2020-12/schema",
            "$ref": "#/$defs/RunSpec", "$defs": components}  # fmt: skip


def _schema_of_type(field: Field) -> object:
    """Return the type of a field of the core, annotated with its limits and documentation."""
    limits: Values = {}
    if field.hint in ("int", "float"):
        number = int if field.hint == "int" else float
        if math.isfinite(field.low):
            limits["gt" if field.excludes_low else "ge"] = number(field.low)
        if math.isfinite(field.high):
            limits["le"] = number(field.high)
    return Annotated[field.type, msgspec.Meta(description=field.doc, **limits)]
