"""Named settings of agents."""

from __future__ import annotations

from typing import Any, Literal, NamedTuple

from sdnn.environments.spaces import AnglePairs, History, Inputs


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
