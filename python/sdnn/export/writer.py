"""What the headers of all agents share: observations, actions and the frame of the file."""

from __future__ import annotations

import json
import math
import zlib
from abc import ABC, abstractmethod
from dataclasses import dataclass
from functools import cache
from typing import Any, ClassVar

import gymnasium as gym
import numpy as np
from jinja2 import Environment, PackageLoader, StrictUndefined
from numpy.typing import NDArray

from sdnn._core import __version__
from sdnn.agents.q_learning import ValueAgent
from sdnn.export.tables import Input, Tables, by_dimension, conversions, joined, table_lines
from sdnn.support.arguments import argument_error, whole

_DEFAULT_FRACTION_BITS = 16
MOST_FRACTION_BITS = 30
NONE = -(2**31)
"""A number in an image that stands for none."""
SCALE = "reward_scale"
SCALE_FIELDS = [
    (f"{SCALE}.n_rewards", "<u8"),
    (f"{SCALE}.size", "<i4"),
    (f"{SCALE}.size_in_window", "<i4"),
    (f"{SCALE}.headroom", "<i4"),
]
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


class Writer(ABC):
    """Makes the header of one agent; subclasses have its kind of network."""

    def __init__(self, agent: ValueAgent[Any, Any], name: str, fraction_bits: int | None) -> None:
        self.agent, self.name = agent, name
        self.networks = agent.networks  # RuntimeError while warming up
        self.n_dimensions = agent.n_dimensions
        self.is_vector = self.n_dimensions > 1
        self.box = self._box()
        first = [agent.actions_of(d)[0] for d in range(agent.n_dimensions)]
        self.start: list[int] = [] if self.box is not None else [int(one) for one in first]
        if any(not -(2**31) <= start < 2**31 for start in self.start):
            raise ValueError(f"actions must begin within 32 bits, got {self.start}")
        self.inputs = self._inputs()
        self.n_inputs = len(self.inputs)
        self.n_observed = len(agent.observation_range[0])
        self.fraction_bits = self._checked_fraction_bits(fraction_bits)

    @abstractmethod
    def network(self) -> Any:
        """Return a network of the agent, which has the patterns of its inputs."""

    @abstractmethod
    def header(self) -> CHeader:
        """Make the header."""

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
            (b for b in range(MOST_FRACTION_BITS, -1, -1) if math.ceil(largest * 2**b) < 2**31), -1
        )
        if most < 0:
            raise ValueError(
                "observation ranges and actions must be below 2^31 in a C header,"
                f" got {largest:g}: scale them"
            )
        if given is None:
            return min(most, _DEFAULT_FRACTION_BITS)
        bits = whole("fraction_bits", given, 0, MOST_FRACTION_BITS)
        if bits > most:
            problem = f"must be at most {most}, so that {largest:g} fits 32 bits, got {bits}"
            raise argument_error("fraction_bits", problem)
        return bits

    def tables_of_spaces(self) -> Tables:
        """Write the constants of observations and actions."""
        tables = Tables(self.name)
        n_bins = np.array([one.n_bins for one in self.inputs])
        tables.add("uint32_t", "n_bins", n_bins, "Bins of each input.")
        if self.box is None:
            about = "The action that has the number 0."
            tables.add("int32_t", "first_action", np.array(self.start), about)
        else:
            fixed = np.round(self.box.astype(np.float64) * 2.0**self.fraction_bits)
            about = f"The actions, times 2^{self.fraction_bits}."
            tables.add("int32_t", "action_fixed", by_dimension(fixed.astype(np.int64)), about)
        return tables

    def n_actions(self) -> list[int]:
        """Return the number of actions of each dimension."""
        return [len(self.agent.actions_of(d)) for d in range(self.n_dimensions)]

    def fingerprint(self) -> int:
        """Return a number that agents of other settings or another seed do not have."""
        learning, approximator = self.agent.learning, self.agent.approximator
        network = self.network()
        about = [
            str(approximator),
            str(learning),
            self.agent.seed,
            self.n_actions(),
            [(one.kind, list(one.at), one.low, one.high, one.n_bins) for one in self.inputs],
            [zlib.crc32(network.permutation(*pair).tobytes()) for pair in network.pairs],
        ]
        return zlib.crc32(json.dumps(about).encode())

    def write(self, name: str, values: dict[str, Any], tables: Tables) -> CHeader:
        """Fill a template in; it also receives this writer's attributes and the agent's settings.

        Values have the description, bytes of RAM and of weights, and words read beside what the
        template names.
        """
        fixed_tables, bins_of_fixed, bins_of_double = conversions(
            self.inputs, self.name, self.fraction_bits
        )
        flash_bytes, scaling = tables.n_bytes + fixed_tables.n_bytes, self.agent.scaling
        common = {
            **vars(self),
            "NAME": self.name.upper(),
            "version": __version__,
            "kind": type(self.agent).__name__,
            "learning": self.agent.learning,
            "sizes": self.agent.approximator,
            "flash": f"{flash_bytes:,}",
            "scaling": None if scaling is None else list(scaling.lines()),
            "is_box": self.box is not None,
            "tables": tables.text(),
            "fixed_tables": fixed_tables.text(),
            "bins_of_fixed": bins_of_fixed,
            "float_tables": self._float_tables(),
            "bins_of_double": bins_of_double,
        }
        return CHeader(
            name=self.name,
            text=_templates().get_template(f"{name}.h.jinja").render({**common, **values}),
            fraction_bits=self.fraction_bits,
            flash_bytes=flash_bytes,
            **{about: values[about] for about in ("weight_bytes", "ram_bytes", "n_words")},
        )

    def _float_tables(self) -> str:
        if self.box is None:
            return ""
        is_double = self.box.dtype == np.float64
        kind, form = ("double", "{!r}") if is_double else ("float", "{!r}f")
        actions = by_dimension(self.box.astype(np.float64))
        lines = table_lines(f"static const {kind} {self.name}_action_float", actions, form)
        return joined(["/* The actions. */", *lines, ""])

    def ties(self) -> str:
        """Return how ties are broken where nothing is drawn."""
        return "lowest" if self.agent.learning.tie_rule == "lowest" else "middle"


class Learner(Writer):
    """Makes the header of an agent that learns, and keeps what it has learned in an image.

    An image has fields of fixed sizes, one after the other, and a checksum. The core's state has
    most of them by the same names.
    """

    magic: ClassVar[int]
    streams: ClassVar[tuple[str, ...]]
    """Random generators, in the order of the image."""

    @abstractmethod
    def fields(self) -> list[tuple[Any, ...]]:
        """Return names, types and shapes of an image, as `numpy.dtype` takes them."""

    @abstractmethod
    def remembered(self, state: dict[str, Any]) -> dict[str, Any]:
        """Return the fields that are not the same in the core's state."""

    @abstractmethod
    def recall(self, image: Any, state: dict[str, Any]) -> None:
        """Put the fields of an image into the core's state; ValueError for impossible ones."""

    def layout(self) -> np.dtype[Any]:
        """Return the type of an image without its checksum."""
        head = [("magic", "<u4"), ("fingerprint", "<u4")]
        return np.dtype([*head, *self.fields()])

    def state(self) -> dict[str, Any]:
        """Return the core's state, and the scale of rewards, with all of its numbers."""
        scale = {"size": NONE, "size_in_window": NONE, **self.agent.state("reward_scale")}
        return {**self.agent.state("agent"), **{f"{SCALE}.{name}": n for name, n in scale.items()}}

    def image(self) -> bytes:
        """Return the state as the header's bytes."""
        state, image = self.state(), np.zeros((), self.layout())
        known = {"magic": self.magic, "fingerprint": self.fingerprint(), **state}
        known |= {"words": self.seeds(state), **self.remembered(state)}
        for name in image.dtype.names or ():
            image[name] = known.get(name, 0)
        content = image.tobytes()
        return content + zlib.crc32(content).to_bytes(4, "little")

    def restore(self, whole: bytes) -> None:
        """Give the agent the state of an image, whole and of this agent."""
        (image,), state = np.frombuffer(whole, self.layout(), 1), self.agent.state("agent")
        for stream, words in zip(self.streams, image["words"], strict=True):
            state[f"{stream}.words"] = words.copy()
        state.pop("n_random_left", None)
        if n_left := image["n_random_left"]:
            state["n_random_left"] = np.array(n_left, np.int32)
        self.recall(image, state)
        names = [name for name in image.dtype.names or () if name.startswith(SCALE)]
        kept = {name: np.array(image[name]) for name in names if image[name] != NONE}
        scale = {name.removeprefix(f"{SCALE}."): number for name, number in kept.items()}
        self.agent._restore(agent=state, reward_scale=scale)

    def seeds(self, state: dict[str, Any]) -> NDArray[np.uint64]:
        """Return the states of the random generators, shape (n_streams, 4)."""
        return np.array([state[f"{stream}.words"] for stream in self.streams], np.uint64)

    def values_of_learning(self, state: dict[str, Any]) -> dict[str, Any]:
        """Return what the templates of all agents that learn need."""
        return {
            "state": state,
            "size": c_number(state[f"{SCALE}.size"]),
            "size_in_window": c_number(state[f"{SCALE}.size_in_window"]),
            "headroom": state[f"{SCALE}.headroom"],
            "ties": "draw" if self.agent.learning.tie_rule == "uniform" else self.ties(),
            "image_bytes": self.layout().itemsize + 4,
            "image_magic": f"0x{self.magic:08x}",
            "fingerprint": f"0x{self.fingerprint():08x}",
        }


def c_number(number: Any) -> str:
    """Write a number of 32 bits in C."""
    return "INT32_MIN" if number == NONE else str(int(number))


def require_few_weights(n_weights: int, settings: str) -> None:
    """Raise ValueError for more weights than a header can hold."""
    if n_weights > MOST_WEIGHTS:
        raise ValueError(
            f"a C header can hold {MOST_WEIGHTS} weights, got {n_weights}: take fewer inputs,"
            f" {settings} or n_pattern_units"
        )


@cache
def _templates() -> Environment:
    return Environment(
        loader=PackageLoader("sdnn.export", "."), undefined=StrictUndefined, autoescape=False,
        variable_start_string="${", variable_end_string="}", line_statement_prefix="@",
        comment_start_string="@{", keep_trailing_newline=True,
    )  # fmt: skip
