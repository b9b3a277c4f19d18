"""How a header finds the columns of a state's code that are not 0."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.export.text import Tables

Pair = tuple[int, int]


class Code:
    """The paired code of a network: groups of columns by the input that modifies them.

    Two groups that an input modifies are stored as half their sum and half their difference, one
    of which is 0: see cpp/include/sdnn/coding/state_code.hpp.
    """

    def __init__(self, network: _core.SDNNC | _core.LinearSDNN, n_inputs: int) -> None:
        self.network = network
        self.n_inputs = n_inputs
        self.m = len(network.permutation(*network.pairs[0]))
        """Units of a pattern, and columns of a group."""
        self.groups, self.n_double = self._layout()

    def _layout(self) -> tuple[list[Pair], int]:
        """Return the groups (mu, nu), those that are paired first, and the number of these.

        Two paired groups are neighbours. Where an input modifies an odd number of groups, its last
        one stays alone, behind all pairs.
        """
        pairs: Sequence[Pair] = self.network.pairs
        ranks, n_before = [], dict[int, int]()  # each group's number among those of its modifier
        for _, nu in pairs:
            ranks.append(n_before.get(nu, 0))
            n_before[nu] = ranks[-1] + 1
        n_paired = len(pairs) // self.n_inputs // 2 * 2  # for each modifier
        order = sorted(
            range(len(pairs)), key=lambda g: (ranks[g] >= n_paired, pairs[g][1], ranks[g])
        )
        return [pairs[g] for g in order], n_paired * self.n_inputs

    @property
    def n_columns(self) -> int:
        """Number of columns."""
        return len(self.groups) * self.m

    @property
    def units(self) -> list[NDArray[np.intp]]:
        """The modified units of each group, in the order of their modifying units."""
        return [np.argsort(self.network.permutation(*group)) for group in self.groups]

    @property
    def most_columns(self) -> int:
        """Largest number of columns that are not 0 for a state."""
        # Two paired groups together have as many columns that are not 0 as a single one.
        n_ones = [int((self.network.table(i) > 0).sum(axis=1).max()) for i in range(self.n_inputs)]
        modifiers = [*self.groups[: self.n_double : 2], *self.groups[self.n_double :]]
        return sum(n_ones[nu] for _, nu in modifiers)

    @property
    def column_bytes(self) -> int:
        """Bytes of an integer that holds the number of any column."""
        return 2 if self.n_columns <= 2**16 else 4

    def defines(self) -> dict[str, int]:
        """Return the macros with the sizes of the code."""
        return {
            "N_PATTERN_UNITS": self.m,
            "N_GROUPS": len(self.groups),
            "N_DOUBLE_GROUPS": self.n_double,
            "MOST_COLUMNS": self.most_columns,
        }

    def add_tables(self, tables: Tables, ending: str = "") -> list[str]:
        """Add the tables that the header computes codes from; return their names without prefix."""
        inputs = range(self.n_inputs)
        patterns = [
            np.packbits(self.network.table(i) > 0, axis=1, bitorder="little") for i in inputs
        ]
        arrays = {
            "patterns": ("uint8_t", np.concatenate(patterns).reshape(-1)),
            "modified": ("uint16_t", np.array([mu for mu, _ in self.groups])),
            "modifiers": ("uint16_t", np.array([nu for _, nu in self.groups])),
            "units": ("uint8_t" if self.m <= 256 else "uint16_t", np.concatenate(self.units)),
        }
        for name, (c_type, values) in arrays.items():
            tables.add(c_type, f"{name}{ending}", values)
        return [f"{name}{ending}" for name in arrays]

    def paired(self, weights: NDArray[np.int32]) -> NDArray[np.int32]:
        """Convert weights (n, D) from the paper's order to the paired columns."""
        rows = weights[:, self._order()].reshape(len(weights), len(self.groups), self.m)
        first, second = rows[:, : self.n_double : 2], rows[:, 1 : self.n_double : 2]
        first[:], second[:] = first + second, first - second
        return rows.reshape(len(weights), -1)

    def unpaired(self, columns: NDArray[np.int32]) -> NDArray[np.int32]:
        """Convert paired columns back to weights; ValueError for impossible sums or differences."""
        rows = columns.reshape(len(columns), len(self.groups), self.m).copy()
        first, second = rows[:, : self.n_double : 2], rows[:, 1 : self.n_double : 2]
        if ((first ^ second) & 1).any():  # a sum and a difference are both even or both odd
            raise ValueError("weights are no sums and differences")
        first[:], second[:] = (first + second) // 2, (first - second) // 2
        weights = np.empty_like(columns)
        weights[:, self._order()] = rows.reshape(len(columns), -1)
        return weights

    def _order(self) -> NDArray[np.intp]:
        """Return the index of each column in the paper's order."""
        numbers = {pair: number for number, pair in enumerate(self.network.pairs)}
        starts = [numbers[group] * self.m for group in self.groups]
        return np.concatenate(
            [start + units for start, units in zip(starts, self.units, strict=True)]
        )
