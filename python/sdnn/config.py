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
        If a value has the wrong type, or is too large for the core's; the message names its field.
    """
    defaults = core_type()
    values = {}
    for field in dataclasses.fields(config):
        value = getattr(config, field.name)
        members = getattr(type(getattr(defaults, field.name)), "__members__", None)
        values[field.name] = value if members is None else choice(field.name, value, members)
        _check_type(core_type, field, values[field.name], getattr(defaults, field.name))
    return core_type(**values)


def _check_type(core_type: Any, field: dataclasses.Field[Any], value: Any, default: Any) -> None:
    """Raise TypeError unless the core takes the value; it takes True for 1 and None for False."""
    kind = getattr(getattr(value, "dtype", None), "kind", "")
    is_truth = kind == "b" or isinstance(value, bool)
    try:
        if is_truth != isinstance(default, bool):
            raise TypeError
        core_type(**{field.name: value})
    except TypeError:
        hint = str(field.type)
        words = {"bool": "True or False", "int": "a whole number", "float": "a number"}
        first = hint.partition(" | ")[0]
        expected = words.get(first, first) + (" or None" if hint.endswith("None") else "")
        if isinstance(value, int) and not is_truth:
            expected += " that the core can hold"
        raise TypeError(f"{field.name} must be {expected}, got {value!r}") from None
