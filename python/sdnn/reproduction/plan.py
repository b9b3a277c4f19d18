"""The trials that a run of the paper's experiments needs."""

from __future__ import annotations

from collections.abc import Iterable

from sdnn.config import SensorConfig
from sdnn.reproduction.cases import PAPER_EPISODES, Case
from sdnn.runs.planned_trial import PlannedTrial, trial_seed
from sdnn.runs.records import TrialKey
from sdnn.runs.registry import label_of, split_label
from sdnn.runs.spec import AgentSpec, BudgetSpec, RunSpec


def case_spec(case: Case, agent: str, n_episodes: int = PAPER_EPISODES) -> RunSpec:
    """Return the specification of an agent in a case: its defaults, the case's sensors.

    Parameters
    ----------
    case
        What is observed.
    agent
        One of `case.agents`.
    n_episodes
        Learning episodes.

    Raises
    ------
    ValueError
        If the agent takes no part in the case, or there is no such agent.
    """
    if agent not in case.agents:
        raise ValueError(f"agent must be one of {case.agents} in case {case.id}, got {agent!r}")
    name, preset = split_label(agent)
    return RunSpec(
        agent=AgentSpec(name=name, preset=preset),
        sensors=SensorConfig(n_sensors=case.n_sensors, noise=case.noise),
        budget=BudgetSpec(episodes=n_episodes),
    )


def plan_trials(
    cases: Iterable[Case], n_trials: int, root_seed: int, n_episodes: int = PAPER_EPISODES
) -> tuple[PlannedTrial, ...]:
    """List the trials of all agents in the given cases, each once.

    The first trial of every case comes first, so an interrupted run covers all cases evenly.

    Parameters
    ----------
    cases
        Cases; rows that share an id and an agent share their trials.
    n_trials
        Trials for each case and agent.
    root_seed
        Seed from which the trials' seeds are derived.
    n_episodes
        Learning episodes in a trial.
    """
    plan: dict[TrialKey, PlannedTrial] = {}
    pairs = [
        (case, agent, case_spec(case, agent, n_episodes)) for case in cases for agent in case.agents
    ]
    hashes = [spec.config_hash for _, _, spec in pairs]
    for trial in range(n_trials):
        for (case, agent, spec), config_hash in zip(pairs, hashes, strict=True):
            seed = trial_seed(root_seed, case.id, trial)
            key = TrialKey(case.id, label_of(*split_label(agent)), trial, seed, config_hash)
            plan.setdefault(key, PlannedTrial(key, spec))
    return tuple(plan.values())
