"""Missing values of observations: refused, held at their last value, or coded."""

from concurrent.futures import ThreadPoolExecutor

import gymnasium as gym
import numpy as np
import pytest

from refusals import refuses
from sdnn.agents import (
    FuzzyQLearning,
    RBFQLearning,
    SDNNQLambda,
    SDNNQLearning,
    Transition,
    evaluate,
)

SPACE = gym.spaces.Dict(
    {"a": gym.spaces.Box(-1.0, 3.0, (2,)), "b": gym.spaces.Discrete(3), "c": gym.spaces.Box(-2, 2)}
)
ACTIONS = gym.spaces.Box(-1.0, 1.0, (1,))
COMPLETE = {"a": np.array([0.0, 2.0]), "b": 1, "c": np.array([1.0])}
WITH_MISSING = {
    "a": np.ma.array([9.0, 0.5], mask=[True, False]),
    "b": np.nan,
    "c": np.array([-np.inf]),
}


def agent_of(agent_class, missing, space=SPACE, **options):
    if agent_class is SDNNQLambda:
        options = {"inputs": "all", "angle_pairs": "none", **options}
    return agent_class(space, ACTIONS, missing=missing, seed=1, **options)


def state_of(agent, observation):
    """Return the inputs of the networks, scaled to 0 to 1."""
    return agent._controller.state_of(agent.flat_observation(observation)).tolist()


@pytest.mark.parametrize("agent_class", [SDNNQLambda, SDNNQLearning, RBFQLearning])
def test_hold_repeats_the_last_value_of_the_variable_environment_and_episode(agent_class):
    agent = agent_of(agent_class, "hold")
    agent.n_environments = 2
    # Only the second number of "a" is present, 0.5 in the range of -1 to 3.
    initial = state_of(agent, WITH_MISSING)
    assert initial[:2] == [0.5, 0.375], "the middle of the range, without an earlier value"
    assert initial[-1] == 0.5
    action = agent.act(COMPLETE)
    present = {"a": np.array([0.0, 0.5])}
    assert state_of(agent, WITH_MISSING) == state_of(agent, COMPLETE | present)
    agent.learn(Transition(COMPLETE, action, 1.0, COMPLETE | {"b": 2}, False))
    agent.act(COMPLETE, environment=1)
    agent.act(COMPLETE | {"c": np.array([-1.5])}, explore=False)
    assert state_of(agent, WITH_MISSING)[-1] == 0.125  # -1.5 in the range of -2 to 2
    with ThreadPoolExecutor() as pool:
        pool.submit(agent.act, COMPLETE | {"c": np.array([-1.0])}, explore=False).result()
        assert state_of(agent, WITH_MISSING)[-1] == 0.25  # -1.0 in the range of -2 to 2
    rebuilt = type(agent).rebuild(agent.description(), agent.state())
    assert state_of(rebuilt, WITH_MISSING) == state_of(agent, WITH_MISSING)
    rebuilt.act(WITH_MISSING)  # exploring: values of greedy actions are not held
    assert state_of(rebuilt, WITH_MISSING) == state_of(agent, COMPLETE | present | {"b": 2})
    agent.begin_episode()
    assert state_of(agent, WITH_MISSING) == initial


@pytest.mark.parametrize("agent_class", [SDNNQLambda, SDNNQLearning])
def test_code_gives_missing_values_a_separate_pattern(agent_class):
    agent = agent_of(agent_class, "code")
    network, without_code = agent.networks[0], agent_of(agent_class, "error").networks[0]
    for i in range(4):
        table = network.table(i)
        assert np.array_equal(table[:-1], without_code.table(i)), "one pattern is added, the last"
        is_last = state_of(agent, WITH_MISSING)[i] * len(table) > len(table) - 1
        assert is_last == (i != 1)  # only input 1 is present
    # Rewards of 1 for missing values, and of -1 for complete ones, are distinguished.
    for _ in range(60):
        agent.learn(Transition(WITH_MISSING, agent.act(WITH_MISSING), 1.0, WITH_MISSING, True))
        agent.learn(Transition(COMPLETE, agent.act(COMPLETE), -1.0, COMPLETE, True))
    assert agent.q_values(WITH_MISSING).max() > 0.8
    assert agent.q_values(COMPLETE).min() < -0.8


def test_an_angle_is_coded_or_held_if_its_cosine_or_sine_is_missing():
    space = gym.spaces.Box(-1.0, 1.0, (3,))
    agent = agent_of(SDNNQLambda, "code", space, angle_pairs=[(0, 1)])
    states = [state_of(agent, x) for x in ([np.nan, 1, 0], [0, np.inf, 0], [np.nan, np.nan, 0])]
    assert states == [states[0]] * 3
    agent = agent_of(SDNNQLambda, "hold", space, angle_pairs=[(0, 1)])
    agent.act([0.0, 1.0, 0.0])
    # Cosine 1 and the held sine 1: 45 degrees in the range of -180 to 180.
    assert state_of(agent, [1.0, np.nan, 0.0])[0] == (45 + 180) / 360


def test_missing_values_are_refused_by_default_and_codes_by_agents_without_patterns():
    for bad in (WITH_MISSING, COMPLETE | {"a": np.array([0.0, np.inf])}):
        refuses("observation", agent_of(SDNNQLambda, "error").act, bad)
    for agent_class in (RBFQLearning, FuzzyQLearning):
        refuses("'hold'", agent_of, agent_class, "code")


@pytest.mark.parametrize("missing", ["hold", "code"])
def test_warm_ups_fit_ranges_and_angles_to_the_values_that_are_present(missing):
    space, random = gym.spaces.Box(-np.inf, np.inf, (4,), np.float64), np.random.default_rng(3)
    options = {"missing": missing, "inputs": "all", "warm_up_steps": 400, "seed": 1}
    agent, with_missing = (SDNNQLambda(space, ACTIONS, **options) for _ in range(2))
    for angle in random.uniform(-3, 3, 400):
        x = np.array([np.cos(angle), np.sin(angle), 5.0 * random.integers(-1, 2), np.nan])
        agent.learn(Transition(x, agent.act(x), 0.0, x, False))
        x[random.random(4) < 0.2] = np.nan
        with_missing.learn(Transition(x, with_missing.act(x), 0.0, x, False))
    assert agent.inputs == [("angle", [0, 1]), ("variable", [2]), ("variable", [3])]
    assert agent.inputs == with_missing.inputs
    assert np.array_equal(agent.observation_range, with_missing.observation_range)
    # A variable that is always missing has the range of 0 to 1, widened by a quarter.
    assert agent.observation_range[0][3] == -0.25


def test_evaluations_begin_episodes_with_the_middle_of_ranges_of_missing_variables():
    class WithoutFirstObservation(gym.Wrapper):
        def reset(self, **options):
            return np.full(4, np.nan, np.float32), super().reset(**options)[1]

    states = []
    agent = SDNNQLearning(gym.make("CartPole-v1"), missing="hold", observation_range=(-5, 5))
    act = agent.act

    def note_state_and_act(observation, **options):
        states.append(state_of(agent, observation))
        return act(observation, **options)

    agent.act = note_state_and_act
    evaluate(agent, WithoutFirstObservation(gym.make("CartPole-v1")), episodes=3)
    assert states.count([0.5] * 4) == 3
