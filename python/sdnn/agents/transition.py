"""What an agent learns from."""

from __future__ import annotations

from contextlib import suppress
from numbers import Real
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sdnn.arguments import real

__all__ = ["Transition", "reward_of"]


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
    """Read a reward, which may be one of NumPy's numbers, an array of one, or a truth value.

    Raises
    ------
    TypeError, ValueError
        If it is something else.
    """
    if type(reward) is float:
        return reward
    if isinstance(reward, np.ndarray) and reward.size == 1 and reward.dtype.kind in "fiub":
        reward = reward.item()
    is_number = isinstance(reward, Real) and not isinstance(reward, bool)
    if not is_number and hasattr(reward, "__float__") and not isinstance(reward, np.ndarray | type):
        with suppress(OverflowError, TypeError, ValueError):
            return float(reward)  # a truth value, or a number of another library
    return real("reward", reward)
