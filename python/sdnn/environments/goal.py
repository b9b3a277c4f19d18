"""The goal tolerance lambda(k), which falls with the learning episode k."""

from __future__ import annotations

from collections.abc import Callable

import gymnasium as gym

from sdnn import _core
from sdnn.config import GoalScheduleConfig
from sdnn.environments.types import Array, Data, Element
from sdnn.support.arguments import whole


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
        return GoalSchedule, (self.config,)  # environments are copied with their schedule

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
