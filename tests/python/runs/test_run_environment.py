"""Environments of runs: ranges, sensor noise and redundant variables."""

import re

import gymnasium as gym
import numpy as np
import pytest

import drifting_env  # noqa: F401
from sdnn.environments import NoisySensors, UnitSensors
from sdnn.runs import ConfigError, EnvironmentSpec


def test_environments_without_noise_and_redundancy_are_unchanged():
    env = EnvironmentSpec(id="CartPole-v1", kwargs={"max_episode_steps": 7}).make()
    assert env.observation_space == gym.make("CartPole-v1").observation_space
    assert env.spec.max_episode_steps == 7


def test_redundant_variables_are_means_of_neighbouring_variables():
    ranges = {"all": (-2.0, 2.0), "1": (-4.0, 4.0)}
    env = EnvironmentSpec(id="tests/Drifting-v0", ranges=ranges, redundant=3).make()
    observation, _ = env.reset(seed=1)
    position, speed = env.unwrapped.state
    first, second = (position + 2) / 4, (speed + 4) / 8
    mean = 0.5 * (first + second)
    np.testing.assert_allclose(observation, [first, second, mean, mean, mean], rtol=1e-15)
    assert env.observation_space == gym.spaces.Box(0.0, 1.0, (5,), np.float64)


@pytest.mark.parametrize("redundant", [1, 5])
def test_the_description_of_the_scaling_reproduces_observations(redundant):
    environment = EnvironmentSpec(
        id="tests/Drifting-v0", ranges={"all": (-0.3, 0.4), "1": (-4.0, 4.0)}, redundant=redundant
    )
    scaled, bare = environment.make(), gym.make("tests/Drifting-v0")
    low, high = environment.scaling().ends
    lines = list(environment.scaling().lines())
    for seed in range(5):
        computed = {}  # the scaled observation, from the described ranges and means only
        values, _ = bare.reset(seed=seed)
        for line in lines:
            name, variable, first, last, left, right = re.fullmatch(
                r"(\S+): (?:variable (\d), from (\S+) to (\S+)|the mean of (\S+) and (\S+))", line
            ).groups()
            if variable is None:
                computed[name] = (computed[left] + computed[right]) / 2
            else:
                unit = (values[int(variable)] - float(first)) / (float(last) - float(first))
                computed[name] = min(max(unit, 0.0), 1.0)
        observation, _ = scaled.reset(seed=seed)
        assert list(computed) == [f"observation[{i}]" for i in range(2 + redundant)]
        np.testing.assert_allclose(observation, list(computed.values()), rtol=1e-15)
        without_redundant, _ = UnitSensors(bare, low, high).reset(seed=seed)
        assert np.array_equal(observation[:2], without_redundant)


def test_without_noise_and_redundancy_there_is_no_scaling():
    environment = EnvironmentSpec(id="tests/Drifting-v0", ranges={"all": (-0.3, 0.4)})
    assert environment.scaling() is None


def test_noise_is_a_share_of_the_range_and_reproducible_by_seed():
    environment = EnvironmentSpec(
        id="tests/Drifting-v0", ranges={"all": (-50.0, 50.0)}, noise=0.02, redundant=1
    )
    env = environment.make()
    assert isinstance(env, NoisySensors)

    def errors(env, seed):
        """Return the noise of two variables and of their mean in 40 steps, (40, 3)."""
        differences = []
        observation, _ = env.reset(seed=seed)
        for _ in range(40):
            position, speed = (env.unwrapped.state + 50) / 100
            differences.append(observation - [position, speed, 0.5 * (position + speed)])
            observation, *_ = env.step(np.zeros(1, np.float32))
        return np.array(differences)

    first = errors(env, 3)
    # The deviation of 120 numbers varies by 1 / sqrt(240) = 6 %.
    assert first.std() == pytest.approx(0.02, rel=0.2)
    assert np.array_equal(errors(env, 3), first), "the noise depends on the seed only"
    assert not np.array_equal(errors(env, 4), first)
    assert not np.array_equal(errors(environment.make("evaluation_sensor_noise"), 3), first)


def test_discrete_observations_are_flattened_to_one_hot_vectors():
    env = EnvironmentSpec(id="FrozenLake-v1", redundant=1).make()
    observation, _ = env.reset(seed=0)
    # The first of 16 cells, and as redundant variable the mean of the first two.
    assert observation.tolist() == [1.0, *[0.0] * 15, 0.5]


@pytest.mark.parametrize(
    ("environment", "key", "words"),
    [
        ({"id": "Nothing-v0"}, "environment.id", "Nothing-v0"),
        ({"id": "nowhere:a/B-v0"}, "environment.id", "nowhere:a/B-v0"),
        ({"id": "CartPole-v1", "kwargs": {"colour": 1}}, "environment.kwargs", "colour"),
        ({"id": "CartPole-v1", "noise": 0.1}, "environment.ranges.1", "1, 3"),
        ({"id": "CartPole-v1", "redundant": 1}, "environment.ranges.1", "lowest and highest"),
        ({"id": "CartPole-v1", "noise": 0.1, "ranges": {"4": (0, 1)}}, "environment.ranges.4", "4"),
        ({"id": "CartPole-v1", "ranges": {"0": (0, float("inf"))}}, "ranges.0", "finite"),
        ({"id": "CartPole-v1", "kwargs": {"function": print}}, "kwargs", "JSON"),
    ],
)
def test_impossible_environments_are_refused_with_their_key(environment, key, words):
    with pytest.raises(ConfigError, match=words) as caught:
        EnvironmentSpec(**environment).make()
    assert caught.value.key == key
