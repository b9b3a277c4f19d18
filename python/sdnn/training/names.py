"""Arguments that agents and their functions do not have, and where the settings are instead."""

from __future__ import annotations

import inspect
from collections.abc import Mapping
from typing import Any

from sdnn.config import fields_of
from sdnn.support.arguments import explains_names

_OF_TRAIN = (
    "steps", "episodes", "callbacks", "progress", "evaluate_every", "evaluation_env",
    "evaluation_episodes",
)  # fmt: skip


def _elsewhere(agent: Any) -> Mapping[str, str]:
    """Return the settings of an agent or a class of agents, and how they are written."""
    spellings = {name: f"train(env, {name}=...)" for name in _OF_TRAIN}
    agent_class = agent if isinstance(agent, type) else type(agent)
    if not hasattr(agent_class, "learning_type"):
        return spellings
    for part in ("approximator", "learning"):
        config_type = getattr(agent_class, f"{part}_type")
        for field in fields_of(config_type):
            meaning = field.doc.partition(".")[0]
            inner = f"{part}={config_type.__name__}({field.name}=...)"
            spellings[field.name] = f"{agent_class.__name__}(env, {inner}) ({meaning})"
    for name in inspect.signature(agent_class).parameters:
        spellings.setdefault(name, f"{agent_class.__name__}(env, {name}=...)")
    return spellings


explained = explains_names(_elsewhere)
"""Decorator of agents' functions, which explains arguments that they do not have."""
