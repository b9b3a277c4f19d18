"""The greedy policy of an agent with SDNN-C as a C header."""

from __future__ import annotations

from typing import Any

import numpy as np

from sdnn.agents import SDNNQLearning
from sdnn.export.tables import Tables, bit_planes, joined, wrapped
from sdnn.export.writer import MOST_WEIGHTS, CHeader, Writer

_MOST_UNITS = 65535  # whose numbers fit 16 bits
_BYTES_OF_UNIT = 8
_BYTES_OF_NETWORK = 28  # a struct of five pointers and two sizes, where pointers have 32 bits


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
        if n_units > _MOST_UNITS:
            raise ValueError(
                f"n_hidden_units must be at most {_MOST_UNITS} in a C header, got {n_units}"
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
        n_columns = sizes.n_pairs * sizes.n_pattern_units
        self._check_sizes(n_columns)
        index_type = "uint8_t" if sizes.n_pattern_units <= 256 else "uint16_t"
        tables = self.tables_of_spaces()
        self._add_ranks(tables)
        units_of, rows, n_units, n_words = list[str](), list[str](), list[int](), 0
        for d, network in enumerate(networks):
            # Only the units that are in a window, and where among them the windows begin.
            first = network.first_units().astype(np.intp)
            used = np.unique(first[:, None] + np.arange(sizes.n_active_units))
            weights, n_bits, lowest = bit_planes(network.averaged_weights()[used])
            thresholds = network.averaged_thresholds()[used]
            units = np.stack([thresholds, lowest, n_bits], axis=1).tolist()
            sigma = [network.permutation(*pair) for pair in network.pairs]
            modifiers = np.array([nu for _, nu in network.pairs])
            tables.add("uint8_t", f"{name}_patterns_{d}", self.patterns(network))
            tables.add("uint16_t", f"{name}_modifiers_{d}", modifiers)
            tables.add(index_type, f"{name}_permutations_{d}", np.concatenate(sigma))
            tables.add("uint32_t", f"{name}_weights_{d}", weights)
            tables.add("uint16_t", f"{name}_first_units_{d}", np.searchsorted(used, first))
            tables.n_bytes += _BYTES_OF_UNIT * used.size + _BYTES_OF_NETWORK
            units_of += [
                f"static const {name}_unit {name}_units_{d}[{used.size}] = {{",
                *wrapped(f"{{{h}, {low}, {bits}}}" for h, low, bits in units),
                "};",
            ]
            parts = ("patterns", "modifiers", "permutations", "weights", "units", "first_units")
            names = ", ".join(f"{name}_{part}_{d}" for part in parts)
            rows.append(f"  {{{names}, {used.size}, {network.n_actions}}},")
            n_units.append(used.size)
            n_words += weights.size
        declaration = f"static const {name}_network {name}_networks[{len(rows)}] = {{"
        n_code_words, n_fire_words = -(-n_columns // 32), -(-max(n_units) // 32)
        most_actions = max(network.n_actions for network in networks)
        ram_bytes = 8 * n_code_words + 4 * n_fire_words + 2 * most_actions + 8 * len(self.inputs)
        values = {
            "description": (
                f"{len(self.inputs)} inputs, {sizes.n_pattern_units} units per pattern,"
                f" {' + '.join(map(str, n_units))} hidden units in use,"
                f" {' x '.join(str(network.n_actions) for network in networks)} actions"
            ),
            "ram_bytes": ram_bytes,
            "weight_bytes": 4 * n_words,
            "weight_bits": f"{32 * n_words / (sum(n_units) * n_columns):.2f}",
            "n_words": n_words,
            "permutation_type": index_type,
            "networks": joined([*units_of, declaration, *rows, "};"]),
            "n_code_words": n_code_words,
            "n_fire_words": n_fire_words,
            "most_actions": most_actions,
            "n_pattern_units": sizes.n_pattern_units,
            "n_partners": sizes.n_pairs // len(self.inputs),
            "pattern_bytes": -(-sizes.n_pattern_units // 8),
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
