"""An agent that begins to learn on a small processor."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import replace
from typing import Any

import gymnasium as gym

from sdnn.agents import LINEAR_PRESETS, SDNNSarsa
from sdnn.approximators import LinearSDNNConfig
from sdnn.arguments import argument_error, shown, whole
from sdnn.export.linear import LearnerWriter

_UNITS = range(32, 769, 16)


def new_agent(
    observation_space: gym.Space[Any],
    action_space: gym.Space[Any],
    *,
    ram_bytes: int = 20_000,
    approximator: LinearSDNNConfig | None = None,
    **options: Any,
) -> SDNNSarsa:
    """Return an agent that has learned nothing, as large as the memory of a processor allows.

    All of its sensors are inputs from the beginning, so it needs no warm-up; `c_header` with
    ``learning=True`` makes a header of it.

    Parameters
    ----------
    observation_space, action_space
        See `Agent`. Every range must be finite, or given as ``observation_range``.
    ram_bytes : int
        Most bytes that the agent may take in C: it gets as many ``n_pattern_units`` as fit, 32 to
        768, unless ``approximator`` has a number of them.
    approximator : LinearSDNNConfig, optional
    **options
        Other arguments of `SDNNSarsa`: ``seed``, ``learning``, ``angles``, ...

    Raises
    ------
    ValueError
        If no agent for these spaces is so small; from `SDNNSarsa`.
    RuntimeError
        If a range is not known.

    Examples
    --------
    >>> import gymnasium as gym
    >>> from sdnn.export import c_header, new_agent
    >>> agent = new_agent(gym.spaces.Box(-2.0, 2.0, (2,)), gym.spaces.Discrete(3), seed=1)
    >>> c_header(agent, "cart", learning=True).ram_bytes <= 20_000
    True
    """
    most = whole("ram_bytes", ram_bytes, 1, 2**31)
    config = LINEAR_PRESETS["general"].approximator if approximator is None else approximator
    if not isinstance(config, LinearSDNNConfig):
        raise TypeError(f"approximator must be a LinearSDNNConfig, got {shown(config)}")
    options = {"inputs": "all", "angle_pairs": [], **options}

    def agent(n_units: int) -> SDNNSarsa:
        own = replace(config, n_pattern_units=n_units)
        return SDNNSarsa(observation_space, action_space, approximator=own, **options)

    def needed(n_units: int) -> int:
        writer = LearnerWriter(agent(n_units), "agent", None)
        return writer.ram_bytes(writer.sizes())

    if config.n_pattern_units > 0:
        return agent(config.n_pattern_units)
    n_fitting = bisect_right(_UNITS, most, key=needed)
    if n_fitting == 0:
        raise argument_error(
            "ram_bytes",
            f"must be at least {needed(_UNITS[0])} for these spaces, got {most}: with fewer"
            " variables, actions or max_pairs an agent needs less",
        )
    return agent(_UNITS[n_fitting - 1])
