"""A trained agent's greedy policy as a C header, for small processors."""

from __future__ import annotations

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.resources import files
from pathlib import Path
from string import Template
from textwrap import wrap
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from sdnn._core import __version__
from sdnn.agents import Agent, Scaling, SDNNQLearning
from sdnn.arguments import argument_error, path_of, shown, whole
from sdnn.export.tables import (
    Input,
    Tables,
    bit_planes,
    by_dimension,
    conversions,
    joined,
    table_lines,
    wrapped,
)
from sdnn.files import write_whole

_LARGEST_NAME = 40
_DEFAULT_FRACTION_BITS = 16
_MOST_FRACTION_BITS = 30
_MOST_UNITS = 65535  # whose numbers fit 16 bits
_MOST_WEIGHTS = 2**26  # some hundred megabytes of text
_BYTES_OF_UNIT = 8
_BYTES_OF_NETWORK = 28  # a struct of five pointers and two sizes, where pointers have 32 bits


@dataclass(frozen=True, kw_only=True)
class CHeader:
    """A C header that holds an agent's greedy policy.

    ``text`` is the file and ``name`` the prefix of its names. Fixed-point observations and actions
    are multiples of ``2**-fraction_bits``. ``flash_bytes`` of constants include ``weight_bytes``;
    a decision takes ``ram_bytes`` of stack and reads ``n_words`` 32-bit words of weights.
    """

    name: str
    text: str
    fraction_bits: int
    flash_bytes: int
    weight_bytes: int
    ram_bytes: int
    n_words: int


def export_c_header(
    agent: Agent[Any, Any],
    path: str | Path,
    *,
    name: str | None = None,
    fraction_bits: int | None = None,
) -> CHeader:
    """Write an agent's greedy policy as a C header and return it.

    The file is written as a whole or not at all. The name is by default the file's, without its
    ending; everything else is as for `c_header`.
    """
    place = path_of("path", path)
    header = c_header(agent, place.stem if name is None else name, fraction_bits=fraction_bits)
    write_whole(place, header.text.encode())
    return header


def c_header(agent: Agent[Any, Any], name: str, *, fraction_bits: int | None = None) -> CHeader:
    """Return an agent's greedy policy as a C header.

    The header is C99 and C++, needs ``<stdint.h>`` only, no heap and no floating point. Its action
    is that of ``agent.act(observation, explore=False)``; where the agent would draw one of several
    best actions, it takes the middle of their widest run. See docs/how-to/small-processors.md.

    Parameters
    ----------
    agent : SDNNQLearning
        With known ranges of its observations.
    name : str
        Prefix of all names in the header.
    fraction_bits : int, optional
        Of observations and actions in fixed point, 0 to 30; by default 16, or fewer if the
        observed ranges or the actions need it.

    Raises
    ------
    TypeError
        For other agents, which calculate in floating point.
    ValueError
        If ``name`` is not a C identifier, ``fraction_bits`` is too large, or the network has more
        than 65,535 hidden units or 2^26 weights.
    RuntimeError
        If the agent is still warming up.

    Examples
    --------
    >>> import gymnasium as gym
    >>> from sdnn.agents import SDNNQLearning
    >>> from sdnn.export import c_header
    >>> env = gym.make("MountainCar-v0")
    >>> agent = SDNNQLearning(env.observation_space, env.action_space, preset="small")
    >>> header = c_header(agent, "car")
    >>> header.flash_bytes < 2**16
    True
    >>> "static inline uint32_t car_act_fixed(const int32_t *observation)" in header.text
    True
    """
    if not isinstance(agent, SDNNQLearning):
        raise TypeError(
            "agent must be an SDNNQLearning, whose network is integers only,"
            f" got {type(agent).__name__}"
        )
    fits = isinstance(name, str) and re.fullmatch(r"[A-Za-z](_?[A-Za-z0-9])*", name)
    if not fits or len(name) > _LARGEST_NAME:
        raise argument_error(
            "name",
            "must be a C identifier of letters, digits and single underscores between them,"
            f" at most {_LARGEST_NAME} long, got {shown(name)}",
        )
    return _Writer(agent, name, fraction_bits).header()


class _Writer:
    """Makes the header of one agent."""

    def __init__(self, agent: SDNNQLearning, name: str, fraction_bits: int | None) -> None:
        self.agent, self.name = agent, name
        core = agent.core  # RuntimeError while warming up
        self.networks = (
            [core.action_value]
            if agent.n_dimensions == 1
            else [core.action_value(dimension) for dimension in range(agent.n_dimensions)]
        )
        self.is_vector = len(self.networks) > 1
        self.sizes, self.learning = agent.approximator, agent.learning
        self.box = self._box()
        first = [agent.actions_of(d)[0] for d in range(agent.n_dimensions)]
        self.start: list[int] = [] if self.box is not None else [int(one) for one in first]
        self.inputs = self._inputs()
        self.n_observed = len(agent.observation_range[0])
        self.n_columns = self.sizes.n_pairs * self.sizes.n_pattern_units
        self.index_type = "uint8_t" if self.sizes.n_pattern_units <= 256 else "uint16_t"
        self._check_sizes()
        self.fraction_bits = self._checked_fraction_bits(fraction_bits)

    def _inputs(self) -> list[Input]:
        inputs = []
        for i, (kind, at) in enumerate(self.agent.inputs):
            low, high = (float(end[at[0]]) for end in self.agent.observation_range)
            inputs.append(Input(kind, list(at), low, high, len(self.networks[0].table(i))))
        return inputs

    def _check_sizes(self) -> None:
        n_units = self.sizes.n_hidden_units
        if n_units > _MOST_UNITS:
            raise ValueError(
                f"n_hidden_units must be at most {_MOST_UNITS} in a C header, got {n_units}"
            )
        n_weights = len(self.networks) * n_units * self.n_columns
        if n_weights > _MOST_WEIGHTS:
            raise ValueError(
                f"a C header can hold {_MOST_WEIGHTS} weights, got {n_weights}: take fewer inputs,"
                " n_hidden_units or n_pattern_units"
            )
        if any(not -(2**31) <= start < 2**31 for start in self.start):
            raise ValueError(f"actions must begin within 32 bits, got {self.start}")

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

    def header(self) -> CHeader:
        """Make the header."""
        name, sizes = self.name, self.sizes
        tables = self._common_tables()
        units_of, rows, n_units, n_words = list[str](), list[str](), list[int](), 0
        for d, network in enumerate(self.networks):
            # Only the units that are in a window, and where among them the windows begin.
            first = network.first_units().astype(np.intp)
            used = np.unique(first[:, None] + np.arange(sizes.n_active_units))
            weights, n_bits, lowest = bit_planes(network.averaged_weights()[used])
            thresholds = network.averaged_thresholds()[used]
            units = np.stack([thresholds, lowest, n_bits], axis=1).tolist()
            self._add_wiring(tables, d, network)
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
        fixed_tables, bins_of_fixed, bins_of_double = conversions(
            self.inputs, name, self.fraction_bits
        )
        n_code_words, n_fire_words = -(-self.n_columns // 32), -(-max(n_units) // 32)
        most_actions = max(network.n_actions for network in self.networks)
        ram_bytes = 8 * n_code_words + 4 * n_fire_words + 2 * most_actions + 8 * len(self.inputs)
        flash_bytes = tables.n_bytes + fixed_tables.n_bytes
        values = {
            "version": __version__,
            "seed": self.agent.seed,
            "description": (
                f"{len(self.inputs)} inputs, {sizes.n_pattern_units} units per pattern,"
                f" {' + '.join(map(str, n_units))} hidden units in use,"
                f" {' x '.join(str(network.n_actions) for network in self.networks)} actions"
            ),
            "flash_bytes": f"{flash_bytes:,}",
            "weight_bytes": f"{4 * n_words:,}",
            "weight_bits": f"{32 * n_words / (sum(n_units) * self.n_columns):.2f}",
            "ram_bytes": f"{ram_bytes:,}",
            "float_ram_bytes": f"{8 * self.n_observed:,}",
            "n_words": f"{n_words:,}",
            "usage": joined(f" * {line}".rstrip() for line in self._usage()),
            "n_observed": self.n_observed,
            "n_inputs": len(self.inputs),
            "n_dimensions": len(self.networks),
            "fraction_bits": self.fraction_bits,
            "tables": tables.text(),
            "permutation_type": self.index_type,
            "networks": joined([*units_of, declaration, *rows, "};"]),
            "n_code_words": n_code_words,
            "n_fire_words": n_fire_words,
            "most_actions": most_actions,
            "n_pattern_units": sizes.n_pattern_units,
            "n_partners": sizes.n_pairs // len(self.inputs),
            "pattern_bytes": -(-sizes.n_pattern_units // 8),
            "n_active_units": sizes.n_active_units,
            "widen": "  best = ${name}_ties[best];\n" if self.learning.tie_tolerance > 0.0 else "",
            **(_LOWEST if self.learning.tie_rule == "lowest" else _MIDDLE),
            **(_OF_VECTORS if self.is_vector else _OF_NUMBERS),
            "fixed_tables": fixed_tables.text(),
            "bins_of_fixed": joined(bins_of_fixed),
            "float_tables": self._float_tables(),
            "bins_of_double": joined(bins_of_double),
        }
        text = files("sdnn.export").joinpath("c_header.template").read_text("utf-8")
        # What is filled in has names in it too.
        text = Template(text).safe_substitute(values)
        text = Template(text).substitute(name=name, NAME=name.upper())
        return CHeader(
            name=name,
            text=_comment_on(self.agent.scaling) + text,
            fraction_bits=self.fraction_bits,
            flash_bytes=flash_bytes,
            weight_bytes=4 * n_words,
            ram_bytes=ram_bytes,
            n_words=n_words,
        )

    def _common_tables(self) -> Tables:
        tables, name = Tables(), self.name
        n_bins = np.array([one.n_bins for one in self.inputs])
        tables.add("uint32_t", f"{name}_n_bins", n_bins, "Bins of each input.")
        values = self.networks[0].output_values()
        if any((network.output_values() != values).any() for network in self.networks):
            raise ValueError("networks of one agent must have one range of values")
        distinct = np.unique(values)
        about = "Ranks of the values that counts of active units stand for."
        tables.add("uint16_t", f"{name}_ranks", np.searchsorted(distinct, values), about)
        if self.learning.tie_tolerance > 0.0:
            ties = np.searchsorted(distinct, distinct - self.learning.tie_tolerance)
            about = "Of each rank, the lowest that ties with it."
            tables.add("uint16_t", f"{name}_ties", ties, about)
        if self.box is None:
            about = "The action that has the number 0."
            tables.add("int32_t", f"{name}_first_action", np.array(self.start), about)
        else:
            fixed = np.round(self.box.astype(np.float64) * 2.0**self.fraction_bits)
            about = f"The actions, times 2^{self.fraction_bits}."
            fixed_actions = by_dimension(fixed.astype(np.int64))
            tables.add("int32_t", f"{name}_action_fixed", fixed_actions, about)
        return tables

    def _add_wiring(self, tables: Tables, d: int, network: Any) -> None:
        inputs = range(len(self.inputs))
        rows = [np.packbits(network.table(i) > 0, axis=1, bitorder="little") for i in inputs]
        sigma = [network.permutation(*pair) for pair in network.pairs]
        modifiers = np.array([nu for _, nu in network.pairs])
        tables.add("uint8_t", f"{self.name}_patterns_{d}", np.concatenate(rows).reshape(-1))
        tables.add("uint16_t", f"{self.name}_modifiers_{d}", modifiers)
        tables.add(self.index_type, f"{self.name}_permutations_{d}", np.concatenate(sigma))

    def _float_tables(self) -> str:
        if self.box is None:
            return ""
        is_double = self.box.dtype == np.float64
        kind, form = ("double", "{!r}") if is_double else ("float", "{!r}f")
        actions = by_dimension(self.box.astype(np.float64))
        lines = table_lines(f"static const {kind} {self.name}_action_float", actions, form)
        return joined(["/* The actions. */", *lines, ""])

    def _usage(self) -> Iterator[str]:
        """Describe how to use the header."""
        name, macro = self.name, self.name.upper()
        dimension, number = ("[d]", "action[d]") if self.is_vector else ("", "action")
        scale = f"2^{self.fraction_bits}"
        yield f'  #include "{name}.h"'
        yield f"  int32_t observation[{macro}_N_OBSERVED]; // in its own units, times {scale}"
        if self.is_vector:
            yield f"  uint32_t action[{macro}_N_DIMENSIONS];"
            yield f"  {name}_act_fixed(observation, action);"
        else:
            yield f"  uint32_t action = {name}_act_fixed(observation);"
        if self.box is None:
            first = f"{name}_first_action[{'d' if self.is_vector else '0'}]"
            yield f"  int32_t value = {first} + (int32_t){number}; // as the task has it"
        else:
            value = f"{name}_action_fixed{dimension}[{number}]"
            yield f"  int32_t value = {value}; // times {scale}"
        yield ""
        floats = f"{name}_act_float and {name}_act_double take observations in floating point"
        actions = "" if self.box is None else f", and {name}_action_float has the actions"
        yield from wrap(
            f"With {macro}_USE_FLOAT defined before the include, {floats}{actions}.", 96
        )
        yield f"{name}_act_bins takes the bins of all inputs:"
        for i, one in enumerate(self.inputs):
            start, *rest = one.usage()
            yield f"  input {i}: {start}"
            yield from (f"  {line}" for line in rest)
        yield from wrap(_TIE_RULES[self.learning.tie_rule], 96)


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
  for (action = 0; ranks[action] < best; ++action) {
  }
  return action;
""",
}

_MIDDLE = {
    "counters": ", run = 0, widest = 0, middle = 0",
    "choose": """\
  for (action = 0; action < network->n_actions; ++action) {
    run = ranks[action] >= best ? run + 1 : 0;
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
    "act_bins": "  return ${name}_best(&${name}_networks[0], bins);\n",
}

_OF_VECTORS = {
    "in_each": " in each dimension",
    "result": "void",
    "parameter": ", uint32_t *action",
    "argument": ", action",
    "call": "",
    "act_bins": """\
  uint32_t d;
  for (d = 0; d < ${NAME}_N_DIMENSIONS; ++d) action[d] = ${name}_best(&${name}_networks[d], bins);
""",
}
