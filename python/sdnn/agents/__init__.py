"""Agents: ``act(observation)`` and ``learn(transition)``."""

from sdnn.agents.q_learning import QLearningConfig, SDNNQLearning
from sdnn.agents.transition import Transition

__all__ = ["QLearningConfig", "SDNNQLearning", "Transition"]
