"""Which input is coded how: a name, an object, or a list of (coding, columns)."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdnn.coding import Coding, coding_named

__all__ = [
    "Columns",
    "coding_entries",
    "codings_of_columns",
    "column_indices",
    "input_pairs",
    "share_of_pairs",
]

Columns = int | str | slice | Sequence[int] | Sequence[str] | Sequence[bool] | Callable[[Any], Any]


def one_index(column: Any, names: Sequence[str] | None, n_inputs: int) -> int:
    """Return the index of a feature given by name or number; negative numbers count from the end.

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
        raise ValueError(f"a feature is given by its name or number, got {column!r}")
    if not -n_inputs <= column < n_inputs:
        raise ValueError(f"X has {n_inputs} features, there is no number {column}")
    return int(column) % n_inputs


def column_indices(
    columns: Columns, names: Sequence[str] | None, n_inputs: int, table: Any = None
) -> list[int]:
    """Return the indices of the features that a column specification means.

    Parameters
    ----------
    columns : int, str, slice, list of int or str, boolean mask, or callable of X
        As scikit-learn's ColumnTransformer takes them; slices of numbers only.
    names : sequence of str, optional
        The names of the features.
    n_inputs : int
        How many features there are.
    table : array_like, optional
        What a callable is called with.

    Examples
    --------
    >>> column_indices(slice(1, None), None, 3)
    [1, 2]
    >>> column_indices([True, False, True], None, 3)
    [0, 2]
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


def coding_entries(listed: Iterable[Any]) -> list[tuple[Coding, Columns]]:
    """Return the entries (coding, columns) of a list, names replaced by codings.

    Raises
    ------
    ValueError
        For an unknown coding, or an entry of another kind.

    Examples
    --------
    >>> [coding.name for coding, _ in coding_entries([("anchor", [0, 1]), ("circular", "hour")])]
    ['anchor', 'circular']
    """
    entries = []
    for entry in listed:
        if not isinstance(entry, list | tuple) or len(entry) != 2:
            raise ValueError(f"coding must be a list of (coding, columns), got {entry!r} in it")
        entries.append((coding_named(entry[0]), entry[1]))
    return entries


def codings_of_columns(
    coding: Any, default: Coding, names: Sequence[str] | None, n_inputs: int, table: Any = None
) -> list[Coding]:
    """Return the coding of each feature.

    Parameters
    ----------
    coding : str, Coding, or list of (str or Coding, columns)
        One for all features, or which features have which; the others have the default.
    default : Coding
        Of features that a list leaves out.
    names, n_inputs, table
        As of `column_indices`.

    Raises
    ------
    ValueError
        For an unknown coding or feature, or a feature that is named twice.
    """
    if not isinstance(coding, list | tuple):
        return [coding_named(coding)] * n_inputs
    found: dict[int, Coding] = {}
    for one, columns in coding_entries(coding):
        for index in column_indices(columns, names, n_inputs, table):
            if index in found:
                raise ValueError(f"feature {index} has more than one coding")
            found[index] = one
    return [found.get(index, default) for index in range(n_inputs)]


def share_of_pairs(n_inputs: int, n_most: int, seed: int) -> list[tuple[int, int]]:
    """Return up to ``n_most`` ordered pairs: all, or an even share of them drawn at random.

    In a share every input is modified as often as any other, and modifies as often. There is at
    least one pair per input.

    >>> share_of_pairs(3, 6, seed=0)
    [(0, 1), (0, 2), (1, 0), (1, 2), (2, 0), (2, 1)]
    >>> len(share_of_pairs(100, 500, seed=0))
    500
    """
    away: NDArray[np.int64] = np.arange(1, n_inputs)
    if n_inputs * len(away) > n_most:
        random = np.random.RandomState(seed)
        away = random.permutation(away)[: max(1, n_most // n_inputs)]
    return sorted((mu, int(mu + step) % n_inputs) for mu in range(n_inputs) for step in away)


def kept_pairs(pairs: Any) -> Any:
    """Return what a generator yields as a list, to be read at every fit; all else as it is."""
    return list(pairs) if isinstance(pairs, Iterator) else pairs


def input_pairs(
    pairs: Any,
    names: Sequence[str] | None,
    n_inputs: int,
    words: tuple[str, ...] = ("budget", "all", "auto"),
) -> list[tuple[int, int]]:
    """Return the ordered pairs (modified, modifier) of features; (mu, mu) is mu's plain pattern.

    Parameters
    ----------
    pairs : "all" or list of (modified, modifier)
        By number or name; a modifier of None leaves the pattern plain. "all" means every ordered
        pair of different features, and the plain pattern where there is one feature only.
    names, n_inputs
        As of `column_indices`.
    words : tuple of str
        What the user may say instead of a list, for the message.

    Examples
    --------
    >>> input_pairs("all", None, 2)
    [(0, 1), (1, 0)]
    >>> input_pairs([("a", "b"), ("a", None)], ["a", "b"], 2)
    [(0, 1), (0, 0)]
    """
    if isinstance(pairs, str) and pairs == "all":
        everything = [(mu, nu) for mu in range(n_inputs) for nu in range(n_inputs) if mu != nu]
        return everything or [(0, 0)]
    if isinstance(pairs, str | Iterator) or not isinstance(pairs, Iterable):
        possible = ", ".join(map(repr, words))
        raise ValueError(
            f"pairs must be {possible} or a list of (modified, modifier), got {pairs!r}"
        )
    found = []
    for pair in pairs:
        if not isinstance(pair, list | tuple | np.ndarray) or len(pair) != 2:
            raise ValueError(f"a pair is (modified, modifier), got {pair!r}")
        mu = one_index(pair[0], names, n_inputs)
        found.append((mu, mu if pair[1] is None else one_index(pair[1], names, n_inputs)))
        if pair[1] is not None and found[-1][0] == found[-1][1]:
            raise ValueError(f"a feature cannot modify itself, got {pair!r}; use None")
    if not found:
        raise ValueError("pairs must not be empty")
    return found
