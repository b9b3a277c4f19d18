"""Agents: ``act(observation)`` and ``learn(transition)``."""

from sdnn.agents.fuzzy_q_learning import FuzzyQLearning, FuzzyQLearningConfig
from sdnn.agents.q_learning import QLearningConfig, RBFQLearning, SDNNQLearning
from sdnn.agents.transition import Transition

__all__ = [
    "FuzzyQLearning",
    "FuzzyQLearningConfig",
    "QLearningConfig",
    "RBFQLearning",
    "SDNNQLearning",
    "Transition",
]
