"""Agents: ``act(observation)`` and ``learn(transition)``."""

from sdnn.agents.fuzzy_q_learning import FuzzyQLearning, FuzzyQLearningConfig
from sdnn.agents.presets import PRESETS, Preset
from sdnn.agents.q_learning import RBFQLearning, SDNNQLearning
from sdnn.agents.q_learning_config import QLearningConfig
from sdnn.agents.transition import Transition

__all__ = [
    "PRESETS",
    "FuzzyQLearning",
    "FuzzyQLearningConfig",
    "Preset",
    "QLearningConfig",
    "RBFQLearning",
    "SDNNQLearning",
    "Transition",
]
