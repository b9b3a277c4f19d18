"""What users of other libraries and of notebooks expect of an agent."""

from __future__ import annotations

import abc
from typing import Any

import gymnasium as gym
import numpy as np

from sdnn.arguments import flag
from sdnn.display import Displayed


class Model(Displayed, abc.ABC):
    """An agent that predicts as models of Stable-Baselines3 do, and shows what it is."""

    observation_space: gym.Space[Any]
    action_space: gym.Space[Any]
    seed: int

    @property
    @abc.abstractmethod
    def is_warming_up(self) -> bool:
        """Whether the agent still acts at random to see the ranges of its observations."""

    @property
    @abc.abstractmethod
    def inputs(self) -> list[tuple[str, list[int]]]:
        """Inputs of the network in order, with the observed variables that they are made of."""

    @abc.abstractmethod
    def act(self, observation: Any, explore: bool = True, environment: int = 0) -> Any:
        """Return the action to take."""

    def predict(
        self,
        observation: Any,
        state: None = None,
        episode_start: Any = None,
        deterministic: bool = True,
    ) -> tuple[Any, None]:
        """Choose as Stable-Baselines3's models do, for its tools such as ``evaluate_policy``.

        Parameters
        ----------
        observation : element of the observation space, or an array of several
            Several are those of a vector environment, along the first axis.
        state, episode_start
            Of recurrent models; not used.
        deterministic : bool
            False: explore, as `act` does, in environment 0.

        Returns
        -------
        The action, or an array of actions along the first axis, and None.
        """
        explore = not flag("deterministic", deterministic)
        space = self.observation_space
        is_array = isinstance(observation, np.ndarray) and space.shape is not None
        if is_array and observation.ndim == len(space.shape or ()) + 1:
            return np.stack([self.act(one, explore) for one in observation]), None
        return self.act(observation, explore), None

    def _facts(self) -> dict[str, object]:
        """Return what is shown of it."""
        inputs = "found in the warm-up" if self.is_warming_up else len(self.inputs)
        return {
            "observation": self.observation_space,
            "action": self.action_space,
            "inputs": inputs,
            "seed": self.seed,
        }
