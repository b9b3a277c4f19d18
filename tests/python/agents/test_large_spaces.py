"""Discrete observations of any size, and observations of many variables."""

import gymnasium as gym
import numpy as np
import pytest

from sdnn.agents import SDNNQLearning, Transition


def test_a_discrete_observation_is_a_symbol():
    """The right action in a room has nothing to do with the next room."""
    right = np.random.default_rng(1).integers(0, 4, 40)
    agent = SDNNQLearning(gym.spaces.Discrete(40), gym.spaces.Discrete(4), seed=1)
    assert agent.approximator.n_inputs == 2
    assert agent.approximator.n_symbols == (40, 40)
    for room, action in np.random.default_rng(2).permutation(list(np.ndindex(40, 4)) * 15):
        agent.learn(Transition(room, action, float(action == right[room]), room, True))
    report = agent.learning_report()
    assert report["q_range"] == (0.0, 1.25)
    assert report["value_step"] == pytest.approx(1.25 / 520)  # counts from 40 to 560
    assert 0.0 < report["mean_error"] < 0.25
    assert [agent.act(room, explore=False) for room in range(40)] == right.tolist()


def test_a_large_discrete_space_costs_no_more_than_its_patterns():
    """Flattened it has 500 variables, whose pairs no memory would hold."""
    agent = SDNNQLearning(gym.spaces.Discrete(500), gym.spaces.Discrete(6), seed=1)
    n_bytes = sum(array.nbytes for array in agent.state().values())
    assert n_bytes < 10e6
    for place in (0, 7, 499):
        agent.learn(Transition(place, 3, 1.0 + place, 0, True))
    assert agent.act(499, explore=False) == 3


def test_of_many_variables_only_some_pairs_are_formed():
    """All 870 pairs of 30 variables would need two gigabytes with `general`."""
    space = gym.spaces.Box(-1.0, 1.0, (30,), dtype=np.float64)
    agent = SDNNQLearning(space, gym.spaces.Discrete(2), preset="small", seed=1)
    assert agent.approximator.n_pairs == 30
    random = np.random.default_rng(1)
    for step in range(2000):
        agent.progress = step / 2000
        seen = random.uniform(-1, 1, 30)
        action = agent.act(seen)
        agent.learn(Transition(seen, action, float(action == (seen[5] > 0)), seen, True))
    seen = random.uniform(-1, 1, (300, 30))
    greedy = [agent.act(one, explore=False) for one in seen]
    assert np.mean(greedy == (seen[:, 5] > 0)) > 0.9
