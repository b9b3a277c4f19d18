"""Steps in one environment, or in several at once: a round is a step in each."""

from __future__ import annotations

import abc
import copy
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple, TypeAlias

import gymnasium as gym
import numpy as np

__all__ = ["EnvironmentAdapter", "OneEnvironment", "StepResult", "adapter_for"]

Seeds: TypeAlias = Mapping[int, int | None]
Options: TypeAlias = dict[str, Any] | None


class StepResult(NamedTuple):
    """What an action led to, as it is: the reward may be none.

    ``observation`` is the last of the episode where it ended.
    """

    observation: Any
    reward: Any
    terminated: bool
    truncated: bool

    @property
    def ends(self) -> bool:
        """Whether the episode is over."""
        return self.terminated or self.truncated


def own_copy(value: Any) -> Any:
    """Copy what others may write to: environments may keep their state, or change an action."""
    if type(value) is np.ndarray:
        return value.copy()
    return value if isinstance(value, np.generic | int | float) else copy.deepcopy(value)


class EnvironmentAdapter(abc.ABC):
    """One face of all environments, single and vectorized.

    Attributes
    ----------
    n_environments : int
    can_repeat : bool
        Whether each environment can be reset at any time, with a seed of its own: then its episode
        can be repeated.
    """

    n_environments: int
    can_repeat: bool

    @abc.abstractmethod
    def reset(self, seeds: Seeds, options: Options = None) -> dict[int, Any]:
        """Begin episodes in some environments, with seeds: their first observations.

        One that is missing has none yet: its episode begins with the next `step`, which gives it.
        Options are those of a single environment.
        """

    @abc.abstractmethod
    def step(self, actions: Sequence[Any]) -> list[StepResult]:
        """Take an action in each; None in those whose episodes have not begun."""


def adapter_for(env: gym.Env[Any, Any] | gym.vector.VectorEnv[Any, Any, Any]) -> EnvironmentAdapter:
    """Find out how to go around an environment, or a vector of them."""
    if not isinstance(env, gym.vector.VectorEnv):
        return OneEnvironment(env)
    if _resets_each(env):
        return _SeparateResets(env)
    return _OwnResets(env)


class OneEnvironment(EnvironmentAdapter):
    """A single environment."""

    n_environments = 1
    can_repeat = True

    def __init__(self, env: gym.Env[Any, Any]) -> None:
        self._env = env

    def reset(self, seeds: Seeds, options: Options = None) -> dict[int, Any]:
        """Begin its episode."""
        return {
            i: own_copy(self._env.reset(seed=seed, options=options)[0]) for i, seed in seeds.items()
        }

    def step(self, actions: Sequence[Any]) -> list[StepResult]:
        """Take the only action."""
        return [self.step_one(actions[0])]

    def step_one(self, action: Any) -> StepResult:
        """Take an action."""
        taken = action.copy() if type(action) is np.ndarray else own_copy(action)
        seen, reward, terminated, truncated, _ = self._env.step(taken)
        seen = seen.copy() if type(seen) is np.ndarray else own_copy(seen)
        return StepResult(seen, reward, bool(terminated), bool(truncated))


class _Vector(EnvironmentAdapter, abc.ABC):
    """What vector environments have in common: lists in, lists out."""

    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any]) -> None:
        self._env = env
        self._mode = _autoreset_mode(env)
        self.n_environments = env.num_envs

    def _step(self, actions: Sequence[Any]) -> tuple[list[StepResult], list[Any]]:
        """Give the outcomes, and what is observed after resets in the same step."""
        from gymnasium.vector.utils import concatenate, create_empty_array

        space = self._env.single_action_space
        batch: Any = create_empty_array(space, self.n_environments)
        observations, rewards, terminated, truncated, infos = self._env.step(
            concatenate(space, actions, batch)
        )
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
            StepResult(last[i], rewards[i], bool(terminated[i]), bool(truncated[i]))
            for i in range(self.n_environments)
        ]
        return outcomes, seen

    def _listed(self, observations: Any) -> list[Any]:
        from gymnasium.vector.utils import iterate

        # A copy: some vector environments write to the same array again.
        return list(iterate(self._env.observation_space, copy.deepcopy(observations)))


class _SeparateResets(_Vector):
    """Resets each environment whose episode is over by itself, whatever the autoreset mode.

    A reset forestalls the one that would come with the next step, and follows the one that came
    with the last.
    """

    can_repeat = True

    def reset(self, seeds: Seeds, options: Options = None) -> dict[int, Any]:
        mask = np.array([i in seeds for i in range(self.n_environments)])
        # Without the option where it is not needed: some wrappers know complete resets only.
        options = None if mask.all() else {"reset_mask": mask}
        listed: Any = [seeds.get(i) for i in range(self.n_environments)]
        observations, _ = self._env.reset(seed=listed, options=options)
        seen = self._listed(observations)
        return {i: seen[i] for i in seeds}

    def step(self, actions: Sequence[Any]) -> list[StepResult]:
        return self._step(actions)[0]


class _OwnResets(_Vector):
    """Follows an environment that resets itself; it is seeded at the beginning only."""

    can_repeat = False

    def __init__(self, env: gym.vector.VectorEnv[Any, Any, Any]) -> None:
        super().__init__(env)
        self._seen: list[Any] | None = None
        self._taken: list[Any] = []

    def reset(self, seeds: Seeds, options: Options = None) -> dict[int, Any]:
        if self._seen is None:
            observations, _ = self._env.reset(seed=seeds[0])
            self._seen = self._listed(observations)
        elif self._mode != "SAME_STEP":
            return {}
        return {i: self._seen[i] for i in seeds}

    def step(self, actions: Sequence[Any]) -> list[StepResult]:
        # What resets takes no notice of its action, but must be given one.
        old = self._taken or list(actions)
        self._taken = [old[i] if action is None else action for i, action in enumerate(actions)]
        outcomes, self._seen = self._step(self._taken)
        return outcomes


def _autoreset_mode(env: gym.vector.VectorEnv[Any, Any, Any]) -> str:
    """Name the mode as Gymnasium's ``AutoresetMode`` does, which Gymnasium 1.0 has not."""
    modes = getattr(gym.vector, "AutoresetMode", None)
    # Not by the metadata first: in Gymnasium 1.1 these may be another vector's.
    mode = getattr(env.unwrapped, "autoreset_mode", env.metadata.get("autoreset_mode"))
    return "NEXT_STEP" if modes is None or mode is None else str(modes(mode).name)


def _resets_each(env: gym.vector.VectorEnv[Any, Any, Any]) -> bool:
    """Whether ``reset`` knows the option ``"reset_mask"``, and a seed for each environment."""
    inner = env
    while isinstance(inner, gym.vector.VectorWrapper):
        if isinstance(inner, gym.wrappers.vector.NormalizeObservation):
            return False  # it resets all or none
        inner = inner.env
    if inner.metadata.get("reset_mask"):
        return True
    if not hasattr(gym.vector, "AutoresetMode"):
        return False  # Gymnasium 1.0
    mode = _autoreset_mode(env)
    if isinstance(inner, gym.vector.AsyncVectorEnv) and not inner.shared_memory:
        return mode != "NEXT_STEP"  # the next step would reset once more (Gymnasium 1.4)
    known = (gym.vector.SyncVectorEnv, gym.vector.AsyncVectorEnv)
    return mode == "DISABLED" or isinstance(inner, known)
