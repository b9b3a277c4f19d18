"""Constants of states that depend on earlier observations: a history, or held readings."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from sdnn.agents.q_learning import ValueAgent
from sdnn.environments.types import Data
from sdnn.export.text import Input, Tables, bits_of, real_number, rounded_up

_OF_HISTORY = ("sdnn_history.h", "sdnn_history_learner.h")
_SINGLE = ("sdnn_single_observations.h", "sdnn_last_bins.h", "sdnn_last_observation.h")
_OF_HELD = ("sdnn_readings.h", "sdnn_held_observations.h")
_DIGITS = {"float64": (53, -1074), "float32": (24, -149), "float16": (11, -24), "whole": (0, 0)}
"""Binary digits of the numbers of a Box, and the exponent of their least bit; 0: whole numbers."""


class StateHistory:
    """The memory of an agent's episode, as its header has it.

    Parameters
    ----------
    agent : ValueAgent
        After its warm-up.
    inputs : sequence of Input
        Those of an observation.
    """

    def __init__(self, agent: ValueAgent[Any, Any], inputs: Sequence[Input]) -> None:
        self.agent, self.inputs, self.kind = agent, inputs, agent.history
        self.fitted = agent._state_of("history")
        self.numbers = [i for i, source in enumerate(inputs) if source.kind != "symbol"]
        self.holds = agent.missing == "hold"
        """Whether the last readings replace those that are missing."""
        self.follows_ranges = False
        """Whether ranges follow the observations from which the header learns."""

    @property
    def has_real_inputs(self) -> bool:
        """Whether the header calculates inputs as real numbers, and not their bins alone."""
        return self.is_needed or self.follows_ranges

    @property
    def is_needed(self) -> bool:
        """Whether states depend on earlier observations: symbols have no history."""
        return self.kind != "none" and bool(self.numbers)

    @property
    def has_episodes(self) -> bool:
        """Whether an action depends on more than one observation."""
        return self.is_needed or self.holds

    @property
    def unused_files(self) -> Sequence[str]:
        """The C files that its header does not need."""
        is_needed = {
            ("sdnn_policy.h",): not self.has_episodes,
            ("sdnn_episode_policy.h",): self.has_episodes,
            _SINGLE: not (self.has_episodes or self.follows_ranges),
            ("sdnn_running_ranges.h",): self.follows_ranges,
            ("sdnn_float_bins.h",): not self.has_real_inputs,
            _OF_HISTORY: self.is_needed,
            _OF_HELD: self.holds and not self.is_needed,
        }
        return [file for files, needed in is_needed.items() if not needed for file in files]

    @property
    def added(self) -> list[Input]:
        """The inputs that a state has beside those of its observation.

        These are the differences of all numbers, or all fast averages and then all slow ones.
        """
        numbers = [self.inputs[i] for i in self.numbers]
        if self.kind == "differences":  # the change of an angle is no angle
            return [replace(number, kind="variable") for number in numbers]
        return 2 * numbers if self.kind == "averages" else []

    @property
    def n_remembered(self) -> int:
        """The number of real numbers that are remembered of an episode, without actions."""
        return len(self.numbers) * (2 if self.kind == "averages" else 1)

    @property
    def episode_bytes(self) -> int:
        """The bytes of an episode's memory."""
        n_held_bytes = 4 * len(self.agent.observation_range[0]) * self.holds
        if not self.is_needed:
            return n_held_bytes
        n_actions = self.agent.n_dimensions if self.kind == "observer" else 0
        return 8 * (self.n_remembered + n_actions) + rounded_up(n_held_bytes + 1, 8)

    @property
    def stack_bytes(self) -> int:
        """The bytes of arrays that a step has on the stack."""
        if not self.is_needed:
            return 0
        n_changes = 2 * len(self.numbers) if self.kind == "observer" else 0
        return 8 * (2 * len(self.inputs) + len(self.added) + n_changes)

    @property
    def function_bytes(self) -> int:
        """The bytes of the tables of coefficients in C, of the functions that the inputs need.

        An input of kind "angle" is atan2 of two readings. An observer also takes sine and cosine of
        these, and of readings that are angles themselves ("circular").
        """
        if not self.has_real_inputs:
            return 0
        kinds = {source.kind for source in self.inputs}
        n_numbers = 23 if "angle" in kinds else 0  # coefficients of atan2
        if self.kind == "observer" and kinds & {"angle", "circular"}:
            n_numbers += 12  # coefficients of sine and cosine
        return 8 * n_numbers

    @property
    def is_box(self) -> bool:
        """Whether the observer depends on actions of a Box."""
        return self.kind == "observer" and not self.agent._action.discrete

    def constants(self) -> list[object]:
        """Return what was fitted, by which images are recognized."""
        return [self.kind, *(np.ravel(values).tolist() for values in self.fitted.values())]

    def defines(self, *, acts_between: bool) -> Data:
        """Return the macros; ``acts_between``: greedy actions may lie between those of a Box.

        SDNN_HISTORY and SDNN_HOLDS are undefined where an agent has none: C asks whether they are.
        """
        sizes: Data = {}
        if self.holds:
            sizes |= {"HOLDS": 1, "N_PARTS": len(self._part_sizes())}
        if self.follows_ranges:
            sizes["HISTORY"] = 0  # none, but states are real numbers
        if not self.is_needed:
            return sizes
        sizes |= {
            "HISTORY": {"differences": 1, "averages": 2, "observer": 3}[self.kind],
            "N_OBSERVED_INPUTS": len(self.inputs),
            "N_NUMBERS": len(self.numbers),
        }
        if self.is_box:
            sizes["N_REAL_ACTIONS"] = len(self.agent.actions_of(0))
            if acts_between:
                digits, least = _DIGITS[self.agent._action.number]
                sizes |= {"ACTION_DIGITS": digits, "LEAST_ACTION_BIT": f"({least})"}
        return sizes

    def add_tables(self, tables: Tables, *, acts_between: bool) -> None:
        """Add the constants of the history; real numbers are the bits of IEEE 754."""
        if self.holds:
            about = "Variables that are missing if one is: a number, or those of a symbol."
            tables.add("uint16_t", "part_sizes", np.array(self._part_sizes()), about)
        if not self.is_needed:
            return
        is_circular = [self.inputs[i].kind in ("angle", "circular") for i in self.numbers]
        about = "Inputs that are numbers, and whether they are angles."
        tables.add("uint16_t", "numbers", np.array(self.numbers), about)
        tables.add("uint8_t", "is_circular", np.array(is_circular, np.int64))
        if self.kind == "differences":
            largest = self.fitted["largest"][self.numbers]
            about = "Differences in which an input is 1, as the bits of doubles."
            tables.add("uint64_t", "largest_differences", bits_of(largest), about)
        elif self.kind == "observer":
            self._add_observer(tables, acts_between)

    def _add_observer(self, tables: Tables, acts_between: bool) -> None:
        """Add the tables of the observer's model, and of the actions of a Box that it observes."""
        fitted = {
            name.removeprefix("observer."): values
            for name, values in self.fitted.items()
            if name.startswith("observer.")
        }
        tables.lines.append("/* The observer's model, as the bits of doubles. */")
        for name in ("means", "deviations"):
            tables.add("uint64_t", name, bits_of(fitted[name]))
        tables.add("uint64_t", "estimate_low", bits_of(fitted["low"]))
        tables.add("uint64_t", "estimate_width", bits_of(fitted["high"] - fitted["low"]))
        tables.add("uint64_t", "observer_weights", bits_of(fitted["weights"]))
        tables.add("uint64_t", "gains", bits_of(fitted["gains"]))
        tables.add("uint8_t", "n_levels", fitted["n_levels"])
        tables.add("uint64_t", "levels", bits_of(fitted["levels"]))
        if not self.is_box:
            return
        actions = [self.agent.actions_of(d) for d in range(self.agent.n_dimensions)]
        about = "The actions of each dimension, as the bits of doubles."
        tables.add("uint64_t", "real_actions", bits_of(np.concatenate(actions)), about)
        if acts_between:
            bounds = np.column_stack([self.agent._action.low, self.agent._action.high])
            tables.add("uint64_t", "action_bounds", bits_of(bounds))

    def _part_sizes(self) -> list[int]:
        """Return the numbers of variables that are missing together."""
        sizes = {first: size for first, size in self.agent._observation.symbols}
        parts, variable = list[int](), 0
        while variable < len(self.agent.observation_range[0]):
            parts.append(sizes.get(variable, 1))  # a symbol has several variables
            variable += parts[-1]
        return parts

    def usage(self) -> Iterator[str]:
        """Describe the inputs to a reader of the header."""
        if self.kind == "observer":
            yield "Inputs that are numbers are estimates of an observer, from all readings so far."
        about = ["the change of input {} in the last step"]
        if self.kind == "averages":
            about = [f"a {speed} running average of input {{}}" for speed in ("fast", "slow")]
        texts = [text.format(i) for text in about for i in self.numbers]
        for number, text in enumerate(texts[: len(self.added)], len(self.inputs)):
            yield f"  input {number}: {text}"

    def memory_lines(self, ram_bytes: int) -> list[str]:
        """Return comment lines about the memory of a greedy policy."""
        n_bytes = self.episode_bytes
        return [
            f"RAM:   {n_bytes:,} bytes in one struct that you place; {ram_bytes - n_bytes:,} bytes"
            " of arrays on",
            "       the stack, and at most 704 bytes for all else there.",
        ]

    def calls_of_episode(self, name: str) -> list[str]:
        """Return example lines of C that begin an episode, of a policy that remembers it."""
        if not self.has_episodes:
            return []
        return [
            f"static {name}_episode episode; // the memory of an episode",
            f"{name}_begin_episode(&episode); // whenever the task starts anew",
        ]

    def calls(self) -> list[str]:
        """Return macro calls, one per input, that compute the inputs of an observation in C."""
        return [self._call(i, source) for i, source in enumerate(self.inputs)]

    def _call(self, i: int, source: Input) -> str:
        """Return the macro call that computes an input from the observed variables."""
        first = source.at[0]
        if source.kind == "angle":
            return f"ANGLE({i}, {first}, {source.at[1]})"
        if source.kind == "symbol":
            return f"SYMBOL({i}, {first}, {source.n_bins})"
        low, width = map(real_number, (source.low, source.high - source.low))
        if self.follows_ranges and source.kind == "variable":
            low, width = f"ranges->low[{first}]", f"ranges->width[{first}]"
        return f"{source.kind.upper()}({i}, {first}, {low}, {width})"
