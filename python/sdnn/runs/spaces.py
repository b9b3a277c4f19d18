"""Whether an environment still observes and does what an agent learned with."""

from __future__ import annotations

from typing import Any

import gymnasium as gym

from sdnn.agents import Agent
from sdnn.runs.errors import RunError

__all__ = ["check_spaces"]


def check_spaces(agent: Agent[Any, Any], env: gym.Env[Any, Any], name: str) -> None:
    """Check that an environment has the spaces of an agent, whatever their bounds.

    Parameters
    ----------
    agent
        Of the run.
    env
        As it is made now.
    name
        What the error calls it.

    Raises
    ------
    RunError
        If observations or actions are of another kind or number.
    """
    for word, own, given in (
        ("observations", agent.observation_space, env.observation_space),
        ("actions", agent.action_space, env.action_space),
    ):
        if not _is_like(own, given):
            raise RunError(
                f"{name} must have the {word} that the agent learned with, {_line(own)},"
                f" got {_line(given)}"
            )


def _is_like(own: gym.Space[Any], given: gym.Space[Any]) -> bool:
    """Whether the second has all that the first is made of, but for bounds and types of numbers."""
    if isinstance(own, gym.spaces.Dict) and isinstance(given, gym.spaces.Dict):
        return own.keys() == given.keys() and all(_is_like(own[key], given[key]) for key in own)
    if isinstance(own, gym.spaces.Tuple) and isinstance(given, gym.spaces.Tuple):
        return len(own) == len(given) and all(map(_is_like, own, given))
    if own.shape != given.shape:
        return False
    if isinstance(own, gym.spaces.Discrete) and isinstance(given, gym.spaces.Discrete):
        return bool(own.n == given.n and own.start == given.start)
    if isinstance(own, gym.spaces.MultiDiscrete) and isinstance(given, gym.spaces.MultiDiscrete):
        return bool((own.nvec == given.nvec).all() and (own.start == given.start).all())
    return any(
        isinstance(own, kind) and isinstance(given, kind)
        for kind in (gym.spaces.Box, gym.spaces.MultiBinary)
    )


def _line(space: gym.Space[Any]) -> str:
    return " ".join(str(space).split())
