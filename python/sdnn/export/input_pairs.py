"""How a header finds the code of a sample: the patterns of inputs, and their pairs."""

from __future__ import annotations

from collections import defaultdict

import numpy as np
from numpy.typing import NDArray

from sdnn.estimators.network import InputCode
from sdnn.export.text import Tables

Patterns = NDArray[np.int8]
Order = NDArray[np.intp]
PAIR_BYTES = 16  # of a struct of sdnn_input_pairs.h
_NONE = "UINT32_MAX"


def order_between(table: Patterns, base: Patterns) -> Order | None:
    """Return the order in which the units of ``base`` make ``table``, or None without one.

    >>> base = np.array([[1, -1, -1], [1, 1, -1]], np.int8)
    >>> order_between(base[:, [2, 0, 1]], base)
    array([2, 0, 1])
    """
    places: dict[bytes, list[int]] = defaultdict(list)
    for unit in range(base.shape[1] - 1, -1, -1):
        places[base[:, unit].tobytes()].append(unit)
    order = []
    for unit in range(table.shape[1]):
        same = places[table[:, unit].tobytes()]
        if not same:
            return None
        order.append(same.pop())
    return np.array(order)


class PairTables:
    """The patterns of a code without repetitions: tables, and orders of their units.

    A modifier's table that has the units of another table in another order is stored as that
    order, where it is shorter.
    """

    def __init__(self, code: InputCode) -> None:
        self.code = code
        self.m = code.core.n_units
        self.row_bytes = -(-self.m // 8)
        self.tables: list[Patterns] = []
        self.orders: list[Order] = []
        self._place_of: dict[int, int] = {}  # by `id` of a table
        self._n_table_bytes = 0
        modified = {mu: table for (mu, _), table in zip(code.pairs, code.modified, strict=True)}
        self.rows = [self._row(pair, modified) for pair in range(len(code.pairs))]

    def _row(self, pair: int, modified: dict[int, Patterns]) -> str:
        """Return the fields of a pair's struct in C: inputs, tables, first index of an order.

        A modifying table that is the input's modified table with its units in another order is
        stored as that order, if this is shorter.
        """
        mu, nu = self.code.core_pairs[pair].tolist()
        table = self._place(self.code.modified[pair])
        modifier = self.code.modifiers[pair]
        if (modifier > 0).all():  # an input alone: its pattern is not modified
            return f"{{{mu}, {nu}, {table}, {_NONE}, {_NONE}}},"
        base = modified.get(self.code.pairs[pair][1])
        is_shorter = self.m * self.order_bytes < len(modifier) * self.row_bytes
        order = None if base is None or not is_shorter else order_between(modifier, base)
        if base is None or order is None:
            return f"{{{mu}, {nu}, {table}, {self._place(modifier)}, {_NONE}}},"
        self.orders.append(order)
        first = self.m * (len(self.orders) - 1)
        return f"{{{mu}, {nu}, {table}, {self._place(base)}, {first}}},"

    def _place(self, table: Patterns) -> int:
        """Return the place of a table among the bytes of patterns, and add it if it is new."""
        key = id(table)
        if key not in self._place_of:
            self._place_of[key] = self._n_table_bytes
            self.tables.append(table)
            self._n_table_bytes += len(table) * self.row_bytes
        return self._place_of[key]

    @property
    def order_bytes(self) -> int:
        """Bytes of the number of a unit."""
        return 1 if self.m <= 256 else 2

    @property
    def most_columns(self) -> int:
        """Largest number of columns that are not 0 for a sample."""
        return sum(int((table > 0).sum(axis=1).max()) for table in self.code.modifiers)

    def add(self, tables: Tables) -> dict[str, object]:
        """Add patterns and orders to the tables; return the macros of the code."""
        bits = [np.packbits(table > 0, axis=1, bitorder="little") for table in self.tables]
        patterns = np.concatenate([rows.reshape(-1) for rows in bits])
        tables.add("uint8_t", "patterns", patterns, "Bits of the patterns of bins.")
        orders = np.concatenate([np.empty(0, np.intp), *self.orders])
        order_type = "uint8_t" if self.order_bytes == 1 else "uint16_t"
        tables.add(order_type, "orders", orders, "Orders of modifying units.")
        tables.n_bytes += PAIR_BYTES * len(self.rows)
        return {
            "N_PATTERN_UNITS": self.m,
            "N_PAIRS": len(self.rows),
            "N_COLUMNS": self.code.core.n_columns,
            "MOST_COLUMNS": self.most_columns,
            "PAIRS": self.rows,
        }
