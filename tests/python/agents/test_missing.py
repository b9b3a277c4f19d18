"""Missing readings: refused, held at their last value, or coded."""

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
BOX = gym.spaces.Box(-1.0, 1.0, (1,))
READ = {"a": np.array([0.0, 2.0]), "b": 1, "c": np.array([1.0])}
LOST = {"a": np.ma.array([9.0, 0.5], mask=[True, False]), "b": np.nan, "c": np.array([-np.inf])}


def agent_of(agent_class, missing, space=SPACE, **options):
    if agent_class is SDNNQLambda:
        options = {"inputs": "all", "angle_pairs": "none", **options}
    return agent_class(space, BOX, missing=missing, seed=1, **options)


def state(agent, observation):
    return agent._controller.state_of(agent.flat_observation(observation)).tolist()


@pytest.mark.parametrize("agent_class", [SDNNQLambda, SDNNQLearning, RBFQLearning])
def test_hold_repeats_the_last_reading_of_the_variable_environment_and_episode(agent_class):
    # In LOST only the second number of "a" is present, 0.5; in READ all readings are.
    agent = agent_of(agent_class, "hold")
    agent.n_environments = 2
    never, last = state(agent, LOST), state(agent, READ | {"a": np.array([0.0, 0.5])})
    assert never[:2] == [0.5, 0.375]  # the middle, and 0.5 in the range of -1 to 3
    assert never[-1] == 0.5
    action = agent.act(READ)
    assert state(agent, LOST) == last
    agent.learn(Transition(READ, action, 1.0, READ | {"b": 2}, False))
    agent.act(READ, environment=1)
    agent.act(READ | {"c": np.array([-1.5])}, explore=False)
    assert state(agent, LOST)[-1] == 0.125  # -1.5 in the range of -2 to 2
    with ThreadPoolExecutor() as pool:
        pool.submit(agent.act, READ | {"c": np.array([-1.0])}, explore=False).result()
        assert state(agent, LOST)[-1] == 0.25  # -1.0 in the range of -2 to 2
    same = type(agent).rebuild(agent.description(), agent.state())
    assert state(same, LOST) == state(agent, LOST)
    same.act(LOST)  # readings of greedy actions are not kept
    assert state(same, LOST) == state(agent, READ | {"a": np.array([0.0, 0.5]), "b": 2})
    agent.begin_episode()
    assert state(agent, LOST) == never


@pytest.mark.parametrize("agent_class", [SDNNQLambda, SDNNQLearning])
def test_code_gives_missing_readings_a_separate_pattern(agent_class):
    agent = agent_of(agent_class, "code")
    core, core_without = agent.networks[0], agent_of(agent_class, "error").networks[0]
    for i in range(4):
        table = core.table(i)
        assert np.array_equal(table[:-1], core_without.table(i)), "one pattern is added, the last"
        is_last = state(agent, LOST)[i] * len(table) > len(table) - 1
        assert is_last == (i != 1)  # input 1 is the only reading that is present
    # Rewards of 1 without the readings, and of -1 with them, are distinguished.
    for _ in range(60):
        agent.learn(Transition(LOST, agent.act(LOST), 1.0, LOST, True))
        agent.learn(Transition(READ, agent.act(READ), -1.0, READ, True))
    assert agent.q_values(LOST).max() > 0.8
    assert agent.q_values(READ).min() < -0.8


def test_an_angle_is_missing_if_either_of_its_pair_is():
    space = gym.spaces.Box(-1.0, 1.0, (3,))
    agent = agent_of(SDNNQLambda, "code", space, angle_pairs=[(0, 1)])
    states = [state(agent, x) for x in ([np.nan, 1, 0], [0, np.inf, 0], [np.nan, np.nan, 0])]
    assert states == [states[0]] * 3
    agent = agent_of(SDNNQLambda, "hold", space, angle_pairs=[(0, 1)])
    agent.act([0.0, 1.0, 0.0])
    assert state(agent, [1.0, np.nan, 0.0])[0] == 0.625  # cosine 1 and held sine 1: 45 degrees


def test_missing_readings_and_unsupported_modes_are_refused_with_a_remedy():
    for bad in (LOST, READ | {"a": np.array([0.0, np.inf])}):
        refuses("observation", agent_of(SDNNQLambda, "error").act, bad)
    for agent_class in (RBFQLearning, FuzzyQLearning):
        refuses("'hold'", agent_of, agent_class, "code")


@pytest.mark.parametrize("missing", ["hold", "code"])
def test_warm_ups_fit_ranges_and_angles_to_the_readings_that_are_present(missing):
    space, random = gym.spaces.Box(-np.inf, np.inf, (4,), np.float64), np.random.default_rng(3)
    options = {"missing": missing, "inputs": "all", "warm_up_steps": 400, "seed": 1}
    agents = [SDNNQLambda(space, BOX, **options) for _ in range(2)]
    for angle in random.uniform(-3, 3, 400):
        x = np.array([np.cos(angle), np.sin(angle), 5.0 * random.integers(-1, 2), np.nan])
        for agent, lost in zip(agents, (False, random.random(4) < 0.2), strict=True):
            y = np.where(lost, np.nan, x)
            agent.learn(Transition(y, agent.act(y), 0.0, y, False))
    full, part = agents
    assert full.inputs == part.inputs == [("angle", [0, 1]), ("variable", [2]), ("variable", [3])]
    assert np.array_equal(full.observation_range, part.observation_range)
    # The range of a variable that was never read is that of 0 and 1, widened by a quarter.
    assert part.observation_range[0][3] == -0.25


def test_evaluations_begin_episodes_with_the_middle_of_unread_ranges():
    class Silent(gym.Wrapper):
        def reset(self, **options):
            return np.full(4, np.nan, np.float32), super().reset(**options)[1]

    states = []
    agent = SDNNQLearning(gym.make("CartPole-v1"), missing="hold", observation_range=(-5, 5))
    act = agent.act
    agent.act = lambda x, **options: (states.append(state(agent, x)), act(x, **options))[1]
    evaluate(agent, Silent(gym.make("CartPole-v1")), 3)
    assert states.count([0.5] * 4) == 3
