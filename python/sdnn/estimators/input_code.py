"""The code of a whole sample: each input's coding, the pairs, and the drawn tables."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.arguments import one_of
from sdnn.coding import Coding

__all__ = ["COLUMN_BUDGET", "InputCode", "draw_input_code", "pattern_units_for"]

COLUMN_BUDGET = 16000
"""Columns of the code that are shared out among the pairs where the user names no size."""


def pattern_units_for(n_pairs: int) -> int:
    """Units per pattern so that the whole code is about `COLUMN_BUDGET` wide.

    >>> pattern_units_for(2), pattern_units_for(90), pattern_units_for(4032)
    (2000, 178, 32)
    """
    return min(2000, max(32, 2 * round(COLUMN_BUDGET / n_pairs / 2)))


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
