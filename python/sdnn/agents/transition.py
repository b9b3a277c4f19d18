"""What an agent learns from."""

from __future__ import annotations

from typing import Any, NamedTuple

from numpy.typing import ArrayLike

__all__ = ["Transition"]


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
