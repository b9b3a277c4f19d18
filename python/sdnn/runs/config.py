"""All that defines a run, and how it is read from files."""

from __future__ import annotations

import dataclasses
import hashlib
import json
import re
import sys
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import gymnasium as gym

from sdnn._core import __version__
from sdnn.agents import (
    PRESETS,
    Agent,
    FuzzyQLearning,
    FuzzyQLearningConfig,
    QLearningConfig,
    RBFQLearning,
    SDNNQLearning,
)
from sdnn.arguments import whole
from sdnn.config import FuzzyRulesConfig, RBFNetworkConfig, SDNNCConfig
from sdnn.runs.environment import EnvironmentSpec
from sdnn.runs.errors import ConfigError, problem_of
from sdnn.runs.settings import kinds_of, values_of
from sdnn.runs.settings import read as read_settings
from sdnn.toml_lines import key_lines, line_of
from sdnn.typed_values import convert, hints_of, possible_words, words_of

if sys.version_info >= (3, 11):
    import tomllib
else:
    import tomli as tomllib

__all__ = ["AGENTS", "DEFAULT_STEPS", "RunConfig", "places_in", "read_json", "read_values"]

FORMAT = "sdnn-run-2"

DEFAULT_STEPS = 200_000

AGENTS: Mapping[str, tuple[type[Agent[Any, Any]], type[Any], type[Any]]] = {
    "sdnn-c": (SDNNQLearning, SDNNCConfig, QLearningConfig),
    "rbf": (RBFQLearning, RBFNetworkConfig, QLearningConfig),
    "fuzzy": (FuzzyQLearning, FuzzyRulesConfig, FuzzyQLearningConfig),
}
"""Agents by their names, with the dataclasses of ``approximator`` and ``learning``."""

DEFAULT_PRESET = "general"

Settings = Mapping[str, Mapping[str, Any]]

_WHOLE = {
    "steps": (1, 2**53),
    "episodes": (1, 2**53),
    "seed": (0, 2**64 - 1),
    "n_envs": (1, 4096),
    "evaluate_every": (0, 2**53),
    "evaluation_episodes": (1, 10**9),
    "checkpoint_every": (1, 2**53),
}


@dataclass(frozen=True, kw_only=True)
class _AgentSettings:
    """Arguments of the agents beside those of their parts."""

    warm_up_steps: int = 1000
    angles: tuple[int, ...] = ()
    observation_range: Literal["seen"] | None = None


@dataclass(frozen=True, kw_only=True)
class RunConfig:
    """Everything that defines a run.

    Parameters
    ----------
    environment
        The task.
    agent
        A key of `AGENTS`.
    preset
        A key of `sdnn.agents.PRESETS`, for the agent ``"sdnn-c"`` only; None: ``"general"`` for it.
    settings
        What differs from the preset, or from the agent's defaults: tables ``"approximator"``,
        ``"learning"`` and ``"agent"`` (``warm_up_steps``, ``angles``, ``observation_range``) of
        settings by their names.
    steps, episodes
        How long it learns: one of them; by default 200,000 steps.
    seed
        Root of all seeds, 0 to 2**64 - 1.
    n_envs
        Environments that the agent learns in, in turn; steps are counted over all of them.
    evaluate_every
        Steps between evaluations; 0: none.
    evaluation_episodes
        Greedy episodes in each.
    checkpoint_every
        Steps between checkpoints.
    target_return
        Stop as soon as an evaluation has this mean return; None: never.
    angle_pairs
        ``"find"``: variables that are cosine and sine of an angle become one input.
    tensorboard
        Write the numbers for TensorBoard, too.
    version
        Of the library that began the run.

    Raises
    ------
    ConfigError
        If a value cannot be used; ``key`` says which.

    Examples
    --------
    >>> config = RunConfig(environment=EnvironmentSpec(id="CartPole-v1"), seed=3)
    >>> config.steps, config.preset
    (200000, 'general')
    """

    environment: EnvironmentSpec
    agent: str = "sdnn-c"
    preset: str | None = None
    settings: Settings = field(default_factory=dict)
    steps: int | None = None
    episodes: int | None = None
    seed: int = 0
    n_envs: int = 1
    evaluate_every: int = 10_000
    evaluation_episodes: int = 10
    checkpoint_every: int = 10_000
    target_return: float | None = None
    angle_pairs: Literal["none", "find"] = "none"
    tensorboard: bool = False
    version: str = __version__

    def __post_init__(self) -> None:
        if self.agent not in AGENTS:
            raise ConfigError("agent", f"must be one of {_listed(AGENTS)}, got {self.agent!r}")
        if self.agent != "sdnn-c" and self.preset is not None:
            raise ConfigError("preset", f"is for the agent 'sdnn-c' only, got {self.agent!r}")
        if self.agent == "sdnn-c" and self.preset is None:
            object.__setattr__(self, "preset", DEFAULT_PRESET)
        if self.preset is not None and self.preset not in PRESETS:
            raise ConfigError("preset", f"must be one of {_listed(PRESETS)}, got {self.preset!r}")
        if self.steps is not None and self.episodes is not None:
            raise ConfigError("episodes", "must not be given together with steps")
        if self.steps is None and self.episodes is None:
            object.__setattr__(self, "steps", DEFAULT_STEPS)
        for name, (low, high) in _WHOLE.items():
            value = getattr(self, name)
            try:
                if value is not None:
                    whole(name, value, low, high)
            except ValueError as error:
                raise ConfigError(name, problem_of(error)) from None
        if self.target_return is not None and not self.evaluate_every:
            raise ConfigError("target_return", "needs evaluations: evaluate_every must not be 0")
        if self.angle_pairs == "find" and self.environment.changes_observations:
            raise ConfigError(
                "angle_pairs",
                "finds no angles in scaled observations: not together with noise or redundant",
            )
        object.__setattr__(self, "settings", self._checked_settings())

    def canonical_json(self) -> str:
        """Return what defines the run but its seed and output, as one line of JSON."""
        values = self.values()
        for name in ("seed", "checkpoint_every", "tensorboard", "version"):
            values.pop(name, None)
        return json.dumps(values, sort_keys=True, separators=(",", ":"))

    @property
    def config_hash(self) -> str:
        """First 16 hexadecimal digits of the SHA-256 of `canonical_json`."""
        return hashlib.sha256(self.canonical_json().encode()).hexdigest()[:16]

    @property
    def warm_up_steps(self) -> int:
        """Steps that an agent acts at random first where it has to see its ranges."""
        of_agent = self.settings.get("agent", {})
        return int(of_agent.get("warm_up_steps", _AgentSettings.warm_up_steps))

    def _checked_settings(self) -> Settings:
        _, approximator, learning = AGENTS[self.agent]
        kinds = {"approximator": approximator, "learning": learning, "agent": _AgentSettings}
        checked: dict[str, dict[str, Any]] = {}
        for section, values in self.settings.items():
            if section not in kinds:
                raise ConfigError(
                    f"settings.{section}", f"unknown section; {possible_words(section, kinds)}"
                )
            if not isinstance(values, Mapping):
                raise ConfigError(f"settings.{section}", f"must be a table, got {words_of(values)}")
            hints = hints_of(kinds[section])
            checked[section] = {}
            for name, value in values.items():
                key = f"settings.{section}.{name}"
                if (section, name) == ("approximator", "n_inputs"):
                    raise ConfigError(key, "follows from the observations: omit it")
                if name not in hints:
                    possible = (hint for hint in hints if hint != "n_inputs")
                    raise ConfigError(key, f"unknown setting; {possible_words(name, possible)}")
                try:
                    plain = list(value) if isinstance(value, tuple) else value
                    checked[section][name] = convert(hints[name], plain)
                except ValueError as error:
                    raise ConfigError(key, str(error)) from None
        return {section: values for section, values in checked.items() if values}

    # What is made of it.

    def make_training_env(self) -> gym.Env[Any, Any] | gym.vector.VectorEnv[Any, Any, Any]:
        """Make what the agent learns in: an environment, or a vector of `n_envs`.

        Raises
        ------
        ConfigError
            As `EnvironmentSpec.make`; or if Gymnasium is too old for a vector.
        """
        if self.n_envs == 1:
            return self.environment.make()
        if not hasattr(gym.vector, "AutoresetMode"):
            raise ConfigError("n_envs", f"needs Gymnasium 1.1 or newer, this is {gym.__version__}")
        return gym.vector.SyncVectorEnv([self.environment.make] * self.n_envs)

    def make_agent(self, env: gym.Env[Any, Any]) -> Agent[Any, Any]:
        """Make the agent for an environment such as `environment` makes.

        Raises
        ------
        ConfigError
            If a setting is out of its range, or the agent cannot work with the spaces.
        """
        kind, approximator, learning = AGENTS[self.agent]
        parts = {"approximator": approximator(), "learning": learning()}
        if self.preset is not None:
            preset = PRESETS[self.preset]
            parts = {"approximator": preset.approximator, "learning": preset.learning}
        given: dict[str, Any] = {}
        for name, part in parts.items():
            try:
                given[name] = part.replace(**self.settings.get(name, {}))
            except (TypeError, ValueError) as error:
                raise ConfigError(self._key_of(str(error)), str(error)) from error
        given |= self.settings.get("agent", {})
        if self.environment.ranges and not self.environment.changes_observations:
            if "observation_range" in given:
                raise ConfigError(
                    "environment.ranges", "must not be given together with ranges that are seen"
                )
            given["observation_range"] = self.environment.ends(env)
        try:
            agent = kind(
                env.observation_space,
                env.action_space,
                seed=self.seed,
                angle_pairs=self.angle_pairs,
                **given,
            )
        except (TypeError, ValueError, OverflowError, MemoryError) as error:
            raise ConfigError(self._key_of(str(error)), str(error)) from error
        agent.scaling = self.environment.scaling(env)
        return agent

    def _key_of(self, message: str) -> str:
        """Find the setting that a message is about; else the environment, whose spaces are."""
        words = re.findall(r"\w+", message)
        _, approximator, learning = AGENTS[self.agent]
        given = [(section, name) for section, values in self.settings.items() for name in values]
        for kind, section in ((approximator, "approximator"), (learning, "learning")):
            given += [(section, name) for name in kinds_of(kind)]
        given = [one for one in given if one != ("approximator", "n_inputs")]  # not a setting
        keys = [f"settings.{section}.{name}" for section, name in given if name in words]
        return keys[0] if keys else "environment.id"

    # Files.

    def values(self) -> dict[str, Any]:
        """Give all values as JSON has them; `from_values` reads them."""
        values = {**dataclasses.asdict(self), "environment": values_of(self.environment)}
        return {
            "format": FORMAT,
            **{name: value for name, value in values.items() if value is not None},
        }

    @classmethod
    def from_values(cls, values: Mapping[str, Any]) -> RunConfig:
        """Make it of values as JSON or TOML has them.

        Raises
        ------
        ConfigError
            If a key is unknown or missing, or a value cannot be used.
        """
        given = {name: value for name, value in values.items() if value is not None}
        _check_format(given.pop("format", FORMAT))
        environment = given.pop("environment", None)
        if environment is None:
            raise ConfigError("environment", "must be given: the id of an environment")
        if isinstance(environment, str):
            environment = {"id": environment}
        settings = given.pop("settings", {})
        read = _converted(cls, given, "")
        place = read_settings(EnvironmentSpec, environment, "environment")
        if not isinstance(settings, Mapping):
            raise ConfigError("settings", f"must be a table, got {words_of(settings)}")
        return cls(environment=place, settings=settings, **read)

    @classmethod
    def read(cls, path: str | Path, environment_id: str | None = None) -> RunConfig:
        """Read it from a JSON or TOML file, by its name's end.

        Parameters
        ----------
        path
            The file.
        environment_id
            Takes the place of that of the file, which then may have none.

        Raises
        ------
        ConfigError
            As `from_values`; the message names file, line (of TOML) and key.
        """
        values, lines = read_values(Path(path))
        values.pop("goals", None)
        if environment_id is not None:
            environment = values.get("environment", {})
            of_file = {"id": environment} if isinstance(environment, str) else environment
            if isinstance(of_file, dict):
                values["environment"] = {**of_file, "id": environment_id}
        try:
            return cls.from_values(values)
        except ConfigError as error:
            raise ConfigError(error.key, error.problem, place_of(path, lines, error.key)) from error


def read_values(path: Path) -> tuple[dict[str, Any], dict[Any, int]]:
    """Read a JSON or TOML file: its values, and of TOML the lines of its keys.

    Raises
    ------
    ConfigError
        If it cannot be read or is something else.
    """
    if path.suffix != ".toml":
        return read_json(path), {}
    try:
        text = path.read_bytes().decode()
        return tomllib.loads(text), key_lines(text)
    except OSError as error:
        raise ConfigError("", error.strerror or str(error), str(path)) from error
    except ValueError as error:
        line = re.search(r"at line (\d+)", str(error))
        place = f"{path}:{line[1]}" if line else str(path)
        raise ConfigError("", f"must be TOML: {error}", place) from error


def places_in(path: Path) -> dict[str, str]:
    """Say where each value of a file stands, by its key: the file, and the line in TOML.

    Raises
    ------
    ConfigError
        If it cannot be read or is something else.
    """
    values, lines = read_values(path)
    return {key: place_of(path, lines, key) for key in _keys_of(values)}


def _keys_of(values: Mapping[str, Any], table: str = "") -> Iterator[str]:
    """List the keys of values, with dots between tables."""
    for name, value in values.items():
        if isinstance(value, Mapping) and value:
            yield from _keys_of(value, f"{table}{name}.")
        else:
            yield table + name


def read_json(path: Path) -> dict[str, Any]:
    """Read a JSON file that holds a table; ConfigError if it is something else."""
    try:
        values = json.loads(path.read_bytes())
    except OSError as error:
        raise ConfigError("", error.strerror or str(error), str(path)) from error
    except ValueError as error:
        raise ConfigError("", f"must be JSON: {error}", str(path)) from error
    if not isinstance(values, dict):
        raise ConfigError("", f"must hold a table, got {words_of(values)}", str(path))
    return values


def place_of(path: str | Path, lines: dict[Any, int], key: str) -> str:
    """Say where a key stands in a file, as well as it is known."""
    line = line_of(lines, tuple(key.split(".")))
    return str(path) if line is None else f"{path}:{line}"


def _check_format(name: Any) -> None:
    if name != FORMAT:
        raise ConfigError(
            "format", f"must be {FORMAT}, got {name!r}: the run is of another version of sdnn"
        )


def _converted(kind: type[Any], values: Any, where: str) -> dict[str, Any]:
    """Convert values to the types of a dataclass's fields; ConfigError with the key."""
    if not isinstance(values, Mapping):
        raise ConfigError(where, f"must be a table, got {words_of(values)}")
    hints = hints_of(kind)
    possible = [one.name for one in dataclasses.fields(kind)]
    converted = {}
    for name, value in values.items():
        key = f"{where}.{name}" if where else name
        if name not in possible:
            raise ConfigError(key, f"unknown key; {possible_words(name, possible)}")
        try:
            converted[name] = convert(hints[name], value)
        except ValueError as error:
            raise ConfigError(key, str(error)) from None
    return converted


def _listed(words: Mapping[str, Any]) -> str:
    return ", ".join(map(repr, words))
