"""A training in the file of its agent: how far it is, and the episodes it is within."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from sdnn.agents.files import read_agent
from sdnn.arguments import flag, real, whole
from sdnn.files import Arrays, Description, write_file

__all__ = ["SavedEpisode", "SavedTraining", "read_training", "write_training"]

_ARRAYS = "training."
_EVALUATIONS = _ARRAYS + "evaluations"
_LIMITS = {
    "steps": (1, 2**53),
    "episodes": (1, 2**53),
    "seed": (0, 2**64 - 1),
    "n_steps": (0, 2**53),
    "n_episodes": (0, 2**53),
    "n_rows": (0, 2**53),
    "next_episode": (0, 2**53),
    "evaluate_every": (1, 2**53),
    "evaluate_every_episodes": (1, 2**53),
    "evaluation_episodes": (1, 10**9),
}
_MAY_BE_NONE = ("steps", "episodes", "seed", "evaluate_every", "evaluate_every_episodes")


class Saved(Protocol):
    """What an agent's file is made of."""

    def description(self) -> Description:
        """Say what it is."""

    def state(self) -> Arrays:
        """Give what it remembers."""


@dataclass(frozen=True, kw_only=True)
class SavedEpisode:
    """The present episode in one environment.

    Parameters
    ----------
    number
        Of all that have begun.
    sum_of_rewards
        Learned in it.
    actions
        Taken in it, shape (n, ...).
    observation
        The last one, flattened.
    waits
        Whether the last action's outcome is still to be learned.
    """

    number: int
    sum_of_rewards: float
    actions: NDArray[Any]
    observation: NDArray[np.float64]
    waits: bool


@dataclass(frozen=True, kw_only=True)
class SavedTraining:
    """What `sdnn.agents.Training` goes on from.

    ``evaluations`` has steps and mean returns, shape (n, 2); ``present`` an entry for each
    environment; ``next_episode`` is the number of the first that has not begun.
    """

    steps: int | None
    episodes: int | None
    seed: int | None
    n_steps: int
    n_episodes: int
    n_rows: int
    next_episode: int
    evaluate_every: int | None
    evaluate_every_episodes: int | None
    evaluation_episodes: int
    limit_bootstraps: bool
    evaluations: NDArray[np.float64]
    present: Sequence[SavedEpisode | None]


def write_training(path: Path, agent: Saved, training: SavedTraining) -> None:
    """Write both in one file; OSError if it cannot be written."""
    arrays = agent.state()
    arrays[_EVALUATIONS] = training.evaluations
    for i, episode in enumerate(training.present):
        if episode is not None:
            arrays[_prefix(i) + "actions"] = episode.actions
            arrays[_prefix(i) + "observation"] = episode.observation
    told: dict[str, Any] = {name: getattr(training, name) for name in _LIMITS}
    told["limit_bootstraps"] = training.limit_bootstraps
    told["environments"] = [
        episode
        and {"episode": episode.number, "return": episode.sum_of_rewards, "waits": episode.waits}
        for episode in training.present
    ]
    write_file(path, "training", arrays, {**agent.description(), "training": told})


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
    told = _checked(path, description.get("training"))
    evaluations = _array(path, arrays, _EVALUATIONS)
    if evaluations.ndim != 2 or evaluations.shape[1] != 2:
        raise ValueError(f"{path} is damaged: {_EVALUATIONS} must have shape (n, 2)")
    present = [
        None
        if one is None
        else SavedEpisode(
            number=one["episode"],
            sum_of_rewards=one["return"],
            actions=_array(path, arrays, _prefix(i) + "actions"),
            observation=_array(path, arrays, _prefix(i) + "observation"),
            waits=one["waits"],
        )
        for i, one in enumerate(told["environments"])
    ]
    limited = {name: told[name] for name in _LIMITS}
    limited["limit_bootstraps"] = told["limit_bootstraps"]
    return agent, SavedTraining(**limited, evaluations=evaluations, present=present)


def _prefix(environment: int) -> str:
    """Of the names of an environment's arrays."""
    return f"{_ARRAYS}{environment}."


def _checked(path: Path, told: Any) -> Mapping[str, Any]:
    try:
        if not isinstance(told, dict):
            raise TypeError(f"training must be a table, got {told!r}")
        for name, (low, high) in _LIMITS.items():
            if told[name] is not None or name not in _MAY_BE_NONE:
                whole(name, told[name], low, high)
        if (told["steps"] is None) == (told["episodes"] is None):
            raise ValueError("one of steps and episodes must be given")
        flag("limit_bootstraps", told["limit_bootstraps"])
        for one in told["environments"]:
            if one is not None:
                whole("episode", one["episode"], 0, 2**53)
                real("return", one["return"])
                flag("waits", one["waits"])
    except KeyError as error:
        raise ValueError(f"{path} is damaged: training has no {error}") from None
    except (OverflowError, TypeError, ValueError) as error:
        raise ValueError(f"{path} is damaged: {error}") from error
    checked: Mapping[str, Any] = told
    return checked


def _array(path: Path, arrays: Arrays, name: str) -> NDArray[Any]:
    # Infinite numbers may be observed: they saturate.
    if name not in arrays or np.isnan(arrays[name]).any():
        raise ValueError(f"{path} is damaged: {name} must be there, of numbers")
    return arrays[name]
