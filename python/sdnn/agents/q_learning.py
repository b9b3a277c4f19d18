"""Q-learning with SDNN-C, for any Gymnasium environment with one action dimension."""

from __future__ import annotations

import dataclasses
from typing import Any, Literal

import gymnasium as gym
import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn import _core
from sdnn.agents.transition import Transition
from sdnn.approximators.sdnn_c import SDNNCConfig
from sdnn.choices import choice

__all__ = ["QLearningConfig", "SDNNQLearning"]


@dataclasses.dataclass(frozen=True, kw_only=True)
class QLearningConfig:
    """The parameters of Q-learning; the defaults are the paper's (section 4.2).

    Attributes
    ----------
    learning_rate : float
        alpha, in (0, 1].
    discount : float
        gamma, in [0, 1].
    epsilon : float
        Probability of a random action, in [0, 1].
    n_greedy_steps : int
        First steps of an episode in which epsilon is 0.
    tie_rule : {"uniform", "lowest", "middle"}
        Which of several best actions is taken: any with the same probability, the one with the
        lowest index, or the middle of the widest run of neighbours. A reading.
    """

    learning_rate: float = 0.5
    discount: float = 0.9
    epsilon: float = 0.1
    n_greedy_steps: int = 10
    tie_rule: Literal["uniform", "lowest", "middle"] = "uniform"

    def to_core(self) -> _core.QLearningConfig:
        """Make the core's struct of the same values; ValueError for an unknown ``tie_rule``."""
        fields = dataclasses.asdict(self)
        fields["tie_rule"] = choice(_core.TieRule.__members__, "tie_rule", self.tie_rule)
        return _core.QLearningConfig(**fields)


class SDNNQLearning:
    """An agent that learns Q(s, a) with SDNN-C, one transition at a time.

    Observations are scaled to [0, 1] by the bounds of the observation space; values outside
    saturate. A one-dimensional ``Box`` of actions is cut evenly into the network's actions, 601 by
    default; a ``Discrete`` space gives one window of hidden units per action.

    Parameters
    ----------
    observation_space : gymnasium.spaces.Box, shape (l,)
        Finite bounds, l >= 2.
    action_space : gymnasium.spaces.Box of shape (1,) or gymnasium.spaces.Discrete
    network : SDNNCConfig, optional
        ``n_inputs`` (and ``n_actions``, for a Discrete space) are taken from the spaces.
    learning : QLearningConfig, optional
    seed : int
        The root of every random stream of the agent.

    Raises
    ------
    TypeError
        For spaces of another kind.
    ValueError
        For spaces of another shape or without finite bounds, or impossible settings.

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
    (601,)
    """

    def __init__(
        self,
        observation_space: gym.Space[Any],
        action_space: gym.Space[Any],
        *,
        network: SDNNCConfig | None = None,
        learning: QLearningConfig | None = None,
        seed: int = 0,
    ) -> None:
        self._low, self._high = _finite_bounds("observation_space", observation_space)
        network = dataclasses.replace(network or SDNNCConfig(), n_inputs=self._low.size)
        self.action_space = action_space
        if isinstance(action_space, gym.spaces.Discrete):
            network = dataclasses.replace(network, n_actions=int(action_space.n))
        else:
            low, high = _finite_bounds("action_space", action_space)
            if low.size != 1:
                raise ValueError(f"action_space must have 1 dimension, got {low.size}")
            self._action_low, self._action_high = float(low[0]), float(high[0])
        self.network = network
        self.learning = learning or QLearningConfig()
        self._core = _core.SdnnQLearning(
            network=self.network.to_core(), learning=self.learning.to_core(), seed=seed
        )

    @property
    def n_actions(self) -> int:
        """Number of actions the agent chooses from."""
        return self._core.network.n_actions

    @property
    def actions(self) -> NDArray[Any]:
        """The actions in order, shape (n_actions,): what ``q_values`` are the values of."""
        if isinstance(self.action_space, gym.spaces.Discrete):
            return np.arange(self.n_actions) + int(self.action_space.start)
        return np.array([self._torque(index) for index in range(self.n_actions)])

    def begin_episode(self) -> None:
        """Start counting steps anew, for the greedy first steps of an episode."""
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
        index = self._core.act(self._scaled("observation", observation), explore)
        if isinstance(self.action_space, gym.spaces.Discrete):
            return self.action_space.start + index
        return np.array([self._torque(index)], dtype=self.action_space.dtype)

    def learn(self, transition: Transition) -> None:
        """Learn one transition by Eq. (1).

        Raises
        ------
        ValueError
            If an observation, the action or the reward is not usable; nothing is learned then.
        OverflowError
            If a weight would leave its range; nothing is learned then.
        """
        self._core.learn(
            self._scaled("observation", transition.observation),
            self._index(transition.action),
            float(transition.reward),
            self._scaled("next_observation", transition.next_observation),
            bool(transition.terminated),
        )
        if transition.terminated:
            self.begin_episode()

    def q_values(self, observation: ArrayLike) -> NDArray[np.float64]:
        """Q(observation, a) of every action, shape (n_actions,)."""
        return self._core.network.values(self._scaled("observation", observation))

    def _scaled(self, name: str, observation: ArrayLike) -> NDArray[np.float64]:
        values = np.asarray(observation, dtype=np.float64)
        if values.shape != self._low.shape:
            raise ValueError(f"{name} must have shape {self._low.shape}, got {values.shape}")
        if np.isnan(values).any():
            raise ValueError(f"{name} must not hold NaN, got {values}")
        return np.clip((values - self._low) / (self._high - self._low), 0.0, 1.0)

    def _torque(self, index: int) -> float:
        return _core.action_value(index, self.n_actions, self._action_low, self._action_high)

    def _index(self, action: Any) -> int:
        if isinstance(self.action_space, gym.spaces.Discrete):
            index = int(action) - int(self.action_space.start)
            if not 0 <= index < self.n_actions:
                raise ValueError(f"action must be in {self.action_space}, got {action}")
            return index
        value = np.asarray(action, dtype=np.float64)
        if value.size != 1 or not self._action_low <= value.item() <= self._action_high:
            raise ValueError(
                f"action must be one number in [{self._action_low}, {self._action_high}], "
                f"got {action}"
            )
        share = (value.item() - self._action_low) / (self._action_high - self._action_low)
        return round(share * (self.n_actions - 1))


def _finite_bounds(
    name: str, space: gym.Space[Any]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Read a one-dimensional Box's bounds as doubles; an error that names the argument if not."""
    if not isinstance(space, gym.spaces.Box):
        allowed = "Box or Discrete" if name == "action_space" else "Box"
        raise TypeError(f"{name} must be a {allowed}, got {type(space).__name__}")
    if len(space.shape) != 1:
        raise ValueError(f"{name} must have shape (n,), got {space.shape}")
    low, high = space.low.astype(np.float64), space.high.astype(np.float64)
    if not (np.isfinite(low).all() and np.isfinite(high).all() and (low < high).all()):
        raise ValueError(
            f"{name} must have finite bounds, low < high, got {low} to {high}; "
            "pass a Box with the range that matters: values outside saturate"
        )
    return low, high
