"""What users of other libraries and of notebooks expect of an agent."""

from __future__ import annotations

import abc
from collections.abc import Iterable, Mapping, Sequence
from typing import Any

import gymnasium as gym
import numpy as np

from sdnn.arguments import argument_error, blamed, flag, shown
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
    def act(
        self, observation: Any, explore: bool = True, environment: int = 0, mask: Any = None
    ) -> Any:
        """Return the action to take."""

    def predict(
        self,
        observation: Any,
        state: None = None,
        episode_start: Any = None,
        deterministic: bool = True,
        action_masks: Any = None,
    ) -> tuple[Any, None]:
        """Choose as Stable-Baselines3's models do, for its tools such as ``evaluate_policy``.

        Parameters
        ----------
        observation : element of the observation space, or a batch of several
            A batch is what a vector environment gives: arrays with one axis more, the first one,
            in a Dict or Tuple where the space is one.
        state, episode_start
            Of recurrent models; not used.
        deterministic : bool
            False: explore, as `act` does, in environment 0.
        action_masks : optional
            As the mask of `act`, of a batch one for each.

        Returns
        -------
        The action, or an array of actions along the first axis, and None.
        """
        explore = not flag("deterministic", deterministic)
        several = _unbatched(self.observation_space, observation)
        if several is None:
            return self._masked_action(observation, explore, action_masks), None
        masks = [None] * len(several) if action_masks is None else action_masks
        if not hasattr(masks, "__len__") or len(masks) != len(several):
            expected = f"one for each of {len(several)} observations"
            raise argument_error("action_masks", f"must be {expected}, got {shown(action_masks)}")
        pairs = zip(several, masks, strict=True)
        return np.stack([self._masked_action(one, explore, mask) for one, mask in pairs]), None

    def _masked_action(self, observation: Any, explore: bool, mask: Any) -> Any:
        try:
            return self.act(observation, explore, mask=mask)
        except ValueError as error:
            name, problem = blamed(error)
            if name != "mask":
                raise
            raise argument_error("action_masks", problem) from error

    def _facts(self) -> dict[str, object]:
        """Return what is shown of it."""
        inputs = "found in the warm-up" if self.is_warming_up else len(self.inputs)
        return {
            "observation": self.observation_space,
            "action": self.action_space,
            "inputs": inputs,
            "seed": self.seed,
        }


def _unbatched(space: gym.Space[Any], observation: Any) -> Sequence[Any] | None:
    """Return the elements of a batch of observations; None if it is no batch."""
    if isinstance(space, gym.spaces.Dict):
        if not isinstance(observation, Mapping) or set(observation) != set(space):
            return None
        columns = _columns((space[name], observation[name]) for name in space)
        if columns is None:
            return None
        return [dict(zip(space, row, strict=True)) for row in zip(*columns, strict=True)]
    if isinstance(space, gym.spaces.Tuple):
        if not isinstance(observation, tuple) or len(observation) != len(space):
            return None
        columns = _columns(zip(space, observation, strict=True))
        return None if columns is None else list(zip(*columns, strict=True))
    is_array = isinstance(observation, np.ndarray) and space.shape is not None
    is_batch = is_array and observation.ndim == len(space.shape or ()) + 1
    return observation if is_batch else None


def _columns(parts: Iterable[tuple[gym.Space[Any], Any]]) -> list[Sequence[Any]] | None:
    """Return the elements of each part of a batch; None if these are not equally many."""
    columns = [_unbatched(space, part) for space, part in parts]
    found = [column for column in columns if column is not None]
    is_batch = len(found) == len(columns) and len({len(column) for column in found}) == 1
    return found if is_batch else None
