"""Agents and trainings in files: which class rebuilds an agent, and the episodes it is within."""

from __future__ import annotations

import base64
import warnings
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal

import gymnasium as gym
import msgspec
import numpy as np
from numpy.typing import NDArray

from sdnn.arguments import path_of, seed_of
from sdnn.files import Arrays, Description, read_file, write_file

if TYPE_CHECKING:
    from sdnn.agents.agent import Agent

_ARRAYS_OF_TRAINING = "training."
"""Prefix of the names of arrays that are not the agent's."""

_CLASSES: dict[str, type[Any]] = {}

_Count = Annotated[int, msgspec.Meta(ge=0, le=2**53)]
_Period = Annotated[int, msgspec.Meta(ge=1, le=2**53)]


def register(kind: type[Any]) -> None:
    """Make a class of agents known by its name; its ``rebuild`` makes one from a file.

    A class that is defined again, as in a notebook or by a script that is imported too, replaces
    the one before. TypeError for the name of a class of this package, which files could confuse.
    """
    known = _CLASSES.get(kind.__name__, kind)
    is_ours = known.__module__.partition(".")[0] == "sdnn"
    if is_ours and known.__module__ != kind.__module__:
        raise TypeError(
            f"an agent's class needs a name of its own, for its files: {kind.__name__} is that of"
            f" {known.__module__}.{known.__qualname__}"
        )
    _CLASSES[kind.__name__] = kind


def read_agent(path: Path, *kinds: str) -> tuple[Any, Description, Arrays]:
    """Read a file of one of these kinds: its agent, its description and its arrays.

    OSError if it cannot be read; ValueError if it is damaged, of another kind or format, or does
    not fit together.
    """
    description, arrays = read_file(path, *kinds)
    name = description.get("class")
    if str(name) not in _CLASSES:
        raise ValueError(f"{path} holds an agent of an unknown class, {name!r}")
    own = {key: a for key, a in arrays.items() if not key.startswith(_ARRAYS_OF_TRAINING)}
    try:
        return _CLASSES[str(name)].rebuild(description, own), description, arrays
    except (ArithmeticError, AttributeError, LookupError, TypeError, ValueError) as error:
        raise ValueError(f"{path} is damaged: {error}") from error


# Wrappers that learn: they have an attribute ``obs_rms`` or ``return_rms`` with numbers ``mean``,
# ``var`` and ``count``, as Gymnasium's NormalizeObservation and NormalizeReward have.

_STATISTICS = ("obs_rms", "return_rms")
_MOMENTS = ("mean", "var", "count")
_SUMS = ("discounted_reward", "accumulated_reward")


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
    """Give each wrapper what one of its name has learned, in order; whether all have got theirs."""
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


class SavedEpisode(msgspec.Struct, frozen=True, kw_only=True):
    """The present episode in one environment.

    ``number`` counts all that have begun; ``waits`` is whether the last action's outcome is still
    to be learned; ``actions`` are those taken, shape (n, ...); ``observation`` is the last one,
    flattened.
    """

    number: _Count
    sum_of_rewards: float
    waits: bool
    actions: Any = None
    observation: Any = None


class SavedTraining(msgspec.Struct, frozen=True, kw_only=True, omit_defaults=True):
    """The state that `sdnn.agents.Training` resumes.

    ``present`` has an entry for each environment, ``evaluations`` steps and mean returns;
    ``next_episode`` is the number of the first that has not begun; ``wrappers`` have learned as
    much when the present episode began.
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
    return None if isinstance(value, np.ndarray) else value.item()


def read_training(path: Path) -> tuple[Any, SavedTraining]:
    """Read an agent and its training; errors as of `read_agent`."""
    agent, description, arrays = read_agent(path, "training")

    def array(name: str) -> NDArray[Any]:
        # Infinite numbers may be observed: they saturate.
        if name not in arrays or np.isnan(arrays[name]).any():
            raise ValueError(f"{path} is damaged: {name} must be there, of numbers")
        return arrays[name]

    def actions(name: str) -> NDArray[Any]:
        if not _are_actions(agent.action_space, array(name)):
            raise ValueError(f"{path} is damaged: {name} must be actions of {agent.action_space}")
        return arrays[name]

    try:
        saved = msgspec.convert(description.get("training"), SavedTraining)
    except msgspec.ValidationError as error:
        raise ValueError(f"{path} is damaged: training: {error}") from None
    present = [
        episode
        and msgspec.structs.replace(
            episode,
            actions=actions(f"{_ARRAYS_OF_TRAINING}{i}.actions"),
            observation=array(f"{_ARRAYS_OF_TRAINING}{i}.observation"),
        )
        for i, episode in enumerate(saved.present)
    ]
    return agent, msgspec.structs.replace(saved, present=present)


def _are_actions(space: Any, values: NDArray[Any]) -> bool:
    """Return whether the rows of an array are actions of a space; environments need not check."""
    if isinstance(space, gym.spaces.Discrete):
        low, high = space.start, space.start + space.n - 1
    elif isinstance(space, gym.spaces.Box):
        low, high = space.low, space.high
    else:
        low = getattr(space, "start", 0)
        high = low + getattr(space, "nvec", 2) - 1
    is_alike = values.dtype.kind == space.dtype.kind or np.can_cast(values.dtype, space.dtype)
    is_shaped = values.ndim > 0 and values.shape[1:] == space.shape
    return is_shaped and (
        len(values) == 0 or (is_alike and bool(((low <= values) & (values <= high)).all()))
    )


def load_agent(path: str | Path) -> Agent[Any, Any]:
    """Read an agent of any kind that `Agent.save` wrote; see `Agent.load`."""
    agent: Agent[Any, Any] = read_agent(path_of("path", path), "agent", "training")[0]
    return agent
