"""Exported C headers of policies, compiled for this processor and compared with the agent.

``nox -s emulation`` has other compilers and processors.
"""

import itertools
import math
from dataclasses import replace
from pathlib import Path

import gymnasium as gym
import numpy as np
import pytest

from c_policies import (
    AGENTS,
    SMALL,
    STRICT,
    STRICT_CPP,
    agents,
    box,
    check_all_actions,
    check_integer_path,
    check_symbols,
    discrete_agent,
    learned,
    learning,
    lone_agent,
    observations_of,
    place_of,
    program,
    run,
    symbols_agent,
)
from refusals import refuses
from sdnn.agents import (
    FuzzyQLearning,
    QLambdaConfig,
    RBFQLearning,
    SDNNActorCritic,
    SDNNQLambda,
    SDNNQLearning,
    Transition,
    load_agent,
)
from sdnn.export import c_header, export_c_header
from sdnn.export.text import weight_words

Discrete = gym.spaces.Discrete


@pytest.mark.parametrize("name", AGENTS)
def test_actions_of_the_c_header_are_those_of_the_agent(name, target, tmp_path):
    # A compiled program answers observations in fixed point, double and float; its actions must be
    # the greedy ones of the Python agent.
    check_all_actions(name, target, tmp_path)


@pytest.mark.parametrize(
    ("reward", "tie_tolerance", "expected"),
    [(1.0, 0.25, 2**21), (1.0, 2.0**-24, 0), (1e-30, 0.0, 0), (1e-30, 1.0, 2**62)],
)
def test_tie_tolerance_is_exported_in_integer_units_of_values(reward, tie_tolerance, expected):
    # The value 1 is a sum of two weights of 23 bits: its unit is 2^-23, and 0.25 is 2^21 units. A
    # tolerance of half a unit is rounded down to 0, and 2^62 is the most: in the unit of values of
    # 1e-30, a tolerance of 1 would be above 2^120.
    rule = QLambdaConfig(tie_rule="lowest", tie_tolerance=tie_tolerance)
    agent = SDNNQLambda(Discrete(2), Discrete(2), learning=rule)
    agent.learn(Transition(0, 1, reward, 1, terminated=True))
    assert f"#define POLICY_TIE_TOLERANCE INT64_C({expected})\n" in c_header(agent, "policy").text


@pytest.mark.parametrize("name", ["actor", "lone-actor"])
def test_greedy_actions_between_those_of_a_box_are_those_of_the_agent(name, target, tmp_path):
    lone = SDNNActorCritic(box(1.0, 2.0), box(2.0), seed=3)
    agent = agents()["actor"] if name == "actor" else learned(lone)
    n = agent.n_dimensions
    header = export_c_header(agent, tmp_path / "policy.h")
    call = "place[0] = policy_place(x)" if n == 1 else "policy_place(x, place)"
    source = f"""
        #include "policy.h"
        #include <stdio.h>
        int main(void) {{
          int32_t x[POLICY_N_OBSERVED], action; uint32_t place[POLICY_N_DIMENSIONS], d;
          while (fread(x, sizeof *x, POLICY_N_OBSERVED, stdin) == POLICY_N_OBSERVED) {{
            {call};
            for (d = 0; d < POLICY_N_DIMENSIONS; ++d) {{
              action = policy_action_at(d, place[d]);
              fwrite(&place[d], sizeof *place, 1, stdout);
              fwrite(&action, sizeof action, 1, stdout);
            }}
          }}
          return 0;
        }}
    """
    executable = program(tmp_path, source, target.compiler, *STRICT)
    scale = 2.0**header.fraction_bits
    fixed = np.round(observations_of(agent, 300) * scale).astype("<i4")
    written = np.frombuffer(run(executable, input=fixed.tobytes()), "<i4").reshape(-1, n, 2)
    expected = np.array([agent.act(x / scale, explore=False) for x in fixed], float)
    places = [
        [place_of(agent.actions_of(d), number) for d, number in enumerate(action)]
        for action in expected
    ]
    assert written[..., 0].tolist() == places
    np.testing.assert_allclose(written[..., 1] / scale, expected, atol=1.0 / scale)


def test_discrete_observations_are_exported_as_one_hot_inputs(target, tmp_path):
    # A program receives 1,000 observations as 0s and 1s, and must answer as the Python agent.
    check_symbols(target, tmp_path)


@pytest.mark.parametrize("name", ["pairs", "several"])
def test_the_integer_path_needs_no_library_and_no_floating_point(name, target, needs, tmp_path):
    needs("nm", "objdump")
    # It is compiled without floating-point instructions, and its object file is disassembled.
    check_integer_path(name, target, tmp_path)


def test_angles_have_the_bins_of_the_agent_at_every_boundary(needs, tmp_path):
    # At every bound, 2^-28 radians before and after it.
    needs("gcc")
    agent = agents()["pairs"]
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
    bins = program(tmp_path, source, "gcc", "-std=c99")
    text = "".join(f"{c!r} {s!r}\n" for c, s in points)
    bins_in_c = np.array(run(bins, input=text.encode()).split(), int).reshape(-1, 2)
    unit = [agent._controller.state_of([c, s, 0.0])[0] for c, s in points]
    expected = np.minimum((np.array(unit) * n_bins).astype(int), n_bins - 1)
    assert expected[: bounds.size].tolist() == list(range(n_bins - 1))
    np.testing.assert_array_equal(bins_in_c, np.column_stack([expected, expected]))


def test_nan_and_infinity_have_defined_bins(needs, tmp_path):
    # NaN counts as the lowest value, an angle of NaN or infinity as 0. The sanitizer would report
    # conversions of NaN. Inputs of "pairs" are the angle of (x, y) = (cosine, sine) and a speed in
    # -8 to 8, with 5 * 9 = 45 bins each.
    caught = ("-fsanitize=undefined,float-cast-overflow", "-fno-sanitize-recover=all")
    needs("clang", options=caught)
    for name, agent in (("pairs", agents()["pairs"]), ("symbols", symbols_agent())):
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
    bins = program(tmp_path, source, "clang", *STRICT, *caught)
    numbers = [math.nan, math.inf, -math.inf, 0.5]
    points = list(itertools.product(numbers, repeat=3))
    text = "".join(f"{x} {y} {z}\n" for x, y, z in points)
    bins_in_c = np.array(run(bins, input=text.encode()).split(), int).reshape(-1, 3)
    for (x, y, z), (angle, speed, symbol) in zip(points, bins_in_c.tolist(), strict=True):
        finite = math.isfinite(x) and math.isfinite(y)
        # Angles begin at half a turn before 0: 0 is at 1/2 of the bins, (0.5, 0.5) at 1/2 + 1/8.
        assert angle == (45 * 5 // 8 if finite else 45 // 2)
        assert speed == {-math.inf: 0, 0.5: 45 * (0.5 + 8) // 16, math.inf: 44}.get(z, 0)
        known = [number for number in (x, y, z) if not math.isnan(number)]
        assert not known or (x, y, z)[symbol] == max(known)


def test_two_headers_compile_in_one_c_or_cpp_program(needs, tmp_path):
    needs("gcc", "g++", "clang++")
    export_c_header(agents()["discrete"], tmp_path / "left.h")
    export_c_header(agents()["pairs"], tmp_path / "right.h", name="right_2")
    source = """
        #define LEFT_USE_FLOAT
        #define RIGHT_2_USE_FLOAT
        #include "left.h"
        #include "right.h"
        #include "left.h"
        #include <stdio.h>
        int main(void) {
          const int32_t x[LEFT_N_OBSERVED] = {131072, -65536, 20000, 3000};
          const float y[RIGHT_2_N_OBSERVED] = {0.6f, -0.8f, 2.0f};
          uint32_t action[RIGHT_2_N_DIMENSIONS];
          right_2_greedy_float(y, action);
          printf("%d", (int)(left_first_action[0] + (int32_t)left_greedy(x)));
          printf(" %.9g %.9g", (double)right_2_action_float[0][action[0]],
                 right_2_action_fixed[1][action[1]] / 65536.0);
          return 0;
        }
    """
    left = agents()["discrete"].act([2.0, -1.0, 20000 / 65536, 3000 / 65536], explore=False)
    right = agents()["pairs"].act(np.float32([0.6, -0.8, 2.0]), explore=False)
    for compiler, options in (("gcc", STRICT), ("g++", STRICT_CPP), ("clang++", STRICT_CPP)):
        printed = [
            float(word) for word in run(program(tmp_path, source, compiler, *options)).split()
        ]
        assert printed == [left, right[0], right[1]]


def balance(agent, scale):
    """Do what docs/examples/c/main.c does, with the agent itself."""
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


def test_the_c_example_balances_as_long_as_the_agent(needs, tmp_path):
    needs("gcc")
    env = gym.make("CartPole-v1")
    agent = SDNNQLearning(
        env.observation_space,
        env.action_space,
        approximator=replace(SDNNQLearning.presets["small"].approximator, n_pattern_units=40),
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
    assert n_steps > 40, "with random actions it falls after about 20 steps"


def test_tables_of_actions_are_those_of_the_agent():
    agent = lone_agent()
    header = c_header(agent, "one", fraction_bits=8)
    agent_values = agent.actions.astype(np.float32)
    table = header.text.split("one_action_float[41] = {")[1].split("}")[0]
    values = [np.float32(word.strip().rstrip("f")) for word in table.split(",") if word.strip()]
    np.testing.assert_array_equal(values, agent_values)
    table = header.text.split("one_action_fixed[41] = {")[1].split("}")[0]
    fixed = [int(word) for word in table.split(",") if word.strip()]
    assert fixed == np.round(agent_values.astype(float) * 256).astype(int).tolist()


def test_hidden_units_outside_all_windows_are_not_exported():
    agent = discrete_agent()
    header = c_header(agent, "policy")
    # Windows of 20 of the 60 hidden units: those of the two actions lie at both ends.
    assert "40 hidden units in use" in header.text
    # A byte for each hidden unit and pattern unit of each ordered pair of four inputs.
    assert header.weight_bytes == 40 * (4 * 3) * SMALL.n_pattern_units


def test_weights_beyond_a_byte_take_two_bytes():
    weights = np.array([[127, -128, 5], [1, 2, 3], [0, 0, 0], [0, 0, 0], [128, -129, 16383]])
    words, n_bytes = weight_words(weights)
    assert n_bytes.tolist() == [1, 2]
    lanes = words.view(np.uint8).reshape(3, 3, 4).astype(int) - 128
    assert lanes[0].T.tolist() == weights[:4].tolist()
    assert (256 * lanes[1, :, 0] + lanes[2, :, 0]).tolist() == weights[4].tolist()


def test_acting_does_not_change_the_header():
    agent = agents()["several"]
    first = c_header(agent, "policy")
    agent.act([0.1, 0.2])
    assert c_header(agent, "policy") == first


def test_fraction_bits_are_reduced_until_numbers_fit_32_bits():
    # 1e5 needs 17 bits and a sign, so that 14 of 32 are left; 40000 needs 16, which leaves 15.
    wide = SDNNQLearning(box(1e5, 1.0), Discrete(2), approximator=SMALL)
    assert c_header(wide, "policy").fraction_bits == 14
    assert c_header(wide, "policy", fraction_bits=6).fraction_bits == 6
    refuses("fraction_bits", c_header, wide, "policy", fraction_bits=15)
    encoder = SDNNQLearning(box(1e5, 1.0), Discrete(2), angles=[0], approximator=SMALL)
    assert c_header(encoder, "policy").fraction_bits == 14
    strong = SDNNQLearning(box(1.0, 1.0), box(40000.0), approximator=SMALL)
    assert c_header(strong, "policy").fraction_bits == 15
    huge = SDNNQLearning(box(1e10, 1.0), Discrete(2), approximator=SMALL)
    refuses("1e+10", c_header, huge, "policy")
    far = SDNNQLearning(box(1.0, 1.0), Discrete(2, start=2**40), approximator=SMALL)
    refuses("actions", c_header, far, "policy")
    for bad in (-1, 31, 1.5, True, "16"):
        refuses("fraction_bits", c_header, wide, "policy", fraction_bits=bad)


@pytest.mark.parametrize(
    "name", ["", "2nd", "a-b", "_a", "a__b", "a_", "a b", "é", "x" * 41, "a;", "a\n", None, 3]
)
def test_names_that_are_no_c_identifiers_are_refused(name):
    refuses("name", c_header, lone_agent(), name)


def test_the_header_has_at_most_three_characters_per_byte_of_flash():
    agent = SDNNQLearning(box(1.0, 2.0, 3.0), Discrete(3), preset="small", seed=1)
    agent.networks[0].set_parameters(
        np.random.default_rng(1).integers(-50, 50, (900, 240)), np.zeros(900, np.int32)
    )
    header = c_header(agent, "policy")
    assert len(header.text) < 3 * header.flash_bytes


def test_an_export_writes_the_header_and_a_failed_one_nothing(tmp_path):
    agent = lone_agent()
    header = export_c_header(agent, tmp_path / "one.h")
    assert (tmp_path / "one.h").read_text() == header.text
    assert header.name == "one"
    refuses("name", export_c_header, agent, tmp_path / "not one.h")
    refuses("path", export_c_header, agent, tmp_path)
    refuses("nowhere", export_c_header, agent, tmp_path / "nowhere" / "one.h", error=OSError)
    assert [path.name for path in tmp_path.iterdir()] == ["one.h"]


def test_agents_of_other_types_sizes_or_unknown_ranges_are_refused():
    for agent_class in (RBFQLearning, FuzzyQLearning):
        agent = agent_class(box(1.0, 1.0), box(1.0))
        refuses("agent", c_header, agent, "policy", error=TypeError)
    unknown = SDNNQLearning(box(np.inf, 1.0), Discrete(2), approximator=SMALL)
    refuses("observation_range", c_header, unknown, "policy", error=RuntimeError)
    large = replace(SMALL, n_hidden_units=70000, n_pattern_units=2)
    refuses(
        "n_hidden_units",
        c_header,
        SDNNQLearning(box(1.0, 1.0), Discrete(2), approximator=large),
        "policy",
    )


def test_an_agent_that_has_learned_with_action_masks_is_refused(tmp_path):
    def untrained():
        return SDNNQLambda(Discrete(3), Discrete(2))

    acted, learned_next, greedy = untrained(), untrained(), untrained()
    acted.act(1, mask=[1, 0])
    learned_next.learn(Transition(0, 1, 1.0, 2, terminated=False, next_mask=[1, 0]))
    greedy.act(1, explore=False, mask=[1, 0])
    greedy.check(Transition(0, 1, 1.0, 2, terminated=False, next_mask=[1, 0]))
    with pytest.raises(ValueError, match="observation"):
        greedy.act(3, mask=[1, 0])
    for agent in (acted, learned_next):
        agent.save(tmp_path / "masked.safetensors")
        for masked in (agent, load_agent(tmp_path / "masked.safetensors")):
            refuses("agent", c_header, masked, "policy")
            refuses("agent", c_header, masked, "policy", learning=True)
    c_header(greedy, "policy")
