"""Resets and steps of environments, checked."""

from __future__ import annotations

import copy
import math
from collections.abc import Mapping
from typing import Any

import gymnasium as gym
import numpy as np

from sdnn.environments.types import Data
from sdnn.support.arguments import flag, has_methods, reward_of, shown

_SCALARS = (np.generic, int, float)

_OLD_API = (
    "; an environment of Gym before 0.26 can be wrapped:"
    " shimmy.GymV21CompatibilityV0(env=env), from pip install shimmy"
)


def require_single(name: str, env: Any) -> None:
    """Check that a value is one environment; TypeError that names the argument."""
    has_methods(name, env, "an environment, as of gymnasium.make(id)", "reset", "step")
    if isinstance(env, gym.vector.VectorEnv):
        raise TypeError(
            f"{name} must be a single environment, got a vector of them, {type(env).__name__}"
        )


class UnusableStepError(ValueError):
    """A step or reset of an environment cannot be used; the message names it and the reason."""


def has_action_masks(env: Any) -> bool:
    """Return whether an environment, or a vector, tells which actions are allowed."""
    return bool((getattr(env, "metadata", None) or {}).get("action_masks"))


def mask_in(info: Mapping[str, Any]) -> Any:
    """Return the mask in an info; UnusableStepError if there is none."""
    if "action_mask" not in info:
        raise UnusableStepError(
            "info must have 'action_mask', as metadata['action_masks'] of env is True,"
            f" got {shown(sorted(map(str, info)))}"
        )
    return info["action_mask"]


def reset_env(env: Any, seed: Any, options: Data | None) -> tuple[Any, Any]:
    """Reset an environment, or a vector; return what is observed first, and the info.

    UnusableStepError if it returns something else than an observation and a dictionary.
    """
    made = env.reset(seed=seed, options=options)
    if not (isinstance(made, tuple | list) and len(made) == 2 and isinstance(made[1], Mapping)):
        raise UnusableStepError(
            f"env.reset must return (observation, info), info a dictionary, got {shown(made)}"
            f"{_OLD_API}"
        )
    return made[0], made[1]


def step_env(env: Any, action: Any) -> tuple[Any, Any, Any, Any, Any]:
    """Step an environment, or a vector; UnusableStepError if it does not return five values."""
    made = env.step(action)
    if not (isinstance(made, (tuple, list)) and len(made) == 5):
        n = len(made) if isinstance(made, (tuple, list)) else 1
        raise UnusableStepError(
            "env.step must return five values, (observation, reward, terminated, truncated, info),"
            f" got {n}{_OLD_API}"
        )
    return made  # type: ignore[return-value]


def checked_outcome(reward: Any, terminated: Any, truncated: Any) -> tuple[float, bool, bool]:
    """Return a finite float and bools; UnusableStepError for something else."""
    try:
        if type(reward) is not float:
            reward = reward_of(reward)
        if not math.isfinite(reward):
            raise ValueError(f"reward must be finite, got {reward}")
        if not type(terminated) is bool is type(truncated):
            terminated, truncated = flag("terminated", terminated), flag("truncated", truncated)
    except (TypeError, ValueError) as error:
        raise UnusableStepError(str(error)) from error
    return reward, terminated, truncated


def copied(value: Any) -> Any:
    """Copy what others may write to: environments may keep their state, or change an action."""
    if type(value) is np.ndarray:
        return value.copy()
    return value if isinstance(value, _SCALARS) else copy.deepcopy(value)
