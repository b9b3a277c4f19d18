"""Named settings of Q-learning with SDNN-C: the paper's, and those we recommend."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
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


# A full step each time, then ever smaller ones, which rounding stills one by one; targets of five
# steps; exploration that goes somewhere; an average that does not swing; values in steps half as
# large as the paper's: docs/benchmarks.md. All pairs of up to eight inputs, so that the weights of
# many fit in memory.
_GENERAL = Preset(
    title="as recommended for any task",
    approximator=SDNNCConfig(
        max_pairs=56,
        n_hidden_units=1800,
        n_active_units=600,
        n_actions=5,
        averaging_interval=100,
    ),
    learning=QLearningConfig(
        learning_rate=1.0,
        final_learning_rate=0.1,
        discount=0.99,
        epsilon=0.03,
        final_epsilon=0.01,
        n_greedy_steps=0,
        n_steps=5,
        max_repetitions=100,
        value_range="seen",
    ),
)

PRESETS: Mapping[str, Preset] = MappingProxyType(
    {
        "paper": Preset(title="as in the paper"),
        "general": _GENERAL,
        # Few actions part the best one from its neighbours by more than sensor noise blurs, and a
        # success that reaches the whole path at once is not forgotten: docs/collapse.md.
        "robust": Preset(
            title="as recommended for the paper's task: steady with noisy sensors",
            approximator=SDNNCConfig(n_actions=61),
            learning=QLearningConfig(n_steps=5),
        ),
        # A tenth of the weights, in steps twice as large: docs/small-processors.md.
        "small": Preset(
            title="as recommended for small processors: the general one, fewer units",
            approximator=replace(
                _GENERAL.approximator, n_hidden_units=900, n_active_units=300, n_pattern_units=40
            ),
            learning=_GENERAL.learning,
        ),
    }
)
"""By name: ``"paper"``, ``"general"``, ``"robust"`` and ``"small"``."""
