"""Named settings of Q-learning with SDNN-C: the paper's, and those we recommend."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from sdnn.agents.q_learning_config import QLearningConfig
from sdnn.approximators.sdnn_c import SDNNCConfig

__all__ = ["PRESETS", "Preset"]


@dataclass(frozen=True, kw_only=True)
class Preset:
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
    approximator: SDNNCConfig = field(default_factory=SDNNCConfig)
    learning: QLearningConfig = field(default_factory=QLearningConfig)


PRESETS: Mapping[str, Preset] = MappingProxyType(
    {
        "paper": Preset(title="as in the paper"),
        # Few actions part the best one from its neighbours by more than sensor noise blurs, and a
        # success that reaches the whole path at once is not forgotten: docs/readings.md.
        "robust": Preset(
            title="as recommended: steady with noisy sensors",
            approximator=SDNNCConfig(n_actions=61),
            learning=QLearningConfig(n_steps=5),
        ),
    }
)
"""By name: ``"paper"`` and ``"robust"``."""
