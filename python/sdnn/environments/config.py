"""Settings of the acrobot, its goal schedule and its sensors; the defaults are the paper's."""

from __future__ import annotations

import dataclasses
import math
from typing import Literal

from sdnn import _core
from sdnn.config import to_core

__all__ = ["AcrobotConfig", "GoalScheduleConfig", "SensorConfig"]


@dataclasses.dataclass(frozen=True, kw_only=True)
class AcrobotConfig:
    """The numbers of the acrobot's task; the defaults are the paper's (section 4.1).

    Values are checked when an environment is built from them. Where the paper is silent or its
    print garbled, the attribute is marked as a reading.

    Attributes
    ----------
    link_mass_1, link_mass_2 : float
        kg, > 0.
    link_length_1, link_length_2 : float
        m, > 0.
    center_of_mass_1, center_of_mass_2 : float
        m from the joint the link hangs on, > 0.
    inertia_1, inertia_2 : float
        kg m^2 about the centre of mass, > 0.
    gravity : float
        m/s^2, finite.
    max_torque : float
        N m, > 0; the torque is in ``[-max_torque, max_torque]``.
    decision_interval : float
        s, > 0; the torque is held for it.
    integration_step : float
        s, > 0, a whole fraction of ``decision_interval``: Runge-Kutta of fourth order. A reading.
    max_decisions : int
        Decisions in an episode, >= 1.
    goal_height : float
        m above joint 1, which the tip must reach.
    goal_velocity_1, goal_velocity_2 : float
        rad/s, > 0. Limits of |theta1_dot| and |theta2_dot|: times the goal tolerance in the goal,
        as they are in the penalty.
    goal_test : {"every_step", "decision_instant"}
        When the goal is looked for: after every integration step, and the episode ends there; or
        only when the next decision is due. A reading.
    goal_reward : float
        Reward at the goal.
    penalty : float
        Reward for idling or too much speed at a decision instant; it ends nothing.
    idle_angle : float
        rad, in [0, pi]: |theta1| below it is idling; 0 turns the rule off. A reading: 5 degrees;
        pi / 5 is the alternative.
    """

    link_mass_1: float = 1.0
    link_mass_2: float = 1.0
    link_length_1: float = 1.0
    link_length_2: float = 1.0
    center_of_mass_1: float = 0.5
    center_of_mass_2: float = 0.5
    inertia_1: float = 1.0
    inertia_2: float = 1.0
    gravity: float = 9.8
    max_torque: float = 10.0
    decision_interval: float = 1.0
    integration_step: float = 0.02
    max_decisions: int = 50
    goal_height: float = 1.5
    goal_velocity_1: float = 3.0 * math.pi
    goal_velocity_2: float = 5.0 * math.pi
    goal_test: Literal["every_step", "decision_instant"] = "every_step"
    goal_reward: float = 10.0
    penalty: float = -5.0
    idle_angle: float = math.pi / 36.0

    def to_core(self) -> _core.AcrobotConfig:
        """Make the core's struct of the same values; see `sdnn.config.to_core`."""
        return to_core(self, _core.AcrobotConfig)


@dataclasses.dataclass(frozen=True, kw_only=True)
class GoalScheduleConfig:
    """How the goal tolerance lambda(k) falls with the learning episode k (section 4.1).

    A reading: the formula is garbled in print.

    Attributes
    ----------
    kind : {"inverse_linear", "inverse_sqrt", "constant"}
        1 / (1 + k / scale); 1 / sqrt(1 + k); or ``constant_value``.
    scale : float
        Episodes, > 0; of ``"inverse_linear"``.
    last_episode : int
        The formula holds up to this episode, >= 0; lambda is ``floor`` beyond.
    floor : float
        lambda beyond ``last_episode``, >= 0.
    constant_value : float
        lambda of ``"constant"``, >= 0.
    """

    kind: Literal["inverse_linear", "inverse_sqrt", "constant"] = "inverse_linear"
    scale: float = 100.0
    last_episode: int = 10000
    floor: float = 0.01
    constant_value: float = 1.0

    def to_core(self) -> _core.GoalScheduleConfig:
        """Make the core's struct of the same values; see `sdnn.config.to_core`."""
        return to_core(self, _core.GoalScheduleConfig)


@dataclasses.dataclass(frozen=True, kw_only=True)
class SensorConfig:
    """What the agent observes (section 4.3).

    Attributes
    ----------
    n_sensors : int
        4: s1..s4; 5: s5, the energy, too; 6: s6, the height, too.
    noise : float
        Standard deviation of the noise on every sensor, >= 0; 0.02 in the paper's noisy cases.
    noise_entry : {"every_sensor", "basic_sensors"}
        Where noise enters: s5 and s6 are computed from the true s1..s4 and get noise of their own,
        or they are computed from the noisy ones. A reading.
    n_constant, n_random : int
        Useless inputs besides, 0 to 100 of each: always 1/2, with noise as on the sensors; or a new
        uniform number each time. Not in the paper.
    """

    n_sensors: int = 4
    noise: float = 0.0
    noise_entry: Literal["every_sensor", "basic_sensors"] = "every_sensor"
    n_constant: int = 0
    n_random: int = 0

    @property
    def n_inputs(self) -> int:
        """Numbers in an observation."""
        return self.n_sensors + self.n_constant + self.n_random

    def to_core(self) -> _core.SensorConfig:
        """Make the core's struct of the same values; see `sdnn.config.to_core`."""
        return to_core(self, _core.SensorConfig)
