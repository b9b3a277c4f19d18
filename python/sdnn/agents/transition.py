"""What an agent learns from."""

from __future__ import annotations

from contextlib import suppress
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sdnn.arguments import real

__all__ = ["Transition", "UnusableStepError", "reward_of"]


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


def reward_of(reward: Any) -> float:
    """Read a reward: a number, also of another library, an array of one, or a truth value.

    Raises
    ------
    ValueError
        If it is something else.
    """
    if type(reward) is float:
        return reward
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
