"""The parameters of Q-learning."""

from __future__ import annotations

import dataclasses
from typing import Literal

from sdnn import _core
from sdnn.config import added_later, to_core

__all__ = ["QLearningConfig"]


@dataclasses.dataclass(frozen=True, kw_only=True)
class QLearningConfig:
    """The parameters of Q-learning; the defaults are the paper's (section 4.2).

    Attributes
    ----------
    learning_rate : float
        alpha, in (0, 1].
    discount : float
        gamma, in [0, 1].
    epsilon : float
        Probability of a random action, in [0, 1].
    n_greedy_steps : int
        First steps of an episode in which epsilon is 0.
    tie_rule : {"uniform", "lowest", "middle"}
        Which of several best actions is taken: any with the same probability, the one with the
        lowest index, or the middle of the widest run of neighbours. A reading.
    tie_tolerance : float
        Values at most this far below the best tie with it, >= 0. Not in the paper: with
        ``"middle"`` the agent acts from the middle of the widest high plateau.
    n_steps : int
        Rewards in a target before it bootstraps, 1 to 1000. Not in the paper, which has 1: with
        more, a transition is learned, once, when so many steps are known or the episode ends.
    """

    learning_rate: float = 0.5
    discount: float = 0.9
    epsilon: float = 0.1
    n_greedy_steps: int = 10
    tie_rule: Literal["uniform", "lowest", "middle"] = "uniform"
    tie_tolerance: float = added_later(0.0)
    n_steps: int = added_later(1)

    def to_core(self) -> _core.QLearningConfig:
        """Make the core's struct of the same values; see `sdnn.config.to_core`."""
        return to_core(self, _core.QLearningConfig)
