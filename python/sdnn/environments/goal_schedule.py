"""lambda(k): the goal tolerance, which falls with the learning episode k."""

from __future__ import annotations

from sdnn import _core
from sdnn.arguments import whole
from sdnn.environments.config import GoalScheduleConfig

__all__ = ["GoalSchedule"]


class GoalSchedule:
    """The goal tolerance lambda as a function of the number of the learning episode.

    `TighteningGoal` applies it to an environment.

    Parameters
    ----------
    config : GoalScheduleConfig, optional

    Raises
    ------
    ValueError
        If a number is outside its range.

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
        self._core = _core.GoalSchedule(self.config.to_core())

    def __call__(self, episode: int) -> float:
        """Goal tolerance of the 1-based learning episode; ValueError below 1."""
        return float(self._core(whole("episode", episode, 1, 2**31 - 1)))

    def __reduce__(self) -> tuple[type[GoalSchedule], tuple[GoalScheduleConfig]]:
        return GoalSchedule, (self.config,)  # environments are copied with their schedule

    def __repr__(self) -> str:
        return f"GoalSchedule({self.config})"
