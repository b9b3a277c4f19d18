"""Redundant and noisy sensors as wrappers."""

import gymnasium as gym
import numpy as np
import pytest

from refusals import refuses
from sdnn import _core
from sdnn.environments import AcrobotSwingUpEnv, NoisySensors, RedundantSensors, SensorConfig


def random_episodes(env):
    """Return the observations of 20 episodes with random actions, and the acrobot's states."""
    rng = np.random.default_rng(1)
    observations, states = [], []
    for _ in range(20):
        observation, info = env.reset()
        observations.append(observation)
        states.append(info["state"])
        has_ended = False
        while not has_ended:
            action = rng.uniform(-1.0, 1.0, 1)
            observation, _, terminated, truncated, info = env.step(action)
            observations.append(observation)
            states.append(info["state"])
            has_ended = terminated or truncated
    return observations, states


@pytest.mark.parametrize("n_sensors", [4, 5, 6])
@pytest.mark.parametrize("noise", [0.0, 0.02])
@pytest.mark.parametrize("stream", ["sensor_noise", "evaluation_sensor_noise"])
def test_sensor_wrappers_have_the_bits_of_the_core(n_sensors, noise, stream):
    functions = ("energy", "height")[: n_sensors - 4]
    env = RedundantSensors(AcrobotSwingUpEnv(dtype="float64"), functions)
    env = NoisySensors(env, sigma=noise, seed=42, stream=stream)
    config = SensorConfig(n_sensors=n_sensors, noise=noise)
    core = _core.AcrobotSensors(config, 42, _core.Stream.__members__[stream])
    observations, states = random_episodes(env)
    assert len(observations) > 50
    for observation, state in zip(observations, states, strict=True):
        assert observation.dtype == np.float64
        np.testing.assert_array_equal(observation, core.observe(state))


def test_noisy_observations_are_within_their_space():
    env = NoisySensors(RedundantSensors(AcrobotSwingUpEnv()), sigma=0.3)
    assert env.observation_space == gym.spaces.Box(0.0, 1.0, (6,), np.float32)
    for observation in random_episodes(env)[0]:
        assert env.observation_space.contains(observation)


def test_redundant_sensors_may_be_custom_functions_with_bounds():
    env = RedundantSensors(
        AcrobotSwingUpEnv(dtype="float64"),
        (lambda s: s[0] - s[1], "height", lambda s: len(s)),
        bounds=[(-1.0, 1.0), (0.0, 1.0), (4.0, 4.0)],
    )
    np.testing.assert_array_equal(env.observation_space.low, [0, 0, 0, 0, -1, 0, 4])
    np.testing.assert_array_equal(env.observation_space.high, [1, 1, 1, 1, 1, 1, 4])
    for observation in random_episodes(env)[0]:
        assert observation[4] == observation[0] - observation[1]
        assert observation[6] == 4.0


class Integers(gym.Env):
    """Observations are integers."""

    observation_space = gym.spaces.Box(0, 1, (3,), np.int8)
    action_space = gym.spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        return np.array([0, 1, 1], np.int8), {}


def test_sensors_convert_integer_observations_to_float():
    env = NoisySensors(Integers(), 0.02, edge="saturate")
    observation, _ = env.reset(seed=1)
    assert env.observation_space.contains(observation)
    assert observation[0] < 0.1
    assert (observation[1:] > 0.9).all()
    assert ((observation > 0.0) & (observation < 1.0)).any()
    env = RedundantSensors(Integers(), [lambda x: x.mean() / 2], bounds=[(0.0, 0.5)])
    observation, _ = env.reset()
    assert env.observation_space.contains(observation)
    assert env.observation_space.high[3] == 0.5
    assert observation.tolist() == [0.0, 1.0, 1.0, np.float32(1 / 3)]  # half the mean of 0, 1, 1


def test_edge_wraps_or_clips_noise_beyond_1_for_each_variable():
    env = gym.wrappers.TransformObservation(
        AcrobotSwingUpEnv(), np.ones_like, gym.spaces.Box(0.0, 1.0, (4,), np.float32)
    )

    def noisy_ones(edge):
        noisy = NoisySensors(env, sigma=0.1, edge=edge, seed=3)
        return np.array([noisy.reset()[0] for _ in range(100)])

    observations = noisy_ones(("saturate", "wrap", "saturate", "saturate"))
    assert (observations[:, 1] < 0.5).any(), "numbers above 1 continue at 0"
    assert (observations[:, 0] > 0.5).all()
    assert (observations[:, 0] == 1.0).any()
    assert (noisy_ones("saturate") > 0.5).all()


def test_reset_with_a_seed_restarts_the_noise():
    env = NoisySensors(AcrobotSwingUpEnv(), seed=7)
    first, second = env.reset()[0], env.reset()[0]
    assert (first != second).all()
    np.testing.assert_array_equal(env.reset(seed=7)[0], first)
    np.testing.assert_array_equal(env.reset()[0], second)
    assert (env.reset(seed=8)[0] != first).all()


def test_noise_does_not_change_the_states_of_the_task():
    _, states = random_episodes(AcrobotSwingUpEnv())
    _, states_with_noise = random_episodes(NoisySensors(AcrobotSwingUpEnv(), sigma=0.5))
    np.testing.assert_array_equal(states, states_with_noise)


def test_sensor_wrappers_are_recreated_from_the_spec():
    env = NoisySensors(RedundantSensors(gym.make("sdnn/AcrobotSwingUp-v0")), sigma=0.01, seed=5)
    recreated = gym.make(env.spec)
    np.testing.assert_array_equal(env.reset()[0], recreated.reset()[0])


def test_bad_arguments_of_sensor_wrappers_are_refused_by_name():
    env = AcrobotSwingUpEnv()
    refuses("functions", RedundantSensors, env, ("speed",))
    refuses("bounds", RedundantSensors, env, bounds=[(0.0, 1.0)])
    refuses("noise", NoisySensors, env, sigma=-1.0)
    refuses("edge", NoisySensors, env, edge="clip")
    refuses("edge", NoisySensors, env, edge=("wrap", "wrap"))
    refuses("seed", NoisySensors, env, seed=-1)
    refuses("stream", NoisySensors, env, stream="weights")
    refuses("[0, 1]", NoisySensors, RedundantSensors(env, ("energy",), bounds=[(0.0, 2.0)]))
    refuses("Box", NoisySensors, gym.make("Blackjack-v1", disable_env_checker=True))
