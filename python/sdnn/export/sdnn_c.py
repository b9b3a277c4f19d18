"""SDNNQLearning as a C header: its greedy policy, or the agent that learns."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.agents import SDNNQLearning
from sdnn.environments.types import Array, Data
from sdnn.export.code import Code
from sdnn.export.learner import SCALE_FIELDS, Field, Learner
from sdnn.export.text import Tables, bits_of, real_number, rounded_up, weight_words
from sdnn.export.writer import (
    MOST_FRACTION_BITS,
    CHeader,
    Writer,
    require_few_weights,
)
from sdnn.support.arguments import argument_error, whole

MOST_UNITS = 65535  # largest number of units: their indices have 16 bits
_BYTES_OF_NETWORK = 40  # a struct of eight pointers and two sizes, 32 bits each


class SDNNCWriter(Writer[_core.SDNNC]):
    """Makes the header of an `SDNNQLearning` agent."""

    agent: SDNNQLearning

    def require_small(self, n_units: int, n_columns: int) -> None:
        """Raise ValueError for more units or weights than a header can hold."""
        n_hidden_units = self.agent.approximator.n_hidden_units
        if n_hidden_units > MOST_UNITS:
            problem = f"must be at most {MOST_UNITS} in a C header, got {n_hidden_units}"
            raise argument_error("n_hidden_units", problem)
        require_few_weights(self.n_dimensions * n_units * n_columns, "n_hidden_units")

    def units(self, network: _core.SDNNC) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Return the hidden units that some action's window has, and where each window begins."""
        first = network.first_units().astype(np.intp)
        used = np.unique(first[:, None] + np.arange(self.agent.approximator.n_active_units))
        return used, np.searchsorted(used, first)

    def describe(self, n_units: str) -> str:
        """Describe the network in the header; ``n_units`` is the text of its hidden units."""
        return (
            f"{self.n_inputs} inputs, {self.agent.approximator.n_pattern_units} units per"
            f" pattern, {n_units} hidden units in use, {' x '.join(map(str, self.n_actions()))}"
            " actions"
        )

    def header(self) -> CHeader:
        """Make the header."""
        networks, tables = self.networks, self.tables_of_spaces()
        codes = [Code(network, self.n_inputs) for network in networks]
        self.require_small(self.agent.approximator.n_hidden_units, codes[0].n_columns)
        self._add_ranks(tables)
        rows, n_units, n_rows = list[str](), list[int](), 0
        for d, (network, code) in enumerate(zip(networks, codes, strict=True)):
            used, first_units = self.units(network)
            weights, n_bytes = weight_words(code.paired(network.averaged_weights()[used]))
            thresholds = np.pad(network.averaged_thresholds()[used], (0, -used.size % 4))
            coding = ", ".join(f"{self.name}_{part}" for part in code.add_tables(tables, f"_{d}"))
            for c_type, part, constants in (
                ("uint32_t", "weights", weights),
                ("int32_t", "thresholds", thresholds),
                ("uint8_t", "n_bytes", n_bytes),
                ("uint16_t", "first_units", first_units),
            ):
                tables.add(c_type, f"{part}_{d}", constants)
            parts = ("weights", "thresholds", "n_bytes", "first_units")
            members = ", ".join(f"{self.name}_{part}_{d}" for part in parts)
            rows.append(f"{{{{{coding}}}, {members}, {used.size}, {network.n_actions}}},")
            tables.n_bytes += _BYTES_OF_NETWORK
            n_units.append(used.size)
            n_rows += int(n_bytes.sum())
        most_columns, most_actions = max(code.most_columns for code in codes), max(self.n_actions())
        defines = {
            **codes[0].defines(),
            "MOST_COLUMNS": most_columns,
            "N_ACTIVE_UNITS": self.agent.approximator.n_active_units,
            "MOST_UNITS": max(n_units),
            "MOST_ACTIONS": most_actions,
            "HAS_TIE_TOLERANCE": int(self.agent.learning.tie_tolerance > 0.0),
            "NETWORKS": rows,
        }
        ram_bytes = codes[0].column_bytes * most_columns + 8 + 4 * -(-max(n_units) // 32)
        ram_bytes += 2 * most_actions + 12 * self.n_inputs + self.history_bytes()
        sizes = {
            "weight_bytes": 4 * n_rows * codes[0].n_columns,
            "ram_bytes": ram_bytes,
            "n_words": n_rows * most_columns,
        }
        description = self.describe(" + ".join(map(str, n_units)))
        needs = self.needs(**sizes)
        return self.write("sdnn_greedy_c.h", description, needs, defines, tables, **sizes)

    def _add_ranks(self, tables: Tables) -> None:
        """Add the ranks of the values of all counts, so that C compares whole numbers.

        With a tolerance of ties, also add the lowest rank that ties with each rank.
        """
        networks = self.networks
        values = networks[0].output_values()
        if any((network.output_values() != values).any() for network in networks):
            raise ValueError("networks of one agent must have one range of values")
        distinct = np.unique(values)
        about = "Ranks of the values that counts of active units stand for."
        tables.add("uint16_t", "ranks", np.searchsorted(distinct, values), about)
        if self.agent.learning.tie_tolerance > 0.0:
            ties = np.searchsorted(distinct, distinct - self.agent.learning.tie_tolerance)
            about = "Of each rank, the lowest that ties with it."
            tables.add("uint16_t", "ties", ties, about)


_WEIGHTS_STREAM = 3  # see cpp/include/sdnn/core/random.hpp
_MOST_RETURNS = 256
MOST_WEIGHT = 127
_LARGEST = 2.0**100  # largest magnitude of real settings
_WORD = 2**64 - 1
_ROUNDING = {"away": "AWAY", "half_up": "HALF_UP", "random": "AT_RANDOM"}


class SDNNCLearner(Learner[_core.SDNNC], SDNNCWriter):
    """Makes the header of an `SDNNQLearning` agent that learns."""

    magic = 0x434E4453  # "SDNC"
    streams = (
        *(f"policy.{stream}" for stream in ("exploration", "ties", "evaluation_ties")),
        "repetitions",
        "action_value.rounding",
    )

    def __init__(self, agent: SDNNQLearning, name: str, fraction_bits: int | None) -> None:
        if agent.n_dimensions > 1:
            raise argument_error(
                "action_space",
                "must have one dimension for an SDNNQLearning that learns in C, got"
                f" {agent.n_dimensions}: SDNNQLambda (q-lambda) learns with more",
            )
        super().__init__(agent, name, fraction_bits)
        self._check_settings()
        self.code = Code(self.network, self.n_inputs)
        self.used, self.first_units = self.units(self.network)
        self.n_units = rounded_up(self.used.size, 4)
        self.require_small(self.n_units, self.code.n_columns)
        self._check_values()
        self.n_words = self.n_units // 4 * self.code.n_columns
        self.horizon = int(2.0 / max(1.0 - agent.learning.discount, 0.004))
        """Number of rewards of a return, at most 500; see `sdnn/agents/return_range.hpp`."""
        self.adapts = agent.learning.value_range == "adaptive"

    def _check_settings(self) -> None:
        """Raise ValueError for settings that the header does not support."""
        learning, sizes = self.agent.learning, self.agent.approximator
        has_finals = learning.final_learning_rate is not None or learning.final_epsilon is not None
        ranges = {"weight_limit": f"1 to {MOST_WEIGHT}"}
        limits = range(1, MOST_WEIGHT + 1)
        for table, name, is_wrong, expected in (
            ("approximator", "weight_limit", sizes.weight_limit not in limits, f"{MOST_WEIGHT}"),
            ("approximator", "averaging_interval", sizes.averaging_interval > 0, "0"),
            ("learning", "tie_tolerance", learning.tie_tolerance > 0, "0"),
            ("learning", "schedule", has_finals and learning.schedule != "linear", "linear"),
        ):
            if is_wrong:
                value = getattr(getattr(self.agent, table), name)
                raise argument_error(
                    name,
                    f"must be {ranges.get(name, expected)} for an SDNNQLearning that learns in C,"
                    f" got {value}: train with --set {table}.{name}={expected}",
                )

    def _check_values(self) -> None:
        """Raise ValueError if the header could not distinguish values of neighbouring counts."""
        network = self.network
        low, high = network.output_range
        steps = np.diff(network.output_values()[network.u_low : network.u_high + 1])
        if max(abs(low), abs(high)) > _LARGEST or steps.min() <= 0:
            raise ValueError(
                f"values must be distinct and at most 2^100 in size in C, got {low:g} to {high:g}:"
                " take other q_low and q_high, or value_range='adaptive'"
            )

    def columns(self) -> NDArray[np.int32]:
        """Return the weights of the used units by columns, shape (n_used, n_columns)."""
        columns = self.code.paired(self.network.weights()[self.used])
        if np.abs(columns).max() > MOST_WEIGHT:
            raise ValueError(
                "sums and differences of two weights must be -127 to 127 for an SDNNQLearning that"
                f" learns in C, got {np.abs(columns).max()}: export the greedy policy, without"
                " learning"
            )
        return columns

    def thresholds(self) -> NDArray[np.int32]:
        """Return the thresholds of the used units, and 0 for those that fill the last word."""
        thresholds: NDArray[np.int32] = self.network.thresholds()[self.used]
        return np.pad(thresholds, (0, self.n_units - self.used.size))

    def fields(self) -> list[Field]:
        """Return names, types and shapes of an image."""
        of_range: list[Field] = []
        if self.adapts:
            of_range = [
                *((f"range.{name}", "<f8") for name in ("low", "high", "sum")),
                *((f"range.{name}", "<u8") for name in ("n_returns", "due")),
                *((name, "<u4") for name in ("n_rewards", "n_kept_returns", "range.oldest")),
                ("range.rewards", "<i4", (2 * self.horizon,)),
                ("range.returns", "<f8", (_MOST_RETURNS,)),
            ]
        return [
            ("fraction_bits", "<u4"),
            ("n_random_left", "<u4"),
            ("words", "<u8", (5, 4)),
            *SCALE_FIELDS,
            ("progress", "<f8"),
            ("action_value.output_range", "<f8", (2,)),
            *of_range,
            ("thresholds", "<i4", (self.n_units,)),
            ("weights", "<u4", (self.n_words,)),
        ]

    def remembered(self, state: Data) -> Data:
        """Return the fields that are not in the core's state, or differ there."""
        of_range: Data = {}
        if self.adapts:
            rewards, returns = self._rewards(state), state["range.returns"]
            of_range = {
                "n_rewards": rewards.size,
                "n_kept_returns": returns.size,
                "range.rewards": np.pad(rewards, (0, 2 * self.horizon - rewards.size)),
                "range.returns": np.pad(returns, (0, _MOST_RETURNS - returns.size)),
            }
        return {
            "fraction_bits": self.fraction_bits,
            "thresholds": self.thresholds(),
            "weights": weight_words(self.columns())[0],
            **of_range,
        }

    def recall(self, image: Array, state: Data) -> None:
        """Write the fields of an image into the core's state, in which a new episode begins."""
        fraction_bits = whole("fraction_bits", int(image["fraction_bits"]), 0, MOST_FRACTION_BITS)
        state["action_value.output_range"] = image["action_value.output_range"].copy()
        if self.adapts:
            for name in ("low", "high", "sum", "n_returns", "due"):
                state[f"range.{name}"] = image[f"range.{name}"]
            state["range.oldest"] = np.uint64(image["range.oldest"])
            rewards = image["range.rewards"][: image["n_rewards"]]
            state["range.rewards"] = rewards / 2.0**fraction_bits
            state["range.returns"] = image["range.returns"][: image["n_kept_returns"]].copy()
        for name in ("states", "actions", "rewards"):
            state[f"n_step_buffer.{name}"] = state[f"n_step_buffer.{name}"][:0]
        words = image["weights"].reshape(-1, self.code.n_columns)
        lanes = words.copy().view(np.uint8).reshape(len(words), -1, 4).transpose(0, 2, 1)
        # An image has weights as bytes plus 128, those of four units in a word.
        columns = lanes.reshape(self.n_units, -1)[: self.used.size].astype(np.int32) - 128
        if not 0.0 <= image["progress"] <= 1.0 or columns.min() < -MOST_WEIGHT:
            raise ValueError("progress must be 0 to 1, and weights -127 to 127")
        known = {"thresholds": image["thresholds"], "weights": self.code.unpaired(columns)}
        for name, values in known.items():
            of_all_units = state[f"action_value.{name}"].copy()
            of_all_units[self.used] = values[: self.used.size]
            state[f"action_value.{name}"] = of_all_units

    def restore(self, whole: bytes) -> None:
        """Set the agent's state from an image; ValueError if it is damaged or another agent's."""
        super().restore(whole)
        self.agent.progress = float(np.frombuffer(whole, self.layout(), 1)["progress"][0])

    def _rewards(self, state: Data) -> Array:
        """Return the pending rewards as fixed-point numbers of 32 bits."""
        scaled: Array = np.round(state["range.rewards"] * 2.0**self.fraction_bits)
        clipped: Array = np.clip(scaled, -(2**31), 2**31 - 1).astype("<i4")
        return clipped

    def _is_new(self) -> bool:
        """Whether weights and thresholds are the initial ones, which the header draws by itself."""
        sizes, network = self.agent.approximator, self.network
        if sizes.initial_weights != "ternary":
            return False
        new = _core.SDNNC(sizes, self.agent.seed)
        return np.array_equal(network.weights(), new.weights()) and np.array_equal(
            network.thresholds(), new.thresholds()
        )

    def _rates(self, state: Data) -> dict[str, str]:
        """Return the macros by which alpha and epsilon follow the progress of the training.

        A rate moves from FIRST to LAST in a FRACTION of it; if that is 0, it stays as it is now.
        """
        learning, defines = self.agent.learning, dict[str, str]()
        fractions = {"learning_rate": 1.0, "epsilon": learning.exploration_fraction}
        for macro, name in (("RATE", "learning_rate"), ("EPSILON", "epsilon")):
            first, last = getattr(learning, name), getattr(learning, f"final_{name}")
            fraction = fractions[name]
            if last is None or name in state:
                first = last = getattr(self.agent, name)
                fraction = 0.0
            numbers = {"FIRST": first, "LAST": last, "FRACTION": fraction}
            defines |= {f"{macro}_{word}": real_number(number) for word, number in numbers.items()}
        return defines

    def header(self) -> CHeader:
        """Make the header."""
        state, tables, is_new = self.state(), self.tables_of_spaces(), self._is_new()
        self.code.add_tables(tables)
        tables.add("uint32_t", "first_units", self.first_units, "Where windows begin.")
        self.add_head(tables, "range.rewards" if self.adapts else "thresholds")
        if self.adapts:
            tables.add("int32_t", "first_rewards", self._rewards(state))
            tables.add("uint64_t", "first_returns", bits_of(state["range.returns"]))
        defines = {
            **self.code.defines(),
            **self._network_defines(),
            **self._rates(state),
            **self.learning_defines(),
            **self._add_weights(tables, is_new),
        }
        ram_bytes = self._ram_bytes()
        stack = f", and {self._stack_bytes():,} bytes of arrays on the stack"
        return self.write(
            "sdnn_c.h",
            self.describe(str(self.used.size)),
            self.learning_needs(12, ram_bytes, self.n_words + self.n_units, stack),
            defines,
            tables,
            weight_bytes=0 if is_new else 4 * self.n_words,
            ram_bytes=ram_bytes,
            n_words=self.n_words,
        )

    def _network_defines(self) -> Data:
        """Return the sizes of the network and the settings of its learning rule."""
        sizes, learning, network = self.agent.approximator, self.agent.learning, self.network
        return {
            "N_ACTIONS": network.n_actions,
            "N_UNITS": self.n_units,
            "N_ACTIVE_UNITS": sizes.n_active_units,
            "U_LOW": network.u_low,
            "U_HIGH": network.u_high,
            "LATTICE": sizes.lattice,
            "WEIGHT_LIMIT": sizes.weight_limit,
            "ROUNDING_RULE": f"{self.name.upper()}_{_ROUNDING[sizes.rounding]}",
            "N_STEPS": learning.n_steps,
            "DISCOUNT": real_number(learning.discount),
            "ADAPTS": int(self.adapts),
            "HORIZON": self.horizon,
        }

    def _add_weights(self, tables: Tables, is_new: bool) -> dict[str, int]:
        """Add the weights, or the ranges of used units if the header draws initial weights."""
        if not is_new:
            words = weight_words(self.columns())[0]
            tables.add("uint32_t", "first_weights", words)
            tables.add("int32_t", "first_thresholds", self.thresholds())
            return {"IS_NEW": 0}
        breaks = np.flatnonzero(np.diff(self.used) > 1)
        first, last = np.r_[0, breaks + 1], np.r_[breaks, self.used.size - 1]
        ranges = np.stack([self.used[first], self.used[last] + 1], axis=1)
        tables.add("uint16_t", "used", ranges, "Hidden units in use: from, to.")
        groups = [self.code.groups.index(pair) for pair in self.network.pairs]
        about = "Groups of the pairs of inputs, in the order in which weights are drawn."
        tables.add("uint16_t", "groups", np.array(groups), about)
        seed = np.array(_seeded(self.agent.seed, _WEIGHTS_STREAM), np.uint64)
        tables.add("uint64_t", "seed_of_weights", seed)
        sizes = self.agent.approximator
        return {
            "IS_NEW": 1,
            "N_RANGES": len(ranges),
            "N_HIDDEN_UNITS": sizes.n_hidden_units,
            "FIRST_THRESHOLD": round(sizes.initial_threshold * sizes.lattice),
        }

    def _ram_bytes(self) -> int:
        """Return the size of the C struct, with numbers aligned to their sizes."""
        n_steps = self.agent.learning.n_steps
        n_bytes = 5 * 32 + 24 + 5 * 8  # generators, reward scale, numbers of 64 bits
        n_bytes += (n_steps + 1) * self._state_bytes() + 12 * n_steps  # pending transitions
        n_bytes += 4 * self.n_words + 4 * self.n_units  # weights and thresholds
        n_bytes += 4 * (10 + self.n_inputs + self.n_observed)  # numbers of 32 bits, next state
        n_bytes += 4 * (self.n_observed + 1) * self.history.holds  # the held readings
        if self.adapts:  # 64-bit numbers, returns, two horizons of rewards, three 32-bit numbers
            n_bytes += 5 * 8 + 8 * _MOST_RETURNS + 8 * self.horizon + 12
        return rounded_up(n_bytes, 8)

    def _state_bytes(self) -> int:
        """Return the bytes of a state with the potentials of all units."""
        columns = rounded_up(self.code.column_bytes * self.code.most_columns, 4)
        return 8 + 4 * self.n_inputs + columns + 4 + 4 * self.n_units

    def _stack_bytes(self) -> int:
        """Return the bytes of the largest arrays that are on the stack at the same time."""
        changes = 2 * self.code.column_bytes * self.code.most_columns + self.code.n_columns
        changes += self._state_bytes()
        return int(changes + 4 * self.network.n_actions + 8 * self.n_inputs)


def _seeded(seed: int, stream: int) -> list[int]:
    """Return the initial state of a random stream; see cpp/include/sdnn/core/random.hpp."""
    mixed = seed

    def split_mix() -> int:
        """Return the next number of SplitMix64, with the constants of its authors."""
        nonlocal mixed
        mixed = mixed + 0x9E3779B97F4A7C15 & _WORD
        z = (mixed ^ mixed >> 30) * 0xBF58476D1CE4E5B9 & _WORD
        z = (z ^ z >> 27) * 0x94D049BB133111EB & _WORD
        return z ^ z >> 31

    mixed = split_mix() ^ stream  # so that streams of a seed differ
    mixed = split_mix()
    return [split_mix() for _ in range(4)]
