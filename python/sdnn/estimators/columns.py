"""Columns of samples by name or number: their codings and their pairs."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn.coding import Coding, RandomInverse, Symbolic, WithMissing, coding_named
from sdnn.coding.symbols import is_missing
from sdnn.support.arguments import require, shown

Array = NDArray[Any]
Floats = NDArray[np.float64]
Ints = NDArray[np.int32]
Column = int | str
Columns = Column | slice | Sequence[int] | Sequence[str] | Sequence[bool] | Callable[..., object]
Entry = tuple[str | Coding, Columns]
Codings = str | Coding | list[Entry] | tuple[Entry, ...]
Pairs = list[tuple[int, int]]
PairChoice = str | Sequence[tuple[Column, Column | None]]
Sample = ArrayLike | Mapping[str, object]  # a row, or values by the names of features
PAIR_BUDGET = 500  # pairs that are formed by default


def index_of(column: object, names: Sequence[str] | None, n_inputs: int) -> int:
    """Return the index of a feature given by name or number.

    >>> index_of("y", ["x", "y"], 2), index_of(-1, None, 3)
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
    columns: Columns, names: Sequence[str] | None, n_inputs: int, table: object = None
) -> list[int]:
    """Return the indices of features given as to scikit-learn's ColumnTransformer.

    >>> column_indices(slice(1, None), None, 3), column_indices([True, False, True], None, 3)
    ([1, 2], [0, 2])
    """
    chosen: object = columns(table) if callable(columns) else columns
    if isinstance(chosen, slice):
        if isinstance(chosen.start, str) or isinstance(chosen.stop, str):  # the last is included
            first = 0 if chosen.start is None else index_of(chosen.start, names, n_inputs)
            last = n_inputs - 1 if chosen.stop is None else index_of(chosen.stop, names, n_inputs)
            chosen = slice(first, last + 1, chosen.step)
        return list(range(n_inputs))[chosen]
    if isinstance(chosen, str) or not isinstance(chosen, Iterable):
        return [index_of(chosen, names, n_inputs)]
    listed = list(chosen)
    if listed and all(isinstance(column, bool | np.bool_) for column in listed):
        if len(listed) != n_inputs:
            raise ValueError(f"a mask must have {n_inputs} entries, got {len(listed)}")
        return np.flatnonzero(listed).tolist()
    return [index_of(column, names, n_inputs) for column in listed]


def coding_entries(coding: Codings) -> list[tuple[Coding, Columns]]:
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


def with_fields(coding: Codings, fields: Mapping[str, object]) -> Codings:
    """Return a coding, or a list of (coding, columns), with some fields replaced.

    ``base__period`` is a field of the coding ``base``. In a list, ``0__period`` is a field of the
    first coding and ``period`` one of every coding that has it.

    >>> with_fields([("circular", ["hour"]), ("symbolic", ["day"])], {"period": 24.0})[0][0].period
    24.0
    """
    if not isinstance(coding, list | tuple):
        return with_replaced_fields(coding_named(coding), fields)
    reached: set[str] = set()
    entries: list[Entry] = []
    for number, (entry, columns) in enumerate(coding_entries(coding)):
        shared = {name: value for name, value in fields.items() if has_field(entry, name)}
        prefix = f"{number}__"
        numbered = {name: name.removeprefix(prefix) for name in fields if name.startswith(prefix)}
        reached |= {*shared, *numbered}
        changes = shared | {short: fields[name] for name, short in numbered.items()}
        entries.append((with_replaced_fields(entry, changes), columns))
    if unknown := set(fields) - reached:
        raise ValueError(
            f"coding__{min(unknown)} must be a field of a coding in the list, or of the first with "
            f"coding__0__, got the list {shown(coding)}"
        )
    return entries


def has_field(coding: Coding, name: str) -> bool:
    """Return whether a coding has the field that a name begins with, before ``__``."""
    return name.partition("__")[0] in field_names(coding)


def field_names(coding: Coding) -> list[str]:
    """Return the names of a coding's fields."""
    if not dataclasses.is_dataclass(coding):
        return []
    return [field.name for field in dataclasses.fields(coding)]


def with_replaced_fields(coding: Coding, fields: Mapping[str, object]) -> Coding:
    """Return a coding with some fields replaced; ``base__period`` is a field of its field."""
    if not all(has_field(coding, name) for name in fields):
        raise ValueError(f"{coding!r} must have the fields {sorted(fields)}")
    for name, value in sorted(fields.items()):  # "base" before "base__period"
        head, _, rest = name.partition("__")
        new = with_fields(getattr(coding, head), {rest: value}) if rest else value
        coding = dataclasses.replace(coding, **{head: new})  # type: ignore[type-var]
    return coding


def categorical_columns(table: object) -> list[int]:
    """Return the columns of a data frame whose type is "category"."""
    types = table.dtypes if hasattr(table, "columns") and hasattr(table, "dtypes") else ()
    return [index for index, column_type in enumerate(types) if str(column_type) == "category"]


def codings_of_columns(
    coding: Codings, names: Sequence[str] | None, n_inputs: int, table: object = None
) -> list[Coding]:
    """Return the coding of each feature, random-inverse where a list has none.

    Categories of a data frame are symbols, which may be missing, unless a list or a `Coding` has
    another coding for them.

    >>> [coding.name for coding in codings_of_columns([("anchor", [1])], None, 2)]
    ['random-inverse', 'anchor']
    """
    codings: dict[int, Coding] = {}
    for entry, columns in coding_entries(coding):
        for index in column_indices(columns, names, n_inputs, table):
            if index in codings:
                raise ValueError(f"feature {index} has more than one coding")
            codings[index] = entry
    for index in categorical_columns(table):
        if isinstance(coding, str) or index not in codings:
            codings[index] = WithMissing(base=Symbolic())
    return [codings.get(index) or RandomInverse() for index in range(n_inputs)]


def with_missing_pattern(coding: Coding, column: Array) -> Coding:
    """Return the coding, wrapped in `WithMissing` if the column has missing values."""
    if not coding.is_numeric:
        return coding
    is_float = column.dtype == np.float64
    lacks = np.isnan(column).any() if is_float else any(map(is_missing, column.tolist()))
    return WithMissing(base=coding) if lacks else coding


def input_pairs(
    pairs: PairChoice, names: Sequence[str] | None, n_inputs: int, seed: int = 0
) -> Pairs:
    """Return the pairs (modified, modifier) of features; (i, i) is feature i's plain pattern.

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
        # Offsets from a feature to its modifiers; within the budget, a random share of them.
        offsets: NDArray[np.int64] = np.arange(1, n_inputs)
        if pairs != "all" and n_inputs * len(offsets) > PAIR_BUDGET:
            random = np.random.RandomState(seed)
            offsets = random.permutation(offsets)[: max(1, PAIR_BUDGET // n_inputs)]
        chosen = [(mu, int(mu + offset) % n_inputs) for mu in range(n_inputs) for offset in offsets]
        return sorted(chosen) or [(0, 0)]
    is_listed = isinstance(pairs, Iterable) and not isinstance(pairs, Iterator)
    require(is_listed, "pairs", "be a list of (modified, modifier)", pairs)
    indices: Pairs = []
    for pair in pairs:
        if not isinstance(pair, list | tuple | np.ndarray) or len(pair) != 2:
            raise ValueError(f"a pair is (modified, modifier), got {shown(pair)}")
        mu = index_of(pair[0], names, n_inputs)
        nu = mu if pair[1] is None else index_of(pair[1], names, n_inputs)
        if pair[1] is not None and mu == nu:
            raise ValueError(f"a feature cannot modify itself, got {shown(pair)}; use None")
        indices.append((mu, nu))
    if not indices:
        raise ValueError(f"pairs must not be empty, got {pairs!r}")
    return indices
