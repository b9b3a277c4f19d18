"""Samples whose inputs have codings: columns, pairs and scikit-learn's checks."""

from __future__ import annotations

import abc
import contextlib
import dataclasses
import datetime
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from numbers import Number
from typing import Any, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, RegressorMixin
from sklearn.utils import assert_all_finite
from sklearn.utils.multiclass import check_classification_targets, unique_labels
from sklearn.utils.validation import validate_data

from sdnn.coding import Coding, RandomInverse, Symbolic, WithMissing, coding_named
from sdnn.coding.symbols import is_missing, missing_as_nan
from sdnn.estimators.hints import first_of_words, hint_about
from sdnn.estimators.outliers import OutlierWarning, numbers_to_range, usual_range, warn_caller
from sdnn.estimators.parameters import parameter, words
from sdnn.support.arguments import require, shown

Columns = int | str | slice | Sequence[int] | Sequence[str] | Sequence[bool] | Callable[[Any], Any]
Pairs = list[tuple[int, int]]
Array = NDArray[Any]
Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Self = TypeVar("Self", bound="CodedInputs")
MOST_BEYOND = 30.0  # outliers that are kept, in widths of the range of the others
PAIR_BUDGET = 500  # pairs that are formed by default
DATES = (datetime.date, datetime.time, datetime.timedelta, np.datetime64, np.timedelta64)
DATES_HINT = "give numbers for it, such as the hour with coding=[(Circular(period=24), columns)]"


def one_index(column: Any, names: Sequence[str] | None, n_inputs: int) -> int:
    """Return the index of a feature given by name or number.

    >>> one_index("y", ["x", "y"], 2), one_index(-1, None, 3)
    (1, 2)
    """
    if isinstance(column, str):
        if names is None:
            raise ValueError(f"feature {column!r} is given by name, but X has no feature names")
        if column not in names:
            raise ValueError(f"X has no feature named {column!r}")
        return list(names).index(column)
    if isinstance(column, bool | np.bool_) or not isinstance(column, int | np.integer):
        raise ValueError(f"a feature is given by its name or number, got {shown(column)}")
    if not -n_inputs <= column < n_inputs:
        raise ValueError(f"X has {n_inputs} features, there is no number {column}")
    return int(column) % n_inputs


def column_indices(
    columns: Columns, names: Sequence[str] | None, n_inputs: int, table: Any = None
) -> list[int]:
    """Return the indices of features given as to scikit-learn's ColumnTransformer.

    >>> column_indices(slice(1, None), None, 3), column_indices([True, False, True], None, 3)
    ([1, 2], [0, 2])
    """
    if callable(columns):
        columns = columns(table)
    if isinstance(columns, slice):
        return list(range(n_inputs))[columns]
    if isinstance(columns, str) or not isinstance(columns, Iterable):
        return [one_index(columns, names, n_inputs)]
    listed: list[Any] = list(columns)
    if listed and all(isinstance(column, bool | np.bool_) for column in listed):
        if len(listed) != n_inputs:
            raise ValueError(f"a mask must have {n_inputs} entries, got {len(listed)}")
        return np.flatnonzero(listed).tolist()
    return [one_index(column, names, n_inputs) for column in listed]


def coding_entries(coding: Any) -> list[tuple[Coding, Columns]]:
    """Return the entries (coding, columns) of a coding or a list, names replaced."""
    if not isinstance(coding, list | tuple):
        return [(coding_named(coding), slice(None))]
    require(coding, "coding", "name a coding for some columns", coding)
    entries = []
    for entry in coding:
        is_pair = isinstance(entry, list | tuple) and len(entry) == 2
        require(is_pair, "coding", "be a list of (coding, columns)", entry)
        entries.append((coding_named(entry[0]), entry[1]))
    return entries


def with_fields(coding: Any, fields: Mapping[str, Any]) -> Any:
    """Return a coding, or a list of (coding, columns), with some fields replaced.

    ``base__period`` is a field of the coding ``base``. In a list, ``0__period`` is a field of the
    first coding and ``period`` one of every coding that has it.

    >>> with_fields([("circular", ["hour"]), ("symbolic", ["day"])], {"period": 24.0})[0][0].period
    24.0
    """
    if not isinstance(coding, list | tuple):
        return with_own_fields(coding_named(coding), fields)
    reached: set[str] = set()
    entries = []
    for number, (one, columns) in enumerate(coding_entries(coding)):
        given = {name: value for name, value in fields.items() if has_field(one, name)}
        named = {name: name.removeprefix(f"{number}__") for name in fields}
        own = {short: fields[name] for name, short in named.items() if short != name}
        reached |= set(given) | {name for name, short in named.items() if short != name}
        entries.append((with_own_fields(one, {**given, **own}), columns))
    if unknown := set(fields) - reached:
        raise ValueError(
            f"coding__{min(unknown)} must be a field of a coding in the list, or of the first with "
            f"coding__0__, got the list {shown(coding)}"
        )
    return entries


def has_field(coding: Coding, name: str) -> bool:
    """Return whether a coding has a field of this name, before ``__``."""
    return name.partition("__")[0] in field_names(coding)


def field_names(coding: Coding) -> list[str]:
    """Return the names of a coding's fields."""
    of_data: Any = coding if dataclasses.is_dataclass(coding) else None
    return [] if of_data is None else [field.name for field in dataclasses.fields(of_data)]


def with_own_fields(coding: Coding, fields: Mapping[str, Any]) -> Coding:
    """Return a coding with some fields, or fields of these, replaced."""
    new: dict[str, Any] = {}
    inner: dict[str, dict[str, Any]] = {}
    for name, value in fields.items():
        head, _, rest = name.partition("__")
        if head not in field_names(coding):
            raise ValueError(f"{coding!r} must have the fields {sorted(fields)}")
        if rest:
            inner.setdefault(head, {})[rest] = value
        else:
            new[head] = value
    for head, given in inner.items():
        new[head] = with_fields(new.get(head, getattr(coding, head)), given)
    return dataclasses.replace(coding, **new) if new else coding  # type: ignore[type-var]


def of_categories(table: Any) -> list[int]:
    """Return the columns of a data frame whose type is "category"."""
    kinds = table.dtypes if hasattr(table, "columns") and hasattr(table, "dtypes") else ()
    return [index for index, kind in enumerate(kinds) if str(kind) == "category"]


def codings_of_columns(
    coding: Any, names: Sequence[str] | None, n_inputs: int, table: Any = None
) -> list[Coding]:
    """Return the coding of each feature, random-inverse where a list has none.

    Categories of a data frame are symbols, which may be missing, unless a list or a `Coding` has
    another coding for them.

    >>> [coding.name for coding in codings_of_columns([("anchor", [1])], None, 2)]
    ['random-inverse', 'anchor']
    """
    found: dict[int, Coding] = {}
    for one, columns in coding_entries(coding):
        for index in column_indices(columns, names, n_inputs, table):
            if index in found:
                raise ValueError(f"feature {index} has more than one coding")
            found[index] = one
    for index in of_categories(table):
        if isinstance(coding, str) or index not in found:
            found[index] = WithMissing(base=Symbolic())
    return [found.get(index) or RandomInverse() for index in range(n_inputs)]


def lacking(coding: Coding, column: Array) -> Coding:
    """Return the coding of a column: with a pattern for missing numbers, if it lacks some."""
    if not coding.is_numeric:
        return coding
    is_float = column.dtype == np.float64
    lacks = np.isnan(column).any() if is_float else any(map(is_missing, column.tolist()))
    return WithMissing(base=coding) if lacks else coding


def input_pairs(pairs: Any, names: Sequence[str] | None, n_inputs: int, seed: int = 0) -> Pairs:
    """Return the pairs (modified, modifier) of features; (mu, mu) is mu's plain pattern.

    "all" gives every pair of different features. Other words give at most `PAIR_BUDGET` of them,
    drawn with the seed so that each input is modified, and modifies, equally often.

    >>> input_pairs("all", None, 3)
    [(0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1)]
    >>> input_pairs([("a", "b"), ("a", None)], ["a", "b"], 2)
    [(0, 1), (0, 0)]
    >>> len(input_pairs("budget", None, 100))
    500
    """
    if isinstance(pairs, str):
        away: NDArray[np.int64] = np.arange(1, n_inputs)
        if pairs != "all" and n_inputs * len(away) > PAIR_BUDGET:
            random = np.random.RandomState(seed)
            away = random.permutation(away)[: max(1, PAIR_BUDGET // n_inputs)]
        inputs = range(n_inputs)
        return sorted((mu, int(mu + step) % n_inputs) for mu in inputs for step in away) or [(0, 0)]
    is_listed = isinstance(pairs, Iterable) and not isinstance(pairs, Iterator)
    require(is_listed, "pairs", "be a list of (modified, modifier)", pairs)
    found = []
    for pair in pairs:
        if not isinstance(pair, list | tuple | np.ndarray) or len(pair) != 2:
            raise ValueError(f"a pair is (modified, modifier), got {shown(pair)}")
        mu = one_index(pair[0], names, n_inputs)
        found.append((mu, mu if pair[1] is None else one_index(pair[1], names, n_inputs)))
        if pair[1] is not None and found[-1][0] == found[-1][1]:
            raise ValueError(f"a feature cannot modify itself, got {shown(pair)}; use None")
    if not found:
        raise ValueError(f"pairs must not be empty, got {pairs!r}")
    return found


def check_labels(y: Array) -> None:
    """Raise ValueError for what are no labels of classes."""
    kinds: dict[type, Any] = {}
    for label in y.ravel().tolist() if y.dtype == object else ():
        kinds[next((kind for kind in (str, Number) if isinstance(label, kind)), type(label))] = (
            label
        )
    if len(kinds) > 1:
        mixed = shown(list(kinds.values()))
        raise ValueError(f"y must have labels that are all words or all numbers, got {mixed}")
    check_classification_targets(y)


def class_labels(y: ArrayLike) -> Array:
    """Return the labels, sorted; ValueError for fewer than two."""
    classes: Array = unique_labels(y)
    if len(classes) < 2:
        raise ValueError(f"at least two classes are needed, got one class: {classes!r}")
    return classes


def refuse_dates(X: Any) -> None:
    """Raise ValueError for a column of dates or times, which scikit-learn may take for numbers."""
    if hasattr(X, "iloc") and hasattr(X, "columns"):
        names, rows = list(X.columns), X.head(1).astype(object).to_numpy()
    elif getattr(X, "ndim", 0) == 2 and getattr(X, "dtype", np.dtype(float)).kind in "OmM":
        names, rows = list(range(X.shape[1])), X[:1]
    else:
        return
    for name, value in zip(names, rows[0] if len(rows) else (), strict=False):
        if isinstance(value, DATES) or hasattr(value, "to_timestamp"):  # a period of pandas
            raise ValueError(f"X has dates or times in column {name!r}: {DATES_HINT}")


def as_it_came(X: Any) -> Any:
    """Return samples so that scikit-learn checks every value with its own type."""
    if hasattr(X, "columns") and hasattr(X, "astype"):
        return X.astype(object)  # pandas has no common type of categories and its own numbers
    if hasattr(X, "dtype"):
        return X
    try:
        is_of_words = np.asarray(X).dtype.kind in "SU"
    except ValueError:  # rows of different lengths
        return X
    return np.array(X, dtype=object) if is_of_words else X  # else numbers and NaN become words


@dataclasses.dataclass(eq=False, repr=False)
class CodedInputs(BaseEstimator):
    """Validation of samples for estimators with a parameter ``coding``."""

    coding: Any = parameter("random-inverse", str, Coding, list, tuple, kw_only=False)
    ranges: str = parameter("auto", words("auto", "all", "robust"))

    @property
    def _parameter_constraints(self) -> dict[str, list[Any]]:
        declared = [one for one in dataclasses.fields(self) if "constraints" in one.metadata]
        return {one.name: one.metadata["constraints"] for one in declared}

    _has_outliers = False
    """Whether values were left out of a range that was learned."""

    def set_params(self: Self, **params: Any) -> Self:
        """Set parameters; ``coding__length_scale`` and the like replace fields of codings.

        In a list, ``coding__0__period`` is a field of the first coding, ``coding__period`` one of
        every coding that has it.
        """
        fields = {name[8:]: params.pop(name) for name in list(params) if name[:8] == "coding__"}
        super().set_params(**params)
        if fields:
            self.coding = with_fields(self.coding, fields)
        return self

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Return the parameters; ``deep`` adds fields of codings, as `set_params` names them."""
        params: dict[str, Any] = super().get_params(deep)
        if deep:
            is_list = isinstance(self.coding, list | tuple)
            with contextlib.suppress(ValueError):  # of a coding that `fit` will refuse
                for number, (one, _) in enumerate(coding_entries(self.coding)):
                    prefix = f"coding__{number}__" if is_list else "coding__"
                    params |= {prefix + name: getattr(one, name) for name in field_names(one)}
        return params

    def __sklearn_tags__(self) -> Any:
        """Declare that numbers may be missing."""
        tags = super().__sklearn_tags__()
        tags.input_tags.allow_nan = True
        return tags

    @abc.abstractmethod
    def _fitted_codings(self) -> Sequence[Coding]:
        """Return the fitted coding of each input, none before `fit`."""

    def _scratch(self: Self) -> Self:
        """Return a shallow copy to train, so that failures leave this one unchanged."""
        work = object.__new__(type(self))
        work.__dict__.update(self.__dict__)
        return work

    def _validated(self, X: Any, y: Any = "no_validation", **options: Any) -> Any:
        """Check data by scikit-learn's rules; words pass where a coding takes them."""
        refuse_dates(X)
        numeric = all(coding.is_numeric for coding, _ in coding_entries(self.coding))
        if options["reset"]:
            numeric = numeric and not of_categories(X)
        else:
            numeric = numeric and all(coding.is_numeric for coding in self._fitted_codings())
        # `_finite` looks for numbers that are not finite, as missing ones have a pattern.
        checks: dict[str, Any] = {"dtype": np.float64 if numeric else None}
        checks["ensure_all_finite"] = "allow-nan" if numeric else False
        try:
            return validate_data(self, X if numeric else as_it_came(X), y, **checks, **options)
        except ValueError as error:
            if "could not convert string" in str(error) and np.asarray(X).dtype.kind in "OSU":
                name, column = first_of_words(X)
                raise ValueError(f"{error} in column {name!r}; {hint_about(column)}") from None
            raise

    def _finite(self, table: Array, codings: Sequence[Coding]) -> Array:
        """Check the numbers of a table, of which only some columns may lack values."""
        if table.dtype == np.float64 and np.isfinite(table).all():
            return table
        names = self._feature_names() or range(len(codings))
        for index, (name, coding) in enumerate(zip(names, codings, strict=True)):
            if not coding.is_numeric:
                continue
            try:
                numbers = np.asarray(table[:, index], dtype=np.float64)
            except (TypeError, ValueError) as error:  # pandas.NA is of no type
                hint = hint_about(table[:, index].tolist())
                raise ValueError(f"{error} in column {name!r}; {hint}") from None
            if np.isnan(numbers).any():
                raise ValueError(
                    f"X contains NaN in column {name!r}, which lacked no value in fit: fill it in,"
                    f" or fit with coding=[('with-missing', [{name!r}])]"
                )
            assert_all_finite(numbers, input_name="X")
        return table

    def _feature_names(self) -> list[str] | None:
        names = getattr(self, "feature_names_in_", None)
        return None if names is None else names.tolist()

    def _codings(self, X: Any, table: Array) -> list[Coding]:
        """Return the unfitted coding of each input, and check the table's numbers."""
        codings = codings_of_columns(self.coding, self._feature_names(), table.shape[1], X)
        codings = [lacking(coding, table[:, index]) for index, coding in enumerate(codings)]
        if any(coding.learns for coding in codings):
            self._need_two(table, "ranges and categories that are not given")
        self._finite(table, codings)
        return codings

    def _fit_codings(self, codings: Sequence[Coding], table: Array, n_units: int) -> list[Coding]:
        """Return the fitted coding of each input; ranges are learned as ``ranges`` says."""
        fitted = []
        for index, coding in enumerate(codings):
            column = table[:, index]
            numbers = numbers_to_range(coding, column)
            if numbers is not None and np.isfinite(numbers).any():
                low, high = self._range(f"column {index} of X", numbers[np.isfinite(numbers)])
                column = column[~((numbers < low) | (numbers > high))]
            try:
                fitted.append(coding.fit(column, n_units))
            except ValueError as error:
                raise ValueError(f"{error} in column {index}") from None
        return fitted

    def _range(self, name: str, values: Floats) -> tuple[float, float]:
        """Return the range of values, without outliers if ``ranges`` says so.

        "auto" keeps those of heavy tails, up to 30 times the width of the others away.
        """
        usual = usual_range(values)
        ends = float(values.min()), float(values.max())
        if usual == ends or self.ranges == "all":
            return ends
        if self.ranges == "robust":
            return usual
        beyond = max(ends[1] - usual[1], usual[0] - ends[0])
        is_left_out = beyond > MOST_BEYOND * (usual[1] - usual[0])
        value = ends[1] if ends[1] > usual[1] else ends[0]
        then = "the range of all is too wide to tell those apart; ranges='robust' leaves it out"
        if is_left_out:
            then = "it is left out of the range, and clipped; ranges='all' takes it in"
        others = f"far from the other values, which are within {list(usual)}"
        warn_caller(f"{name} has {value}, {others}: {then}", OutlierWarning)
        self._has_outliers = self._has_outliers or is_left_out
        return usual if is_left_out else ends

    def _need_two(self, samples: Array, what: str) -> None:
        """Raise ValueError, in scikit-learn's words, for a single sample."""
        if len(samples) < 2:
            raise ValueError(
                f"Found array with {len(samples)} sample(s) while a minimum of 2 is required by "
                f"{type(self).__name__} to learn {what}"
            )

    def _row(self, x: Any, code: Any) -> Array:
        """Return one sample, a row or a mapping from names, checked, shape (n_features,)."""
        codings = code.codings
        values: Any = self._values_of(x, codings) if isinstance(x, Mapping) else x
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
            of_one: Array = self._finite(row[None], codings)[0]
            return of_one
        is_number = np.isfinite(row)
        if not is_number.all():
            is_number |= np.isnan(row) & code.may_lack
            require(is_number.all(), "x", "be finite numbers", x)
        return row

    def _values_of(self, x: Mapping[Any, Any], codings: tuple[Coding, ...]) -> list[Any]:
        """Return a sample's values in feature order, None for missing ones."""
        names = getattr(self, "feature_names_in_", None)
        if names is None:
            raise ValueError("x must be a 1-D array: the features were learned without names")
        if len(x) == len(names):
            with contextlib.suppress(KeyError):
                return [x[name] for name in names]
        coded = zip(names, codings, strict=True)
        optional = {name for name, coding in coded if isinstance(coding, WithMissing)}
        if not set(names) - optional <= set(x) <= set(names):
            but = f", of which {sorted(optional)} may be missing" if optional else ""
            raise ValueError(f"x must have the features {names.tolist()}{but}, got {list(x)}")
        return [x.get(name) for name in names]

    def _first_row(self, x: Any) -> Array:
        """Return the very first sample as a table; a mapping names the features."""
        names = list(x) if isinstance(x, Mapping) else None
        row = np.array(list(x.values()) if isinstance(x, Mapping) else x, dtype=object)
        are_words = all(isinstance(name, str) for name in names or ())
        expected = "be a 1-D array, or a mapping with words as keys"
        require(row.ndim == 1 and are_words, "x", expected, x)
        table: Array = self._validated(row[None], reset=True)
        if names is not None:
            self.feature_names_in_ = np.array(names, dtype=object)
        return table


class CodedRegressor(RegressorMixin, CodedInputs):
    """Validation of numeric targets, of one output or several."""

    def __sklearn_tags__(self) -> Any:
        """Declare that several outputs can be learned at once."""
        tags = super().__sklearn_tags__()
        tags.target_tags.multi_output = True
        return tags

    def _validated_numbers(self, X: Any, y: Any, reset: bool) -> tuple[Array, Floats]:
        if y is None:
            # Here because scikit-learn's message is less clear where several outputs may come.
            raise ValueError(
                f"{type(self).__name__} requires y to be passed, but the target y is None"
            )
        table, targets = self._validated(X, y, multi_output=True, y_numeric=True, reset=reset)
        try:
            return table, np.asarray(targets, dtype=np.float64)
        except ValueError as error:
            raise ValueError(f"y must be numbers: {error}") from None

    def _ranges_of(self, targets: Floats) -> tuple[Floats, Floats]:
        """Return the lowest and highest targets of each output, as ``ranges`` says."""
        low, high = zip(*(self._range("y", column) for column in targets.T), strict=True)
        return np.array(low), np.array(high)
