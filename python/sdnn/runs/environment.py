"""The environment of a run: any of Gymnasium's, with noisy and redundant sensors."""

from __future__ import annotations

import importlib.util
import json
import sys
from contextlib import closing
from functools import partial
from pathlib import Path
from typing import Annotated, Any, NamedTuple

import gymnasium as gym
import msgspec
import numpy as np
from msgspec import Meta
from numpy.typing import NDArray

from sdnn.agents.scaling import Scaling, neighbours
from sdnn.config import values_of
from sdnn.environments import (
    AcrobotConfig,
    ActionMasks,
    GoalScheduleConfig,
    NoisySensors,
    RedundantSensors,
    SensorConfig,
    UnitSensors,
)
from sdnn.environments.paper_acrobot import PAPER_ACROBOT
from sdnn.environments.sensors import NoiseStream, in_own_units
from sdnn.environments.space_kinds import flat_bounds
from sdnn.environments.types import Array, Data, Env
from sdnn.runs.errors import ConfigError, RunError
from sdnn.runs.settings import Settings, doc, with_changes
from sdnn.support.arguments import blamed, shown

ALL = "all"  # the key of the range for all variables without a range


class PaperSettings(NamedTuple):
    """The arguments of the paper's acrobot as settings of the core."""

    acrobot: AcrobotConfig
    goal: GoalScheduleConfig
    sensors: SensorConfig


def mean_of(first: int, second: int, observation: Array) -> float:
    """Return the mean of variables number ``first`` and ``second``: a redundant sensor."""
    return 0.5 * (float(observation[first]) + float(observation[second]))


class EnvironmentSpec(Settings, frozen=True):
    """A Gymnasium environment and what the agent observes of it.

    With noise or redundant variables, observations are flattened and, but for ``own_units``, scaled
    to [0, 1]; values outside their ranges saturate. Without, the agent gets them as they are.

    ``kwargs`` of the paper's acrobot, ``sdnn/PaperAcrobot-v0``, are filled in, since its trials may
    run in C++: ``acrobot``, ``goal`` and ``sensors``, each a table with every setting.
    """

    id: Annotated[
        str,
        Meta(min_length=1),
        doc(
            "What `gymnasium.make` is given: `Pendulum-v1`, or `module:namespace/Name-v0`, "
            "for which the module is imported first."
        ),
    ]
    kwargs: Annotated[
        dict[str, Any],
        doc("Arguments of the environment, and of `gymnasium.make`, such as `max_episode_steps`."),
    ] = msgspec.field(default_factory=dict)
    ranges: Annotated[
        dict[str, tuple[float, float]],
        doc(
            "(low, high) of observed variables by their numbers, from 0; `all`: of all "
            "others. By default the bounds of the observation space."
        ),
    ] = msgspec.field(default_factory=dict)
    noise: Annotated[
        float,
        Meta(ge=0),
        doc("Standard deviation of Gaussian noise on every variable, in parts of its range."),
    ] = 0.0
    redundant: Annotated[
        int,
        Meta(ge=0, le=1000),
        doc(
            "Means of neighbouring variables to append to the observation, before the noise: "
            "of 0 and 1, of 1 and 2, ..., of the last and 0, and so on in a circle."
        ),
    ] = 0
    action_masks: Annotated[
        bool,
        doc(
            'Whether agents take only the actions that `info["action_mask"]` allows, as '
            "Taxi's does."
        ),
    ] = False
    own_units: Annotated[
        bool,
        doc(
            "Whether noisy and redundant variables are given in the variables' own units, not"
            " scaled to [0, 1]; a redundant one is the mean of two in [-1, 1]."
        ),
    ] = False

    def __post_init__(self) -> None:
        """Fill in the arguments of the paper's acrobot, and check ranges."""
        super().__post_init__()
        if self.is_paper_acrobot:
            kwargs = dict(self.kwargs)
            for name, default in _PAPER_DEFAULTS._asdict().items():
                settings = with_changes(default, kwargs.get(name, {}), f"kwargs.{name}")
                kwargs[name] = values_of(settings)
            msgspec.structs.force_setattr(self, "kwargs", kwargs)
        try:
            json.dumps(self.kwargs, allow_nan=False)
        except (TypeError, ValueError) as error:
            raise ConfigError("kwargs", f"must be data that JSON has: {error}") from None
        for key, (low, high) in self.ranges.items():
            if key != ALL and not (key.isascii() and key.isdigit()):
                problem = f"must be of 'all' or a number, got {shown(key)}"
                raise ConfigError(f"ranges.{key}", problem)
            if not (np.isfinite([low, high]).all() and low < high):
                problem = f"must be finite, low < high, got {low} and {high}"
                raise ConfigError(f"ranges.{key}", problem)

    def __hash__(self) -> int:
        return hash((self.id, self.noise, self.redundant, json.dumps(self.kwargs, sort_keys=True)))

    @property
    def is_paper_acrobot(self) -> bool:
        """Whether it is the acrobot of the paper's experiments."""
        return self.id.rpartition(":")[2] == PAPER_ACROBOT

    @property
    def is_plain_paper_acrobot(self) -> bool:
        """Whether it is the paper's acrobot without additional noise, sensors or wrappers."""
        return (
            self.is_paper_acrobot
            and self.kwargs.keys() == set(PaperSettings._fields)
            and self == EnvironmentSpec(id=self.id, kwargs=self.kwargs)
        )

    def paper_settings(self) -> PaperSettings:
        """Return the arguments of the paper's acrobot as settings of the core."""
        acrobot, goal, sensors = (self.kwargs[name] for name in PaperSettings._fields)
        return PaperSettings(
            AcrobotConfig(**acrobot), GoalScheduleConfig(**goal), SensorConfig(**sensors)
        )

    def without_noise(self) -> EnvironmentSpec:
        """Return the environment without noise on its sensors."""
        kwargs = self.kwargs
        if self.is_paper_acrobot:
            kwargs = kwargs | {"sensors": kwargs["sensors"] | {"noise": 0.0}}
        return self.replace(noise=0.0, kwargs=kwargs)

    @property
    def changes_observations(self) -> bool:
        """Whether the agent observes variables that are scaled to [0, 1]."""
        return self.has_other_sensors and not self.own_units

    @property
    def has_other_sensors(self) -> bool:
        """Whether the agent's observations differ from the environment's."""
        return self.noise > 0.0 or self.redundant > 0

    def make(self, stream: NoiseStream = "sensor_noise", render_mode: str | None = None) -> Env:
        """Make the environment; every reset with a seed restarts its noise, drawn from ``stream``.

        ConfigError if there is no such environment, it cannot be made, or ranges are missing or
        wrong. RunError if it can be made, but not with this render mode.
        """
        env = self._make_unwrapped(stream, render_mode)
        try:
            if render_mode is not None and env.render_mode != render_mode:
                raise RunError(_problem_of_render_mode(self.id, render_mode))
            if self.action_masks:
                try:
                    env = ActionMasks(env)
                except ValueError as error:
                    raise ConfigError("environment.action_masks", f"{self.id}: {error}") from error
            low, high = self.ends(env)
            return self._with_sensors(env, low, high, stream) if self.has_other_sensors else env
        except BaseException:
            env.close()
            raise

    def _with_sensors(
        self, env: Env, low: NDArray[np.float64], high: NDArray[np.float64], stream: NoiseStream
    ) -> Env:
        """Return the environment with scaled, redundant and noisy sensors, by wrappers in order.

        ``low`` and ``high`` are the limits of the flattened observation, (n_variables,);
        ConfigError if one is not finite.
        """
        space = env.observation_space
        if not isinstance(space, gym.spaces.Box) or low.shape != space.shape:
            env = gym.wrappers.FlattenObservation(env)
        unknown = np.flatnonzero(~(np.isfinite(low) & np.isfinite(high)))
        if unknown.size:
            variables = ", ".join(map(str, unknown))
            raise ConfigError(
                f"environment.ranges.{unknown[0]}",
                "must be given, as lowest and highest value: noise and redundant need the range"
                f" of every variable, and {self.id} has none of variables {variables} of"
                f" {low.size} (from 0)",
            )
        env = UnitSensors(env, low, high)
        if self.redundant:
            pairs = neighbours(low.size, self.redundant)
            env = RedundantSensors(env, [partial(mean_of, *pair) for pair in pairs])
        if self.noise:
            env = NoisySensors(env, self.noise, edge="saturate", stream=stream)
        return in_own_units(env, low, high) if self.own_units else env

    def import_module(self) -> bool:
        """Import the module that ``id`` names; return whether a module was imported now.

        ConfigError if it cannot be imported.
        """
        module, colon, _ = self.id.rpartition(":")
        if not colon or module in sys.modules:
            return False
        find_module(module)
        try:
            importlib.import_module(module)
        except Exception as error:  # a user's module may raise anything
            problem = f"no environment {self.id!r}: {type(error).__name__}: {error}"
            raise ConfigError("environment.id", problem) from error
        return True

    def scaling(self, env: Env | None = None) -> Scaling | None:
        """Return the scaling of observations; None without scaling.

        Where the agent acts without the noisy or redundant sensors of its run, it needs
        ``UnitSensors(env, *scaling.ends)``. ``env`` is one that `make` gave; by default one is
        made. ConfigError if that is impossible.

        Examples
        --------
        >>> scaling = EnvironmentSpec(id="MountainCar-v0", noise=0.1).scaling()
        >>> scaling.ends[1].round(2).tolist()
        [0.6, 0.07]
        """
        if not self.changes_observations:
            return None
        if env is None:
            with closing(self.make()) as made:
                return self.scaling(made)
        while not isinstance(env, UnitSensors):
            assert isinstance(env, gym.Wrapper)  # `make` adds wrappers
            env = env.env
        pairs = zip(env.observation_low.tolist(), env.observation_high.tolist(), strict=True)
        return Scaling(ranges=tuple(pairs), n_redundant=self.redundant)

    def ends(self, env: Env) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Return low and high limits of the flattened observation's variables, (n_variables,) each.

        They are those of ``ranges``, else of the observation space: infinite where not known.
        ConfigError if a range is given of a variable that is not there, or observations are no
        vector.
        """
        try:
            low, high = flat_bounds(env.observation_space)
        except TypeError:
            expected = "observations that Gymnasium flattens to a vector"
            problem = f"{self.id} must have {expected}, got {env.observation_space}"
            raise ConfigError("environment.id", problem) from None
        if ALL in self.ranges:
            low[:], high[:] = self.ranges[ALL]
        for key in sorted(self.ranges.keys() - {ALL}):
            if int(key) >= low.size:
                problem = f"{self.id} has the variables 0 to {low.size - 1}, got {key}"
                raise ConfigError(f"environment.ranges.{key}", problem)
            low[int(key)], high[int(key)] = self.ranges[key]
        return low, high

    def _make_unwrapped(self, stream: NoiseStream, render_mode: str | None) -> Env:
        """Make the environment without wrappers; ConfigError names the setting to blame."""
        options = {"disable_env_checker": True, **self.kwargs}
        if self.is_paper_acrobot:
            options["stream"] = stream
        if render_mode is not None:
            options["render_mode"] = render_mode
        find_module(self.id.rpartition(":")[0])
        try:
            return gym.make(self.id, **options)
        except gym.error.DependencyNotInstalled as error:
            problem = f"{self.id} needs more packages: {error}"
            raise ConfigError("environment.id", problem) from error
        except (gym.error.Error, ImportError) as error:
            raise ConfigError("environment.id", f"no environment {self.id!r}: {error}") from error
        except Exception as error:  # a user's environment may raise anything
            if render_mode is not None:
                self._make_unwrapped(stream, None).close()
                raise RunError(_problem_of_render_mode(self.id, render_mode)) from error
            problem = f"{self.id} cannot be made: {type(error).__name__}: {error}"
            default_key = "environment.kwargs" if self.kwargs else "environment.id"
            raise ConfigError(self.key_of(blamed(error)[0]) or default_key, problem) from error

    def key_of(self, argument: str) -> str:
        """Return the key of an argument of the environment, or "" for an unknown name."""
        for key, value in self.kwargs.items():
            if argument == key:
                return f"environment.kwargs.{key}"
            if isinstance(value, dict) and argument in value:
                return f"environment.kwargs.{key}.{argument}"
        return ""


_PAPER_DEFAULTS = PaperSettings(AcrobotConfig(), GoalScheduleConfig(), SensorConfig())


def has_episode_option(env: Env) -> bool:
    """Return whether `reset` has the option ``"episode"``, the number of the learning episode."""
    return bool(env.metadata.get("reset_episode"))


def episode_option(episode: int) -> Data:
    """Return the options of a reset for the learning episode of this number, from 1."""
    return {"episode": max(1, episode)}


class SeedFirstReset(gym.Wrapper[object, object, object, object]):
    """Gives the first reset a seed, so that the random streams of all others follow from it."""

    def __init__(self, env: Env, seed: int) -> None:
        super().__init__(env)
        self._seed: int | None = seed

    def reset(self, *, seed: int | None = None, options: Data | None = None) -> tuple[object, Data]:
        """Reset the environment; the first reset without a seed gets that of the constructor."""
        if seed is None:
            seed, self._seed = self._seed, None
        return super().reset(seed=seed, options=options)


_folders: list[str] = []


def search_folder(folder: Path) -> None:
    """Register a folder in which `find_module` searches modules that are nowhere else."""
    if str(folder) not in _folders:
        _folders.append(str(folder))


def find_module(name: str) -> None:
    """Add the folders of `search_folder` to ``sys.path`` if a module is nowhere else.

    The folders are not on the path from the beginning, since any file in them could then take the
    place of a missing package.
    """
    package = name.partition(".")[0]
    if package and package not in sys.modules and importlib.util.find_spec(package) is None:
        sys.path += [folder for folder in _folders if folder not in sys.path]


def render_modes(env: Env) -> tuple[str, ...]:
    """Return the render modes in the metadata of an environment, or an empty tuple."""
    return tuple((env.metadata or {}).get("render_modes") or ())


def _problem_of_render_mode(name: str, render_mode: str) -> str:
    """Return the message about an environment that lacks a render mode."""
    return f"{name} cannot be rendered as pictures ({render_mode})"
