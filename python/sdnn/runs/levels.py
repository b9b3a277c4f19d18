"""Levels to compare returns with: an environment's goal, random actions, and stored baselines."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from contextlib import closing
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import gymnasium as gym
import msgspec
import numpy as np

from sdnn.environments.types import Element, Space
from sdnn.runs.environment import EnvironmentSpec
from sdnn.runs.errors import ConfigError
from sdnn.training.evaluation import greedy_episode

MAX_EPISODES, MAX_STEPS = 20, 10_000
"""Random actions are measured in this number of episodes, or in those that the steps allow."""

_MEASURED_PACKAGES = ("gymnasium", "sdnn")
"""Packages whose environments can be stepped without asking: no code of a user, and no robot."""


@dataclass(frozen=True, kw_only=True)
class Level:
    """A return to compare with in the panel of a task."""

    task: str
    title: str
    value: float

    def rows(self) -> Iterator[tuple[object, ...]]:
        """Yield its row of a file of curves, without a step."""
        yield (self.task, "", self.title, "", "", "", self.value, "", "")


def levels_of(
    tasks: Mapping[str, EnvironmentSpec], baselines: Sequence[str] = (), *, plain: bool = False
) -> tuple[list[Level], list[str]]:
    """Return the levels of tasks, by the titles of their panels, and notes about missing baselines.

    These are the goal of the environment's registration, unless arguments change the environment;
    the mean return of random actions, in environments of Gymnasium and of this package; and the
    baselines that are named. With `plain` only these. ConfigError if a name is not that of a stored
    baseline.
    """
    known = baseline_names()
    for name in baselines:
        if name not in known:
            names = ", ".join(map(repr, known))
            raise ConfigError("baseline", f"must be one of {names}, got {name!r}")
    levels, notes = [], []
    for task, environment in tasks.items():
        for title, measure in (("goal", goal_of), ("random actions", mean_random_return)):
            if not plain and (value := measure(environment)) is not None:
                levels.append(Level(task=task, title=title, value=value))
        is_changed = environment != EnvironmentSpec(id=environment.id)
        stored = {} if is_changed else _baselines().get(environment.id, {})
        for name in baselines:
            if name in stored:
                levels.append(Level(task=task, title=name, value=stored[name]))
            else:
                notes.append(f"{task}: no stored return of {name}")
    return levels, notes


def goal_of(environment: EnvironmentSpec) -> float | None:
    """Return the return that solves an environment; None if unknown, or arguments change it."""
    registered = gym.registry.get(environment.id)
    if registered is None or environment.kwargs:
        return None
    return registered.reward_threshold


class _RandomAgent:
    """An agent that takes random actions of a space."""

    def __init__(self, actions: Space) -> None:
        self._actions = actions

    def act(self, observation: Element, explore: bool = False) -> Element:
        """Return a random action, whatever is observed."""
        return self._actions.sample()


@cache
def mean_random_return(environment: EnvironmentSpec) -> float | None:
    """Return the mean return of random actions, always the same; None if it cannot be measured."""
    registered = gym.registry.get(environment.id)
    entry = "" if registered is None else str(registered.entry_point)
    if entry.partition(".")[0] not in _MEASURED_PACKAGES or environment.action_masks:
        return None
    returns: list[float] = []
    n_steps_left = MAX_STEPS
    with closing(environment.without_noise().make()) as env:
        env.action_space.seed(0)
        agent = _RandomAgent(env.action_space)
        for episode in range(MAX_EPISODES):
            for now in greedy_episode(agent, env, 0, episode):
                if now.n_steps > n_steps_left:  # an episode that is cut off has no return
                    return float(np.mean(returns)) if returns else None
            returns.append(now.total_reward)
            n_steps_left -= now.n_steps
    return float(np.mean(returns))


@cache
def _baselines() -> dict[str, dict[str, float]]:
    """Return the median return of each stored baseline by environment and agent."""
    content = files("sdnn.runs").joinpath("baselines.json").read_bytes()
    return msgspec.json.decode(content, type=dict[str, dict[str, float]])


def baseline_names() -> list[str]:
    """Return the names of all stored baselines."""
    return list(dict.fromkeys(name for returns in _baselines().values() for name in returns))
