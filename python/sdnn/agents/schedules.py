"""The scheduled settings of an agent over its training: epsilon and alpha."""

from __future__ import annotations

import dataclasses
from typing import NamedTuple

import gymnasium as gym
import numpy as np

from sdnn.agents.inspection import Floats
from sdnn.agents.q_lambda import SDNNQLambda
from sdnn.agents.q_learning import ValueAgent

_N_LEARNED = "agent.n_learned"  # the number of steps in the state of agents with `schedule_steps`


class RateCurves(NamedTuple):
    """Epsilon and alpha at points of a training, each (n,)."""

    epsilon: Floats
    learning_rate: Floats


def schedule_of(agent: ValueAgent[object, object], steps: Floats, progress: Floats) -> RateCurves:
    """Return the scheduled rates at numbers of steps and their progress, each of shape (n,).

    An agent with the same settings, but a single input, computes them, so that the agent itself
    stays as it is. Rates that a user has set are not in them.
    """
    learning = agent.learning
    if isinstance(agent, SDNNQLambda):
        learning = dataclasses.replace(agent.learning, final_epsilon=agent.final_epsilon)
    small = type(agent)(
        gym.spaces.Box(0.0, 1.0, (1,)),
        gym.spaces.Box(0.0, 1.0, (1,)),
        learning=learning,
        seed=0,
        observation_range=(0.0, 1.0),
        angle_pairs="none",
        inputs="all",
        history="none",
    )
    state = small.state()
    epsilon, learning_rate = np.zeros(len(steps)), np.zeros(len(steps))
    for i, (n_steps, done) in enumerate(zip(steps.tolist(), progress.tolist(), strict=True)):
        if _N_LEARNED in state:
            n_learned = np.asarray(n_steps, state[_N_LEARNED].dtype)
            small._controller.restore(state | {_N_LEARNED: n_learned})
        small.progress = min(1.0, done)
        epsilon[i], learning_rate[i] = small.epsilon, small.learning_rate
    return RateCurves(epsilon, learning_rate)
