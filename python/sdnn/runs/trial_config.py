"""The trials that a run needs: the configuration of one, its hash, its seed, and their list."""

from __future__ import annotations

import hashlib
import json
import zlib
from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field, fields
from typing import Any

import numpy as np

from sdnn.agents import QLearningConfig
from sdnn.approximators import SDNNCConfig
from sdnn.config import ProtocolConfig
from sdnn.environments import AcrobotConfig, GoalScheduleConfig, SensorConfig
from sdnn.runs.records import TrialKey
from sdnn.runs.registry import agent_entry
from sdnn.runs.spec import AgentSpec, BudgetSpec, ProtocolSpec, RunSpec
from sdnn.runs.trial import TrainingTrial, Trial, training_trial

CONFIG_HASH_DIGITS = 16
"""Hexadecimal digits kept of a configuration's SHA-256: 64 bits."""


class TrialSettings(ABC):
    """Everything that fixes the outcome of a trial but its seed, whatever the task is.

    Subclasses are frozen dataclasses of plain values and of such dataclasses.
    """

    agent: str
    approximator: Any
    learning: Any
    protocol: ProtocolConfig

    @abstractmethod
    def make_trial(self, seed: int) -> Trial | TrainingTrial:
        """Make the trial of a seed.

        Raises
        ------
        ValueError
            If a value of the configuration is out of its range.
        """

    @property
    @abstractmethod
    def is_compiled(self) -> bool:
        """Whether the trial runs in C++, where it holds no GIL."""

    @property
    def length(self) -> int:
        """Learning episodes of the trial, in which its progress is told."""
        return self.protocol.n_learning_episodes

    def specification(self, seed: int, **task: Any) -> RunSpec:
        """Give the same agent and protocol as the specification of a run.

        Parameters
        ----------
        seed
            Of the run.
        task
            What it is done in.
        """
        protocol = self.protocol
        return RunSpec(
            agent=AgentSpec(name=self.agent),
            approximator=self.approximator,
            learning=self.learning,
            protocol=ProtocolSpec(
                evaluate_every_episodes=protocol.test_interval,
                evaluation_episodes=1,
                limit_bootstraps=protocol.limit_bootstraps,
                noisy_evaluations=protocol.noisy_tests,
            ),
            budget=BudgetSpec(episodes=protocol.n_learning_episodes),
            seed=seed,
            **task,
        )

    def check_agent(self) -> None:
        """Check that there is such an agent, and that the settings are its own.

        Raises
        ------
        ValueError
            If no agent has that id.
        TypeError
            If approximator or learning are those of another agent.
        """
        if not isinstance(self.agent, str):
            raise TypeError(f"agent must be the id of an agent, got {self.agent!r}")
        entry = agent_entry(self.agent)
        self.check_parts(approximator=entry.approximator, learning=entry.learning)

    def check_parts(self, **kinds: type) -> None:
        """Check that each part is of its kind; TypeError if not."""
        for name, kind in kinds.items():
            value = getattr(self, name)
            if not isinstance(value, kind):
                raise TypeError(
                    f"{name} of {self.agent} must be a {kind.__name__},"
                    f" got a {type(value).__name__}"
                )

    def canonical_json(self) -> str:
        """All values as one line of JSON: keys sorted, no spaces, 1.0 written as 1.

        With the agent's version, where its entry has one.

        Equal settings give equal text, however they were typed.
        """
        values = asdict(self)  # type: ignore[call-overload]
        if version := agent_entry(self.agent).version:
            values["agent_version"] = version
        return json.dumps(
            _canonical(values), sort_keys=True, separators=(",", ":"), allow_nan=False
        )

    @property
    def config_hash(self) -> str:
        """First 16 hexadecimal digits of the SHA-256 of `canonical_json`."""
        digest = hashlib.sha256(self.canonical_json().encode()).hexdigest()
        return digest[:CONFIG_HASH_DIGITS]


@dataclass(frozen=True, kw_only=True)
class TrialConfig(TrialSettings):
    """A trial of an agent on the acrobot.

    Parameters
    ----------
    agent
        Id of the agent, as in `sdnn.runs.registry`.
    approximator
        Sizes and start of what the agent learns with: the dataclass of its entry.
    learning
        How the agent learns and explores: the dataclass of its entry.
    acrobot
        Physics, goal and reward.
    goal
        How the goal tightens with the episodes.
    sensors
        What is observed, and how noisily.
    protocol
        Learning and test episodes.

    Raises
    ------
    ValueError
        If no agent has that id.
    TypeError
        If approximator or learning are those of another agent.

    Examples
    --------
    >>> TrialConfig().config_hash == TrialConfig(agent="sdnn-c").config_hash
    True
    """

    agent: str = "sdnn-c"
    approximator: Any = field(default_factory=SDNNCConfig)
    learning: Any = field(default_factory=QLearningConfig)
    acrobot: AcrobotConfig = field(default_factory=AcrobotConfig)
    goal: GoalScheduleConfig = field(default_factory=GoalScheduleConfig)
    sensors: SensorConfig = field(default_factory=SensorConfig)
    protocol: ProtocolConfig = field(default_factory=ProtocolConfig)

    def __post_init__(self) -> None:
        self.check_agent()
        self.check_parts(
            acrobot=AcrobotConfig,
            goal=GoalScheduleConfig,
            sensors=SensorConfig,
            protocol=ProtocolConfig,
        )

    @property
    def is_compiled(self) -> bool:
        """Whether the agent has a trial in C++."""
        return agent_entry(self.agent).core_trial is not None

    def make_trial(self, seed: int) -> Trial | TrainingTrial:
        """Make the trial: in C++ if the agent has one there, else in Python.

        A trial in C++ releases the GIL while it advances.

        Raises
        ------
        ValueError
            If a value of the configuration is out of its range.
        """
        entry = agent_entry(self.agent)
        if entry.core_trial is not None:
            parts = {f.name: getattr(self, f.name) for f in fields(self) if f.name != "agent"}
            return entry.core_trial(**parts, seed=seed)
        if self.approximator.n_inputs != self.sensors.n_inputs:
            raise ValueError(
                f"n_inputs must be the number of inputs of the sensors, {self.sensors.n_inputs},"
                f" got {self.approximator.n_inputs}"
            )
        task = {"acrobot": self.acrobot, "goal": self.goal, "sensors": self.sensors}
        return training_trial(self.specification(seed, **task))


def _canonical(value: Any) -> Any:
    if isinstance(value, np.generic):
        value = value.item()
    if isinstance(value, Mapping):
        return {str(key): _canonical(item) for key, item in value.items()}
    if isinstance(value, (list, tuple)):
        return [_canonical(item) for item in value]
    if isinstance(value, float) and value.is_integer():
        return int(value)
    return value


def trial_seed(root_seed: int, case_id: str, trial: int) -> int:
    """Seed of a trial, the same for every agent, order of execution and number of jobs.

    All agents thus meet the same sensor noise in the same trial of a case.

    It is the first 64-bit word of ``SeedSequence(root_seed, spawn_key=(crc32(case_id), trial))``
    without its lowest bit, because the result file's integers have a sign.

    Parameters
    ----------
    root_seed
        The run's seed, not negative.
    case_id
        Id of the case.
    trial
        Number of the trial, from 0.

    Examples
    --------
    >>> trial_seed(0, "s4", 0) == trial_seed(0, "s4", 1)
    False
    """
    spawn_key = (zlib.crc32(case_id.encode()), trial)
    word = np.random.SeedSequence(root_seed, spawn_key=spawn_key).generate_state(1, np.uint64)[0]
    return int(word) >> 1


def describe(key: TrialKey) -> str:
    """Name a trial for a reader; trials count from 1.

    Examples
    --------
    >>> describe(TrialKey("s4", "sdnn-c", 0, 1, ""))
    'SDNN-C s4, trial 1'
    """
    return f"{agent_entry(key.agent).title} {key.case_id}, trial {key.trial + 1}"


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
    config: TrialSettings

    @property
    def title(self) -> str:
        """Its name for a reader."""
        return describe(self.key)
