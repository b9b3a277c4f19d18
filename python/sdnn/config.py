"""From a frozen dataclass to the core's struct of the same fields."""

from __future__ import annotations

import dataclasses
from typing import Any, TypeVar

from sdnn.arguments import choice

__all__ = ["to_core"]

CoreConfig = TypeVar("CoreConfig")


def to_core(config: Any, core_type: type[CoreConfig]) -> CoreConfig:
    """Make the core's struct of the values of a dataclass; words become its enumerations.

    Raises
    ------
    ValueError
        If a word is none of its enumeration's.
    TypeError
        If a value has the wrong type.
    """
    defaults = core_type()
    values = {}
    for field in dataclasses.fields(config):
        value = getattr(config, field.name)
        members = getattr(type(getattr(defaults, field.name)), "__members__", None)
        values[field.name] = value if members is None else choice(field.name, value, members)
    return core_type(**values)
