"""Experiments: trials, their store, their statistics and figures.

Names are loaded when they are first used, so that the command line starts quickly.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sdnn.experiments.cases import EXPERIMENTS, Case, Experiment, select_experiments
    from sdnn.experiments.claims import CLAIMS, Claim
    from sdnn.experiments.config import ProtocolConfig, TrialConfig, case_config, trial_seed
    from sdnn.experiments.cost import CostConfig, CostRecord
    from sdnn.experiments.cost_figure import draw_cost
    from sdnn.experiments.engine import Observer, run_trials
    from sdnn.experiments.errors import ExperimentError, PlotUnavailableError, StoreError
    from sdnn.experiments.figures import draw_experiment
    from sdnn.experiments.measures import MeasureConfig
    from sdnn.experiments.plan import PlannedTrial, plan_trials
    from sdnn.experiments.records import TrialKey, TrialRecord, TrialRows
    from sdnn.experiments.results import CaseResult, CaseSummary, collect, summarize
    from sdnn.experiments.statistics import Estimate
    from sdnn.experiments.store import ResultStore
    from sdnn.experiments.trial import Trial, make_core_trial
    from sdnn.experiments.verdicts import judge_claims

_HOMES = {
    "cases": ("EXPERIMENTS", "Case", "Experiment", "select_experiments"),
    "claims": ("CLAIMS", "Claim"),
    "config": ("ProtocolConfig", "TrialConfig", "case_config", "trial_seed"),
    "cost": ("CostConfig", "CostRecord"),
    "engine": ("Observer", "run_trials"),
    "errors": ("ExperimentError", "PlotUnavailableError", "StoreError"),
    "cost_figure": ("draw_cost",),
    "figures": ("draw_experiment",),
    "measures": ("MeasureConfig",),
    "plan": ("PlannedTrial", "plan_trials"),
    "records": ("TrialKey", "TrialRecord", "TrialRows"),
    "results": ("CaseResult", "CaseSummary", "collect", "summarize"),
    "statistics": ("Estimate",),
    "store": ("ResultStore",),
    "trial": ("Trial", "make_core_trial"),
    "verdicts": ("judge_claims",),
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [
    "CLAIMS",
    "EXPERIMENTS",
    "Case",
    "CaseResult",
    "CaseSummary",
    "Claim",
    "CostConfig",
    "CostRecord",
    "Estimate",
    "Experiment",
    "ExperimentError",
    "MeasureConfig",
    "Observer",
    "PlannedTrial",
    "PlotUnavailableError",
    "ProtocolConfig",
    "ResultStore",
    "StoreError",
    "Trial",
    "TrialConfig",
    "TrialKey",
    "TrialRecord",
    "TrialRows",
    "case_config",
    "collect",
    "draw_cost",
    "draw_experiment",
    "judge_claims",
    "make_core_trial",
    "plan_trials",
    "run_trials",
    "select_experiments",
    "summarize",
    "trial_seed",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"{__name__}.{_HOME_OF[name]}"), name)


def __dir__() -> list[str]:
    return __all__
