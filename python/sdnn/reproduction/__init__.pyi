from sdnn.reproduction.cases import (
    EXPERIMENTS as EXPERIMENTS,
    Case as Case,
    Experiment as Experiment,
    select_experiments as select_experiments,
)
from sdnn.reproduction.claims import CLAIMS as CLAIMS, Claim as Claim, judge_claims as judge_claims
from sdnn.reproduction.cost import CostConfig as CostConfig, CostRecord as CostRecord
from sdnn.reproduction.figures import draw_cost as draw_cost, draw_experiment as draw_experiment
from sdnn.reproduction.reproduce import (
    PaperStudy as PaperStudy,
    case_spec as case_spec,
    paper_spec as paper_spec,
    plan_trials as plan_trials,
)
