"""The engine: runs, trials, studies, their store and reports.

A run is one agent that learns in one environment, in a folder of its own, and can be resumed.

A folder holds ``config.json`` (all that defines the run), ``results.sqlite`` (its episodes and
evaluations), ``checkpoint.safetensors`` (where it is resumed) and, once it is finished,
``agent.safetensors``. The commands ``sdnn train``, ``resume``, ``evaluate``, ``plot``, ``record``,
``inspect`` and ``verify`` work on such folders.
"""

from sdnn.support.lazy import attach

__getattr__, __dir__, __all__ = attach(
    __name__,
    {
        "sdnn.agents.registry": "AGENTS AgentEntry agent_entry register",
        "sdnn.reports.statistics": "Estimate",
        "sdnn.runs.dask_executor": "DaskExecutor",
        "sdnn.runs.engine": "Executor Observer PlannedTrial ThreadExecutor run_trials",
        "sdnn.runs.environment": "EnvironmentSpec",
        "sdnn.runs.errors": (
            "ClusterError ConfigError PlotUnavailableError RunError RunTerminatedError "
            "StoreError WorkerLostError"
        ),
        "sdnn.runs.results": "CaseResult measure",
        "sdnn.runs.run": "Goal Run",
        "sdnn.runs.settings": "AgentSpec BudgetSpec OutputSpec ProtocolSpec",
        "sdnn.runs.spec": "RunSpec",
        "sdnn.runs.store": "ResultStore",
        "sdnn.runs.trial": (
            "RunEvaluation RunOutcome Trial TrialKey TrialRecord TrialRows trial_seed"
        ),
    },
)
