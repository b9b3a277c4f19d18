"""Redundant and noisy sensors as wrappers."""

import gymnasium as gym
import numpy as np
import pytest

from refusals import refuses
from sdnn import _core
from sdnn.environments import AcrobotSwingUpEnv, NoisySensors, RedundantSensors, SensorConfig


def run(env, n_episodes=20):
    """Observations and true states of random episodes."""
    rng = np.random.default_rng(1)
    observed, states = [], []
    for _ in range(n_episodes):
        observation, info = env.reset()
        ended = False
        while True:
            observed.append(observation)
            states.append(info["state"])
            if ended:
                break
            action = rng.uniform(-1.0, 1.0, 1)
            observation, _, terminated, truncated, info = env.step(action)
            ended = terminated or truncated
    return observed, states


@pytest.mark.parametrize("n_sensors", [4, 5, 6])
@pytest.mark.parametrize("noise", [0.0, 0.02])
@pytest.mark.parametrize("stream", ["sensor_noise", "evaluation_sensor_noise"])
def test_sensor_wrappers_have_the_bits_of_the_core(n_sensors, noise, stream):
    functions = ("energy", "height")[: n_sensors - 4]
    env = RedundantSensors(AcrobotSwingUpEnv(dtype="float64"), functions)
    env = NoisySensors(env, sigma=noise, seed=42, stream=stream)
    config = SensorConfig(n_sensors=n_sensors, noise=noise)
    core = _core.AcrobotSensors(config, 42, _core.Stream.__members__[stream])
    observed, states = run(env)
    assert len(observed) > 50
    for observation, state in zip(observed, states, strict=True):
        assert observation.dtype == np.float64
        np.testing.assert_array_equal(observation, core.observe(state))


def test_noisy_observations_are_within_their_space():
    env = NoisySensors(RedundantSensors(AcrobotSwingUpEnv()), sigma=0.3)
    assert env.observation_space == gym.spaces.Box(0.0, 1.0, (6,), np.float32)
    for observation in run(env)[0]:
        assert env.observation_space.contains(observation)


def test_redundant_sensors_may_be_custom_functions_with_bounds():
    env = RedundantSensors(
        AcrobotSwingUpEnv(dtype="float64"),
        (lambda s: s[0] - s[1], "height", lambda s: len(s)),
        bounds=[(-1.0, 1.0), (0.0, 1.0), (4.0, 4.0)],
    )
    np.testing.assert_array_equal(env.observation_space.low, [0, 0, 0, 0, -1, 0, 4])
    np.testing.assert_array_equal(env.observation_space.high, [1, 1, 1, 1, 1, 1, 4])
    for observation in run(env)[0]:
        assert observation[4] == observation[0] - observation[1]
        assert observation[6] == 4.0


class Switches(gym.Env):
    """Observes whole numbers."""

    observation_space = gym.spaces.Box(0, 1, (3,), np.int8)
    action_space = gym.spaces.Discrete(2)

    def reset(self, *, seed=None, options=None):
        return np.array([0, 1, 1], np.int8), {}


def test_sensors_convert_integer_observations_to_float():
    noisy = NoisySensors(Switches(), 0.02, edge="saturate")
    observed, _ = noisy.reset(seed=1)
    assert noisy.observation_space.contains(observed)
    assert observed[0] < 0.1
    assert (observed[1:] > 0.9).all()
    assert ((observed > 0.0) & (observed < 1.0)).any()
    more = RedundantSensors(Switches(), [lambda s: s.mean() / 2], bounds=[(0.0, 0.5)])
    observed, _ = more.reset()
    assert more.observation_space.contains(observed)
    assert more.observation_space.high[3] == 0.5
    assert observed.tolist() == [0.0, 1.0, 1.0, np.float32(1 / 3)]


def test_edge_wraps_or_clips_noise_per_variable():
    env = gym.wrappers.TransformObservation(
        AcrobotSwingUpEnv(), np.ones_like, gym.spaces.Box(0.0, 1.0, (4,), np.float32)
    )
    edges = ("saturate", "wrap", "saturate", "saturate")
    noisy = NoisySensors(env, sigma=0.1, edge=edges, seed=3)
    observed = np.array([noisy.reset()[0] for _ in range(100)])
    assert (observed[:, 1] < 0.5).any()
    assert (observed[:, 0] > 0.5).all()
    assert (observed[:, 0] == 1.0).any()
    noisy = NoisySensors(env, sigma=0.1, edge="saturate", seed=3)
    assert (np.array([noisy.reset()[0] for _ in range(100)]) > 0.5).all()


def test_reset_with_a_seed_restarts_the_noise():
    env = NoisySensors(AcrobotSwingUpEnv(), seed=7)
    first, second = env.reset()[0], env.reset()[0]
    assert (first != second).all()
    np.testing.assert_array_equal(env.reset(seed=7)[0], first)
    np.testing.assert_array_equal(env.reset()[0], second)
    assert (env.reset(seed=8)[0] != first).all()


def test_noise_does_not_change_the_states_of_the_task():
    quiet, loud = AcrobotSwingUpEnv(), NoisySensors(AcrobotSwingUpEnv(), sigma=0.5)
    for clean, noisy in zip(run(quiet)[1], run(loud)[1], strict=True):
        np.testing.assert_array_equal(clean, noisy)


def test_sensor_wrappers_are_recreated_from_the_spec():
    env = NoisySensors(RedundantSensors(gym.make("sdnn/AcrobotSwingUp-v0")), sigma=0.01, seed=5)
    again = gym.make(env.spec)
    np.testing.assert_array_equal(env.reset()[0], again.reset()[0])


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
