"""An agent with a linear readout as a C header: its greedy policy, or the agent, which learns."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdnn.agents import SDNNQLambda
from sdnn.export.code import Code
from sdnn.export.tables import Tables
from sdnn.export.writer import NONE, SCALE_FIELDS, CHeader, Learner, Writer, require_few_weights

_WEIGHTS = {"weights": "action_value.weights", "averaged": "action_value.averaged_weights"}
"""Names in the header and in the core's state."""
_ONE = 1 << 16  # of rates
_MOST_TOLERANCE = 2**62  # in units: above any difference of values


class LinearWriter(Writer):
    """Makes the header of an `SDNNQLambda` agent's greedy policy."""

    agent: SDNNQLambda

    def network(self) -> Any:
        """Return the readout."""
        return self.networks[0]

    def code(self) -> Code:
        """Return the code of its states."""
        return Code(self.network(), self.n_inputs)

    def columns(self) -> NDArray[np.intp]:
        """Return the places of the header's columns among those of the weights."""
        m = self.agent.approximator.n_pattern_units
        n_groups = len(self.network().pairs)
        slots = np.arange(n_groups)[:, None] * (-(-m // 64) * 64) + np.arange(m)
        return slots.reshape(-1)

    def sizes(self) -> dict[str, Any]:
        """Return what the templates of a readout need, and check it."""
        config = self.agent.approximator
        window, code = config.action_window, self.code()
        n_actions = self.n_actions()
        n_rows = sum(n + window - 1 for n in n_actions)
        n_weights = n_rows * code.n_columns
        require_few_weights(n_weights, "n_actions")
        return {
            **code.values(),
            "description": (
                f"{self.n_inputs} inputs, {config.n_pattern_units} units per pattern,"
                f" {' x '.join(map(str, n_actions))} actions"
            ),
            "coding": f"{self.name}_",
            "n_rows": n_rows,
            "n_weights": n_weights,
            "n_actions": n_actions,
            "n_windows": window * self.n_dimensions,
            "most_rows": max(n_actions) + window - 1,
            "is_linear": True,
        }

    def tolerance(self) -> tuple[int, int]:
        """Return the tolerance of ties as a number below 2^62, times 2 to a power."""
        fraction, exponent = math.frexp(self.agent.learning.tie_tolerance)
        return int(fraction * _MOST_TOLERANCE), exponent - 62

    def add_code(self, tables: Tables, sizes: dict[str, Any]) -> None:
        """Add the constants of the code and of the readout's rows."""
        self.code().add_tables(tables)
        n_actions = np.array(sizes["n_actions"])
        n_rows = n_actions + self.agent.approximator.action_window - 1
        first_rows = np.cumsum([0, *n_rows])[:-1]
        tables.add("uint32_t", "n_actions", n_actions, "Actions of each dimension.")
        tables.add("uint32_t", "first_rows", first_rows, "Readout units of each dimension.")

    def header(self) -> CHeader:
        """Make the header."""
        sizes, tables = self.sizes(), self.tables_of_spaces()
        self.add_code(tables, sizes)
        state = self.agent.state("agent")
        weights = state["action_value.weights"]
        if np.any(state.get("action_value.n_snapshots", 0)):
            weights = state["action_value.averaged_weights"]
        tables.add("int32_t", "weights", weights[:, self.columns()].reshape(-1))
        most_columns = sizes["most_columns"]
        number, exponent = self.tolerance()
        shift = int(state.get("action_value.exponent", 0)) - exponent
        tolerance = min(number << max(-shift, 0) >> max(shift, 0), _MOST_TOLERANCE)
        n_words = min(most_columns, sizes["n_columns"]) * sizes["n_rows"]
        ram_bytes = most_columns * sizes["bytes_of_column"] + 8 * sizes["most_rows"]
        values = {
            "weight_bytes": 4 * sizes["n_weights"],
            "ram_bytes": ram_bytes + 12 * self.n_inputs,
            "n_words": n_words,
            "ties": self.ties(),
            "tolerance": f", INT64_C({tolerance})" if tolerance else "",
        }
        return self.write("c_linear", {**sizes, **values}, tables)


class LearnerWriter(Learner, LinearWriter):
    """Makes the header of an `SDNNQLambda` agent that learns."""

    magic = 0x4C4E4453  # "SDNL"
    streams = ("policy.exploration", "policy.ties", "policy.evaluation_ties", "repetitions")

    def fields(self) -> list[tuple[Any, ...]]:
        """Return names, types and shapes of an image."""
        sizes, kept = self.sizes(), [*_WEIGHTS.values()][: 1 + self.averages]
        return [
            ("action_value.exponent", "<i4"),
            ("action_value.n_snapshots", "<u4"),
            ("n_random_left", "<u4"),
            ("n_ended", "<u4"),
            ("n_learned", "<u8"),
            ("action_value.n_steps", "<u8"),
            *SCALE_FIELDS,
            ("words", "<u8", (4, 4)),
            *((name, "<i4", (sizes["n_rows"], sizes["n_columns"])) for name in kept),
        ]

    @property
    def averages(self) -> bool:
        """Whether the agent acts by an average of its weights."""
        return self.agent.approximator.averaging_interval > 0

    def remembered(self, state: dict[str, Any]) -> dict[str, Any]:
        """Return the fields that are not the same in the core's state."""
        columns = self.columns()
        rows = {name: state[name][:, columns] for name in _WEIGHTS.values() if name in state}
        return {"action_value.exponent": NONE, **state, **rows}

    def recall(self, image: Any, state: dict[str, Any]) -> None:
        """Put the fields of an image into the core's state; the episode before is over."""
        for name in ("waits", "reward", "old_value"):
            state[name] = np.zeros_like(state[name])
        state["trace.values"] = state["trace.values"][:0]
        for name in ("action_value.n_steps", "action_value.n_snapshots", "n_learned"):
            if name in state:
                state[name] = np.array(image[name], np.int64)
        for name, nothing in (("action_value.exponent", NONE), ("n_ended", 0)):
            state.pop(name, None)
            if image[name] != nothing:
                state[name] = np.array(image[name], np.int32)
        for name in _WEIGHTS.values():
            if name in state:
                state[name] = np.zeros_like(state[name])
                state[name][:, self.columns()] = image[name]

    def header(self) -> CHeader:
        """Make the header."""
        learning, sizes, tables = self.agent.learning, self.sizes(), self.tables_of_spaces()
        state, known = self.state(), list[str]()
        self.add_code(tables, sizes)
        about = "What the agent begins with: states of its random generators."
        tables.add("uint64_t", "seeds", self.seeds(state), about)
        number, exponent = self.tolerance()
        n_image_weights = (1 + self.averages) * sizes["n_weights"]
        for mine, name in _WEIGHTS.items():
            rows = state.get(name)
            if rows is not None and rows.any():
                known.append(mine)
                first = rows[:, self.columns()].reshape(-1)
                tables.add("int32_t", f"first_{mine}", first)
        values = {
            **self.values_of_learning(state),
            "weight_bytes": 0,
            "ram_bytes": self.ram_bytes(sizes),
            "n_words": sizes["most_columns"] * sizes["n_rows"],
            "has_progress": False,
            "averages": self.averages,
            "rate": self._rate("learning_rate"),
            "epsilon": self._rate("epsilon"),
            "decay": round(learning.discount * learning.trace_decay * 8192),
            "discount": round(learning.discount * 32768),
            "horizon_bits": 16 - max(32768 - round(learning.discount * 32768), 1).bit_length(),
            "tolerance": f", {self.name}_tolerance(agent)" if number else "",
            "tolerance_number": number,
            "tolerance_exponent": exponent,
            "most_tolerance": _MOST_TOLERANCE,
            "known": known,
            "image_head": self.layout().itemsize - 4 * n_image_weights,
            "n_image_weights": n_image_weights,
        }
        return self.write("c_learning", {**sizes, **values}, tables)

    def _rate(self, name: str) -> str:
        """Write alpha or epsilon: as it is now, or by the schedule."""
        learning, state = self.agent.learning, self.agent.state("agent")
        if learning.schedule_steps == 0 or name in state:
            return str(round(getattr(self.agent, name) * _ONE))
        first, last = getattr(learning, name), learning.final_learning_rate
        if name == "epsilon":
            last = self.agent.final_epsilon
        ends = [round(one * _ONE) for one in (first, first if last is None else last)]
        return f"{self.name}_scheduled(agent, {ends[0]}, {ends[1]})"

    def ram_bytes(self, sizes: dict[str, Any]) -> int:
        """Return the bytes of the struct, where numbers lie at multiples of their sizes."""
        code = 8 + 4 * self.n_inputs + sizes["bytes_of_column"] * sizes["most_columns"]
        n_bytes: int = 8 * 3 + 24 + 32 * 4 + 4 * (2 + self.averages) * sizes["n_weights"] + 4 * 10
        n_bytes += 4 * (2 * self.n_dimensions + self.n_inputs) + 2 * (-(-code // 4) * 4)
        n_bytes += 3 + int(sizes["n_rows"])
        return -(-n_bytes // 8) * 8
