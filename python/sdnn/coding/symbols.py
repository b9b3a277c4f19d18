"""Codings of categories and of values that may be missing."""

from __future__ import annotations

import dataclasses
from collections.abc import Hashable, Iterable
from typing import ClassVar, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn import _core
from sdnn.coding.base import Coding, Column, fitted_field
from sdnn.coding.numeric import RandomInverse
from sdnn.support.arguments import array_of, one_of, require, seed_of, shown

Category = str | float | int | bool


def is_missing(value: object) -> bool:
    """Return whether a value is None, NaN or pandas.NA."""
    try:
        return value is None or bool(value != value)  # NaN differs from itself
    except TypeError:  # pandas.NA is neither true nor false
        return True


def missing_as_nan(values: Column) -> NDArray[np.float64]:
    """Return numbers of any type as floats, missing ones as NaN.

    >>> missing_as_nan(np.array([1, None, "2.5"], dtype=object))
    array([1. , nan, 2.5])
    """
    plain = [np.nan if is_missing(value) else value for value in values.ravel().tolist()]
    return np.array(plain, dtype=np.float64).reshape(values.shape)


class Categorical(Coding):
    """Coding of categories, given or learned in sorted order."""

    is_numeric: ClassVar[bool] = False
    categories: tuple[Category, ...] | None

    def __post_init__(self) -> None:
        """Check the categories, and convert them to a tuple."""
        categories: object = self.categories
        if categories is None:
            return
        if not isinstance(categories, Iterable) or isinstance(categories, str | bytes):
            raise ValueError(f"categories must be a tuple of values, got {shown(categories)}")
        object.__setattr__(self, "categories", tuple(categories))
        are_hashable = all(isinstance(category, Hashable) for category in self.categories or ())
        require(are_hashable, "categories", "be words or numbers", self.categories)

    @property
    def learns(self) -> bool:
        return self.categories is None

    @property
    def size(self) -> int:
        return len(fitted_field(self.categories))

    def bins(self, column: Column) -> NDArray[np.int32]:
        """Return the number of each value's category; ValueError lists unknown values."""
        categories = fitted_field(self.categories)
        numbers = {category: number for number, category in enumerate(categories)}
        try:
            return np.array([numbers[value] for value in column.tolist()], dtype=np.int32)
        except (KeyError, TypeError):
            unknown = dict.fromkeys(map(shown, column.tolist()))
            names = [value for value in unknown if value not in set(map(shown, numbers))]
            raise ValueError(f"Found unknown categories [{', '.join(names)}]") from None

    def knows(self, column: Column) -> NDArray[np.bool_]:
        """Return whether each value is one of the categories."""
        categories = set(fitted_field(self.categories))

        def is_known(value: object) -> bool:
            """Return whether `value` is a learned category; values without a hash never are."""
            try:
                return value in categories
            except TypeError:
                return False

        return np.array([is_known(value) for value in column.tolist()], dtype=bool)

    def _learned(self, column: Column) -> tuple[Category, ...]:
        """Return the given categories, or the sorted distinct values of a column."""
        if self.categories is not None:
            return self.categories
        values = column.tolist()
        if any(map(is_missing, values)):
            raise ValueError(
                "Input contains NaN: a missing value is not a category, unless the coding is "
                f"WithMissing(base={type(self).__name__}(...))"
            )
        try:
            return tuple(sorted(set(values)))
        except TypeError:
            problem = "the categories of an input must be all words or all numbers"
            raise ValueError(problem) from None


@dataclasses.dataclass(frozen=True, kw_only=True)
class Symbolic(Categorical):
    """Categories without order or similarity, with an independent random pattern each.

    Attributes
    ----------
    categories : tuple, optional
        All categories; learned in sorted order where None.
    """

    name: ClassVar[str] = "symbolic"
    categories: tuple[Category, ...] | None = None

    def fit(self, column: Column, n_units: int) -> Symbolic:
        """Return a copy with the categories of the column, unless they were given."""
        categories = self.categories
        are_different = categories is None or 0 < len(set(categories)) == len(categories)
        require(are_different, "categories", "be different and at least one", categories)
        return dataclasses.replace(self, categories=self._learned(column))

    def patterns(self, n_units: int, seed: int) -> NDArray[np.int8]:
        return _core.symbol_patterns(self.size, n_units, seed)

    def correlations(self, n_units: int) -> NDArray[np.float64]:
        return np.eye(self.size)


@dataclasses.dataclass(frozen=True, kw_only=True)
class CorrelationMatrix(Categorical):
    """Categories of known similarity: pattern correlations approach a given matrix.

    Attributes
    ----------
    matrix : array_like, shape (n_categories, n_categories)
        Symmetric, ones on the diagonal, entries in [-1, 1].
    categories : tuple, optional
        The category of each row; the sample's in sorted order where None.

    Examples
    --------
    >>> away = np.abs(np.subtract.outer(np.arange(7), np.arange(7)))
    >>> week = CorrelationMatrix(
    ...     matrix=0.8 ** np.minimum(away, 7 - away),
    ...     categories=("Mon", "Tue", "Wed", "Thu", "Fri", "Sat", "Sun"),
    ... )
    >>> week.bins(np.array(["Sun", "Tue"]))
    array([6, 1], dtype=int32)
    """

    name: ClassVar[str] = "correlation-matrix"
    matrix: ArrayLike
    categories: tuple[Category, ...] | None = None

    def __post_init__(self) -> None:
        """Convert the matrix to tuples of its rows, so that equal codings have equal hashes."""
        super().__post_init__()
        rows = np.atleast_2d(array_of("matrix", self.matrix).astype(np.float64))
        object.__setattr__(self, "matrix", tuple(map(tuple, rows.tolist())))

    def fit(self, column: Column, n_units: int) -> CorrelationMatrix:
        """Check the matrix; return a copy with the categories of its rows."""
        matrix = np.array(self.matrix)
        is_square = matrix.ndim == 2 and matrix.shape[0] == matrix.shape[1]
        is_symmetric = is_square and np.array_equal(matrix, matrix.T)
        require(is_symmetric, "matrix", "be square and symmetric", matrix.tolist())
        are_correlations = np.all(np.diag(matrix) == 1) and np.all(np.abs(matrix) <= 1)
        expected = "have ones on its diagonal and entries in [-1, 1]"
        require(are_correlations, "matrix", expected, matrix.tolist())
        names = self._learned(column)
        if len(set(names)) != len(matrix):
            raise ValueError(
                f"matrix must have a row for each of the categories {shown(names)}, got "
                f"{len(matrix)} rows"
            )
        return dataclasses.replace(self, categories=names)

    def patterns(self, n_units: int, seed: int) -> NDArray[np.int8]:
        return _core.correlation_matrix_patterns(n_units, np.array(self.matrix), seed)

    def correlations(self, n_units: int) -> NDArray[np.float64]:
        return np.array(self.matrix)


@dataclasses.dataclass(frozen=True, kw_only=True)
class WithMissing(Coding):
    """Another coding with an additional, unrelated pattern for None, NaN and pandas.NA.

    Attributes
    ----------
    base : Coding
        Coding of the other values; it learns from them alone.
    unknown : {"missing", "error"}
        Whether a category that was not in the training sample counts as missing.

    Examples
    --------
    >>> color = WithMissing(base=Symbolic()).fit(np.array(["red", None, "blue"]), n_units=100)
    >>> color.bins(np.array(["blue", "red", "pink", None]))
    array([0, 1, 2, 2], dtype=int32)
    """

    name: ClassVar[str] = "with-missing"
    is_numeric: ClassVar[bool] = False  # makes scikit-learn's checks accept NaN
    base: Coding = dataclasses.field(default_factory=RandomInverse)
    unknown: Literal["missing", "error"] = "missing"

    def fit(self, column: Column, n_units: int) -> WithMissing:
        """Return a copy whose base coding has learned the values that are present."""
        one_of("unknown", self.unknown, ("missing", "error"))
        learns = self.learns  # raises first if the base is not a coding
        values = self._values(column[self._is_present(column)])
        if learns and len(values) == 0:
            raise ValueError("every value of an input is missing: there is nothing to learn")
        return dataclasses.replace(self, base=self.base.fit(values, n_units))

    @property
    def learns(self) -> bool:
        is_plain = isinstance(self.base, Coding) and not isinstance(self.base, WithMissing)
        require(is_plain, "base", "be a Coding without missing values", self.base)
        return self.base.learns

    @property
    def size(self) -> int:
        return self.base.size + 1

    def ends(self) -> tuple[float, float] | None:
        return self.base.ends()

    def bins(self, column: Column) -> NDArray[np.int32]:
        """Return the bins of the base coding; missing values have an additional, last bin."""
        is_present = self._is_present(column)
        if isinstance(self.base, Categorical) and self.unknown == "missing":
            is_present &= self.base.knows(column)
        bins = np.full(len(column), self.size - 1, dtype=np.int32)
        bins[is_present] = self.base.bins(self._values(column[is_present]))
        return bins

    def patterns(self, n_units: int, seed: int) -> NDArray[np.int8]:
        """Return the patterns of the base coding, then that of missing values."""
        seed_of_missing = int(np.random.SeedSequence(seed_of(seed)).generate_state(1, np.uint64)[0])
        missing = _core.symbol_patterns(1, n_units, seed_of_missing)
        return np.vstack([self.base.patterns(n_units, seed), missing])

    def correlations(self, n_units: int) -> NDArray[np.float64]:
        correlations = np.eye(self.size)
        correlations[:-1, :-1] = self.base.correlations(n_units)
        return correlations

    def _is_present(self, column: Column) -> NDArray[np.bool_]:
        return np.array([not is_missing(value) for value in column.tolist()], dtype=bool)

    def _values(self, column: Column) -> Column:
        """Convert present values to the base coding's type; ValueError for infinite numbers."""
        if not self.base.is_numeric:
            return column
        values = missing_as_nan(column)
        if not np.isfinite(values).all():
            raise ValueError("Input contains infinity")
        return values


def present(coding: Coding) -> Coding:
    """Return the coding of present values: the base of `WithMissing`, else the coding itself."""
    return coding.base if isinstance(coding, WithMissing) else coding
