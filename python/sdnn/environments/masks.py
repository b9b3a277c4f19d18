"""Environments that report which actions are allowed."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import gymnasium as gym

from sdnn.environments.types import Data, Element, Env, Mask
from sdnn.support.arguments import has_methods, shown


class ActionMasks(gym.Wrapper[Element, Element, Element, Element], gym.utils.RecordConstructorArgs):
    """Adds ``info["action_mask"]``, with 1 for each allowed action, which agents follow.

    `sdnn.agents.Agent.train` and `sdnn.agents.evaluate` follow the masks of environments, or
    vectors of such, whose ``metadata["action_masks"]`` is True, as this wrapper makes it. A step
    that is truncated in a state in which no action is allowed is learned as one that terminates.

    Parameters
    ----------
    env : gymnasium.Env
        With discrete actions.
    mask : callable, optional
        Returns the mask of the present state from the unwrapped environment: 0 or 1 for each action
        of a Discrete space, a tuple of such for MultiDiscrete. By default the environment's info
        has it, as Taxi's does.

    Examples
    --------
    >>> import gymnasium as gym
    >>> from sdnn.agents import SDNNQLambda
    >>> env = ActionMasks(gym.make("Taxi-v4"))
    >>> agent = SDNNQLambda(env.observation_space, env.action_space, seed=1)
    >>> agent.train(env, steps=300).n_steps
    300
    """

    def __init__(self, env: Env, mask: Callable[[Env], Mask] | None = None) -> None:
        gym.utils.RecordConstructorArgs.__init__(self, mask=mask)
        has_methods("env", env, "a Gymnasium environment", "reset", "step")
        super().__init__(env)
        if isinstance(env.action_space, gym.spaces.Box):
            raise ValueError(f"env must have discrete actions, got {env.action_space}")
        if mask is not None and not callable(mask):
            raise TypeError(f"mask must be a function or None, got {shown(mask)}")
        self._mask = mask
        self.metadata = {**(env.metadata or {}), "action_masks": True}

    def reset(self, **kwargs: Any) -> tuple[Element, Data]:
        """Begin an episode."""
        observation, info = self.env.reset(**kwargs)
        return observation, self._with_mask(info)

    def step(self, action: Element) -> tuple[Element, Any, Any, Any, Data]:
        """Take an action."""
        *outcome, info = self.env.step(action)
        return (*outcome, self._with_mask(info))

    def _with_mask(self, info: Data) -> Data:
        """Return an info with the mask of the present state, or as it is without a function."""
        return info if self._mask is None else {**info, "action_mask": self._mask(self.unwrapped)}
