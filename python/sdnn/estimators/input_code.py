"""The code of a whole sample: each input's coding, the pairs, and the drawn tables."""

from __future__ import annotations

import functools
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.arguments import one_of
from sdnn.coding import Coding
from sdnn.coding.missing import missing_as_nan

__all__ = [
    "COLUMN_BUDGET",
    "PAIR_BUDGET",
    "InputCode",
    "code_bytes",
    "draw_input_code",
    "pattern_units_for",
]

COLUMN_BUDGET = 16000
"""Columns of the code that are shared out among the pairs where the user names no size."""


PAIR_BUDGET = 500
"""Pairs that are formed where the user names none: 32 units each are the budget of columns."""


def code_bytes(codings: Sequence[Coding], pairs: Sequence[tuple[int, int]], n_units: int) -> int:
    """Return the bytes that drawing and keeping the patterns of fitted codings takes, about."""
    of_pairs = sum(codings[mu].size + codings[nu].size for mu, nu in pairs)
    return int(of_pairs * n_units * 9 / 8)  # a byte a unit, and a bit in the core


def pattern_units_for(n_pairs: int) -> int:
    """Units per pattern so that the whole code is about `COLUMN_BUDGET` wide.

    At least 32 up to `PAIR_BUDGET` pairs, and 8 beyond.

    >>> [pattern_units_for(n) for n in (2, 90, 500, 870, 4032)]
    [2000, 178, 32, 18, 8]
    """
    least = 32 if n_pairs <= PAIR_BUDGET else 8
    return min(2000, max(least, 2 * round(COLUMN_BUDGET / n_pairs / 2)))


class InputCode:
    """Turns samples into bins, and bins into the code that the network reads.

    Parameters
    ----------
    codings : sequence of Coding
        One per input, fitted.
    pairs : sequence of (int, int)
        Ordered pairs (modified, modifier); equal ones stand for the plain pattern.
    modified, modifiers : list of ndarray, shape (n_bins, n_units)
        Per pair, the patterns of the modified input and of the modifier.
    """

    def __init__(
        self,
        codings: Sequence[Coding],
        pairs: Sequence[tuple[int, int]],
        modified: list[NDArray[np.int8]],
        modifiers: list[NDArray[np.int8]],
    ) -> None:
        self.codings = tuple(codings)
        self.pairs = tuple(pairs)
        self.modified = modified
        self.modifiers = modifiers
        # Inputs that no pair mentions are validated and then ignored.
        self.used = sorted({index for pair in self.pairs for index in pair})
        number_of = {index: number for number, index in enumerate(self.used)}
        self.core_pairs = np.array(
            [(number_of[mu], number_of[nu]) for mu, nu in self.pairs], dtype=np.int32
        )
        self.is_numeric = all(coding.is_numeric for coding in self.codings)
        self.core = _core.SelectiveDesensitization(modified, modifiers, self.core_pairs)

    def __getstate__(self) -> dict[str, Any]:
        """Everything but the core's object, which follows from it."""
        return {name: getattr(self, name) for name in ("codings", "pairs", "modified", "modifiers")}

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Build the core's object again."""
        self.__init__(**state)  # type: ignore[misc]

    @property
    def n_units(self) -> int:
        """Units per pattern."""
        return self.core.n_units

    def bins(self, table: NDArray[Any]) -> NDArray[np.int32]:
        """Return the bins of samples, (n_samples, n_inputs) to (n_samples, n inputs in pairs).

        Raises
        ------
        ValueError
            For a category that was not there in training; the message names the input.
        """
        bins = np.empty((len(table), len(self.used)), dtype=np.int32)
        for number, index in enumerate(self.used):
            try:
                bins[:, number] = self.codings[index].bins(table[:, index])
            except ValueError as error:
                raise ValueError(f"{error} in column {index}") from None
        return bins

    @functools.cached_property
    def _even(self) -> tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.int32]] | None:
        """Ranges and numbers of bins of the inputs in pairs, where all have bins of equal width."""
        ranges = [self.codings[index].even_range() for index in self.used]
        if any(ends is None or not ends[0] < ends[1] for ends in ranges):
            return None
        low, high = np.array(ranges, dtype=np.float64).T
        return low, high, np.array([self.codings[i].size for i in self.used], dtype=np.int32)

    def bins_of_row(self, row: NDArray[Any]) -> NDArray[np.int32]:
        """Return the bins of one sample, (n_inputs,) to (1, n inputs in pairs); as of `bins`.

        Where all inputs have bins of equal width, they are found together: inputs one by one
        would cost more than the network.
        """
        if self._even is None or row.dtype != np.float64:
            return self.bins(row[None])
        low, high, sizes = self._even
        inside = np.minimum(np.maximum(row[self._used], low), high)
        where = (inside / 2 - low / 2) / (high / 2 - low / 2)  # as in `sdnn.coding.ranges`
        bins: NDArray[np.int32] = np.minimum((where * sizes).astype(np.int32), sizes - 1)
        return bins[None]

    @functools.cached_property
    def _used(self) -> NDArray[np.intp] | slice:
        every = self.used == list(range(len(self.codings)))
        return slice(None) if every else np.array(self.used)

    @functools.cached_property
    def _ends(self) -> tuple[list[int], NDArray[np.float64], NDArray[np.float64]]:
        """Which inputs have a range, and their ranges."""
        ends = {index: self.codings[index].ends() for index in self.used}
        ranges = {index: pair for index, pair in ends.items() if pair is not None}
        low, high = np.array(list(ranges.values()), dtype=np.float64).reshape(-1, 2).T
        return list(ranges), low, high

    def outside(self, table: NDArray[Any]) -> tuple[int, str]:
        """Return how many values lie beyond their input's range, and what the first of them is.

        Shapes: table (n_samples, n_inputs).
        """
        indices, low, high = self._ends
        values = table if len(indices) == table.shape[1] else table[:, indices]
        if values.dtype != np.float64:
            values = missing_as_nan(values)
        beyond = (values < low) | (values > high)
        n_beyond = int(np.count_nonzero(beyond))
        if n_beyond == 0:
            return 0, ""
        row, place = np.argwhere(beyond)[0]
        return n_beyond, (
            f"{values[row, place]} in column {indices[place]}, whose range is "
            f"[{low[place]}, {high[place]}]"
        )


def draw_input_code(
    codings: Sequence[Coding],
    pairs: Sequence[tuple[int, int]],
    n_units: int,
    tables: str,
    seed: int,
) -> InputCode:
    """Draw the patterns of fitted codings.

    Parameters
    ----------
    codings, pairs
        As of `InputCode`.
    n_units : int
        Units per pattern.
    tables : {"shared", "separate"}
        One table per input, its units permuted anew as modifier in each pair; or two fresh tables
        per pair.
    seed : int
        Equal seeds give equal tables.
    """
    one_of("tables", tables, ("shared", "separate"))
    seeds = iter(
        np.random.SeedSequence(seed).generate_state(2 * (len(codings) + len(pairs)), np.uint64)
    )
    plain: dict[int, NDArray[np.int8]] = {}

    def table_of(index: int) -> NDArray[np.int8]:
        return codings[index].patterns(n_units, int(next(seeds)))

    def all_on(index: int) -> NDArray[np.int8]:
        return plain.setdefault(index, np.ones((codings[index].size, n_units), dtype=np.int8))

    if tables == "separate":
        modified = [table_of(mu) for mu, _ in pairs]
        modifiers = [table_of(nu) if mu != nu else all_on(nu) for mu, nu in pairs]
        return InputCode(codings, pairs, modified, modifiers)
    used = sorted({index for pair in pairs for index in pair})
    shared = {index: table_of(index) for index in used}
    modified = [shared[mu] for mu, _ in pairs]
    modifiers = []
    for mu, nu in pairs:
        order = np.random.RandomState(int(next(seeds)) % 2**32).permutation(n_units)
        modifiers.append(np.ascontiguousarray(shared[nu][:, order]) if mu != nu else all_on(nu))
    return InputCode(codings, pairs, modified, modifiers)
