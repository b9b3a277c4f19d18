"""The trials that a run of the paper's experiments needs."""

from __future__ import annotations

from collections.abc import Iterable

from sdnn.config import ProtocolConfig
from sdnn.environments import SensorConfig
from sdnn.reproduction.cases import Case
from sdnn.runs.records import TrialKey
from sdnn.runs.registry import agent_entry
from sdnn.runs.trial_config import PlannedTrial, TrialConfig, trial_seed


def case_config(case: Case, agent: str, protocol: ProtocolConfig | None = None) -> TrialConfig:
    """Return the configuration of an agent in a case: its entry's defaults, the case's sensors.

    The protocol is the paper's by default. A ValueError says that the agent takes no part in the
    case, or that no agent has that id.
    """
    if agent not in case.agents:
        raise ValueError(f"agent must be one of {case.agents} in case {case.id}, got {agent!r}")
    entry = agent_entry(agent)
    return TrialConfig(
        agent=agent,
        approximator=entry.approximator_settings(case.n_sensors),
        learning=entry.learning_settings(),
        sensors=SensorConfig(n_sensors=case.n_sensors, noise=case.noise),
        protocol=ProtocolConfig() if protocol is None else protocol,
    )


def plan_trials(
    cases: Iterable[Case], n_trials: int, root_seed: int, protocol: ProtocolConfig | None = None
) -> tuple[PlannedTrial, ...]:
    """List the trials of all agents in the given cases, each once.

    The first trial of every case comes first, so an interrupted run covers all cases evenly.
    Experiments share the trials of cases that have the same id.
    """
    plan: dict[TrialKey, PlannedTrial] = {}
    configs = [(case.id, a, case_config(case, a, protocol)) for case in cases for a in case.agents]
    for trial in range(n_trials):
        for case_id, agent, config in configs:
            seed = trial_seed(root_seed, case_id, trial)
            key = TrialKey(case_id, agent, trial, seed, config.config_hash)
            plan.setdefault(key, PlannedTrial(key, config))
    return tuple(plan.values())
