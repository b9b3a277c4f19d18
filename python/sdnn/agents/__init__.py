"""Agents: ``agent.train(env, steps=...)``, or ``act(observation)`` and ``learn(transition)``."""

from sdnn.agents.adapters import UnusableStepError
from sdnn.agents.agent import Agent
from sdnn.agents.base import load_agent
from sdnn.agents.callbacks import (
    Callback,
    CheckpointCallback,
    JSONLines,
    SaveBestAgent,
    Schedule,
    StopTrainingOnNoImprovement,
    StopTrainingOnRewardThreshold,
    TensorBoard,
)
from sdnn.agents.datasets import learn_from
from sdnn.agents.episode import Transition, UnrepeatedEpisodeError
from sdnn.agents.evaluation import Evaluation, evaluate
from sdnn.agents.fixed_rate import FixedRate
from sdnn.agents.fuzzy_q_learning import FuzzyQLearning
from sdnn.agents.q_lambda import SDNNQLambda
from sdnn.agents.q_learning import Preset, RBFQLearning, SDNNQLearning
from sdnn.agents.scaling import Scaling
from sdnn.agents.training import Training, TrainingResult
from sdnn.config import FuzzyQLearningConfig, QLambdaConfig, QLearningConfig

__all__ = [
    "Agent",
    "Callback",
    "CheckpointCallback",
    "Evaluation",
    "FixedRate",
    "FuzzyQLearning",
    "FuzzyQLearningConfig",
    "JSONLines",
    "Preset",
    "QLambdaConfig",
    "QLearningConfig",
    "RBFQLearning",
    "SDNNQLambda",
    "SDNNQLearning",
    "SaveBestAgent",
    "Scaling",
    "Schedule",
    "StopTrainingOnNoImprovement",
    "StopTrainingOnRewardThreshold",
    "TensorBoard",
    "Training",
    "TrainingResult",
    "Transition",
    "UnrepeatedEpisodeError",
    "UnusableStepError",
    "evaluate",
    "learn_from",
    "load_agent",
]
