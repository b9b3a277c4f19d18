"""The JSON Schema of a run's specification: for editors and documentation."""

from __future__ import annotations

import math
from typing import Annotated, get_type_hints

import msgspec

from sdnn.agents.registry import AGENTS
from sdnn.config import Field, fields_of
from sdnn.environments.paper_acrobot import PAPER_ACROBOT
from sdnn.runs.environment import PaperSettings
from sdnn.runs.settings import Values, schemas_of
from sdnn.runs.spec import RunSpec

PAPER_ARGUMENTS: dict[str, type[object]] = get_type_hints(PaperSettings)
"""The core's settings that are arguments of the paper's acrobot."""

PARTS: dict[str, tuple[type[object], ...]] = {
    part: tuple(
        dict.fromkeys(getattr(entry, part) for entry in AGENTS.values() if entry.core_trial)
    )
    for part in ("approximator", "learning")
}
"""The core's settings of the parts of agents, by their tables."""


def spec_schema() -> Values:
    """Return the JSON Schema of a specification.

    Examples
    --------
    >>> spec_schema()["$defs"]["QLearningConfig"]["properties"]["epsilon"]["maximum"]
    1.0
    """
    configs = [config for configs in PARTS.values() for config in configs]
    structs = [
        msgspec.defstruct(
            config.__name__,
            [(f.name, _type(f), f.default) for f in fields_of(config) if f.name != "n_inputs"],
            forbid_unknown_fields=True,
        )
        for config in (*configs, *PAPER_ARGUMENTS.values())
    ]
    components = schemas_of(RunSpec, *structs)
    properties = components["RunSpec"]["properties"]
    for table, core in PARTS.items():
        properties[table]["anyOf"] = [
            *({"$ref": f"#/$defs/{kind.__name__}"} for kind in core),
            {"type": "object"},  # of an agent from elsewhere
        ]
    arguments = {name: {"$ref": f"#/$defs/{c.__name__}"} for name, c in PAPER_ARGUMENTS.items()}
    components["EnvironmentSpec"]["if"] = {"properties": {"id": {"const": PAPER_ACROBOT}}}
    components["EnvironmentSpec"]["then"] = {"properties": {"kwargs": {"properties": arguments}}}
    for table in ("environment", "agent"):
        inner = {
            name: properties[table].pop(name)
            for name in ("anyOf", "$ref")
            if name in properties[table]
        }
        properties[table]["anyOf"] = [*inner.get("anyOf", [inner]), {"type": "string"}]
    return {"$schema": "https://json-schema.org/draft/2020-12/schema",
            "$ref": "#/$defs/RunSpec", "$defs": components}  # fmt: skip


def _type(field: Field) -> object:
    limits: Values = {}
    if field.hint in ("int", "float"):
        number = int if field.hint == "int" else float
        if math.isfinite(field.low):
            limits["gt" if field.excludes_low else "ge"] = number(field.low)
        if math.isfinite(field.high):
            limits["le"] = number(field.high)
    return Annotated[field.type, msgspec.Meta(description=field.doc, **limits)]
