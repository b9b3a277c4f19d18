"""The C header of a policy, compiled for several processors, against the agent it is of."""

import doctest
import functools
import importlib
import itertools
import math
import shutil
import subprocess
from dataclasses import dataclass, replace
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from sdnn.agents import (
    PRESETS,
    FuzzyQLearning,
    RBFQLearning,
    SDNNQLearning,
    Transition,
)
from sdnn.approximators import SDNNCConfig
from sdnn.coding import RandomInverse
from sdnn.export import c_header, export_c_header

Box, Discrete = gym.spaces.Box, gym.spaces.Discrete
STRICT = ("-std=c99", "-pedantic", "-Wall", "-Wextra", "-Wconversion", "-Wshadow", "-Werror")
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


TARGETS = {
    "x86-64": Target("gcc"),
    "clang": Target("clang"),
    "aarch64": Target("aarch64-linux-gnu-gcc", "qemu-aarch64", (), "aarch64-linux-gnu-"),
    "arm": Target("arm-linux-gnueabihf-gcc", "qemu-arm", ("-mthumb",), "arm-linux-gnueabihf-"),
}


@pytest.fixture(scope="module")
def needs(skip_unless_ci):
    """Skips where a tool is missing."""

    def _needs(*tools):
        for tool in tools:
            if shutil.which(tool) is None:
                skip_unless_ci(f"needs {tool}")

    return _needs


@pytest.fixture(params=TARGETS)
def target(request, needs):
    found = TARGETS[request.param]
    needs(*filter(None, (found.compiler, found.runner)))
    return found


def run(*command, **options):
    done = subprocess.run([str(word) for word in command], capture_output=True, **options)
    assert done.returncode == 0, done.stderr.decode()
    return done.stdout


# Agents of all kinds.


def learned(agent, n_steps=300, seed=1):
    """The agent after some random transitions."""
    random = np.random.default_rng(seed)
    space = agent.observation_space
    low, high = np.maximum(space.low, -5.0), np.minimum(space.high, 5.0)
    agent.action_space.seed(seed)
    agent.begin_episode()
    observation = random.uniform(low, high)
    for _ in range(n_steps):
        following = random.uniform(low, high)
        reward = float(np.sin(observation.sum()) + random.normal())
        action = agent.action_space.sample()
        agent.learn(Transition(observation, action, reward, following, bool(random.random() < 0.1)))
        observation = following
    return agent


def learning(**changes):
    return replace(PRESETS["general"].learning, **changes)


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
    """One variable, which is two inputs, all windows, and a range of values given."""
    approximator = replace(SMALL, n_actions=0, u_low=3, q_low=-0.3, q_high=0.1)
    own = learning(tie_rule="lowest", value_range="given")
    return SDNNQLearning(box(3.0), box(1.0), approximator=approximator, learning=own, seed=5)


def tables_agent():
    """Codes of its own, wide patterns, and weights of more than a byte."""
    tables = [RandomInverse(n_bins=n, n_flipped=9).patterns(300, seed=n) for n in (40, 7)]
    agent = SDNNQLearning(
        box(1.0, 1.0), box(2.0), approximator=replace(SMALL, n_pattern_units=300),
        learning=learning(tie_rule="middle"), tables=tables, seed=6,
    )  # fmt: skip
    for step in range(800):
        where = [0.9, -0.9]
        agent.learn(Transition(where, [[2.0], [-2.0]][step % 2], step % 4 // 2, where, True))
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
        seen, action = space.sample(), agent.action_space.sample()
        reward = float(np.sin(2.0 * seen[0] + seen[1][0] + seen[2]) + random.normal())
        agent.learn(Transition(seen, action, reward, space.sample(), True))
    return agent


def partners_agent():
    """Five variables, of which each is paired with two, in another way in each dimension."""
    return SDNNQLearning(
        box(1.0, 2.0, 3.0, 4.0, 5.0), box(1.0, 2.0), approximator=replace(SMALL, max_pairs=10),
        learning=learning(tie_rule="lowest"), seed=8,
    )  # fmt: skip


AGENTS = {
    "discrete": discrete_agent,
    "partners": partners_agent,
    "circular": circular_agent,
    "several": several_agent,
    "pairs": pairs_agent,
    "lone": lone_agent,
    "tables": tables_agent,
}


@pytest.fixture(scope="module")
def agents():
    return {name: learned(make()) for name, make in AGENTS.items()}


def observations_of(agent, n, seed=0):
    """Random ones, some outside the ranges, many where a bin begins or next to it."""
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
    """What is asked, and in each dimension the actions that tie and the agent's own."""

    kind: str
    given: np.ndarray
    tied: list[list[set[int]]]
    chosen: list[list[int]]


def expected_of(agent, kind, given, observations):
    tied, chosen = [], []
    tolerance = agent.learning.tie_tolerance
    for observation in observations:
        action = np.ravel(agent.act(observation, explore=False))
        chosen.append(
            [np.abs(agent.actions_of(d) - one).argmin().item() for d, one in enumerate(action)]
        )
        values = [agent.q_values(observation, d) for d in range(agent.n_dimensions)]
        tied.append([set(np.flatnonzero(q >= q.max() - tolerance).tolist()) for q in values])
    return Expected(kind, given, tied, chosen)


def all_expected(name, agent):
    """10,000 observations, in double and single precision and in fixed point."""
    values = observations_of(agent, N_STATES)
    if name == "pairs":  # whose bins differ right beside bounds: tested below
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


def check_actions(agent, expected, actions):
    """Each one the agent's, or one of those among which it draws."""
    n_unique = 0
    for tied, chosen, came in zip(expected.tied, expected.chosen, actions, strict=True):
        for among, own, action in zip(tied, chosen, came, strict=True):
            assert action in among
            if len(among) == 1 or agent.learning.tie_rule != "uniform":
                assert action == own
                n_unique += 1
    assert n_unique > len(actions) / 4
    assert len({tuple(action) for action in actions}) > 1


POLICY = """
#include "declarations.h"
{define}
#include "policy.h"
uint32_t policy_n_observed(void) {{ return POLICY_N_OBSERVED; }}
uint32_t policy_n_dimensions(void) {{ return POLICY_N_DIMENSIONS; }}
void policy_fixed(const int32_t *x, uint32_t *a) {{ {fixed} }}
#ifdef POLICY_USE_FLOAT
void policy_double(const double *x, uint32_t *a) {{ {double} }}
void policy_float(const float *x, uint32_t *a) {{ {float} }}
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
    """The header, and a source file that makes its functions callable from others."""
    header = export_c_header(agent, folder / "policy.h", **options)
    one = agent.n_dimensions == 1
    calls = {
        kind: f"a[0] = policy_act_{kind}(x);" if one else f"policy_act_{kind}(x, a);"
        for kind in ("fixed", "double", "float")
    }
    define = "#define POLICY_USE_FLOAT" if floats else ""
    (folder / "policy.c").write_text(POLICY.format(define=define, **calls))
    (folder / "declarations.h").write_text(DECLARATIONS)
    (folder / "driver.c").write_text(DRIVER)
    return header


def compile_policy(folder, target, *options):
    """The policy's object, compiled on its own, without a C library."""
    done = folder / "policy.o"
    alone = (*STRICT, *ALONE, *target.options, *options)
    run(target.compiler, *alone, "-c", folder / "policy.c", "-o", done)
    return done


def build(folder, target):
    """The program that answers observations with actions, as a command."""
    program = folder / "program"
    run(
        # Static: an emulated program finds no shared libraries.
        target.compiler, "-O1", *target.options, "-static", folder / "driver.c",
        compile_policy(folder, target, "-O2"), "-o", program,
    )  # fmt: skip
    return [target.runner, program] if target.runner else [program]


def actions_of(command, kind, observations, n_dimensions):
    raw = run(*command, kind, input=np.ascontiguousarray(observations).tobytes())
    return np.frombuffer(raw, "<u4").reshape(-1, n_dimensions).tolist()


@pytest.fixture(scope="module")
def expectations(agents):
    """What the agents do, asked once for all targets."""
    return functools.cache(lambda name: all_expected(name, agents[name]))


@pytest.mark.parametrize("kind", AGENTS)
def test_the_actions_are_the_agents(kind, agents, expectations, target, tmp_path):
    agent = agents[kind]
    write_policy(tmp_path, agent)
    command = build(tmp_path, target)
    for expected in expectations(kind):
        came = actions_of(command, expected.kind, expected.given, agent.n_dimensions)
        check_actions(agent, expected, came)


def test_symbols_are_told_by_readings_of_one_and_zero(target, tmp_path):
    agent = symbols_agent()
    header = write_policy(tmp_path, agent)
    command = build(tmp_path, target)
    agent.observation_space.seed(3)
    seen = [agent.observation_space.sample() for _ in range(1000)]
    told = np.array([agent.flat_observation(one) for one in seen])
    for kind, given in (
        ("double", told),
        ("float", told.astype(np.float32)),
        ("fixed", np.round(told * 2.0**header.fraction_bits).astype(np.int32)),
    ):
        check_actions(
            agent, expected_of(agent, kind, given, seen), actions_of(command, kind, given, 1)
        )
    assert "input 2: which of observation[4] to observation[7] is 1" in header.text


def test_the_angle_of_a_pair_is_in_the_agents_bin(agents, needs, tmp_path):
    """At every bound, a 2^-28th of a radian before and after it."""
    needs("gcc")
    agent = agents["pairs"]
    header = c_header(agent, "policy")
    n_bins = 5 * 9
    bounds = -np.pi + 2 * np.pi * np.arange(1, n_bins) / n_bins
    source = """
        #define POLICY_USE_FLOAT
        #include "policy.h"
        #include <stdio.h>
        int main(void) {
          double x[3]; int32_t y[3]; uint32_t bins[POLICY_N_INPUTS]; int i;
          while (scanf("%lf %lf", &x[0], &x[1]) == 2) {
            x[2] = 0; for (i = 0; i < 3; ++i) y[i] = (int32_t)(x[i] * 1073741824.0);
            policy_bins_of_double(x, bins); printf("%d ", (int)bins[0]);
            policy_bins_of_fixed(y, bins); printf("%d\\n", (int)bins[0]);
          }
          return 0;
        }
    """
    angles = np.concatenate([bounds - 2.0**-28, bounds + 2.0**-28])
    points = np.column_stack([np.cos(angles), np.sin(angles)]).tolist()
    points += [(1, 0), (0, 1), (-1, 0), (0, -1), (0, 0), (1.5, 1.5), (-0.5, 0.5)]
    (tmp_path / "policy.h").write_text(header.text)
    (tmp_path / "bins.c").write_text(source)
    run("gcc", "-std=c99", tmp_path / "bins.c", "-o", tmp_path / "bins")
    text = "".join(f"{c!r} {s!r}\n" for c, s in points)
    found = np.array(run(tmp_path / "bins", input=text.encode()).split(), int).reshape(-1, 2)
    unit = [agent._controller.state_of([c, s, 0.0])[0] for c, s in points]
    expected = np.minimum((np.array(unit) * n_bins).astype(int), n_bins - 1)
    assert expected[: bounds.size].tolist() == list(range(n_bins - 1))
    np.testing.assert_array_equal(found, np.column_stack([expected, expected]))


def test_what_the_library_refuses_is_defined(agents, needs, tmp_path):
    """NaN is the lowest; an angle of NaN or infinity is 0. Conversions of NaN would be caught."""
    needs("clang")
    for name, agent in (("pairs", agents["pairs"]), ("symbols", symbols_agent())):
        (tmp_path / f"{name}.h").write_text(c_header(agent, name).text)
    source = """
        #define PAIRS_USE_FLOAT
        #define SYMBOLS_USE_FLOAT
        #include "pairs.h"
        #include "symbols.h"
        #include <stdio.h>
        int main(void) {
          double x[3] = {0, 0, 0}, y[8] = {0}; uint32_t bins[SYMBOLS_N_INPUTS];
          while (scanf("%lf %lf %lf", &y[0], &y[1], &y[2]) == 3) {
            x[0] = y[0]; x[1] = y[1]; x[2] = y[2];
            pairs_bins_of_double(x, bins); printf("%d %d ", (int)bins[0], (int)bins[1]);
            symbols_bins_of_double(y, bins); printf("%d\\n", (int)bins[0]);
          }
          return 0;
        }
    """
    (tmp_path / "bins.c").write_text(source + "\n")
    caught = ("-fsanitize=undefined,float-cast-overflow", "-fno-sanitize-recover=all")
    run("clang", *STRICT, *caught, tmp_path / "bins.c", "-o", tmp_path / "bins")
    numbers = [math.nan, math.inf, -math.inf, 0.5]
    points = list(itertools.product(numbers, repeat=3))
    text = "".join(f"{x} {y} {z}\n" for x, y, z in points)
    found = np.array(run(tmp_path / "bins", input=text.encode()).split(), int).reshape(-1, 3)
    for (x, y, z), (angle, speed, symbol) in zip(points, found.tolist(), strict=True):
        finite = math.isfinite(x) and math.isfinite(y)
        assert angle == (5 * 9 * 5 // 8 if finite else 5 * 9 // 2)  # an eighth of a turn beyond 0
        assert speed == {-math.inf: 0, 0.5: 5 * 9 * 8.5 // 16, math.inf: 44}.get(z, 0)
        known = [number for number in (x, y, z) if not math.isnan(number)]
        assert not known or (x, y, z)[symbol] == max(known)


def test_the_integer_path_needs_no_library_and_no_floating_point(agents, target, tmp_path):
    for number, agent in enumerate(agents.values()):
        folder = tmp_path / str(number)
        folder.mkdir()
        write_policy(folder, agent, floats=False)
        options = {
            "aarch64-linux-gnu-gcc": ["-mgeneral-regs-only"],
            "arm-linux-gnueabihf-gcc": ["-mcpu=cortex-m4", "-mfloat-abi=soft"],
        }.get(target.compiler, ["-mno-sse", "-mno-80387"])
        done = compile_policy(folder, target, "-O2", *options)
        assert run(target.prefix + "nm", "-u", done) == b""
        sections = run(target.prefix + "objdump", "-h", done).decode()
        sizes = {
            words[1]: int(words[2], 16)
            for words in map(str.split, sections.splitlines())
            if len(words) > 3 and words[0].isdigit()
        }
        assert sizes.get(".data", 0) == sizes.get(".bss", 0) == 0


def test_flash_and_ram_are_as_the_header_says(agents, needs, tmp_path):
    target = TARGETS["arm"]
    needs(target.compiler)
    for number, agent in enumerate(agents.values()):
        folder = tmp_path / str(number)
        folder.mkdir()
        header = write_policy(folder, agent, floats=False)
        options = ("-Os", "-mcpu=cortex-m4", "-mfloat-abi=soft", "-fstack-usage")
        done = compile_policy(folder, target, *options)
        lines = run(target.prefix + "size", "-A", done).decode().splitlines()
        sizes = {w[0]: int(w[1]) for w in map(str.split, lines) if len(w) == 3 and w[0][0] == "."}
        constants = sum(n for name, n in sizes.items() if name.startswith((".rodata", ".data.rel")))
        # Tables of what nobody calls (actions, say) are not in the object.
        assert header.flash_bytes - 512 < constants < header.flash_bytes + 128
        assert 600 < sizes[".text"] < 2048
        usage = (folder / "policy.su").read_text().splitlines()
        stack = sum(int(line.split("\t")[1]) for line in usage)
        assert header.ram_bytes < stack < header.ram_bytes + 256
        assert f"{header.flash_bytes:,} bytes of constants" in header.text
        assert f"{header.ram_bytes:,} bytes of arrays on the stack" in header.text


def test_two_headers_share_a_program_and_cpp_takes_them(agents, needs, tmp_path):
    needs("gcc", "g++", "clang++")
    export_c_header(agents["discrete"], tmp_path / "left.h")
    export_c_header(agents["pairs"], tmp_path / "right.h", name="right_2")
    source = """
        #define LEFT_USE_FLOAT
        #define RIGHT_2_USE_FLOAT
        #include "left.h"
        #include "right.h"
        #include "left.h"
        #include <stdio.h>
        int main(void) {
          const int32_t x[LEFT_N_OBSERVED] = {65536, -65536, 20000, 3000};
          const float y[RIGHT_2_N_OBSERVED] = {0.6f, -0.8f, 2.0f};
          uint32_t action[RIGHT_2_N_DIMENSIONS];
          right_2_act_float(y, action);
          printf("%d", (int)(left_first_action[0] + (int32_t)left_act_fixed(x)));
          printf(" %.9g %.9g", (double)right_2_action_float[0][action[0]],
                 right_2_action_fixed[1][action[1]] / 65536.0);
          return 0;
        }
    """
    left = agents["discrete"].act([1.0, -1.0, 20000 / 65536, 3000 / 65536], explore=False)
    right = agents["pairs"].act(np.float32([0.6, -0.8, 2.0]), explore=False)
    for compiler, options, ending in (
        ("gcc", STRICT, "c"),
        ("g++", ("-std=c++11", "-Wall", "-Wextra", "-Wconversion", "-Werror"), "cpp"),
        ("clang++", ("-std=c++11", "-Wall", "-Wextra", "-Wconversion", "-Werror"), "cpp"),
    ):
        (tmp_path / f"both.{ending}").write_text(source)
        run(compiler, *options, tmp_path / f"both.{ending}", "-o", tmp_path / "both")
        said = [float(word) for word in run(tmp_path / "both").split()]
        assert said == [left, right[0], right[1]]


def balance(agent, scale):
    """What docs/examples/c/main.c does, with the agent itself."""
    x, v, a, w = 0.01, -0.02, 0.03, 0.0
    for step in range(500):
        if abs(x) > 2.4 or abs(a) > 12.0 / 180.0 * 3.141592653589793:
            return step
        observation = np.round(np.array([x, v, a, w]) * scale) / scale
        force = 10.0 if agent.act(observation, explore=False) == 1 else -10.0
        sine, cosine = math.sin(a), math.cos(a)
        pull = (force + 0.05 * w * w * sine) / 1.1
        bend = 9.8 * sine - cosine * pull
        bend /= 0.5 * (4.0 / 3.0 - 0.1 * cosine * cosine / 1.1)
        x, v = x + 0.02 * v, v + 0.02 * (pull - 0.05 * bend * cosine / 1.1)
        a, w = a + 0.02 * w, w + 0.02 * bend
    return 500


def test_the_example_balances_as_the_agent_does(needs, tmp_path):
    needs("gcc")
    env = gym.make("CartPole-v1")
    agent = SDNNQLearning(
        env.observation_space,
        env.action_space,
        approximator=replace(PRESETS["small"].approximator, n_pattern_units=40),
        learning=learning(tie_rule="middle"),
        seed=1,
    )
    agent.train(env, steps=6000)
    header = export_c_header(agent, tmp_path / "cartpole.h")
    main = Path(__file__).parents[3] / "docs" / "examples" / "c" / "main.c"
    options = (*STRICT, "-O2", "-I", tmp_path)
    run("gcc", *options, main, "-o", tmp_path / "main", "-lm")
    n_steps = int(run(tmp_path / "main"))
    assert n_steps == balance(agent, 2.0**header.fraction_bits)
    assert n_steps > 40  # at random it falls after 20


def test_docstrings():
    result = doctest.testmod(importlib.import_module("sdnn.export.header"))
    assert result.failed == 0
    assert result.attempted > 0


def test_values_of_actions_are_those_of_act():
    agent = lone_agent()
    header = c_header(agent, "one", fraction_bits=8)
    agent_values = agent.actions.astype(np.float32)
    table = header.text.split("one_action_float[41] = {")[1].split("}")[0]
    values = [np.float32(word.strip().rstrip("f")) for word in table.split(",") if word.strip()]
    np.testing.assert_array_equal(values, agent_values)
    table = header.text.split("one_action_fixed[41] = {")[1].split("}")[0]
    fixed = [int(word) for word in table.split(",") if word.strip()]
    assert fixed == np.round(agent_values.astype(float) * 256).astype(int).tolist()


def test_hidden_units_in_no_window_are_left_out():
    agent = discrete_agent()
    header = c_header(agent, "policy")
    assert "40 hidden units in use" in header.text
    n_columns = 4 * 3 * 24
    weights = agent.core.action_value.weights()[np.r_[:20, 40:60]]
    n_bits = np.ceil(np.log2(np.ptp(weights, axis=1) + 1)).sum()
    assert header.weight_bytes == n_bits * n_columns / 8
    assert header.n_words == header.weight_bytes / 4


def test_the_same_agent_gives_the_same_header(agents):
    agent = agents["several"]
    first = c_header(agent, "policy")
    agent.act([0.1, 0.2])
    assert c_header(agent, "policy") == first


def test_numbers_of_fixed_point_fit_32_bits():
    wide = SDNNQLearning(box(1e5, 1.0), Discrete(2), approximator=SMALL)
    assert c_header(wide, "policy").fraction_bits == 14
    assert c_header(wide, "policy", fraction_bits=3).fraction_bits == 3
    with pytest.raises(ValueError, match=r"fraction_bits must be at most 14, .* got 15"):
        c_header(wide, "policy", fraction_bits=15)
    encoder = SDNNQLearning(box(1e5, 1.0), Discrete(2), angles=[0], approximator=SMALL)
    assert c_header(encoder, "policy").fraction_bits == 14
    strong = SDNNQLearning(box(1.0, 1.0), box(40000.0), approximator=SMALL)
    assert c_header(strong, "policy").fraction_bits == 15
    huge = SDNNQLearning(box(1e10, 1.0), Discrete(2), approximator=SMALL)
    with pytest.raises(ValueError, match=r"ranges and actions must be below 2\^31.*got 1e\+10"):
        c_header(huge, "policy")
    far = SDNNQLearning(box(1.0, 1.0), Discrete(2, start=2**40), approximator=SMALL)
    with pytest.raises(ValueError, match="actions must begin within 32 bits"):
        c_header(far, "policy")
    for bad in (-1, 31, 1.5, True, "16"):
        with pytest.raises(ValueError, match="fraction_bits must be a whole number in"):
            c_header(wide, "policy", fraction_bits=bad)


@pytest.mark.parametrize(
    "name", ["", "2nd", "a-b", "_a", "a__b", "a_", "a b", "é", "x" * 41, "a;", "a\n", None, 3]
)
def test_names_that_are_none_in_c_are_refused(name):
    with pytest.raises(ValueError, match="name must be a C identifier"):
        c_header(lone_agent(), name)


def test_the_file_is_whole_or_not_there(tmp_path):
    agent = lone_agent()
    header = export_c_header(agent, tmp_path / "one.h")
    assert (tmp_path / "one.h").read_text() == header.text
    assert header.name == "one"
    with pytest.raises(ValueError, match="name must be a C identifier"):
        export_c_header(agent, tmp_path / "not one.h")
    with pytest.raises(OSError, match="nowhere"):
        export_c_header(agent, tmp_path / "nowhere" / "one.h")
    assert [path.name for path in tmp_path.iterdir()] == ["one.h"]


def test_what_cannot_be_exported_is_refused():
    for kind in (RBFQLearning, FuzzyQLearning):
        agent = kind(box(1.0, 1.0), box(1.0))
        with pytest.raises(TypeError, match=f"agent must be an SDNNQLearning.*got {kind.__name__}"):
            c_header(agent, "policy")
    unknown = SDNNQLearning(box(np.inf, 1.0), Discrete(2), approximator=SMALL)
    with pytest.raises(RuntimeError, match="still warming up"):
        c_header(unknown, "policy")
    large = replace(SMALL, n_hidden_units=70000, n_pattern_units=2)
    with pytest.raises(ValueError, match=r"n_hidden_units must be at most 65535 .* got 70000"):
        c_header(SDNNQLearning(box(1.0, 1.0), Discrete(2), approximator=large), "policy")
