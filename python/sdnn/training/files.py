"""Files of agents and of their trainings."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Annotated, Any, Protocol

import msgspec
import numpy as np

from sdnn.environments.spaces import Actions
from sdnn.environments.types import Array, Data
from sdnn.support.arguments import seed_of
from sdnn.support.state_files import Arrays, Description, read_file, write_file
from sdnn.training.statistics import Statistics, read_statistics

_ARRAYS_OF_TRAINING = "training."
"""Prefix of the names of arrays that are not the agent's."""

_Count = Annotated[int, msgspec.Meta(ge=0, le=2**53)]
_Period = Annotated[int, msgspec.Meta(ge=1, le=2**53)]


class SavedClass(Protocol):
    """A class whose objects are made of what files hold."""

    def rebuild(self, description: Mapping[str, Any], arrays: Mapping[str, Array]) -> Any:
        """Make an object; an ordinary error if description and arrays do not fit."""


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

    takes_missing = agent.missing != "error"

    def array(name: str) -> Array:
        if name not in arrays or not (takes_missing or np.isfinite(arrays[name]).all()):
            raise ValueError(f"{path} is damaged: {name} must be there, of numbers")
        return arrays[name]

    def actions(name: str) -> Array:
        if not Actions(agent.action_space).hold(array(name)):
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
