"""The interface of codings; codings by name and as plain data for files."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Mapping
from typing import Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

from sdnn.support.arguments import shown

Value = TypeVar("Value")
Column = NDArray[Any]  # the values of an input, numbers or objects

CODINGS: dict[str, type[Coding]] = {}
"""Every coding of this package by its name."""


class Coding(abc.ABC):
    """Maps the values of one input to balanced patterns of +1 and -1.

    Subclasses are frozen dataclasses with a ``name``; ``is_numeric`` is False for categories.
    """

    name: ClassVar[str]
    is_numeric: ClassVar[bool] = True

    @abc.abstractmethod
    def fit(self, column: Column, n_units: int) -> Coding:
        """Return a copy with the fields that are None learned from a column.

        Parameters
        ----------
        column : ndarray, shape (n_samples,)
            The input's values in the training sample.
        n_units : int
            Units per pattern, even.

        Raises
        ------
        ValueError
            For an impossible field or value; the message names it.
        """

    @property
    @abc.abstractmethod
    def learns(self) -> bool:
        """Whether ``fit`` learns a range or categories from the sample."""

    @property
    @abc.abstractmethod
    def size(self) -> int:
        """Number of bins, and of patterns, of a fitted coding."""

    @abc.abstractmethod
    def bins(self, column: Column) -> NDArray[np.int32]:
        """Return the bin of each value, shape (n_samples,); the coding must be fitted."""

    def ends(self) -> tuple[float, float] | None:
        """Return the range (low, high) outside which values are clipped; None without one."""
        return None

    def even_range(self) -> tuple[float, float] | None:
        """Return the range (low, high) if it is divided into bins of equal width, else None."""
        return None

    @abc.abstractmethod
    def patterns(self, n_units: int, seed: int) -> NDArray[np.int8]:
        """Draw the patterns of a fitted coding, +1 and -1, shape (n_bins, n_units)."""

    @abc.abstractmethod
    def correlations(self, n_units: int) -> NDArray[np.float64]:
        """Return the expected correlations of patterns, shape (n_bins, n_bins)."""


def fitted_field(value: Value | None) -> Value:
    """Return a field that ``fit`` sets; ValueError if it is None, as the coding is not fitted."""
    if value is None:
        raise ValueError("this coding is not fitted yet: call fit first")
    return value


def coding_named(coding: str | Coding) -> Coding:
    """Return the coding of a name with default values; a coding is returned unchanged.

    >>> coding_named("anchor").n_anchor_patterns
    9
    """
    if isinstance(coding, Coding):
        return coding
    if not isinstance(coding, str) or coding not in CODINGS:
        names = ", ".join(repr(name) for name in CODINGS if name != "correlation-matrix")
        raise ValueError(f"coding must be one of {names} or a Coding object, got {shown(coding)}")
    if coding == "correlation-matrix":
        raise ValueError("'correlation-matrix' needs a matrix: use CorrelationMatrix(matrix=...)")
    return CODINGS[coding]()


def to_dict(coding: Coding) -> dict[str, object]:
    """Describe a coding of this package in plain data that JSON can hold.

    >>> from sdnn.coding import Symbolic
    >>> to_dict(Symbolic(categories=("a", "b")))
    {'coding': 'symbolic', 'categories': ('a', 'b')}
    """
    if type(coding) not in CODINGS.values():
        raise TypeError(f"only codings of sdnn.coding can be described, got {shown(coding)}")
    fields = {field.name: getattr(coding, field.name) for field in dataclasses.fields(coding)}  # type: ignore[arg-type]
    return {"coding": coding.name, **{name: json_value(value) for name, value in fields.items()}}


def json_value(value: object) -> object:
    """Convert a field to JSON data: codings to descriptions, NumPy's numbers to Python's."""
    if isinstance(value, Coding):
        return to_dict(value)
    if isinstance(value, tuple):
        return tuple(map(json_value, value))
    return value.item() if isinstance(value, np.generic) else value


def from_dict(data: Mapping[str, object]) -> Coding:
    """Make the coding that `to_dict` described; lists become tuples.

    >>> from_dict({"coding": "circular", "period": 24.0}).period
    24.0
    """
    fields = {name: from_json_value(value) for name, value in data.items() if name != "coding"}
    return CODINGS[str(data["coding"])](**fields)


def from_json_value(value: object) -> object:
    """Convert JSON data back to a field: the inverse of `json_value`. Lists become tuples."""
    if isinstance(value, Mapping):
        return from_dict(value)
    return tuple(map(from_json_value, value)) if isinstance(value, list | tuple) else value
