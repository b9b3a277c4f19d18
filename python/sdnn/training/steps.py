"""Resets and steps of environments, single and vectorized: calls, and checks of the results."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from typing import Any

from sdnn.environments.types import AnyEnv, Element, Info, Mask
from sdnn.support.arguments import flag, real, reward_of, shown
from sdnn.training.interfaces import Options, UnusableStepError

_OLD_API = (
    "; an environment of Gym before 0.26 can be wrapped:"
    " shimmy.GymV21CompatibilityV0(env=env), from pip install shimmy"
)


def has_action_masks(env: object) -> bool:
    """Return whether an environment, or a vector, tells which actions are allowed."""
    return bool((getattr(env, "metadata", None) or {}).get("action_masks"))


def has_durations(env: object) -> bool:
    """Return whether an environment, or a vector, tells how long its steps took."""
    return bool((getattr(env, "metadata", None) or {}).get("durations"))


def duration_in(info: Info) -> float:
    """Return the duration of a step in an info; UnusableStepError if there is none."""
    if "dt" not in info:
        raise UnusableStepError(
            "info must have 'dt', the duration of the step in usual steps, as"
            f" metadata['durations'] of env is True, got {shown(sorted(map(str, info)))}"
        )
    try:
        return real("dt", info["dt"])
    except (ValueError, OverflowError) as error:
        raise UnusableStepError(str(error)) from error


def mask_in(info: Info) -> Mask:
    """Return the mask in an info; UnusableStepError if there is none."""
    if "action_mask" not in info:
        raise UnusableStepError(
            "info must have 'action_mask', as metadata['action_masks'] of env is True,"
            f" got {shown(sorted(map(str, info)))}"
        )
    mask: Mask = info["action_mask"]
    return mask


def reset_env(env: AnyEnv, seed: Any, options: Options) -> tuple[Element, Info]:
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


def step_env(env: AnyEnv, action: Element) -> Sequence[Any]:
    """Step an environment, or a vector; UnusableStepError if it does not return five values."""
    made = env.step(action)
    if not (isinstance(made, (tuple, list)) and len(made) == 5):
        n = len(made) if isinstance(made, (tuple, list)) else 1
        raise UnusableStepError(
            "env.step must return five values, (observation, reward, terminated, truncated, info),"
            f" got {n}{_OLD_API}"
        )
    return made


def checked_outcome(reward: Any, terminated: object, truncated: object) -> tuple[float, bool, bool]:
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
