"""Steps and resets of vector environments, of any of Gymnasium's autoreset modes."""

from __future__ import annotations

import abc
from collections.abc import Callable, Collection, Iterable, Sequence
from typing import Any

import gymnasium as gym
import numpy as np
from gymnasium.vector.utils import concatenate, create_empty_array, iterate
from numpy import ndarray

from sdnn.environments.spaces import has_mask
from sdnn.environments.types import Element, Elements, Info, Mask, VectorEnv
from sdnn.support.arguments import array_of, shown
from sdnn.training.episodes import SingleEnvironment, announces, reset_env, step_env
from sdnn.training.interfaces import (
    EnvironmentAdapter,
    Options,
    Seeds,
    UnusableStepError,
    missing_in_info,
)


def vector_adapter(env: VectorEnv) -> EnvironmentAdapter:
    """Return the adapter for a vector environment."""
    if type(env) is gym.vector.SyncVectorEnv and getattr(env, "observation_mode", "") == "same":
        return _SyncEnvironments(env)
    return _SeparateResets(env) if _resets_each(env) else _AutomaticResets(env)


class _SyncEnvironments(EnvironmentAdapter):
    """The environments of a ``SyncVectorEnv``, stepped one by one: faster than the vector."""

    can_repeat = True

    def __init__(self, env: gym.vector.SyncVectorEnv) -> None:
        self._env = env
        self._adapters = [SingleEnvironment(single) for single in env.envs]
        self._space = env.single_observation_space
        self.n_environments = env.num_envs
        self.masks = [None] * env.num_envs if announces(env, "action_masks") else None
        self.dts = [1.0] * env.num_envs if announces(env, "durations") else None
        for adapter in self._adapters:
            adapter.dts = None if self.dts is None else [1.0]  # the vector's metadata decide

    def reset(self, seeds: Seeds, options: Options = None) -> dict[int, Element]:
        first = self._call_each(seeds, lambda env, i: env.reset({0: seeds[i]})[0])
        return dict(zip(seeds, self._converted(first), strict=True))

    def step(self, actions: Elements) -> Elements:
        """Step every environment, and set `rewards`, `terminated` and `truncated`."""
        steps = self._call_each(range(self.n_environments), lambda env, i: env.take(actions[i]))
        columns = map(list, zip(*steps, strict=True))
        observations, self.rewards, self.terminated, self.truncated = columns
        return self._converted(observations)

    def _call_each(
        self, environments: Iterable[int], call: Callable[[SingleEnvironment, int], Any]
    ) -> list[Any]:
        """Call a function for each of the environments; return its results.

        Then store the masks and durations of all. Errors name the environment.
        """
        results = []
        for i in environments:
            try:
                results.append(call(self._adapters[i], i))
            except UnusableStepError as error:
                raise UnusableStepError(f"environment {i}: {error}") from error
        if self.masks is not None:
            self.masks = [env.masks[0] if env.masks else None for env in self._adapters]
        if self.dts is not None:
            self.dts = [env.dts[0] for env in self._adapters if env.dts]
        return results

    def _converted(self, observations: list[Element]) -> Elements:
        """Convert observations to the type of their space, as the vector itself does.

        Observations that do not fit are returned unchanged: the agent's error names them.
        """
        space, dtype = self._space, self._space.dtype
        if all(type(x) is ndarray and x.dtype is dtype for x in observations):
            return observations
        if any(has_mask(space, observation) for observation in observations):
            return observations  # the vector's arrays would drop the mask of a masked array
        batch: Any = create_empty_array(space, len(observations))
        try:
            return _split_batch(self._env, concatenate(space, observations, batch))
        except (LookupError, TypeError, ValueError):
            return observations


class _Vector(EnvironmentAdapter, abc.ABC):
    """Base of adapters for vector environments: converts batches to lists and back."""

    def __init__(self, env: VectorEnv) -> None:
        self._env = env
        self._mode = _autoreset_mode(env)
        self.n_environments = env.num_envs
        self.masks = [None] * env.num_envs if announces(env, "action_masks") else None
        self.dts = [1.0] * env.num_envs if announces(env, "durations") else None
        self._begun: list[Mask] = []  # masks of episodes that began within the last step
        self._resetting: Collection[int] = ()
        """Environments in which the next step is a reset, whose info has no duration."""

    def _step(self, actions: Elements) -> tuple[Elements, Elements]:
        """Step all environments, and store the outcome.

        Returns the observations after the step, where an episode ended its last one; and those
        after the resets of mode ``SAME_STEP``, in other modes the same ones.
        """
        batch, rewards, terminated, truncated, infos = step_env(self._env, self._batch(actions))
        observations = _split_batch(self._env, batch)
        self.rewards = self._column("reward", rewards, "fiub", "numbers")
        self.terminated = self._column("terminated", terminated, "b", "bools")
        self.truncated = self._column("truncated", truncated, "b", "bools")
        ended = [a or b for a, b in zip(self.terminated, self.truncated, strict=True)]
        self._take_masks(infos, self.terminated, ended)
        if self.dts is not None:
            self.dts = self._durations_in(infos, ended)
        if self._mode == "SAME_STEP" and any(ended):
            if "final_obs" not in infos:
                raise ValueError(
                    "env must give the last observations of episodes in infos['final_obs'] with"
                    f" autoreset in the same step, got {sorted(infos)}"
                )
            final = infos["final_obs"]
            last = [final[i] if ended[i] else x for i, x in enumerate(observations)]
            return last, observations
        return observations, observations

    def _take_masks(self, infos: Info, terminated: Sequence[bool], ended: Sequence[bool]) -> None:
        """Store the masks after a step; where an episode ended, the mask of its last state.

        A terminal state needs none. In mode ``SAME_STEP`` infos belong to the next episode where
        one has ended, and ``final_info`` to the last state.
        """
        if self.masks is None:
            return
        resets = self._mode == "SAME_STEP"
        masks = self._masks_in(infos, [resets or not is_terminal for is_terminal in terminated])
        self._begun = list(masks)
        if resets and any(ended):
            truncated = [a and not b for a, b in zip(ended, terminated, strict=True)]
            last = self._masks_in(infos.get("final_info", {}), truncated)
            masks = [last[i] if has_ended else masks[i] for i, has_ended in enumerate(ended)]
        self.masks = masks

    def _durations_in(self, infos: Info, ended: Sequence[bool]) -> list[float]:
        """Return the durations of the last step; UnusableStepError if one is missing.

        In mode ``SAME_STEP`` those of steps that end an episode are in ``final_info``.
        """
        is_final = [self._mode == "SAME_STEP" and has_ended for has_ended in ended]
        dts = self._dt_column(infos, [not is_last for is_last in is_final])
        if any(is_final):
            last = self._dt_column(infos.get("final_info", {}), is_final)
            dts = [last[i] if is_last else dts[i] for i, is_last in enumerate(is_final)]
        return dts

    def _dt_column(self, infos: Info, needed: Sequence[bool]) -> list[float]:
        """Return the numbers ``dt`` in infos, 1 where not needed, also in the step of a reset."""
        needed = [is_needed and i not in self._resetting for i, is_needed in enumerate(needed)]
        if not any(needed):
            return [1.0] * self.n_environments
        self._require_key("dt", infos, needed)
        numbers = self._column("dt", np.where(needed, infos["dt"], 1.0), "fiu", "numbers")
        if not np.isfinite(numbers).all():
            raise UnusableStepError(f"dt must be finite, got {shown(numbers)}")
        return [float(number) for number in numbers]

    def _masks_in(self, infos: Info, needed: Sequence[bool]) -> list[Mask]:
        """Return the masks in infos, None where not needed; UnusableStepError if one is missing."""
        if not any(needed):
            return [None] * self.n_environments
        self._require_key("action_mask", infos, needed)
        masks: Any = infos["action_mask"]
        rows = list(zip(*masks, strict=True)) if isinstance(masks, tuple) else masks
        return [rows[i] if is_needed else None for i, is_needed in enumerate(needed)]

    def _require_key(self, key: str, infos: Info, needed: Sequence[bool]) -> None:
        """Raise UnusableStepError if the info of a needed environment lacks a key.

        In a vector's infos, flags under ``"_" + key`` tell which environments have the key; without
        flags all have it.
        """

        def has_key(name: str, i: int) -> bool:
            """Return whether the info of environment `i` has a key."""
            flags = infos.get(f"_{name}")
            return name in infos and (flags is None or bool(flags[i]))

        for i in np.flatnonzero(needed).tolist():
            if not has_key(key, i):
                keys = [name for name in infos if not name.startswith("_") and has_key(name, i)]
                raise missing_in_info(key, keys, f"info of environment {i}")

    def _note_masks(self, infos: Info, begun: Collection[int]) -> None:
        """Store the masks of the environments that were reset."""
        if self.masks is not None:
            rows = self._masks_in(infos, [i in begun for i in range(self.n_environments)])
            self.masks = [rows[i] if i in begun else m for i, m in enumerate(self.masks)]

    def _batch(self, actions: Elements) -> Element:
        """Copy the actions into the batch that the vector environment expects."""
        space: Any = self._env.single_action_space
        if type(actions) is np.ndarray:
            return np.array(actions, space.dtype).reshape(self.n_environments, *space.shape)
        batch: Any = create_empty_array(space, self.n_environments)
        return concatenate(space, actions, batch)

    def _column(self, name: str, values: object, types: str, what: str) -> list[Any]:
        """Return a list with a value for each environment; UnusableStepError for anything else.

        ``types`` and ``what`` are those of `array_of`: possible types, and their word for errors.
        """
        what = f"{self.n_environments} {what}"
        try:
            column = array_of(name, values, types, what)
        except ValueError as error:
            raise UnusableStepError(f"env.step must return arrays: {error}") from None
        if column.shape != (self.n_environments,):
            raise UnusableStepError(
                f"env.step must return arrays: {name} must be {what}, got shape {column.shape}"
            )
        return list(column.tolist())


class _SeparateResets(_Vector):
    """A vector in which each environment is reset by itself, whatever the autoreset mode.

    A reset replaces the automatic one, whether that came with the last step or would come next.
    """

    can_repeat = True

    def reset(self, seeds: Seeds, options: Options = None) -> dict[int, Element]:
        """Reset the environments that have an entry in `seeds`; return their observations."""
        mask = np.array([i in seeds for i in range(self.n_environments)])
        # Some wrappers can only reset all environments: leave the option out where all are reset.
        options = None if mask.all() else {"reset_mask": mask}
        listed = [seeds.get(i) for i in range(self.n_environments)]
        observations, infos = reset_env(self._env, listed, options)
        self._note_masks(infos, seeds)
        rows = _split_batch(self._env, observations)
        return {i: rows[i] for i in seeds}

    def step(self, actions: Elements) -> Elements:
        return self._step(actions)[0]


class _AutomaticResets(_Vector):
    """A vector that resets its environments itself, so only its first reset can have a seed."""

    can_repeat = False

    def __init__(self, env: VectorEnv) -> None:
        super().__init__(env)
        self._after_resets: Elements | None = None

    def reset(self, seeds: Seeds, options: Options = None) -> dict[int, Element]:
        """Return first observations; only the first call resets, others are automatic.

        In mode ``SAME_STEP`` the resets came with the last step. In other modes they come with the
        next one, so nothing is returned yet. ``options`` are always None, as for all vectors:
        `Training` refuses them.
        """
        if self._after_resets is None:
            observations, infos = reset_env(self._env, seeds[0], None)
            self._note_masks(infos, range(self.n_environments))
            self._after_resets = _split_batch(self._env, observations)
        elif self._mode != "SAME_STEP":
            self._resetting = seeds.keys()
            return {}
        elif self.masks is not None:
            self.masks = [self._begun[i] if i in seeds else m for i, m in enumerate(self.masks)]
        return {i: self._after_resets[i] for i in seeds}

    def step(self, actions: Elements) -> Elements:
        observations, self._after_resets = self._step(actions)
        self._resetting = ()
        return observations


def _split_batch(env: VectorEnv, observations: Element) -> Elements:
    """Split a batch of observations into one per environment, without copying."""
    if type(observations) is np.ndarray:
        return observations
    return list(iterate(env.observation_space, observations))


def _autoreset_mode(env: VectorEnv) -> str:
    """Return the name of the vector's autoreset mode, as in Gymnasium's ``AutoresetMode``."""
    # The attribute comes first: in Gymnasium 1.1 the metadata may be those of another vector.
    mode = getattr(env.unwrapped, "autoreset_mode", env.metadata.get("autoreset_mode"))
    return "NEXT_STEP" if mode is None else str(gym.vector.AutoresetMode(mode).name)


def _resets_each(env: VectorEnv) -> bool:
    """Return whether ``reset`` takes the option ``"reset_mask"`` and a seed per environment."""
    inner = env
    while isinstance(inner, gym.vector.VectorWrapper):
        if isinstance(inner, gym.wrappers.vector.NormalizeObservation):
            return False  # this wrapper resets all environments or none
        inner = inner.env
    if inner.metadata.get("reset_mask"):
        return True
    mode = _autoreset_mode(env)
    if isinstance(inner, gym.vector.AsyncVectorEnv) and not inner.shared_memory:
        return mode != "NEXT_STEP"  # the next step would reset once more (Gymnasium 1.4)
    known = (gym.vector.SyncVectorEnv, gym.vector.AsyncVectorEnv)
    return mode == "DISABLED" or isinstance(inner, known)
