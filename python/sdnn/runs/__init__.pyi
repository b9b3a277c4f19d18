from sdnn.agents.registry import (
    AGENTS as AGENTS,
    AgentEntry as AgentEntry,
    agent_entry as agent_entry,
    register as register,
)
from sdnn.reports.statistics import Estimate as Estimate
from sdnn.runs.dask_executor import DaskExecutor as DaskExecutor
from sdnn.runs.engine import (
    Executor as Executor,
    Observer as Observer,
    PlannedTrial as PlannedTrial,
    ThreadExecutor as ThreadExecutor,
    run_trials as run_trials,
)
from sdnn.runs.environment import EnvironmentSpec as EnvironmentSpec
from sdnn.runs.errors import (
    ClusterError as ClusterError,
    ConfigError as ConfigError,
    PlotUnavailableError as PlotUnavailableError,
    RunError as RunError,
    RunTerminatedError as RunTerminatedError,
    StoreError as StoreError,
    WorkerLostError as WorkerLostError,
)
from sdnn.runs.results import CaseResult as CaseResult, measure as measure
from sdnn.runs.run import Goal as Goal, Run as Run
from sdnn.runs.settings import (
    AgentSpec as AgentSpec,
    BudgetSpec as BudgetSpec,
    OutputSpec as OutputSpec,
    ProtocolSpec as ProtocolSpec,
)
from sdnn.runs.spec import RunSpec as RunSpec
from sdnn.runs.store import ResultStore as ResultStore
from sdnn.runs.trial import (
    RunEvaluation as RunEvaluation,
    RunOutcome as RunOutcome,
    Trial as Trial,
    TrialKey as TrialKey,
    TrialRecord as TrialRecord,
    TrialRows as TrialRows,
    trial_seed as trial_seed,
)
