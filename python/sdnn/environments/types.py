"""Names for the types of Gymnasium's spaces and environments, whatever their elements are."""

from __future__ import annotations

from collections.abc import Mapping, MutableSequence, Sequence
from typing import Any, TypeAlias

import gymnasium as gym
from numpy.typing import ArrayLike, NDArray

Space: TypeAlias = gym.Space[Any]
Env: TypeAlias = gym.Env[Any, Any]
VectorEnv: TypeAlias = gym.vector.VectorEnv[Any, Any, Any]
AnyEnv: TypeAlias = Env | VectorEnv
Array: TypeAlias = NDArray[Any]
"""An array of any type of numbers."""
Element: TypeAlias = Any
"""An element of a space: an observation or an action."""
Elements: TypeAlias = MutableSequence[Element] | Array
"""Elements of a space, of each environment."""
Mask: TypeAlias = ArrayLike | None
"""1 for each action that is allowed, 0 for others; None: all are."""
Masks: TypeAlias = Sequence[Mask] | Array
"""Masks of each environment."""
Info: TypeAlias = Mapping[str, Any]
"""The information of a step or reset."""
Data: TypeAlias = dict[str, Any]
"""Values by name, as JSON has them."""
