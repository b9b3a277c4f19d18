"""SDNNActorCritic as a C header: its greedy policy, or the agent that learns."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.agents import SDNNActorCritic
from sdnn.environments.types import Array, Data
from sdnn.export.code import Code
from sdnn.export.learner import MOMENTS, NONE, SCALE_FIELDS, Field
from sdnn.export.linear import LinearLearner, LinearWriter
from sdnn.export.text import Tables, rounded_up
from sdnn.export.writer import CHeader, follows_ranges

_CRITIC, _ACTOR = "action_value.weights", "actor.weights"


class ThermometerCode(Code):
    """The paired code, and after it the thermometers of some inputs."""

    def __init__(
        self, network: _core.LinearSDNN, inputs: list[int], n_inputs: int, *, n_unread_bins: int
    ) -> None:
        super().__init__(network, n_inputs)
        self.n_unread_bins = n_unread_bins
        """Bins of an input that stand for missing readings."""
        self.n_pair_slots = len(self.groups) * rounded_up(self.m, 64)
        """Columns of the groups in the agent's weights, where each fills whole words."""
        n_thermometer_columns = network.weights().shape[1] - self.n_pair_slots
        self.thermometers = inputs if n_thermometer_columns else []
        self.n_units: int = n_thermometer_columns // max(len(inputs), 1)
        """Columns of a thermometer."""

    @property
    def n_thermometer_columns(self) -> int:
        """Number of columns of thermometers, none of which is ever 0."""
        return len(self.thermometers) * self.n_units

    @property
    def n_columns(self) -> int:
        """Number of columns."""
        return super().n_columns + self.n_thermometer_columns

    @property
    def most_columns(self) -> int:
        """Number of columns that a state can have at most."""
        return super().most_columns + self.n_thermometer_columns

    def defines(self) -> dict[str, int]:
        """Return the macros with the sizes of the code."""
        bins = [len(self.network.table(i)) - self.n_unread_bins for i in self.thermometers]
        return {  # a last bin of at least 1, since C divides by it
            **super().defines(),
            "N_COLUMNS": self.n_columns,
            "N_THERMOMETERS": len(self.thermometers),
            "N_THERMOMETER_UNITS": self.n_units,
            "LAST_THERMOMETER_BIN": max([*bins, 2]) - 1,
        }


class ActorCriticWriter(LinearWriter):
    """Makes the header of an `SDNNActorCritic` agent's greedy policy."""

    agent: SDNNActorCritic

    def unused_files(self) -> list[str]:
        """Return the C files that the header does not need."""
        last = "sdnn_last_observation.h" if self.codes_missing else "sdnn_last_bins.h"
        return [*super().unused_files(), last]

    def code(self) -> ThermometerCode:
        """Return the code of its states."""
        inputs = [*self.inputs, *self.history.added]
        variables = [i for i, source in enumerate(inputs) if source.kind == "variable"]
        n_unread_bins = int(self.codes_missing)
        return ThermometerCode(self.network, variables, self.n_inputs, n_unread_bins=n_unread_bins)

    @property
    def action_window(self) -> int:
        """The number of readout units of an action."""
        return 1

    @property
    def acts_between(self) -> bool:
        """Whether greedy actions may lie between those of a Box."""
        return self.box is not None

    def columns(self) -> NDArray[np.intp]:
        """Return the indices of the header's columns among those of the agent's weights."""
        code = self.code()
        thermometers = code.n_pair_slots + np.arange(code.n_thermometer_columns)
        return np.concatenate([super().columns(), thermometers])

    def tables(self) -> Tables:
        """Return the constants of the spaces, the code and the readout's rows."""
        tables = super().tables()
        thermometers = np.array(self.code().thermometers, np.int64)
        tables.add("uint8_t", "thermometers", thermometers, "Inputs that have thermometers.")
        return tables

    def defines(self) -> Data:
        """Return the macros of the readout; see `SoftmaxPolicy` for the bits of a preference."""
        n_slots = self.network.weights().shape[1]
        n_unit_bits = min(40, 16 + (n_slots // 4).bit_length())
        return {
            **super().defines(),
            "N_UNIT_BITS": n_unit_bits,
            "IS_BOX": int(self.box is not None),
        }

    def tie_rule(self) -> str:
        """Return how the header breaks ties: a greedy policy draws nothing."""
        return "middle"

    def tie_remark(self) -> list[str]:
        """Describe how ties are broken, and the actions between those of a box."""
        episode = "&episode, " if self.history.has_episodes else ""
        return [
            "Of several most probable actions it takes the middle of the widest run of neighbours,",
            "where the agent draws one.",
            *self.place_remark(f"place({episode}observation"),
        ]

    def place_remark(self, call: str) -> list[str]:
        """Describe how the greedy actions of a box are called, which may lie between others."""
        if self.box is None:
            return []
        array = ", place" if self.is_vector else ""
        return [
            f"{self.name}_{call}{array}) has the place of the agent's greedy action",
            f"among these, times 2^16, and {self.name}_action_at(d, place) the action there,"
            f" times 2^{self.fraction_bits}.",
        ]

    def weights(self, state: Data) -> NDArray[np.int32]:
        """Return the weights of the header, (n_rows, n_columns); a policy has no critic's."""
        rows = np.concatenate([state[_CRITIC][: self.n_critic_rows], state[_ACTOR]])
        weights: NDArray[np.int32] = rows[:, self.columns()]
        return weights

    def header(self) -> CHeader:
        """Make the header; an action has a preference of 8 bytes and a probability of 4."""
        weights = self.weights(self.agent._state_of("agent"))
        return self.write_policy("sdnn_greedy_actor_critic.h", weights, self.defines(), 12)


class ActorCriticLearner(LinearLearner, ActorCriticWriter):
    """Makes the header of an `SDNNActorCritic` agent that learns."""

    magic = 0x414E4453  # "SDNA"
    streams = ("exploration", "ties")
    n_critic_rows = 1

    def __init__(self, agent: SDNNActorCritic, name: str, fraction_bits: int | None) -> None:
        super().__init__(agent, name, fraction_bits)
        self.history.follows_ranges = follows_ranges(agent)

    def fields(self) -> list[Field]:
        """Return names, types and shapes of an image."""
        shape = self.n_critic_rows + sum(self.n_rows()), self.code().n_columns
        return [
            ("action_value.exponent", "<i4"),
            ("error_scale.exponent", "<i4"),
            ("error_scale.n_errors", "<u4"),
            ("error_scale.mean_square", "<u8"),
            ("n_learned", "<u8"),
            *SCALE_FIELDS,
            ("words", "<u8", (2, 4)),
            *self._moments(),
            ("weights", "<i4", shape),
        ]

    def remembered(self, state: Data) -> Data:
        """Return the fields that are not in the core's state, or differ there."""
        moments = self.agent._state_of("observations") if self._moments() else {}
        return {"action_value.exponent": NONE, **state, **moments, "weights": self.weights(state)}

    def _moments(self) -> list[Field]:
        """Return the fields of the moments of running ranges; none without such ranges."""
        if not self.history.follows_ranges:
            return []
        return [(f"running.{name}", c, (self.n_observed,)) for name, c in MOMENTS.items()]

    def recall(self, image: Array, state: Data) -> None:
        """Write the fields of an image into the core's state, in which a new episode begins."""
        for name in ("old_value", "has_acted"):
            state[name] = np.zeros_like(state[name])
        for name in ("trace.values", "actor_trace.values", "next_state", "mask"):
            if name in state:
                state[name] = state[name][:0]
        for name in ("n_learned", "error_scale.mean_square", "error_scale.n_errors"):
            state[name] = np.array(image[name], np.int64)
        state["error_scale.exponent"] = np.array(image["error_scale.exponent"], np.int32)
        state.pop("action_value.exponent", None)
        if image["action_value.exponent"] != NONE:
            state["action_value.exponent"] = np.array(image["action_value.exponent"], np.int32)
        for name, rows in ((_CRITIC, image["weights"][:1]), (_ACTOR, image["weights"][1:])):
            state[name] = np.zeros_like(state[name])
            state[name][:, self.columns()] = rows

    def tie_rule(self) -> str:
        """Return how the agent breaks ties."""
        return "uniform"

    def tie_remark(self) -> list[str]:
        """Describe how ties are broken, and the actions between those of a box."""
        return [
            f"{self.name}_act draws an action by its probability.",
            *self.greedy_remark(),
            *self.place_remark(f"place({self.greedy_arguments}"),
        ]

    def header(self) -> CHeader:
        """Make the header."""
        tables, weights = self.tables(), self.weights(self.state())
        self.add_head(tables, "weights")
        if not self.history.has_episodes and not self.codes_missing and not self._moments():
            self.add_limits(tables)  # C compares observations and not states
        first_weights = weights.reshape(-1) if weights.any() else np.zeros(0, np.int32)
        fingerprint = {"FINGERPRINT": f"UINT32_C(0x{self.fingerprint():08x})"}
        defines = {**self._learning_rule(), **fingerprint}
        sizes = {"kilobytes": 10, "ram_bytes": self._ram_bytes(self.n_weights())}
        return self.write_learner("sdnn_actor_critic.h", first_weights, tables, defines, **sizes)

    def _learning_rule(self) -> Data:
        """Return the macros of the learning rule; entropy counts units of 2^-16."""
        learning = self.agent.learning
        first, last = learning.learning_rate, learning.final_learning_rate
        actor_rates = learning.actor_learning_rate, learning.final_actor_learning_rate
        if "learning_rate" in self.agent._state_of("agent"):  # it was set, and has no schedule
            first, last = self.agent.learning_rate, None
        return {
            **self.rule_of_values(),
            **self.rates("RATE", first, last),
            **self.rates("ACTOR_RATE", *actor_rates),
            "ENTROPY": math.floor(learning.entropy * 65536 + 0.5),
        }

    def _ram_bytes(self, n_weights: int) -> int:
        """Return the bytes of the struct, where numbers lie at multiples of their sizes."""
        n_bytes = 8 * 2 + 16 + 24 + 32 * 2  # 64-bit numbers, scales of errors, rewards; generators
        n_bytes += 4 * 2 * n_weights + 4 * 3  # weights and traces, numbers of 32 bits
        n_last = self.n_inputs if self.codes_missing else self.n_observed
        n_bytes = self.with_states(n_bytes, 4 * n_last, next_bins=False)
        n_flags = 3 + self.n_critic_rows + sum(self.n_rows())  # a byte each
        n_bytes += 2 * self.code_bytes() + self.duration_bytes + n_flags
        return rounded_up(n_bytes, 8)
