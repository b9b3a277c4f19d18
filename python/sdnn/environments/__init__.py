"""The acrobot swing-up as a Gymnasium environment, redundant and noisy sensors as wrappers.

Importing ``sdnn`` registers ``sdnn/AcrobotSwingUp-v0``:

>>> import gymnasium as gym
>>> import sdnn
>>> gym.make("sdnn/AcrobotSwingUp-v0").observation_space.shape
(4,)
"""

import gymnasium as gym

from sdnn.environments.acrobot import AcrobotSwingUpEnv
from sdnn.environments.config import AcrobotConfig, GoalScheduleConfig, SensorConfig
from sdnn.environments.goal_schedule import GoalSchedule
from sdnn.environments.sensors import NoisySensors, RedundantSensors

__all__ = [
    "AcrobotConfig",
    "AcrobotSwingUpEnv",
    "GoalSchedule",
    "GoalScheduleConfig",
    "NoisySensors",
    "RedundantSensors",
    "SensorConfig",
    "register_environments",
]


def register_environments() -> None:
    """Make ``sdnn/AcrobotSwingUp-v0`` known to Gymnasium; a second call changes nothing."""
    if "sdnn/AcrobotSwingUp-v0" not in gym.registry:
        gym.register(
            id="sdnn/AcrobotSwingUp-v0",
            entry_point="sdnn.environments.acrobot:AcrobotSwingUpEnv",
            reward_threshold=10.0,
        )


register_environments()
