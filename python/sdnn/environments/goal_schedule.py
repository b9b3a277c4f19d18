"""lambda(k): how the goal's speed limits tighten with the learning episode."""

from __future__ import annotations

from sdnn import _core
from sdnn.environments.config import GoalScheduleConfig

__all__ = ["GoalSchedule"]


class GoalSchedule:
    """lambda as a function of the number of the learning episode.

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
    >>> lambda_ = GoalSchedule()
    >>> lambda_(100), lambda_(300), lambda_(10001)
    (0.5, 0.25, 0.01)
    >>> GoalSchedule(GoalScheduleConfig(kind="inverse_sqrt"))(99)
    0.1
    """

    def __init__(self, config: GoalScheduleConfig | None = None) -> None:
        self.config = config or GoalScheduleConfig()
        self._core = _core.GoalSchedule(self.config.to_core())

    def __call__(self, episode: int) -> float:
        """Lambda of the 1-based learning episode; ValueError below 1."""
        return float(self._core(episode))

    def __repr__(self) -> str:
        return f"GoalSchedule({self.config})"
