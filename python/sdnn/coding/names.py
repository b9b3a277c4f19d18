"""Codings by name, and as plain data for files."""

from __future__ import annotations

import dataclasses
from collections.abc import Mapping
from typing import Any

import numpy as np

from sdnn.coding.base import Coding
from sdnn.coding.missing import WithMissing
from sdnn.coding.numeric import Anchor, Circular, RandomInverse
from sdnn.coding.symbols import CorrelationMatrix, Symbolic

__all__ = ["CODINGS", "coding_named", "from_dict", "to_dict"]

CODINGS: dict[str, type[Coding]] = {
    coding.name: coding
    for coding in (RandomInverse, Anchor, Circular, Symbolic, CorrelationMatrix, WithMissing)
}
"""Every coding by its name."""


def coding_named(coding: str | Coding) -> Coding:
    """Return a coding given as such, or by its name with its default values.

    Raises
    ------
    ValueError
        If there is none of that name, or it cannot be made from a name alone.

    Examples
    --------
    >>> coding_named("anchor").n_anchor_patterns
    9
    """
    if isinstance(coding, Coding):
        return coding
    if isinstance(coding, str) and coding == CorrelationMatrix.name:
        raise ValueError("'correlation-matrix' needs a matrix: use CorrelationMatrix(matrix=...)")
    if not isinstance(coding, str) or coding not in CODINGS:
        names = ", ".join(repr(name) for name in CODINGS if name != CorrelationMatrix.name)
        raise ValueError(f"coding must be one of {names} or a Coding object, got {coding!r}")
    return CODINGS[coding]()


def to_dict(coding: Coding) -> dict[str, Any]:
    """Describe a coding in plain data that JSON can hold.

    >>> to_dict(Symbolic(categories=("a", "b")))
    {'coding': 'symbolic', 'categories': ('a', 'b')}

    Raises
    ------
    TypeError
        If the coding is not one of this package.
    """
    if type(coding) is not CODINGS.get(coding.name):
        raise TypeError(f"only codings of sdnn.coding can be described, got {coding!r}")
    fields = {field.name: getattr(coding, field.name) for field in dataclasses.fields(coding)}  # type: ignore[arg-type]
    return {"coding": coding.name, **{name: plain(value) for name, value in fields.items()}}


def plain(value: Any) -> Any:
    """Replace codings by their descriptions and NumPy's numbers by Python's, in tuples too."""
    if isinstance(value, Coding):
        return to_dict(value)
    if isinstance(value, tuple):
        return tuple(map(plain, value))
    return value.item() if isinstance(value, np.generic) else value


def from_dict(data: Mapping[str, Any]) -> Coding:
    """Make the coding that `to_dict` described; lists count as tuples.

    >>> from_dict({"coding": "circular", "period": 24.0}).period
    24.0
    """
    fields = {name: tupled(value) for name, value in data.items() if name != "coding"}
    return CODINGS[data["coding"]](**fields)


def tupled(value: Any) -> Any:
    """Replace lists by tuples and descriptions of codings by codings, all the way down."""
    if isinstance(value, Mapping):
        return from_dict(value)
    return tuple(map(tupled, value)) if isinstance(value, list | tuple) else value
