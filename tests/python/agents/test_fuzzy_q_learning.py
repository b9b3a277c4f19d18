"""Fuzzy Q-learning in Python; its steps are worked by hand in C++."""

import gymnasium as gym
import numpy as np

from refusals import refuses
from sdnn.agents import FuzzyQLearning, FuzzyQLearningConfig, Transition
from sdnn.approximators import FuzzyRulesConfig

OBSERVATIONS = gym.spaces.Box(-2.0, 2.0, (3,), np.float64)
TORQUES = gym.spaces.Box(-1.0, 3.0, (1,), np.float32)


def test_fuzzy_q_learning_refuses_an_action_that_was_modified():
    agent = FuzzyQLearning(OBSERVATIONS, TORQUES, seed=2)
    here = [0.1, 0.2, 0.3]
    action = agent.act(here)
    copy = action.copy()
    action[0] = 0.5 * (action[0] + 3.0)
    refuses("action", agent.learn, Transition(here, action, 1.0, here, False))
    agent.learn(Transition(here, copy, 1.0, here, False))
    assert agent.value(here) > 0.0


def test_a_fuzzy_agent_exposes_its_configurations_and_number_of_rules():
    agent = FuzzyQLearning(OBSERVATIONS, TORQUES, approximator=FuzzyRulesConfig(n_sets=5))
    assert agent.approximator == FuzzyRulesConfig(n_inputs=3, n_sets=5)
    assert agent.learning == FuzzyQLearningConfig()
    assert agent.n_rules == 125  # 5 sets for each of 3 inputs


def test_a_rule_that_fires_alone_learns_half_of_its_error():
    agent = FuzzyQLearning(OBSERVATIONS, TORQUES, seed=2)
    centre = [0.0, 0.0, 0.0]  # of set 4 of 9 in each of the three dimensions
    agent.learn(Transition(centre, agent.act(centre), 1.0, centre, terminated=True))
    values = agent.rule_values(4 * 81 + 4 * 9 + 4)
    assert sorted(values.tolist())[-2:] == [0.0, 0.5]  # half of the error of 1
    assert agent.value(centre) == 0.5
