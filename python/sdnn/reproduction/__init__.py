"""The paper: its experiments, claims, costs and figures.

Names are loaded when they are first used, so that the command line starts quickly.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from sdnn.support.lazy import attach

if TYPE_CHECKING:
    from sdnn.reproduction.cases import (
        EXPERIMENTS as EXPERIMENTS,
        Case as Case,
        Experiment as Experiment,
        select_experiments as select_experiments,
    )
    from sdnn.reproduction.claims import (
        CLAIMS as CLAIMS,
        Claim as Claim,
        judge_claims as judge_claims,
    )
    from sdnn.reproduction.cost import CostConfig as CostConfig, CostRecord as CostRecord
    from sdnn.reproduction.figures import draw_cost as draw_cost, draw_experiment as draw_experiment
    from sdnn.reproduction.reproduce import (
        PaperStudy as PaperStudy,
        case_spec as case_spec,
        paper_spec as paper_spec,
        plan_trials as plan_trials,
    )

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "sdnn.reproduction.cases": "EXPERIMENTS Case Experiment select_experiments",
        "sdnn.reproduction.claims": "CLAIMS Claim judge_claims",
        "sdnn.reproduction.cost": "CostConfig CostRecord",
        "sdnn.reproduction.figures": "draw_cost draw_experiment",
        "sdnn.reproduction.reproduce": "PaperStudy case_spec paper_spec plan_trials",
    },
)
