"""The goal tolerance lambda(k), which falls with the learning episode k."""

from __future__ import annotations

import operator
from collections.abc import Callable
from typing import Any

import gymnasium as gym
from numpy.typing import NDArray

from sdnn import _core
from sdnn.arguments import whole
from sdnn.config import GoalScheduleConfig

__all__ = ["GoalSchedule", "TighteningGoal"]


class GoalSchedule:
    """The goal tolerance lambda as a function of the number of the learning episode.

    `TighteningGoal` applies it to an environment. ValueError if a number of ``config`` is outside
    its range.

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
        """Return the goal tolerance of the 1-based learning episode; ValueError below 1."""
        return float(self._core(whole("episode", episode, 1, 2**31 - 1)))

    def __reduce__(self) -> tuple[type[GoalSchedule], tuple[GoalScheduleConfig]]:
        return GoalSchedule, (self.config,)  # environments are copied with their schedule

    def __repr__(self) -> str:
        return f"GoalSchedule({self.config})"


class TighteningGoal(
    gym.Wrapper[NDArray[Any], Any, NDArray[Any], Any], gym.utils.RecordConstructorArgs
):
    """Gives the environment the goal tolerance of a learning episode.

    The caller counts the learning episodes: ``reset(options={"episode": k})`` begins episode k.
    A reset without that option keeps the episode, so evaluation never moves the task. Where a loop
    in other hands calls ``reset()``, set the attribute ``episode``, which holds from the next reset
    on. In vector environments with a copy of the wrapper in each: ``envs.set_attr("episode", k)``.

    Parameters
    ----------
    env : gymnasium.Env
        With an attribute ``goal_tolerance`` and a reset option of the same name, like
        ``sdnn/AcrobotSwingUp-v0``; other wrappers may lie between.
    schedule : callable, optional
        The goal tolerance as a function of the learning episode, by default the paper's
        `GoalSchedule`.

    Raises
    ------
    ValueError
        If the environment has no goal tolerance.

    Examples
    --------
    >>> import gymnasium as gym
    >>> from sdnn.environments import TighteningGoal
    >>> env = TighteningGoal(gym.make("sdnn/AcrobotSwingUp-v0"))
    >>> for episode in (1, 100, 300):
    ...     observation, info = env.reset(options={"episode": episode})
    ...     print(round(info["goal_tolerance"], 3))
    0.99
    0.5
    0.25
    >>> env.reset()[1]["goal_tolerance"], env.episode
    (0.25, 300)
    """

    def __init__(
        self, env: gym.Env[NDArray[Any], Any], schedule: Callable[[int], float] | None = None
    ) -> None:
        gym.utils.RecordConstructorArgs.__init__(self, schedule=schedule)
        super().__init__(env)
        if not env.has_wrapper_attr("goal_tolerance"):
            raise ValueError(f"env must have a goal_tolerance, got {env}")
        self.schedule = GoalSchedule() if schedule is None else schedule
        self._episode = 1

    @property
    def episode(self) -> int:
        """The learning episode k >= 1, from the next reset on; at first 1."""
        return self._episode

    @episode.setter
    def episode(self, value: int) -> None:
        self._episode = _episode_of(value)

    def reset(
        self, *, seed: int | None = None, options: dict[str, Any] | None = None
    ) -> tuple[NDArray[Any], dict[str, Any]]:
        """Begin an episode with the goal tolerance of the learning episode ``options["episode"]``.

        Without that option, of the one before. Seed and other options are passed on. ValueError for
        an episode below 1, or an option ``"goal_tolerance"``, which follows from the episode.
        """
        options = dict(options or {})
        if "goal_tolerance" in options:
            raise ValueError("options must hold 'episode' in place of 'goal_tolerance'")
        episode = _episode_of(options.pop("episode", self._episode))
        options["goal_tolerance"] = float(self.schedule(episode))
        result = self.env.reset(seed=seed, options=options)
        self._episode = episode
        return result


def _episode_of(value: Any) -> int:
    episode = operator.index(value)
    if episode < 1:
        raise ValueError(f"episode must be at least 1, got {value!r}")
    return episode
