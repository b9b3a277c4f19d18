"""What every coding can do, and codings by name and as plain data for files."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Mapping
from typing import Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

__all__ = ["CODINGS", "Coding", "coding_named", "from_dict", "known", "to_dict"]

Value = TypeVar("Value")

CODINGS: dict[str, type[Coding]] = {}
"""Every coding of this package by its name."""


class Coding(abc.ABC):
    """How the values of one input become balanced patterns of +1 and -1.

    Attributes
    ----------
    name : str
        What the coding is called where a name is enough.
    is_numeric : bool
        Whether values are numbers; otherwise they are categories.
    """

    name: ClassVar[str]
    is_numeric: ClassVar[bool] = True

    @abc.abstractmethod
    def fit(self, column: NDArray[Any], n_units: int) -> Coding:
        """Return a copy with everything learned that was not given.

        Parameters
        ----------
        column : ndarray, shape (n_samples,)
            The input's values in the training sample.
        n_units : int
            Units per pattern, even.

        Raises
        ------
        ValueError
            If an argument of the coding is impossible; the message names it.
        """

    @property
    @abc.abstractmethod
    def learns(self) -> bool:
        """Whether ``fit`` learns something from the sample: a range or the categories."""

    @property
    @abc.abstractmethod
    def size(self) -> int:
        """The number of bins, and of patterns, of a fitted coding."""

    @abc.abstractmethod
    def bins(self, column: NDArray[Any]) -> NDArray[np.int32]:
        """Return the bin of each value of a column, shape (n_samples,), for a fitted coding."""

    def ends(self) -> tuple[float, float] | None:
        """Return the smallest and largest number within a fitted coding's range.

        Values beyond it are clipped. None: every value is within, or there is no order.
        """
        return None

    def even_range(self) -> tuple[float, float] | None:
        """Return the range of a fitted coding whose bins are equal parts of it, else None."""
        return None

    @abc.abstractmethod
    def patterns(self, n_units: int, seed: int) -> NDArray[np.int8]:
        """Draw the patterns of a fitted coding, +1 and -1, shape (n_bins, n_units)."""

    @abc.abstractmethod
    def correlations(self, n_units: int) -> NDArray[np.float64]:
        """Return the expected correlations of patterns, shape (n_bins, n_bins)."""


def known(value: Value | None) -> Value:
    """Return the value of an attribute that ``fit`` fills in; ValueError if it is still None."""
    if value is None:
        raise ValueError("this coding is not fitted yet: call fit first")
    return value


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
    if coding == "correlation-matrix":
        raise ValueError("'correlation-matrix' needs a matrix: use CorrelationMatrix(matrix=...)")
    if not isinstance(coding, str) or coding not in CODINGS:
        names = ", ".join(repr(name) for name in CODINGS if name != "correlation-matrix")
        raise ValueError(f"coding must be one of {names} or a Coding object, got {coding!r}")
    return CODINGS[coding]()


def to_dict(coding: Coding) -> dict[str, Any]:
    """Describe a coding in plain data that JSON can hold.

    >>> from sdnn.coding import Symbolic
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
