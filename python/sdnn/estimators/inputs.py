"""Checks of samples, targets and labels for estimators whose inputs have codings."""

from __future__ import annotations

import abc
import contextlib
import dataclasses
import datetime
from collections.abc import Iterable, Iterator, Mapping, Sequence
from numbers import Number
from typing import Any, Self

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, ClassifierMixin, RegressorMixin
from sklearn.utils import Tags, assert_all_finite
from sklearn.utils.multiclass import check_classification_targets, unique_labels
from sklearn.utils.validation import validate_data

from sdnn.coding import Coding, WithMissing
from sdnn.coding.symbols import is_missing, missing_as_nan
from sdnn.estimators.columns import (
    Array,
    Codings,
    Floats,
    Sample,
    categorical_columns,
    coding_entries,
    codings_of_columns,
    field_names,
    with_fields,
    with_missing_pattern,
)
from sdnn.estimators.hints import first_column_of_words, hint_about
from sdnn.estimators.network import InputCode
from sdnn.estimators.outliers import OutlierWarning, numbers_to_range, usual_range, warn_caller
from sdnn.estimators.parameters import parameter, words
from sdnn.estimators.training import ClassWeight, without_absent
from sdnn.support.arguments import require, shown

MOST_BEYOND = 30.0  # largest distance of an outlier that is kept, in widths of the usual range
DATES = (datetime.date, datetime.time, datetime.timedelta, np.datetime64, np.timedelta64)
DATES_HINT = "give numbers for it, such as the hour with coding=[(Circular(period=24), columns)]"


def refuse_dates(X: object) -> None:
    """Raise ValueError for a column of dates or times, which scikit-learn may take for numbers."""
    for name, column in columns_of_objects(X):
        try:
            value = next((value for value in column if not is_missing(value)), None)
        except ValueError:  # a cell with an array, which scikit-learn refuses
            return
        if isinstance(value, DATES) or hasattr(value, "to_timestamp"):  # pandas.Period
            raise ValueError(f"X has dates or times in column {name!r}: {DATES_HINT}")


def columns_of_objects(X: Any) -> Iterator[tuple[object, Iterable[object]]]:
    """Yield the name and the values of each column whose type does not say that it has numbers."""
    if hasattr(X, "columns") and hasattr(X, "dtypes") and hasattr(X, "iloc"):  # pandas
        for index, (name, column_type) in enumerate(zip(X.columns, X.dtypes, strict=True)):
            if column_type.kind in "OmM":
                yield name, X.iloc[:, index]
    elif hasattr(X, "iter_columns"):  # polars
        for column in X.iter_columns():
            yield column.name, column
    else:
        try:
            table = np.array(X, dtype=object) if isinstance(X, list | tuple) else X
        except ValueError:  # parts of different sizes
            return
        is_array = getattr(table, "ndim", 0) == 2 and hasattr(table, "dtype")
        if is_array and table.dtype.kind in "OmM":
            yield from enumerate(np.asarray(table).T)


def with_names(x: Any) -> Any:
    """Return a row of a data frame of pandas as a mapping, another sample unchanged."""
    is_row = getattr(x, "ndim", 0) == 1 and hasattr(x, "index") and hasattr(x, "to_dict")
    return x.to_dict() if is_row and all(isinstance(name, str) for name in x.index) else x


def with_types_kept(X: object) -> object:
    """Return samples in a form in which scikit-learn keeps the type of every value."""
    if hasattr(X, "columns") and hasattr(X, "astype"):
        return X.astype(object)  # pandas cannot convert categories and nullable numbers together
    if hasattr(X, "dtype"):
        return X
    try:
        is_of_words = np.asarray(X).dtype.kind in "SU"
    except ValueError:  # rows of different lengths
        return X
    return np.array(X, dtype=object) if is_of_words else X  # NumPy would turn numbers into words


@dataclasses.dataclass(eq=False, repr=False)
class CodedInputs(BaseEstimator):
    """Validation of samples for estimators with a parameter ``coding``."""

    coding: Codings = parameter("random-inverse", str, Coding, list, tuple, kw_only=False)
    ranges: str = parameter("auto", words("auto", "all", "robust"))

    @property
    def _parameter_constraints(self) -> dict[str, list[object]]:
        """Return scikit-learn's constraints, read from the metadata of the fields."""
        return {
            field.name: field.metadata["constraints"]
            for field in dataclasses.fields(self)
            if "constraints" in field.metadata
        }

    _warns = True
    """Whether `fit` warns of values outside of ranges."""
    _has_outliers = False
    """Whether the last `fit` left outliers out of a range."""

    def set_params(self, **params: object) -> Self:
        """Set parameters; ``coding__length_scale`` and the like replace fields of codings.

        In a list, ``coding__0__period`` is a field of the first coding, ``coding__period`` one of
        every coding that has it.
        """
        names = [name for name in params if name.startswith("coding__")]
        fields = {name.removeprefix("coding__"): params.pop(name) for name in names}
        super().set_params(**params)
        if fields:
            self.coding = with_fields(self.coding, fields)
        return self

    def get_params(self, deep: bool = True) -> dict[str, object]:
        """Return the parameters; ``deep`` adds fields of codings, as `set_params` names them."""
        params: dict[str, object] = super().get_params(deep)
        if deep:
            is_list = isinstance(self.coding, list | tuple)
            with contextlib.suppress(ValueError):  # `fit` raises the error of an invalid coding
                for number, (coding, _) in enumerate(coding_entries(self.coding)):
                    prefix = f"coding__{number}__" if is_list else "coding__"
                    params |= {prefix + name: getattr(coding, name) for name in field_names(coding)}
        return params

    def __sklearn_tags__(self) -> Tags:
        """Declare that numbers may be missing."""
        tags = super().__sklearn_tags__()
        tags.input_tags.allow_nan = True
        return tags

    def fit(self, X: ArrayLike, y: ArrayLike, sample_weight: ArrayLike | None = None) -> Self:
        """Learn ranges and outputs, and what the estimator predicts with.

        Parameters
        ----------
        X : array_like, shape (n_samples, n_features)
        y : array_like, shape (n_samples,) or (n_samples, n_outputs)
            Several outputs for regressors only.
        sample_weight : array_like, shape (n_samples,), optional
            How many samples each one counts for, by default 1. A network is presented with them so
            many times per epoch on average; if none reaches 1, they are scaled to a mean of 1.
            Samples of weight 0 count as absent.

        Raises
        ------
        ValueError
            For an impossible parameter, one that a warm start cannot follow, unusable data, or
            training that needs more than ``memory_limit``.
        OverflowError
            Before a weight of a network could leave its range.
        """
        # An interrupt of scikit-learn's _fit_context could leave its global setting changed.
        self._validate_params()
        work = self._copy_to_train()
        work._fit(*without_absent(X, y, sample_weight))
        self.__dict__ = work.__dict__
        return self

    @abc.abstractmethod
    def _fit(self, X: ArrayLike, y: ArrayLike, sample_weight: ArrayLike | None) -> None:
        """Check the samples and learn from them."""

    def _copy_to_train(self) -> Self:
        """Return a shallow copy to train, so that an error leaves this estimator unchanged."""
        work = object.__new__(type(self))
        work.__dict__.update(self.__dict__)
        work.__dict__.pop("_has_outliers", None)
        return work

    def _validated(
        self,
        X: object,
        y: object = "no_validation",
        codings: Sequence[Coding] | None = None,
        **options: bool | int,
    ) -> Any:
        """Check data by scikit-learn's rules, but allow text where a coding reads it.

        ``codings`` are the fitted codings of the inputs; None if they are to be learned, and
        numbers to be checked with them.
        """
        refuse_dates(X)
        all_codings = (*(coding for coding, _ in coding_entries(self.coding)), *(codings or ()))
        numeric = all(coding.is_numeric for coding in all_codings)
        numeric = numeric and (codings is not None or not categorical_columns(X))
        options["reset"] = codings is None
        try:
            validated = validate_data(
                self,
                X if numeric else with_types_kept(X),
                y,
                dtype=np.float64 if numeric else None,
                ensure_all_finite="allow-nan" if numeric else False,  # NaN may have a pattern
                **options,
            )
        except ValueError as error:
            if "could not convert string" in str(error) and np.asarray(X).dtype.kind in "OSU":
                name, column = first_column_of_words(X)
                raise ValueError(f"{error} in column {name!r}; {hint_about(column)}") from None
            raise
        if codings is not None:
            table = validated[0] if isinstance(validated, tuple) else validated
            self._check_numbers(table, codings)
        return validated

    def _check_numbers(self, table: Array, codings: Sequence[Coding]) -> None:
        """Raise ValueError unless the columns of numeric codings hold only finite numbers."""
        if table.dtype == np.float64 and np.isfinite(table).all():
            return
        names = self._feature_names() or range(len(codings))
        for index, (name, coding) in enumerate(zip(names, codings, strict=True)):
            if not coding.is_numeric:
                continue
            try:
                numbers = np.asarray(table[:, index], dtype=np.float64)
            except (TypeError, ValueError) as error:  # pandas.NA raises TypeError, for example
                hint = hint_about(table[:, index].tolist())
                raise ValueError(f"{error} in column {name!r}; {hint}") from None
            if np.isnan(numbers).any():
                raise ValueError(
                    f"X contains NaN in column {name!r}, which lacked no value in fit: fill it in,"
                    f" or fit with coding=[('with-missing', [{name!r}])]"
                )
            assert_all_finite(numbers, input_name="X")

    def _feature_names(self) -> list[str] | None:
        names = getattr(self, "feature_names_in_", None)
        return None if names is None else names.tolist()

    def _codings(self, X: object, table: Array) -> list[Coding]:
        """Return the unfitted coding of each input, and check the table's numbers."""
        codings = codings_of_columns(self.coding, self._feature_names(), table.shape[1], X)
        codings = [with_missing_pattern(coding, table[:, i]) for i, coding in enumerate(codings)]
        if any(coding.learns for coding in codings):
            self._require_two_samples(table, "ranges and categories that are not given")
        self._check_numbers(table, codings)
        return codings

    def _fit_codings(
        self,
        codings: Sequence[Coding],
        table: Array,
        n_units: int,
        names: Sequence[object] | None = None,
    ) -> list[Coding]:
        """Return the fitted coding of each column of a table; ``ranges`` decides about outliers.

        Columns have the names of the features, or their numbers, unless others are given.
        """
        fitted = []
        names = names or self._feature_names() or range(len(codings))
        for index, (name, coding) in enumerate(zip(names, codings, strict=True)):
            column = table[:, index]
            numbers = numbers_to_range(coding, column)
            if numbers is not None and np.isfinite(numbers).any():
                low, high = self._range(f"column {name!r} of X", numbers[np.isfinite(numbers)])
                column = column[~((numbers < low) | (numbers > high))]
            try:
                fitted.append(coding.fit(column, n_units))
            except ValueError as error:
                raise ValueError(f"{error} in column {name!r}") from None
        return fitted

    def _range(self, name: str, values: Floats) -> tuple[float, float]:
        """Return the range of values; ``ranges`` decides about outliers.

        "auto" keeps outliers of heavy tails, up to 30 times the width of the other values away.
        """
        usual = usual_range(values)
        low, high = full = float(values.min()), float(values.max())
        if usual == full or self.ranges == "all":
            return full
        if self.ranges == "robust":
            return usual
        beyond = max(high - usual[1], usual[0] - low)
        is_left_out = beyond > MOST_BEYOND * (usual[1] - usual[0])
        outlier = high if high > usual[1] else low
        effect = "the range of all is too wide to tell those apart; ranges='robust' leaves it out"
        if is_left_out:
            effect = "it is left out of the range, and clipped; ranges='all' takes it in"
        others = f"far from the other values, which are within {list(usual)}"
        if self._warns:
            warn_caller(f"{name} has {outlier}, {others}: {effect}", OutlierWarning)
        self._has_outliers |= is_left_out
        return usual if is_left_out else full

    def _require_two_samples(self, samples: Array, what: str) -> None:
        """Raise scikit-learn's ValueError for a single sample."""
        if len(samples) < 2:
            raise ValueError(
                f"Found array with {len(samples)} sample(s) while a minimum of 2 is required by "
                f"{type(self).__name__} to learn {what}"
            )

    def _row(self, x: Sample, code: InputCode) -> Array:
        """Return one sample, a row or a mapping from names, checked, shape (n_features,)."""
        codings = code.codings
        if self._feature_names():
            x = with_names(x)
        values = self._values_of(x, codings) if isinstance(x, Mapping) else x
        if code.is_numeric:
            try:
                row = np.asarray(values, dtype=np.float64)
            except (TypeError, ValueError):
                try:
                    row = missing_as_nan(np.array(values, dtype=object))
                except (TypeError, ValueError):
                    raise ValueError(f"x must be numbers, got {shown(x)}") from None
        else:
            row = np.array(values, dtype=object)
        require(row.shape == (len(codings),), "x", f"have {len(codings)} features", x)
        if not code.is_numeric:
            self._check_numbers(row[None], codings)
            return row
        is_number = np.isfinite(row)
        if not is_number.all():
            is_number |= np.isnan(row) & code.may_lack
            require(is_number.all(), "x", "be finite numbers", x)
        return row

    def _values_of(self, x: Mapping[str, object], codings: tuple[Coding, ...]) -> list[object]:
        """Return a sample's values in feature order, None for missing ones."""
        names = self._feature_names()
        if names is None:
            raise ValueError("x must be a 1-D array: the features were learned without names")
        if len(x) == len(names):
            with contextlib.suppress(KeyError):
                return [x[name] for name in names]
        coded = zip(names, codings, strict=True)
        optional = {name for name, coding in coded if isinstance(coding, WithMissing)}
        if not set(names) - optional <= set(x) <= set(names):
            note = f", of which {sorted(optional)} may be missing" if optional else ""
            raise ValueError(f"x must have the features {names}{note}, got {list(x)}")
        return [x.get(name) for name in names]

    def _first_row(self, x: Sample) -> Array:
        """Return the first sample of a stream as a table; a mapping names the features."""
        x = with_names(x)
        names = list(x) if isinstance(x, Mapping) else None
        row = np.array(list(x.values()) if isinstance(x, Mapping) else x, dtype=object)
        are_words = all(isinstance(name, str) for name in names or ())
        expected = "be a 1-D array, or a mapping with words as keys"
        require(row.ndim == 1 and are_words, "x", expected, x)
        table: Array = self._validated(row[None])
        if names is not None:
            self.feature_names_in_ = np.array(names, dtype=object)
        return table


def as_numbers(y: object) -> object:
    """Return targets unchanged, or words and objects as numbers, missing ones as NaN."""
    try:
        targets = np.asarray(y)
    except ValueError:  # rows of different lengths, which scikit-learn refuses
        return y
    if targets.dtype.kind in "mM":
        raise ValueError("y must be numbers, got dates or times")
    if targets.ndim == 0 or targets.dtype.kind not in "OSU":
        return y
    try:
        return missing_as_nan(targets)
    except (TypeError, ValueError) as error:
        raise ValueError(f"y must be numbers: {error}") from None


class CodedRegressor(RegressorMixin, CodedInputs):
    """Validation of numeric targets, of one output or several."""

    def __sklearn_tags__(self) -> Tags:
        """Declare that several outputs can be learned at once."""
        tags = super().__sklearn_tags__()
        tags.target_tags.multi_output = True
        return tags

    def _check_samples(
        self, X: object, y: object, codings: Sequence[Coding] | None = None, in_fit: bool = False
    ) -> tuple[Array, Floats]:
        """Return samples and targets, checked as by `_validated`."""
        if y is None:
            # scikit-learn's message for several outputs is less clear.
            raise ValueError(
                f"{type(self).__name__} requires y to be passed, but the target y is None"
            )
        numbers = as_numbers(y)
        table, targets = self._validated(X, numbers, codings, multi_output=True, y_numeric=True)
        return table, np.asarray(targets, dtype=np.float64)

    def _ranges_of(self, targets: Floats) -> tuple[Floats, Floats]:
        """Return the lowest and highest target of each output, perhaps without outliers."""
        low, high = zip(*(self._range("y", column) for column in targets.T), strict=True)
        return np.array(low), np.array(high)


@dataclasses.dataclass(eq=False, repr=False)
class CodedClassifier(ClassifierMixin, CodedInputs):
    """Validation of labels, and prediction of the label with the largest score."""

    class_weight: ClassWeight = parameter(None, words("balanced"), dict, None)

    def _check_samples(
        self, X: object, y: object, codings: Sequence[Coding] | None = None, in_fit: bool = False
    ) -> tuple[Array, Array]:
        """Return samples and labels, checked as by `_validated`."""
        table, labels = self._validated(X, y, codings, ensure_min_samples=2 if in_fit else 1)
        examples: dict[type, object] = {}
        for label in labels.ravel().tolist() if labels.dtype == object else ():
            label_type = str if isinstance(label, str) else type(label)
            examples[Number if isinstance(label, Number) else label_type] = label
        if len(examples) > 1:
            mixed = shown(list(examples.values()))
            raise ValueError(f"y must have labels that are all words or all numbers, got {mixed}")
        check_classification_targets(labels)
        return table, labels

    def _set_classes(self, y: ArrayLike) -> None:
        """Store the sorted labels; ValueError if there are fewer than two."""
        self.classes_: Array = unique_labels(y)
        if len(self.classes_) < 2:
            raise ValueError(f"at least two classes are needed, got one class: {self.classes_!r}")

    @abc.abstractmethod
    def decision_function(self, X: ArrayLike) -> Floats:
        """Return the score of each class; of two classes, positive for the second."""

    @staticmethod
    def _winners(decision: Floats) -> NDArray[np.int64]:
        """Return the number of each sample's class, from scores as of `decision_function`."""
        winners = decision > 0 if decision.ndim == 1 else np.argmax(decision, axis=1)
        return np.asarray(winners, dtype=np.int64)

    def predict(self, X: ArrayLike) -> Array:
        """Predict the labels of samples, shape (n_samples,)."""
        winners = self._winners(self.decision_function(X))  # may raise NotFittedError first
        return self.classes_[winners]
