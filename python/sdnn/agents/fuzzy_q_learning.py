"""Fuzzy Q-learning, for any Gymnasium environment with continuous actions."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn import _core
from sdnn.agents.actions import Actions, ContinuousActions
from sdnn.agents.agent import Agent, check_shape
from sdnn.agents.observations import AnglePairs, Ranges
from sdnn.arguments import whole
from sdnn.config import FuzzyQLearningConfig, FuzzyRulesConfig

__all__ = ["FuzzyQLearning"]


class FuzzyQLearning(Agent[FuzzyRulesConfig, FuzzyQLearningConfig]):
    """An agent that learns by Jouffe's fuzzy Q-learning, one transition at a time.

    Every fired rule picks one of its discrete actions; the action taken is their mean, weighted by
    the truth values, hence continuous. Each dimension of an action has rules of its own, which
    learn as if the others were part of the environment.

    Only the transition of the last exploring `act` in an environment can be learned: which rule
    picked what is known of no other. What a warm-up did is therefore not learned.

    Parameters
    ----------
    observation_space : gymnasium.Space
        See `Agent`.
    action_space : gymnasium.spaces.Box
        Finite bounds.
    approximator : FuzzyRulesConfig, optional
        ``n_inputs`` is taken from the observation space.
    learning : FuzzyQLearningConfig, optional
    seed : int
        The root of every random stream of the agent.
    observation_range, angles, angle_pairs, warm_up_steps
        See `Agent`. An angle is scaled like any other variable: the rules know no circle.

    Raises
    ------
    TypeError
        For spaces of another kind.
    ValueError
        For spaces, ranges or settings that are impossible, or a larger table than
        ``approximator.max_table_bytes`` allows.

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
    >>> env = gym.make("sdnn.environments:sdnn/AcrobotSwingUp-v0")
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

    approximator_type = FuzzyRulesConfig
    learning_type = FuzzyQLearningConfig
    learns_any_transition = False

    def __init__(
        self,
        observation_space: gym.Space[Any],
        action_space: gym.Space[Any],
        *,
        approximator: FuzzyRulesConfig | None = None,
        learning: FuzzyQLearningConfig | None = None,
        seed: int = 0,
        observation_range: Ranges | None = None,
        angles: Sequence[int] = (),
        angle_pairs: AnglePairs = "none",
        warm_up_steps: int = 1000,
    ) -> None:
        super().__init__(
            observation_space,
            action_space,
            FuzzyRulesConfig() if approximator is None else approximator,
            FuzzyQLearningConfig() if learning is None else learning,
            seed=seed,
            observation_range=observation_range,
            angles=angles,
            angle_pairs=angle_pairs,
            warm_up_steps=warm_up_steps,
        )

    def _make_actions(self, space: gym.Space[Any]) -> Actions:
        return ContinuousActions(space)

    def _make(self) -> Any:
        self.approximator = self.approximator.replace(n_inputs=self._observations.n_inputs)
        approximator, learning = self._core_approximator(), self.learning
        if self._is_scalar:
            return _core.FuzzyQLearning(
                approximator=approximator, learning=learning, seed=self.seed
            )
        return _core.VectorFuzzyQLearning(
            approximator=approximator,
            n_dimensions=self._actions.n_dimensions,
            learning=learning,
            seed=self.seed,
        )

    @property
    def _is_scalar(self) -> bool:
        return self._actions.n_dimensions == 1

    def _remember_actions(self, taken: Mapping[str, NDArray[Any]]) -> None:
        for environment in range(self.n_environments):
            last = self._compiled.last_action(environment)
            self._actions.take([last] if self._is_scalar else last, environment)

    def _act(self, state: NDArray[np.float64], explore: bool, environment: int) -> list[Any]:
        chosen: Any = self._compiled.act(state, explore, environment)
        return [chosen] if self._is_scalar else chosen

    def _learn(
        self,
        state: NDArray[np.float64],
        numbers: list[Any],
        reward: float,
        following: NDArray[np.float64],
        terminated: bool,
        environment: int,
    ) -> None:
        action = numbers[0] if self._is_scalar else numbers
        try:
            self._compiled.learn(state, action, reward, following, terminated, environment)
        except ValueError as error:
            if "exploring act" not in str(error):
                raise
            raise ValueError(
                f"observation and action must be those of the last exploring act: {error}"
            ) from error

    def _check_state(self, state: Mapping[str, NDArray[Any]]) -> None:
        sizes = self.approximator
        shape = (sizes.n_sets**self._observations.n_inputs, sizes.n_actions)
        n = self._actions.n_dimensions
        for prefix in [""] if n == 1 else [f"{dimension}." for dimension in range(n)]:
            check_shape(state, f"{prefix}rules.values", shape)

    @property
    def core(self) -> Any:
        """The compiled agent, which shares all that is learned: states [0, 1], actions [-1, 1].

        ``core.rules`` is its table of rules. Of the first dimension, where there are several.

        Raises
        ------
        RuntimeError
            While the agent is warming up.
        """
        compiled = self._born()
        return compiled if self._is_scalar else compiled.part(0)

    @property
    def n_rules(self) -> int:
        """Number of rules of a dimension, ``n_sets ** n_inputs``."""
        n_rules: int = self.core.rules.n_rules
        return n_rules

    def value(self, observation: ArrayLike) -> float:
        """V(observation): the truth-weighted mean of every fired rule's best value.

        The mean over the dimensions, where there are several.
        """
        state = self._state("observation", observation)
        return float(self._compiled.value(state))

    def rule_values(self, rule: int) -> NDArray[np.float32]:
        """v(rule, a) of every discrete action, shape (n_actions,); of the first dimension."""
        rule = whole("rule", rule, 0, self.n_rules - 1)
        values: NDArray[np.float32] = self.core.rules.values(rule)
        return values
