"""Steps and resets of vector environments, of any of Gymnasium's autoreset modes."""

from __future__ import annotations

import abc
import copy
from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector.utils import concatenate, create_empty_array, iterate

from sdnn.agents.episode import (
    EnvironmentAdapter,
    Options,
    Seeds,
    StepResult,
    UnusableStepError,
    reset_env,
    step_env,
)
from sdnn.arguments import array_of


def vector_adapter(env: gym.vector.VectorEnv[Any, Any, Any]) -> EnvironmentAdapter:
    """Return the adapter for a vector environment."""
    return _SeparateResets(env) if _resets_each(env) else _OwnResets(env)


class _Vector(EnvironmentAdapter, abc.ABC):
    """A vector environment: lists in, lists out."""

    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any]) -> None:
        self._env = env
        self._mode = _autoreset_mode(env)
        self.n_environments = env.num_envs

    def _step(self, actions: Sequence[Any]) -> tuple[list[StepResult], list[Any]]:
        """Return the outcomes, and what is observed after resets in the same step."""
        space = self._env.single_action_space
        batch: Any = create_empty_array(space, self.n_environments)
        observations, rewards, terminated, truncated, infos = step_env(
            self._env, concatenate(space, actions, batch)
        )
        rewards = self._column("reward", rewards, "fiub", "numbers")
        terminated = self._column("terminated", terminated, "b", "bools")
        truncated = self._column("truncated", truncated, "b", "bools")
        seen = self._listed(observations)
        last = list(seen)
        if self._mode == "SAME_STEP":
            for i in np.flatnonzero(np.logical_or(terminated, truncated)):
                if "final_obs" not in infos:
                    raise ValueError(
                        "env must give the last observations of episodes in infos['final_obs']"
                        f" with autoreset in the same step, got {sorted(infos)}"
                    )
                last[i] = copy.deepcopy(infos["final_obs"][i])
        outcomes = [
            StepResult(last[i], rewards[i], terminated[i], truncated[i])
            for i in range(self.n_environments)
        ]
        return outcomes, seen

    def _column(self, name: str, values: Any, kinds: str, what: str) -> list[Any]:
        """Return one value for each environment; UnusableStepError if there are others."""
        what = f"{self.n_environments} {what}"
        try:
            column = array_of(name, values, kinds, what)
        except ValueError as error:
            raise UnusableStepError(f"env.step must return arrays: {error}") from None
        if column.shape != (self.n_environments,):
            raise UnusableStepError(
                f"env.step must return arrays: {name} must be {what}, got shape {column.shape}"
            )
        return list(column.tolist())

    def _listed(self, observations: Any) -> list[Any]:
        # A copy: some vector environments write to the same array again.
        return list(iterate(self._env.observation_space, copy.deepcopy(observations)))


class _SeparateResets(_Vector):
    """A vector in which each environment is reset by itself, whatever the autoreset mode.

    A reset replaces the one that would come with the next step or came with the last.
    """

    can_repeat = True

    def reset(self, seeds: Seeds, options: Options = None) -> dict[int, Any]:
        mask = np.array([i in seeds for i in range(self.n_environments)])
        # Without the option where it is not needed: some wrappers have complete resets only.
        options = None if mask.all() else {"reset_mask": mask}
        listed: Any = [seeds.get(i) for i in range(self.n_environments)]
        observations = reset_env(self._env, listed, options)
        seen = self._listed(observations)
        return {i: seen[i] for i in seeds}

    def step(self, actions: Sequence[Any]) -> list[StepResult]:
        return self._step(actions)[0]


class _OwnResets(_Vector):
    """A vector that resets itself; it is seeded at the beginning only."""

    can_repeat = False

    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any]) -> None:
        super().__init__(env)
        self._seen: list[Any] | None = None
        self._taken: list[Any] = []

    def reset(self, seeds: Seeds, options: Options = None) -> dict[int, Any]:
        if self._seen is None:
            observations = reset_env(self._env, seeds[0], None)
            self._seen = self._listed(observations)
        elif self._mode != "SAME_STEP":
            return {}
        return {i: self._seen[i] for i in seeds}

    def step(self, actions: Sequence[Any]) -> list[StepResult]:
        # An environment that resets ignores its action, but must be given one.
        old = self._taken or list(actions)
        self._taken = [old[i] if action is None else action for i, action in enumerate(actions)]
        outcomes, self._seen = self._step(self._taken)
        return outcomes


def _autoreset_mode(env: gym.vector.VectorEnv[Any, Any, Any]) -> str:
    """Return the name in Gymnasium's ``AutoresetMode``."""
    # Not by the metadata first: in Gymnasium 1.1 these may be another vector's.
    mode = getattr(env.unwrapped, "autoreset_mode", env.metadata.get("autoreset_mode"))
    return "NEXT_STEP" if mode is None else str(gym.vector.AutoresetMode(mode).name)


def _resets_each(env: gym.vector.VectorEnv[Any, Any, Any]) -> bool:
    """Return whether ``reset`` takes the option ``"reset_mask"`` and a seed per environment."""
    inner = env
    while isinstance(inner, gym.vector.VectorWrapper):
        if isinstance(inner, gym.wrappers.vector.NormalizeObservation):
            return False  # it resets all or none
        inner = inner.env
    if inner.metadata.get("reset_mask"):
        return True
    mode = _autoreset_mode(env)
    if isinstance(inner, gym.vector.AsyncVectorEnv) and not inner.shared_memory:
        return mode != "NEXT_STEP"  # the next step would reset once more (Gymnasium 1.4)
    known = (gym.vector.SyncVectorEnv, gym.vector.AsyncVectorEnv)
    return mode == "DISABLED" or isinstance(inner, known)
