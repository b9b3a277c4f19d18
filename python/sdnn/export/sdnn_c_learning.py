"""An agent with SDNN-C that learns as a C header."""

from __future__ import annotations

import struct
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.agents import SDNNQLearning
from sdnn.arguments import argument_error
from sdnn.export.code import Code
from sdnn.export.sdnn_c import MOST_UNITS
from sdnn.export.tables import Tables, weight_words
from sdnn.export.writer import MOST_WEIGHTS, CHeader, Writer

_IMAGE_MAGIC = 0x434E4453  # "SDNC"
_STREAMS = (
    *(f"policy.{stream}" for stream in ("exploration", "ties", "evaluation_ties")),
    "repetitions",
    "action_value.rounding",
)
_WEIGHTS_STREAM = 3  # see cpp/include/sdnn/core/random.hpp
_MOST_RETURNS = 256
MOST_WEIGHT = 127
_LARGEST = 2.0**100  # of real numbers
_WORD = 2**64 - 1


class SDNNCLearner(Writer):
    """Makes the header of an `SDNNQLearning` agent that learns, and reads what it remembers."""

    agent: SDNNQLearning

    def __init__(self, agent: SDNNQLearning, name: str, fraction_bits: int | None) -> None:
        if agent.n_dimensions > 1:
            raise ValueError(
                "actions must have one dimension for an SDNNQLearning that learns in C, got"
                f" {agent.n_dimensions}: SDNNSarsa learns with more"
            )
        super().__init__(agent, name, fraction_bits)
        self._check_settings()
        self.code = Code(self.network(), len(self.inputs))
        sizes = agent.approximator
        # Only the units that are in a window, and where among them the windows begin.
        first = self.network().first_units().astype(np.intp)
        self.used = np.unique(first[:, None] + np.arange(sizes.n_active_units))
        self.first_units = np.searchsorted(self.used, first)
        self.n_units = -(-self.used.size // 4) * 4
        self.n_words = self.n_units // 4 * self.code.n_columns
        if 4 * self.n_words > MOST_WEIGHTS:
            raise ValueError(
                f"a C header can hold {MOST_WEIGHTS} weights, got {4 * self.n_words}: take fewer"
                " inputs, n_hidden_units or n_pattern_units"
            )
        discount = agent.learning.discount
        self.horizon = int(2.0 / max(1.0 - discount, 0.004))
        """Rewards until a return is known; see cpp/include/sdnn/agents/return_range.hpp."""
        self.adapts = agent.learning.value_range == "adaptive"

    def network(self) -> Any:
        """Return the network."""
        return self.core.action_value

    def _check_settings(self) -> None:
        """Raise ValueError for settings that the header cannot have."""
        learning, sizes = self.agent.learning, self.agent.approximator
        has_finals = learning.final_learning_rate is not None or learning.final_epsilon is not None
        words = {"weight_limit": f"1 to {MOST_WEIGHT}"}
        limits = range(1, MOST_WEIGHT + 1)
        for table, name, is_wrong, expected in (
            ("approximator", "weight_limit", sizes.weight_limit not in limits, f"{MOST_WEIGHT}"),
            ("approximator", "averaging_interval", sizes.averaging_interval > 0, "0"),
            ("learning", "tie_tolerance", learning.tie_tolerance > 0, "0"),
            ("learning", "schedule", has_finals and learning.schedule != "linear", "linear"),
        ):
            if is_wrong:
                given = getattr(getattr(self.agent, table), name)
                raise argument_error(
                    name,
                    f"must be {words.get(name, expected)} for an SDNNQLearning that learns in C,"
                    f" got {given}: train with --set {table}.{name}={expected}",
                )
        if sizes.n_hidden_units > MOST_UNITS:
            problem = f"must be at most {MOST_UNITS} in a C header, got {sizes.n_hidden_units}"
            raise argument_error("n_hidden_units", problem)
        network = self.network()
        low, high = network.output_range
        steps = np.diff(network.output_values()[network.u_low : network.u_high + 1])
        if max(abs(low), abs(high)) > _LARGEST or steps.min() <= 0:
            raise ValueError(
                f"values must be distinct and at most 2^100 in size in C, got {low:g} to {high:g}:"
                " take other q_low and q_high, or value_range='adaptive'"
            )

    def columns(self) -> NDArray[np.int32]:
        """Return the weights of the used units by columns, shape (n_used, n_columns)."""
        columns = self.code.paired(self.network().weights()[self.used])
        if np.abs(columns).max() > MOST_WEIGHT:
            raise ValueError(
                "sums and differences of two weights must be -127 to 127 for an SDNNQLearning that"
                f" learns in C, got {np.abs(columns).max()}: export the greedy policy, without"
                " learning"
            )
        return columns

    def thresholds(self) -> NDArray[np.int32]:
        """Return the thresholds of the used units, filled up with zeros."""
        thresholds: NDArray[np.int32] = self.network().thresholds()[self.used]
        return np.pad(thresholds, (0, self.n_units - self.used.size))

    def image(self) -> bytes:
        """Return the state as the header's bytes."""
        state = self.core.state()
        parts = [
            np.array([_IMAGE_MAGIC, self.fingerprint()], "<u4"),
            np.array([self.fraction_bits, _left(state)], "<u4"),
            *(state[f"{stream}.words"].astype("<u8") for stream in _STREAMS),
            np.array([state["progress"], *state["action_value.output_range"]], "<f8"),
        ]
        if self.adapts:
            returns, rewards = state["range.returns"], self._rewards(state)
            parts += [
                np.array([state[f"range.{name}"] for name in ("low", "high", "sum")], "<f8"),
                np.array([state[f"range.{name}"] for name in ("n_returns", "due")], "<u8"),
                np.array([rewards.size, returns.size, state["range.oldest"]], "<u4"),
                np.pad(rewards, (0, 2 * self.horizon - rewards.size)),
                np.pad(returns, (0, _MOST_RETURNS - returns.size)).astype("<f8"),
            ]
        parts += [self.thresholds().astype("<i4"), weight_words(self.columns())[0].astype("<u4")]
        image = b"".join(part.tobytes() for part in parts)
        return image + zlib.crc32(image).to_bytes(4, "little")

    def restore(self, image: bytes) -> None:
        """Give the agent the state of an image, whole and of this agent."""
        state, at = self.core.state(), 8

        def take(kind: str, n: int) -> NDArray[Any]:
            nonlocal at
            values = np.frombuffer(image, kind, n, at)
            at += values.nbytes
            return values

        fraction_bits, n_left = take("<u4", 2).tolist()
        state.pop("n_random_left", None)
        if n_left:
            state["n_random_left"] = np.array(n_left, np.int32)
        state |= {f"{stream}.words": take("<u8", 4).copy() for stream in _STREAMS}
        progress = float(take("<f8", 1)[0])
        state["action_value.output_range"] = take("<f8", 2).copy()
        if self.adapts:
            state |= {f"range.{name}": take("<f8", 1)[0] for name in ("low", "high", "sum")}
            state |= {f"range.{name}": take("<u8", 1)[0] for name in ("n_returns", "due")}
            n_rewards, n_returns, oldest = take("<u4", 3).tolist()
            state["range.oldest"] = np.uint64(oldest)
            rewards = take("<i4", 2 * self.horizon)[:n_rewards]
            state["range.rewards"] = rewards / 2.0**fraction_bits
            state["range.returns"] = take("<f8", _MOST_RETURNS)[:n_returns].copy()
        for name in ("states", "actions", "rewards"):  # of the episode before
            state[f"n_step_buffer.{name}"] = state[f"n_step_buffer.{name}"][:0]
        thresholds = state["action_value.thresholds"].copy()
        thresholds[self.used] = take("<i4", self.n_units)[: self.used.size]
        words = take("<u4", self.n_words).reshape(-1, self.code.n_columns)
        lanes = words.copy().view(np.uint8).reshape(len(words), -1, 4).transpose(0, 2, 1)
        columns = lanes.reshape(self.n_units, -1)[: self.used.size].astype(np.int32) - 128
        if not 0.0 <= progress <= 1.0 or columns.min() < -MOST_WEIGHT:
            raise ValueError("progress must be 0 to 1, and weights -127 to 127")
        weights = state["action_value.weights"].copy()
        weights[self.used] = self.code.unpaired(columns)
        state |= {"action_value.thresholds": thresholds, "action_value.weights": weights}
        self.core.restore(state)
        self.agent.progress = progress

    def _rewards(self, state: dict[str, Any]) -> NDArray[Any]:
        scaled: NDArray[Any] = np.round(state["range.rewards"] * 2.0**self.fraction_bits)
        clipped: NDArray[Any] = np.clip(scaled, -(2**31), 2**31 - 1).astype("<i4")
        return clipped

    def _is_new(self) -> bool:
        """Whether weights and thresholds are those that the header can draw."""
        sizes, network = self.agent.approximator, self.network()
        if sizes.initial_weights != "ternary":
            return False
        new = _core.SDNNC(sizes, self.agent.seed)
        return all(
            np.array_equal(ours, others)
            for ours, others in (
                (network.weights(), new.weights()),
                (network.thresholds(), new.thresholds()),
            )
        )

    def _threshold(self) -> int:
        sizes = self.agent.approximator
        return round(sizes.initial_threshold * sizes.lattice)

    def _plans(self, state: dict[str, Any]) -> dict[str, dict[str, str]]:
        """Return what follows the progress, and how."""
        learning, plans = self.agent.learning, {}
        for field, name, fraction in (
            ("rate", "learning_rate", 1.0),
            ("epsilon", "epsilon", learning.exploration_fraction),
        ):
            first, last = getattr(learning, name), getattr(learning, f"final_{name}")
            if last is None or name in state:
                continue
            plans[field] = {
                "first": _real(first),
                "last": _real(last),
                "fraction": "" if fraction == 1.0 else _real(fraction),
            }
        return plans

    def header(self) -> CHeader:
        """Make the header."""
        name, code, state = self.name, self.code, self.core.state()
        learning, sizes, network = self.agent.learning, self.agent.approximator, self.network()
        tables, is_new = self.tables_of_spaces(), self._is_new()
        code.add_tables(tables, name)
        tables.add("uint32_t", f"{name}_first_units", self.first_units, "Where windows begin.")
        seeds = [state[f"{stream}.words"] for stream in _STREAMS]
        if is_new:
            seeds.append(np.array(_seeded(self.agent.seed, _WEIGHTS_STREAM), np.uint64))
        about = "What the agent begins with: states of its random generators."
        tables.add("uint64_t", f"{name}_seeds", np.array(seeds), about)
        n_ranges = self._add_weights(tables, is_new)
        shape, n_actions = code.values(), network.n_actions
        low, high = network.output_range
        reals = {
            "progress": state["progress"],
            "rate": self.core.learning_rate,
            "epsilon": self.core.epsilon,
        }
        returns: dict[str, Any] = {}
        if self.adapts:
            rewards, known = self._rewards(state), state["range.returns"]
            reals |= {one: state[f"range.{one}"] for one in ("low", "high", "sum")}
            returns = {one: state[f"range.{one}"] for one in ("due", "n_returns", "oldest")}
            returns |= {"n_rewards": rewards.size, "n_kept_returns": known.size}
            if rewards.size:
                tables.add("int32_t", f"{name}_first_rewards", rewards)
            if known.size:
                tables.add("uint64_t", f"{name}_first_returns", known.view(np.uint64))
        is_double, change = shape["is_double"], "(column < {} ? 2 : 1) * change"
        values = {
            **shape,
            **returns,
            "description": (
                f"{len(self.inputs)} inputs, {sizes.n_pattern_units} units per pattern,"
                f" {self.used.size} hidden units in use, {n_actions} actions"
            ),
            "coding": f"{name}_",
            "is_linear": False,
            "has_progress": True,
            "weight_bytes": 0 if is_new else 4 * self.n_words,
            "n_words": self.n_words,
            "n_units": self.n_units,
            "n_active_units": sizes.n_active_units,
            "n_hidden_units": sizes.n_hidden_units,
            "n_actions": n_actions,
            "n_steps": learning.n_steps,
            "n_ranges": n_ranges,
            "is_new": is_new,
            "threshold": self._threshold(),
            "q_low": _real(low),
            "q_high": _real(high),
            "u_low": network.u_low,
            "u_high": network.u_high,
            "rounding": sizes.rounding,
            "lattice": sizes.lattice,
            "weight_limit": sizes.weight_limit,
            "change": {"0": "change", "1": "2 * change"}.get(
                is_double, change.format(code.n_double * code.m)
            ),
            "adapts": self.adapts,
            "horizon": self.horizon,
            "discount": _real(learning.discount),
            "reals": {field: _real(value) for field, value in reals.items()},
            "plans": self._plans(state),
            "ties": "draw" if learning.tie_rule == "uniform" else self.ties(),
            "late": learning.n_greedy_steps,
            "most_kept": learning.max_action_repeat,
            "n_random_left": _left(state),
            "start_steps": learning.start_steps,
            "image_bytes": len(self.image()),
            "image_magic": f"0x{_IMAGE_MAGIC:08x}",
            "fingerprint": f"0x{self.fingerprint():08x}",
            "stack_bytes": self._stack_bytes(shape),
            "ram_bytes": self._ram_bytes(shape),
        }
        return self.write("c_sdnn_c_learning", values, tables)

    def _add_weights(self, tables: Tables, is_new: bool) -> int:
        """Add the weights or, where they are drawn, ranges of used units; return their number."""
        name = self.name
        if not is_new:
            words = weight_words(self.columns())[0]
            tables.add("uint32_t", f"{name}_first_weights", words)
            tables.add("int32_t", f"{name}_first_thresholds", self.thresholds())
            return 0
        breaks = np.flatnonzero(np.diff(self.used) > 1)
        first, last = np.r_[0, breaks + 1], np.r_[breaks, self.used.size - 1]
        ranges = np.stack([self.used[first], self.used[last] + 1], axis=1)
        tables.add("uint16_t", f"{name}_used", ranges, "Hidden units in use: from, to.")
        places = [self.code.groups.index(pair) for pair in self.network().pairs]
        about = "Places of the pairs of inputs, in the order in which weights are drawn."
        tables.add("uint16_t", f"{name}_groups", np.array(places), about)
        return len(ranges)

    def _ram_bytes(self, shape: dict[str, Any]) -> int:
        """Return the bytes of the struct, where numbers lie at multiples of their sizes."""
        n_steps, n_inputs = self.agent.learning.n_steps, len(self.inputs)
        columns = -(-shape["bytes_of_column"] * shape["most_columns"] // 4) * 4
        one_state = 8 + 4 * n_inputs + columns + 4 + 4 * self.n_units
        n_bytes = 5 * 32 + 5 * 8 + (n_steps + 1) * one_state + 12 * n_steps
        n_bytes += 4 * self.n_words + 4 * self.n_units
        n_bytes += 4 * (10 + n_inputs + self.n_observed)
        if self.adapts:
            n_bytes += 5 * 8 + 8 * _MOST_RETURNS + 8 * self.horizon + 12
        return int(-(-n_bytes // 8) * 8)

    def _stack_bytes(self, shape: dict[str, Any]) -> int:
        """Return the bytes of the largest arrays that are there at one time."""
        changes = 2 * shape["bytes_of_column"] * shape["most_columns"] + shape["n_columns"]
        return int(changes + 4 * self.network().n_actions + 8 * len(self.inputs))


def _left(state: dict[str, Any]) -> int:
    return int(state.get("n_random_left", 0))


def _real(value: Any) -> str:
    """Write a number as its bits."""
    (bits,) = struct.unpack("<Q", struct.pack("<d", float(value)))
    return f"UINT64_C(0x{bits:x})"


def _seeded(seed: int, stream: int) -> list[int]:
    """Return the words that a random stream begins with; see cpp/include/sdnn/core/random.hpp."""
    mixed = seed

    def split_mix() -> int:
        nonlocal mixed
        mixed = mixed + 0x9E3779B97F4A7C15 & _WORD
        z = (mixed ^ mixed >> 30) * 0xBF58476D1CE4E5B9 & _WORD
        z = (z ^ z >> 27) * 0x94D049BB133111EB & _WORD
        return z ^ z >> 31

    mixed = split_mix() ^ stream
    mixed = split_mix()
    return [split_mix() for _ in range(4)]
