"""Fuzzy Q-learning, for any Gymnasium environment with one continuous action."""

from __future__ import annotations

import dataclasses
from typing import Any, Literal

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn import _core
from sdnn.agents.spaces import ContinuousActions, UnitObservations
from sdnn.agents.transition import Transition
from sdnn.approximators.fuzzy_rules import FuzzyRulesConfig
from sdnn.arguments import seed_of
from sdnn.config import added_later, to_core

__all__ = ["FuzzyQLearning", "FuzzyQLearningConfig"]


@dataclasses.dataclass(frozen=True, kw_only=True)
class FuzzyQLearningConfig:
    """The parameters of fuzzy Q-learning; the defaults are the paper's (section 4.3).

    Attributes
    ----------
    learning_coefficient : float
        c_fql, in (0, 1]. A reading: the paper does not give it; 0.1 and 1.0 are alternatives.
    discount : float
        gamma, in [0, 1].
    trace_decay : float
        lambda of accumulating eligibility traces, in [0, 1]; 0: none, as in the paper.
    epsilon : float
        Probability that a fired rule picks a random action, each rule for itself, in [0, 1].
    n_greedy_steps : int
        First steps of an episode in which epsilon is 0.
    tie_rule : {"uniform", "lowest", "middle"}
        Which of several best actions a rule picks; see `QLearningConfig`. A reading.
    tie_tolerance : float
        Values at most this far below the best tie with it, >= 0.
    """

    learning_coefficient: float = 0.5
    discount: float = 0.9
    trace_decay: float = 0.0
    epsilon: float = 0.1
    n_greedy_steps: int = 10
    tie_rule: Literal["uniform", "lowest", "middle"] = "uniform"
    tie_tolerance: float = added_later(0.0)

    def to_core(self) -> _core.FuzzyQLearningConfig:
        """Make the core's struct of the same values; see `sdnn.config.to_core`."""
        return to_core(self, _core.FuzzyQLearningConfig)


class FuzzyQLearning:
    """An agent that learns by Jouffe's fuzzy Q-learning, one transition at a time.

    Every fired rule picks one of its discrete actions; the action taken is their mean, weighted by
    the truth values, hence continuous. Observations are scaled to [0, 1] by the bounds of the
    observation space; values outside saturate.

    Parameters
    ----------
    observation_space : gymnasium.spaces.Box, shape (d,)
        Finite bounds.
    action_space : gymnasium.spaces.Box, shape (1,)
        Finite bounds.
    approximator : FuzzyRulesConfig, optional
        ``n_inputs`` is taken from the observation space.
    learning : FuzzyQLearningConfig, optional
    seed : int
        The root of every random stream of the agent.

    Raises
    ------
    TypeError
        For spaces of another kind.
    ValueError
        For spaces of another shape or without finite bounds, impossible settings, or a larger table
        than ``approximator.max_table_bytes`` allows.

    Attributes
    ----------
    approximator : FuzzyRulesConfig
        As used.
    learning : FuzzyQLearningConfig
        As used.

    Examples
    --------
    >>> import gymnasium as gym, sdnn
    >>> from sdnn.agents import FuzzyQLearning, Transition
    >>> env = gym.make("sdnn/AcrobotSwingUp-v0")
    >>> agent = FuzzyQLearning(env.observation_space, env.action_space, seed=1)
    >>> observation, _ = env.reset(seed=1)
    >>> agent.begin_episode()
    >>> for _ in range(3):
    ...     action = agent.act(observation)
    ...     following, reward, terminated, truncated, _ = env.step(action)
    ...     agent.learn(Transition(observation, action, reward, following, terminated))
    ...     observation = following
    >>> agent.n_rules
    6561
    """

    def __init__(
        self,
        observation_space: gym.Space[Any],
        action_space: gym.Space[Any],
        *,
        approximator: FuzzyRulesConfig | None = None,
        learning: FuzzyQLearningConfig | None = None,
        seed: int = 0,
    ) -> None:
        self._scaled = UnitObservations(observation_space)
        self._actions = ContinuousActions(action_space)
        self.action_space = action_space
        self.approximator = dataclasses.replace(
            approximator or FuzzyRulesConfig(), n_inputs=self._scaled.n_inputs
        )
        self.learning = learning or FuzzyQLearningConfig()
        self._core = _core.FuzzyQLearning(
            approximator=self.approximator.to_core(),
            learning=self.learning.to_core(),
            seed=seed_of(seed),
        )

    @property
    def core(self) -> _core.FuzzyQLearning:
        """The compiled agent, which shares all that is learned: states [0, 1], actions [-1, 1].

        ``core.rules`` is its table of rules.
        """
        return self._core

    @property
    def n_rules(self) -> int:
        """Number of rules, ``n_sets ** n_inputs``."""
        return self._core.rules.n_rules

    def begin_episode(self) -> None:
        """Start counting steps anew, for the greedy first steps of an episode; forget traces.

        To be called at the start of each episode: `learn` never does.
        """
        self._core.begin_episode()

    def act(self, observation: ArrayLike, explore: bool = True) -> Any:
        """Choose the action to take, an element of the action space.

        Parameters
        ----------
        observation : array_like, shape (d,)
        explore : bool
            False: every rule picks a best action, and nothing is remembered: `learn` still waits
            for the transition of the last exploring act.

        Raises
        ------
        ValueError
            If the observation has another shape or holds NaN.
        """
        action = self._core.act(self._scaled("observation", observation), explore)
        return self._actions.take(action) if explore else self._actions.element(action)

    def learn(self, transition: Transition) -> None:
        """Learn the transition that began with the last exploring `act`.

        Other transitions cannot be learned: which rule picked what is known of that act only. A
        terminated transition ends the eligibility traces, but begins no episode.

        Raises
        ------
        ValueError
            If observation and action are not those of the last exploring act, or the next
            observation or the reward is not usable; nothing is learned then.
        OverflowError
            If a value would leave the range of 32-bit floats; nothing is learned then.
        """
        self._core.learn(
            self._scaled("observation", transition.observation),
            self._actions.core_action(transition.action),
            float(transition.reward),
            self._scaled("next_observation", transition.next_observation),
            bool(transition.terminated),
        )

    def value(self, observation: ArrayLike) -> float:
        """V(observation): the truth-weighted mean of every fired rule's best value."""
        return self._core.value(self._scaled("observation", observation))

    def rule_values(self, rule: int) -> NDArray[np.float32]:
        """v(rule, a) of every discrete action, shape (n_actions,)."""
        return self._core.rules.values(rule)
