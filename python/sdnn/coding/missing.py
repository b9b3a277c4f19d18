"""A coding of values that may be missing, or categories that nobody has seen before."""

from __future__ import annotations

import dataclasses
from collections.abc import Set
from typing import Any, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.arguments import one_of
from sdnn.coding.base import Coding, known
from sdnn.coding.numeric import RandomInverse
from sdnn.coding.symbols import CorrelationMatrix, Symbolic, is_missing

__all__ = ["WithMissing", "missing_as_nan"]


def missing_as_nan(values: NDArray[Any]) -> NDArray[np.float64]:
    """Return numbers of any type as floats, missing ones as NaN; the shape is kept.

    Raises
    ------
    ValueError
        If a value is no number.

    >>> missing_as_nan(np.array([1, None, "2.5"], dtype=object))
    array([1. , nan, 2.5])
    """
    plain = [np.nan if is_missing(value) else value for value in values.ravel().tolist()]
    return np.array(plain, dtype=np.float64).reshape(values.shape)


def is_among(value: Any, categories: Set[Any]) -> bool:
    """Return whether a value is one of the categories; what cannot be hashed is none."""
    try:
        return value in categories
    except TypeError:
        return False


@dataclasses.dataclass(frozen=True, kw_only=True)
class WithMissing(Coding):
    """Another coding, and one pattern more, like no other, for values that are missing.

    Missing are None, NaN and pandas.NA.

    Attributes
    ----------
    base : Coding
        Of the values that are there; it learns from them alone.
    unknown : {"missing", "error"}
        Whether a category that was not there in training counts as missing, or is an error.

    Examples
    --------
    >>> from sdnn.coding import Symbolic
    >>> color = WithMissing(base=Symbolic()).fit(np.array(["red", None, "blue"]), n_units=100)
    >>> color.bins(np.array(["blue", "red", "pink", None]))
    array([0, 1, 2, 2], dtype=int32)
    """

    name: ClassVar[str] = "with-missing"
    is_numeric: ClassVar[bool] = False  # as scikit-learn lets words through, so it does NaN
    base: Coding = dataclasses.field(default_factory=RandomInverse)
    unknown: Literal["missing", "error"] = "missing"

    def fit(self, column: NDArray[Any], n_units: int) -> WithMissing:
        """Return a copy whose coding is fitted to the values that are there; see `Coding.fit`."""
        one_of("unknown", self.unknown, ("missing", "error"))
        learns = self.learns  # before all else: it says if the base is none
        there = self._values(column[self._is_there(column)])
        if learns and len(there) == 0:
            raise ValueError("every value of an input is missing: there is nothing to learn")
        return dataclasses.replace(self, base=self.base.fit(there, n_units))

    @property
    def learns(self) -> bool:
        """Whether ``fit`` learns from the sample."""
        if not isinstance(self.base, Coding) or isinstance(self.base, WithMissing):
            raise ValueError(f"base must be a Coding without missing values, got {self.base!r}")
        return self.base.learns

    @property
    def size(self) -> int:
        """The number of bins, that of what is missing among them, as the last."""
        return self.base.size + 1

    def ends(self) -> tuple[float, float] | None:
        """Return the range of the values that are there; see `Coding.ends`."""
        return self.base.ends()

    def bins(self, column: NDArray[Any]) -> NDArray[np.int32]:
        """Return the bin of each value; see `Coding.bins`."""
        is_there = self._is_there(column)
        if isinstance(self.base, Symbolic | CorrelationMatrix) and self.unknown == "missing":
            categories = set(known(self.base.categories))
            is_there &= np.array([is_among(value, categories) for value in column.tolist()], bool)
        found = np.full(len(column), self.size - 1, dtype=np.int32)
        found[is_there] = self.base.bins(self._values(column[is_there]))
        return found

    def patterns(self, n_units: int, seed: int) -> NDArray[np.int8]:
        """Draw the patterns; see `Coding.patterns`."""
        own = int(np.random.SeedSequence(seed).generate_state(1, np.uint64)[0])
        return np.vstack(
            [self.base.patterns(n_units, seed), _core.symbol_patterns(1, n_units, own)]
        )

    def correlations(self, n_units: int) -> NDArray[np.float64]:
        """Return those of the coding; what is missing has none with them; see `Coding`."""
        every = np.eye(self.size)
        every[:-1, :-1] = self.base.correlations(n_units)
        return every

    def _is_there(self, column: NDArray[Any]) -> NDArray[np.bool_]:
        return np.array([not is_missing(value) for value in column.tolist()], dtype=bool)

    def _values(self, there: NDArray[Any]) -> NDArray[Any]:
        """Return values as the coding wants them.

        Raises
        ------
        ValueError
            If numbers are wanted and one is none, or is infinite.
        """
        if not self.base.is_numeric:
            return there
        values = missing_as_nan(there)
        if not np.isfinite(values).all():
            raise ValueError("Input contains infinity")
        return values
