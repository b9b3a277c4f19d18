"""The specification of a run: all that fixes its rows, declared once."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping
from dataclasses import replace
from typing import Annotated, Any

import gymnasium as gym
import msgspec
from msgspec import Meta

from sdnn.agents import Agent
from sdnn.agents.episode import Learner
from sdnn.config import ProtocolConfig
from sdnn.environments import (
    AcrobotConfig,
    AcrobotSensors,
    AcrobotSwingUpEnv,
    GoalSchedule,
    GoalScheduleConfig,
    SensorConfig,
    TighteningGoal,
)
from sdnn.runs.environment import EnvironmentSpec, Stream
from sdnn.runs.errors import ConfigError
from sdnn.runs.registry import agent_entry, label_of, split_label
from sdnn.runs.settings import Settings, argument_of, changed, kinds_of, read, values_of
from sdnn.runs.spec_parts import AgentSpec, BudgetSpec, OutputSpec, ProtocolSpec
from sdnn.runs.trial import TrainingTrial, Trial, training_trial

__all__ = [
    "AgentSpec",
    "BudgetSpec",
    "OutputSpec",
    "ProtocolSpec",
    "RunSpec",
]

HASH_DIGITS = 16
"""Hexadecimal digits kept of a specification's SHA-256: 64 bits."""

DEFAULT_STEPS = 200_000
PAPER_EPISODES = 15_000
PAPER_INTERVAL = 10

_ALWAYS = ("id", "name", "preset", "steps", "episodes")
"""Settings that are written also where they are the default."""

_ACROBOT = {"acrobot": AcrobotConfig, "goal": GoalScheduleConfig, "sensors": SensorConfig}


class RunSpec(Settings, frozen=True):
    """Everything that fixes the rows of a run, and what is written of it.

    What is not given is filled in: preset, budget and evaluations follow from the task, the
    settings of the agent's parts from its preset. ``approximator.n_inputs`` follows from what is
    observed.

    Raises
    ------
    ConfigError
        If a value cannot be used; ``key`` says which, with dots between tables.

    Examples
    --------
    >>> spec = RunSpec(environment=EnvironmentSpec(id="CartPole-v1"), seed=3)
    >>> spec.budget.steps, spec.agent.preset, spec.learning.n_steps
    (200000, 'general', 5)
    >>> RunSpec(learning={"epsilon": 0.2}).learning.epsilon
    0.2
    """

    environment: Annotated[
        EnvironmentSpec | None,
        Meta(description="A Gymnasium environment; by default the task is the paper's acrobot."),
    ] = None
    acrobot: Annotated[Any, Meta(description="Physics, goal and reward of the acrobot.")] = None
    goal: Annotated[Any, Meta(description="How the acrobot's goal tightens.")] = None
    sensors: Annotated[
        Any, Meta(description="What is observed of the acrobot, and how noisily.")
    ] = None
    agent: Annotated[AgentSpec, Meta(description="Who learns.")] = AgentSpec()
    approximator: Annotated[Any, Meta(description="What the agent learns with.")] = None
    learning: Annotated[Any, Meta(description="How the agent learns and explores.")] = None
    protocol: Annotated[ProtocolSpec, Meta(description="How it is evaluated.")] = ProtocolSpec()
    budget: Annotated[BudgetSpec, Meta(description="How long it learns.")] = BudgetSpec()
    seed: Annotated[
        Annotated[int, Meta(ge=0)], Meta(description="Root of all seeds, at most 2**64 - 1.")
    ] = 0
    output: Annotated[OutputSpec, Meta(description="What is written besides the rows.")] = (
        OutputSpec()
    )

    def __post_init__(self) -> None:
        super().__post_init__()
        if self.seed >= 2**64:
            raise ConfigError("seed", f"must be at most 2**64 - 1, got {self.seed}")
        self._fill_task()
        self._fill_agent()
        self._fill_protocol()

    def _set(self, **values: Any) -> None:
        for name, value in values.items():
            msgspec.structs.force_setattr(self, name, value)

    def _fill_task(self) -> None:
        for name, kind in _ACROBOT.items():
            value = getattr(self, name)
            if self.environment is not None:
                if value is not None:
                    raise ConfigError(name, "is the acrobot's: it does not go with an environment")
            elif isinstance(value, Mapping) or value is None:
                self._set(**{name: changed(kind(), value or {}, name)})
            elif not isinstance(value, kind):
                raise ConfigError(name, f"must be a table or a {kind.__name__}, got {value!r}")

    def _fill_agent(self) -> None:
        try:
            entry = agent_entry(self.agent.name)
        except ValueError as error:
            raise ConfigError("agent.name", str(error).partition(" ")[2]) from None
        if self.environment is None:
            standard = AgentSpec(name=self.agent.name, preset=self.agent.preset)
            for key in ("observation_range", "angles", "angle_pairs", "warm_up_steps"):
                if getattr(self.agent, key) != getattr(standard, key):
                    raise ConfigError(f"agent.{key}", "is for environments: omit it on acrobot")
        preset = self.agent.preset
        if preset is None and entry.presets:
            preset = "paper" if self.environment is None else "general"
            self._set(agent=self.agent.replace(preset=preset))
        if preset is not None and preset not in entry.presets:
            words = f"one of {', '.join(map(repr, entry.presets))}" if entry.presets else "omitted"
            raise ConfigError(
                "agent.preset", f"must be {words} for the agent {entry.id!r}, got {preset!r}"
            )
        defaults = entry.parts(preset)
        hint = f" (agent {entry.id})"
        for name, base in zip(("approximator", "learning"), defaults, strict=True):
            value = getattr(self, name)
            if isinstance(value, Mapping) or value is None:
                value = changed(base, value or {}, name, hint)
            elif not isinstance(value, type(base)):
                words = f"must be a table, or the {type(base).__name__} of {entry.id}"
                raise ConfigError(name, f"{words}, got {value!r}")
            if name == "approximator" and self.environment is None:
                n_inputs = self.sensors.n_inputs
                value = changed_size(value, n_inputs)
            self._set(**{name: value})

    def _fill_protocol(self) -> None:
        on_acrobot = self.environment is None
        protocol, budget = self.protocol, self.budget
        if protocol.evaluate_every is not None and protocol.evaluate_every_episodes is not None:
            raise ConfigError(
                "protocol.evaluate_every_episodes", "must not be given together with evaluate_every"
            )
        if protocol.evaluate_every is None and protocol.evaluate_every_episodes is None:
            name = "evaluate_every_episodes" if on_acrobot else "evaluate_every"
            protocol = protocol.replace(**{name: PAPER_INTERVAL if on_acrobot else 10_000})
        if protocol.evaluation_episodes is None:
            protocol = protocol.replace(evaluation_episodes=1 if on_acrobot else 10)
        if budget.steps is None and budget.episodes is None:
            budget = (
                budget.replace(episodes=PAPER_EPISODES)
                if on_acrobot
                else budget.replace(steps=DEFAULT_STEPS)
            )
        self._set(protocol=protocol, budget=budget)
        if on_acrobot and protocol.n_envs > 1:
            raise ConfigError("protocol.n_envs", f"must be 1 for acrobot, got {protocol.n_envs}")
        if budget.target_return is not None and not self.is_evaluated:
            raise ConfigError(
                "budget.target_return", "needs evaluations: evaluate_every must not be 0"
            )
        every = protocol.evaluate_every_episodes
        if every is not None and budget.episodes is not None and budget.episodes < every:
            raise ConfigError(
                "budget.episodes",
                f"must be at least evaluate_every_episodes ({every}), got {budget.episodes}",
            )
        environment = self.environment
        if (
            self.agent.angle_pairs == "find"
            and environment is not None
            and environment.changes_observations
        ):
            raise ConfigError(
                "agent.angle_pairs",
                "finds no angles in scaled observations: not together with noise or redundant",
            )

    def __hash__(self) -> int:
        return hash((self.canonical_json(), self.seed, self.output))

    # What is derived.

    @property
    def is_evaluated(self) -> bool:
        """Whether there are evaluations."""
        return bool(self.protocol.evaluate_every or self.protocol.evaluate_every_episodes)

    @property
    def task(self) -> str:
        """The environment's id, or ``"acrobot"`` for the paper's."""
        return "acrobot" if self.environment is None else self.environment.id

    @property
    def label(self) -> str:
        """The agent for a reader: ``"sdnn-c"``, with a preset ``"sdnn-c-robust"``."""
        return label_of(self.agent.name, self.agent.preset)

    @property
    def max_episode_steps(self) -> int | None:
        """Steps in an episode at most; None if nobody knows."""
        if self.environment is None:
            return int(self.acrobot.max_decisions)
        with self.environment.opened() as env:
            return None if env.spec is None else env.spec.max_episode_steps

    @property
    def is_compiled(self) -> bool:
        """Whether the whole run can be done in C++, by `core_trial`, where it holds no GIL."""
        return (
            self.environment is None
            and agent_entry(self.agent.name).core_trial is not None
            and self.protocol.n_envs == 1
            and self.protocol.evaluation_episodes == 1
            and self.protocol.evaluate_every_episodes is not None
            and self.budget.episodes is not None
            and self.budget.target_return is None
        )

    # What is made of it.

    def core_trial(self) -> Trial:
        """Make the trial in C++: the rows of the training loop, bit for bit.

        It releases the GIL while it advances.

        Raises
        ------
        ValueError
            If a value is out of its range, or not `is_compiled`.
        """
        entry = agent_entry(self.agent.name)
        if not self.is_compiled or entry.core_trial is None:
            raise ValueError(f"{self.label} has no trial in C++ under this protocol")
        parts = {name: getattr(self, name) for name in (*_ACROBOT, "approximator", "learning")}
        protocol = ProtocolConfig(
            n_learning_episodes=self.budget.episodes or 0,
            test_interval=self.protocol.evaluate_every_episodes or 0,
            limit_bootstraps=self.protocol.limit_bootstraps,
            noisy_tests=self.protocol.noisy_evaluations,
        )
        return entry.core_trial(**parts, protocol=protocol, seed=self.seed)

    @property
    def length(self) -> int:
        """Episodes or steps to learn, in which progress is told."""
        return self.budget.episodes or self.budget.steps or 0

    def make_trial(self, seed: int) -> Trial | TrainingTrial:
        """Make the trial of a seed: in C++ if that can do the whole run, else a training.

        Raises
        ------
        ConfigError
            If environment or agent cannot be made.
        ValueError
            If a value is out of its range.
        """
        spec = self.replace(seed=seed)
        return spec.core_trial() if spec.is_compiled else training_trial(spec)

    def make_env(
        self,
        stream: Stream = "sensor_noise",
        *,
        render_mode: str | None = None,
        seed: int | None = None,
    ) -> gym.Env[Any, Any]:
        """Make an environment to learn in or, of the other stream, to be evaluated in.

        Parameters
        ----------
        stream
            Where its sensor noise comes from.
        render_mode
            As Gymnasium has it.
        seed
            Where the noise starts in a Gymnasium environment; by default each reset with a seed
            starts it. On the paper's acrobot it starts at the run's seed and runs on over episodes.

        Raises
        ------
        ConfigError
            If it cannot be made.
        RunError
            If it can be made, but not with this render mode.
        """
        is_quiet = stream == "evaluation_sensor_noise" and not self.protocol.noisy_evaluations
        if self.environment is not None:
            environment = self.environment.replace(noise=0.0) if is_quiet else self.environment
            return environment.make(stream, render_mode, seed)
        sensors = changed(self.sensors, {"noise": 0.0} if is_quiet else {}, "sensors")
        env = AcrobotSwingUpEnv(config=self.acrobot, dtype="float64", render_mode=render_mode)
        tightening = TighteningGoal(env, GoalSchedule(self.goal))
        return AcrobotSensors(tightening, sensors, seed=self.seed, stream=stream)

    def make_training_env(self) -> gym.Env[Any, Any] | gym.vector.VectorEnv[Any, Any, Any]:
        """Make what the agent learns in: an environment, or a vector of ``protocol.n_envs``.

        Raises
        ------
        ConfigError
            As `make_env`; or if Gymnasium is too old for a vector.
        """
        n_envs = self.protocol.n_envs
        if n_envs == 1:
            return self.make_env()
        if not hasattr(gym.vector, "AutoresetMode"):
            raise ConfigError(
                "protocol.n_envs", f"needs Gymnasium 1.1 or newer, this is {gym.__version__}"
            )
        return gym.vector.SyncVectorEnv([self.make_env] * n_envs)

    def make_agent(self, env: gym.Env[Any, Any]) -> Learner:
        """Make the agent for an environment such as `make_env` makes.

        Raises
        ------
        ConfigError
            If a setting is out of its range, or the agent cannot work with the spaces.
        """
        entry = agent_entry(self.agent.name)
        approximator = self.approximator
        shape = env.observation_space.shape
        is_own = isinstance(entry.agent, type) and issubclass(entry.agent, Agent)
        if not is_own and shape is not None and len(shape) == 1:
            approximator = changed_size(approximator, shape[0])  # others find it out themselves
        try:
            agent = entry.agent(
                env.observation_space,
                env.action_space,
                approximator=approximator,
                learning=self.learning,
                seed=self.seed,
                **self._agent_options(env),
            )
        except (TypeError, ValueError, OverflowError, MemoryError) as error:
            raise ConfigError(self.key_of(error), str(error)) from error
        if isinstance(agent, Agent) and self.environment is not None:
            agent.scaling = self.environment.scaling(env)
        return agent

    def _agent_options(self, env: gym.Env[Any, Any]) -> dict[str, Any]:
        """Return the arguments that only some agents have: those that are not the default."""
        defaults = AgentSpec()
        names = ("observation_range", "angles", "angle_pairs", "warm_up_steps")
        given = {name: getattr(self.agent, name) for name in names}
        given = {name: v for name, v in given.items() if v != getattr(defaults, name)}
        environment = self.environment
        if environment is None or not environment.ranges or environment.has_other_sensors:
            return given
        if "observation_range" in given:
            raise ConfigError(
                "environment.ranges", "must not be given together with adaptive ranges"
            )
        return {**given, "observation_range": environment.ends(env)}

    def key_of(self, error: BaseException) -> str:
        """Return the key of the setting that an error is about; else of the task."""
        name = argument_of(error)
        for section in ("approximator", "learning", "agent"):
            if name != "n_inputs" and name in kinds_of(type(getattr(self, section))):
                return f"{section}.{name}"
        return "environment.id" if self.environment is not None else "agent.name"

    # Files and stores.

    def values(self) -> dict[str, Any]:
        """Return what is not the default as JSON has it; `from_values` reads it.

        The settings of the agent's parts are those that differ from its preset.
        """
        environment = None if self.environment is None else EnvironmentSpec(id=self.task)
        agent = AgentSpec(name=self.agent.name, preset=self.agent.preset)
        defaults = RunSpec(environment=environment, agent=agent).full_values()
        values: dict[str, Any] = {}
        for name, value in self.full_values().items():
            if isinstance(value, Mapping):
                value = {
                    key: one
                    for key, one in value.items()
                    if key in _ALWAYS or one != defaults[name].get(key)
                }
                if name in ("agent", "budget", "protocol"):  # None: as it follows from others
                    value = {key: one for key, one in value.items() if one is not None}
            if value not in ({}, defaults[name]):
                values[name] = value
        return values

    def full_values(self) -> dict[str, Any]:
        """Return all values as JSON has them."""
        values = {name: value for name, value in values_of(self).items() if value is not None}
        values["approximator"].pop("n_inputs", None)
        return values

    @classmethod
    def from_values(cls, values: Mapping[str, Any]) -> RunSpec:
        """Make it of values as JSON or TOML has them.

        ``environment`` may be the id of one, and ``agent`` the name of one, with its preset if
        wanted: ``"sdnn-c-robust"``.

        Raises
        ------
        ConfigError
            If a key is unknown or missing, or a value cannot be used.
        """
        given = dict(values)
        if isinstance(given.get("environment"), str):
            given["environment"] = {"id": given["environment"]}
        if isinstance(given.get("agent"), str):
            given["agent"] = {"name": given["agent"]}
        if isinstance(given.get("agent"), Mapping):
            given["agent"] = _with_preset(given["agent"])
        return read(cls, given)

    def canonical_json(self) -> str:
        """Return what fixes the rows but the seed, as one line of JSON: sorted keys, 1 for 1.0.

        Presets are resolved, so equal settings give equal text however they were typed. With the
        agent's version, where its entry has one.
        """
        values = self.full_values()
        for name in ("seed", "output"):
            del values[name]
        values["agent"].pop("preset")
        if version := agent_entry(self.agent.name).version:
            values["agent"]["version"] = version
        return json.dumps(
            _canonical(values), sort_keys=True, separators=(",", ":"), allow_nan=False
        )

    @property
    def config_hash(self) -> str:
        """First 16 hexadecimal digits of the SHA-256 of `canonical_json`."""
        return hashlib.sha256(self.canonical_json().encode()).hexdigest()[:HASH_DIGITS]


def _with_preset(agent: Mapping[str, Any]) -> Mapping[str, Any]:
    """Take the preset out of an agent's name, such as ``"sdnn-c-robust"``."""
    name = agent.get("name")
    try:
        short, preset = split_label(name) if isinstance(name, str) else (name, None)
    except ValueError:
        return agent  # which is refused by its name
    if preset is None:
        return agent
    if agent.get("preset", preset) != preset:
        raise ConfigError("agent.preset", f"must be that of {name!r}, got {agent['preset']!r}")
    return {**agent, "name": short, "preset": preset}


def changed_size(approximator: Any, n_inputs: int) -> Any:
    """Return the settings of an approximator for so many inputs, if these are among them."""
    if "n_inputs" not in kinds_of(type(approximator)):
        return approximator
    return replace(approximator, n_inputs=n_inputs)


def _canonical(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _canonical(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_canonical(item) for item in value]
    if isinstance(value, float) and value.is_integer():
        return int(value)
    return value
