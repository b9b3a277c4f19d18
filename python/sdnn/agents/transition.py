"""What an agent learns from, and what a training needs of it."""

from __future__ import annotations

from contextlib import suppress
from typing import Any, NamedTuple, Protocol

import numpy as np
from numpy.typing import ArrayLike

from sdnn.arguments import real

__all__ = ["Learner", "Transition", "UnusableStepError", "reward_of"]


class UnusableStepError(ValueError):
    """An environment gave what cannot be learned or added up: the message says where."""


class Transition(NamedTuple):
    """One step of an environment.

    ``terminated`` is Gymnasium's: the episode ended in a terminal state. An episode cut off by a
    time limit (``truncated``) is not terminated; its last transition is learned like any other.
    """

    observation: ArrayLike
    action: Any
    reward: float
    next_observation: ArrayLike
    terminated: bool


class Learner(Protocol):
    """What is trained: every `sdnn.agents.Agent`.

    An agent that learns in one environment and is not saved needs only these methods, without the
    argument ``environment``. Where it has an attribute ``progress``, that is kept up to date.
    """

    def begin_episode(self) -> None:
        """Note that an episode begins."""

    def act(self, observation: Any, explore: bool = True) -> Any:
        """Choose an action; without `explore` nothing may be learned or remembered."""

    def learn(self, transition: Transition) -> None:
        """Learn a step."""


def reward_of(reward: Any) -> float:
    """Read a reward: a number, also of another library, an array of one, or a truth value.

    Raises
    ------
    ValueError
        If it is something else.
    """
    if isinstance(reward, float):  # NumPy's, too
        return float(reward)
    if isinstance(reward, np.ndarray) and reward.size == 1 and reward.dtype.kind in "fiub":
        reward = reward.item()
    is_real = not isinstance(reward, np.ndarray | np.complexfloating)
    if is_real and hasattr(reward, "__float__"):
        with suppress(OverflowError, TypeError, ValueError):
            return float(reward)
    try:
        return real("reward", reward)  # for its message
    except OverflowError as error:  # which would say of `Agent.learn` that a weight left its range
        raise ValueError(str(error)) from None
