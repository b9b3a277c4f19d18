"""The interface of all environments that a training steps, and that of a single one."""

from __future__ import annotations

import abc
from collections.abc import Mapping, Sequence
from typing import Any, TypeAlias

import numpy as np

from sdnn.environments.types import Data, Env
from sdnn.training.steps import (
    checked_outcome,
    copied,
    has_action_masks,
    mask_in,
    reset_env,
    step_env,
)

Seeds: TypeAlias = Mapping[int, int | None]
Options: TypeAlias = Data | None


class EnvironmentAdapter(abc.ABC):
    """The interface of all environments, single and vectorized.

    ``can_repeat`` is whether each environment can be reset at any time, with a seed of its own.
    ``rewards``, ``terminated`` and ``truncated`` are those of the last step in each. ``masks`` are
    those of the actions allowed after the last reset or step in each, None where it has none; None
    altogether where `has_action_masks` is False.
    """

    n_environments: int
    can_repeat: bool
    rewards: list[float]
    terminated: list[bool]
    truncated: list[bool]
    masks: list[Any] | None

    @abc.abstractmethod
    def reset(self, seeds: Seeds, options: Options = None) -> dict[int, Any]:
        """Begin episodes in some environments, with seeds; return their first observations.

        Where one is missing, the episode begins with the next `step`, which returns it.
        """

    @abc.abstractmethod
    def step(self, actions: Sequence[Any]) -> Any:
        """Take an action in each, any one where the episode has not begun.

        Returns what is observed, in an array or a list: the last observations where episodes end.
        """


class OneEnvironment(EnvironmentAdapter):
    """A single environment."""

    n_environments = 1
    can_repeat = True

    def __init__(self, env: Env) -> None:
        self._env = env
        self.rewards, self.terminated, self.truncated = [0.0], [False], [False]
        self.masks = [None] if has_action_masks(env) else None

    def reset(self, seeds: Seeds, options: Options = None) -> dict[int, Any]:
        """Begin its episode."""
        first, info = reset_env(self._env, seeds[0], options)
        if self.masks is not None:
            self.masks = [mask_in(info)]
        return {0: first}

    def take(self, action: Any) -> tuple[Any, float, bool, bool]:
        """Take an action; return what a step gives but for the info."""
        observation, reward, terminated, truncated, info = step_env(self._env, copied(action))
        reward, terminated, truncated = checked_outcome(reward, terminated, truncated)
        if self.masks is not None:
            self.masks = [None if terminated else mask_in(info)]
        return observation, reward, terminated, truncated

    def step(self, actions: Sequence[Any]) -> Any:
        """Take the only action."""
        observation, self.rewards[0], self.terminated[0], self.truncated[0] = self.take(actions[0])
        return observation[np.newaxis] if type(observation) is np.ndarray else [observation]
