"""SDNNQLambda as a C header: its greedy policy, or the agent that learns."""

from __future__ import annotations

import math

import numpy as np

from sdnn.agents import SDNNQLambda
from sdnn.environments.types import Array, Data
from sdnn.export.learner import NONE, SCALE_FIELDS, Field
from sdnn.export.linear import LinearLearner, LinearWriter
from sdnn.export.text import rounded_up
from sdnn.export.writer import CHeader

_WEIGHTS = ("action_value.weights", "action_value.averaged_weights")
_MOST_TOLERANCE = 2**62  # in units: above any difference of values


class QLambdaWriter(LinearWriter):
    """Makes the header of an `SDNNQLambda` agent's greedy policy."""

    agent: SDNNQLambda

    def tolerance(self) -> tuple[int, int]:
        """Return (number, exponent) of the tolerance of ties, number 2^exponent; number < 2^62."""
        fraction, exponent = math.frexp(self.agent.learning.tie_tolerance)
        return int(fraction * _MOST_TOLERANCE), exponent - 62  # the fraction is in [0.5, 1)

    def header(self) -> CHeader:
        """Make the header; an action has a value of 8 bytes."""
        state = self.agent._state_of("agent")
        weights, averaged = _WEIGHTS
        has_average = np.any(state.get("action_value.n_snapshots", 0))
        number, exponent = self.tolerance()
        # The tolerance in the unit of values, whose exponent is in the agent's state.
        shift = exponent - int(state.get("action_value.exponent", 0))
        tolerance = min(number << shift if shift > 0 else number >> -shift, _MOST_TOLERANCE)
        defines = {**self.defines(), "TIE_TOLERANCE": f"INT64_C({tolerance})"}
        rows = state[averaged if has_average else weights][:, self.columns()]
        return self.write_policy("sdnn_greedy_q_lambda.h", rows, defines, 8)


class QLambdaLearner(LinearLearner, QLambdaWriter):
    """Makes the header of an `SDNNQLambda` agent that learns."""

    magic = 0x4C4E4453  # "SDNL"
    streams = ("policy.exploration", "policy.ties", "policy.evaluation_ties", "repetitions")

    def fields(self) -> list[Field]:
        """Return names, types and shapes of an image."""
        shape = sum(self.n_rows()), self.code().n_columns
        names = _WEIGHTS[: 1 + self.averages]
        return [
            ("action_value.exponent", "<i4"),
            ("action_value.n_snapshots", "<u4"),
            ("n_random_left", "<u4"),
            ("n_ended", "<u4"),
            ("n_learned", "<u8"),
            ("action_value.n_steps", "<u8"),
            *SCALE_FIELDS,
            ("words", "<u8", (4, 4)),
            *((name, "<i4", shape) for name in names),
        ]

    @property
    def averages(self) -> bool:
        """Whether the agent acts by an average of its weights."""
        return self.agent.approximator.averaging_interval > 0

    def remembered(self, state: Data) -> Data:
        """Return the fields that are not in the core's state, or differ there."""
        columns = self.columns()
        rows = {name: state[name][:, columns] for name in _WEIGHTS if name in state}
        return {"action_value.exponent": NONE, **state, **rows}

    def recall(self, image: Array, state: Data) -> None:
        """Write the fields of an image into the core's state, in which a new episode begins."""
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
        for name in _WEIGHTS:
            if name in state:
                state[name] = np.zeros_like(state[name])
                state[name][:, self.columns()] = image[name]

    def header(self) -> CHeader:
        """Make the header."""
        state, tables = self.state(), self.tables()
        self.add_head(tables, _WEIGHTS[0])
        rows = [state[name][:, self.columns()].reshape(-1) for name in _WEIGHTS if name in state]
        while rows and not rows[-1].any():
            rows.pop()  # weights, or their averages, that are all 0 need no table
        first_weights = np.concatenate([*rows, np.zeros(0, np.int32)])
        defines = {**self._learning_rule(), **self.learning_defines()}
        sizes = {"kilobytes": 9, "ram_bytes": self._ram_bytes(self.n_weights())}
        return self.write_learner("sdnn_q_lambda.h", first_weights, tables, defines, **sizes)

    def _learning_rule(self) -> Data:
        """Return the macros of the learning rule."""
        learning = self.agent.learning
        number, exponent = self.tolerance()
        n_symbols = self.agent.approximator.n_symbols
        has_symbols_only = len(n_symbols) > 0 and all(n_symbols)
        return {
            "SEARCHES": int(learning.max_action_repeat > 1 and not has_symbols_only),
            "IS_DUTCH": int(learning.traces == "dutch"),
            "IS_SARSA": int(learning.bootstrap == "sarsa"),
            "AVERAGING_INTERVAL": self.agent.approximator.averaging_interval,
            **self.rule_of_values(),
            **self._rates("RATE", "learning_rate"),
            **self._rates("EPSILON", "epsilon"),
            "TIE_TOLERANCE": f"INT64_C({number})",
            "TIE_TOLERANCE_EXPONENT": f"({exponent})",
        }

    def _rates(self, macro: str, name: str) -> dict[str, int]:
        """Return alpha or epsilon at the beginning and at the end of the schedule."""
        learning = self.agent.learning
        if learning.schedule_steps == 0 or name in self.agent._state_of("agent"):
            first = last = getattr(self.agent, name)
        else:
            first, last = getattr(learning, name), learning.final_learning_rate
            if name == "epsilon":
                last = self.agent.final_epsilon
        return self.rates(macro, first, last)

    def _ram_bytes(self, n_weights: int) -> int:
        """Return the bytes of the struct, where numbers lie at multiples of their sizes."""
        n_bytes = 8 * 3 + 24 + 32 * 4  # numbers of 64 bits, reward scale, generators
        n_bytes += 4 * (2 + self.averages) * n_weights + 4 * 10  # weights, traces; 32-bit numbers
        n_bytes += 4 * 2 * self.n_dimensions  # the action, and the one that is repeated
        n_bytes = self.with_states(n_bytes, 4 * self.n_inputs, next_bins=True)
        n_bytes += 2 * self.code_bytes() + self.duration_bytes
        n_bytes += 5 + sum(self.n_rows())  # flags, flags of rows
        return rounded_up(n_bytes, 8)
