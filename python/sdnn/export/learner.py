"""Parts of the headers of agents that learn: their state as an image, and how they are called."""

from __future__ import annotations

import math
import zlib
from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar, TypeAlias

import numpy as np

from sdnn.environments.types import Array, Data
from sdnn.export.text import Tables, rounded_up
from sdnn.export.writer import Network, Writer

_N_RECORD_WORDS, _PART_BYTES = 7, 64
"""Words after a kept policy, and bytes in which it is written: see cpp/c/sdnn_keeper.h."""
_LARGEST = 2**31 - 1  # of readings
NONE = -(2**31)
"""Number in an image that stands for a missing value."""
SCALE = "reward_scale"
SCALE_FIELDS = [
    (f"{SCALE}.n_rewards", "<u8"),
    (f"{SCALE}.size", "<i4"),
    (f"{SCALE}.size_in_window", "<i4"),
    (f"{SCALE}.headroom", "<i4"),
]
MOMENTS = {"counts": "<u8", "means": "<f8", "squares": "<f8"}
"""Names and types of the moments of running ranges."""
Field: TypeAlias = tuple[str, str] | tuple[str, str, tuple[int, ...]]
"""Name and type of a field of an image, and its shape."""


class Learner(Writer[Network]):
    """Makes the header of an agent that learns, and keeps what it has learned in an image.

    An image has fields of fixed sizes, one after the other, and a checksum. The core's state has
    most of them by the same names.
    """

    title = "an agent that learns"
    magic: ClassVar[int]
    streams: ClassVar[tuple[str, ...]]
    """Names of the random generators, in the order of the image."""

    @abstractmethod
    def fields(self) -> list[Field]:
        """Return names, types and shapes of an image, as `numpy.dtype` takes them."""

    @abstractmethod
    def remembered(self, state: Data) -> Data:
        """Return the fields that are not in the core's state, or differ there."""

    @abstractmethod
    def recall(self, image: Array, state: Data) -> None:
        """Write the fields of an image into the core's state; ValueError for impossible values."""

    def layout(self) -> np.dtype[Any]:
        """Return the type of an image without its checksum."""
        head = [("magic", "<u4"), ("fingerprint", "<u4")]
        return np.dtype([*head, *self.fields()])

    def state(self) -> Data:
        """Return the core's state and the scale of rewards; numbers not known yet are `NONE`."""
        scale = {"size": NONE, "size_in_window": NONE, **self.agent._state_of("reward_scale")}
        state = self.agent._state_of("agent")
        return state | {f"{SCALE}.{name}": number for name, number in scale.items()}

    def image(self) -> bytes:
        """Return the state as the header's bytes."""
        state, image = self.state(), np.zeros((), self.layout())
        known = {"magic": self.magic, "fingerprint": self.fingerprint(), **state}
        generators = np.array([state[f"{stream}.words"] for stream in self.streams], np.uint64)
        known |= {"words": generators, **self.remembered(state)}
        for name in image.dtype.names or ():
            image[name] = known.get(name, 0)
        content = image.tobytes()
        return content + zlib.crc32(content).to_bytes(4, "little")

    def restore(self, whole: bytes) -> None:
        """Set the agent's state from an image; ValueError if it is damaged or another agent's."""
        (image,) = np.frombuffer(whole, self.layout(), 1)
        state = self.agent._state_of("agent")
        for stream, words in zip(self.streams, image["words"], strict=True):
            state[f"{stream}.words"] = words.copy()
        fields = image.dtype.names or ()
        state.pop("n_random_left", None)  # an agent's state has it only where it is not 0
        if "n_random_left" in fields and (n_left := image["n_random_left"]):
            state["n_random_left"] = np.array(n_left, np.int32)
        self.recall(image, state)
        names = [name for name in fields if name.startswith(SCALE)]
        known = {name: np.array(image[name]) for name in names if image[name] != NONE}
        scale = {name.removeprefix(f"{SCALE}."): number for name, number in known.items()}
        parts = {"agent": state, "reward_scale": scale}
        if self.history.follows_ranges:
            parts["observations"] = self._observations_of(image)
        self.agent._restore(**parts)

    def _observations_of(self, image: Array) -> Data:
        """Return the core's state of running ranges, with the moments of an image."""
        counts, means, squares = (image[f"running.{name}"].copy() for name in MOMENTS)
        state = self.agent._state_of("observations")
        if "low" in state:  # where a warm-up found the inputs, the ranges are listed too
            # The ranges of cpp/include/sdnn/agents/running_ranges.hpp: 2.5 deviations each way.
            deviations = np.sqrt(squares / np.maximum(counts - 1.0, 1.0))
            deviations[counts < 2] = 1.0
            ends = 2.5 * np.maximum(deviations, np.maximum(1e-6 * np.abs(means), 1e-140))
            at = [source.at[0] for source in self.inputs if source.kind == "variable"]
            state["low"][at], state["high"][at] = (means - ends)[at], (means + ends)[at]
        moments = (counts.astype(np.int64), means, squares)
        return state | {f"running.{name}": m for name, m in zip(MOMENTS, moments, strict=True)}

    def tie_rule(self) -> str:
        """Return how the agent breaks ties."""
        return str(self.agent.learning.tie_rule)

    def tie_remark(self) -> list[str]:
        """Describe how ties are broken."""
        first, *rest = super().tie_remark()
        return [first.replace("it takes", f"{self.name}_act takes"), *rest, *self.greedy_remark()]

    def greedy_remark(self) -> list[str]:
        """Describe how the agent acts without exploration."""
        action = ", action" if self.is_vector else ""
        remark = [
            f"{self.name}_greedy({self.greedy_arguments}{action}) has a best action,",
            "and changes nothing of the agent.",
        ]
        if self.tie_rule() == "uniform":
            remark.append("Of several it takes the middle of the widest run.")
        if self.history.has_episodes:
            remark += [
                f"A {self.name}_greedy_episode is the memory of greedy steps;"
                f" {self.name}_begin_greedy_episode",
                "begins one apart from the episode of which the agent learns.",
            ]
        return remark

    @property
    def greedy_arguments(self) -> str:
        """The arguments of greedy functions."""
        episode = "&episode, " if self.history.has_episodes else ""
        return f"&agent, {episode}observation"

    def calls(self) -> list[str]:
        """Return example lines of C in which the agent acts and learns."""
        name, arguments = self.name, "observation, action, reward, next_observation, terminated"
        action = [f"uint32_t action = {name}_act(&agent, observation); // at times a random one"]
        if self.is_vector:
            action = [
                f"uint32_t action[{name.upper()}_N_DIMENSIONS];",
                f"{name}_act(&agent, observation, action); // at times a random one",
            ]
        return [
            f"static {name}_agent agent; // everything that it remembers",
            f"{name}_begin(&agent);",
            f"{name}_begin_episode(&agent); // whenever the task starts anew",
            *action,
            f"{name}_learn(&agent, {arguments});",
            *self._call_over(arguments),
        ]

    def _call_over(self, arguments: str) -> list[str]:
        """Return example lines that learn a step of another duration, where a header does."""
        if not self.has_durations:
            return []
        return [
            "// or, if the step took dt usual steps, here a constant:",
            f"{self.name}_learn_over(&agent, {arguments}, {self.name.upper()}_DURATION(2.5));",
        ]

    def add_head(self, tables: Tables, end: str) -> None:
        """Add the head of the agent's image, which ends with the field ``end``."""
        fields: Mapping[str, Any] = self.layout().fields or {}
        head = np.frombuffer(self.image()[: fields[end][1]], np.uint8)
        tables.add(
            "uint8_t", "first_head", head, "The state that the agent begins with, as in an image."
        )

    def add_limits(self, tables: Tables) -> None:
        """Add the least and the largest reading that count, of each observed number."""
        limits = np.zeros((self.n_observed, 2), np.int64)
        scale = 2.0**self.fraction_bits
        for source in self.inputs:
            first = source.at[0]
            if source.kind == "variable":
                limits[first] = math.floor(source.low * scale), math.ceil(source.high * scale)
            elif source.kind == "symbol":
                limits[first : first + source.n_bins] = -_LARGEST, _LARGEST
            else:
                limits[list(source.at)] = -_LARGEST, _LARGEST
        about = "The range of each observed number, beyond which all are equal."
        tables.add("int32_t", "limits", limits, about)

    def tables_of_spaces(self) -> Tables:
        """Write the constants of observations and actions."""
        tables = super().tables_of_spaces()
        if self.history.holds and not self.history.is_needed:
            self.add_limits(tables)
        return tables

    def learning_defines(self) -> Data:
        """Return the macros that all headers of learning agents have."""
        learning = self.agent.learning
        return {
            "FINGERPRINT": f"UINT32_C(0x{self.fingerprint():08x})",
            "START_STEPS": learning.start_steps,
            "N_GREEDY_STEPS": learning.n_greedy_steps,
            "MAX_ACTION_REPEAT": learning.max_action_repeat,
        }

    def learning_needs(
        self, kilobytes: int, ram_bytes: int, n_policy_words: int, stack: str = ""
    ) -> list[str]:
        """Return comment lines about memory.

        ``kilobytes`` of code are those without a history, running ranges or durations, of which 3
        are for storing and keeping; ``n_policy_words`` are the 32-bit words of the kept policy.
        """
        kilobytes += 3 * self.history.is_needed
        kilobytes += 2 * (self.history.follows_ranges + self.has_durations)
        kept_bytes = rounded_up(4 * (n_policy_words + _N_RECORD_WORDS), _PART_BYTES)
        return [
            f"Flash: {{flash}} bytes of constants; the code comes to some {kilobytes} kB.",
            f"RAM:   {ram_bytes:,} bytes, in one struct that you place{stack}.",
            f"       A policy that {self.name}_keep keeps takes {kept_bytes:,} more, or flash.",
            "       No heap, and nothing static that changes.",
            "Where the processor cannot multiply or shift 64 bits by itself, the compiler's"
            " library",
            "does (libgcc); nothing is divided.",
        ]
