"""Agents that learn in C, compiled for this processor and compared bit for bit.

``nox -s emulation`` has other compilers and processors.
"""

import zlib
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest

from c_learners import (
    LEARNERS,
    actor,
    actor_running,
    actor_vector,
    build,
    check_learning,
    discrete,
    exported,
    lies_between,
    lines_of,
    network,
    run_agent,
    run_program,
    sarsa,
    several,
    small_steps,
)
from c_policies import STRICT, STRICT_CPP, box, program, run
from refusals import refuses
from sdnn.agents import (
    QLambdaConfig,
    RBFQLearning,
    SDNNActorCritic,
    SDNNQLambda,
    SDNNQLearning,
)
from sdnn.export import c_header, load_image, save_image

SANITIZED = ("-fsanitize=undefined", "-fno-sanitize-recover=all")


@pytest.mark.parametrize("name", LEARNERS)
def test_an_exported_agent_acts_and_learns_bit_for_bit_as_in_python(name, target, tmp_path):
    # A compiled program and the Python agent act and learn 3,000 steps; their actions and their
    # saved images must be equal, from a new agent and from an image.
    check_learning(name, target, tmp_path, options=SANITIZED)


@pytest.mark.parametrize("make", [discrete, network, small_steps, actor, actor_running])
def test_a_trained_agent_continues_in_c(make, target, tmp_path):
    agent = make()
    run_agent(agent, lines_of(agent, 500, 3, 16), 16)
    header, command = build(tmp_path, agent, target)
    lines = lines_of(agent, 500, 4, header.fraction_bits)
    # The program gets an image that it refuses, and begins with what the header knows.
    refused_image = bytes(len(save_image(agent)))
    actions, image = run_program(command, refused_image, lines, agent.n_dimensions)
    assert actions == run_agent(agent, lines, header.fraction_bits)
    assert image == save_image(agent)


def test_an_agent_in_c_searches_for_a_first_reward_like_the_agent(target, tmp_path):
    # The first 300 rewards are 0; of the later ones each 20th is not.
    agent = discrete()
    header, command = build(tmp_path, agent, target, *SANITIZED)
    lines = lines_of(agent, 1500, 5, header.fraction_bits)
    # A line is its kind, an observation of n numbers, the reward, the next observation, its end.
    n = (lines.shape[1] - 3) // 2
    rewards = lines[:, 1 + n]
    rewards[:300] = 0
    rewards[300:] *= np.arange(len(lines) - 300) % 20 == 0
    initial_image = save_image(agent)
    actions, image = run_program(command, initial_image, lines, agent.n_dimensions)
    assert actions == run_agent(agent, lines, header.fraction_bits)
    assert image == save_image(agent)


def test_an_endless_episode_in_c_has_the_excursions_of_the_agent(target, tmp_path):
    # After 2,000 steps of an episode, some explorations are excursions: several worst actions.
    agent = discrete()
    assert agent.learning.max_action_repeat > 1  # else there are none
    header, command = build(tmp_path, agent, target, *SANITIZED)
    lines = lines_of(agent, 4000, 6, header.fraction_bits)
    lines = np.concatenate([lines[:1], lines[lines[:, 0] == 1]])  # a begin, then steps to learn
    lines[:, -1] = 0  # nothing terminates
    initial_image = save_image(agent)
    actions, image = run_program(command, initial_image, lines, agent.n_dimensions)
    assert actions == run_agent(agent, lines, header.fraction_bits)
    assert agent.n_learned < len(lines) - 100, "steps of excursions are not learned"
    assert image == save_image(agent)
    restored = discrete()
    load_image(restored, image)
    assert restored.n_learned == agent.n_learned


def test_extreme_readings_and_rewards_have_defined_results(target, tmp_path):
    # Half of the numbers are extreme; acting, learning and new episodes come in any order.
    for make in (discrete, sarsa, network, small_steps, actor, actor_running):
        folder = tmp_path / make.__name__
        folder.mkdir()
        agent = make()
        _, command = build(folder, agent, target, *SANITIZED, "-fsanitize=address")
        random = np.random.default_rng(0)
        n = len(agent.observation_range[0])
        lines = random.integers(-(2**31), 2**31, (100_000, 2 * n + 3))
        ends = random.choice([-(2**31), 2**31 - 1, 0, 1, -1], lines.shape)
        lines = np.where(random.random(lines.shape) < 0.5, ends, lines)
        lines[:, 0] = random.integers(0, 3, len(lines))
        lines[:, -1] = random.random(len(lines)) < 0.1
        actions, image = run_program(command, save_image(agent), lines.astype("<i4"), 1)
        unit = 2**16 if lies_between(agent) else 1  # of places of greedy actions
        assert np.max(actions) < len(agent.actions_of(0)) * unit
        load_image(agent, image)


HOSTILE = """
#include <stdio.h>
#include "agent.h"
static agent_agent agent;
static uint8_t image[AGENT_IMAGE_BYTES];
int main(void) {
  uint32_t noise = 1, step, action, i;
  int is_loaded = 1, n_loaded = 0;
  while (fread(image, 1, sizeof image, stdin) == sizeof image) {
    agent_begin(&agent);
    if (!agent_load(&agent, image)) continue;
    ++n_loaded;
    for (step = 0; step < 100; ++step) {
      int32_t x[2][AGENT_N_OBSERVED], reward = 0;
      for (i = 0; i < 2 * AGENT_N_OBSERVED + 1; ++i) {
        noise = noise * 1664525 + 1013904223;
        reward = noise >> 31 ? (int32_t)(noise << 1) : noise & 1 << 30 ? INT32_MAX : INT32_MIN;
        if (i < 2 * AGENT_N_OBSERVED) x[i & 1][i / 2] = reward;
      }
      action = step & 1 ? agent_act(&agent, x[0]) : agent_greedy(&agent, x[0]);
      agent_learn(&agent, x[0], action, reward, x[1], step % 9 == 0);
      VALUE;
    }
    agent_begin_episode(&agent);
    agent_save(&agent, image);
    is_loaded &= agent_load(&agent, image);
  }
  printf("%d", n_loaded);
  return !is_loaded;
}
"""


@pytest.mark.parametrize("make", [discrete, sarsa, network, small_steps, actor, actor_running])
def test_images_with_extreme_numbers_are_refused_or_saved_again(make, target, tmp_path):
    # The program fails if it cannot load an image that it saved.
    agent = make()
    run_agent(agent, lines_of(agent, 300, 1, 16), 16)
    (tmp_path / "agent.h").write_text(c_header(agent, "agent", learning=True).text)
    options = (*STRICT, "-O1", *SANITIZED, "-fsanitize=address")
    is_actor = isinstance(agent, SDNNActorCritic)
    value = "agent_state_value(&agent, x[1])" if is_actor else "agent_q(&agent, x[1], 0)"
    hostile = program(tmp_path, HOSTILE.replace("VALUE", value), target.compiler, *options)
    random = np.random.default_rng(3)
    whole = [0, 1, 255, 2**31 - 1, 2**31, 2**32 - 1, 2**45, 2**62 - 1001, 2**63, 2**64 - 1]
    real = np.array([1.0, -1.0, 2.0**99, -(2.0**99), 5e-324, 1e300, np.inf, np.nan, -0.0])
    words = np.concatenate([np.array(whole, np.uint64), real.view(np.uint64)])
    images = []
    for _ in range(200):
        image = bytearray(save_image(agent))
        # The first two words identify the agent: others become extreme.
        for place in 4 * random.integers(2, 70, random.integers(1, 4)):
            n_bytes = random.choice([1, 4, 8])
            image[place : place + n_bytes] = random.choice(words).tobytes()[:n_bytes]
        if random.random() < 0.3:  # weights
            most = [b"\xff\xff\x7f\x00", b"\x01\x00\x80\xff"]
            weights = [b"\xff", b"\x01"] if isinstance(agent, SDNNQLearning) else most
            weight = weights[random.integers(2)]
            half = len(image) // 8 * 4
            image[-4 - half : -4] = weight * (half // len(weight))
        image[-4:] = zlib.crc32(image[:-4]).to_bytes(4, "little")
        images.append(bytes(image))
    n_loaded = int(run(hostile, input=b"".join(images)))
    assert 40 < n_loaded < 180, "of 200 images some have no impossible number, and many have one"


def test_weights_that_leave_their_range_are_halved(target, tmp_path):
    # From the largest weights, a step leads to 2^24 - 1, which doubles the unit.
    learning = QLambdaConfig(
        schedule_steps=0, final_learning_rate=None, traces="replacing", epsilon=0.0,
        tie_rule="lowest",
    )  # fmt: skip
    agent = SDNNQLambda(gym.spaces.Discrete(9), gym.spaces.Discrete(4), learning=learning)
    state = agent._state_of("agent")
    state["action_value.weights"][:] = 2**23 - 1
    state["action_value.exponent"] = np.array(-10, np.int32)
    agent._restore(agent=state)
    header, command = build(tmp_path, agent, target, *SANITIZED)
    values = [round(agent.q_values(symbol)[0] * 2.0**10) for symbol in range(9)]
    symbol, value = min(enumerate(values), key=lambda pair: pair[1])
    assert value == -2 * (2**23 - 1)  # both of its inputs are -1 in the code
    # Two lines, each with its kind, an observation, a reward, the next observation, and its end: an
    # episode begins, and a step to learn is terminal. Its target is twice the value, and needs
    # weights of twice the size.
    now, reward = np.eye(9, dtype="<i4")[symbol], 2 * value << header.fraction_bits - 10
    lines = np.concatenate([[0], now, [0], now, [0], [1], now, [reward], now, [1]], dtype="<i4")
    lines = lines.reshape(2, -1)
    actions, image = run_program(command, save_image(agent), lines, 1)
    assert actions == run_agent(agent, lines, header.fraction_bits)
    assert image == save_image(agent)
    assert agent._state_of("agent")["action_value.weights"].max() == 2**22  # 2^23 - 1, halved
    load_image(agent, image)


CONSTANT = """
#include <stdio.h>
#include "agent.h"
#include "policy.h"
static agent_agent agent, before;
int main(void) {
  const agent_agent* const same = &agent;
  int32_t x[AGENT_N_OBSERVED];
  agent_begin(&agent);
  memcpy(&before, &agent, sizeof agent);
  while (fread(x, sizeof *x, AGENT_N_OBSERVED, stdin) == AGENT_N_OBSERVED) {
    if (agent_greedy(same, x) != policy_greedy(x)) return 1;
  }
  return memcmp(&before, &agent, sizeof agent) != 0;
}
"""


@pytest.mark.parametrize("make", [discrete, sarsa, network, actor])
def test_greedy_actions_leave_the_agent_as_it_is_and_are_those_of_the_policy(
    make, target, tmp_path
):
    agent = make()
    run_agent(agent, lines_of(agent, 300, 1, 16), 16)
    (tmp_path / "agent.h").write_text(c_header(agent, "agent", learning=True).text)
    (tmp_path / "policy.h").write_text(c_header(agent, "policy").text)
    greedy = program(
        tmp_path, f"#include <string.h>{CONSTANT}", target.compiler, *STRICT, *SANITIZED
    )
    observations = lines_of(agent, 1000, 2, 16)[:, 1 : len(agent.observation_range[0]) + 1]
    run(greedy, input=np.ascontiguousarray(observations).tobytes())


def test_constants_become_fixed_point_at_compile_time(target, tmp_path):
    # Numbers are times 2^16: 0.3 gives 19660.8, 7 gives 458752; halves are rounded away from 0.
    (tmp_path / "agent.h").write_text(c_header(discrete(), "agent", learning=True).text)
    numbers = {"0.3": 19661, "-0.3": -19661, "1.5 / 65536": 2, "-1.5 / 65536": -2, "7": 458752}
    values = ", ".join(f"AGENT_FIXED({number})" for number in numbers)
    source = f"""
        #include <stdio.h>
        #include "agent.h"
        static const int32_t values[] = {{{values}, AGENT_FIXED(2.0f)}};
        int main(void) {{
          unsigned i;
          for (i = 0; i < 6; ++i) printf("%ld ", (long)values[i]);
          return 0;
        }}
    """
    printed = run(program(tmp_path, source, target.compiler, *STRICT)).split()
    assert [int(number) for number in printed] == [*numbers.values(), 2 * 65536]


@pytest.mark.parametrize("compiler", ["g++", "clang++"])
@pytest.mark.parametrize(
    ("make", "act"),
    [
        (discrete, "const uint32_t a = one.act(x)"),
        (several, "uint32_t a[2]; one.act(x, a)"),
        (network, "one.set_progress(65536); const uint32_t a = one.act(x)"),
        (actor, "const uint32_t a = one.act(x)"),
        (actor_vector, "uint32_t a[2]; one.act(x, a)"),
    ],
)
def test_the_learner_class_of_cpp_acts_learns_saves_and_loads(compiler, make, act, needs, tmp_path):
    needs(compiler)
    agent = make()
    (tmp_path / "agent.h").write_text(c_header(agent, "agent", learning=True).text)
    has_many = agent.n_dimensions > 1
    greedy = "uint32_t b[2]; one.greedy(x, b)" if has_many else "one.greedy(x)"
    best = "one.best(keeper, x, b)" if has_many else "one.best(keeper, x)"
    value = "state_value(x)" if isinstance(agent, SDNNActorCritic) else "q(x, a)"
    source = f"""
        #include "agent.h"
        static agent_learner one, same;
        static uint8_t image[AGENT_IMAGE_BYTES], memory[AGENT_KEPT_BYTES];
        static agent_keeper keeper;
        int main() {{
          int32_t x[AGENT_N_OBSERVED] = {{}};
          one.begin_episode();
          {act};
          one.learn(x, a, AGENT_FIXED(1.0), x, true);
          {greedy};
          one.save(image);
          agent_begin_keeping(&keeper, memory, agent_read_memory, agent_write_memory, 1);
          if (!one.keep(keeper, 1)) return 2;
          {best};
          return one.{value} != same.{value} && same.load(image) && same.{value} == one.{value}
                     ? 0 : 1;
        }}
    """
    run(program(tmp_path, source, compiler, *STRICT_CPP))


@pytest.mark.parametrize("name", LEARNERS)
def test_the_header_states_the_size_of_the_agent_in_memory(name, target, tmp_path):
    header = exported(name)
    (tmp_path / "agent.h").write_text(header.text)
    source = '#include "agent.h"\n#include <stdio.h>\nint main(void)'
    source += ' { printf("%d %d", (int)sizeof(agent_agent), (int)AGENT_KEPT_BYTES); return 0; }'
    printed = run(program(tmp_path, source, target.compiler, *STRICT)).split()
    ram_bytes, kept_bytes = (int(number) for number in printed)
    assert ram_bytes == header.ram_bytes
    assert f"agent_keep keeps takes {kept_bytes:,} more" in header.text


REAL_NUMBERS = """
#include "agent.h"
#include <stdio.h>
int main(void) {
  uint64_t x[2], y[4];
  while (fread(x, sizeof *x, 2, stdin) == 2) {
    y[0] = agent_plus(x[0], x[1]);
    y[1] = agent_minus(x[0], x[1]);
    y[2] = agent_times(x[0], x[1]);
    y[3] = agent_over(x[0], x[1]);
    fwrite(y, sizeof *y, 4, stdout);
  }
  return 0;
}
"""


def test_software_floating_point_has_the_bits_of_ieee_754(target, tmp_path):
    # Numbers of all sizes, also subnormal ones, and pairs of nearly equal numbers.
    (tmp_path / "agent.h").write_text(c_header(network(), "agent", learning=True).text)
    real = program(tmp_path, REAL_NUMBERS, target.compiler, *STRICT, *SANITIZED)
    random = np.random.default_rng(1)
    bits = random.integers(0, 2**64, (50_000, 2), np.uint64)
    near = bits[:, :1] ^ (bits[:, 1:] >> random.integers(1, 63, (50_000, 1)).astype(np.uint64))
    numbers = np.concatenate([bits, np.hstack([bits[:, :1], near])]).view(np.float64)
    numbers = np.concatenate([numbers, random.integers(-300, 300, (5000, 2)) / 4])
    numbers = numbers[np.isfinite(numbers).all(axis=1) & (numbers[:, 1] != 0)]
    with np.errstate(all="ignore"):
        a, b = numbers.T
        expected = np.column_stack([a + b, a - b, a * b, a / b])
    actions = np.frombuffer(run(real, input=numbers.tobytes()), "<u8").reshape(-1, 4)
    is_finite = np.isfinite(expected)
    assert is_finite.mean() > 0.9
    assert (actions == expected.view(np.uint64))[is_finite].all()


def test_settings_that_cannot_learn_in_c_are_refused():
    for learning, approximator, named in (
        ({}, {"averaging_interval": 100}, "averaging_interval"),
        ({}, {"weight_limit": 0}, "weight_limit"),
        ({}, {"weight_limit": 128}, "weight_limit"),
        ({"tie_tolerance": 0.1}, {}, "tie_tolerance"),
        ({"schedule": "exponential"}, {}, "schedule"),
        ({"value_range": "fixed"}, {"q_low": 1e300, "q_high": 1e301}, "q_low"),
    ):
        agent = network()
        other = SDNNQLearning(
            box(1.0, 2.0), gym.spaces.Discrete(2),
            learning=replace(agent.learning, **learning),
            approximator=replace(agent.approximator, n_inputs=2, **approximator),
        )  # fmt: skip
        refuses(named, c_header, other, "agent", learning=True)
        refuses(named, save_image, other)
    vector = SDNNQLearning(
        box(1.0, 2.0), gym.spaces.MultiDiscrete([2, 3]), approximator=network().approximator
    )
    refuses("action_space", c_header, vector, "agent", learning=True)
    full = network()
    weights = full.networks[0].weights()
    weights[3, 5] = 128
    full.networks[0].set_parameters(weights, full.networks[0].thresholds())
    refuses("127", c_header, full, "agent", learning=True)
    radial = RBFQLearning(box(1.0, 1.0), gym.spaces.Discrete(2))
    refuses("agent", c_header, radial, "agent", learning=True, error=TypeError)
    refuses("agent", save_image, radial, error=TypeError)
    refuses("learning", c_header, discrete(), "agent", learning=1, error=TypeError)
