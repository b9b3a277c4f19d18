"""What the headers of all agents share: observations, actions and the frame of the file."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.resources import files
from string import Template
from textwrap import wrap
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from sdnn._core import __version__
from sdnn.agents import Scaling
from sdnn.agents.q_learning import CodedAgent
from sdnn.arguments import argument_error, whole
from sdnn.export.tables import (
    Input,
    Tables,
    by_dimension,
    conversions,
    joined,
    table_lines,
)

_DEFAULT_FRACTION_BITS = 16
_MOST_FRACTION_BITS = 30
MOST_WEIGHTS = 2**26  # some hundred megabytes of text


@dataclass(frozen=True, kw_only=True)
class CHeader:
    """A C header that holds an agent's greedy policy, or an agent that learns.

    ``text`` is the file and ``name`` the prefix of its names. Fixed-point observations and actions
    are multiples of ``2**-fraction_bits``. ``flash_bytes`` of constants include ``weight_bytes``.
    ``ram_bytes`` are the arrays that a decision has on the stack or, if the agent learns, all that
    it remembers. A decision reads ``n_words`` 32-bit words of weights.
    """

    name: str
    text: str
    fraction_bits: int
    flash_bytes: int
    weight_bytes: int
    ram_bytes: int
    n_words: int


class Writer:
    """Makes the header of one agent; subclasses have its kind of network."""

    def __init__(self, agent: CodedAgent[Any, Any], name: str, fraction_bits: int | None) -> None:
        self.agent, self.name = agent, name
        self.core = agent.core  # RuntimeError while warming up
        self.n_dimensions = agent.n_dimensions
        self.is_vector = self.n_dimensions > 1
        self.box = self._box()
        first = [agent.actions_of(d)[0] for d in range(agent.n_dimensions)]
        self.start: list[int] = [] if self.box is not None else [int(one) for one in first]
        if any(not -(2**31) <= start < 2**31 for start in self.start):
            raise ValueError(f"actions must begin within 32 bits, got {self.start}")
        self.inputs = self._inputs()
        self.n_observed = len(agent.observation_range[0])
        self.fraction_bits = self._checked_fraction_bits(fraction_bits)

    def network(self) -> Any:
        """Return a network of the agent, which has the patterns of its inputs."""
        raise NotImplementedError

    def header(self) -> CHeader:
        """Make the header."""
        raise NotImplementedError

    def _inputs(self) -> list[Input]:
        inputs = []
        for i, (kind, at) in enumerate(self.agent.inputs):
            low, high = (float(end[at[0]]) for end in self.agent.observation_range)
            inputs.append(Input(kind, list(at), low, high, len(self.network().table(i))))
        return inputs

    def _box(self) -> NDArray[Any] | None:
        """Return the actions of a Box as `act` gives them, shape (n_actions, n_dimensions)."""
        if not isinstance(self.agent.action_space, gym.spaces.Box):
            return None
        actions = [self.agent.actions_of(d) for d in range(self.agent.n_dimensions)]
        return np.stack(actions, axis=1).astype(self.agent.action_space.dtype)

    def _checked_fraction_bits(self, given: int | None) -> int:
        ranges = [one for one in self.inputs if one.kind in ("variable", "circular")]
        numbers = [abs(end) for one in ranges for end in (one.low, one.high)]
        if self.box is not None:
            numbers += np.abs(self.box.astype(np.float64)).reshape(-1).tolist()
        largest = max(numbers, default=0.0)
        most = next(
            (b for b in range(_MOST_FRACTION_BITS, -1, -1) if math.ceil(largest * 2**b) < 2**31), -1
        )
        if most < 0:
            raise ValueError(
                "observation ranges and actions must be below 2^31 in a C header,"
                f" got {largest:g}: scale them"
            )
        if given is None:
            return min(most, _DEFAULT_FRACTION_BITS)
        bits = whole("fraction_bits", given, 0, _MOST_FRACTION_BITS)
        if bits > most:
            problem = f"must be at most {most}, so that {largest:g} fits 32 bits, got {bits}"
            raise argument_error("fraction_bits", problem)
        return bits

    def tables_of_spaces(self) -> Tables:
        """Write the constants of observations and actions."""
        tables, name = Tables(), self.name
        n_bins = np.array([one.n_bins for one in self.inputs])
        tables.add("uint32_t", f"{name}_n_bins", n_bins, "Bins of each input.")
        if self.box is None:
            about = "The action that has the number 0."
            tables.add("int32_t", f"{name}_first_action", np.array(self.start), about)
        else:
            fixed = np.round(self.box.astype(np.float64) * 2.0**self.fraction_bits)
            about = f"The actions, times 2^{self.fraction_bits}."
            fixed_actions = by_dimension(fixed.astype(np.int64))
            tables.add("int32_t", f"{name}_action_fixed", fixed_actions, about)
        return tables

    def patterns(self, network: Any) -> NDArray[np.uint8]:
        """Pack the patterns of every bin of every input, from the lowest bit on."""
        inputs = range(len(self.inputs))
        rows = [np.packbits(network.table(i) > 0, axis=1, bitorder="little") for i in inputs]
        return np.concatenate(rows).reshape(-1)

    def write(self, policy: str, end: str, values: dict[str, Any], tables: Tables) -> CHeader:
        """Fill the frame in: templates of the policy and of what follows the observations.

        Values have the description, bytes of RAM and of weights, and words read beside what the
        templates name.
        """
        fixed_tables, bins_of_fixed, bins_of_double = conversions(
            self.inputs, self.name, self.fraction_bits
        )
        flash_bytes = tables.n_bytes + fixed_tables.n_bytes
        values = {
            "version": __version__,
            "kind": type(self.agent).__name__,
            "seed": self.agent.seed,
            "flash": f"{flash_bytes:,}",
            "float_ram": f"{8 * self.n_observed:,}",
            "usage": joined(f" * {line}".rstrip() for line in self._usage()),
            "n_observed": self.n_observed,
            "n_inputs": len(self.inputs),
            "n_dimensions": self.n_dimensions,
            "fraction_bits": self.fraction_bits,
            "tables": tables.text(),
            "fixed_tables": fixed_tables.text(),
            "bins_of_fixed": joined(bins_of_fixed),
            "float_tables": self._float_tables(),
            "bins_of_double": joined(bins_of_double),
            **(_OF_VECTORS if self.is_vector else _OF_NUMBERS),
            **values,
        }
        text = template("c_header").replace("${policy}", policy).replace("${end}", end)
        # What is filled in has names in it too.
        for _ in range(2):
            text = Template(text).safe_substitute(values)
        text = Template(text).substitute(name=self.name, NAME=self.name.upper())
        return CHeader(
            name=self.name,
            text=_comment_on(self.agent.scaling) + text,
            fraction_bits=self.fraction_bits,
            flash_bytes=flash_bytes,
            weight_bytes=values["weight_bytes"],
            ram_bytes=values["ram_bytes"],
            n_words=values["n_words"],
        )

    def _float_tables(self) -> str:
        if self.box is None:
            return ""
        is_double = self.box.dtype == np.float64
        kind, form = ("double", "{!r}") if is_double else ("float", "{!r}f")
        actions = by_dimension(self.box.astype(np.float64))
        lines = table_lines(f"static const {kind} {self.name}_action_float", actions, form)
        return joined(["/* The actions. */", *lines, ""])

    def calls(self) -> Iterator[str]:
        """Describe how to use the header: declarations and calls."""
        name, macro = self.name, self.name.upper()
        if self.is_vector:
            yield f"  uint32_t action[{macro}_N_DIMENSIONS];"
            yield f"  {name}_act_fixed(observation, action);"
        else:
            yield f"  uint32_t action = {name}_act_fixed(observation);"

    def remarks(self) -> Iterator[str]:
        """Describe what else there is."""
        name = self.name
        floats = f"{name}_act_float and {name}_act_double take observations in floating point"
        actions = "" if self.box is None else f", and {name}_action_float has the actions"
        yield from wrap(
            f"With {name.upper()}_USE_FLOAT defined before the include, {floats}{actions}.", 96
        )
        yield f"{name}_act_bins takes the bins of all inputs:"

    def _usage(self) -> Iterator[str]:
        """Describe how to use the header."""
        name, macro = self.name, self.name.upper()
        dimension, number = ("[d]", "action[d]") if self.is_vector else ("", "action")
        scale = f"2^{self.fraction_bits}"
        yield f'  #include "{name}.h"'
        yield f"  int32_t observation[{macro}_N_OBSERVED]; // in its own units, times {scale}"
        yield from self.calls()
        if self.box is None:
            first = f"{name}_first_action[{'d' if self.is_vector else '0'}]"
            yield f"  int32_t value = {first} + (int32_t){number}; // as the task has it"
        else:
            value = f"{name}_action_fixed{dimension}[{number}]"
            yield f"  int32_t value = {value}; // times {scale}"
        yield ""
        yield from self.remarks()
        for i, one in enumerate(self.inputs):
            start, *rest = one.usage()
            yield f"  input {i}: {start}"
            yield from (f"  {line}" for line in rest)
        yield from wrap(self.tie_rule(), 96)

    def tie_rule(self) -> str:
        """Describe which of several best actions is taken."""
        return _TIE_RULES[str(self.agent.learning.tie_rule)]

    def choice(self, is_best: str, n_actions: str) -> dict[str, str]:
        """Write how ties are broken, between actions for which an expression holds."""
        chosen = _LOWEST if self.agent.learning.tie_rule == "lowest" else _MIDDLE
        return {
            key: text.replace("@is_best", is_best).replace("@n_actions", n_actions)
            for key, text in chosen.items()
        }


def template(name: str) -> str:
    """Return a template of the package."""
    return files("sdnn.export").joinpath(f"{name}.template").read_text("utf-8")


def _comment_on(scaling: Scaling | None) -> str:
    """Describe at the top of the header how its observations are scaled."""
    if scaling is None:
        return ""
    lines = (
        "What this policy observes is scaled, since its run had noise or redundant variables:",
        "each variable from its range to [0, 1], (value - low) / (high - low), and what lies",
        "beyond the range to 0 or 1. Wherever an observation has units below, it is these.",
        "",
        *(f"  {line}" for line in scaling.lines()),
    )
    return "\n".join(["/* " + lines[0], *(f" * {one}".rstrip() for one in lines[1:]), " */\n"])


_TIE_RULES = {
    "uniform": "Of several best actions, of which the agent draws one, the header takes the middle"
    " of the widest run of neighbours.",
    "middle": "Of several best actions it takes the middle of the widest run of neighbours, as the"
    " agent does.",
    "lowest": "Of several best actions it takes the lowest, as the agent does.",
}

# How ties are broken.
_LOWEST = {
    "counters": "",
    "choose": """\
  for (action = 0; !(@is_best); ++action) {
  }
  return action;
""",
}

_MIDDLE = {
    "counters": ", run = 0, widest = 0, middle = 0",
    "choose": """\
  for (action = 0; action < @n_actions; ++action) {
    run = @is_best ? run + 1 : 0;
    if (run > widest) {
      widest = run;
      middle = action - run / 2;
    }
  }
  return middle;
""",
}

# Functions that return one number of an action, or fill in several.
_OF_NUMBERS = {
    "in_each": "",
    "result": "uint32_t",
    "parameter": "",
    "argument": "",
    "call": "return ",
}

_OF_VECTORS = {
    "in_each": " in each dimension",
    "result": "void",
    "parameter": ", uint32_t *action",
    "argument": ", action",
    "call": "",
}
