"""The paper: its experiments, claims, costs and figures.

Names are loaded when they are first used, so that the command line starts quickly.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from sdnn.lazy import attach

if TYPE_CHECKING:
    from sdnn.reproduction.cases import EXPERIMENTS, Case, Experiment, select_experiments
    from sdnn.reproduction.claims import CLAIMS, Claim, judge_claims
    from sdnn.reproduction.cost import CostConfig, CostRecord
    from sdnn.reproduction.figures import draw_cost, draw_experiment
    from sdnn.reproduction.reproduce import ReproduceRequest, case_spec, collect, plan_trials

__getattr__, __dir__ = attach(globals())

__all__ = [
    "CLAIMS",
    "EXPERIMENTS",
    "Case",
    "Claim",
    "CostConfig",
    "CostRecord",
    "Experiment",
    "ReproduceRequest",
    "case_spec",
    "collect",
    "draw_cost",
    "draw_experiment",
    "judge_claims",
    "plan_trials",
    "select_experiments",
]
