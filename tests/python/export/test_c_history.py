"""C headers of agents whose states include earlier observations, compiled for this processor.

The tests of learning headers have these agents too. ``nox -s emulation`` has other compilers and
processors.
"""

import math

import numpy as np
import pytest

from c_histories import (
    LEARNERS,
    POLICIES,
    SMALL,
    check_policy,
    differences,
    observer,
    policy,
    warmed_up,
)
from c_learners import build, run_agent, run_program
from c_policies import SANITIZED, STRICT, box, program, run
from refusals import refuses
from sdnn.agents import SDNNQLambda, SDNNQLearning
from sdnn.export import c_header, load_image, save_image


@pytest.mark.parametrize("kind", ["int32_t", "double", "float"])
@pytest.mark.parametrize("name", POLICIES)
def test_greedy_actions_with_a_history_are_those_of_the_agent(name, kind, target, tmp_path):
    # A compiled program and the Python agent act for the same observations of several episodes.
    check_policy(name, kind, target, tmp_path)


@pytest.mark.parametrize("name", LEARNERS)
def test_calls_in_any_order_continue_or_begin_the_episodes_of_the_agent(name, target, tmp_path):
    # Few observations, so that equal ones follow each other; steps of all kinds in any order. A
    # line is its kind (an episode begins, a step to learn, a greedy action, one that begins a
    # greedy episode), an observation, a reward, the next observation, and whether it is terminal.
    agent = LEARNERS[name]()
    header, command = build(tmp_path, agent, target, *SANITIZED)
    random = np.random.default_rng(1)
    high = np.asarray(agent.observation_space.high, float)
    readings = np.round(random.uniform(-1.5, 1.5, (4, high.size)) * high * 2**header.fraction_bits)
    lines = np.column_stack([
        random.choice([0, 1, 2, 3], 2000, p=[0.1, 0.5, 0.3, 0.1]),
        readings[random.integers(0, 4, 2000)],
        random.choice([0, 0, 1 << 16, 1 << 8, -(1 << 16), 2**31 - 1], 2000),
        readings[random.integers(0, 4, 2000)],
        random.random(2000) < 0.05,
    ]).astype("<i4")  # fmt: skip
    actions, image = run_program(command, save_image(agent), lines, agent.n_dimensions)
    assert actions == run_agent(agent, lines, header.fraction_bits)
    assert image == save_image(agent)


ELEMENTARY = """
#include "agent.h"
#include <stdio.h>
int main(void) {
  uint64_t x[2], y[6];
  while (fread(x, sizeof *x, 2, stdin) == 2) {
    y[0] = agent_floor(x[0]);
    y[1] = agent_nearest(x[0]);
    agent_sin_cos(x[1], &y[2], &y[3]);
    y[4] = agent_atan2(x[0], x[1]);
    y[5] = agent_with_digits(x[0], 24, -149);
    fwrite(y, sizeof *y, 6, stdout);
  }
  return 0;
}
"""


def test_elementary_functions_in_integers_are_those_of_floating_point(target, tmp_path):
    (tmp_path / "agent.h").write_text(c_header(observer(), "agent").text)
    elementary = program(tmp_path, ELEMENTARY, target.compiler, *STRICT, *SANITIZED)
    random = np.random.default_rng(1)
    sizes = 2.0 ** random.uniform(-40, 40, 20_000)
    numbers = random.choice([-1.0, 1.0], 20_000) * sizes
    numbers[:2000] = random.integers(-40, 40, 2000) / 4
    # The floor of x + 0.5 would round the first of these to 1 instead of 0.
    numbers[2000:2004] = 0.49999999999999994, -0.5, -0.0, 2.0**53 + 2
    angles = random.uniform(-1e5, 1e5, 20_000)
    angles[:2000] = random.integers(-100, 100, 2000) * math.pi / 4  # sines and cosines next to 0
    pairs = np.column_stack([numbers, angles])
    output = run(elementary, input=pairs.tobytes())
    floors, nearest, sines, cosines, directions, singles = np.frombuffer(output).reshape(-1, 6).T
    np.testing.assert_array_equal(floors, np.floor(numbers))
    halves_away = np.copysign(np.trunc(np.abs(numbers)), numbers)
    halves_away += np.copysign(np.abs(numbers - halves_away) >= 0.5, numbers)
    np.testing.assert_array_equal(nearest, halves_away)
    np.testing.assert_array_max_ulp(sines[2000:], np.sin(angles[2000:]), 2)
    np.testing.assert_array_max_ulp(cosines[2000:], np.cos(angles[2000:]), 2)
    np.testing.assert_allclose(sines[:2000], np.sin(angles[:2000]), rtol=0, atol=1e-15)
    np.testing.assert_array_max_ulp(directions, np.arctan2(numbers, angles), 2)
    np.testing.assert_array_equal(singles, numbers.astype(np.float32))


def test_nan_and_infinity_have_defined_actions(needs, tmp_path):
    # The sanitizer would report conversions of NaN.
    caught = ("-fsanitize=undefined,float-cast-overflow", "-fno-sanitize-recover=all")
    needs("clang", options=caught)
    (tmp_path / "policy.h").write_text(c_header(policy("observer"), "policy").text)
    source = """
        #define POLICY_USE_FLOAT
        #include "policy.h"
        int main(void) {
          const double numbers[5] = {NAN, -INFINITY, INFINITY, 1e308, -1e-320};
          static policy_episode episode; uint32_t step;
          for (step = 0; step < 625; ++step) {
            const double x[3] = {numbers[step % 5], numbers[step / 5 % 5], numbers[step / 25 % 5]};
            if (step % 25 == 0) policy_begin_episode(&episode);
            if (policy_greedy_double(&episode, x) >= 11) return 1; /* there are 11 actions */
          }
          return 0;
        }
    """.replace("NAN", '__builtin_nan("")').replace("INFINITY", "__builtin_inf()")
    run(program(tmp_path, source, "clang", *STRICT, *caught))


def test_a_header_describes_the_episode_and_the_added_inputs():
    text = c_header(differences(), "pole").text
    assert "static pole_episode episode; // the memory of an episode" in text
    assert "uint32_t action = pole_greedy(&episode, observation);" in text
    assert "input 3: the change of input 0 in the last step" in text


def test_images_of_another_history_are_refused():
    agent, other = differences(), policy("differences")
    image = save_image(agent)
    load_image(other, image)
    assert save_image(other) == image
    # Only the warm-up differs, 100 steps instead of 150: other ranges of differences were fitted to
    # it, with which the weights in the image would mean other states.
    shorter = SDNNQLambda(
        agent.observation_space, agent.action_space, history="differences", seed=1, angles=[2],
        inputs="all", angle_pairs=[], approximator=SMALL, warm_up_steps=100,
    )  # fmt: skip
    refuses("image", load_image, warmed_up(shorter), image)


def test_an_sdnn_c_agent_with_a_history_is_refused():
    agent = SDNNQLearning(box(1.0, 2.0), box(1.0), history="differences", warm_up_steps=100)
    refuses("history", c_header, agent, "agent")
