"""The results of training a run and of evaluating its agent."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from sdnn.agents import Evaluation, Scaling
from sdnn.runs.trial import Reason
from sdnn.training.loop import Row


@dataclass(frozen=True, kw_only=True)
class RunOutcome:
    """The result of training a run.

    ``learning_report``: see `sdnn.agents.SDNNQLearning`, None for fuzzy agents and while one is
    warming up; ``is_solved``: whether the last evaluation reached the environment's reward
    threshold; ``has_pictures``: whether `record` can render the environment.
    """

    n_steps: int
    n_episodes: int
    reason: Reason
    last_evaluation: Row | None
    learning_report: Mapping[str, Any] | None
    is_warming_up: bool
    is_solved: bool
    has_pictures: bool
    scaling: Scaling | None


@dataclass(frozen=True, kw_only=True)
class RunEvaluation(Evaluation):
    """The result of greedy episodes; ``is_warming_up``: all actions of the agent are random."""

    is_warming_up: bool
