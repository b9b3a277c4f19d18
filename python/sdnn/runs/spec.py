"""The specification of a run: all that fixes its rows, declared once."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from contextlib import ExitStack, closing
from pathlib import Path
from typing import Annotated

import msgspec
from gymnasium.vector import SyncVectorEnv
from msgspec import Meta

from sdnn.agents import Agent, Callback, StopTrainingOnRewardThreshold, Training
from sdnn.agents.q_learning import ValueAgent
from sdnn.agents.registry import AGENTS, AgentEntry, agent_entry, label_of, split_label
from sdnn.config import ProtocolConfig
from sdnn.environments.sensors import NoiseStream
from sdnn.environments.space_kinds import flat_bounds
from sdnn.environments.types import Env
from sdnn.runs.environment import (
    EnvironmentSpec,
    SeedFirstReset,
    episode_option,
    has_episode_option,
)
from sdnn.runs.errors import ConfigError
from sdnn.runs.settings import (
    DEFAULT_AGENT,
    SHORTHANDS,
    AgentSpec,
    BudgetSpec,
    OutputSpec,
    PartSettings,
    PresetSettings,
    ProtocolSpec,
    Settings,
    Values,
    differences,
    doc,
    names_of,
    read_table,
    with_changes,
    with_n_inputs,
)
from sdnn.runs.trial import TrainingTrial, Trial, canonical_json, config_hash
from sdnn.support.arguments import blamed, shown
from sdnn.training.interfaces import Learner

DEFAULT_STEPS, DEFAULT_INTERVAL = 200_000, 10_000

_ALWAYS = ("id", "name", "preset", "steps", "episodes")
"""Settings that are written even if they have the default value."""

_OPTIONAL = (
    "observation_range", "angles", "angle_pairs", "inputs", "warm_up_steps", "missing", "history",
)  # fmt: skip
"""Settings of `AgentSpec` that are arguments of an agent where they are not the default."""


class RunSpec(Settings, frozen=True):
    """Everything that fixes the rows of a run, and what is written of it.

    Missing settings are filled in; those of the agent's parts, ``approximator`` and ``learning``,
    follow from its preset. Each of the two may be a mapping of the settings that differ.
    ``approximator.n_inputs`` follows from the observations.

    ConfigError if a value cannot be used; ``key`` names it, with dots between tables.

    Examples
    --------
    >>> spec = RunSpec(environment=EnvironmentSpec(id="CartPole-v1"), seed=3)
    >>> spec.budget.steps, spec.agent.name, spec.agent.preset
    (200000, 'q-lambda', 'general')
    >>> spec = RunSpec.from_values({"environment": "CartPole-v1", "learning": {"epsilon": 0.2}})
    >>> spec.learning.epsilon
    0.2
    """

    environment: Annotated[EnvironmentSpec, doc("The task: an environment of Gymnasium.")]
    agent: Annotated[AgentSpec, doc("Who learns.")] = AgentSpec()
    approximator: Annotated[PartSettings, doc("What the agent learns with.")] = PresetSettings()
    learning: Annotated[PartSettings, doc("How the agent learns and explores.")] = PresetSettings()
    protocol: Annotated[ProtocolSpec, doc("How it is evaluated.")] = ProtocolSpec()
    budget: Annotated[BudgetSpec, doc("How long it learns.")] = BudgetSpec()
    seed: Annotated[int, Meta(ge=0), doc("Root of all seeds, at most 2**64 - 1.")] = 0
    output: Annotated[OutputSpec, doc("What is written besides the rows.")] = OutputSpec()

    def __post_init__(self) -> None:
        """Replace shorthands by tables, check all values, and fill in those that are missing."""
        for name, key in SHORTHANDS.items():
            if isinstance(value := getattr(self, name), str):
                self._set(**{name: {key: value}})
        super().__post_init__()
        if self.seed >= 2**64:
            raise ConfigError("seed", f"must be at most 2**64 - 1, got {shown(self.seed)}")
        self._fill_agent()
        self._fill_protocol()
        self._require_consistency()

    def _set(self, **values: object) -> None:
        """Set fields of this frozen object while it is made."""
        for name, value in values.items():
            msgspec.structs.force_setattr(self, name, value)

    def _fill_agent(self) -> None:
        """Set the agent's settings that are missing: those of its preset, or its defaults."""
        entry, preset = self._chosen_agent()
        if preset is None and entry.presets:
            preset = "general"
        if preset is not None and preset not in entry.presets:
            raise _unknown_preset(entry, preset)
        defaults = entry.settings(preset)
        hint = f" (agent {entry.id})"
        for name in ("approximator", "learning"):
            base: PartSettings = getattr(defaults, name)
            value: object = getattr(self, name)
            is_preset = value is None or isinstance(value, PresetSettings)
            self._set(**{name: base if is_preset else with_changes(base, value, name, hint)})
        agent, is_scaled = self.agent, self.environment.changes_observations
        agent_defaults = {
            # Cosine and sine, each scaled to [0, 1] by itself, are no longer on a circle.
            "angle_pairs": "none" if is_scaled else defaults.angle_pairs,
            "inputs": defaults.inputs,
            "history": "none" if agent.missing == "code" else defaults.history,
        }
        missing = {
            name: value for name, value in agent_defaults.items() if getattr(agent, name) is None
        }
        self._set(agent=agent.replace(name=entry.id, preset=preset, **missing))

    def _chosen_agent(self) -> tuple[AgentEntry, str | None]:
        """Return the agent's entry and preset; a name such as ``"sdnn-c-robust"`` has both."""
        label, preset = self.agent.name or DEFAULT_AGENT, self.agent.preset
        try:
            name, preset_in_label = split_label(label)
        except ValueError as error:
            if not self.environment.import_module():
                raise ConfigError("agent.name", blamed(error)[1]) from None
            return self._chosen_agent()  # the environment's module may have registered the agent
        if preset_in_label is not None and preset not in (None, preset_in_label):
            raise ConfigError("agent.preset", f"must be that of {label!r}, got {shown(preset)}")
        return agent_entry(name), preset_in_label or preset

    def _fill_protocol(self) -> None:
        """Set interval of evaluations and budget if they are missing."""
        protocol, budget = self.protocol, self.budget
        if protocol.evaluate_every is None and protocol.evaluate_every_episodes is None:
            protocol = protocol.replace(evaluate_every=DEFAULT_INTERVAL)
        if budget.steps is None and budget.episodes is None:
            budget = budget.replace(steps=DEFAULT_STEPS)
        self._set(protocol=protocol, budget=budget)

    def _require_consistency(self) -> None:
        """Raise ConfigError if settings of several tables do not go together."""
        protocol, budget = self.protocol, self.budget
        every, keep_best = protocol.evaluate_every, self.output.keep_best
        if not self.is_evaluated and (budget.target_return is not None or keep_best):
            key = "output.keep_best" if keep_best else "budget.target_return"
            raise ConfigError(key, "needs evaluations: evaluate_every must not be 0")
        if keep_best and budget.steps and budget.steps < (every or 0):
            problem = f"budget.steps must be at least {every} (evaluate_every), got {budget.steps}"
            raise ConfigError("output.keep_best", f"needs an evaluation: {problem}")
        every = protocol.evaluate_every_episodes
        if every is not None and budget.episodes is not None and budget.episodes < every:
            problem = f"must be at least evaluate_every_episodes ({every}), got {budget.episodes}"
            raise ConfigError("budget.episodes", problem)
        if self.agent.angle_pairs == "find" and self.environment.changes_observations:
            problem = "finds no angles in scaled observations: not together with noise or redundant"
            raise ConfigError("agent.angle_pairs", problem)

    def __hash__(self) -> int:
        return hash((self.canonical_json(), self.seed, self.output))

    @property
    def is_evaluated(self) -> bool:
        """Whether there are evaluations."""
        return bool(self.protocol.evaluate_every or self.protocol.evaluate_every_episodes)

    @property
    def task(self) -> str:
        """The environment's id."""
        return self.environment.id

    @property
    def label(self) -> str:
        """The agent for a reader: ``"sdnn-c"``, with a preset ``"sdnn-c-robust"``."""
        return label_of(self.entry.id, self.agent.preset)

    @property
    def entry(self) -> AgentEntry:
        """The agent's entry in the registry."""
        return agent_entry(self.agent.name or "")

    @property
    def is_compiled(self) -> bool:
        """Whether the whole run can be done in C++, by `core_trial`, without the GIL."""
        protocol = self.protocol
        return (
            self.entry.core_trial is not None
            and self.environment.is_plain_paper_acrobot
            # Without a warm-up history="auto" means none.
            and self._optional_settings().items() <= {("history", "auto")}
            and (protocol.n_envs, protocol.evaluation_episodes) == (1, 1)
            and protocol.evaluate_every_episodes is not None
            and not protocol.seeded_episodes
            and self.budget.episodes is not None
            and self.budget.target_return is None
        )

    def core_settings(self) -> dict[str, object]:
        """Return the settings of the trial in C++ that are not its protocol, by their names."""
        paper = self.environment.paper_settings()
        return {
            **paper._asdict(),
            "approximator": with_n_inputs(self.approximator, paper.sensors.n_inputs),
            "learning": self.learning,
        }

    def core_trial(self) -> Trial:
        """Make the trial in C++, whose rows equal those of the training loop bit for bit.

        It releases the GIL while it advances. ValueError if a value is out of its range, or if it
        is not `is_compiled`.
        """
        make = self.entry.core_trial
        if not self.is_compiled or make is None:
            raise ValueError(f"{self.label} has no trial in C++ under this protocol")
        protocol = ProtocolConfig(
            episodes=self.budget.episodes or 0,
            evaluate_every_episodes=self.protocol.evaluate_every_episodes or 0,
            limit_bootstraps=self.protocol.limit_bootstraps,
            noisy_evaluations=self.protocol.noisy_evaluations,
        )
        trial: Trial = make(**self.core_settings(), protocol=protocol, seed=self.seed)
        return trial

    @property
    def length(self) -> int:
        """Episodes or steps to learn, in which progress is counted."""
        return self.budget.episodes or self.budget.steps or 0

    def make_trial(self, seed: int) -> Trial | TrainingTrial:
        """Make the trial of a seed: in C++ if `is_compiled`, else a training in Python.

        ConfigError if environment or agent cannot be made; ValueError if a value is out of range.
        """
        spec = self.replace(seed=seed)
        return spec.core_trial() if spec.is_compiled else spec.make_training()

    def make_training(
        self,
        callbacks: Iterable[Callback] = (),
        checkpoint: Path | None = None,
        *,
        repeat_episodes: bool = True,
    ) -> TrainingTrial:
        """Make the trial in Python: a training with its environments.

        It resumes at the checkpoint, if there is one; see `sdnn.agents.Training.load`. ConfigError
        if a part cannot be made.
        """
        budget, protocol = self.budget, self.protocol
        target, evaluation_env = None, None
        if budget.target_return is not None:
            target = StopTrainingOnRewardThreshold(budget.target_return)
            callbacks = (target, *callbacks)
        with ExitStack() as environments:
            env = environments.enter_context(closing(self.make_training_env()))
            if self.is_evaluated:
                try:
                    evaluation_env = self.make_env("evaluation_sensor_noise")
                except ConfigError as error:  # a robot has no second environment for evaluations
                    problem = f"needs a second environment, or must be 0: {error.problem}"
                    raise ConfigError("protocol.evaluate_every", problem) from error
                environments.callback(evaluation_env.close)
            single: Env = env.envs[0] if isinstance(env, SyncVectorEnv) else env
            options = episode_option if has_episode_option(single) else None
            if options is not None and protocol.n_envs > 1:
                problem = f"must be 1: resets of {self.task} take the number of the episode"
                raise ConfigError("protocol.n_envs", f"{problem}, got {protocol.n_envs}")
            if checkpoint is not None:
                training = Training.load(
                    checkpoint, env, callbacks=callbacks, evaluation_env=evaluation_env,
                    repeat_episodes=repeat_episodes, reset_options=options,
                )  # fmt: skip
            else:
                training = self.entry.training(
                    self.make_agent(single),
                    env,
                    steps=budget.steps,
                    episodes=budget.episodes,
                    seed=self.seed if protocol.seeded_episodes else None,
                    callbacks=callbacks,
                    evaluate_every=protocol.evaluate_every or None,
                    evaluate_every_episodes=protocol.evaluate_every_episodes,
                    evaluation_env=evaluation_env,
                    evaluation_episodes=protocol.evaluation_episodes,
                    limit_bootstraps=protocol.limit_bootstraps,
                    reset_options=options,
                )
            return TrainingTrial(training, environments.pop_all(), target)

    def make_env(
        self, stream: NoiseStream = "sensor_noise", *, render_mode: str | None = None
    ) -> Env:
        """Make an environment to learn in or, of the other stream of noise, to be evaluated in.

        Each reset with a seed starts the sensors' noise. Where episodes have no seeds, the first
        reset has the run's.

        ConfigError if it cannot be made. RunError if it can be made, but not with this render mode.
        """
        environment = self.environment
        if stream == "evaluation_sensor_noise" and not self.protocol.noisy_evaluations:
            environment = environment.without_noise()
        env = environment.make(stream, render_mode)
        return env if self.protocol.seeded_episodes else SeedFirstReset(env, self.seed)

    def make_training_env(self) -> Env | SyncVectorEnv:
        """Make the environment to learn in, or a vector of ``protocol.n_envs`` environments."""
        n_envs = self.protocol.n_envs
        return self.make_env() if n_envs == 1 else SyncVectorEnv([self.make_env] * n_envs)

    def make_agent(self, env: Env) -> Learner:
        """Make the agent for an environment such as `make_env` makes.

        ConfigError if a setting is out of its range, or the agent cannot work with the spaces.
        """
        entry = self.entry
        approximator = self.approximator
        shape = env.observation_space.shape
        if not _is_class_of(entry.agent, Agent) and shape is not None and len(shape) == 1:
            approximator = with_n_inputs(approximator, shape[0])  # others count inputs themselves
        try:
            agent = entry.agent(
                env.observation_space,
                env.action_space,
                approximator=approximator,
                learning=self.learning,
                seed=self.seed,
                **self._agent_arguments(env),
            )
        except (TypeError, ValueError, OverflowError, MemoryError) as error:
            raise self.refusal(error) from error
        if isinstance(agent, Agent):
            agent.scaling = self.environment.scaling(env)
        return agent

    def _optional_settings(self) -> dict[str, object]:
        """Return the settings that only some agents have, as far as they are not the default."""
        values = {name: getattr(self.agent, name) for name in _OPTIONAL}
        defaults = AgentSpec(angle_pairs="none", inputs="all", history="none")
        return {name: value for name, value in values.items() if value != getattr(defaults, name)}

    def _agent_arguments(self, env: Env) -> dict[str, object]:
        """Return the arguments that only some agents have: those that are not the default."""
        arguments, environment = self._optional_settings(), self.environment
        if _is_class_of(self.entry.agent, ValueAgent) and self.entry.presets:
            # Without these arguments the agent would take the defaults of its own preset.
            names = ("angle_pairs", "inputs", "history")
            arguments |= {name: getattr(self.agent, name) for name in names}
        if not environment.ranges:
            return arguments
        if environment.has_other_sensors:  # the ranges are then the bounds of the space
            return {"observation_range": flat_bounds(env.observation_space), **arguments}
        if "observation_range" in arguments:
            problem = "must not be given together with agent.observation_range"
            raise ConfigError("environment.ranges", problem)
        return {**arguments, "observation_range": environment.ends(env)}

    def refusal(self, error: Exception) -> ConfigError:
        """Convert an error to a ConfigError about the setting that it names, or about the task."""
        if isinstance(error, ConfigError):
            return error
        name, problem = blamed(error)
        for table in ("approximator", "learning", "agent"):
            if name != "n_inputs" and name in names_of(type(getattr(self, table))):
                return ConfigError(f"{table}.{name}", problem)
        if key := self.environment.key_of(name):
            return ConfigError(key, problem)
        return ConfigError("environment.id", str(error) or type(error).__name__)

    def values(self) -> Values:
        """Return the values that differ from the defaults, for JSON; `from_values` reads them.

        Settings of the agent's parts are compared with its preset.
        """
        defaults = RunSpec(
            environment=EnvironmentSpec(id=self.task),
            agent=AgentSpec(name=self.agent.name, preset=self.agent.preset),
        )
        values = differences(self.full_values(), defaults.full_values(), _ALWAYS)
        for name in ("agent", "budget", "protocol"):  # None: the value follows from others
            table = values.get(name, {})
            values[name] = {key: value for key, value in table.items() if value is not None}
        return {name: value for name, value in values.items() if value != {}}

    def full_values(self) -> Values:
        """Return all values, for JSON."""
        values: Values = msgspec.to_builtins(self)
        values["approximator"].pop("n_inputs", None)
        return values

    @classmethod
    def from_values(cls, values: Mapping[str, object]) -> RunSpec:
        """Make a specification from values of JSON or TOML.

        ``environment`` may be the id of one, and ``agent`` the name of one, perhaps with a preset:
        ``"sdnn-c-robust"``.

        ConfigError if a key is unknown or missing, or a value cannot be used.
        """
        return read_table(cls, values)

    def canonical_json(self) -> str:
        """Return all settings that fix the rows, except the seed, as one line of JSON.

        Presets are resolved and keys sorted, so equal settings give equal text however they were
        typed. The text includes the version of the agent's entry, if any.
        """
        values = self.full_values()
        del values["seed"], values["output"], values["agent"]["preset"]
        if self.agent.history == "none":  # keeps the text of versions without this setting
            del values["agent"]["history"]
        if version := self.entry.version:
            values["agent"]["version"] = version
        return canonical_json(values)

    @property
    def config_hash(self) -> str:
        """First 16 hexadecimal digits of the SHA-256 of `canonical_json`."""
        return config_hash(self.canonical_json())


def _unknown_preset(entry: AgentEntry, preset: str) -> ConfigError:
    """Return the error about a preset that an agent lacks; it names the agents that have it."""
    names = ", ".join(map(repr, entry.presets))
    expected = f"{f'one of {names}' if names else 'omitted'} for the agent {entry.id!r}"
    others = [other.id for other in AGENTS.values() if preset in other.presets]
    hint = f", a preset of {' and '.join(others)}" if others else ""
    return ConfigError("agent.preset", f"must be {expected}, got {shown(preset)}{hint}")


def _is_class_of(agent: object, ancestor: type[object]) -> bool:
    """Return whether an entry's agent is a subclass; it may also be a function that makes one."""
    return isinstance(agent, type) and issubclass(agent, ancestor)
