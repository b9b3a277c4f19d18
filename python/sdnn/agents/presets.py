"""Named settings of agents, from the core."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any, Literal, NamedTuple

from sdnn import _core
from sdnn.environments.spaces import AnglePairs, History, Inputs

_NO_CHOICE = _core.ObservationConfig()


class Preset(NamedTuple):
    """Settings that belong together, with a title of a few words."""

    title: str
    approximator: Any
    learning: Any
    angle_pairs: AnglePairs = "none"
    inputs: Inputs = "all"
    history: History = "none"
    observation_range: Literal["running"] | None = None
    narrows_ranges: bool = False
    """Whether a warm-up replaces bounds of the space that are far wider than its observations."""


def presets_of(listed: Mapping[str, tuple[Any, ...]]) -> Mapping[str, Preset]:
    """Return the presets of the core by name."""
    return MappingProxyType({name: _preset(*settings) for name, settings in listed.items()})


def _preset(
    title: str,
    approximator: Any,
    learning: Any,
    observation: _core.ObservationConfig = _NO_CHOICE,
) -> Preset:
    return Preset(
        title,
        approximator,
        learning,
        angle_pairs="find" if observation.find_angle_pairs else "none",
        inputs="relevant" if observation.relevant_only else "all",
        history=observation.history,
        observation_range="running" if observation.running else None,
        narrows_ranges=observation.narrowed,
    )
