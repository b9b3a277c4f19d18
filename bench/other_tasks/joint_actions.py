"""SDNN-C with one value for each joint action of a Box: the agents that two torques compare."""

from __future__ import annotations

from dataclasses import replace
from functools import partial

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray
from tile_coding import N_VALUES, listed_actions

from sdnn.agents import PRESETS, QLearningConfig, SDNNQLearning
from sdnn.approximators import SDNNCConfig
from sdnn.runs.registry import AgentEntry, register


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
