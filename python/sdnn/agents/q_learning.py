"""Q-learning, for any Gymnasium environment with one action dimension."""

from __future__ import annotations

import abc
import dataclasses
from collections.abc import Sequence
from typing import Any, Generic, TypeAlias, TypeVar

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn import _core
from sdnn.agents.presets import PRESETS
from sdnn.agents.q_learning_config import QLearningConfig
from sdnn.agents.spaces import UnitObservations, discrete_actions
from sdnn.agents.transition import Transition
from sdnn.approximators.rbf_network import RBFNetworkConfig
from sdnn.approximators.sdnn_c import SDNNCConfig, pattern_tables
from sdnn.arguments import choice, seed_of

__all__ = ["RBFQLearning", "SDNNQLearning"]


CoreAgent: TypeAlias = _core.SDNNQLearning | _core.RBFQLearning
"""The agents of the C++ core."""

Approximator = TypeVar("Approximator", SDNNCConfig, RBFNetworkConfig)


class _QLearning(abc.ABC, Generic[Approximator]):
    """What Q-learning with any approximator has in common: spaces in, spaces out."""

    def __init__(
        self,
        observation_space: gym.Space[Any],
        action_space: gym.Space[Any],
        approximator: Approximator,
        learning: QLearningConfig | None,
        seed: int,
    ) -> None:
        self._scaled = UnitObservations(observation_space)
        approximator = dataclasses.replace(approximator, n_inputs=self._scaled.n_inputs)
        if isinstance(action_space, gym.spaces.Discrete):
            approximator = dataclasses.replace(approximator, n_actions=int(action_space.n))
        self.action_space = action_space
        self.learning = learning or QLearningConfig()
        self._core = self._make_core(approximator, seed_of(seed))
        n_actions = self._core.action_value.n_actions
        self.approximator: Approximator = dataclasses.replace(approximator, n_actions=n_actions)
        self._actions = discrete_actions(action_space, n_actions)

    @abc.abstractmethod
    def _make_core(self, approximator: Approximator, seed: int) -> CoreAgent:
        """Make the compiled agent; ``learning`` is known."""

    @property
    def core(self) -> CoreAgent:
        """The compiled agent, which shares all that is learned: states in [0, 1], indices.

        ``core.action_value`` is its approximator.
        """
        return self._core

    @property
    def n_actions(self) -> int:
        """Number of actions the agent chooses from."""
        return self._core.action_value.n_actions

    @property
    def actions(self) -> NDArray[Any]:
        """The actions in order, shape (n_actions,): what ``q_values`` are the values of."""
        return self._actions.values

    def begin_episode(self) -> None:
        """Start counting steps anew, for the greedy first steps of an episode.

        To be called at the start of each episode: `learn` never does.
        """
        self._core.begin_episode()

    def act(self, observation: ArrayLike, explore: bool = True) -> Any:
        """Choose the action to take, an element of the action space.

        Parameters
        ----------
        observation : array_like, shape (l,)
        explore : bool
            False: always a best action, and no effect on the agent's later learning.

        Raises
        ------
        ValueError
            If the observation has another shape or holds NaN.
        """
        action = self._core.act(self._scaled("observation", observation), explore)
        return self._actions.take(action) if explore else self._actions.element(action)

    def learn(self, transition: Transition) -> None:
        """Learn one transition by Eq. (1).

        Any action of the space can be learned, not only that of the last `act`; of a ``Box`` the
        nearest one is. A terminated transition begins no episode. With ``n_steps`` above 1 a
        transition waits for those that follow; one that does not begin where the one before it
        ended (another ``observation`` than the last ``next_observation``) begins anew, and
        `begin_episode` learns what still waits.

        Raises
        ------
        ValueError
            If an observation, the action or the reward is not usable; nothing is learned then.
        OverflowError
            If a weight would leave its range; nothing is learned then.
        """
        self._core.learn(
            self._scaled("observation", transition.observation),
            self._actions.core_action(transition.action),
            float(transition.reward),
            self._scaled("next_observation", transition.next_observation),
            bool(transition.terminated),
        )

    def q_values(self, observation: ArrayLike) -> NDArray[np.float64]:
        """Q(observation, a) of every action, shape (n_actions,)."""
        return self._core.action_value.values(self._scaled("observation", observation))


class SDNNQLearning(_QLearning[SDNNCConfig]):
    """An agent that learns Q(s, a) with SDNN-C, one transition at a time.

    Observations are scaled to [0, 1] by the bounds of the observation space; values outside
    saturate. A one-dimensional ``Box`` of actions is cut evenly into the network's actions, 61 by
    default; a ``Discrete`` space gives one window of hidden units per action.

    Parameters
    ----------
    observation_space : gymnasium.spaces.Box, shape (l,)
        Finite bounds, l >= 2.
    action_space : gymnasium.spaces.Box of shape (1,) or gymnasium.spaces.Discrete
    approximator : SDNNCConfig, optional
        ``n_inputs`` (and ``n_actions``, for a Discrete space) are taken from the spaces. By default
        that of the preset.
    learning : QLearningConfig, optional
        By default that of the preset.
    seed : int
        The root of every random stream of the agent.
    tables : sequence of array_like, shape (n_bins, n_pattern_units), optional
        Patterns for each observed variable, of any coding; see `sdnn.approximators.SDNNC`.
    preset : {"robust", "paper"}
        What is used where no settings are given: those recommended, or the paper's; see
        `sdnn.agents.PRESETS`.

    Raises
    ------
    TypeError
        For spaces of another kind.
    ValueError
        For spaces of another shape or without finite bounds, or impossible settings.

    Attributes
    ----------
    approximator : SDNNCConfig
        As used, with ``n_inputs`` and ``n_actions`` filled in.
    learning : QLearningConfig
        As used.

    Examples
    --------
    >>> import gymnasium as gym, sdnn
    >>> from sdnn.agents import SDNNQLearning, Transition
    >>> env = gym.make("sdnn/AcrobotSwingUp-v0")
    >>> agent = SDNNQLearning(env.observation_space, env.action_space, seed=1)
    >>> observation, _ = env.reset(seed=1)
    >>> agent.begin_episode()
    >>> for _ in range(3):
    ...     action = agent.act(observation)
    ...     following, reward, terminated, truncated, _ = env.step(action)
    ...     agent.learn(Transition(observation, action, reward, following, terminated))
    ...     observation = following
    >>> agent.q_values(observation).shape
    (61,)
    """

    def __init__(
        self,
        observation_space: gym.Space[Any],
        action_space: gym.Space[Any],
        *,
        approximator: SDNNCConfig | None = None,
        learning: QLearningConfig | None = None,
        seed: int = 0,
        tables: Sequence[ArrayLike] | None = None,
        preset: str = "robust",
    ) -> None:
        self._tables = None if tables is None else pattern_tables(tables)
        chosen = choice("preset", preset, PRESETS)
        super().__init__(
            observation_space,
            action_space,
            approximator or chosen.approximator,
            learning or chosen.learning,
            seed,
        )

    def _make_core(self, approximator: SDNNCConfig, seed: int) -> _core.SDNNQLearning:
        given = {} if self._tables is None else {"tables": self._tables}
        return _core.SDNNQLearning(
            approximator=approximator.to_core(),
            learning=self.learning.to_core(),
            seed=seed,
            **given,
        )


class RBFQLearning(_QLearning[RBFNetworkConfig]):
    """An agent that learns Q(s, a) with an RBF network, one transition at a time.

    It is the baseline whose cost the paper quotes: normalized Gaussians on an even grid over state
    and action, linear weights, gradient Q-learning. Observations and actions are treated as by
    `SDNNQLearning`; the actions of a ``Discrete`` space are taken as evenly spaced.

    Parameters
    ----------
    observation_space : gymnasium.spaces.Box, shape (d,)
        Finite bounds.
    action_space : gymnasium.spaces.Box of shape (1,) or gymnasium.spaces.Discrete
    approximator : RBFNetworkConfig, optional
        ``n_inputs`` (and ``n_actions``, for a Discrete space) are taken from the spaces.
    learning : QLearningConfig, optional
    seed : int
        The root of every random stream of the agent.

    Raises
    ------
    TypeError
        For spaces of another kind.
    ValueError
        For spaces of another shape or without finite bounds, impossible settings, or more weights
        than ``approximator.max_table_bytes`` allows.

    Attributes
    ----------
    approximator : RBFNetworkConfig
        As used, with ``n_inputs`` and ``n_actions`` filled in.
    learning : QLearningConfig
        As used.

    Examples
    --------
    >>> import gymnasium as gym, sdnn
    >>> from sdnn.agents import RBFQLearning, Transition
    >>> env = gym.make("sdnn/AcrobotSwingUp-v0")
    >>> agent = RBFQLearning(env.observation_space, env.action_space, seed=1)
    >>> observation, _ = env.reset(seed=1)
    >>> agent.begin_episode()
    >>> for _ in range(3):
    ...     action = agent.act(observation)
    ...     following, reward, terminated, truncated, _ = env.step(action)
    ...     agent.learn(Transition(observation, action, reward, following, terminated))
    ...     observation = following
    >>> agent.q_values(observation).shape
    (601,)
    """

    def __init__(
        self,
        observation_space: gym.Space[Any],
        action_space: gym.Space[Any],
        *,
        approximator: RBFNetworkConfig | None = None,
        learning: QLearningConfig | None = None,
        seed: int = 0,
    ) -> None:
        super().__init__(
            observation_space, action_space, approximator or RBFNetworkConfig(), learning, seed
        )

    def _make_core(self, approximator: RBFNetworkConfig, seed: int) -> _core.RBFQLearning:
        return _core.RBFQLearning(
            approximator=approximator.to_core(), learning=self.learning.to_core(), seed=seed
        )
