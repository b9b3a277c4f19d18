"""Samples whose inputs have codings: checked by scikit-learn's rules, words let through."""

from __future__ import annotations

import dataclasses
from typing import Any, TypeVar

import numpy as np
from numpy.typing import NDArray
from sklearn.base import BaseEstimator
from sklearn.utils import assert_all_finite
from sklearn.utils.validation import validate_data

from sdnn.coding import Coding, RandomInverse, coding_named
from sdnn.estimators.columns import coding_entries, codings_of_columns

__all__ = ["CodedInputs"]

Self = TypeVar("Self", bound="CodedInputs")
WORDS_HINT = "words need a coding of their own, such as coding=[('symbolic', columns)]"


def as_it_came(X: Any) -> Any:
    """Return samples with words as they are to be checked: every value of its own type."""
    if hasattr(X, "columns") and hasattr(X, "astype"):
        return X.astype(object)  # pandas has no common type of categories and its own numbers
    if hasattr(X, "dtype"):
        return X
    try:
        is_of_words = np.asarray(X).dtype.kind in "SU"
    except ValueError:  # rows of different lengths
        return X
    return np.array(X, dtype=object) if is_of_words else X  # else numbers and NaN become words


class CodedInputs(BaseEstimator):
    """Validation of samples for estimators with a parameter ``coding``."""

    coding: Any

    def set_params(self: Self, **params: Any) -> Self:
        """Set parameters; ``coding__length_scale`` and the like replace a field of the coding.

        Raises
        ------
        ValueError
            For an unknown parameter or field, or a field where columns have codings of their own.
        """
        fields = {name[8:]: params.pop(name) for name in list(params) if name[:8] == "coding__"}
        super().set_params(**params)
        if fields:
            if isinstance(self.coding, list | tuple):
                raise ValueError(
                    f"coding__{next(iter(fields))} needs one coding for all inputs, got a list"
                )
            coding = coding_named(self.coding)
            try:
                self.coding = dataclasses.replace(coding, **fields)  # type: ignore[type-var]
            except TypeError:
                raise ValueError(f"{coding!r} must have the fields {sorted(fields)}") from None
        return self

    def _scratch(self: Self) -> Self:
        """Return an estimator to be trained instead of this one, which takes its attributes over.

        So whatever fails leaves this one as it was. They share what they have until then: nothing
        of it may be changed in place.
        """
        work = object.__new__(type(self))
        work.__dict__.update(self.__dict__)
        return work

    def _validated(self, X: Any, y: Any = "no_validation", **options: Any) -> Any:
        """Check data by scikit-learn's rules; words are let through where a coding takes them."""
        if isinstance(self.coding, list | tuple):
            numeric = all(coding.is_numeric for coding, _ in coding_entries(self.coding))
        else:
            numeric = coding_named(self.coding).is_numeric
        checks: dict[str, Any] = (
            {"dtype": np.float64} if numeric else {"dtype": None, "ensure_all_finite": False}
        )
        try:
            return validate_data(self, X if numeric else as_it_came(X), y, **checks, **options)
        except ValueError as error:
            if "could not convert string" in str(error) and np.asarray(X).dtype.kind in "OSU":
                raise ValueError(f"{error}; {WORDS_HINT}") from None
            raise

    def _finite(self, table: NDArray[Any], codings: Any) -> NDArray[Any]:
        """Check the numbers of a table that also holds words."""
        for index, coding in enumerate(codings):
            if table.dtype != np.float64 and coding.is_numeric:
                try:
                    numbers = np.asarray(table[:, index], dtype=np.float64)
                except (TypeError, ValueError) as error:  # pandas.NA is of no type
                    raise ValueError(f"{error} in column {index}; {WORDS_HINT}") from None
                assert_all_finite(numbers, input_name="X")
        return table

    def _listed_names(self) -> list[str] | None:
        names = getattr(self, "feature_names_in_", None)
        return None if names is None else names.tolist()

    def _codings(self, X: Any, table: NDArray[Any]) -> list[Coding]:
        """Return the coding of each input, not fitted yet, and check the table's numbers."""
        codings = codings_of_columns(
            self.coding, RandomInverse(), self._listed_names(), table.shape[1], X
        )
        if any(coding.learns for coding in codings):
            self._need_two(table, "ranges and categories that are not given")
        self._finite(table, codings)
        return codings

    def _need_two(self, samples: NDArray[Any], what: str) -> None:
        """ValueError, in scikit-learn's words, if one sample has to teach what it cannot."""
        if len(samples) < 2:
            raise ValueError(
                f"Found array with {len(samples)} sample(s) while a minimum of 2 is required by "
                f"{type(self).__name__} to learn {what}"
            )
