"""Environments as a training steps them, and what their wrappers learn.

One environment is stepped as many are; results are checked and arrays copied.
"""

from __future__ import annotations

import abc
import base64
import copy
import math
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from typing import Any, Literal, TypeAlias

import gymnasium as gym
import msgspec
import numpy as np
from numpy.typing import NDArray

from sdnn.support.arguments import flag, has_methods, reward_of, shown

Seeds: TypeAlias = Mapping[int, int | None]
Options: TypeAlias = dict[str, Any] | None

_SCALARS = (np.generic, int, float)

_OLD_API = (
    "; an environment of Gym before 0.26 can be wrapped:"
    " shimmy.GymV21CompatibilityV0(env=env), from pip install shimmy"
)


def require_single(name: str, env: Any) -> None:
    """Check that a value is one environment; TypeError that names the argument."""
    has_methods(name, env, "an environment, as of gymnasium.make(id)", "reset", "step")
    if isinstance(env, gym.vector.VectorEnv):
        raise TypeError(
            f"{name} must be a single environment, got a vector of them, {type(env).__name__}"
        )


class UnusableStepError(ValueError):
    """A step or reset of an environment cannot be used; the message names it and the reason."""


def has_action_masks(env: Any) -> bool:
    """Return whether an environment, or a vector, tells which actions are allowed."""
    return bool((getattr(env, "metadata", None) or {}).get("action_masks"))


def mask_in(info: Mapping[str, Any]) -> Any:
    """Return the mask in an info; UnusableStepError if there is none."""
    if "action_mask" not in info:
        raise UnusableStepError(
            "info must have 'action_mask', as metadata['action_masks'] of env is True,"
            f" got {shown(sorted(map(str, info)))}"
        )
    return info["action_mask"]


def reset_env(env: Any, seed: Any, options: dict[str, Any] | None) -> tuple[Any, Any]:
    """Reset an environment, or a vector; return what is observed first, and the info.

    UnusableStepError if it returns something else than an observation and a dictionary.
    """
    made = env.reset(seed=seed, options=options)
    if not (isinstance(made, tuple | list) and len(made) == 2 and isinstance(made[1], Mapping)):
        raise UnusableStepError(
            f"env.reset must return (observation, info), info a dictionary, got {shown(made)}"
            f"{_OLD_API}"
        )
    return made[0], made[1]


def step_env(env: Any, action: Any) -> tuple[Any, Any, Any, Any, Any]:
    """Step an environment, or a vector; UnusableStepError if it does not return five values."""
    made = env.step(action)
    if not (isinstance(made, (tuple, list)) and len(made) == 5):
        n = len(made) if isinstance(made, (tuple, list)) else 1
        raise UnusableStepError(
            "env.step must return five values, (observation, reward, terminated, truncated, info),"
            f" got {n}{_OLD_API}"
        )
    return made  # type: ignore[return-value]


def checked(reward: Any, terminated: Any, truncated: Any) -> tuple[float, bool, bool]:
    """Return a finite float and bools; UnusableStepError for something else."""
    try:
        if type(reward) is not float:
            reward = reward_of(reward)
        if not math.isfinite(reward):
            raise ValueError(f"reward must be finite, got {reward}")
        if not type(terminated) is bool is type(truncated):
            terminated, truncated = flag("terminated", terminated), flag("truncated", truncated)
    except (TypeError, ValueError) as error:
        raise UnusableStepError(str(error)) from error
    return reward, terminated, truncated


def own_copy(value: Any) -> Any:
    """Copy what others may write to: environments may keep their state, or change an action."""
    if type(value) is np.ndarray:
        return value.copy()
    return value if isinstance(value, _SCALARS) else copy.deepcopy(value)


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

    def __init__(self, env: gym.Env[Any, Any]) -> None:
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
        seen, reward, terminated, truncated, info = step_env(self._env, own_copy(action))
        reward, terminated, truncated = checked(reward, terminated, truncated)
        if self.masks is not None:
            self.masks = [None if terminated else mask_in(info)]
        return seen, reward, terminated, truncated

    def step(self, actions: Sequence[Any]) -> Any:
        """Take the only action."""
        seen, self.rewards[0], self.terminated[0], self.truncated[0] = self.take(actions[0])
        return seen[np.newaxis] if type(seen) is np.ndarray else [seen]


# Wrappers that learn: they have an attribute ``obs_rms`` or ``return_rms`` with numbers ``mean``,
# ``var`` and ``count``, as Gymnasium's NormalizeObservation and NormalizeReward have.

_STATISTICS = ("obs_rms", "return_rms")
_MOMENTS = ("mean", "var", "count")
_SUMS = ("discounted_reward", "accumulated_reward")
_FEW = 1.0
"""The count of statistics that have seen nothing is below it."""


class _Numbers(msgspec.Struct, frozen=True):
    """An array, its bytes as text: JSON has no NaN."""

    dtype: Literal["<f4", "<f8"]
    shape: tuple[int, ...]
    values: str


class Statistics(msgspec.Struct, frozen=True):
    """Statistics of a wrapper by the names of its attributes, such as ``"obs_rms.mean"``."""

    wrapper: str
    numbers: dict[str, _Numbers]


def learning_wrappers(env: Any) -> list[Any]:
    """List the wrappers of an environment, or of a vector, that learn; the outermost first."""
    found = []
    while env is not None:
        if any(moments_of(env, name) is not None for name in _STATISTICS):
            found.append(env)
        if isinstance(env, gym.vector.SyncVectorEnv):
            found += [one for inner in env.envs for one in learning_wrappers(inner)]
        env = getattr(env, "__dict__", {}).get("env")
    return found


def names_of(env: Any) -> str:
    """Return the names of all wrappers and of the environment in them."""
    names = []
    while env is not None:
        names.append(type(env).__name__)
        env = getattr(env, "__dict__", {}).get("env")
    return ", ".join(names)


def share_statistics(env: Any, evaluation_env: Any) -> None:
    """Copy the statistics of one environment's wrappers to those of another.

    Warns where only one of the two has a wrapper that learns about observations.
    """
    wrappers, others = learning_wrappers(env), learning_wrappers(evaluation_env)
    take_statistics(others, statistics_of(wrappers))
    own, other = (
        [type(one).__name__ for one in found if moments_of(one, "obs_rms") is not None]
        for found in (wrappers, others)
    )
    if bool(own) != bool(other):
        has, lacks = ("env", "evaluation_env") if own else ("evaluation_env", "env")
        warnings.warn(
            f"{has} has the wrapper {(own or other)[0]}, {lacks} has not: the agent observes other"
            " numbers in evaluations than in training; wrap both in the same way",
            RuntimeWarning,
            stacklevel=3,
        )


def read_statistics(values: Any) -> list[Statistics]:
    """Make statistics of plain data; ValueError if they are none."""
    try:
        learned = msgspec.convert(values, list[Statistics])
    except msgspec.ValidationError as error:
        raise ValueError(f"wrappers: {error}") from None
    for numbers in (one for own in learned for one in own.numbers.values()):
        _unpacked(numbers)
    return learned


def statistics_of(wrappers: Sequence[Any]) -> list[Statistics]:
    """Return what wrappers have learned."""
    return [
        Statistics(
            type(one).__name__, {name: _packed(getattr(of, key)) for name, of, key in _slots(one)}
        )
        for one in wrappers
    ]


def take_statistics(wrappers: Sequence[Any], learned: Sequence[Statistics]) -> bool:
    """Give each wrapper, in order, what one of its name has learned; return whether all match."""
    left = list(learned)
    for wrapper in wrappers:
        own = next((one for one in left if _fits(wrapper, one)), None)
        if own is not None:
            left.remove(own)
            for name, of, key in _slots(wrapper):
                value = _unpacked(own.numbers[name])
                setattr(of, key, value if value.ndim else value.item())
    return not left and len(wrappers) == len(learned)


def moments_of(wrapper: Any, name: str) -> Any:
    """Return a wrapper's attribute that has mean, var and count; None if it has none."""
    found = getattr(wrapper, "__dict__", {}).get(name)
    return found if all(hasattr(found, moment) for moment in _MOMENTS) else None


def _slots(wrapper: Any) -> Iterator[tuple[str, Any, str]]:
    """Yield the names of all numbers that a wrapper has learned, and where each is kept."""
    for name in _STATISTICS:
        moments = moments_of(wrapper, name)
        for moment in _MOMENTS if moments is not None else ():
            yield f"{name}.{moment}", moments, moment
    for name in _SUMS:
        if name in vars(wrapper):
            yield name, wrapper, name


def _fits(wrapper: Any, learned: Statistics) -> bool:
    own = {name: np.shape(getattr(of, key)) for name, of, key in _slots(wrapper)}
    found = {name: one.shape for name, one in learned.numbers.items()}
    return type(wrapper).__name__ == learned.wrapper and own == found


def _packed(value: Any) -> _Numbers:
    array = np.asarray(value)
    array = array.astype("<f4" if array.dtype == np.float32 else "<f8")
    text = base64.b64encode(array.tobytes()).decode()
    return _Numbers("<f4" if array.itemsize == 4 else "<f8", array.shape, text)


def _unpacked(numbers: _Numbers) -> NDArray[Any]:
    """Return the array; ValueError if it has another number of values."""
    values = np.frombuffer(base64.b64decode(numbers.values), numbers.dtype)
    return values.reshape(numbers.shape).copy()


@contextmanager
def fixed(env: Any, learned: Sequence[Statistics]) -> Iterator[None]:
    """Keep the statistics of an environment's wrappers as they are, for greedy episodes.

    Wrappers that have seen nothing yet take what was learned; a warning names one that cannot.
    """
    wrappers = learning_wrappers(env)
    fresh = [one for one in wrappers if _has_seen_nothing(one)]
    if fresh and not take_statistics(fresh, learned):
        warnings.warn(
            f"{type(fresh[0]).__name__} of env has seen nothing yet, so the agent observes other"
            " numbers than in training: give the statistics of the training's wrapper to it, or"
            " evaluate in the environment of the training",
            RuntimeWarning,
            stacklevel=3,
        )
    before = statistics_of(wrappers)
    flags = [getattr(one, "update_running_mean", None) for one in wrappers]
    try:
        for one, flag in zip(wrappers, flags, strict=True):
            if flag is not None:
                one.update_running_mean = False
        yield
    finally:
        take_statistics(wrappers, before)
        for one, flag in zip(wrappers, flags, strict=True):
            if flag is not None:
                one.update_running_mean = flag


def _has_seen_nothing(wrapper: Any) -> bool:
    found = (moments_of(wrapper, name) for name in _STATISTICS)
    return any(moments is not None and moments.count < _FEW for moments in found)
