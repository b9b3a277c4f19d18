"""Configuration of one trial, its hash, and the seeds of trials."""

from __future__ import annotations

import hashlib
import json
import zlib
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, TypeAlias

import numpy as np

from sdnn import _core
from sdnn.agents import FuzzyQLearningConfig, QLearningConfig
from sdnn.approximators import FuzzyRulesConfig, RBFNetworkConfig, SDNNCConfig
from sdnn.config import to_core
from sdnn.environments import AcrobotConfig, GoalScheduleConfig, SensorConfig

if TYPE_CHECKING:
    from sdnn.experiments.cases import Case

CONFIG_HASH_DIGITS = 16
"""Hexadecimal digits kept of a configuration's SHA-256: 64 bits."""


@dataclass(frozen=True, kw_only=True)
class ProtocolConfig:
    """Learning protocol of a trial; the defaults are the paper's values (spec section 5).

    Parameters
    ----------
    n_learning_episodes
        Learning episodes in a trial, at least 1.
    test_interval
        One test episode follows every so many learning episodes, at least 1.
    """

    n_learning_episodes: int = 15_000
    test_interval: int = 10

    def to_core(self) -> _core.ProtocolConfig:
        """Make the core's struct of the same values; see `sdnn.config.to_core`."""
        return to_core(self, _core.ProtocolConfig)


ApproximatorConfig: TypeAlias = SDNNCConfig | FuzzyRulesConfig | RBFNetworkConfig
LearningConfig: TypeAlias = QLearningConfig | FuzzyQLearningConfig

_AGENT_CONFIGS: dict[str, tuple[type[ApproximatorConfig], type[LearningConfig]]] = {
    "sdnn-c": (SDNNCConfig, QLearningConfig),
    "fql": (FuzzyRulesConfig, FuzzyQLearningConfig),
    "rbfn": (RBFNetworkConfig, QLearningConfig),
}


@dataclass(frozen=True, kw_only=True)
class TrialConfig:
    """Everything that fixes the outcome of a trial but its seed.

    Parameters
    ----------
    agent
        Id of the agent.
    approximator
        Sizes and start of what the agent learns with.
    learning
        How the agent learns and explores.
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
    approximator: ApproximatorConfig = field(default_factory=SDNNCConfig)
    learning: LearningConfig = field(default_factory=QLearningConfig)
    acrobot: AcrobotConfig = field(default_factory=AcrobotConfig)
    goal: GoalScheduleConfig = field(default_factory=GoalScheduleConfig)
    sensors: SensorConfig = field(default_factory=SensorConfig)
    protocol: ProtocolConfig = field(default_factory=ProtocolConfig)

    def __post_init__(self) -> None:
        expected = _configs_of(self.agent)
        for name, kind in zip(("approximator", "learning"), expected, strict=True):
            value = getattr(self, name)
            if not isinstance(value, kind):
                raise TypeError(
                    f"{name} of {self.agent} must be a {kind.__name__},"
                    f" got a {type(value).__name__}"
                )

    def canonical_json(self) -> str:
        """All values as one line of JSON: keys sorted, no spaces, 1.0 written as 1.

        Equal settings give equal text, however they were typed.
        """
        return json.dumps(
            _canonical(asdict(self)), sort_keys=True, separators=(",", ":"), allow_nan=False
        )

    @property
    def config_hash(self) -> str:
        """First 16 hexadecimal digits of the SHA-256 of `canonical_json`."""
        digest = hashlib.sha256(self.canonical_json().encode()).hexdigest()
        return digest[:CONFIG_HASH_DIGITS]


def _configs_of(agent: str) -> tuple[type[ApproximatorConfig], type[LearningConfig]]:
    if agent not in _AGENT_CONFIGS:
        raise ValueError(f"agent must be one of {list(_AGENT_CONFIGS)}, got {agent!r}")
    return _AGENT_CONFIGS[agent]


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


def case_config(case: Case, agent: str, protocol: ProtocolConfig | None = None) -> TrialConfig:
    """Return the paper's configuration of an agent in a case.

    Parameters
    ----------
    case
        What is observed.
    agent
        Id of the agent, one of `case.agents`.
    protocol
        Another protocol than the paper's.

    Raises
    ------
    ValueError
        If the agent takes no part in the case.
    """
    if agent not in case.agents:
        raise ValueError(f"agent must be one of {case.agents} in case {case.id}, got {agent!r}")
    approximator, learning = _configs_of(agent)
    return TrialConfig(
        agent=agent,
        approximator=approximator(n_inputs=case.n_sensors),
        learning=learning(),
        sensors=SensorConfig(n_sensors=case.n_sensors, noise=case.noise),
        protocol=ProtocolConfig() if protocol is None else protocol,
    )


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
