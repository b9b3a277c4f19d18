"""An agent with a linear readout as a C header: its greedy policy, or the agent, which learns."""

from __future__ import annotations

import math
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdnn.agents import SDNNSarsa
from sdnn.export.code import Code
from sdnn.export.tables import Tables
from sdnn.export.writer import MOST_WEIGHTS, CHeader, Writer

_IMAGE_MAGIC = 0x4C4E4453  # "SDNL"
_IMAGE_HEAD = 40 + 4 * 32
"""Bytes of an image before its weights."""
_STREAMS = ("policy.exploration", "policy.ties", "policy.evaluation_ties", "repetitions")
_NO_EXPONENT = -(2**31)
_WEIGHTS = {"weights": "weights", "averaged": "averaged_weights"}
_ONE = 1 << 16  # of rates
_MOST_TOLERANCE = 2**40  # above any value


class LinearWriter(Writer):
    """Makes the header of an `SDNNSarsa` agent's greedy policy."""

    agent: SDNNSarsa

    def network(self) -> Any:
        """Return the readout."""
        return self.core.action_value

    def code(self) -> Code:
        """Return the code of its states."""
        return Code(self.network(), len(self.inputs))

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
        if n_weights > MOST_WEIGHTS:
            raise ValueError(
                f"a C header can hold {MOST_WEIGHTS} weights, got {n_weights}: take fewer"
                " inputs, n_actions or n_pattern_units"
            )
        return {
            **code.values(),
            "description": (
                f"{len(self.inputs)} inputs, {config.n_pattern_units} units per pattern,"
                f" {' x '.join(map(str, n_actions))} actions"
            ),
            "coding": f"{self.name}_",
            "n_rows": n_rows,
            "n_weights": n_weights,
            "n_actions": n_actions,
            "window": window,
            "n_windows": window * self.n_dimensions,
            "most_rows": max(n_actions) + window - 1,
            "tolerance": math.floor(min(self.agent.learning.tie_tolerance, _MOST_TOLERANCE)),
            "is_linear": True,
        }

    def add_code(self, tables: Tables, sizes: dict[str, Any]) -> None:
        """Add the constants of the code and of the readout's rows."""
        name = self.name
        self.code().add_tables(tables, name)
        n_actions = np.array(sizes["n_actions"])
        first_rows = np.cumsum([0, *(n_actions + sizes["window"] - 1)])[:-1]
        tables.add("uint32_t", f"{name}_n_actions", n_actions, "Actions of each dimension.")
        tables.add("uint32_t", f"{name}_first_rows", first_rows, "Readout units of each dimension.")

    def header(self) -> CHeader:
        """Make the header."""
        sizes, tables = self.sizes(), self.tables_of_spaces()
        self.add_code(tables, sizes)
        state = self.core.state()
        weights = state["action_value.weights"]
        if np.any(state.get("action_value.n_snapshots", 0)):
            weights = state["action_value.averaged_weights"]
        tables.add("int32_t", f"{self.name}_weights", weights[:, self.columns()].reshape(-1))
        most_columns = sizes["most_columns"]
        n_words = min(most_columns, sizes["n_columns"]) * sizes["n_rows"]
        ram_bytes = most_columns * sizes["bytes_of_column"] + 8 * sizes["most_rows"]
        values = {
            "weight_bytes": 4 * sizes["n_weights"],
            "ram_bytes": ram_bytes + 12 * len(self.inputs),
            "n_words": n_words,
            "ties": self.ties(),
        }
        return self.write("c_linear", {**sizes, **values}, tables)


class LearnerWriter(LinearWriter):
    """Makes the header of an `SDNNSarsa` agent that learns."""

    def image(self) -> bytes:
        """Return the state as the header's bytes."""
        state, columns = self.core.state(), self.columns()
        exponent = state.get("action_value.exponent", _NO_EXPONENT)
        head = [
            np.array([_IMAGE_MAGIC, self.fingerprint()], "<u4"),
            np.array([exponent], "<i4"),
            np.array([state.get("action_value.n_snapshots", 0), _left(state)], "<u4"),
            np.array([state.get("n_ended", 0)], "<u4"),
            np.array([state["n_learned"], state.get("action_value.n_steps", 0)], "<u8"),
            *(state[f"{stream}.words"].astype("<u8") for stream in _STREAMS),
        ]
        names = ("action_value.weights", "action_value.averaged_weights")
        rows = [state[n][:, columns].astype("<i4") for n in names if n in state]
        image = b"".join(part.tobytes() for part in (*head, *rows))
        return image + zlib.crc32(image).to_bytes(4, "little")

    def restore(self, image: bytes) -> None:
        """Give the agent the state of an image, whole and of this agent."""
        exponent = int.from_bytes(image[8:12], "little", signed=True)
        n_snapshots, n_left, n_ended = np.frombuffer(image, "<i4", 3, 12).tolist()
        n_learned, n_steps = np.frombuffer(image, "<i8", 2, 24).tolist()
        words = np.frombuffer(image, "<u8", 16, 40).reshape(4, 4)
        state = self.core.state()
        for name in ("waits", "reward", "old_value"):  # of the episode before
            state[name] = np.zeros_like(state[name])
        state["trace.values"] = state["trace.values"][:0]
        for name in ("action_value.exponent", "n_random_left", "n_ended"):
            state.pop(name, None)
        state["n_learned"] = np.array(n_learned, np.int64)
        if exponent != _NO_EXPONENT:
            state["action_value.exponent"] = np.array(exponent, np.int32)
        if "action_value.n_steps" in state:
            state["action_value.n_steps"] = np.array(n_steps, np.int64)
            state["action_value.n_snapshots"] = np.array(n_snapshots, np.int64)
        if n_left:
            state["n_random_left"] = np.array(n_left, np.int32)
        if n_ended:
            state["n_ended"] = np.array(n_ended, np.int32)
        state |= {f"{name}.words": one.copy() for name, one in zip(_STREAMS, words, strict=True)}
        kept = [name for name in ("weights", "averaged_weights") if f"action_value.{name}" in state]
        at, columns = _IMAGE_HEAD, self.columns()
        for name in kept:
            rows = np.zeros_like(state[f"action_value.{name}"])
            n = rows.shape[0] * columns.size
            rows[:, columns] = np.frombuffer(image, "<i4", n, at).reshape(-1, columns.size)
            state[f"action_value.{name}"] = rows
            at += 4 * n
        self.core.restore(state)

    def header(self) -> CHeader:
        """Make the header."""
        learning, sizes, tables = self.agent.learning, self.sizes(), self.tables_of_spaces()
        config, state = self.agent.approximator, self.core.state()
        self.add_code(tables, sizes)
        seeds = np.array([state[f"{stream}.words"] for stream in _STREAMS])
        about = "What the agent begins with: states of its random generators."
        tables.add("uint64_t", f"{self.name}_seeds", seeds, about)
        averages = config.averaging_interval > 0
        n_image_weights = (1 + averages) * sizes["n_weights"]
        for mine, name in _WEIGHTS.items():
            rows = state.get(f"action_value.{name}")
            if rows is not None and rows.any():
                known = rows[:, self.columns()].reshape(-1)
                tables.add("int32_t", f"{self.name}_first_{mine}", known)
        values = {
            "weight_bytes": 0,
            "ram_bytes": self.ram_bytes(sizes),
            "n_words": sizes["most_columns"] * sizes["n_rows"],
            "ties": "draw" if learning.tie_rule == "uniform" else self.ties(),
            "has_progress": False,
            "averages": averages,
            "interval": max(1, config.averaging_interval),
            "schedule_steps": learning.schedule_steps,
            "rate": self._rate("learning_rate"),
            "epsilon": self._rate("epsilon"),
            "decay": round(learning.discount * learning.trace_decay * 8192),
            "discount": round(learning.discount * 32768),
            "is_dutch": learning.traces == "dutch",
            "is_sarsa": learning.bootstrap == "sarsa",
            "exponent": state.get("action_value.exponent"),
            "n_learned": state["n_learned"],
            "n_ended": state.get("n_ended", 0),
            "n_steps": state.get("action_value.n_steps", 0),
            "n_snapshots": state.get("action_value.n_snapshots", 0),
            "known": [mine for mine in _WEIGHTS if f"_first_{mine}[" in tables.text()],
            "n_random_left": _left(state),
            "start_steps": learning.start_steps,
            "late": learning.n_greedy_steps,
            "most_kept": learning.max_action_repeat,
            "least_kept": min(5, learning.max_action_repeat),
            "image_bytes": _IMAGE_HEAD + 4 * n_image_weights + 4,
            "image_head": _IMAGE_HEAD,
            "image_magic": f"0x{_IMAGE_MAGIC:08x}",
            "fingerprint": f"0x{self.fingerprint():08x}",
            "n_image_weights": n_image_weights,
        }
        return self.write("c_learning", {**sizes, **values}, tables)

    def _rate(self, name: str) -> str:
        """Write alpha or epsilon: as it is now, or by the schedule."""
        learning, state = self.agent.learning, self.core.state()
        if learning.schedule_steps == 0 or name in state:
            return str(round(getattr(self.core, name) * _ONE))
        first, last = getattr(learning, name), learning.final_learning_rate
        if name == "epsilon":
            last = self.core.final_epsilon
        ends = [round(one * _ONE) for one in (first, first if last is None else last)]
        return f"{self.name}_scheduled(agent, {ends[0]}, {ends[1]})"

    def ram_bytes(self, sizes: dict[str, Any]) -> int:
        """Return the bytes of the struct, where numbers lie at multiples of their sizes."""
        n_inputs, averages = len(self.inputs), self.agent.approximator.averaging_interval > 0
        code = 8 + 4 * n_inputs + sizes["bytes_of_column"] * sizes["most_columns"]
        n_bytes: int = 8 * 3 + 32 * 4 + 4 * (2 + averages) * sizes["n_weights"] + 4 * 10
        n_bytes += 4 * (2 * self.n_dimensions + n_inputs) + 2 * (-(-code // 4) * 4)
        n_bytes += 3 + int(sizes["n_rows"])
        return -(-n_bytes // 8) * 8


def _left(state: Any) -> int:
    left = state.get("n_random_left")
    return 0 if left is None else int(left)
