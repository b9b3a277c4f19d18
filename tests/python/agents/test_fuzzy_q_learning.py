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
    action[0] = 0.5 * (action[0] + TORQUES.high[0])  # another one within the space
    refuses("action", agent.learn, Transition(here, action, 1.0, here, False))
    agent.learn(Transition(here, copy, 1.0, here, False))
    assert agent.value(here) > 0.0


def test_a_fuzzy_agent_exposes_its_configurations_and_number_of_rules():
    agent = FuzzyQLearning(OBSERVATIONS, TORQUES, approximator=FuzzyRulesConfig(n_sets=5))
    assert agent.approximator == FuzzyRulesConfig(n_inputs=3, n_sets=5)
    assert agent.learning == FuzzyQLearningConfig()
    assert agent.n_rules == 125  # 5 sets for each of 3 inputs


def test_a_rule_that_fires_alone_learns_its_error_times_the_learning_coefficient():
    agent = FuzzyQLearning(OBSERVATIONS, TORQUES, seed=2)
    centre = [0.0, 0.0, 0.0]  # of the middle one of 9 fuzzy sets in each dimension
    rule = 4 * 9**2 + 4 * 9 + 4  # three digits to base 9: the middle set in each dimension
    error = reward = 1.0
    agent.learn(Transition(centre, agent.act(centre), reward, centre, terminated=True))
    learned = agent.learning.learning_coefficient * error
    assert sorted(agent.rule_values(rule).tolist())[-2:] == [0.0, learned]
    assert agent.value(centre) == learned
