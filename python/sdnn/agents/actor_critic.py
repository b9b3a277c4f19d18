"""An actor-critic, linear in the SDNN code, for any Gymnasium environment."""

from __future__ import annotations

from typing import Never

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn import _core
from sdnn.agents.base import presets_of
from sdnn.agents.q_learning import ValueAgent
from sdnn.config import ActorCriticConfig, LinearSDNNConfig


class SDNNActorCritic(ValueAgent[LinearSDNNConfig, ActorCriticConfig]):
    """An agent that learns a softmax policy and the values of states, by traces.

    Both are linear in the SDNN code, with thermometers of single inputs beside it, and all that is
    learned are integers. TD errors count in units of their running root mean square, so no scale of
    rewards has to be known. In each dimension of a ``Box`` the policy chooses among
    ``approximator.n_actions`` actions, which cut it evenly, 5 by the preset; a greedy action is the
    mean of the most probable one and its neighbours. Learning is on-policy: transitions of another
    policy, as in a log, teach the critic rather than the actor.

    Parameters
    ----------
    observation_space, action_space, seed, tables, observation_range, angles, angle_pairs, inputs, \
warm_up_steps, missing, history
        See `Agent`; ``observation_range`` is ``"running"`` by default, so there is no warm-up
        unless inputs or pairs are to be found. Inputs that are left out stay out. ``history`` is
        ``"auto"`` by default; for noisy sensors or hidden velocities give ``angle_pairs="find"``,
        which has a warm-up and lets the observer know how angles turn.
    approximator : LinearSDNNConfig, optional
        ``n_inputs`` (and ``n_actions``, unless actions are a Box) are taken from the spaces;
        ``action_window`` and ``averaging_interval`` have no effect.
    learning : ActorCriticConfig, optional
    preset : {"general"}
        Settings where none are given; see `presets`.

    Examples
    --------
    >>> import gymnasium as gym
    >>> from sdnn.agents import SDNNActorCritic
    >>> env = gym.make("CartPole-v1")
    >>> agent = SDNNActorCritic(env, seed=1)
    >>> result = agent.train(env, steps=1500, seed=1)
    >>> agent.action_probabilities(env.reset(seed=2)[0]).shape
    (2,)
    """

    kind = "actor-critic"
    approximator_type = LinearSDNNConfig
    learning_type = ActorCriticConfig
    presets = presets_of(_core.actor_critic_presets())
    """Settings by name: ``"general"``."""

    def action_probabilities(
        self, observation: ArrayLike, dimension: int = 0
    ) -> NDArray[np.float64]:
        """Return the probability of each action of a dimension, shape (n_actions[dimension],).

        Raises
        ------
        RuntimeError, ValueError
            While the agent is warming up; for arguments that are not usable.
        """
        return self._values(observation, self._dimension(dimension))

    def value(self, observation: ArrayLike) -> float:
        """Return V(observation), the expected discounted return; RuntimeError in a warm-up."""
        variables = self._observations.vector("observation", observation)
        return self._require_warm().state_value(variables)

    @property
    def q_values(self) -> Never:
        """Raise AttributeError: an actor-critic has no values of actions."""
        raise AttributeError(
            "an actor-critic learns no values of actions: use action_probabilities(observation) or"
            " value(observation)"
        )

    @property
    def epsilon(self) -> float:
        """Always 0: the softmax policy explores; ``learning.entropy`` keeps it random."""
        return 0.0

    @epsilon.setter
    def epsilon(self, epsilon: float | None) -> None:
        """Refuse every exploration rate but 0: the policy itself explores."""
        if epsilon:
            raise ValueError(
                f"epsilon must be 0, got {epsilon}: the policy itself is random; set"
                " ActorCriticConfig(entropy=...)"
            )
