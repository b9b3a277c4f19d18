"""The wrapper that scales observations from their ranges to the unit interval."""

import gymnasium as gym
import numpy as np
import pytest

from refusals import refuses
from sdnn.environments import UnitSensors


class ConstantObservation(gym.Env):
    """An environment whose observations have these bounds and are all the same."""

    def __init__(self, low, high, observation=None):
        self.observation_space = gym.spaces.Box(
            np.array(low, np.float32), np.array(high, np.float32)
        )
        self.action_space = gym.spaces.Discrete(2)
        self._observation = np.array(observation, np.float32)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        return self._observation, {}


def test_observations_are_scaled_to_the_unit_interval_and_clipped():
    env = UnitSensors(ConstantObservation([-2, 0, -1], [2, 8, 1], [-1, 6, 3]))
    observation, _ = env.reset()
    # -1 in -2 to 2, 6 in 0 to 8, and 3, which is clipped to 1, in -1 to 1.
    assert observation.tolist() == [0.25, 0.75, 1.0]
    assert observation.dtype == np.float64
    assert env.observation_space == gym.spaces.Box(0.0, 1.0, (3,), np.float64)


def test_observation_low_overrides_the_lower_bounds_of_the_space():
    env = ConstantObservation([-np.inf, 0], [4, 8], [1, 2])
    # 1 in -4 to 4 is 5/8 of the range, 2 in 0 to 8 a quarter.
    assert UnitSensors(env, observation_low=[-4, 0]).reset()[0].tolist() == [5 / 8, 2 / 8]


@pytest.mark.parametrize("large", [np.inf, np.finfo(np.float32).max])
def test_unbounded_observations_need_a_range(large):
    env = ConstantObservation([-large, 0], [large, 8], [1, 2])
    refuses("observation_low", UnitSensors, env)
    unit = UnitSensors(env, observation_low=[-3, 0], observation_high=[5, 4])
    assert unit.reset()[0].tolist() == [0.5, 0.5]  # 1 in -3 to 5, and 2 in 0 to 4


@pytest.mark.parametrize(
    "bounds",
    [{"observation_low": [0]}, {"observation_high": [0, 8]}],
    ids=["one of two bounds", "0 not above 0"],
)
def test_ranges_of_wrong_length_or_order_are_refused(bounds):
    env = ConstantObservation([0, 0], [1, 8], [1, 2])
    refuses("observation_low", UnitSensors, env, **bounds)


def test_discrete_observations_are_refused():
    refuses("Box", UnitSensors, gym.make("FrozenLake-v1"))
