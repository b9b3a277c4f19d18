"""Actions of a Gymnasium space as the vectors of numbers that the core takes, and back."""

from __future__ import annotations

from typing import Any

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

__all__ = ["Actions"]


class Actions:
    """The numbers of an action space: a row of them for each action.

    Parameters
    ----------
    space : gymnasium.Space
        Box with finite bounds, Discrete, MultiDiscrete or MultiBinary.

    Raises
    ------
    TypeError
        For other spaces.

    Attributes
    ----------
    is_box : bool
    config : dict
        The fields of the core's ``ActionConfig``.
    """

    def __init__(self, space: gym.Space[Any]) -> None:
        self._space = space
        self.is_box = isinstance(space, gym.spaces.Box)
        if isinstance(space, gym.spaces.Box):
            low, high = space.low, space.high
        elif isinstance(space, gym.spaces.Discrete):
            low, high = _first_and_last(space.start, space.n)
        elif isinstance(space, gym.spaces.MultiDiscrete):
            low, high = _first_and_last(space.start, space.nvec)
        elif isinstance(space, gym.spaces.MultiBinary):
            low, high = _first_and_last(np.zeros(space.shape), 2)
        else:
            raise TypeError(
                "action_space must be a Box, Discrete, MultiDiscrete or MultiBinary,"
                f" got {type(space).__name__}"
            )
        self._type: Any = np.dtype(space.dtype).type
        self._shape = space.shape or ()
        number = {"f2": "float16", "f4": "float32"}.get(np.dtype(space.dtype).str[1:], "float64")
        self.config: dict[str, Any] = {
            "low": np.ravel(low).astype(np.float64).tolist(),
            "high": np.ravel(high).astype(np.float64).tolist(),
            "discrete": not self.is_box,
            "number": number if np.dtype(space.dtype).kind == "f" else "whole",
        }

    def element(self, numbers: NDArray[np.float64]) -> Any:
        """Make the element of the space that has these numbers."""
        if isinstance(self._space, gym.spaces.Discrete):
            return self._type(numbers[0])
        return numbers.astype(self._type).reshape(self._shape)

    def numbers(self, action: Any) -> NDArray[Any]:
        """Return the numbers of an element, in any shape; ValueError if they are none."""
        try:
            values = np.asarray(action)
        except ValueError:  # lists of several lengths
            values = np.empty(0, object)
        if values.dtype.kind not in "biuf":
            raise ValueError(f"action must be in {self._space}, got {action!r}")
        return values


def _first_and_last(start: Any, n: Any) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    first = np.asarray(start, np.float64)
    return first, first + n - 1
