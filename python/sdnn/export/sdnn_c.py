"""The greedy policy of an agent with SDNN-C as a C header."""

from __future__ import annotations

from typing import Any

import numpy as np

from sdnn.agents import SDNNQLearning
from sdnn.export.code import Code
from sdnn.export.tables import Tables, joined, weight_words
from sdnn.export.writer import MOST_WEIGHTS, CHeader, Writer

MOST_UNITS = 65535  # whose numbers fit 16 bits
_BYTES_OF_NETWORK = 40  # a struct of eight pointers and two sizes, where pointers have 32 bits


class SDNNCWriter(Writer):
    """Makes the header of an `SDNNQLearning` agent."""

    agent: SDNNQLearning

    def network(self) -> Any:
        """Return the network of the first dimension."""
        return self._networks()[0]

    def _networks(self) -> list[Any]:
        if not self.is_vector:
            return [self.core.action_value]
        return [self.core.action_value(dimension) for dimension in range(self.n_dimensions)]

    def _check_sizes(self, n_columns: int) -> None:
        n_units = self.agent.approximator.n_hidden_units
        if n_units > MOST_UNITS:
            raise ValueError(
                f"n_hidden_units must be at most {MOST_UNITS} in a C header, got {n_units}"
            )
        n_weights = self.n_dimensions * n_units * n_columns
        if n_weights > MOST_WEIGHTS:
            raise ValueError(
                f"a C header can hold {MOST_WEIGHTS} weights, got {n_weights}: take fewer inputs,"
                " n_hidden_units or n_pattern_units"
            )

    def header(self) -> CHeader:
        """Make the header."""
        name, sizes, networks = self.name, self.agent.approximator, self._networks()
        codes = [Code(network, len(self.inputs)) for network in networks]
        n_columns = codes[0].n_columns
        self._check_sizes(n_columns)
        tables = self.tables_of_spaces()
        self._add_ranks(tables)
        rows, n_units, n_rows = list[str](), list[int](), 0
        for d, (network, code) in enumerate(zip(networks, codes, strict=True)):
            # Only the units that are in a window, and where among them the windows begin.
            first = network.first_units().astype(np.intp)
            used = np.unique(first[:, None] + np.arange(sizes.n_active_units))
            weights, n_bytes = weight_words(code.paired(network.averaged_weights()[used]))
            thresholds = np.pad(network.averaged_thresholds()[used], (0, -used.size % 4))
            parts = code.add_tables(tables, name, f"_{d}")
            for kind, part, values in (
                ("uint32_t", "weights", weights),
                ("int32_t", "thresholds", thresholds),
                ("uint8_t", "n_bytes", n_bytes),
                ("uint16_t", "first_units", np.searchsorted(used, first)),
            ):
                parts.append(f"{name}_{part}_{d}")
                tables.add(kind, parts[-1], values)
            tables.n_bytes += _BYTES_OF_NETWORK
            rows.append(f"  {{{', '.join(parts)}, {used.size}, {network.n_actions}}},")
            n_units.append(used.size)
            n_rows += int(n_bytes.sum())
        declaration = f"static const {name}_network {name}_networks[{len(rows)}] = {{"
        n_fire_words = -(-max(n_units) // 32)
        most_actions = max(network.n_actions for network in networks)
        shapes = [code.values() for code in codes]
        most_columns = max(shape["most_columns"] for shape in shapes)
        ram_bytes = shapes[0]["bytes_of_column"] * most_columns + 8
        ram_bytes += 4 * n_fire_words + 2 * most_actions + 12 * len(self.inputs)
        values = {
            **shapes[0],
            "description": (
                f"{len(self.inputs)} inputs, {sizes.n_pattern_units} units per pattern,"
                f" {' + '.join(map(str, n_units))} hidden units in use,"
                f" {' x '.join(str(network.n_actions) for network in networks)} actions"
            ),
            "coding": "network->",
            "most_columns": most_columns,
            "ram_bytes": ram_bytes,
            "weight_bytes": 4 * n_rows * n_columns,
            "n_words": n_rows * most_columns,
            "networks": joined([declaration, *rows, "};"]),
            "n_fire_words": n_fire_words,
            "most_actions": most_actions,
            "n_active_units": sizes.n_active_units,
            "has_ties": self.agent.learning.tie_tolerance > 0.0,
            "ties": self.ties(),
            "is_linear": False,
        }
        return self.write("c_sdnn_c", values, tables)

    def _add_ranks(self, tables: Tables) -> None:
        name, networks = self.name, self._networks()
        values = networks[0].output_values()
        if any((network.output_values() != values).any() for network in networks):
            raise ValueError("networks of one agent must have one range of values")
        distinct = np.unique(values)
        about = "Ranks of the values that counts of active units stand for."
        tables.add("uint16_t", f"{name}_ranks", np.searchsorted(distinct, values), about)
        if self.agent.learning.tie_tolerance > 0.0:
            ties = np.searchsorted(distinct, distinct - self.agent.learning.tie_tolerance)
            about = "Of each rank, the lowest that ties with it."
            tables.add("uint16_t", f"{name}_ties", ties, about)
