"""Parts of the headers of agents with a linear readout."""

from __future__ import annotations

from typing import ClassVar

import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.environments.types import Data
from sdnn.export.code import Code
from sdnn.export.learner import Learner
from sdnn.export.text import Tables, real_number, rounded_up
from sdnn.export.writer import CHeader, Writer, require_few_weights

_ONE = 1 << 16  # of rates
_LEAST_LOGARITHM = -1e6  # of a discount of 0, which is 0 over any duration


class LinearWriter(Writer[_core.LinearSDNN]):
    """Makes the header of an agent whose readout is linear."""

    n_critic_rows: ClassVar[int] = 0
    """Readout units, rows of weights, before those of actions: 1 if the header has a critic."""

    def code(self) -> Code:
        """Return the code of its states."""
        return Code(self.network, self.n_inputs)

    def columns(self) -> NDArray[np.intp]:
        """Return the indices of the header's columns among those of the agent's weights.

        The agent's weights have columns of 0 after each group, up to a multiple of 64.
        """
        m = self.agent.approximator.n_pattern_units
        n_groups = len(self.network.pairs)
        slots = np.arange(n_groups)[:, None] * rounded_up(m, 64) + np.arange(m)
        columns: NDArray[np.intp] = slots.reshape(-1)
        return columns

    @property
    def action_window(self) -> int:
        """The number of readout units of an action."""
        return int(self.agent.approximator.action_window)

    def n_rows(self) -> list[int]:
        """Return the number of readout units of each dimension."""
        return [n + self.action_window - 1 for n in self.n_actions()]

    def n_weights(self) -> int:
        """Return the number of weights; ValueError for too many."""
        n_weights = (self.n_critic_rows + sum(self.n_rows())) * self.code().n_columns
        require_few_weights(n_weights, "n_actions")
        return n_weights

    def description(self) -> str:
        """Return the sizes of the agent in words."""
        return (
            f"{self.n_inputs} inputs, {self.agent.approximator.n_pattern_units} units per pattern,"
            f" {' x '.join(map(str, self.n_actions()))} actions"
        )

    def defines(self) -> Data:
        """Return the sizes of the readout."""
        return {
            **self.code().defines(),
            "ACTION_WINDOW": self.action_window,
            "N_ROWS": self.n_critic_rows + sum(self.n_rows()),
            "MOST_ROWS": max(self.n_rows()),
        }

    def tables(self) -> Tables:
        """Return the constants of the spaces, the code, the actions and the readout's rows."""
        tables = self.tables_of_spaces()
        first_rows = np.cumsum([self.n_critic_rows, *self.n_rows()])[:-1]
        self.code().add_tables(tables)
        n_actions = np.array(self.n_actions())
        tables.add("uint32_t", "n_actions", n_actions, "Number of actions of each dimension.")
        tables.add("uint32_t", "first_rows", first_rows, "First readout unit of each dimension.")
        return tables

    def write_policy(
        self, file: str, weights: NDArray[np.int32], defines: Data, action_bytes: int
    ) -> CHeader:
        """Return the header of a greedy policy, with weights of shape (n_rows, n_columns).

        ``action_bytes`` are those that C needs on the stack for each action of a dimension.
        """
        tables, code = self.tables(), self.code()
        tables.add("int32_t", "weights", weights.reshape(-1))
        ram_bytes = code.most_columns * code.column_bytes + action_bytes * max(self.n_rows())
        ram_bytes += 12 * self.n_inputs + self.history_bytes()  # bins, bins of a code, and patterns
        sizes = {
            "weight_bytes": 4 * self.n_weights(),
            "ram_bytes": ram_bytes,
            "n_words": code.most_columns * sum(self.n_rows()),
        }
        return self.write(file, self.description(), self.needs(**sizes), defines, tables, **sizes)


class LinearLearner(Learner[_core.LinearSDNN], LinearWriter):
    """Makes the header of an agent that learns a linear readout with traces."""

    def write_learner(
        self,
        file: str,
        first_weights: NDArray[np.int32],
        tables: Tables,
        defines: Data,
        *,
        kilobytes: int,
        ram_bytes: int,
    ) -> CHeader:
        """Return the header of an agent that begins with a row of weights, and with 0 after them.

        ``kilobytes`` are those of its code, as for `learning_needs`.
        """
        tables.add("int32_t", "first_weights", first_weights)
        return self.write(
            file,
            self.description(),
            self.learning_needs(kilobytes, ram_bytes, self.n_weights()),
            {**self.defines(), **defines, "N_FIRST_WEIGHTS": first_weights.size},
            tables,
            weight_bytes=0,
            ram_bytes=ram_bytes,
            n_words=self.code().most_columns * sum(self.n_rows()),
        )

    def rule_of_values(self) -> Data:
        """Return the settings by which an agent with traces learns values, as whole numbers.

        The discount counts units of 2^-15, the decay of traces units of 2^-13.
        """
        learning, discount = self.agent.learning, round(self.agent.learning.discount * 32768)
        usual = "USUAL_" if self.has_durations else ""
        rule = {
            f"{usual}DISCOUNT": discount,
            # About log2(1 / (1 - discount)): values are that many times as large as rewards.
            "HORIZON_BITS": 16 - max(32768 - discount, 1).bit_length(),
            f"{usual}TRACE_DECAY": round(learning.discount * learning.trace_decay * 8192),
            "SCHEDULE_STEPS": learning.schedule_steps,
        }
        if self.has_durations:
            logarithm = max(float(_core.log(learning.discount)), _LEAST_LOGARITHM)
            rule["LOG_DISCOUNT"] = real_number(logarithm)
            rule["LAMBDA"] = real_number(learning.trace_decay)
        return rule

    def rates(self, macro: str, first: float, last: float | None) -> dict[str, int]:
        """Return a rate at the beginning and at the end of the schedule, in units of 2^-16."""
        last = first if last is None else last
        return {f"{macro}_FIRST": round(first * _ONE), f"{macro}_LAST": round(last * _ONE)}

    def with_states(self, n_bytes: int, plain_bytes: int, *, next_bins: bool) -> int:
        """Return ``n_bytes`` of fields before the struct of the last states, and the bytes of it.

        Without a history it has ``plain_bytes`` and held readings; with one, or running ranges, it
        begins at a multiple of 8 bytes. ``next_bins``: it has the bins of the next state.
        """
        if self.history.follows_ranges:
            # Two states; of each number five of sdnn_ranges and a reading; two flags.
            states = 16 * self.n_inputs + (5 * 8 + 4) * self.n_observed + 2
            return rounded_up(n_bytes, 8) + rounded_up(states, 8)
        if not self.history.is_needed:
            n_readings = self.n_observed + 1 + self.n_observed * next_bins
            return n_bytes + 4 * n_readings * self.history.holds + plain_bytes
        last = 8 * self.n_inputs + 4 * self.n_observed + self.history.episode_bytes + 1
        states = rounded_up(last, 8) + 8 * self.n_inputs + 4 * self.n_inputs * next_bins + 4
        return rounded_up(n_bytes, 8) + rounded_up(states, 8)

    @property
    def duration_bytes(self) -> int:
        """The bytes of the factors of durations, five of two bytes, up to the next word."""
        return 12 * self.has_durations

    def code_bytes(self) -> int:
        """Return the bytes of a state's code in memory."""
        code = self.code()
        n_counts, n_bins = 2, self.n_inputs  # of 4 bytes each
        n_bytes = 4 * (n_counts + n_bins) + code.column_bytes * code.most_columns
        return rounded_up(n_bytes, 4)
