"""Missing readings in C: held, coded or refused, with the bits of the library's agents."""

from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest

from c_histories import warmed_up
from c_learners import NETWORK, SMALL, build, lies_between, run_agent, run_program
from c_lines import MISSING, lines_of, with_missing
from c_policies import SANITIZED, STRICT, STRICT_CPP, box, place_of, program, run
from refusals import refuses
from sdnn.agents import QLambdaConfig, SDNNActorCritic, SDNNQLambda, SDNNQLearning
from sdnn.export import c_header, load_image, new_agent, save_image

ALL = {"inputs": "all", "approximator": SMALL}
SPACES = box(1.0, 1.0, 8.0, np.pi), gym.spaces.Discrete(3, start=-1)


def q_lambda(missing):
    """A cosine and a sine, a number and an angle."""
    return SDNNQLambda(*SPACES, angle_pairs=[(0, 1)], angles=[3], missing=missing, seed=1, **ALL)


def several(missing):
    """Two dimensions of actions."""
    learning = QLambdaConfig(bootstrap="sarsa", epsilon=0.3, tie_rule="lowest")
    spaces = box(1.0, 2.0), gym.spaces.MultiDiscrete([3, 5])
    return SDNNQLambda(*spaces, angle_pairs=[], learning=learning, missing=missing, seed=2, **ALL)


def actor(missing):
    """Thermometers, and greedy actions between others."""
    high = np.array([1.0, 1.0, 8.0])
    ranges = {"angle_pairs": [(0, 1)], "observation_range": (-high, high)}
    return SDNNActorCritic(box(*high), box(2.0), missing=missing, seed=3, **ranges, **ALL)


def network(missing):
    """SDNN-C with five-step targets."""
    learning = replace(SDNNQLearning.presets["small"].learning, epsilon=0.1)
    settings = {"approximator": replace(NETWORK, n_hidden_units=90), "learning": learning}
    space, actions = box(1.0, 2.0, 3.0, 0.25), gym.spaces.Discrete(2, start=-1)
    return SDNNQLearning(space, actions, missing=missing, seed=4, **settings)


def observer(missing):
    """Estimates of numbers and angles."""
    agent = SDNNQLambda(
        *SPACES, angle_pairs=[(0, 1)], angles=[3], missing=missing, seed=5, history="observer",
        warm_up_steps=150, **ALL,
    )  # fmt: skip
    return warmed_up(agent)


def differences(missing):
    """An actor-critic with differences of a number."""
    agent = SDNNActorCritic(
        box(2.0, 3.0), box(1.0), missing=missing, seed=6, history="differences", warm_up_steps=150,
        observation_range=([-2.0, -3.0], [2.0, 3.0]), angle_pairs=[], **ALL,
    )  # fmt: skip
    return warmed_up(agent)


MAKERS = (q_lambda, several, actor, network)
CASES = [
    *((make, missing) for make in MAKERS for missing in ("error", "hold", "code")),
    *((make, missing) for make in (observer, differences) for missing in ("error", "hold")),
]


@pytest.mark.parametrize(("make", "missing"), CASES)
def test_missing_readings_are_treated_bit_for_bit_as_in_python(make, missing, target, tmp_path):
    agent = make(missing)
    header, command = build(tmp_path, agent, target, *SANITIZED, "-DAGENT_REFUSES")
    lines = lines_of(agent, 1200, 7, header.fraction_bits)
    # Few numbers are missing where observations that lack one are refused: most are learned.
    lines = with_missing(lines, np.random.default_rng(8), 0.03 if missing == "error" else 0.2)
    actions, image = run_program(command, save_image(agent), lines, agent.n_dimensions)
    assert actions == run_agent(agent, lines, header.fraction_bits)
    assert image == save_image(agent)
    load_image(agent, image)


@pytest.mark.parametrize(("make", "missing"), CASES)
def test_policies_treat_missing_readings_as_the_agent(make, missing, target, tmp_path):
    agent = make(missing)
    random = np.random.default_rng(9)
    run_agent(agent, with_missing(lines_of(agent, 300, 1, 16), random, 0.1), 16)
    header = c_header(agent, "policy")
    (tmp_path / "policy.h").write_text(header.text)
    n, scale = len(agent.observation_range[0]), 2.0**header.fraction_bits
    fixed = lines_of(agent, 400, 2, header.fraction_bits)[:, 1 : n + 1]
    fixed[random.random(fixed.shape) < 0.3] = MISSING
    begins = random.random(len(fixed)) < 0.1
    begins[0] = True
    episodes = "policy_episode" in header.text.split("*/", 1)[1]
    episode = "&episode, " if missing == "hold" or agent.history != "none" else ""
    assert episodes == (episode != "")
    array = ", action" if agent.n_dimensions > 1 else ""
    calls = {
        kind: f"policy_greedy{suffix}({episode}x{array})"
        for kind, suffix in {"fixed": "", "double": "_double", "float": "_float"}.items()
    }
    calls = {k: call if array else f"action[0] = {call}" for k, call in calls.items()}
    source = f"""
        #define POLICY_USE_FLOAT
        #define POLICY_REFUSES
        #include "policy.h"
        #include <stdio.h>
        #define READ(type, call) {{ \\
          type x[POLICY_N_OBSERVED]; \\
          if (fread(x, sizeof *x, POLICY_N_OBSERVED, stdin) != POLICY_N_OBSERVED) return 1; \\
          call; }}
        int main(void) {{
          uint32_t action[POLICY_N_DIMENSIONS]; int begins, kind;
          {"policy_episode episode;" if episode else ""}
          while ((kind = getchar()) != EOF) {{
            begins = getchar();
            if (begins) {{ {"policy_begin_episode(&episode);" if episode else ""} }}
            if (kind == 0) READ(int32_t, {calls["fixed"]})
            if (kind == 1) READ(double, {calls["double"]})
            if (kind == 2) READ(float, {calls["float"]})
            fwrite(action, sizeof *action, POLICY_N_DIMENSIONS, stdout);
          }}
          return 0;
        }}
    """
    policy = program(tmp_path, source, target.compiler, *STRICT, *SANITIZED)
    for kind, dtype in enumerate(("<i4", "<f8", "<f4")):
        doubles = np.where(fixed == MISSING, np.nan, fixed / scale)
        numbers = fixed if kind == 0 else doubles.astype(dtype)
        queries = [
            bytes([kind, int(begin)]) + row.tobytes()
            for begin, row in zip(begins, numbers, strict=True)
        ]
        written = run(policy, input=b"".join(queries))
        in_c = np.frombuffer(written, "<u4").reshape(-1, agent.n_dimensions)
        observations = doubles if kind == 0 else numbers.astype(float)
        n_answered = check_greedy(agent, observations, begins, in_c)
        assert n_answered == len(fixed) or missing == "error"
        assert n_answered > 50


def check_greedy(agent, observations, begins, actions):
    """Compare indices with the agent's, where it draws none; return the number of its actions."""
    n_answered = 0
    for observation, begin, in_c in zip(observations, begins, actions.tolist(), strict=True):
        if begin:
            agent.begin_greedy_episode()
        if agent.missing == "error" and np.isnan(observation).any():
            refuses("observation", agent.act, observation, explore=False)
            assert in_c == [2**32 - 1] * agent.n_dimensions
            continue
        n_answered += 1
        # Drawn ties would be other actions, of which a history knows: follow those of C.
        action = np.ravel(agent.act(observation, explore=False))
        for d, index in enumerate(in_c):
            choices = agent.actions_of(d)
            if isinstance(agent, SDNNActorCritic):
                values, tolerance = agent.action_probabilities(observation, d), 0.0
            else:
                values = agent.q_values(observation, d)
                tolerance = agent.learning.tie_tolerance
            assert values[index] >= values.max() - tolerance
            if (values >= values.max() - tolerance).sum() == 1 and not lies_between(agent):
                assert choices[index] == action[d]
            if lies_between(agent):
                assert abs(place_of(choices, action[d]) / 2**16 - index) <= 1.0
    return n_answered


@pytest.mark.parametrize("missing", ["hold", "code"])
def test_symbols_and_angles_are_missing_if_one_of_their_variables_is(missing, target, tmp_path):
    space = gym.spaces.Tuple([gym.spaces.Discrete(3), box(2.0), box(1.0, 1.0)])
    agent = SDNNQLambda(
        space, gym.spaces.Discrete(2), missing=missing, angle_pairs=[(4, 5)], **ALL
    )  # fmt: skip
    header = c_header(agent, "policy")
    (tmp_path / "policy.h").write_text(header.text)
    copy = "for (i = 0; i < POLICY_N_OBSERVED; ++i) held[i] = x[i];"
    fill = "policy_hold_readings(held, x);" if missing == "hold" else copy
    source = f"""
        #include "policy.h"
        #include <stdio.h>
        int main(void) {{
          int32_t x[POLICY_N_OBSERVED], held[POLICY_N_OBSERVED]; uint32_t bins[POLICY_N_INPUTS], i;
          for (i = 0; i < POLICY_N_OBSERVED; ++i) held[i] = POLICY_MISSING;
          while (fread(x, sizeof *x, POLICY_N_OBSERVED, stdin) == POLICY_N_OBSERVED) {{
            {fill}
            policy_bins_of_fixed(held, bins);
            fwrite(bins, sizeof *bins, POLICY_N_INPUTS, stdout);
          }}
          return 0;
        }}
    """
    command = program(tmp_path, source, target.compiler, *STRICT, *SANITIZED)
    random, scale = np.random.default_rng(0), 2**header.fraction_bits
    rows = np.hstack([np.eye(3)[random.integers(3, size=500)], random.uniform(-1, 1, (500, 3))])
    fixed = np.round(rows * scale).astype("<i4")
    fixed[random.random(fixed.shape) < 0.3] = MISSING
    fixed[:3] = MISSING
    bins = np.frombuffer(run(command, input=fixed.tobytes()), "<u4").reshape(len(fixed), -1)
    network = agent.networks[0]
    n_bins = np.array([len(network.table(i)) for i in range(bins.shape[1])])
    expected = []
    agent.begin_episode()
    for row in np.where(fixed == MISSING, np.nan, fixed / scale):
        state = np.array(agent._controller.state_of(row))
        expected.append(np.minimum((state * n_bins).astype(int), n_bins - 1))
        agent._controller.act(row, True, 0, np.empty(0, np.uint8))
    np.testing.assert_array_equal(bins, expected)
    # In row 0 all is missing: coded by the last bin, or held at symbol 0 and the middles of ranges.
    never_read = n_bins - 1 if missing == "code" else [0, n_bins[1] // 2, n_bins[2] // 2]
    np.testing.assert_array_equal(bins[0], never_read)


def test_the_action_for_a_missing_reading_that_is_refused_is_missing_too(target, tmp_path):
    agent = new_agent(box(1.0), gym.spaces.Box(-2.0, 2.0), kind="actor-critic")
    (tmp_path / "policy.h").write_text(c_header(agent, "policy").text)
    source = """
        #define POLICY_REFUSES
        #include "policy.h"
        int main(void) {
          const int32_t missing = POLICY_MISSING, read = 0;
          return policy_action_at(0, policy_place(&missing)) != POLICY_MISSING
            || policy_action_at(0, policy_place(&read)) == POLICY_MISSING;
        }
    """
    run(program(tmp_path, source, target.compiler, *STRICT, *SANITIZED))


@pytest.mark.parametrize("missing", ["error", "hold", "code"])
@pytest.mark.parametrize("kind", ["q-lambda", "actor-critic", "sdnn-c"])
def test_headers_state_their_memory_and_are_cpp(kind, missing, needs, tmp_path):
    needs("g++")
    space = box(1.0, 2.0, 3.0)
    agent = new_agent(space, gym.spaces.Discrete(2), kind=kind, missing=missing, ram_bytes=60_000)
    header = c_header(agent, "agent", learning=True)
    (tmp_path / "agent.h").write_text(header.text)
    episode = "agent_greedy_episode episode; learner.begin_greedy_episode(&episode);"
    source = f"""
        #include "agent.h"
        #include <stdio.h>
        static agent_learner learner;
        int main() {{
          const int32_t x[AGENT_N_OBSERVED] = {{AGENT_MISSING, 0, 0}};
          {episode if missing == "hold" else ""}
          printf("%lu ", (unsigned long)sizeof(agent_agent));
          printf("%d ", learner.act(x) == AGENT_REFUSED);
          printf("%d", learner.greedy({"&episode, " if missing == "hold" else ""}x)
                 == AGENT_REFUSED);
          return 0;
        }}
    """
    command = program(tmp_path, source, "g++", *STRICT_CPP, "-DAGENT_REFUSES")
    size, *are_refused = map(int, run(command).split())
    assert size == header.ram_bytes
    assert are_refused == [missing == "error"] * 2
