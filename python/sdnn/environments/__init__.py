"""The acrobot swing-up as a Gymnasium environment, redundant and noisy sensors as wrappers.

After ``import sdnn`` Gymnasium knows ``sdnn/AcrobotSwingUp-v0``:

>>> import gymnasium as gym
>>> import sdnn
>>> gym.make("sdnn/AcrobotSwingUp-v0").observation_space.shape
(4,)

and many of them at once, stepped side by side in vector registers:

>>> gym.make_vec("sdnn/AcrobotSwingUp-v0", num_envs=16).observation_space.shape
(16, 4)

How hard it is, is one number, ``goal_tolerance``; `TighteningGoal` lets it fall while the agent
learns, as in the paper.
"""

from sdnn.environments.acrobot import AcrobotSwingUpEnv
from sdnn.environments.config import AcrobotConfig, GoalScheduleConfig, SensorConfig
from sdnn.environments.goal_schedule import GoalSchedule
from sdnn.environments.sensors import AcrobotSensors, NoisySensors, RedundantSensors
from sdnn.environments.tightening_goal import TighteningGoal
from sdnn.environments.unit_sensors import UnitSensors
from sdnn.environments.vector_env import AcrobotSwingUpVectorEnv

__all__ = [
    "AcrobotConfig",
    "AcrobotSensors",
    "AcrobotSwingUpEnv",
    "AcrobotSwingUpVectorEnv",
    "GoalSchedule",
    "GoalScheduleConfig",
    "NoisySensors",
    "RedundantSensors",
    "SensorConfig",
    "TighteningGoal",
    "UnitSensors",
]
