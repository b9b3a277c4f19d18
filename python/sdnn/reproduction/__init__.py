"""The paper: its experiments, claims, costs and figures.

Names are loaded when they are first used, so that the command line starts quickly.
"""

from sdnn.support.lazy import attach

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
