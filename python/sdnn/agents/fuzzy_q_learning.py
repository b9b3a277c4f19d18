"""Fuzzy Q-learning, for any Gymnasium environment with continuous actions."""

from __future__ import annotations

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn import _core
from sdnn.agents.agent import Agent
from sdnn.agents.base import presets_of
from sdnn.config import FuzzyQLearningConfig, FuzzyRulesConfig
from sdnn.environments.types import Space
from sdnn.support.arguments import whole


class FuzzyQLearning(Agent[FuzzyRulesConfig, FuzzyQLearningConfig]):
    """An agent that learns by Jouffe's fuzzy Q-learning, one transition at a time.

    Every fired rule picks one of its discrete actions; the action taken is their mean, weighted by
    the truth values, hence continuous. Each dimension of an action has rules of its own, which
    learn as if the others were part of the environment.

    Only the transition of the last exploring `act` in an environment can be learned: which rule
    picked what is known of no other. What a warm-up did is therefore not learned.

    Parameters are those of `Agent`, without ``tables``; ``action_space`` must be a Box. An angle is
    scaled like any other variable: the rules know no circle. ValueError for a larger table than
    ``approximator.max_table_bytes`` allows.

    Examples
    --------
    >>> import gymnasium as gym, sdnn
    >>> from sdnn.agents import FuzzyQLearning
    >>> env = gym.make("sdnn.environments:sdnn/AcrobotSwingUp-v0")
    >>> agent = FuzzyQLearning(env, seed=1)
    >>> agent.train(env, steps=3).n_steps
    3
    >>> agent.n_rules
    6561
    """

    kind = "fuzzy"
    approximator_type = FuzzyRulesConfig
    learning_type = FuzzyQLearningConfig
    presets = presets_of({"paper": ("paper", FuzzyRulesConfig(), FuzzyQLearningConfig())})
    default_preset = "paper"

    def _take_spaces(self, observations: Space, actions: Space) -> None:
        if not isinstance(actions, gym.spaces.Box):
            raise TypeError(f"action_space must be a Box, got {type(actions).__name__}")
        super()._take_spaces(observations, actions)

    @property
    def rules(self) -> list[_core.FuzzyRules]:
        """The compiled rules of each dimension of actions, which share all that is learned.

        States are in [0, 1]. RuntimeError while the agent is warming up.
        """
        return self._require_warm().networks

    @property
    def n_rules(self) -> int:
        """Number of rules of a dimension, ``n_sets ** n_inputs``."""
        return self.rules[0].n_rules

    def value(self, observation: ArrayLike) -> float:
        """V(observation): the truth-weighted mean of every fired rule's best value.

        The mean over the dimensions, where there are several.
        """
        values = [self._values(observation, d)[0] for d in range(self.n_dimensions)]
        return float(sum(values) / self.n_dimensions)

    def rule_values(self, rule: int, dimension: int = 0) -> NDArray[np.float32]:
        """v(rule, a) of every discrete action of a dimension, shape (n_actions,)."""
        rules = self.rules[self._dimension(dimension)]
        return rules.values(whole("rule", rule, 0, rules.n_rules - 1))
