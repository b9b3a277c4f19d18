"""Statistics of wrappers that learn, such as Gymnasium's NormalizeObservation.

They are in an attribute ``obs_rms`` or ``return_rms`` with numbers ``mean``, ``var``, ``count``.
"""

from __future__ import annotations

import base64
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import Any, Literal

import gymnasium as gym
import msgspec
import numpy as np

from sdnn.environments.types import Array

_STATISTICS = ("obs_rms", "return_rms")
_MOMENTS = ("mean", "var", "count")
_SUMS = ("discounted_reward", "accumulated_reward")
_FEW = 1.0
"""The count of statistics without an observation is below it."""


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
    wrappers = []
    while env is not None:
        if any(moments_of(env, name) is not None for name in _STATISTICS):
            wrappers.append(env)
        if isinstance(env, gym.vector.SyncVectorEnv):
            for inner in env.envs:
                wrappers += learning_wrappers(inner)
        env = getattr(env, "__dict__", {}).get("env")
    return wrappers


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
    names, other_names = (
        [type(w).__name__ for w in learning if moments_of(w, "obs_rms") is not None]
        for learning in (wrappers, others)
    )
    if bool(names) != bool(other_names):
        has, lacks = ("env", "evaluation_env") if names else ("evaluation_env", "env")
        warnings.warn(
            f"{has} has the wrapper {(names or other_names)[0]}, {lacks} has not: the agent"
            " observes other numbers in evaluations than in training; wrap both in the same way",
            RuntimeWarning,
            stacklevel=3,
        )


def read_statistics(values: Any) -> list[Statistics]:
    """Make statistics of plain data; ValueError if they are none."""
    try:
        learned = msgspec.convert(values, list[Statistics])
    except msgspec.ValidationError as error:
        raise ValueError(f"wrappers: {error}") from None
    for statistics in learned:
        for numbers in statistics.numbers.values():
            _unpacked(numbers)
    return learned


def statistics_of(wrappers: Sequence[Any]) -> list[Statistics]:
    """Return what wrappers have learned."""
    return [
        Statistics(
            type(wrapper).__name__,
            {name: _packed(getattr(owner, key)) for name, owner, key in _slots(wrapper)},
        )
        for wrapper in wrappers
    ]


def take_statistics(wrappers: Sequence[Any], learned: Sequence[Statistics]) -> bool:
    """Give each wrapper, in order, the statistics of its name; return whether all match."""
    remaining = list(learned)
    for wrapper in wrappers:
        statistics = next((s for s in remaining if _fits(wrapper, s)), None)
        if statistics is not None:
            remaining.remove(statistics)
            for name, owner, key in _slots(wrapper):
                value = _unpacked(statistics.numbers[name])
                setattr(owner, key, value if value.ndim else value.item())
    return not remaining and len(wrappers) == len(learned)


def moments_of(wrapper: Any, name: str) -> Any:
    """Return a wrapper's attribute that has mean, var and count; None if it has none."""
    moments = getattr(wrapper, "__dict__", {}).get(name)
    return moments if all(hasattr(moments, moment) for moment in _MOMENTS) else None


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
    shapes = {name: np.shape(getattr(owner, key)) for name, owner, key in _slots(wrapper)}
    learned_shapes = {name: numbers.shape for name, numbers in learned.numbers.items()}
    return type(wrapper).__name__ == learned.wrapper and shapes == learned_shapes


def _packed(value: Any) -> _Numbers:
    array = np.asarray(value)
    array = array.astype("<f4" if array.dtype == np.float32 else "<f8")
    text = base64.b64encode(array.tobytes()).decode()
    return _Numbers("<f4" if array.itemsize == 4 else "<f8", array.shape, text)


def _unpacked(numbers: _Numbers) -> Array:
    """Return the array; ValueError if it has another number of values."""
    values = np.frombuffer(base64.b64decode(numbers.values), numbers.dtype)
    return values.reshape(numbers.shape).copy()


@contextmanager
def fixed(env: Any, learned: Sequence[Statistics]) -> Iterator[None]:
    """Keep the statistics of an environment's wrappers as they are, for greedy episodes.

    Wrappers without statistics take those that were learned; a warning names one that cannot.
    """
    wrappers = learning_wrappers(env)
    fresh = [wrapper for wrapper in wrappers if _has_no_statistics(wrapper)]
    if fresh and not take_statistics(fresh, learned):
        warnings.warn(
            f"{type(fresh[0]).__name__} of env has no statistics yet, so the agent observes other"
            " numbers than in training: give the statistics of the training's wrapper to it, or"
            " evaluate in the environment of the training",
            RuntimeWarning,
            stacklevel=3,
        )
    before = statistics_of(wrappers)
    flags = [getattr(wrapper, "update_running_mean", None) for wrapper in wrappers]
    try:
        for wrapper, flag in zip(wrappers, flags, strict=True):
            if flag is not None:
                wrapper.update_running_mean = False
        yield
    finally:
        take_statistics(wrappers, before)
        for wrapper, flag in zip(wrappers, flags, strict=True):
            if flag is not None:
                wrapper.update_running_mean = flag


def _has_no_statistics(wrapper: Any) -> bool:
    all_moments = (moments_of(wrapper, name) for name in _STATISTICS)
    return any(moments is not None and moments.count < _FEW for moments in all_moments)
