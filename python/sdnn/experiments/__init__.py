"""Experiments: trials, their store, their statistics and figures.

Names are loaded when they are first used, so that the command line starts quickly.
"""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from sdnn.experiments.cases import EXPERIMENTS, Case, Experiment, select_experiments
    from sdnn.experiments.claims import CLAIMS, Claim
    from sdnn.experiments.config import (
        PlannedTrial,
        TrialConfig,
        TrialSettings,
        case_config,
        plan_trials,
        trial_seed,
    )
    from sdnn.experiments.cost import CostConfig
    from sdnn.experiments.dask_executor import DaskExecutor
    from sdnn.experiments.engine import Observer, run_trials
    from sdnn.experiments.environment_trial import EnvironmentConfig, EnvironmentTrialConfig
    from sdnn.experiments.errors import (
        ClusterError,
        ExperimentError,
        PlotUnavailableError,
        StoreError,
        StudyError,
        WorkerLostError,
    )
    from sdnn.experiments.executor import Executor
    from sdnn.experiments.figures import draw_cost, draw_experiment
    from sdnn.experiments.measures import MeasureConfig
    from sdnn.experiments.records import CostRecord, TrialKey, TrialRecord, TrialRows
    from sdnn.experiments.registry import AGENTS, AgentEntry, CostSeries, agent_entry, register
    from sdnn.experiments.reproduce import ReproduceRequest, Reproduction
    from sdnn.experiments.results import CaseResult, CaseSummary, collect, summarize
    from sdnn.experiments.statistics import Estimate
    from sdnn.experiments.store import ResultStore
    from sdnn.experiments.thread_executor import ThreadExecutor
    from sdnn.experiments.trial import LearningAgent, ProtocolConfig, PythonTrial, Trial
    from sdnn.experiments.verdicts import judge_claims

_HOMES = {
    "cases": (
        "EXPERIMENTS",
        "Case",
        "Experiment",
        "select_experiments",
    ),
    "claims": (
        "CLAIMS",
        "Claim",
    ),
    "config": (
        "PlannedTrial",
        "TrialConfig",
        "TrialSettings",
        "case_config",
        "plan_trials",
        "trial_seed",
    ),
    "cost": ("CostConfig",),
    "dask_executor": ("DaskExecutor",),
    "engine": (
        "Observer",
        "run_trials",
    ),
    "environment_trial": (
        "EnvironmentConfig",
        "EnvironmentTrialConfig",
    ),
    "errors": (
        "ClusterError",
        "ExperimentError",
        "PlotUnavailableError",
        "StoreError",
        "StudyError",
        "WorkerLostError",
    ),
    "executor": ("Executor",),
    "figures": (
        "draw_cost",
        "draw_experiment",
    ),
    "measures": ("MeasureConfig",),
    "records": (
        "CostRecord",
        "TrialKey",
        "TrialRecord",
        "TrialRows",
    ),
    "registry": (
        "AGENTS",
        "AgentEntry",
        "CostSeries",
        "agent_entry",
        "register",
    ),
    "reproduce": (
        "ReproduceRequest",
        "Reproduction",
    ),
    "results": (
        "CaseResult",
        "CaseSummary",
        "collect",
        "summarize",
    ),
    "statistics": ("Estimate",),
    "store": ("ResultStore",),
    "thread_executor": ("ThreadExecutor",),
    "trial": (
        "LearningAgent",
        "ProtocolConfig",
        "PythonTrial",
        "Trial",
    ),
    "verdicts": ("judge_claims",),
}
_HOME_OF = {name: module for module, names in _HOMES.items() for name in names}

__all__ = [
    "AGENTS",
    "CLAIMS",
    "EXPERIMENTS",
    "AgentEntry",
    "Case",
    "CaseResult",
    "CaseSummary",
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
    "ExperimentError",
    "LearningAgent",
    "MeasureConfig",
    "Observer",
    "PlannedTrial",
    "PlotUnavailableError",
    "ProtocolConfig",
    "PythonTrial",
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
    "plan_trials",
    "register",
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
