"""Codings of categories: unrelated ones, and ones whose similarity the user knows."""

from __future__ import annotations

import dataclasses
from collections.abc import Hashable, Iterable
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.coding.base import Coding, known

__all__ = ["CorrelationMatrix", "Symbolic"]

Category = str | float | int | bool


def listed(categories: Any) -> tuple[Category, ...] | None:
    """Return given categories as a tuple; ValueError for what are no words or numbers."""
    if categories is None:
        return None
    if isinstance(categories, str | bytes) or not isinstance(categories, Iterable):
        raise ValueError(f"categories must be a tuple of values, got {categories!r}")
    found = tuple(categories)
    if not all(isinstance(category, Hashable) for category in found):
        raise ValueError(f"categories must be words or numbers, got {found!r}")
    return found


def rows_of(matrix: Any) -> tuple[tuple[float, ...], ...]:
    """Return the rows of a matrix of numbers; ValueError for what are none."""
    try:
        given = np.asarray(matrix)
        if given.dtype.kind == "c":
            raise ValueError("complex numbers")
        rows = np.atleast_2d(given.astype(np.float64))
    except (OverflowError, TypeError, ValueError) as error:
        raise ValueError(f"matrix must be numbers, got {matrix!r}: {error}") from None
    return tuple(map(tuple, rows.tolist()))


def is_missing(value: Any) -> bool:
    """Return whether a value is None, NaN or pandas.NA, which is not even unlike itself."""
    try:
        return value is None or bool(value != value)
    except TypeError:
        return True


def learned_categories(column: NDArray[Any]) -> tuple[Category, ...]:
    """Return the different values of a column, in order, as plain Python values.

    Raises
    ------
    ValueError
        If values cannot be ordered (words and numbers), or one is missing.
    """
    values = column.tolist()
    if any(map(is_missing, values)):
        raise ValueError("Input contains NaN: a missing value is not a category")
    try:
        return tuple(sorted(set(values)))
    except TypeError:
        raise ValueError("the categories of an input must be all words or all numbers") from None


def _as_word(value: Any) -> Any:
    is_number = isinstance(value, int | float) and not isinstance(value, bool)
    return str(value) if is_number and value == value else value


def bins_of_categories(column: NDArray[Any], categories: tuple[Category, ...]) -> NDArray[np.int32]:
    """Return the place of each value among the categories.

    Raises
    ------
    ValueError
        If a value is none of them.
    """
    places = {category: place for place, category in enumerate(categories)}
    if all(isinstance(category, str) for category in categories):
        # Lists of words and numbers were all words once: models that learned so know "1.0".
        column = np.array([_as_word(value) for value in column.tolist()], dtype=object)
    try:
        return np.array([places[value] for value in column.tolist()], dtype=np.int32)
    except (KeyError, TypeError):
        unknown = [value for value in dict.fromkeys(map(repr, column.tolist()))]
        unknown = [value for value in unknown if value not in set(map(repr, categories))]
        raise ValueError(f"Found unknown categories [{', '.join(unknown)}]") from None


@dataclasses.dataclass(frozen=True, kw_only=True)
class Symbolic(Coding):
    """Categories without any order or likeness: a random pattern each.

    Attributes
    ----------
    categories : tuple, optional
        All categories; learned from the sample, in sorted order, where None.
    """

    name: ClassVar[str] = "symbolic"
    is_numeric: ClassVar[bool] = False
    categories: tuple[Category, ...] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "categories", listed(self.categories))

    def fit(self, column: NDArray[Any], n_units: int) -> Symbolic:
        """Return a copy with the categories known; see `Coding.fit`."""
        given = self.categories
        if given is not None and (not given or len(set(given)) < len(given)):
            raise ValueError(f"categories must be different and at least one, got {given!r}")
        return dataclasses.replace(
            self, categories=learned_categories(column) if given is None else given
        )

    @property
    def learns(self) -> bool:
        """Whether ``fit`` learns from the sample."""
        return self.categories is None

    @property
    def size(self) -> int:
        """The number of categories."""
        return len(known(self.categories))

    def bins(self, column: NDArray[Any]) -> NDArray[np.int32]:
        """Return the place of each category; see `Coding.bins`."""
        return bins_of_categories(column, known(self.categories))

    def patterns(self, n_units: int, seed: int) -> NDArray[np.int8]:
        """Draw the patterns; see `Coding.patterns`."""
        return _core.symbol_patterns(self.size, n_units, seed)

    def correlations(self, n_units: int) -> NDArray[np.float64]:
        """Zero but for a category with itself; see `Coding.correlations`."""
        return np.eye(self.size)


@dataclasses.dataclass(frozen=True, kw_only=True)
class CorrelationMatrix(Coding):
    """Categories whose likeness is given: pattern correlations approach a given matrix.

    Attributes
    ----------
    matrix : array_like, shape (n_categories, n_categories)
        Symmetric, ones on the diagonal, entries in [-1, 1].
    categories : tuple, optional
        The category of each row; those of the sample in sorted order where None.

    Examples
    --------
    Weekdays, of which Sunday is as near to Monday as Monday to Tuesday:

    >>> away = np.abs(np.subtract.outer(np.arange(7), np.arange(7)))
    >>> week = CorrelationMatrix(
    ...     matrix=0.8 ** np.minimum(away, 7 - away),
    ...     categories=("Mon", "Tue", "Wed", "Thu", "Fri", "Sat", "Sun"),
    ... )
    >>> week.bins(np.array(["Sun", "Tue"]))
    array([6, 1], dtype=int32)
    """

    name: ClassVar[str] = "correlation-matrix"
    is_numeric: ClassVar[bool] = False
    matrix: Any
    categories: tuple[Category, ...] | None = None

    def __post_init__(self) -> None:
        object.__setattr__(self, "matrix", rows_of(self.matrix))
        object.__setattr__(self, "categories", listed(self.categories))

    def fit(self, column: NDArray[Any], n_units: int) -> CorrelationMatrix:
        """Return a copy with the categories known; see `Coding.fit`."""
        matrix = np.array(self.matrix)
        is_square = matrix.ndim == 2 and matrix.shape[0] == matrix.shape[1]
        if not is_square or not np.array_equal(matrix, matrix.T):
            raise ValueError(f"matrix must be square and symmetric, got {matrix.tolist()}")
        if not np.all(np.diag(matrix) == 1) or not np.all(np.abs(matrix) <= 1):
            raise ValueError(
                "matrix must have ones on its diagonal and entries in [-1, 1], "
                f"got {matrix.tolist()}"
            )
        names = learned_categories(column) if self.categories is None else self.categories
        if len(set(names)) != len(matrix):
            raise ValueError(
                f"matrix must have a row for each of the categories {names!r}, got "
                f"{len(matrix)} rows"
            )
        return dataclasses.replace(self, categories=names)

    @property
    def learns(self) -> bool:
        """Whether ``fit`` learns from the sample."""
        return self.categories is None

    @property
    def size(self) -> int:
        """The number of categories."""
        return len(self.matrix)

    def bins(self, column: NDArray[Any]) -> NDArray[np.int32]:
        """Return the place of each category; see `Coding.bins`."""
        return bins_of_categories(column, known(self.categories))

    def patterns(self, n_units: int, seed: int) -> NDArray[np.int8]:
        """Draw the patterns; see `Coding.patterns`."""
        return _core.correlation_matrix_patterns(n_units, np.array(self.matrix), seed)

    def correlations(self, n_units: int) -> NDArray[np.float64]:
        """Return the matrix itself; see `Coding.correlations`."""
        return np.array(self.matrix)
