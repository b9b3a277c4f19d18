"""Discrete observations of any size, and observations of many variables."""

import gymnasium as gym
import numpy as np
import pytest

from sdnn.agents import SDNNQLearning, Transition


def test_greedy_actions_in_40_unrelated_states_are_the_rewarded_ones():
    # A random action of each state is rewarded: states with near numbers do not help.
    rewarded = np.random.default_rng(1).integers(0, 4, 40)
    agent = SDNNQLearning(gym.spaces.Discrete(40), gym.spaces.Discrete(4), seed=1)
    assert agent.approximator.n_inputs == 2, "the only input is repeated"
    assert agent.approximator.n_symbols == (40, 40)
    for state, action in np.random.default_rng(2).permutation(list(np.ndindex(40, 4)) * 15):
        reward = float(action == rewarded[state])
        agent.learn(Transition(state, action, reward, state, True))
    report = agent.learning_report()
    # Rewards are 0 and 1. The range has a margin of a quarter for better returns, but none below:
    # untried actions have its lowest value, and are not to look worse than bad ones.
    assert report["q_range"] == (0.0, 1.25)
    n_active = agent.approximator.n_active_units
    # The lowest value has 1/15 of a window's units active, the highest all but 1/15.
    n_inactive = n_active // 15
    assert report["value_step"] == pytest.approx(1.25 / (n_active - 2 * n_inactive))
    assert 0.0 < report["mean_error"] < 0.25
    assert [agent.act(state, explore=False) for state in range(40)] == rewarded.tolist()


def test_an_agent_of_500_discrete_states_takes_less_than_10_mb():
    # Flattened, the space would have 500 variables with 124,750 pairs.
    agent = SDNNQLearning(gym.spaces.Discrete(500), gym.spaces.Discrete(6), seed=1)
    n_bytes = sum(array.nbytes for array in agent.state().values())
    assert n_bytes < 10e6
    for state in (0, 7, 499):
        agent.learn(Transition(state, 3, 1.0 + state, 0, True))
    assert agent.act(499, explore=False) == 3


def test_of_30_variables_30_pairs_are_formed_and_the_only_relevant_variable_is_learned():
    # All 870 ordered pairs of 30 variables would need two gigabytes with `general`.
    space = gym.spaces.Box(-1.0, 1.0, (30,), dtype=np.float64)
    agent = SDNNQLearning(space, gym.spaces.Discrete(2), preset="small", seed=1)
    assert agent.approximator.n_pairs == 30
    random = np.random.default_rng(1)
    for step in range(2000):
        agent.progress = step / 2000
        x = random.uniform(-1, 1, 30)
        action = agent.act(x)
        agent.learn(Transition(x, action, float(action == (x[5] > 0)), x, True))
    observations = random.uniform(-1, 1, (300, 30))
    greedy = [agent.act(x, explore=False) for x in observations]
    assert np.mean(greedy == (observations[:, 5] > 0)) > 0.9
