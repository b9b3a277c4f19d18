"""The engine: runs, trials, studies, their store and reports.

A run is one agent that learns in one environment, in a folder of its own, and can be resumed.

A folder holds ``config.json`` (all that defines the run), ``results.sqlite`` (its episodes and
evaluations), ``checkpoint.safetensors`` (where it is resumed) and, once it is finished,
``agent.safetensors``. The commands ``sdnn train``, ``resume``, ``evaluate``, ``plot`` and
``record`` work on such folders.
"""

from typing import TYPE_CHECKING

from sdnn.lazy import attach

if TYPE_CHECKING:
    from sdnn.runs.dask_executor import DaskExecutor
    from sdnn.runs.engine import (
        Executor,
        Observer,
        PlannedTrial,
        ThreadExecutor,
        run_trials,
        trial_seed,
    )
    from sdnn.runs.environment import EnvironmentSpec
    from sdnn.runs.errors import (
        ClusterError,
        ConfigError,
        PlotUnavailableError,
        RunError,
        RunTerminatedError,
        StoreError,
        WorkerLostError,
    )
    from sdnn.runs.registry import AGENTS, AgentEntry, agent_entry, register
    from sdnn.runs.results import CaseResult, Estimate, MeasureConfig, measure
    from sdnn.runs.run import Goal, Run, RunEvaluation, RunOutcome
    from sdnn.runs.spec import AgentSpec, BudgetSpec, OutputSpec, ProtocolSpec, RunSpec
    from sdnn.runs.store import ResultStore
    from sdnn.runs.trial import Trial, TrialKey, TrialRecord, TrialRows

__getattr__, __dir__ = attach(globals())

__all__ = [
    "AGENTS",
    "AgentEntry",
    "AgentSpec",
    "BudgetSpec",
    "CaseResult",
    "ClusterError",
    "ConfigError",
    "DaskExecutor",
    "EnvironmentSpec",
    "Estimate",
    "Executor",
    "Goal",
    "MeasureConfig",
    "Observer",
    "OutputSpec",
    "PlannedTrial",
    "PlotUnavailableError",
    "ProtocolSpec",
    "ResultStore",
    "Run",
    "RunError",
    "RunEvaluation",
    "RunOutcome",
    "RunSpec",
    "RunTerminatedError",
    "StoreError",
    "ThreadExecutor",
    "Trial",
    "TrialKey",
    "TrialRecord",
    "TrialRows",
    "WorkerLostError",
    "agent_entry",
    "measure",
    "register",
    "run_trials",
    "trial_seed",
]
