"""Named settings of Q-learning with SDNN-C: the paper's, and those we recommend."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import NamedTuple

from sdnn import _core
from sdnn.config import QLearningConfig, SDNNCConfig

__all__ = ["PRESETS", "Preset"]


class Preset(NamedTuple):
    """Settings that belong together.

    Parameters
    ----------
    title
        What it is, in a few words.
    approximator
        Of the network.
    learning
        Of the agent.
    """

    title: str
    approximator: SDNNCConfig
    learning: QLearningConfig


PRESETS: Mapping[str, Preset] = MappingProxyType(
    {name: Preset(*settings) for name, settings in _core.presets().items()}
)
"""By name: ``"paper"``, ``"general"``, ``"robust"`` and ``"small"``."""
