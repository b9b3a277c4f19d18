"""Parts of the headers of all agents: observations, actions and the frame of the file."""

from __future__ import annotations

import json
import math
import zlib
from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, ClassVar, Generic, TypeVar

import gymnasium as gym
import numpy as np

from sdnn import _core
from sdnn.agents.q_learning import ValueAgent
from sdnn.environments.types import Array, Data
from sdnn.export.history import StateHistory
from sdnn.export.text import (
    Header,
    Input,
    Tables,
    by_dimension,
    c_source,
    conversions,
    define_lines,
    header_text,
    joined,
    normalization_comment,
    scaling_comment,
    table_lines,
)
from sdnn.support.arguments import argument_error, whole

_DEFAULT_FRACTION_BITS = 16
_FEW_STEPS = 64  # of fixed point: a chosen number, below which a range is hardly resolved
MOST_FRACTION_BITS = 30
_TIES = {"lowest": "LOWEST", "middle": "MIDDLE", "uniform": "DRAWN"}
_OF_DURATIONS = ("sdnn_durations.h", "sdnn_learn_over.h")
MOST_WEIGHTS = 2**26  # larger headers would have hundreds of megabytes
Network = TypeVar("Network", bound=_core.SDNNC | _core.LinearSDNN)


@dataclass(frozen=True, kw_only=True)
class CHeader(Header):
    """A C header that holds an agent's greedy policy, or an agent that learns.

    ``text`` is the file and ``name`` the prefix of its names. Fixed-point observations and actions
    are multiples of ``2**-fraction_bits``. ``flash_bytes`` of constants include ``weight_bytes``.
    ``ram_bytes`` are the arrays that a decision has on the stack or, if the agent learns, all that
    it remembers. A decision reads ``n_words`` 32-bit words of weights.
    """

    fraction_bits: int
    n_words: int


class Writer(ABC, Generic[Network]):
    """Makes the header of one agent; subclasses have its kind of network."""

    title: ClassVar[str] = "the greedy policy of a trained agent"
    has_durations = False
    """Whether the header learns transitions of unequal durations."""

    def __init__(self, agent: ValueAgent[Any, Any], name: str, fraction_bits: int | None) -> None:
        self.agent, self.name = agent, name
        self.networks: list[Network] = agent.networks  # raises RuntimeError in a warm-up
        self.n_dimensions = agent.n_dimensions
        self.is_vector = self.n_dimensions > 1
        self.box = self._box()
        first = [agent.actions_of(d)[0] for d in range(agent.n_dimensions)]
        self.start: list[int] = [] if self.box is not None else [int(number) for number in first]
        if any(not -(2**31) <= start < 2**31 for start in self.start):
            raise ValueError(f"actions must begin within 32 bits, got {self.start}")
        self.inputs = self._inputs()
        self.history = StateHistory(agent, self.inputs)
        self.n_inputs = len(self.inputs) + len(self.history.added)
        self.n_observed = len(agent.observation_range[0])
        self.fraction_bits = self._checked_fraction_bits(fraction_bits)

    @property
    def network(self) -> Network:
        """The network of the first dimension, which has the patterns of the inputs."""
        return self.networks[0]

    @abstractmethod
    def header(self) -> CHeader:
        """Make the header."""

    @property
    def codes_missing(self) -> bool:
        """Whether the last pattern of each input stands for missing readings."""
        return self.agent.missing == "code"

    def unused_files(self) -> list[str]:
        """Return the C files that the header does not need."""
        return [*self.history.unused_files, *(() if self.has_durations else _OF_DURATIONS)]

    def history_bytes(self) -> int:
        """Return the bytes of a greedy policy's memory, on the stack and of an episode."""
        return self.history.stack_bytes + self.history.episode_bytes

    def _inputs(self) -> list[Input]:
        """Return the agent's inputs, their bins without those of missing readings."""
        inputs = []
        for i, (kind, at) in enumerate(self.agent.inputs):
            low, high = (float(end[at[0]]) for end in self.agent.observation_range)
            n_bins = len(self.network.table(i)) - self.codes_missing
            inputs.append(Input(kind, list(at), low, high, n_bins))
        return inputs

    def _box(self) -> Array | None:
        """Return the actions of a Box as `act` gives them, shape (n_actions, n_dimensions)."""
        if not isinstance(self.agent.action_space, gym.spaces.Box):
            return None
        actions = [self.agent.actions_of(d) for d in range(self.agent.n_dimensions)]
        return np.stack(actions, axis=1).astype(self.agent.action_space.dtype)

    def _checked_fraction_bits(self, fraction_bits: int | None) -> int:
        """Return the fraction bits; by default 16, or fewer where 32 bits hold no more."""
        ranges = [source for source in self.inputs if source.kind in ("variable", "circular")]
        numbers = [abs(end) for source in ranges for end in (source.low, source.high)]
        if self.box is not None:
            numbers += np.abs(self.box.astype(np.float64)).reshape(-1).tolist()
        largest = max(numbers, default=0.0)
        most_bits = MOST_FRACTION_BITS
        while most_bits >= 0 and math.ceil(largest * 2**most_bits) >= 2**31:
            most_bits -= 1
        if most_bits < 0:
            raise ValueError(
                "observation ranges and actions must be below 2^31 in a C header,"
                f" got {largest:g}: scale them"
            )
        if fraction_bits is None:
            return min(most_bits, _DEFAULT_FRACTION_BITS)
        bits = whole("fraction_bits", fraction_bits, 0, MOST_FRACTION_BITS)
        if bits > most_bits:
            problem = f"must be at most {most_bits}, so that {largest:g} fits 32 bits, got {bits}"
            raise argument_error("fraction_bits", problem)
        return bits

    def coarse_ranges(self) -> Iterator[str]:
        """Describe ranges of observations and actions with few values in fixed point, a line each.

        Angles have none: they are directions, or turns of 64 bits.
        """
        agent = self.agent
        variables = sorted({source.at[0] for source in self.inputs if source.kind == "variable"})
        ranges = [
            ("observation", "observe", i, *(end[i] for end in agent.observation_range))
            for i in variables
        ]
        if self.box is not None:
            bounds = zip(agent._action.low, agent._action.high, strict=True)
            ranges += [("action", "give", i, low, high) for i, (low, high) in enumerate(bounds)]
        for name, verb, i, low, high in ranges:
            n_steps = float(high - low) * 2.0**self.fraction_bits
            if n_steps < _FEW_STEPS:
                yield (
                    f"{name}[{i}], from {low:g} to {high:g}, has a range of only {n_steps:.2g}"
                    f" times 2^-{self.fraction_bits}: {verb} it in another unit, or with more"
                    " fraction_bits"
                )

    def tables_of_spaces(self) -> Tables:
        """Write the constants of observations and actions."""
        tables = Tables(self.name)
        n_bins = np.array([len(self.network.table(i)) for i in range(self.n_inputs)])
        tables.add("uint32_t", "n_bins", n_bins, "Bins of each input.")
        if self.box is None:
            about = "The action that has the number 0."
            tables.add("int32_t", "first_action", np.array(self.start), about)
        else:
            fixed = np.round(self.box.astype(np.float64) * 2.0**self.fraction_bits)
            about = f"The actions, times 2^{self.fraction_bits}."
            tables.add("int32_t", "action_fixed", by_dimension(fixed.astype(np.int64)), about)
        self.history.add_tables(tables, acts_between=self.acts_between)
        return tables

    @property
    def acts_between(self) -> bool:
        """Whether greedy actions may lie between those of a Box."""
        return False

    def n_actions(self) -> list[int]:
        """Return the number of actions of each dimension."""
        return [len(self.agent.actions_of(d)) for d in range(self.n_dimensions)]

    def fingerprint(self) -> int:
        """Return a hash of the agent's settings and seed, by which images are recognized."""
        learning, approximator = self.agent.learning, self.agent.approximator
        about = [
            str(approximator),
            str(learning),
            self.agent.seed,
            self.n_actions(),
            [
                (source.kind, list(source.at), *self._fixed_range(source), source.n_bins)
                for source in self.inputs
            ],
            [zlib.crc32(self.network.permutation(*pair).tobytes()) for pair in self.network.pairs],
        ]
        if self.history.is_needed:
            about += self.history.constants()
        if self.agent.missing != "error":
            about.append(self.agent.missing)
        return zlib.crc32(json.dumps(about).encode())

    def _fixed_range(self, source: Input) -> tuple[float, float] | tuple[()]:
        """Return the range of an input, unless it follows what is observed."""
        is_running = self.history.follows_ranges and source.kind == "variable"
        return () if is_running else (source.low, source.high)

    def write(
        self,
        file: str,
        description: str,
        needs: list[str],
        defines: Data,
        tables: Tables,
        **sizes: int,
    ) -> CHeader:
        """Return the header: settings, tables, and the C code of ``file`` with the agent's prefix.

        ``needs`` are lines about memory, and ``sizes`` the other attributes of the `CHeader`.
        """
        conversion_tables, inputs = Tables(self.name), self.history.calls()
        if not self.history.has_real_inputs:
            conversion_tables, inputs = conversions(self.inputs, self.name, self.fraction_bits)
        flash_bytes = tables.n_bytes + conversion_tables.n_bytes + self.history.function_bytes
        flash_bytes += 80 * self.has_durations  # coefficients of an exponential
        macro = self.name.upper()
        spaces = {
            "N_OBSERVED": self.n_observed,
            "N_INPUTS": self.n_inputs,
            "N_DIMENSIONS": self.n_dimensions,
            "FRACTION_BITS": self.fraction_bits,
            "TIES": f"{macro}_{_TIES[self.tie_rule()]}",
        }
        spaces |= self.history.defines(acts_between=self.acts_between)
        spaces |= {"CODES": 1} if self.codes_missing else {}
        normalizations = [
            line
            for statistics in self.agent.wrappers
            if (lines := statistics.observation_lines())
            for line in normalization_comment(statistics.wrapper, lines)
        ]
        scaling = scaling_comment(self.agent.scaling.lines()) if self.agent.scaling else []
        text = header_text(
            self.name,
            title=self.title,
            made=[
                f"{type(self.agent).__name__} agent with seed {self.agent.seed}:",
                f"{description}.",
            ],
            needs=[line.format(flash=f"{flash_bytes:,}") for line in needs],
            arithmetic=["integers. Include it in one source file: its constants are static."],
            usage=self._usage(),
            constants=[
                *define_lines(macro, {**spaces, **defines}),
                *define_lines(macro, {"INPUTS": [f"{macro}_{call}" for call in inputs]}),
                "",
                *tables.lines,
                *conversion_tables.lines,
                *self._float_tables(),
            ],
            code=c_source(file, self.name, self.unused_files()),
        )
        return CHeader(
            name=self.name,
            text=joined([*normalizations, *scaling]) + text,
            fraction_bits=self.fraction_bits,
            flash_bytes=flash_bytes,
            **sizes,
        )

    def _missing_remark(self) -> list[str]:
        """Describe what happens to an observation with a missing reading."""
        name = self.name.upper()
        if self.codes_missing:
            return [f"A reading may be {name}_MISSING: each input has a pattern for that."]
        if self.history.holds:
            return [f"A reading may be {name}_MISSING: it counts as the last one of the episode."]
        return [
            f"With {name}_REFUSES defined before the include, an observation in which a reading",
            f"is {name}_MISSING gives {name}_REFUSED, the number of no action, and is not learned.",
        ]

    def _usage(self) -> list[str]:
        """Return the lines of the header that show how to call it."""
        observation = f"int32_t observation[{self.name.upper()}_N_OBSERVED];"
        return [
            f"  {observation} // in its own units, times 2^{self.fraction_bits}",
            f"  observation[0] = {self.name.upper()}_FIXED(0.5); // a constant",
            *(f"  {line}" for line in self.calls()),
            "",
            f"An action is a number; {self._action_value()} is its value.",
            *(
                line
                for i, source in enumerate(self.inputs)
                for line in source.usage(i, is_running=self.history.follows_ranges)
            ),
            *self.history.usage(),
            *self._missing_remark(),
            *self.tie_remark(),
        ]

    def needs(self, weight_bytes: int, ram_bytes: int, n_words: int) -> list[str]:
        """Return comment lines about the memory and time of a greedy policy."""
        stack = [
            f"RAM:   {ram_bytes:,} bytes of arrays on the stack, and at most 256 bytes for all",
            f"       else there; {self.name}_greedy_float takes {8 * self.n_observed:,} more.",
        ]
        return [
            f"Flash: {{flash}} bytes of constants, of which {weight_bytes:,} are weights; the code",
            f"       comes to {'2 to 5' if self.history.is_needed else '1 to 2'} kB.",
            *(self.history.memory_lines(ram_bytes) if self.history.has_episodes else stack),
            "       No heap, and nothing static that changes.",
            f"Time:  a decision reads {n_words:,} words of 32 bits of weights.",
        ]

    def calls(self) -> list[str]:
        """Return example lines of C that choose an action."""
        before, arguments = self.history.calls_of_episode(self.name), "observation"
        if before:
            arguments = f"&episode, {arguments}"
        if not self.is_vector:
            return [*before, f"uint32_t action = {self.name}_greedy({arguments});"]
        array = f"uint32_t action[{self.name.upper()}_N_DIMENSIONS];"
        return [*before, array, f"{self.name}_greedy({arguments}, action);"]

    def _action_value(self) -> str:
        """Return the C expression of an action's value, for the header's comments."""
        if self.box is None:
            d, action = ("d", "action[d]") if self.is_vector else ("0", "action")
            return f"{self.name}_first_action[{d}] + (int32_t){action}"
        index = "[d][action[d]]" if self.is_vector else "[action]"
        return f"{self.name}_action_fixed{index} / 2^{self.fraction_bits}"

    def _float_tables(self) -> list[str]:
        """Return the table of a Box's actions as floating-point numbers, or no lines."""
        if self.box is None:
            return []
        is_double = self.box.dtype == np.float64
        c_type, form = ("double", "{!r}") if is_double else ("float", "{!r}f")
        actions = by_dimension(self.box.astype(np.float64))
        lines = table_lines(f"static const {c_type} {self.name}_action_float", actions, form)
        condition = f"#ifdef {self.name.upper()}_USE_FLOAT"
        return [condition, "/* The actions. */", *lines, "#endif"]

    def tie_rule(self) -> str:
        """Return the tie rule of the header: a greedy policy has no random draws."""
        rule = self.agent.learning.tie_rule
        return "middle" if rule == "uniform" else rule

    def tie_remark(self) -> list[str]:
        """Describe how ties are broken."""
        rule, agent_rule = self.tie_rule(), self.agent.learning.tie_rule
        choice = {
            "lowest": "the lowest",
            "middle": "the middle of the widest run of neighbours",
            "uniform": "a random one",
        }[rule]
        agent = "as the agent does" if rule == agent_rule else "where the agent draws one"
        return [f"Of several best actions it takes {choice}, {agent}."]


def follows_ranges(agent: Any) -> bool:
    """Return whether ranges of an agent's inputs are adapted to each new observation."""
    if not getattr(agent, "has_running_ranges", False):
        return False
    return agent.is_warming_up or any(kind == "variable" for kind, _ in agent.inputs)


def require_few_weights(n_weights: int, settings: str) -> None:
    """Raise ValueError for more weights than a header can hold."""
    if n_weights > MOST_WEIGHTS:
        raise ValueError(
            f"a C header can hold {MOST_WEIGHTS} weights, got {n_weights}: take fewer inputs,"
            f" {settings} or n_pattern_units"
        )
