"""The paper: its experiments, their statistics, claims and figures.

Names are loaded when they are first used, so that the command line starts quickly.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sdnn.reproduction.cases import EXPERIMENTS, Case, Experiment, select_experiments
    from sdnn.reproduction.claims import CLAIMS, Claim
    from sdnn.reproduction.cost import CostConfig
    from sdnn.reproduction.figures import draw_cost, draw_experiment
    from sdnn.reproduction.plan import case_config, plan_trials
    from sdnn.reproduction.reproduce import ReproduceRequest, Reproduction, collect
    from sdnn.reproduction.verdicts import judge_claims
    from sdnn.runs.dask_executor import DaskExecutor
    from sdnn.runs.engine import Observer, run_trials
    from sdnn.runs.environment_trial import EnvironmentConfig, EnvironmentTrialConfig
    from sdnn.runs.errors import (
        ClusterError,
        PlotUnavailableError,
        StoreError,
        StudyError,
        WorkerLostError,
    )
    from sdnn.runs.executor import Executor
    from sdnn.runs.measures import MeasureConfig
    from sdnn.runs.records import CostRecord, TrialKey, TrialRecord, TrialRows
    from sdnn.runs.registry import AGENTS, AgentEntry, CostSeries, agent_entry, register
    from sdnn.runs.results import CaseResult, measure
    from sdnn.runs.statistics import Estimate
    from sdnn.runs.store import ResultStore
    from sdnn.runs.thread_executor import ThreadExecutor
    from sdnn.runs.trial import ProtocolConfig, Trial
    from sdnn.runs.trial_config import PlannedTrial, TrialConfig, TrialSettings, trial_seed

_HOMES = {
    "reproduction.cases": "Case EXPERIMENTS Experiment select_experiments",
    "reproduction.claims": "CLAIMS Claim",
    "reproduction.cost": "CostConfig",
    "reproduction.figures": "draw_cost draw_experiment",
    "reproduction.plan": "case_config plan_trials",
    "reproduction.reproduce": "ReproduceRequest Reproduction collect",
    "reproduction.verdicts": "judge_claims",
    "runs.dask_executor": "DaskExecutor",
    "runs.engine": "Observer run_trials",
    "runs.environment_trial": "EnvironmentConfig EnvironmentTrialConfig",
    "runs.executor": "Executor",
    "runs.measures": "MeasureConfig",
    "runs.records": "CostRecord TrialKey TrialRecord TrialRows",
    "runs.registry": "AGENTS AgentEntry CostSeries agent_entry register",
    "runs.results": "CaseResult measure",
    "runs.statistics": "Estimate",
    "runs.store": "ResultStore",
    "runs.thread_executor": "ThreadExecutor",
    "runs.trial": "ProtocolConfig Trial",
    "runs.trial_config": "PlannedTrial TrialConfig TrialSettings trial_seed",
    "runs.errors": "ClusterError PlotUnavailableError StoreError StudyError WorkerLostError",
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names.split()}

__all__ = [
    "AGENTS",
    "CLAIMS",
    "EXPERIMENTS",
    "AgentEntry",
    "Case",
    "CaseResult",
    "Claim",
    "ClusterError",
    "CostConfig",
    "CostRecord",
    "CostSeries",
    "DaskExecutor",
    "EnvironmentConfig",
    "EnvironmentTrialConfig",
    "Estimate",
    "Executor",
    "Experiment",
    "MeasureConfig",
    "Observer",
    "PlannedTrial",
    "PlotUnavailableError",
    "ProtocolConfig",
    "ReproduceRequest",
    "Reproduction",
    "ResultStore",
    "StoreError",
    "StudyError",
    "ThreadExecutor",
    "Trial",
    "TrialConfig",
    "TrialKey",
    "TrialRecord",
    "TrialRows",
    "TrialSettings",
    "WorkerLostError",
    "agent_entry",
    "case_config",
    "collect",
    "draw_cost",
    "draw_experiment",
    "judge_claims",
    "measure",
    "plan_trials",
    "register",
    "run_trials",
    "select_experiments",
    "trial_seed",
]


def __getattr__(name: str) -> Any:
    if name not in _HOME_OF:
        raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
    return getattr(import_module(f"sdnn.{_HOME_OF[name]}"), name)


def __dir__() -> list[str]:
    return __all__
