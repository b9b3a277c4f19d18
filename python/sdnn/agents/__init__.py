"""Agents: ``agent.train(env, steps=...)``, or ``act(observation)`` and ``learn(transition)``."""

from typing import TYPE_CHECKING, Never

from sdnn.agents.actor_critic import SDNNActorCritic
from sdnn.agents.agent import Agent, load_agent
from sdnn.agents.datasets import learn_from
from sdnn.agents.fixed_rate import FixedRate
from sdnn.agents.fuzzy_q_learning import FuzzyQLearning
from sdnn.agents.imitation import imitate
from sdnn.agents.presets import Preset
from sdnn.agents.q_lambda import SDNNQLambda
from sdnn.agents.q_learning import RBFQLearning, SDNNQLearning
from sdnn.agents.scaling import Scaling
from sdnn.config import ActorCriticConfig, FuzzyQLearningConfig, QLambdaConfig, QLearningConfig
from sdnn.support.habits import error_of_name
from sdnn.training.callbacks import (
    JSONLines,
    SaveBestAgent,
    Schedule,
    StopTrainingOnNoImprovement,
    StopTrainingOnRewardThreshold,
    TensorBoard,
)
from sdnn.training.evaluation import Evaluation, evaluate
from sdnn.training.interfaces import Transition, UnrepeatedEpisodeError, UnusableStepError
from sdnn.training.training import Callback, CheckpointCallback, Training, TrainingResult

__all__ = [
    "ActorCriticConfig",
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
    "SDNNActorCritic",
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
    "imitate",
    "learn_from",
    "load_agent",
]

if not TYPE_CHECKING:  # type checkers would accept every name

    def __getattr__(name: str) -> Never:
        raise error_of_name(__name__, name, __all__)
