"""Names for the types of Gymnasium's spaces and environments, whatever their elements are."""

from __future__ import annotations

from typing import Any, TypeAlias

import gymnasium as gym
from numpy.typing import NDArray

Space: TypeAlias = gym.Space[Any]
Env: TypeAlias = gym.Env[Any, Any]
VectorEnv: TypeAlias = gym.vector.VectorEnv[Any, Any, Any]
Array: TypeAlias = NDArray[Any]
"""An array of any type of numbers."""
Data: TypeAlias = dict[str, Any]
"""Values by name, as JSON has them."""
