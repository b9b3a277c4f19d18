"""Steps and resets of vector environments, of any of Gymnasium's autoreset modes."""

from __future__ import annotations

import abc
from collections.abc import Callable, Collection, Iterable, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector.utils import concatenate, create_empty_array, iterate

from sdnn.environments.spaces import has_mask
from sdnn.support.arguments import array_of
from sdnn.training.environments import EnvironmentAdapter, OneEnvironment, Options, Seeds
from sdnn.training.steps import UnusableStepError, has_action_masks, mask_in, reset_env, step_env


def vector_adapter(env: gym.vector.VectorEnv[Any, Any, Any]) -> EnvironmentAdapter:
    """Return the adapter for a vector environment."""
    if type(env) is gym.vector.SyncVectorEnv and getattr(env, "observation_mode", "") == "same":
        return _Listed(env)
    return _SeparateResets(env) if _resets_each(env) else _OwnResets(env)


class _Listed(EnvironmentAdapter):
    """The environments of a ``SyncVectorEnv``, without its own work in each step and reset."""

    can_repeat = True

    def __init__(self, env: gym.vector.SyncVectorEnv) -> None:
        self._env = env
        self._adapters = [OneEnvironment(one) for one in env.envs]
        self.n_environments = env.num_envs
        self.masks = [None] * env.num_envs if has_action_masks(env) else None

    def reset(self, seeds: Seeds, options: Options = None) -> dict[int, Any]:
        first = self._of_each(seeds, lambda one, i: one.reset({0: seeds[i]})[0])
        return dict(zip(seeds, self._converted(first), strict=True))

    def step(self, actions: Sequence[Any]) -> Any:
        made = self._of_each(range(self.n_environments), lambda one, i: one.take(actions[i]))
        seen, self.rewards, self.terminated, self.truncated = map(list, zip(*made, strict=True))
        return self._converted(seen)

    def _of_each(
        self, numbers: Iterable[int], call: Callable[[OneEnvironment, int], Any]
    ) -> list[Any]:
        """Return the result of the call for each environment; errors name the environment."""
        made = []
        for i in numbers:
            try:
                made.append(call(self._adapters[i], i))
            except UnusableStepError as error:
                raise UnusableStepError(f"environment {i}: {error}") from error
        if self.masks is not None:
            self.masks = [one.masks[0] if one.masks else None for one in self._adapters]
        return made

    def _converted(self, seen: list[Any]) -> Any:
        """Return observations in the numbers of their space, as the vector itself does.

        Others stay as they are: the agent refuses them by name.
        """
        space = self._env.single_observation_space
        if any(one.shape != space.shape for one in seen if type(one) is np.ndarray):
            return seen
        if type(space) is gym.spaces.Box and all(type(one) is np.ndarray for one in seen):
            rows = np.array(seen)
            if rows.dtype == space.dtype:
                return rows
        if any(has_mask(space, one) for one in seen):
            return seen  # arrays of the vector have no mask
        batch: Any = create_empty_array(space, len(seen))
        try:
            return _listed(self._env, concatenate(space, seen, batch))
        except (LookupError, TypeError, ValueError):
            return seen


class _Vector(EnvironmentAdapter, abc.ABC):
    """A vector environment: lists in, lists out."""

    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any]) -> None:
        self._env = env
        self._mode = _autoreset_mode(env)
        self.n_environments = env.num_envs
        self.masks = [None] * env.num_envs if has_action_masks(env) else None
        self._begun: list[Any] = []  # masks after resets in the same step

    def _step(self, actions: Any) -> tuple[Any, Any]:
        """Return what is observed, and what is after resets in the same step."""
        observations, rewards, terminated, truncated, infos = step_env(
            self._env, self._batch(actions)
        )
        seen = _listed(self._env, observations)
        self.rewards = self._column("reward", rewards, "fiub", "numbers")
        self.terminated = self._column("terminated", terminated, "b", "bools")
        self.truncated = self._column("truncated", truncated, "b", "bools")
        ended = [a or b for a, b in zip(self.terminated, self.truncated, strict=True)]
        self._take_masks(infos, self.terminated, ended)
        if self._mode == "SAME_STEP" and any(ended):
            if "final_obs" not in infos:
                raise ValueError(
                    "env must give the last observations of episodes in infos['final_obs'] with"
                    f" autoreset in the same step, got {sorted(infos)}"
                )
            last = [infos["final_obs"][i] if ended[i] else one for i, one in enumerate(seen)]
            return last, seen
        return seen, seen

    def _take_masks(self, infos: Any, terminated: Sequence[bool], ended: Sequence[bool]) -> None:
        """Take the masks of what is observed: of episodes that ended, those of their ends."""
        if self.masks is None:
            return
        resets = self._mode == "SAME_STEP"  # infos are then of the next episodes
        masks = self._masks_in(infos, [resets or not one for one in terminated])
        self._begun = list(masks)
        if resets and any(ended):
            cut = [end and not one for end, one in zip(ended, terminated, strict=True)]
            last = self._masks_in(infos.get("final_info", {}), cut)
            masks = [last[i] if end else masks[i] for i, end in enumerate(ended)]
        self.masks = masks

    def _masks_in(self, infos: Any, needed: Sequence[bool]) -> list[Any]:
        """Return the masks of environments in infos, where needed; UnusableStepError without."""
        if not any(needed):
            return [None] * self.n_environments
        found = mask_in(infos)
        own = infos.get("_action_mask", np.ones(self.n_environments, bool))
        for i in np.flatnonzero(needed):
            if not own[i]:
                raise UnusableStepError(f"info of environment {i} must have 'action_mask'")
        rows = list(zip(*found, strict=True)) if isinstance(found, tuple) else found
        return [rows[i] if one else None for i, one in enumerate(needed)]

    def _note_masks(self, infos: Any, begun: Collection[int]) -> None:
        """Note the masks of the environments that were reset."""
        if self.masks is not None:
            rows = self._masks_in(infos, [i in begun for i in range(self.n_environments)])
            self.masks = [rows[i] if i in begun else m for i, m in enumerate(self.masks)]

    def _batch(self, actions: Any) -> Any:
        """Return a copy of the actions as the environment takes them."""
        space: Any = self._env.single_action_space
        if type(actions) is np.ndarray:
            return np.array(actions, space.dtype).reshape(self.n_environments, *space.shape)
        batch: Any = create_empty_array(space, self.n_environments)
        return concatenate(space, actions, batch)

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
        observations, infos = reset_env(self._env, listed, options)
        self._note_masks(infos, seeds)
        seen = _listed(self._env, observations)
        return {i: seen[i] for i in seeds}

    def step(self, actions: Sequence[Any]) -> Any:
        return self._step(actions)[0]


class _OwnResets(_Vector):
    """A vector that resets itself; it is seeded at the beginning only."""

    can_repeat = False

    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any]) -> None:
        super().__init__(env)
        self._seen: Any = None

    def reset(self, seeds: Seeds, options: Options = None) -> dict[int, Any]:
        if self._seen is None:
            observations, infos = reset_env(self._env, seeds[0], None)
            self._note_masks(infos, range(self.n_environments))
            self._seen = _listed(self._env, observations)
        elif self._mode != "SAME_STEP":
            return {}
        elif self.masks is not None:
            self.masks = [self._begun[i] if i in seeds else m for i, m in enumerate(self.masks)]
        return {i: self._seen[i] for i in seeds}

    def step(self, actions: Sequence[Any]) -> Any:
        observations, self._seen = self._step(actions)
        return observations


def _listed(env: gym.vector.VectorEnv[Any, Any, Any], observations: Any) -> Any:
    """Return observations one by one, not copied."""
    if type(observations) is np.ndarray:
        return observations
    return list(iterate(env.observation_space, observations))


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
