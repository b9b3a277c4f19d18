"""The paper: its experiments, their statistics, claims and figures.

Names are loaded when they are first used, so that the command line starts quickly.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from sdnn.lazy import attach

if TYPE_CHECKING:
    from sdnn.config import ProtocolConfig
    from sdnn.reproduction.cases import EXPERIMENTS, Case, Experiment, select_experiments
    from sdnn.reproduction.claims import CLAIMS, Claim
    from sdnn.reproduction.cost import CostConfig, CostRecord
    from sdnn.reproduction.figures import draw_cost, draw_experiment
    from sdnn.reproduction.reproduce import ReproduceRequest, case_spec, collect, plan_trials
    from sdnn.reproduction.verdicts import judge_claims
    from sdnn.runs.dask_executor import DaskExecutor
    from sdnn.runs.engine import Observer, run_trials
    from sdnn.runs.errors import (
        ClusterError,
        PlotUnavailableError,
        StoreError,
        WorkerLostError,
    )
    from sdnn.runs.executor import Executor, ThreadExecutor
    from sdnn.runs.measures import MeasureConfig
    from sdnn.runs.planned_trial import PlannedTrial, trial_seed
    from sdnn.runs.records import TrialKey, TrialRecord, TrialRows
    from sdnn.runs.registry import AGENTS, AgentEntry, CostSeries, agent_entry, register
    from sdnn.runs.results import CaseResult, measure
    from sdnn.runs.statistics import Estimate
    from sdnn.runs.store import ResultStore
    from sdnn.runs.trial import Trial

__getattr__, __dir__ = attach(globals())

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
    "Estimate",
    "Executor",
    "Experiment",
    "MeasureConfig",
    "Observer",
    "PlannedTrial",
    "PlotUnavailableError",
    "ProtocolConfig",
    "ReproduceRequest",
    "ResultStore",
    "StoreError",
    "ThreadExecutor",
    "Trial",
    "TrialKey",
    "TrialRecord",
    "TrialRows",
    "WorkerLostError",
    "agent_entry",
    "case_spec",
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
