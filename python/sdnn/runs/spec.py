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

from sdnn.agents import Agent, Preset
from sdnn.agents.q_learning import CodedAgent
from sdnn.agents.registry import (
    AGENTS,
    AgentEntry,
    agent_entry,
    default_agent,
    label_of,
    split_label,
)
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
from sdnn.runs.settings import (
    SHORTHANDS,
    AgentSpec,
    BudgetSpec,
    OutputSpec,
    ProtocolSpec,
    Settings,
    changed,
    doc,
    names_of,
    read,
)
from sdnn.runs.trial import TrainingTrial, Trial, training_trial
from sdnn.support.arguments import blamed, is_of_class, shown
from sdnn.support.bounds import flat_bounds
from sdnn.training.learners import Learner

HASH_DIGITS = 16
"""Hexadecimal digits kept of a specification's SHA-256: 64 bits."""

DEFAULT_STEPS = 200_000
PAPER_EPISODES = 15_000
PAPER_INTERVAL = 10

_ALWAYS = ("id", "name", "preset", "steps", "episodes")
"""Settings that are written also where they are the default."""

ACROBOT = {"acrobot": AcrobotConfig, "goal": GoalScheduleConfig, "sensors": SensorConfig}
"""Tables of the paper's task, which a specification without an environment has."""

_OF_SPACES = ("observation_range", "angles", "angle_pairs", "inputs", "warm_up_steps", "missing")
"""Settings of agents in environments."""

_UNUSED = AgentSpec(angle_pairs="none", inputs="all")
"""Values of these settings on the acrobot."""


class RunSpec(Settings, frozen=True):
    """Everything that fixes the rows of a run, and what is written of it.

    What is not given is filled in: preset, budget and evaluations follow from the task, the
    settings of the agent's parts from its preset. ``approximator.n_inputs`` follows from what is
    observed.

    ConfigError if a value cannot be used; ``key`` names it, with dots between tables.

    Examples
    --------
    >>> spec = RunSpec(environment=EnvironmentSpec(id="CartPole-v1"), seed=3)
    >>> spec.budget.steps, spec.agent.name, spec.agent.preset
    (200000, 'q-lambda', 'general')
    >>> RunSpec(learning={"epsilon": 0.2}).learning.epsilon
    0.2
    """

    environment: Annotated[
        EnvironmentSpec | None,
        doc("A Gymnasium environment; by default the task is the paper's acrobot."),
    ] = None
    acrobot: Annotated[Any, doc("Physics, goal and reward of the acrobot.")] = None
    goal: Annotated[Any, doc("How the acrobot's goal tightens.")] = None
    sensors: Annotated[Any, doc("What is observed of the acrobot, and how noisily.")] = None
    agent: Annotated[AgentSpec, doc("Who learns.")] = AgentSpec()
    approximator: Annotated[Any, doc("What the agent learns with.")] = None
    learning: Annotated[Any, doc("How the agent learns and explores.")] = None
    protocol: Annotated[ProtocolSpec, doc("How it is evaluated.")] = ProtocolSpec()
    budget: Annotated[BudgetSpec, doc("How long it learns.")] = BudgetSpec()
    seed: Annotated[int, Meta(ge=0), doc("Root of all seeds, at most 2**64 - 1.")] = 0
    output: Annotated[OutputSpec, doc("What is written besides the rows.")] = OutputSpec()

    def __post_init__(self) -> None:
        for name, key in SHORTHANDS.items():
            if isinstance(value := getattr(self, name), str):
                self._set(**{name: {key: value}})
        super().__post_init__()
        if self.seed >= 2**64:
            raise ConfigError("seed", f"must be at most 2**64 - 1, got {shown(self.seed)}")
        for name, kind in ACROBOT.items():
            if self.environment is None:
                self._set(**{name: self._part(name, kind())})
            elif getattr(self, name) is not None:
                raise ConfigError(name, "is the acrobot's: it does not go with an environment")
        self._fill_agent()
        self._fill_protocol()

    def _set(self, **values: Any) -> None:
        for name, value in values.items():
            msgspec.structs.force_setattr(self, name, value)

    def _part(self, name: str, base: Any, hint: str = "") -> Any:
        """Return settings of a part: as given, or those of ``base`` with the given changes."""
        value = getattr(self, name)
        if value is None or isinstance(value, Mapping):
            return changed(base, value or {}, name, hint)
        if is_of_class(value, type(base)):
            return value
        words = f"must be a table or {type(base).__name__}{hint}"
        raise ConfigError(name, f"{words}, got {shown(value)}")

    def _fill_agent(self) -> None:
        entry, preset = self._chosen_agent()
        for name in self._of_spaces() if self.environment is None else ():
            raise ConfigError(f"agent.{name}", "is for environments: omit it on acrobot")
        if preset is None and entry.presets:
            preset = "paper" if self.environment is None else "general"
        if preset is not None and preset not in entry.presets:
            words = f"one of {', '.join(map(repr, entry.presets))}" if entry.presets else "omitted"
            others = [other.id for other in AGENTS.values() if preset in other.presets]
            hint = f", a preset of {' and '.join(others)}" if others else ""
            raise ConfigError(
                "agent.preset",
                f"must be {words} for the agent {entry.id!r}, got {shown(preset)}{hint}",
            )
        defaults = entry.settings(preset)
        for name in ("approximator", "learning"):
            base = getattr(defaults, name)
            self._set(**{name: self._part(name, base, f" (agent {entry.id})")})
        self._set(agent=self.agent.replace(name=entry.id, preset=preset, **self._chosen(defaults)))
        if self.environment is None:
            self._set(approximator=changed_size(self.approximator, self.sensors.n_inputs))

    def _chosen_agent(self) -> tuple[AgentEntry, str | None]:
        """Return the agent and the preset; a name such as ``"sdnn-c-robust"`` has both."""
        word, preset = self.agent.name, self.agent.preset
        if word is None:
            word = default_agent(on_acrobot=self.environment is None)
        try:
            name, named = split_label(word)
        except ValueError as error:
            if self.environment is None or not self.environment.imported():
                raise ConfigError("agent.name", blamed(error)[1]) from None
            return self._chosen_agent()  # which the environment's module may have registered
        if named is not None and preset not in (None, named):
            raise ConfigError("agent.preset", f"must be that of {word!r}, got {shown(preset)}")
        return agent_entry(name), named or preset

    def _chosen(self, preset: Preset) -> dict[str, Any]:
        """Return what is an input: as given, or as the preset has it in environments."""
        environment, agent = self.environment, self.agent
        default = _UNUSED if environment is None else preset
        pairs = "none" if environment and environment.changes_observations else default.angle_pairs
        return {
            "angle_pairs": pairs if agent.angle_pairs is None else agent.angle_pairs,
            "inputs": default.inputs if agent.inputs is None else agent.inputs,
        }

    def _of_spaces(self) -> dict[str, Any]:
        """Return the settings for environments that are not those of the acrobot."""
        given = {name: getattr(self.agent, name) for name in _OF_SPACES}
        return {k: value for k, value in given.items() if value not in (None, getattr(_UNUSED, k))}

    def _fill_protocol(self) -> None:
        on_acrobot, environment = self.environment is None, self.environment
        protocol, budget = self.protocol, self.budget
        if protocol.evaluate_every is protocol.evaluate_every_episodes is None:
            name = "evaluate_every_episodes" if on_acrobot else "evaluate_every"
            protocol = protocol.replace(**{name: PAPER_INTERVAL if on_acrobot else 10_000})
        if protocol.evaluation_episodes is None:
            protocol = protocol.replace(evaluation_episodes=1 if on_acrobot else 10)
        if budget.steps is budget.episodes is None:
            name = "episodes" if on_acrobot else "steps"
            budget = budget.replace(**{name: PAPER_EPISODES if on_acrobot else DEFAULT_STEPS})
        self._set(protocol=protocol, budget=budget)
        if on_acrobot and protocol.n_envs > 1:
            raise ConfigError("protocol.n_envs", f"must be 1 for acrobot, got {protocol.n_envs}")
        if budget.target_return is not None and not self.is_evaluated:
            raise ConfigError(
                "budget.target_return", "needs evaluations: evaluate_every must not be 0"
            )
        if self.output.keep_best and not self.is_evaluated:
            raise ConfigError("output.keep_best", "needs evaluations: evaluate_every must not be 0")
        if self.output.keep_best and budget.steps and budget.steps < (protocol.evaluate_every or 0):
            raise ConfigError(
                "output.keep_best",
                f"needs an evaluation: budget.steps must be at least {protocol.evaluate_every}"
                f" (evaluate_every), got {budget.steps}",
            )
        every = protocol.evaluate_every_episodes
        if every is not None and budget.episodes is not None and budget.episodes < every:
            raise ConfigError(
                "budget.episodes",
                f"must be at least evaluate_every_episodes ({every}), got {budget.episodes}",
            )
        if self.agent.angle_pairs == "find" and environment and environment.changes_observations:
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
        return label_of(self.entry.id, self.agent.preset)

    @property
    def entry(self) -> AgentEntry:
        """The agent as it is registered."""
        return agent_entry(self.agent.name or "")

    @property
    def is_compiled(self) -> bool:
        """Whether the whole run can be done in C++, by `core_trial`, without the GIL."""
        return (
            self.environment is None
            and self.entry.core_trial is not None
            and self.protocol.evaluation_episodes == 1
            and self.protocol.evaluate_every_episodes is not None
            and self.budget.episodes is not None
            and self.budget.target_return is None
        )

    # What is made of it.

    def core_trial(self) -> Trial:
        """Make the trial in C++: the rows of the training loop, bit for bit.

        It releases the GIL while it advances. ValueError if a value is out of its range, or if it
        is not `is_compiled`.
        """
        entry = self.entry
        if not self.is_compiled or entry.core_trial is None:
            raise ValueError(f"{self.label} has no trial in C++ under this protocol")
        parts = {name: getattr(self, name) for name in (*ACROBOT, "approximator", "learning")}
        protocol = ProtocolConfig(
            episodes=self.budget.episodes or 0,
            evaluate_every_episodes=self.protocol.evaluate_every_episodes or 0,
            limit_bootstraps=self.protocol.limit_bootstraps,
            noisy_evaluations=self.protocol.noisy_evaluations,
        )
        trial: Trial = entry.core_trial(**parts, protocol=protocol, seed=self.seed)
        return trial

    @property
    def length(self) -> int:
        """Episodes or steps to learn, in which progress is counted."""
        return self.budget.episodes or self.budget.steps or 0

    def make_trial(self, seed: int) -> Trial | TrainingTrial:
        """Make the trial of a seed: in C++ if that can do the whole run, else a training.

        ConfigError if environment or agent cannot be made; ValueError if a value is out of range.
        """
        spec = self.replace(seed=seed)
        return spec.core_trial() if spec.is_compiled else training_trial(spec)

    def make_env(
        self, stream: Stream = "sensor_noise", *, render_mode: str | None = None
    ) -> gym.Env[Any, Any]:
        """Make an environment to learn in or, of the other stream, to be evaluated in.

        Each reset with a seed starts the sensors' noise. On the paper's acrobot it starts at the
        run's seed and runs on over episodes.

        ConfigError if it cannot be made. RunError if it can be made, but not with this render mode.

        Parameters
        ----------
        stream
            Where its sensor noise comes from.
        render_mode
            As Gymnasium has it.
        """
        is_quiet = stream == "evaluation_sensor_noise" and not self.protocol.noisy_evaluations
        if self.environment is not None:
            environment = self.environment.replace(noise=0.0) if is_quiet else self.environment
            return environment.make(stream, render_mode)
        sensors = replace(self.sensors, noise=0.0) if is_quiet else self.sensors
        env = AcrobotSwingUpEnv(config=self.acrobot, dtype="float64", render_mode=render_mode)
        tightening = TighteningGoal(env, GoalSchedule(self.goal))
        return AcrobotSensors(tightening, sensors, seed=self.seed, stream=stream)

    def make_training_env(self) -> gym.Env[Any, Any] | gym.vector.VectorEnv[Any, Any, Any]:
        """Make what the agent learns in, as `make_env`, or a vector of ``protocol.n_envs``."""
        n_envs = self.protocol.n_envs
        return (
            self.make_env() if n_envs == 1 else gym.vector.SyncVectorEnv([self.make_env] * n_envs)
        )

    def make_agent(self, env: gym.Env[Any, Any]) -> Learner:
        """Make the agent for an environment such as `make_env` makes.

        ConfigError if a setting is out of its range, or the agent cannot work with the spaces.
        """
        entry = self.entry
        approximator = self.approximator
        shape = env.observation_space.shape
        is_own = _is_kind_of(entry.agent, Agent)
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
            raise self.refusal(error) from error
        if isinstance(agent, Agent) and self.environment is not None:
            agent.scaling = self.environment.scaling(env)
        return agent

    def _agent_options(self, env: gym.Env[Any, Any]) -> dict[str, Any]:
        """Return the arguments that only some agents have: those that are not the default."""
        given, environment = self._of_spaces(), self.environment
        if _is_kind_of(self.entry.agent, CodedAgent):  # by its preset
            given |= {"angle_pairs": self.agent.angle_pairs, "inputs": self.agent.inputs}
        if environment is None or not environment.ranges:
            return given
        if environment.has_other_sensors:  # given ranges are the space's then
            return {"observation_range": flat_bounds(env.observation_space), **given}
        if "observation_range" in given:
            raise ConfigError(
                "environment.ranges", "must not be given together with adaptive ranges"
            )
        return {**given, "observation_range": environment.ends(env)}

    def refusal(self, error: Exception) -> ConfigError:
        """Return an error as one about the setting that it names, or about the task."""
        if isinstance(error, ConfigError):
            return error
        name, problem = blamed(error)
        tables = ("approximator", "learning", "agent", *(ACROBOT if self.acrobot else ()))
        for table in tables:
            if name != "n_inputs" and name in names_of(type(getattr(self, table))):
                return ConfigError(f"{table}.{name}", problem)
        key = "environment.id" if self.environment is not None else "agent.name"
        return ConfigError(key, str(error) or type(error).__name__)

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
        values: dict[str, Any] = msgspec.to_builtins(self)
        values = {name: value for name, value in values.items() if value is not None}
        values["approximator"].pop("n_inputs", None)
        return values

    @classmethod
    def from_values(cls, values: Mapping[str, Any]) -> RunSpec:
        """Make it of values as JSON or TOML has them.

        ``environment`` may be the id of one, and ``agent`` the name of one, perhaps with a preset:
        ``"sdnn-c-robust"``.

        ConfigError if a key is unknown or missing, or a value cannot be used.
        """
        return read(cls, values)

    def canonical_json(self) -> str:
        """Return what fixes the rows but the seed, as one line of JSON: sorted keys, 1 for 1.0.

        Presets are resolved, so equal settings give equal text however they were typed. With the
        agent's version, where its entry has one.
        """
        values = self.full_values()
        for name in ("seed", "output"):
            del values[name]
        values["agent"].pop("preset")
        # As in trials from before there was a choice.
        if values["agent"]["inputs"] == "all":
            del values["agent"]["inputs"]
        if values["agent"]["missing"] == "error":
            del values["agent"]["missing"]
        if values.get("approximator", {}).get("weight_limit") == 0:
            del values["approximator"]["weight_limit"]
        if not values.get("environment", {}).get("action_masks", True):
            del values["environment"]["action_masks"]
        if version := self.entry.version:
            values["agent"]["version"] = version
        return json.dumps(
            _canonical(values), sort_keys=True, separators=(",", ":"), allow_nan=False
        )

    @property
    def config_hash(self) -> str:
        """First 16 hexadecimal digits of the SHA-256 of `canonical_json`."""
        return hashlib.sha256(self.canonical_json().encode()).hexdigest()[:HASH_DIGITS]


def changed_size(approximator: Any, n_inputs: int) -> Any:
    """Return the settings of an approximator with a number of inputs, if it has that field."""
    if "n_inputs" not in names_of(type(approximator)):
        return approximator
    return replace(approximator, n_inputs=n_inputs)


def _is_kind_of(agent: Any, kind: type[Any]) -> bool:
    return isinstance(agent, type) and issubclass(agent, kind)


def _canonical(value: Any) -> Any:
    if isinstance(value, Mapping):
        return {str(key): _canonical(item) for key, item in value.items()}
    if isinstance(value, list | tuple):
        return [_canonical(item) for item in value]
    if isinstance(value, float) and value.is_integer():
        return int(value)
    return value
