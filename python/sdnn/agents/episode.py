"""The present episode of a training, in one environment."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdnn.agents.rounds import Outcome

__all__ = ["Actions", "Episode"]


class Actions:
    """The actions of an episode in one array, which grows: an episode may have millions of them.

    Parameters
    ----------
    taken
        Those that it has already, shape (n, ...).
    """

    def __init__(self, taken: NDArray[Any] | None = None) -> None:
        self._n = 0 if taken is None else len(taken)
        self._array = taken if self._n else None

    def __len__(self) -> int:
        return self._n

    @property
    def taken(self) -> NDArray[Any]:
        """All of them, shape (n, ...)."""
        return np.empty(0) if self._array is None else self._array[: self._n]

    def append(self, action: Any) -> None:
        """Add one, of the shape and type of the others."""
        if self._array is None:
            one = np.asarray(action)
            self._array = np.empty((16, *one.shape), one.dtype)
        elif self._n == len(self._array):
            self._array = np.concatenate([self._array, np.empty_like(self._array)])
        self._array[self._n] = action
        self._n += 1


@dataclass
class Episode:
    """How far it is.

    Parameters
    ----------
    number
        Of all that have begun.
    observation
        What was observed before ``outcome``, if that is still to be learned; else the last one.
    actions
        Taken in it.
    sum_of_rewards
        Learned in it.
    outcome
        What the last action led to, if it is still to be learned.
    """

    number: int
    observation: Any
    actions: Actions = field(default_factory=Actions)
    sum_of_rewards: float = 0.0
    outcome: Outcome | None = None

    @property
    def last_observation(self) -> Any:
        """What was observed last, learned or not."""
        return self.observation if self.outcome is None else self.outcome.observation
