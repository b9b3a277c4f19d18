"""An agent that begins to learn on a small processor."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import gymnasium as gym

from sdnn.agents import SDNNActorCritic, SDNNQLambda, SDNNQLearning
from sdnn.approximators import LinearSDNNConfig, SDNNCConfig
from sdnn.environments.types import Data, Space
from sdnn.export.header import writer_of
from sdnn.export.sdnn_c import MOST_WEIGHT
from sdnn.support.arguments import argument_error, choice, shown, whole

NewConfig = LinearSDNNConfig | SDNNCConfig
NewAgent = SDNNActorCritic | SDNNQLambda | SDNNQLearning
_KINDS: dict[str, type[SDNNActorCritic] | type[SDNNQLambda] | type[SDNNQLearning]] = {
    "q-lambda": SDNNQLambda,
    "actor-critic": SDNNActorCritic,
    "sdnn-c": SDNNQLearning,
}
_RAM_BYTES = {"q-lambda": 20_000, "actor-critic": 20_000, "sdnn-c": 60_000}


def new_agent(
    observation_space: Space,
    action_space: Space,
    *,
    kind: str = "q-lambda",
    ram_bytes: int | None = None,
    approximator: NewConfig | None = None,
    durations: bool = False,
    **options: Any,
) -> NewAgent:
    """Return an agent that has learned nothing, as large as the memory of a processor allows.

    All of its sensors are inputs from the beginning, so it needs no warm-up; `c_header` with
    ``learning=True`` makes a header of it.

    Parameters
    ----------
    observation_space, action_space
        See `Agent`. Every range must be finite, or given as ``observation_range``; for
        ``"actor-critic"`` that may be ``"running"``.
    kind : {"q-lambda", "actor-critic", "sdnn-c"}
    ram_bytes : int, optional
        Most bytes that the agent may take in C; by default 20,000, or 60,000 for ``"sdnn-c"``, and
        whatever a linear agent takes for a given number of ``n_pattern_units``.
    approximator : LinearSDNNConfig or SDNNCConfig, optional
        Linear agents, Q(lambda) and actor-critic, get as many ``n_pattern_units`` as fit, 32 to
        768, unless there is a number of them. SDNN-C gets the units given, by default those of its
        preset ``small``, or fewer if they do not fit.
    durations : bool, optional
        Whether its header will have them; see `c_header`.
    **options
        Other arguments of the agent's class: ``seed``, ``learning``, ``angles``, ...

    Raises
    ------
    ValueError
        If no agent for these spaces is so small; from the agent's class.
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
    agent_type = choice("kind", kind, _KINDS)
    most = _RAM_BYTES[kind] if ram_bytes is None else whole("ram_bytes", ram_bytes, 1, 2**31)
    settings = {**new_settings(kind), "inputs": "all", "angle_pairs": [], **options}
    is_running = agent_type.presets[agent_type.default_preset].observation_range == "running"
    if is_running and isinstance(observation_space, gym.spaces.Box):
        bounds = observation_space.low.reshape(-1), observation_space.high.reshape(-1)
        settings.setdefault("observation_range", bounds)  # these need less memory
    config = settings["approximator"] if approximator is None else approximator
    if not isinstance(config, agent_type.approximator_type):
        expected = agent_type.approximator_type.__name__
        raise TypeError(
            f"approximator must have the type {expected} for {kind}, got {shown(config)}"
        )

    def make_agent(size: NewConfig) -> NewAgent:
        return agent_type(observation_space, action_space, **{**settings, "approximator": size})

    def ram_bytes_of(size: NewConfig) -> int:
        writer = writer_of(make_agent(size), "agent", None, learns=True, durations=durations)
        return int(writer.header().ram_bytes)

    sizes = _sizes(config)
    if len(sizes) == 1 and ram_bytes is None:
        return make_agent(config)
    n_fitting = bisect_right(sizes, most, key=ram_bytes_of)
    if n_fitting == 0:
        raise argument_error(
            "ram_bytes",
            f"must be at least {ram_bytes_of(sizes[0])} for these spaces, got {most}: with fewer"
            " variables, actions, units or max_pairs an agent needs less",
        )
    return make_agent(sizes[n_fitting - 1])


def new_settings(kind: str) -> Data:
    """Return the settings that a new agent begins with, ``approximator`` and ``learning``."""
    agent_class, name = _KINDS[kind], "small" if kind == "sdnn-c" else "general"
    preset = agent_class.presets[name]
    config = preset.approximator
    if isinstance(config, SDNNCConfig):
        config = replace(config, averaging_interval=0, weight_limit=MOST_WEIGHT)
    return {"approximator": config, "learning": preset.learning}


def _sizes(config: NewConfig) -> Sequence[NewConfig]:
    """Return candidate settings in ascending order of their memory."""
    if isinstance(config, LinearSDNNConfig):
        if config.n_pattern_units > 0:
            return [config]
        return [replace(config, n_pattern_units=n) for n in range(32, 769, 16)]
    # Eighths of the patterns and twelfths of the units: patterns grow to their full length first,
    # since longer patterns improve learning more than further hidden units.
    fractions = [*((m, 1) for m in range(3, 8)), *((8, n) for n in range(1, 13))]
    return [
        replace(
            config,
            n_pattern_units=max(2, config.n_pattern_units * m // 8),
            n_hidden_units=max(1, config.n_hidden_units * n // 12),
            n_active_units=max(1, config.n_active_units * n // 12),
        )
        for m, n in fractions
    ]
