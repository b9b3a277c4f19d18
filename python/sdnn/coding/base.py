"""What every coding can do."""

from __future__ import annotations

import abc
from typing import Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import NDArray

__all__ = ["Coding", "known"]

Value = TypeVar("Value")


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

        Values beyond it count as its ends. None: every value is within, or there is no order.
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
    """Return the value of an attribute that ``fit`` fills in.

    Raises
    ------
    ValueError
        If it is still None.
    """
    if value is None:
        raise ValueError("this coding is not fitted yet: call fit first")
    return value
