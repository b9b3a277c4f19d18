"""Which trials a run needs."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

from sdnn.experiments.cases import Case
from sdnn.experiments.config import ProtocolConfig, TrialConfig, case_config, trial_seed
from sdnn.experiments.records import TrialKey


@dataclass(frozen=True)
class PlannedTrial:
    """A trial that a run needs.

    Parameters
    ----------
    key
        Where its result is stored.
    config
        Its settings.
    """

    key: TrialKey
    config: TrialConfig


def plan_trials(
    cases: Iterable[Case], n_trials: int, root_seed: int, protocol: ProtocolConfig | None = None
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
    protocol
        Another protocol than the paper's.
    """
    plan: dict[TrialKey, PlannedTrial] = {}
    pairs = [
        (case, agent, case_config(case, agent, protocol)) for case in cases for agent in case.agents
    ]
    for trial in range(n_trials):
        for case, agent, config in pairs:
            seed = trial_seed(root_seed, case.id, trial)
            key = TrialKey(case.id, agent, trial, seed, config.config_hash)
            plan.setdefault(key, PlannedTrial(key, config))
    return tuple(plan.values())
