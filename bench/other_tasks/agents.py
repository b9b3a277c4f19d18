"""Our agents and the rivals, each as a function that learns a task.

A contender's ``learn(name, condition, steps, seed, after_step)`` learns the task of this name for a
number of steps and calls ``after_step(n_steps, policy, memory)`` after each, or after each step of
all its environments: ``policy`` gives an observation's greedy action, ``memory()`` the bytes kept.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Protocol

import gymnasium as gym
import numpy as np
import stable_baselines
import stream_ac
from numpy.typing import NDArray
from rows import Work
from tasks import TASKS, Task
from tile_coding import N_VALUES, TileCodingSarsa, listed_actions

from sdnn.agents import Callback, RBFQLearning, SDNNQLearning
from sdnn.agents.presets import PRESETS
from sdnn.approximators import RBFNetworkConfig
from sdnn.bounds import flat_bounds

AfterStep = Callable[[int, Callable[[Any], Any], Callable[[], int]], None]


class Learn(Protocol):
    """See the module."""

    def __call__(
        self, name: str, condition: str, steps: int, seed: int, after_step: AfterStep
    ) -> None:
        """Learn."""


@dataclass(frozen=True, kw_only=True)
class Contender:
    """A method of learning.

    Parameters
    ----------
    title
        For a reader.
    learn
        See the module.
    tasks
        It is run on.
    steps
        By task, where it was published with a shorter or longer training than the task's.
    make
        Makes the environment as it sees it: ``make(task, condition, evaluation)``.
    """

    title: str
    learn: Learn
    tasks: tuple[str, ...]
    steps: Mapping[str, int] = field(default_factory=dict)
    make: Callable[[Task, str, bool], gym.Env[Any, Any]] = Task.make


class _Report(Callback):
    def __init__(self, after_step: AfterStep) -> None:
        self._after_step = after_step

    def on_step(self, training) -> None:
        agent = training.agent

        def memory():
            return sum(array.nbytes for array in agent.state().values())

        self._after_step(training.n_steps, partial(agent.act, explore=False), memory)


class ListedActions(gym.ActionWrapper):
    """All joint actions of a Box, 5 values in each dimension, as a Discrete space."""

    def __init__(self, env) -> None:
        super().__init__(env)
        self._actions = listed_actions(env.action_space)
        self.action_space = gym.spaces.Discrete(len(self._actions))

    def action(self, action):
        """Give the Box's element."""
        return self._actions[int(action)]


def _learn_ours(make, name, condition, steps, seed, after_step):
    _learn_in(_environment(TASKS[name], condition), make, name, condition, steps, seed, after_step)


def _environment(task: Task, condition: str, evaluation: bool = False):
    """Make it as our agents see it: what is said of variables is said of them in their units."""
    make = task.make_unscaled if task.options else task.make
    return make(condition, evaluation)


def _learn_joint(name, condition, steps, seed, after_step):
    env = ListedActions(_environment(TASKS[name], condition))

    def after(n_steps, policy, memory):
        after_step(n_steps, lambda observation: env.action(policy(observation)), memory)

    _learn_in(env, SDNNQLearning, name, condition, steps, seed, after)


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


def _learn_joint_ascending(name, condition, steps, seed, after_step):
    """Learn as the joint one does, and look at what its network is worth when it is searched so."""
    env = ListedActions(_environment(TASKS[name], condition))
    agent = _agent(env, SDNNQLearning, name, condition, seed)
    shape = (N_VALUES,) * env.unwrapped.action_space.shape[0]

    def policy(observation):
        values = agent.q_values(observation).reshape(shape)
        return env.action(np.ravel_multi_index(ascend(values), shape))

    report = _Report(lambda n_steps, _, memory: after_step(n_steps, policy, memory))
    agent.train(env, steps=steps, callbacks=[report])


def _learn_in(env, make, name, condition, steps, seed, after_step):
    agent = _agent(env, make, name, condition, seed)
    agent.train(env, steps=steps, callbacks=[_Report(after_step)])


def _agent(env, make, name, condition, seed):
    options = dict(TASKS[name].options)
    if condition != "clean":
        options.pop("observation_range", None)  # the space has it
    return make(env.observation_space, env.action_space, seed=seed, **options)


def _brief(*spaces, **options):
    learning = replace(PRESETS["general"].learning, max_repetitions=1)
    return SDNNQLearning(*spaces, learning=learning, **options)


def _with_bounds(*spaces, observation_range=None, **options):
    return SDNNQLearning(*spaces, **options)


def _with_ranges_seen(*spaces, observation_range=None, **options):
    return SDNNQLearning(*spaces, observation_range="seen", **options)


def _with_fewer_pairs(*spaces, **options):
    sizes = replace(PRESETS["general"].approximator, max_pairs=24)
    return SDNNQLearning(*spaces, approximator=sizes, **options)


RBF_SETTINGS = {
    "CartPole": {"n_bases": 8, "n_steps": 1},
    "Pendulum": {"n_bases": 8, "n_steps": 1},
    "MountainCar": {"n_bases": 16, "n_steps": 5},
    "MountainCarContinuous": {"n_bases": 8, "n_steps": 5},
    "Acrobot": {"n_bases": 3, "n_steps": 5},
}
"""Bases of a dimension and steps of a target; the best of a few on one or two seeds each."""


def _rbf(*spaces, angle_pairs=(), **options):
    """Its bases know no circle: cosines and sines serve it better than the angles."""
    return RBFQLearning(*spaces, **options)


def _learn_rbf(name, condition, steps, seed, after_step):
    general, settings = PRESETS["general"], RBF_SETTINGS[name]
    n_actions = general.approximator.n_actions
    make = partial(
        _rbf,
        approximator=RBFNetworkConfig(n_actions=n_actions, n_bases=settings["n_bases"]),
        learning=replace(general.learning, n_steps=settings["n_steps"]),
    )
    _learn_ours(make, name, condition, steps, seed, after_step)


TILINGS = {
    "CartPole": {"n_bins": 6, "n_tilings": 16},
    "Pendulum": {"n_bins": 8, "n_tilings": 16},
    "MountainCar": {"n_bins": 8, "n_tilings": 8, "discount": 1.0, "epsilon": 0.0},
    "MountainCarContinuous": {"n_bins": 8, "n_tilings": 8},
    "Acrobot": {"n_bins": 4, "n_tilings": 16, "discount": 1.0, "epsilon": 0.0},
    "LunarLanderContinuous": {"n_bins": 3, "n_tilings": 16},
    "Reaching": {"n_bins": 2, "n_tilings": 16, "discount": 0.9},
    "Wheels": {"n_bins": 3, "n_tilings": 16},
}
"""Finer grids for fewer variables; tasks of -1 a step need no chance, as in the book."""


def _learn_tiles(name, condition, steps, seed, after_step):
    task = TASKS[name]
    env = task.make(condition)
    low, high = task.ends() if condition == "clean" else flat_bounds(env.observation_space)
    agent = TileCodingSarsa(env.action_space, (low, high), seed=seed, **TILINGS[name])
    agent.learn(
        env, steps, seed, lambda n: after_step(n, agent.greedy, lambda: agent.weights.nbytes)
    )


def _learn_stable(algorithm, name, condition, steps, seed, after_step):
    make = partial(TASKS[name].make_unscaled, condition)
    stable_baselines.learn(algorithm, name, make, steps, seed, after_step)


def _learn_stream_ac(name, condition, steps, seed, after_step):
    stream_ac.learn(TASKS[name].make_unscaled(condition), steps, seed, after_step)


def _stable(algorithm):
    return Contender(
        title=f"{algorithm}, Stable-Baselines3",
        learn=partial(_learn_stable, algorithm),
        tasks=tuple(stable_baselines.SETTINGS[algorithm]),
        steps=stable_baselines.steps_of(algorithm),
        make=Task.make_unscaled,
    )


def _ours(**options):
    return Contender(make=_environment, **options)


CONTENDERS = {
    "sdnn": _ours(title="SDNN-C", learn=partial(_learn_ours, SDNNQLearning), tasks=tuple(TASKS)),
    "sdnn-small": _ours(
        title="SDNN-C, small",
        learn=partial(_learn_ours, partial(SDNNQLearning, preset="small")),
        tasks=("CartPole", "Pendulum", "MountainCarContinuous"),
    ),
    "sdnn-brief": _ours(
        title="SDNN-C, brief random actions", learn=partial(_learn_ours, _brief), tasks=tuple(TASKS)
    ),
    "sdnn-bounds": _ours(
        title="SDNN-C, bounds of the space",
        learn=partial(_learn_ours, _with_bounds),
        tasks=("LunarLanderContinuous",),
    ),
    "sdnn-seen": _ours(
        title="SDNN-C, ranges seen",
        learn=partial(_learn_ours, _with_ranges_seen),
        tasks=("LunarLanderContinuous",),
    ),
    "sdnn-fewer-pairs": _ours(
        title="SDNN-C, 24 pairs of inputs",
        learn=partial(_learn_ours, _with_fewer_pairs),
        tasks=("LunarLanderContinuous",),
    ),
    "sdnn-joint": _ours(
        title="SDNN-C, joint actions", learn=_learn_joint, tasks=("Reaching", "Wheels")
    ),
    "sdnn-joint-ascent": _ours(
        title="SDNN-C, joint actions, by ascent",
        learn=_learn_joint_ascending,
        tasks=("Reaching", "Wheels"),
    ),
    "rbf": _ours(
        title="RBFN",
        learn=_learn_rbf,
        tasks=tuple(RBF_SETTINGS),
    ),
    "tiles": Contender(
        title="Sarsa(lambda), tile coding", learn=_learn_tiles, tasks=tuple(TILINGS)
    ),
    "stream-ac": Contender(
        title="stream AC",
        learn=_learn_stream_ac,
        tasks=stream_ac.TASKS,
        make=Task.make_unscaled,
    ),
    "sac": _stable("SAC"),
    "td3": _stable("TD3"),
    "ppo": _stable("PPO"),
}


def work_for(
    n_seeds: int, conditions: Sequence[str], names: Sequence[str], kinds: Sequence[str]
) -> list[Work]:
    """List the trials there are, the contenders of a task and seed one after the other."""
    return [
        (name, condition, kind, seed)
        for seed in range(n_seeds)
        for condition in conditions
        for name in names
        for kind in kinds
        if name in CONTENDERS[kind].tasks
    ]


def train(work: Work, make_looks: Callable[[gym.Env, Task, int, int], AfterStep]) -> None:
    """Let a contender learn, under the eyes of ``make_looks(env, task, steps, seed)``."""
    name, condition, kind, seed = work
    task, contender = TASKS[name], CONTENDERS[kind]
    steps = contender.steps.get(name, task.steps)
    looks = make_looks(contender.make(task, condition, True), task, steps, seed)
    contender.learn(name, condition, steps, seed, looks)
