"""The acrobot's states between two decisions, for pictures that move."""

from __future__ import annotations

import dataclasses
from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.environments.config import AcrobotConfig

__all__ = ["AcrobotMotion"]

_LONGEST = 0.04
"""Seconds between pictures that look like one movement."""


class AcrobotMotion:
    """Follows the acrobot from one decision to the next.

    Parameters
    ----------
    config
        Of the acrobot that is followed.

    Attributes
    ----------
    interval : float
        s from state to state: at most 0.04 where the integration step is not longer, and a whole
        fraction of the decision interval.
    """

    def __init__(self, config: AcrobotConfig) -> None:
        n_steps = round(config.decision_interval / config.integration_step)
        most = max(1, int(_LONGEST / config.integration_step * (1.0 + 1e-9)))
        taken = next(n for n in range(min(most, n_steps), 0, -1) if n_steps % n == 0)
        self.interval = taken * config.integration_step
        self._n_intervals = n_steps // taken
        parts = dataclasses.replace(
            config, decision_interval=self.interval, max_decisions=self._n_intervals
        )
        self._acrobot = _core.Acrobot(parts.to_core())
        self._looks_for_goal = config.goal_test == "every_step"

    def between(
        self, state: NDArray[np.float64], torque: float, goal_tolerance: float
    ) -> Iterator[tuple[NDArray[np.float64], float]]:
        """Give the states after ``state`` and before the next decision or the goal.

        Parameters
        ----------
        state : ndarray, shape (4,)
            At the decision: theta1, theta2, theta1_dot, theta2_dot.
        torque, goal_tolerance
            Held in N m, and that of the episode.

        Yields
        ------
        state : ndarray, shape (4,)
        tip_height : float
            m.
        """
        tolerance = goal_tolerance if self._looks_for_goal else 0.0
        self._acrobot.set_state(state)
        for _ in range(self._n_intervals - 1):
            _, reached, _ = self._acrobot.step(torque, tolerance)
            if reached:
                return
            yield self._acrobot.state(), self._acrobot.tip_height()
