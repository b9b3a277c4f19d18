"""Agents exported as C headers, with docstrings of what they cover, and checks of the actions."""

import functools
import subprocess
from dataclasses import dataclass, replace

import gymnasium as gym
import numpy as np

from sdnn.agents import QLambdaConfig, SDNNActorCritic, SDNNQLambda, SDNNQLearning, Transition
from sdnn.approximators import LinearSDNNConfig, SDNNCConfig
from sdnn.coding import RandomInverse
from sdnn.export import c_header, export_c_header

Box, Discrete = gym.spaces.Box, gym.spaces.Discrete
STRICT = ("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror")
STRICT_CPP = ("-std=c++11", "-Wall", "-Wextra", "-Wconversion", "-Werror")
SANITIZED = ("-fsanitize=undefined,address", "-fno-sanitize-recover=all")
ALONE = ("-ffreestanding", "-nostdlib")
N_STATES = 10_000
SMALL = SDNNCConfig(n_pattern_units=24, n_hidden_units=60, n_active_units=20, n_actions=5)


@dataclass(frozen=True)
class Target:
    """A compiler of a kind of processor, and what runs its programs here."""

    compiler: str
    runner: str | None = None
    options: tuple[str, ...] = ()
    prefix: str = ""
    arguments: tuple[str, ...] = ()
    """Arguments of the runner before the program."""
    stdio: str = ""
    """The file stdio.h, where there is no C library."""

    def compile(self, source, *options):
        """Compile a program beside its headers; return its command."""
        folder, path = source.parent, source.with_suffix("")
        if self.stdio:
            (folder / "stdio.h").write_text(self.stdio)
        # An emulated program finds no shared libraries.
        static = ("-static",) if self.runner else ()
        run(self.compiler, *self.options, *static, "-I", folder, *options, source, "-o", path)
        return [self.runner, *self.arguments, path] if self.runner else [path]


TARGETS = {
    "x86-64": Target("gcc"),
    "clang": Target("clang"),
    "aarch64": Target("aarch64-linux-gnu-gcc", "qemu-aarch64", (), "aarch64-linux-gnu-"),
    "arm": Target("arm-linux-gnueabihf-gcc", "qemu-arm", ("-mthumb",), "arm-linux-gnueabihf-"),
}


def run(*command, **options):
    done = subprocess.run([str(word) for word in command], capture_output=True, **options)
    assert done.returncode == 0, done.stderr.decode()
    return done.stdout


def macros(**definitions):
    """Return lines that define names in C: places of a program that differ between agents."""
    return "".join(f"#define {name} {text}\n" for name, text in definitions.items())


def store_action(agent, function, arguments, action="action"):
    """Return C that calls a function of a header and stores the action in an array.

    The function returns the index of an action of a single dimension. For several it writes an
    index each to its last argument.
    """
    if agent.n_dimensions == 1:
        return f"{action}[0] = {function}({arguments})"
    return f"{function}({arguments}, {action})"


def program(folder, source, compiler, *options):
    """Compile a program in C or C++, by the compiler; return its path."""
    path = folder / ("main.cpp" if compiler.endswith("++") else "main.c")
    path.write_text(source + "\n")
    run(compiler, *options, path, "-o", folder / "main")
    return folder / "main"


def learned(agent, n_steps=300, seed=1):
    """Let the agent learn random transitions, and return it."""
    random = np.random.default_rng(seed)
    space = agent.observation_space
    low, high = np.maximum(space.low, -5.0), np.minimum(space.high, 5.0)
    agent.action_space.seed(seed)
    agent.begin_episode()
    observation = random.uniform(low, high)
    for _ in range(n_steps):
        next_observation = random.uniform(low, high)
        reward = float(np.sin(observation.sum()) + random.normal())
        action = agent.action_space.sample()
        agent.learn(
            Transition(observation, action, reward, next_observation, bool(random.random() < 0.1))
        )
        observation = next_observation
    return agent


def learning(**changes):
    return replace(SDNNQLearning.presets["general"].learning, **changes)


def box(*sizes):
    return Box(-np.array(sizes, np.float32), np.array(sizes, np.float32))


def discrete_agent():
    """Windows that leave hidden units unused, and bounds that are no round numbers."""
    return SDNNQLearning(
        Box(np.array([-4.8, -3.3, -0.418, -0.07]), np.array([4.8, 3.1, 0.418, 0.6]), dtype=float),
        Discrete(2, start=-1),
        approximator=SMALL,
        seed=1,
    )


def circular_agent():
    """An angle, ties within a tolerance, actions in double precision, averaged weights."""
    return SDNNQLearning(
        box(np.pi, 8.0, 1.0),
        Box(-2.0, 2.0, (1,), np.float64),
        approximator=replace(SMALL, n_actions=11, averaging_interval=20),
        learning=learning(tie_rule="middle", tie_tolerance=0.3),
        angles=[0],
        seed=2,
    )


def several_agent():
    return SDNNQLearning(
        box(2.0, 3.0), gym.spaces.MultiDiscrete([3, 4, 2]), approximator=SMALL, seed=3
    )


def pairs_agent():
    """A cosine and a sine, two torques, averaged weights."""
    return SDNNQLearning(
        box(1.0, 1.0, 8.0),
        box(1.0, 3.0),
        approximator=replace(SMALL, n_interpolated=8, n_anchor_patterns=6, averaging_interval=30),
        learning=learning(tie_rule="lowest"),
        angle_pairs=[(0, 1)],
        seed=4,
    )


def lone_agent():
    """A single variable, which is two inputs, all windows, and a fixed range of values."""
    approximator = replace(SMALL, n_actions=0, u_low=3, q_low=-0.3, q_high=0.1)
    fixed = learning(tie_rule="lowest", value_range="fixed")
    return SDNNQLearning(box(3.0), box(1.0), approximator=approximator, learning=fixed, seed=5)


def tables_agent():
    """Tables of codes that the user gives, wide patterns, and weights of more than a byte."""
    tables = [RandomInverse(n_bins=n, n_flipped=9).patterns(300, seed=n) for n in (40, 7)]
    agent = SDNNQLearning(
        box(1.0, 1.0), box(2.0), approximator=replace(SMALL, n_pattern_units=300),
        learning=learning(tie_rule="middle"), tables=tables, seed=6,
    )  # fmt: skip
    state = [0.9, -0.9]
    for step in range(800):
        action, reward = [[2.0], [-2.0]][step % 2], step % 4 // 2
        agent.learn(Transition(state, action, reward, state, True))
    return agent


def symbols_agent():
    """A number between two symbols, as Gymnasium flattens a Tuple."""
    space = gym.spaces.Tuple([Discrete(3), box(2.0), Discrete(4, start=1)])
    agent = SDNNQLearning(
        space, box(1.0), approximator=replace(SMALL, averaging_interval=20), seed=7
    )
    random = np.random.default_rng(7)
    space.seed(7)
    agent.action_space.seed(7)
    for _ in range(300):
        (symbol, (number,), other_symbol), action = space.sample(), agent.action_space.sample()
        observation = symbol, [number], other_symbol
        reward = float(np.sin(2.0 * symbol + number + other_symbol) + random.normal())
        agent.learn(Transition(observation, action, reward, space.sample(), True))
    return agent


def partners_agent():
    """Five variables, of which each is paired with two others, which differ by dimension."""
    return SDNNQLearning(
        box(1.0, 2.0, 3.0, 4.0, 5.0), box(1.0, 2.0), approximator=replace(SMALL, max_pairs=10),
        learning=learning(tie_rule="lowest"), seed=8,
    )  # fmt: skip


def linear_agent():
    """A linear readout: windows of torques, an average, groups in twos and left over."""
    return SDNNQLambda(
        box(1.0, 2.0, 3.0, 1.0), box(2.0), seed=9, angle_pairs=[], inputs="all",
        approximator=LinearSDNNConfig(
            n_pattern_units=40, n_actions=9, action_window=3, averaging_interval=20
        ),
        learning=QLambdaConfig(tie_rule="lowest"),
    )  # fmt: skip


def linear_vector_agent():
    """Two dimensions, ties within a tolerance."""
    return SDNNQLambda(
        box(2.0, 3.0), gym.spaces.MultiDiscrete([3, 4]), seed=10, angle_pairs=[], inputs="all",
        approximator=LinearSDNNConfig(n_pattern_units=40, averaging_interval=0),
        learning=QLambdaConfig(tie_rule="middle", tie_tolerance=0.3),
    )  # fmt: skip


def actor_agent():
    """An actor-critic with ranges that follow what is observed, two torques and an angle."""
    return SDNNActorCritic(
        box(1.0, 1.0, 8.0), box(1.0, 3.0), seed=11, angle_pairs=[(0, 1)], inputs="all",
        approximator=LinearSDNNConfig(n_pattern_units=40, n_actions=5),
    )  # fmt: skip


def actor_discrete_agent():
    """An actor-critic with discrete actions."""
    return SDNNActorCritic(
        box(2.0, 3.0), Discrete(3, start=-1), seed=12, angle_pairs=[], inputs="all",
        approximator=LinearSDNNConfig(n_pattern_units=100),
    )  # fmt: skip


AGENTS = {
    "actor": actor_agent,
    "actor-discrete": actor_discrete_agent,
    "linear": linear_agent,
    "linear-vector": linear_vector_agent,
    "discrete": discrete_agent,
    "partners": partners_agent,
    "circular": circular_agent,
    "several": several_agent,
    "pairs": pairs_agent,
    "lone": lone_agent,
    "tables": tables_agent,
}


@functools.cache
def agents():
    """Return trained agents by the names in `AGENTS`."""
    return {name: learned(make()) for name, make in AGENTS.items()}


def observations_of(agent, n, seed=0):
    """Return random observations, some outside the ranges, many at or next to a bound of a bin."""
    random = np.random.default_rng(seed)
    low, high = agent.observation_space.low, agent.observation_space.high
    low, high = low.astype(float), high.astype(float)
    values = random.uniform(low - 0.2 * (high - low), high + 0.2 * (high - low), (n, low.size))
    on_bounds = low + random.integers(0, 361, values.shape) / 360 * (high - low)
    towards = random.choice([-np.inf, np.inf], values.shape)
    on_bounds = np.where(random.random(values.shape) < 0.3, on_bounds, values)
    nudged = np.nextafter(on_bounds, towards)
    values = np.where(random.random(values.shape) < 0.5, on_bounds, nudged)
    values[0] = 0.0
    values[1], values[2] = low, high
    return values


@dataclass(frozen=True)
class Expected:
    """Observations of a kind of numbers, and by dimension the actions that tie and the chosen."""

    kind: str
    given: np.ndarray
    tied: list[list[set[int]]]
    chosen: list[list[int]]


def expected_of(agent, kind, given, observations):
    """Return the agent's actions for observations, which programs read as the numbers ``given``."""
    tied, chosen = [], []
    has_policy = isinstance(agent, SDNNActorCritic)
    values_of = agent.action_probabilities if has_policy else agent.q_values
    tolerance = 0.0 if has_policy else agent.learning.tie_tolerance
    for observation in observations:
        action = np.ravel(agent.act(observation, explore=False))
        values = [values_of(observation, d) for d in range(agent.n_dimensions)]
        if has_policy:  # the most probable ones; greedy actions may lie between those of a box
            action = [agent.actions_of(d)[q.argmax()] for d, q in enumerate(values)]
        distances = [np.abs(agent.actions_of(d) - part) for d, part in enumerate(action)]
        chosen.append([of_actions.argmin().item() for of_actions in distances])
        tied.append([set(np.flatnonzero(q >= q.max() - tolerance).tolist()) for q in values])
    return Expected(kind, given, tied, chosen)


def all_expected(name, agent):
    """Return what is expected for observations in double and single precision and fixed point."""
    values = observations_of(agent, N_STATES)
    if name == "pairs":  # angles, whose bins differ right beside bounds
        values = np.random.default_rng(0).uniform(-1.2, 1.2, values.shape)
    doubles, floats, fixed = np.split(values, [N_STATES // 3, N_STATES // 3 * 2])
    floats = floats.astype(np.float32)
    scale = 2.0 ** c_header(agent, "policy").fraction_bits
    fixed = np.round(fixed * scale).astype(np.int32)
    return [
        expected_of(agent, "double", doubles, doubles),
        expected_of(agent, "float", floats, floats.astype(np.float64)),
        expected_of(agent, "fixed", fixed, fixed / scale),
    ]


def lies_between(agent):
    """Return whether greedy actions of the agent lie between those that it learns."""
    return isinstance(agent, SDNNActorCritic) and isinstance(agent.action_space, gym.spaces.Box)


def place_of(actions, action):
    """Return the fractional index of an action among evenly spaced ones, times 2^16."""
    share = (float(action) - actions[0]) / (actions[-1] - actions[0])
    return round(share * (len(actions) - 1) * 2**16)


def check_actions(agent, expected, actions):
    """Check that each action is the agent's, or one of the tied actions among which it draws."""
    n_certain = 0
    draws = getattr(agent.learning, "tie_rule", "uniform") == "uniform"
    for all_tied, all_chosen, vector in zip(expected.tied, expected.chosen, actions, strict=True):
        for tied, chosen, action in zip(all_tied, all_chosen, vector, strict=True):
            assert action in tied
            if len(tied) == 1 or not draws:
                assert action == chosen
                n_certain += 1
    assert n_certain > len(actions) / 4
    assert len({tuple(action) for action in actions}) > 1


POLICY = """
#include "declarations.h"
#include "policy.h"
uint32_t policy_n_observed(void) { return POLICY_N_OBSERVED; }
uint32_t policy_n_dimensions(void) { return POLICY_N_DIMENSIONS; }
void policy_fixed(const int32_t *x, uint32_t *a) { FIXED; }
#ifdef POLICY_USE_FLOAT
void policy_double(const double *x, uint32_t *a) { DOUBLE; }
void policy_float(const float *x, uint32_t *a) { FLOAT; }
#endif
"""

DECLARATIONS = """
#include <stdint.h>
uint32_t policy_n_observed(void);
uint32_t policy_n_dimensions(void);
void policy_fixed(const int32_t *x, uint32_t *a);
void policy_double(const double *x, uint32_t *a);
void policy_float(const float *x, uint32_t *a);
"""

DRIVER = """
#include <stdio.h>
#include <string.h>
#include "declarations.h"
#define RUN(type, act) \\
  { type x[64]; \\
    while (fread(x, sizeof *x, policy_n_observed(), stdin) == policy_n_observed()) { \\
      act(x, action); \\
      fwrite(action, sizeof *action, policy_n_dimensions(), stdout); } }
int main(int argc, char **argv) {
  uint32_t action[64];
  if (argc != 2) return 2;
  if (!strcmp(argv[1], "fixed")) RUN(int32_t, policy_fixed)
  if (!strcmp(argv[1], "double")) RUN(double, policy_double)
  if (!strcmp(argv[1], "float")) RUN(float, policy_float)
  return 0;
}
"""


def write_policy(folder, agent, *, floats=True, **options):
    """Write the header and a source file that makes its functions callable from others."""
    header = export_c_header(agent, folder / "policy.h", **options)
    definitions = {
        "FIXED": store_action(agent, "policy_greedy", "x", "a"),
        "DOUBLE": store_action(agent, "policy_greedy_double", "x", "a"),
        "FLOAT": store_action(agent, "policy_greedy_float", "x", "a"),
    }
    if floats:
        definitions["POLICY_USE_FLOAT"] = ""
    (folder / "policy.c").write_text(macros(**definitions) + POLICY)
    (folder / "declarations.h").write_text(DECLARATIONS)
    (folder / "driver.c").write_text(DRIVER)
    return header


def compile_policy(folder, target, *options):
    """Compile the policy without a C library; return its object file."""
    object_file = folder / "policy.o"
    all_options = (*STRICT, *ALONE, *target.options, *options)
    run(target.compiler, *all_options, "-c", folder / "policy.c", "-o", object_file)
    return object_file


def build(folder, target):
    """Compile the program that answers observations with actions; return its command."""
    return target.compile(folder / "driver.c", "-O1", compile_policy(folder, target, "-O2"))


def actions_of(command, kind, observations, n_dimensions):
    raw = run(*command, kind, input=np.ascontiguousarray(observations).tobytes())
    return np.frombuffer(raw, "<u4").reshape(-1, n_dimensions).tolist()


@functools.cache
def expectations(name):
    """Return what is expected of an agent, computed once for all targets."""
    return all_expected(name, agents()[name])


def check_all_actions(name, target, folder):
    """Check that a policy, compiled for and run on the target, acts as its agent."""
    agent = agents()[name]
    write_policy(folder, agent)
    command = build(folder, target)
    for expected in expectations(name):
        actions = actions_of(command, expected.kind, expected.given, agent.n_dimensions)
        check_actions(agent, expected, actions)


def check_symbols(target, folder):
    """Check a policy that reads symbols as a number for each value, which are one and zeros."""
    agent = symbols_agent()
    header = write_policy(folder, agent)
    command = build(folder, target)
    agent.observation_space.seed(3)
    observations = [agent.observation_space.sample() for _ in range(1000)]
    flat = np.array([agent.flat_observation(observation) for observation in observations])
    for kind, given in (
        ("double", flat),
        ("float", flat.astype(np.float32)),
        ("fixed", np.round(flat * 2.0**header.fraction_bits).astype(np.int32)),
    ):
        expected = expected_of(agent, kind, given, observations)
        check_actions(agent, expected, actions_of(command, kind, given, 1))
    assert "input 2: which of observation[4] to observation[7] is 1" in header.text


def check_integer_path(name, target, folder):
    """Check that the integer policy needs no library, no floating point and no static memory."""
    agent = agents()[name]
    write_policy(folder, agent, floats=False)
    options = {
        "aarch64-linux-gnu-gcc": ["-mgeneral-regs-only"],
        "arm-linux-gnueabihf-gcc": ["-mcpu=cortex-m4", "-mfloat-abi=soft"],
    }.get(target.compiler, ["-mno-sse", "-mno-80387"])
    object_file = compile_policy(folder, target, "-O2", *options)
    assert run(target.prefix + "nm", "-u", object_file) == b""
    sections = run(target.prefix + "objdump", "-h", object_file).decode()
    # Lines of sections: number, name, size in hexadecimal digits, ...
    lines = [line.split() for line in sections.splitlines()]
    sizes = {line[1]: int(line[2], 16) for line in lines if len(line) > 3 and line[0].isdigit()}
    assert sizes.get(".data", 0) == sizes.get(".bss", 0) == 0
