"""An agent with a linear readout as a C header: its greedy policy, or the agent, which learns."""

from __future__ import annotations

import json
import math
import zlib
from collections.abc import Iterator
from textwrap import wrap
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdnn.agents import SDNNSarsa
from sdnn.export.tables import Tables, joined
from sdnn.export.writer import MOST_WEIGHTS, CHeader, Writer, template

IMAGE_MAGIC = 0x4C4E4453  # "SDNL"
IMAGE_HEAD = 40 + 4 * 32
"""Bytes of an image before its weights."""
STREAMS = ("policy.exploration", "policy.ties", "policy.evaluation_ties", "repetitions")
_ONE = 1 << 16  # of rates
_MOST_TOLERANCE = 2**40  # above any value

_POLICY = "the greedy policy of a trained agent, in C99 for small processors."
_ABOUT_POLICY = """\
 * Flash: ${flash} bytes of constants, of which ${weight_bytes} are weights; the code comes to
 *        1 to 2 kB.
 * RAM:   ${ram_bytes} bytes of arrays on the stack, and at most 256 bytes for all else there;
 *        ${name}_act_float takes ${float_ram} more. No heap, and nothing static that changes.
 * Time:  a decision reads ${words} words of 32 bits of weights.
"""
_LEARNER = "an agent that learns, in C99 for small processors."
_ABOUT_LEARNER = """\
 * Flash: ${flash} bytes of constants; the code comes to some 6 kB.
 * RAM:   ${ram_bytes} bytes, in one struct that you place. No heap, and nothing static that
 *        changes.
 * Where the processor cannot multiply or shift 64 bits by itself, the compiler's own library does
 * (libgcc); nothing is divided.
"""

_RANDOM = """\
/* xoshiro256** of Blackman and Vigna. */
typedef struct {
  uint64_t words[4];
} ${name}_random;

/* a / b and what is left, without a division. b is above 0. */
static inline uint64_t ${name}_quotient(uint64_t a, uint64_t b, uint64_t *rest) {
  uint64_t quotient = 0;
  uint32_t n = 0;
  for (; b <= a >> 1; b <<= 1) ++n;
  for (;; --n, b >>= 1) {
    quotient <<= 1;
    if (a >= b) {
      a -= b;
      quotient |= 1;
    }
    if (n == 0) break;
  }
  *rest = a;
  return quotient;
}

static inline uint64_t ${name}_bits(${name}_random *random) {
  uint64_t *const s = random->words;
  const uint64_t five = s[1] * 5, shifted = s[1] << 17;
  const uint64_t result = (five << 7 | five >> 57) * 9;
  s[2] ^= s[0];
  s[3] ^= s[1];
  s[1] ^= s[2];
  s[0] ^= s[3];
  s[2] ^= shifted;
  s[3] = s[3] << 45 | s[3] >> 19;
  return result;
}

/* A number below n, all with the same probability. */
static inline uint64_t ${name}_below(${name}_random *random, uint64_t n) {
  uint64_t rejected, drawn, rest;
  ${name}_quotient(0 - n, n, &rejected);
  do {
    drawn = ${name}_bits(random);
  } while (drawn < rejected);
  ${name}_quotient(drawn, n, &rest);
  return rest;
}

"""
_DRAW = {
    "counters": ", n_tied = 0, skip = 0",
    "choose": """\
  for (action = 0; action < n_actions; ++action) n_tied += sums[action] >= least;
  if (n_tied > 1) skip = (uint32_t)${name}_below(random, n_tied);
  for (action = 0;; ++action) {
    if (sums[action] >= least && skip-- == 0) return action;
  }
""",
}
_SUM_WINDOWS = """\
  {
    uint32_t a;
    for (a = 0; a < n; ++a) {
      for (i = 1; i < ${window}; ++i) sums[a] += sums[a + i];
    }
  }
"""
_NOTE_STEP = """
/* The average moves to the weights by 1 / 2^k of the way, ever less. */
static inline void ${name}_note_step(${name}_agent *agent) {
  uint32_t k = 0, j;
  int32_t half;
  ++agent->n_steps;
  if (++agent->phase < ${interval}) return;
  agent->phase = 0;
  while (3 * ((UINT32_C(2) << k) - 1) <= agent->n_snapshots) ++k;
  half = k > 0 ? (int32_t)(UINT32_C(1) << (k - 1)) : 0;
  for (j = 0; j < ${n_weights}; ++j) {
    agent->averaged[j] += ${name}_shifted_32(agent->weights[j] - agent->averaged[j] + half, k);
  }
  if (agent->n_snapshots < 3072) ++agent->n_snapshots;
}
"""
_KEEP = """\
  {
    const uint64_t whole = UINT64_C(1) << 53;
    const uint32_t most = UINT32_C(${most_kept}) >> agent->n_ended;
    const uint32_t longest = most > ${least_kept} ? most : ${least_kept};
    uint64_t rest;
    const uint64_t n =
        ${name}_quotient(whole, whole - (${name}_bits(&agent->repetitions) >> 11), &rest);
    agent->n_kept = (uint32_t)(n < longest ? n : longest) - 1;
  }
"""
_DUTCH_GAIN = """\
  gain -= (int32_t)${name}_clipped(
      ${name}_scaled(${name}_scaled(${name}_sum(agent->traces, code, agent->action), rate, 28),
                     ${decay}, 13),
      131071);
"""
_AVERAGED = {
    "averaged": "  int32_t averaged[${n_weights}];\n",
    "halve_averaged": "    agent->averaged[j] = ${name}_shifted_32(agent->averaged[j] + 1, 1);\n",
    "note_step": _NOTE_STEP,
    "call_note_step": "  ${name}_note_step(agent);\n",
    "by_average": ", by the average of the weights",
    "choose_rows": "    if (!explore && agent->n_snapshots > 0) rows = agent->averaged;\n",
    "put_averaged": (
        "  for (j = 0; j < ${n_weights}; ++j) {\n"
        "    at = ${name}_put(at, (uint32_t)agent->averaged[j], 4);\n"
        "  }\n"
    ),
    "get_averaged": (
        "  for (j = 0; j < ${n_weights}; ++j) {\n"
        "    agent->averaged[j] = ${name}_get_32(weights + 4 * (${n_weights} + j));\n"
        "  }\n"
    ),
}
_ACT = """\
  ${name}_code code;
  int64_t sums[${most_rows}];
  ${name}_encode(bins, &code);
"""


class LinearWriter(Writer):
    """Makes the header of an `SDNNSarsa` agent's greedy policy."""

    agent: SDNNSarsa

    def network(self) -> Any:
        """Return the readout."""
        return self.core.action_value

    def layout(self) -> tuple[list[tuple[int, int]], int]:
        """Return the groups (mu, nu) in the order of the code, and how many are taken in twos."""
        pairs = self.network().pairs
        n_partners = len(pairs) // len(self.inputs)
        ranks, n_before = [], dict[int, int]()
        for _, nu in pairs:
            ranks.append(n_before.get(nu, 0))
            n_before[nu] = ranks[-1] + 1
        n_taken = n_partners // 2 * 2
        order = sorted(
            range(len(pairs)), key=lambda g: (ranks[g] >= n_taken, pairs[g][1], ranks[g])
        )
        return [pairs[g] for g in order], n_taken * len(self.inputs)

    def columns(self) -> NDArray[np.intp]:
        """Return the places of the header's columns among those of the weights."""
        m = self.agent.approximator.n_pattern_units
        n_groups = len(self.network().pairs)
        slots = np.arange(n_groups)[:, None] * (-(-m // 64) * 64) + np.arange(m)
        return slots.reshape(-1)

    def n_actions(self) -> list[int]:
        """Return the number of actions of each dimension."""
        return [len(self.agent.actions_of(d)) for d in range(self.n_dimensions)]

    def sizes(self) -> dict[str, Any]:
        """Return what the templates of a readout need, and check it."""
        config, network = self.agent.approximator, self.network()
        m, window = config.n_pattern_units, config.action_window
        groups, n_double = self.layout()
        n_columns = len(groups) * m
        n_actions = self.n_actions()
        n_rows = sum(n + window - 1 for n in n_actions)
        if n_rows * n_columns > MOST_WEIGHTS:
            raise ValueError(
                f"a C header can hold {MOST_WEIGHTS} weights, got {n_rows * n_columns}: take fewer"
                " inputs, n_actions or n_pattern_units"
            )
        n_ones = [int((network.table(i) > 0).sum(axis=1).max()) for i in range(len(self.inputs))]
        most_columns = sum(n_ones[nu] for _, nu in groups[:n_double:2])
        most_columns += sum(n_ones[nu] for _, nu in groups[n_double:])
        is_short = n_columns <= 2**15
        is_double = {0: "0", len(groups): "1"}.get(n_double, f"group < {n_double}")
        return {
            "description": (
                f"{len(self.inputs)} inputs, {m} units per pattern,"
                f" {' x '.join(map(str, n_actions))} actions"
            ),
            "n_pattern_units": m,
            "pattern_bytes": -(-m // 8),
            "n_groups": len(groups),
            "is_double": is_double,
            "unit_type": "uint8_t" if m <= 256 else "uint16_t",
            "column_type": "uint16_t" if is_short else "uint32_t",
            "sign_bit": 15 if is_short else 31,
            "column_mask": "UINT32_C(0x7fff)" if is_short else "UINT32_C(0x7fffffff)",
            "bytes_of_column": 2 if is_short else 4,
            "n_columns": n_columns,
            "most_columns": most_columns,
            "n_rows": n_rows,
            "n_weights": n_rows * n_columns,
            "n_actions": n_actions,
            "window": window,
            "n_windows": window * self.n_dimensions,
            "most_rows": max(n_actions) + window - 1,
            "sum_windows": _SUM_WINDOWS if window > 1 else "",
            "tolerance": self._tolerance(),
        }

    def _tolerance(self) -> str:
        units = math.floor(min(self.agent.learning.tie_tolerance, _MOST_TOLERANCE))
        return f"  least -= INT64_C({units});\n" if units else ""

    def add_code(self, tables: Tables, sizes: dict[str, Any]) -> None:
        """Add the constants of the code and of the readout's rows."""
        name, network = self.name, self.network()
        groups, _ = self.layout()
        # Unit k of a group is modified by unit sigma[k]; here they are in the order of the latter.
        units = [np.argsort(network.permutation(*group)) for group in groups]
        tables.add("uint8_t", f"{name}_patterns", self.patterns(network))
        tables.add("uint16_t", f"{name}_modified", np.array([mu for mu, _ in groups]))
        tables.add("uint16_t", f"{name}_modifiers", np.array([nu for _, nu in groups]))
        tables.add(sizes["unit_type"], f"{name}_units", np.concatenate(units))
        n_actions = np.array(sizes["n_actions"])
        first_rows = np.cumsum([0, *(n_actions + sizes["window"] - 1)])[:-1]
        tables.add("uint32_t", f"{name}_n_actions", n_actions, "Actions of each dimension.")
        tables.add("uint32_t", f"{name}_first_rows", first_rows, "Readout units of each dimension.")

    def header(self) -> CHeader:
        """Make the header."""
        sizes, tables = self.sizes(), self.tables_of_spaces()
        self.add_code(tables, sizes)
        state = self.core.state()
        weights = state["action_value.weights"]
        if np.any(state.get("action_value.n_snapshots", 0)):
            weights = state["action_value.averaged_weights"]
        tables.add("int32_t", f"{self.name}_weights", weights[:, self.columns()].reshape(-1))
        choose = [
            f"  ${{name}}_sums(${{name}}_weights, &code, {d}, sums);\n"
            + (f"  action[{d}] = " if self.is_vector else "  return ")
            + f"${{name}}_best(sums, {n});\n"
            for d, n in enumerate(sizes["n_actions"])
        ]
        most_columns = sizes["most_columns"]
        n_words = min(most_columns, sizes["n_columns"]) * sizes["n_rows"]
        ram_bytes = most_columns * sizes["bytes_of_column"] + 8 * sizes["most_rows"]
        values = {
            "title": _POLICY,
            "about": _ABOUT_POLICY,
            "weight_bytes": 4 * sizes["n_weights"],
            "ram_bytes": ram_bytes + 12 * len(self.inputs),
            "n_words": n_words,
            "words": f"{n_words:,}",
            "random": "",
            "random_parameter": "",
            **self.choice("sums[action] >= least", "n_actions"),
            "act_bins": _ACT + "".join(choose),
        }
        return self.write(template("c_linear"), template("c_greedy"), {**sizes, **values}, tables)


class LearnerWriter(LinearWriter):
    """Makes the header of an `SDNNSarsa` agent that learns."""

    def calls(self) -> Iterator[str]:
        """Describe the declarations and calls."""
        name, macro = self.name, self.name.upper()
        yield f"  static {name}_agent agent; // all that it remembers"
        yield f"  {name}_begin(&agent);"
        yield f"  {name}_begin_episode(&agent); // whenever the task starts anew"
        if self.is_vector:
            yield f"  uint32_t action[{macro}_N_DIMENSIONS];"
            yield f"  {name}_act(&agent, observation, 1, action); // 0: the best one, to use it"
        else:
            yield f"  uint32_t action = {name}_act(&agent, observation, 1); // 0: the best one"
        yield f"  {name}_learn(&agent, observation, action, reward, next_observation, terminated);"

    def remarks(self) -> Iterator[str]:
        """Describe what else there is."""
        yield from wrap(
            f"Rewards are times 2^{self.fraction_bits} too. {self.name}_save and {self.name}_load"
            " write and read what was learned as bytes, as sdnn.export.load_image and"
            " save_image do.",
            96,
        )
        yield f"{self.name}_bins_of_fixed finds the bins of all inputs:"

    def tie_rule(self) -> str:
        """Describe which of several best actions is taken."""
        rule = self.agent.learning.tie_rule
        if rule == "uniform":
            return "Of several best actions it draws one, as the agent does."
        return super().tie_rule()

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

    def image(self) -> bytes:
        """Return the state as the header's bytes."""
        state, columns = self.core.state(), self.columns()
        exponent = state.get("action_value.exponent", -(2**31))
        head = [
            np.array([IMAGE_MAGIC, self.fingerprint()], "<u4"),
            np.array([exponent], "<i4"),
            np.array([state.get("action_value.n_snapshots", 0), _left(state)], "<u4"),
            np.array([state.get("n_ended", 0)], "<u4"),
            np.array([state["n_learned"], state.get("action_value.n_steps", 0)], "<u8"),
            *(state[f"{stream}.words"].astype("<u8") for stream in STREAMS),
        ]
        names = ("action_value.weights", "action_value.averaged_weights")
        rows = [state[n][:, columns].astype("<i4") for n in names if n in state]
        image = b"".join(part.tobytes() for part in (*head, *rows))
        return image + zlib.crc32(image).to_bytes(4, "little")

    def header(self) -> CHeader:
        """Make the header."""
        learning, sizes, tables = self.agent.learning, self.sizes(), self.tables_of_spaces()
        config, state = self.agent.approximator, self.core.state()
        self.add_code(tables, sizes)
        about = "What the agent begins with: states of its random generators."
        lines = [f"/* {about} */", f"static const uint64_t {self.name}_seeds[4][4] = {{"]
        for stream in STREAMS:
            words = ", ".join(f"UINT64_C({int(w)})" for w in state[f"{stream}.words"])
            lines.append(f"  {{{words}}},")
        tables.lines += [*lines, "};"]
        tables.n_bytes += 128
        initial = self._initial(tables, state)
        is_dutch, is_sarsa = learning.traces == "dutch", learning.bootstrap == "sarsa"
        averages = config.averaging_interval > 0
        n_copies = 3 if averages else 2
        n_image_weights = (2 if averages else 1) * sizes["n_weights"]
        uniform = learning.tie_rule == "uniform"
        most_kept, late = learning.max_action_repeat, learning.n_greedy_steps
        values = {
            "title": _LEARNER,
            "about": _ABOUT_LEARNER,
            "weight_bytes": 0,
            "ram_bytes": self._ram_bytes(sizes, n_copies),
            "n_words": sizes["most_columns"] * sizes["n_rows"],
            "random": _RANDOM,
            "random_parameter": ", ${name}_random *random" if uniform else "",
            "random_argument": (
                ",\n                               explore ? &agent->ties : &agent->evaluation_ties"
                if uniform
                else ""
            ),
            **(_DRAW if uniform else self.choice("sums[action] >= least", "n_actions")),
            **dict.fromkeys(_AVERAGED, ""),
            **(_AVERAGED if averages else {}),
            "interval": max(1, config.averaging_interval),
            "schedule_steps": learning.schedule_steps,
            "rate": self._rate("learning_rate"),
            "epsilon": self._rate("epsilon"),
            "decay": round(learning.discount * learning.trace_decay * 8192),
            "discount": round(learning.discount * 32768),
            "dutch_gain": _DUTCH_GAIN if is_dutch else "",
            "kept_trace": "traces[column] + " if is_dutch else "",
            "drift": "value - agent->old_value" if is_dutch else "0",
            "sarsa_at_end": "  ${name}_correct_by_best(agent);\n" if is_sarsa else "",
            "finish": (
                "    ${name}_correct(agent, ${name}_value(agent, code, given, 0));\n"
                if is_sarsa
                else "    if (${name}_sum(agent->weights, code, given) <"
                " ${name}_best_sum(agent, code)) ${name}_end(agent);\n"
            ),
            "q_learning": "" if is_sarsa else " else {\n    ${name}_correct_by_best(agent);\n  }",
            "initial": initial,
            "n_random_left": _left(state),
            "start_steps": learning.start_steps,
            "is_late": f"step >= {late} && " if late else "",
            "keep": _KEEP if most_kept > 1 else "",
            "most_kept": most_kept,
            "least_kept": min(5, most_kept),
            "give": (
                "  for (d = 0; d < ${n_dimensions}; ++d) action[d] = chosen[d];\n"
                if self.is_vector
                else "  return chosen[0];\n"
            ),
            "action_parameter": "const uint32_t *action" if self.is_vector else "uint32_t action",
            "action_d": "action[d]" if self.is_vector else "action",
            "image_bytes": IMAGE_HEAD + 4 * n_image_weights + 4,
            "image_head": IMAGE_HEAD,
            "image_magic": f"0x{IMAGE_MAGIC:08x}",
            "fingerprint": f"0x{self.fingerprint():08x}",
            "n_image_weights": n_image_weights,
        }
        return self.write(template("c_linear"), template("c_learning"), {**sizes, **values}, tables)

    def _rate(self, name: str) -> str:
        """Write alpha or epsilon: as it is now, or by the schedule."""
        learning, state = self.agent.learning, self.core.state()
        if learning.schedule_steps == 0 or name in state:
            return str(round(getattr(self.core, name) * _ONE))
        first, last = getattr(learning, name), getattr(learning, f"final_{name}")
        ends = [round(one * _ONE) for one in (first, first if last is None else last)]
        return f"${{name}}_scheduled(agent, {ends[0]}, {ends[1]})"

    def _initial(self, tables: Tables, state: Any) -> str:
        """Write what the agent knows already."""
        lines = []
        exponent = state.get("action_value.exponent")
        if exponent is not None:
            lines += ["agent->has_exponent = 1;", f"agent->exponent = {int(exponent)};"]
        lines.append(f"agent->n_learned = INT64_C({int(state['n_learned'])});")
        lines.append(f"agent->n_ended = {int(state.get('n_ended', 0))};")
        if "action_value.n_steps" in state:
            n_steps = int(state["action_value.n_steps"])
            lines.append(f"agent->n_steps = INT64_C({n_steps});")
            lines.append(f"agent->phase = {n_steps % self.agent.approximator.averaging_interval};")
            lines.append(f"agent->n_snapshots = {int(state['action_value.n_snapshots'])};")
        for mine, name in (("weights", "weights"), ("averaged", "averaged_weights")):
            rows = state.get(f"action_value.{name}")
            if rows is None or not rows.any():
                continue
            tables.add("int32_t", f"{self.name}_first_{mine}", rows[:, self.columns()].reshape(-1))
            lines.append("for (i = 0; i < ${n_weights}; ++i) {")
            lines.append(f"  volatile int32_t *const at = &agent->{mine}[i]; /* else: memcpy */")
            lines.append(f"  *at = ${{name}}_first_{mine}[i];")
            lines.append("}")
        return joined(f"  {line}" for line in lines)

    def _ram_bytes(self, sizes: dict[str, Any], n_copies: int) -> int:
        """Return the bytes of the struct, where numbers lie at multiples of their sizes."""
        n_inputs = len(self.inputs)
        code = 4 + 4 * n_inputs + sizes["bytes_of_column"] * sizes["most_columns"]
        n_bytes: int = 8 * 3 + 32 * 4 + 4 * n_copies * sizes["n_weights"] + 4 * 10
        n_bytes += 4 * (2 * self.n_dimensions + n_inputs) + 2 * (-(-code // 4) * 4)
        n_bytes += 3 + int(sizes["n_rows"])
        return -(-n_bytes // 8) * 8


def _left(state: Any) -> int:
    left = state.get("n_random_left")
    return 0 if left is None else int(left)
