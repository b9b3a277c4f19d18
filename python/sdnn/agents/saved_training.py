"""A training in the file of its agent: how far it is, and the episodes it is within."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Annotated, Any, Protocol

import msgspec
import numpy as np
from numpy.typing import NDArray

from sdnn.agents.files import read_agent
from sdnn.arguments import seed_of
from sdnn.files import Arrays, Description, write_file

__all__ = ["SavedEpisode", "SavedTraining", "read_training", "write_training"]

_ARRAYS = "training."
_EVALUATIONS = _ARRAYS + "evaluations"

_Count = Annotated[int, msgspec.Meta(ge=0, le=2**53)]
_Period = Annotated[int, msgspec.Meta(ge=1, le=2**53)]


class Saved(Protocol):
    """What an agent's file is made of."""

    def description(self) -> Description:
        """Say what it is."""

    def state(self) -> Arrays:
        """Give what it remembers."""


class SavedEpisode(msgspec.Struct, frozen=True, kw_only=True):
    """The present episode in one environment.

    Parameters
    ----------
    number
        Of all that have begun.
    sum_of_rewards
        Learned in it.
    waits
        Whether the last action's outcome is still to be learned.
    actions
        Taken in it, shape (n, ...).
    observation
        The last one, flattened.
    """

    number: _Count
    sum_of_rewards: float
    waits: bool
    actions: Any = None
    observation: Any = None


class SavedTraining(msgspec.Struct, frozen=True, kw_only=True):
    """What `sdnn.agents.Training` resumes.

    ``present`` has an entry for each environment, ``evaluations`` steps and mean returns, shape
    (n, 2); ``next_episode`` is the number of the first that has not begun.
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
    present: Sequence[SavedEpisode | None]
    evaluations: Any = None

    def __post_init__(self) -> None:
        if (self.steps is None) == (self.episodes is None):
            raise ValueError("one of steps and episodes must be given")
        if self.seed is not None:
            seed_of(self.seed)


def write_training(path: Path, agent: Saved, training: SavedTraining) -> None:
    """Write both in one file; OSError if it cannot be written."""
    arrays = agent.state()
    arrays[_EVALUATIONS] = training.evaluations
    for i, episode in enumerate(training.present):
        if episode is not None:
            arrays[_prefix(i) + "actions"] = episode.actions
            arrays[_prefix(i) + "observation"] = episode.observation
    told = msgspec.to_builtins(training, enc_hook=_without_arrays)
    write_file(path, "training", arrays, {**agent.description(), "training": told})


def _without_arrays(value: Any) -> Any:
    return None if isinstance(value, np.ndarray) else value.item()


def read_training(path: Path) -> tuple[Any, SavedTraining]:
    """Read an agent and its training.

    Raises
    ------
    OSError
        If the file cannot be read.
    ValueError
        If it is damaged or holds no training.
    """
    agent, description, arrays = read_agent(path, "training")
    try:
        saved = msgspec.convert(description.get("training"), SavedTraining)
    except msgspec.ValidationError as error:
        raise ValueError(f"{path} is damaged: training: {error}") from None
    evaluations = _array(path, arrays, _EVALUATIONS)
    if evaluations.ndim != 2 or evaluations.shape[1] != 2:
        raise ValueError(f"{path} is damaged: {_EVALUATIONS} must have shape (n, 2)")
    present = [
        episode
        and msgspec.structs.replace(
            episode,
            actions=_array(path, arrays, _prefix(i) + "actions"),
            observation=_array(path, arrays, _prefix(i) + "observation"),
        )
        for i, episode in enumerate(saved.present)
    ]
    return agent, msgspec.structs.replace(saved, evaluations=evaluations, present=present)


def _prefix(environment: int) -> str:
    """Of the names of an environment's arrays."""
    return f"{_ARRAYS}{environment}."


def _array(path: Path, arrays: Arrays, name: str) -> NDArray[Any]:
    # Infinite numbers may be observed: they saturate.
    if name not in arrays or np.isnan(arrays[name]).any():
        raise ValueError(f"{path} is damaged: {name} must be there, of numbers")
    return arrays[name]
