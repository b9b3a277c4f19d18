"""The acrobot swing-up as a Gymnasium environment, redundant and noisy sensors as wrappers.

Importing this package registers the acrobot with Gymnasium. An id can import it:

>>> import gymnasium as gym
>>> gym.make("sdnn.environments:sdnn/AcrobotSwingUp-v0").observation_space.shape
(4,)

`goal_tolerance` sets the difficulty; `TighteningGoal` reduces it during training, as in the paper.
``"sdnn/PaperAcrobot-v0"`` is the paper's task, with such a goal and the paper's sensors.
"""

import gymnasium as gym

from sdnn.config import AcrobotConfig, GoalScheduleConfig, SensorConfig
from sdnn.environments.acrobot import AcrobotSwingUpEnv
from sdnn.environments.masks import ActionMasks
from sdnn.environments.paper_acrobot import (
    PAPER_ACROBOT,
    GoalSchedule,
    PaperAcrobotEnv,
    TighteningGoal,
)
from sdnn.environments.sensors import AcrobotSensors, NoisySensors, RedundantSensors, UnitSensors
from sdnn.environments.vector_env import AcrobotSwingUpVectorEnv

__all__ = [
    "AcrobotConfig",
    "AcrobotSensors",
    "AcrobotSwingUpEnv",
    "AcrobotSwingUpVectorEnv",
    "ActionMasks",
    "GoalSchedule",
    "GoalScheduleConfig",
    "NoisySensors",
    "PaperAcrobotEnv",
    "RedundantSensors",
    "SensorConfig",
    "TighteningGoal",
    "UnitSensors",
]

gym.register(
    id="sdnn/AcrobotSwingUp-v0",
    entry_point="sdnn.environments.acrobot:AcrobotSwingUpEnv",
    vector_entry_point="sdnn.environments.vector_env:AcrobotSwingUpVectorEnv",
    reward_threshold=10.0,
)
gym.register(
    id=PAPER_ACROBOT,
    entry_point="sdnn.environments.paper_acrobot:PaperAcrobotEnv",
    reward_threshold=10.0,
    order_enforce=False,
)
