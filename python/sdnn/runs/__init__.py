"""Runs: one agent that learns in one environment, in a folder of its own, which can be resumed.

A folder holds ``config.json`` (all that defines the run), ``results.sqlite`` (its episodes and
evaluations), ``checkpoint.safetensors`` (where it goes on) and, once it is finished,
``agent.safetensors``. The commands ``sdnn train``, ``resume``, ``evaluate``, ``plot`` and
``record`` work on such folders.
"""

from typing import TYPE_CHECKING

from sdnn.lazy import attach

if TYPE_CHECKING:
    from sdnn.runs.config import AGENTS, RunConfig
    from sdnn.runs.environment import EnvironmentSpec
    from sdnn.runs.errors import ConfigError, RunError, RunTerminatedError
    from sdnn.runs.run import Goal, Run, RunEvaluation, RunOutcome
    from sdnn.runs.spec import AgentSpec, BudgetSpec, OutputSpec, ProtocolSpec, RunSpec

__getattr__, __dir__ = attach(globals())

__all__ = [
    "AGENTS",
    "AgentSpec",
    "BudgetSpec",
    "ConfigError",
    "EnvironmentSpec",
    "Goal",
    "OutputSpec",
    "ProtocolSpec",
    "Run",
    "RunConfig",
    "RunError",
    "RunEvaluation",
    "RunOutcome",
    "RunSpec",
    "RunTerminatedError",
]
