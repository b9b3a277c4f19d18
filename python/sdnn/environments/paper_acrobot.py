"""The task of the paper: the acrobot with a goal that tightens, seen through its sensors."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from typing import TypeVar

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.config import AcrobotConfig, GoalScheduleConfig, SensorConfig
from sdnn.environments.acrobot import AcrobotSwingUpEnv
from sdnn.environments.sensors import STREAMS, NoiseStream
from sdnn.environments.types import Array, Data, Element
from sdnn.support.arguments import choice, require, seed_of, whole


class GoalSchedule:
    """The goal tolerance as a function of the learning episode.

    Examples
    --------
    >>> from sdnn.environments import GoalSchedule, GoalScheduleConfig
    >>> schedule = GoalSchedule()
    >>> schedule(100), schedule(300), schedule(10001)
    (0.5, 0.25, 0.01)
    >>> GoalSchedule(GoalScheduleConfig(kind="inverse_sqrt"))(99)
    0.1
    """

    def __init__(self, config: GoalScheduleConfig | None = None) -> None:
        self.config = config or GoalScheduleConfig()
        self._core = _core.GoalSchedule(self.config)

    def __call__(self, episode: int) -> float:
        """Return the goal tolerance of a learning episode, counted from 1."""
        return float(self._core(whole("episode", episode, 1, 2**31 - 1)))

    def __reduce__(self) -> tuple[type[GoalSchedule], tuple[GoalScheduleConfig]]:
        return GoalSchedule, (self.config,)  # for `copy.deepcopy` of environments

    def __repr__(self) -> str:
        return f"GoalSchedule({self.config})"


class TighteningGoal(gym.Wrapper[Array, Element, Array, Element], gym.utils.RecordConstructorArgs):
    """Reduces the goal tolerance with the learning episode.

    The caller counts the learning episodes: ``reset(options={"episode": k})`` or the attribute
    ``episode`` sets the next one. Other resets keep it, so evaluation does not move the goal.

    Parameters
    ----------
    env : gymnasium.Env
        With an attribute and a reset option ``goal_tolerance``, like ``sdnn/AcrobotSwingUp-v0``.
    schedule : callable, optional
        The goal tolerance as a function of the episode; by default the paper's `GoalSchedule`.

    Examples
    --------
    >>> import gymnasium as gym
    >>> from sdnn.environments import TighteningGoal
    >>> env = TighteningGoal(gym.make("sdnn/AcrobotSwingUp-v0"))
    >>> env.reset(options={"episode": 300})[1]["goal_tolerance"], env.episode
    (0.25, 300)
    """

    def __init__(
        self, env: gym.Env[Array, Element], schedule: Callable[[int], float] | None = None
    ) -> None:
        gym.utils.RecordConstructorArgs.__init__(self, schedule=schedule)
        super().__init__(env)
        if not env.has_wrapper_attr("goal_tolerance"):
            raise ValueError(f"env must have a goal_tolerance, got {env}")
        self.schedule = GoalSchedule() if schedule is None else schedule
        self._episode = 1

    @property
    def episode(self) -> int:
        """The learning episode k >= 1 from the next reset on; initially 1."""
        return self._episode

    @episode.setter
    def episode(self, value: int) -> None:
        self._episode = whole("episode", value, 1, 2**31 - 1)

    def reset(self, *, seed: int | None = None, options: Data | None = None) -> tuple[Array, Data]:
        """Begin an episode; the option ``"episode"`` sets the learning episode from now on."""
        options = dict(options or {})
        if "goal_tolerance" in options:
            raise ValueError("options must hold 'episode' in place of 'goal_tolerance'")
        episode = whole("episode", options.pop("episode", self._episode), 1, 2**31 - 1)
        options["goal_tolerance"] = float(self.schedule(episode))
        result = self.env.reset(seed=seed, options=options)
        self._episode = episode
        return result


PAPER_ACROBOT = "sdnn/PaperAcrobot-v0"

AnyConfig = TypeVar("AnyConfig", AcrobotConfig, GoalScheduleConfig, SensorConfig)


class PaperAcrobotEnv(AcrobotSwingUpEnv):
    """Swing up the acrobot of `AcrobotSwingUpEnv` as in the experiments of the SDNN papers.

    The goal tolerance falls with the learning episode, which the reset option ``"episode"`` sets;
    it is counted from 1 and stays for later resets. Observations, shape (n_inputs,), float64, have
    the order s1..s6, constant, random inputs; a reset with a seed restarts their noise. All equals
    a compiled trial, bit for bit.

    Arguments may be mappings of the settings that differ from the defaults.

    Parameters
    ----------
    acrobot : AcrobotConfig, optional
        Physics, goal and reward.
    goal : GoalScheduleConfig, optional
        The schedule of the goal tolerance.
    sensors : SensorConfig, optional
        Observed variables and their noise.
    stream : {"sensor_noise", "evaluation_sensor_noise"}
        The core's random stream, of learning or of test episodes.
    render_mode : str, optional
        As of `AcrobotSwingUpEnv`.

    Examples
    --------
    >>> import gymnasium as gym
    >>> env = gym.make("sdnn/PaperAcrobot-v0", sensors={"n_sensors": 6, "noise": 0.02})
    >>> observation, info = env.reset(seed=1, options={"episode": 300})
    >>> observation.shape, info["goal_tolerance"]
    ((6,), 0.25)
    """

    metadata: Data = {  # noqa: RUF012
        **AcrobotSwingUpEnv.metadata,
        "reset_episode": True,  # an option of reset: the number of the learning episode
    }

    def __init__(
        self,
        *,
        acrobot: AcrobotConfig | Mapping[str, object] | None = None,
        goal: GoalScheduleConfig | Mapping[str, object] | None = None,
        sensors: SensorConfig | Mapping[str, object] | None = None,
        stream: NoiseStream = "sensor_noise",
        render_mode: str | None = None,
    ) -> None:
        config = _config("acrobot", AcrobotConfig, acrobot)
        super().__init__(config=config, render_mode=render_mode, dtype="float64")
        self.schedule = GoalSchedule(_config("goal", GoalScheduleConfig, goal))
        self.sensors = _config("sensors", SensorConfig, sensors)
        self._stream = choice("stream", stream, STREAMS)
        self._restart_noise(0)
        self._episode = 1
        self.observation_space = gym.spaces.Box(0.0, 1.0, (self.sensors.n_inputs,), np.float64)

    def _restart_noise(self, seed: int) -> None:
        self._sensors = _core.AcrobotSensors(self.sensors, seed_of(seed), self._stream)

    def reset(self, *, seed: int | None = None, options: Data | None = None) -> tuple[Array, Data]:
        """Begin an episode; the option ``"episode"`` holds for it and later ones."""
        options = dict(options or {})
        self._episode = whole("episode", options.pop("episode", self._episode), 1, 2**31 - 1)
        require(not options, "options", "hold no more than 'episode'", options)
        if seed is not None:
            self._restart_noise(seed)
        return super().reset(seed=seed, options={"goal_tolerance": self.schedule(self._episode)})

    def _observation(self) -> NDArray[np.float64]:
        return self._sensors.observe(self.state)


def _config(
    name: str, config_type: type[AnyConfig], value: AnyConfig | Mapping[str, object] | None
) -> AnyConfig:
    """Return settings: the defaults for None; a mapping has those that differ from them."""
    make: Callable[..., AnyConfig] = config_type
    if value is None:
        return make()
    if isinstance(value, Mapping):
        return make(**value)
    is_config = isinstance(value, config_type)
    require(is_config, name, f"be a {config_type.__name__} or a mapping", value, TypeError)
    return value
