"""The parameters of Q-learning."""

from __future__ import annotations

import dataclasses
from typing import Literal

from sdnn import _core
from sdnn.config import to_core

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
    max_repetitions : int
        Steps that a random action may last, 1 to 10**6. Not in the paper, which has 1: with more,
        it is kept for at least k steps with probability 1 / k.
    final_learning_rate, final_epsilon : float, optional
        What alpha and epsilon become as the agent's progress goes from 0 to 1; None: they stay. Not
        in the paper.
    schedule : {"linear", "exponential"}
        How they go there: in a straight line, or by the same factor in equal parts of the progress,
        ``first * (final / first) ** progress``. A rate that stays is the common choice where the
        task itself changes; a line is what most libraries of deep Q-learning take for epsilon; an
        exponential spends more of the training near a small final value, and has none that is 0.
        Any other function of the progress: `sdnn.agents.Schedule`.
    exploration_fraction : float
        Part of the progress in which epsilon goes to ``final_epsilon``, where it then stays, in
        (0, 1]. Not in the paper.
    n_random_steps : int
        First steps of the agent's life in which every action is random, whatever epsilon, 0 to
        2**30. Not in the paper, which has 0: a rare success is found before the greedy actions have
        learned to do nothing.
    value_range : {"given", "seen"}
        Whether Q has the approximator's range, ``q_low`` to ``q_high``, or one that grows with the
        discounted sums of the rewards that come. Not in the paper.
    """

    learning_rate: float = 0.5
    discount: float = 0.9
    epsilon: float = 0.1
    n_greedy_steps: int = 10
    tie_rule: Literal["uniform", "lowest", "middle"] = "uniform"
    tie_tolerance: float = 0.0
    n_steps: int = 1
    max_repetitions: int = 1
    final_learning_rate: float | None = None
    final_epsilon: float | None = None
    value_range: Literal["given", "seen"] = "given"
    schedule: Literal["linear", "exponential"] = "linear"
    exploration_fraction: float = 1.0
    n_random_steps: int = 0

    def to_core(self) -> _core.QLearningConfig:
        """Make the core's struct of the same values; see `sdnn.config.to_core`."""
        return to_core(self, _core.QLearningConfig)
