"""Our agents and the rivals: what is specified of each on a task, and plug-ins made of ours."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from types import MappingProxyType
from typing import Any

import gymnasium as gym
import numpy as np
import stream_ac  # noqa: F401, registers its agent
from numpy.typing import NDArray
from stable_baselines import N_ENVS, SETTINGS, STEPS
from tasks import TASKS, Task
from tile_coding import N_VALUES, listed_actions

from sdnn.agents import PRESETS, QLearningConfig, SDNNQLearning
from sdnn.approximators import SDNNCConfig
from sdnn.runs import AgentSpec, BudgetSpec, EnvironmentSpec, ProtocolSpec, RunSpec
from sdnn.runs.registry import AgentEntry, register

Trial = tuple[str, str, str, int]
"""Task, condition, contender, seed."""


def ascend(values: NDArray[np.float64]) -> tuple[int, ...]:
    """Search the largest of values, an axis for each dimension, one dimension at a time.

    From the middle, until no dimension alone can do better.
    """
    at = [n // 2 for n in values.shape]
    best = -np.inf
    while values[tuple(at)] > best:
        best = values[tuple(at)]
        for dimension in range(len(at)):
            line = np.moveaxis(values, dimension, -1)[tuple(np.delete(at, dimension))]
            if line.max() > line[at[dimension]]:
                at[dimension] = int(np.argmax(line))
    return tuple(at)


class JointActions:
    """SDNN-C with one value for each joint action of a Box, 5 values in each dimension.

    ``ascends`` says whether greedy actions are searched by `ascend`.
    """

    def __init__(self, observation_space, action_space, *, ascends, approximator, **options):
        self._actions = listed_actions(action_space)
        self._shape = (N_VALUES,) * action_space.shape[0]
        self._ascends = ascends
        # How many inputs there are, the agent finds out.
        approximator = replace(approximator, n_inputs=SDNNCConfig().n_inputs)
        listed = gym.spaces.Discrete(len(self._actions))
        self._agent = SDNNQLearning(observation_space, listed, approximator=approximator, **options)
        self.state, self.begin_episode = self._agent.state, self._agent.begin_episode

    @property
    def progress(self) -> float:
        """How much of the training is done."""
        return self._agent.progress

    @progress.setter
    def progress(self, value: float) -> None:
        self._agent.progress = value

    def act(self, observation, explore=True):
        """Choose the Box's element."""
        if self._ascends and not explore:
            values = self._agent.q_values(observation).reshape(self._shape)
            return self._actions[np.ravel_multi_index(ascend(values), self._shape)]
        chosen = self._agent.act(observation, explore=explore)
        if explore:
            self._chosen = chosen
        return self._actions[int(chosen)]

    def learn(self, transition) -> None:
        """Learn it as a step with the listed action."""
        self._agent.learn(transition._replace(action=self._chosen))


for name, ascends in (("sdnn-c-joint", False), ("sdnn-c-joint-ascent", True)):
    register(
        AgentEntry(
            id=name,
            title="SDNN-C, joint actions" + (", by ascent" if ascends else ""),
            approximator=SDNNCConfig,
            learning=QLearningConfig,
            agent=partial(JointActions, ascends=ascends),
            presets=PRESETS,
        )
    )


@dataclass(frozen=True, kw_only=True)
class Contender:
    """A method of learning.

    Parameters
    ----------
    title
        For a reader.
    tasks
        It is run on.
    environment
        The environment as it sees it, of a task and a condition.
    settings
        Agent and other parts of its specification, of a task.
    """

    title: str
    tasks: Sequence[str] = tuple(TASKS)
    environment: Callable[[Task, str], EnvironmentSpec]
    settings: Callable[[str], Mapping[str, Any]]

    def spec(self, name: str, condition: str, seed: int) -> RunSpec:
        """Specify its run on a task."""
        task = TASKS[name]
        settings = {
            "budget": BudgetSpec(steps=task.steps),
            "protocol": ProtocolSpec(evaluate_every=0),
            **self.settings(name),
        }
        return RunSpec(environment=self.environment(task, condition), seed=seed, **settings)


def _seen_by_ours(task: Task, condition: str) -> EnvironmentSpec:
    """Give what is said of variables, which is said of them in their units."""
    own_units = bool(task.angle_pairs or task.declares_ranges)
    return task.environment(condition, own_units=own_units, with_ranges=task.declares_ranges)


def _own_units(task: Task, condition: str) -> EnvironmentSpec:
    return task.environment(condition, own_units=True, with_ranges=False)


def _ours(
    variant: str = "",
    *,
    name: str = "sdnn-c",
    agent: Mapping[str, Any] = MappingProxyType({}),
    tasks: Sequence[str] = tuple(TASKS),
    environment: Callable[[Task, str], EnvironmentSpec] = _seen_by_ours,
    **parts: Any,
) -> Contender:
    """Specify a variant of ours; ``agent`` and ``parts`` are what it changes."""

    def settings(task: str) -> dict[str, Any]:
        pairs = TASKS[task].angle_pairs or "none"
        return {"agent": AgentSpec(**{"name": name, "angle_pairs": pairs, **agent}), **parts}

    return Contender(
        title=f"SDNN-C{variant}", tasks=tasks, environment=environment, settings=settings
    )


RBF_SETTINGS = {
    "CartPole": {"n_bases": 8, "n_steps": 1},
    "Pendulum": {"n_bases": 8, "n_steps": 1},
    "MountainCar": {"n_bases": 16, "n_steps": 5},
    "MountainCarContinuous": {"n_bases": 8, "n_steps": 5},
    "Acrobot": {"n_bases": 3, "n_steps": 5},
}
"""Bases of a dimension and steps of a target; the best of a few on one or two seeds each."""


def _rbf_settings(name: str) -> dict[str, Any]:
    """Its bases know no circle: cosines and sines serve it better than the angles."""
    general, own = PRESETS["general"], RBF_SETTINGS[name]
    return {
        "agent": AgentSpec(name="rbf"),
        "approximator": {
            "n_actions": general.approximator.n_actions,
            "n_bases": own["n_bases"],
        },
        "learning": replace(general.learning, n_steps=own["n_steps"]),
    }


_OF_UNIT_COST = {"discount": 1.0, "epsilon": 0.0}
TILINGS: dict[str, tuple[dict[str, int], dict[str, float]]] = {
    "CartPole": ({"n_bins": 6, "n_tilings": 16}, {}),
    "Pendulum": ({"n_bins": 8, "n_tilings": 16}, {}),
    "MountainCar": ({"n_bins": 8, "n_tilings": 8}, _OF_UNIT_COST),
    "MountainCarContinuous": ({"n_bins": 8, "n_tilings": 8}, {}),
    "Acrobot": ({"n_bins": 4, "n_tilings": 16}, _OF_UNIT_COST),
    "LunarLanderContinuous": ({"n_bins": 3, "n_tilings": 16}, {}),
    "Reaching": ({"n_bins": 2, "n_tilings": 16}, {"discount": 0.9}),
    "Wheels": ({"n_bins": 3, "n_tilings": 16}, {}),
}
"""Finer grids for fewer variables; tasks of -1 a step need no chance, as in the book."""


def _tile_settings(name: str) -> dict[str, Any]:
    tiles, learning = TILINGS[name]
    return {"agent": AgentSpec(name="tiles"), "approximator": tiles, "learning": learning}


def _stable(algorithm: str) -> Contender:
    def settings(name: str) -> dict[str, Any]:
        published = SETTINGS[algorithm][name]
        return {
            "agent": AgentSpec(name=algorithm.lower()),
            "learning": {"task": name},
            "budget": BudgetSpec(steps=published[STEPS]),
            "protocol": ProtocolSpec(evaluate_every=0, n_envs=published.get(N_ENVS, 1)),
        }

    return Contender(
        title=f"{algorithm}, Stable-Baselines3",
        tasks=tuple(SETTINGS[algorithm]),
        environment=_own_units,
        settings=settings,
    )


_LANDER, _TORQUES = ("LunarLanderContinuous",), ("Reaching", "Wheels")

CONTENDERS = {
    "sdnn-c": _ours(),
    "sdnn-c-small": _ours(
        ", small",
        agent={"preset": "small"},
        tasks=("CartPole", "Pendulum", "MountainCarContinuous"),
    ),
    "sdnn-c-brief": _ours(", brief random actions", learning={"max_action_repeat": 1}),
    "sdnn-c-bounds": _ours(", bounds of the space", environment=_own_units, tasks=_LANDER),
    "sdnn-c-seen": _ours(
        ", adaptive ranges",
        agent={"observation_range": "adaptive"},
        environment=_own_units,
        tasks=_LANDER,
    ),
    "sdnn-c-fewer-pairs": _ours(
        ", 24 pairs of inputs", approximator={"max_pairs": 24}, tasks=_LANDER
    ),
    "sdnn-c-joint": _ours(", joint actions", name="sdnn-c-joint", tasks=_TORQUES),
    "sdnn-c-joint-ascent": _ours(
        ", joint actions, by ascent", name="sdnn-c-joint-ascent", tasks=_TORQUES
    ),
    "rbf": Contender(
        title="RBFN",
        tasks=tuple(RBF_SETTINGS),
        environment=_seen_by_ours,
        settings=_rbf_settings,
    ),
    "tiles": Contender(
        title="Sarsa(lambda), tile coding",
        environment=Task.environment,
        settings=_tile_settings,
    ),
    "stream-ac": Contender(
        title="stream AC",
        environment=_own_units,
        settings=lambda name: {"agent": AgentSpec(name="stream-ac")},
    ),
    **{algorithm.lower(): _stable(algorithm) for algorithm in SETTINGS},
}


def trials_of(
    n_seeds: int, conditions: Sequence[str], names: Sequence[str], kinds: Sequence[str]
) -> list[Trial]:
    """List the trials there are, the contenders of a task and seed one after the other."""
    return [
        (name, condition, kind, seed)
        for seed in range(n_seeds)
        for condition in conditions
        for name in names
        for kind in kinds
        if name in CONTENDERS[kind].tasks
    ]
