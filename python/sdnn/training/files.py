"""Files of agents and of their trainings, with the statistics of wrappers that learn.

Wrappers such as Gymnasium's NormalizeObservation have statistics in an attribute ``obs_rms`` or
``return_rms`` with numbers ``mean``, ``var``, ``count``.
"""

from __future__ import annotations

import copy
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Annotated, Any, Literal

import gymnasium as gym
import msgspec
import numpy as np

from sdnn.environments.spaces import Actions
from sdnn.environments.types import Array, Data, Element
from sdnn.support.arguments import seed_of
from sdnn.support.files import Arrays, Description, read_file, write_file

_STATISTICS = ("obs_rms", "return_rms")
_MOMENTS = ("mean", "var", "count")
_SUMS = ("discounted_reward", "accumulated_reward")
"""The running discounted return of NormalizeReward, by its names for environments and vectors."""
_FEW = 1.0
"""Statistics with a lower count have no observation yet: wrappers begin with a tiny count."""


class _Numbers(msgspec.Struct, frozen=True):
    """An array for JSON: its bytes as text, since JSON's numbers have no NaN."""

    dtype: Literal["<f4", "<f8"]
    shape: tuple[int, ...]
    values: bytes


class Statistics(msgspec.Struct, frozen=True):
    """Statistics of a wrapper by the names of its attributes, such as ``"obs_rms.mean"``."""

    wrapper: str
    numbers: dict[str, _Numbers]

    def observation_lines(self) -> list[str]:
        """Describe how the wrapper normalizes each observed variable, a line each; [] if none."""
        moments = [self.numbers.get(f"obs_rms.{name}") for name in ("mean", "var")]
        means, variances = (
            [] if moment is None else np.frombuffer(moment.values, moment.dtype).tolist()
            for moment in moments
        )
        return [
            f"{i}: mean {mean:.9g}, variance {variance:.9g}"
            for i, (mean, variance) in enumerate(zip(means, variances, strict=True))
        ]


def _layers_of(env: object) -> Iterator[object]:
    """Yield an environment's wrappers, the outermost first, and the environment in them."""
    while env is not None:
        yield env
        # Wrappers pass on the attributes of their environment, so that `env.env` may be another's.
        env = getattr(env, "__dict__", {}).get("env")


def learning_wrappers(env: object) -> list[Any]:
    """List the wrappers of an environment, or of a vector, that learn; the outermost first."""
    wrappers = []
    for layer in _layers_of(env):
        if any(moments_of(layer, name) is not None for name in _STATISTICS):
            wrappers.append(layer)
        if isinstance(layer, gym.vector.SyncVectorEnv):
            for inner in layer.envs:
                wrappers += learning_wrappers(inner)
    return wrappers


def names_of(env: object) -> str:
    """Return the names of all wrappers and of the environment in them."""
    return ", ".join(type(layer).__name__ for layer in _layers_of(env))


def share_statistics(env: object, evaluation_env: object) -> None:
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


def read_statistics(values: object) -> list[Statistics]:
    """Make statistics from plain data; ValueError if the data is invalid."""
    try:
        learned = msgspec.convert(values, list[Statistics])
    except msgspec.ValidationError as error:
        raise ValueError(f"wrappers: {error}") from None
    for statistics in learned:
        for numbers in statistics.numbers.values():
            _unpacked(numbers)
    return learned


def statistics_of(wrappers: Sequence[object]) -> list[Statistics]:
    """Return what wrappers have learned."""
    return [
        Statistics(
            type(wrapper).__name__,
            {name: _packed(getattr(owner, key)) for name, owner, key in _learned_numbers(wrapper)},
        )
        for wrapper in wrappers
    ]


def take_statistics(wrappers: Sequence[object], learned: Sequence[Statistics]) -> bool:
    """Give each wrapper, in order, the statistics of its name; return whether all match."""
    remaining = list(learned)
    for wrapper in wrappers:
        statistics = next((s for s in remaining if _has_shapes_of(wrapper, s)), None)
        if statistics is not None:
            remaining.remove(statistics)
            for name, owner, key in _learned_numbers(wrapper):
                value = _unpacked(statistics.numbers[name])
                setattr(owner, key, value if value.ndim else value.item())
    return not remaining and len(wrappers) == len(learned)


def moments_of(wrapper: object, name: str) -> Any:
    """Return a wrapper's attribute that has mean, var and count; None if it has none."""
    moments = getattr(wrapper, "__dict__", {}).get(name)
    return moments if all(hasattr(moments, moment) for moment in _MOMENTS) else None


def _learned_numbers(wrapper: object) -> Iterator[tuple[str, object, str]]:
    """Yield the name of each number that a wrapper has learned, and its object and attribute."""
    for name in _STATISTICS:
        moments = moments_of(wrapper, name)
        for moment in _MOMENTS if moments is not None else ():
            yield f"{name}.{moment}", moments, moment
    for name in _SUMS:
        if name in vars(wrapper):
            yield name, wrapper, name


def _has_shapes_of(wrapper: object, learned: Statistics) -> bool:
    """Return whether statistics are of the wrapper's class, with numbers of its shapes."""
    shapes = {name: np.shape(getattr(owner, key)) for name, owner, key in _learned_numbers(wrapper)}
    learned_shapes = {name: numbers.shape for name, numbers in learned.numbers.items()}
    return type(wrapper).__name__ == learned.wrapper and shapes == learned_shapes


def _packed(value: object) -> _Numbers:
    """Convert a number or an array; all but float32 become float64."""
    array = np.asarray(value)
    dtype: Literal["<f4", "<f8"] = "<f4" if array.dtype == np.float32 else "<f8"
    return _Numbers(dtype, array.shape, array.astype(dtype).tobytes())


def _unpacked(numbers: _Numbers) -> Array:
    """Return the array; ValueError if it has another number of values."""
    return np.frombuffer(numbers.values, numbers.dtype).reshape(numbers.shape).copy()


@contextmanager
def fixed_statistics(env: object, learned: Sequence[Statistics]) -> Iterator[None]:
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


def _has_no_statistics(wrapper: object) -> bool:
    """Return whether a wrapper that learns statistics has observed nothing yet."""
    all_moments = (moments_of(wrapper, name) for name in _STATISTICS)
    return any(moments is not None and moments.count < _FEW for moments in all_moments)


_ARRAYS_OF_TRAINING = "training."  # prefix of the names of arrays that are not the agent's

_LARGEST_RETURN = 1e300  # returns that count as larger ones, so that sums of a block are finite
MOST_IN_BLOCK = 10**6  # largest number of episodes in a block

_Sum = Annotated[float, msgspec.Meta(ge=-1e307, le=1e307)]
_BlockLength = Annotated[int, msgspec.Meta(ge=1, le=MOST_IN_BLOCK)]
_Count = Annotated[int, msgspec.Meta(ge=0, le=2**53)]
_Period = Annotated[int, msgspec.Meta(ge=1, le=2**53)]

CLASSES: Data = {}
"""The classes of agents, by the name that files have; `sdnn.agents.Agent` adds its subclasses."""


def read_agent(path: Path, *kinds: str) -> tuple[Any, Description, Arrays]:
    """Read a file of one of these kinds: its agent, its description and its arrays.

    OSError if it cannot be read; ValueError if it is damaged, of another kind or format, or does
    not fit together.
    """
    description, arrays = read_file(path, *kinds)
    name = description.get("class")
    if str(name) not in CLASSES:
        raise ValueError(f"{path} holds an agent of an unknown class, {name!r}")
    state = {key: a for key, a in arrays.items() if not key.startswith(_ARRAYS_OF_TRAINING)}
    try:
        return CLASSES[str(name)].rebuild(description, state), description, arrays
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise ValueError(f"{path} is damaged: {error}") from error


_SCALARS = (np.generic, int, float)
"""Immutable types of observations and actions, which need no copy."""

MOST_RECENT = 1024  # rounds of steps after which the recent actions of all episodes become arrays


def copied(value: Element) -> Element:
    """Copy an observation or action that an environment or agent may change later."""
    if type(value) is np.ndarray:
        return value.copy()
    return value if isinstance(value, _SCALARS) else copy.deepcopy(value)


class ActionLog:
    """The actions of an episode, kept in arrays: a list of millions would need much more memory."""

    def __init__(self, actions: Array | None = None) -> None:
        self._arrays = [] if actions is None or not len(actions) else [actions]
        self.recent: list[Element] = []
        """Where actions are added, of the shape and type of the others; see `pack`."""

    def array(self) -> Array:
        """Return all actions, shape (n, ...)."""
        arrays = self._arrays + ([np.array(self.recent)] if self.recent else [])
        return np.concatenate(arrays) if arrays else np.empty(0)

    def pack(self) -> None:
        """Move recent actions to an array."""
        if self.recent:
            self._arrays.append(np.array(self.recent))
            self.recent.clear()


class SavedEpisode(msgspec.Struct, frozen=True, kw_only=True):
    """The present episode in one environment.

    ``number`` counts all that have begun; ``waits`` is whether its last step is not learned yet;
    ``actions`` are those taken, shape (n_steps, ...); ``observation`` is the last one, flattened,
    shape (n_variables,). Both arrays are stored apart from the rest, which is JSON.
    """

    number: _Count
    sum_of_rewards: float
    waits: bool
    actions: Any = None
    observation: Any = None


class EpisodeBlock(msgspec.Struct, omit_defaults=True):
    """Blocks of ``length`` learned episodes each, of which the best is the one of largest returns.

    Blocks do not overlap. ``total`` is the sum of the ``n`` returns of the present block, ``best``
    the largest sum of a whole one.
    """

    length: _BlockLength
    n: _Count = 0
    total: _Sum = 0.0
    best: _Sum | None = None

    def __post_init__(self) -> None:
        if self.n >= self.length:
            raise ValueError("a block must be shorter than its length")

    def ends_best(self, episode_return: float) -> bool:
        """Add an episode; return whether it ends a block that is better than all before."""
        self.n += 1
        self.total += min(max(-_LARGEST_RETURN, episode_return), _LARGEST_RETURN)
        if self.n < self.length:
            return False
        is_best = self.best is None or self.total > self.best
        if is_best:
            self.best = self.total
        self.n, self.total = 0, 0.0
        return is_best


class SavedTraining(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The state that `sdnn.agents.Training` resumes.

    ``present`` has an entry for each environment, ``evaluations`` steps and mean returns;
    ``next_episode`` is the number of the first that has not begun; ``wrappers`` are the statistics
    of wrappers when the present episode began.
    """

    steps: _Period | None
    episodes: _Period | None
    seed: int | None
    n_steps: _Count
    n_episodes: _Count
    n_rows: _Count
    next_episode: _Count
    evaluate_every: _Period | None
    evaluate_every_episodes: _Period | None
    evaluation_episodes: Annotated[int, msgspec.Meta(ge=1, le=10**9)]
    limit_bootstraps: bool
    evaluations: list[tuple[_Count, float]]
    present: list[SavedEpisode | None]
    blocks: list[EpisodeBlock] = msgspec.field(default_factory=list)
    wrappers: list[Statistics] = msgspec.field(default_factory=list)

    def __post_init__(self) -> None:
        if (self.steps is None) == (self.episodes is None):
            raise ValueError("one of steps and episodes must be given")
        if self.seed is not None:
            seed_of(self.seed)
        read_statistics(msgspec.to_builtins(self.wrappers))


def write_training(path: Path, agent: Any, training: SavedTraining) -> None:
    """Write both in one file; OSError if it cannot be written."""
    arrays = agent.state()
    for i, episode in enumerate(training.present):
        if episode is not None:
            arrays[f"{_ARRAYS_OF_TRAINING}{i}.actions"] = episode.actions
            arrays[f"{_ARRAYS_OF_TRAINING}{i}.observation"] = episode.observation
    values = msgspec.to_builtins(training, enc_hook=_without_arrays)
    write_file(path, "training", arrays, {**agent.description(), "training": values})


def _without_arrays(value: Any) -> Any:
    """Convert what JSON lacks: NumPy's numbers; arrays, which are stored apart, become null."""
    return None if isinstance(value, np.ndarray) else value.item()


def read_training(path: Path) -> tuple[Any, SavedTraining]:
    """Read an agent and its training.

    OSError if the file cannot be read; ValueError if it is damaged or holds no training.
    """
    agent, description, arrays = read_agent(path, "training")
    may_lack_readings = agent.missing != "error"

    def array(name: str) -> Array:
        """Return an array; ValueError if it is missing, or has NaN where readings cannot lack."""
        if name not in arrays or not (may_lack_readings or np.isfinite(arrays[name]).all()):
            raise ValueError(f"{path} is damaged: {name} must be there, of numbers")
        return arrays[name]

    def actions(name: str) -> Array:
        """Return an array of actions of the agent; ValueError if it holds something else."""
        if not Actions(agent.action_space).hold(array(name)):
            raise ValueError(f"{path} is damaged: {name} must be actions of {agent.action_space}")
        return arrays[name]

    try:
        saved = msgspec.convert(description.get("training"), SavedTraining)
    except msgspec.ValidationError as error:
        raise ValueError(f"{path} is damaged: training: {error}") from None
    present = list(saved.present)
    for i, episode in enumerate(present):
        if episode is not None:
            present[i] = msgspec.structs.replace(
                episode,
                actions=actions(f"{_ARRAYS_OF_TRAINING}{i}.actions"),
                observation=array(f"{_ARRAYS_OF_TRAINING}{i}.observation"),
            )
    return agent, msgspec.structs.replace(saved, present=present)
