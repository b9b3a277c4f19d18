"""The greedy policy of an agent with SDNN-C as a C header."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.agents import SDNNQLearning
from sdnn.export.code import Code
from sdnn.export.text import Tables, weight_words
from sdnn.export.writer import CHeader, Writer, require_few_weights
from sdnn.support.arguments import argument_error

MOST_UNITS = 65535  # whose numbers fit 16 bits
_BYTES_OF_NETWORK = 40  # a struct of eight pointers and two sizes, where pointers have 32 bits


class SDNNCWriter(Writer):
    """Makes the header of an `SDNNQLearning` agent."""

    agent: SDNNQLearning
    networks: list[_core.SDNNC]

    def network(self) -> _core.SDNNC:
        """Return the network of the first dimension."""
        return self.networks[0]

    def require_small(self, n_units: int, n_columns: int) -> None:
        """Raise ValueError for more units or weights than a header can hold."""
        n_hidden_units = self.agent.approximator.n_hidden_units
        if n_hidden_units > MOST_UNITS:
            problem = f"must be at most {MOST_UNITS} in a C header, got {n_hidden_units}"
            raise argument_error("n_hidden_units", problem)
        require_few_weights(self.n_dimensions * n_units * n_columns, "n_hidden_units")

    def units(self, network: _core.SDNNC) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return the hidden units that are in a window, and where among them the windows begin."""
        first = network.first_units().astype(np.intp)
        used = np.unique(first[:, None] + np.arange(self.agent.approximator.n_active_units))
        return used, np.searchsorted(used, first)

    def describe(self, n_units: str) -> str:
        """Return what the header is of; ``n_units`` are the hidden units in use."""
        return (
            f"{self.n_inputs} inputs, {self.agent.approximator.n_pattern_units} units per"
            f" pattern, {n_units} hidden units in use, {' x '.join(map(str, self.n_actions()))}"
            " actions"
        )

    def header(self) -> CHeader:
        """Make the header."""
        networks, tables = self.networks, self.tables_of_spaces()
        codes = [Code(network, self.n_inputs) for network in networks]
        self.require_small(self.agent.approximator.n_hidden_units, codes[0].n_columns)
        self._add_ranks(tables)
        rows, n_units, n_rows = list[str](), list[int](), 0
        for d, (network, code) in enumerate(zip(networks, codes, strict=True)):
            used, first_units = self.units(network)
            weights, n_bytes = weight_words(code.paired(network.averaged_weights()[used]))
            thresholds = np.pad(network.averaged_thresholds()[used], (0, -used.size % 4))
            coding = ", ".join(f"{self.name}_{part}" for part in code.add_tables(tables, f"_{d}"))
            for c_type, part, constants in (
                ("uint32_t", "weights", weights),
                ("int32_t", "thresholds", thresholds),
                ("uint8_t", "n_bytes", n_bytes),
                ("uint16_t", "first_units", first_units),
            ):
                tables.add(c_type, f"{part}_{d}", constants)
            parts = ("weights", "thresholds", "n_bytes", "first_units")
            members = ", ".join(f"{self.name}_{part}_{d}" for part in parts)
            rows.append(f"{{{{{coding}}}, {members}, {used.size}, {network.n_actions}}},")
            tables.n_bytes += _BYTES_OF_NETWORK
            n_units.append(used.size)
            n_rows += int(n_bytes.sum())
        most_columns, most_actions = max(code.most_columns for code in codes), max(self.n_actions())
        defines = {
            **codes[0].defines(),
            "MOST_COLUMNS": most_columns,
            "N_ACTIVE_UNITS": self.agent.approximator.n_active_units,
            "MOST_UNITS": max(n_units),
            "MOST_ACTIONS": most_actions,
            "HAS_TIE_TOLERANCE": int(self.agent.learning.tie_tolerance > 0.0),
            "NETWORKS": rows,
        }
        ram_bytes = codes[0].column_bytes * most_columns + 8 + 4 * -(-max(n_units) // 32)
        ram_bytes += 2 * most_actions + 12 * self.n_inputs
        sizes = {
            "weight_bytes": 4 * n_rows * codes[0].n_columns,
            "ram_bytes": ram_bytes,
            "n_words": n_rows * most_columns,
        }
        description = self.describe(" + ".join(map(str, n_units)))
        needs = self.needs(**sizes)
        return self.write("sdnn_greedy_c.h", description, needs, defines, tables, **sizes)

    def _add_ranks(self, tables: Tables) -> None:
        networks = self.networks
        values = networks[0].output_values()
        if any((network.output_values() != values).any() for network in networks):
            raise ValueError("networks of one agent must have one range of values")
        distinct = np.unique(values)
        about = "Ranks of the values that counts of active units stand for."
        tables.add("uint16_t", "ranks", np.searchsorted(distinct, values), about)
        if self.agent.learning.tie_tolerance > 0.0:
            ties = np.searchsorted(distinct, distinct - self.agent.learning.tie_tolerance)
            about = "Of each rank, the lowest that ties with it."
            tables.add("uint16_t", "ties", ties, about)
