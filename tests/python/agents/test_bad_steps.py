"""Results of `step` and `reset` that the interface does not allow are refused."""

import gymnasium as gym
import numpy as np
import pytest

from bad_values import BAD
from refusals import refuses
from sdnn.agents import RBFQLearning, UnusableStepError, evaluate

RESULTS = ("reward", "terminated", "truncated")
MORE_BAD = {
    "a list": [False],
    "an array": np.array([False]),
    "a label": "False",
    "0-d": np.array(False),
}
REWARDS = {"-1", "0", "0.5", "2**20", "2**31", "2**63", "-2**63", "True", "0-d", "an array"}
"""Labels of values that are valid rewards; larger numbers cannot be learned."""


class Point(gym.Env):
    """Episodes of four equal steps; a test may change the results of step 3 and of reset."""

    observation_space = gym.spaces.Box(-1.0, 1.0, (2,), np.float64)
    action_space = gym.spaces.Discrete(2)

    def __init__(self, change=lambda result: result, change_reset=lambda result: result):
        self._change, self._change_reset = change, change_reset

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self._n = 0
        return self._change_reset((np.zeros(2), {}))

    def step(self, action):
        self._n += 1
        result = (np.zeros(2), 1.0, False, self._n == 4, {})
        return self._change(result) if self._n == 3 else result


class Points(gym.vector.VectorEnv):
    """Two environments without ends of episodes; a test may replace columns of their results."""

    metadata = {"autoreset_mode": "Disabled"}  # noqa: RUF012
    num_envs = 2
    single_observation_space = Point.observation_space
    single_action_space = Point.action_space
    observation_space = gym.spaces.Box(-1.0, 1.0, (2, 2), np.float64)
    action_space = gym.spaces.MultiDiscrete([2, 2])

    def __init__(self, **columns):
        self._columns = columns

    def reset(self, *, seed=None, options=None):
        return np.zeros((2, 2)), {}

    def step(self, actions):
        columns = {"reward": np.zeros(2), **dict.fromkeys(RESULTS[1:], np.zeros(2, bool))}
        return np.zeros((2, 2)), *(columns | self._columns).values(), {}


def trained(env):
    return RBFQLearning(env, seed=1).train(env, steps=20)


def evaluated(env):
    return evaluate(RBFQLearning(env, seed=1), env, episodes=2)


def with_value(name, value):
    """Return a function that replaces a result of `step`."""
    index = 1 + RESULTS.index(name)  # an observation comes first
    return lambda results: (*results[:index], value, *results[index + 1 :])


def bad_values(name):
    """Return values, by label, that are invalid for a result of `step`."""
    good = REWARDS if name == "reward" else {"True"}
    values = {label: make() for label, make in BAD.items()} | MORE_BAD
    return {label: value for label, value in values.items() if label not in good}


@pytest.mark.parametrize("use", [trained, evaluated])
@pytest.mark.parametrize("name", RESULTS)
def test_invalid_rewards_and_flags_are_refused_with_the_number_of_the_step(name, use):
    for label, value in bad_values(name).items():
        if name == "reward" and use is evaluated and label in ("1e308", "-1e308"):
            continue  # a return of such rewards is finite, and nothing is learned
        with pytest.raises(UnusableStepError, match=rf"step 3 of .*\b{name}\b"):
            use(Point(with_value(name, value)))


@pytest.mark.parametrize("name", RESULTS[1:])
def test_numpy_bools_end_an_episode_like_python_bools(name):
    env = Point(with_value(name, np.True_))  # in step 3
    assert trained(env).returns.tolist() == [3.0] * 6  # of 20 steps, each with a reward of 1
    assert evaluated(env).lengths.tolist() == [3, 3]


@pytest.mark.parametrize("name", RESULTS)
def test_rewards_and_flags_of_a_vector_need_a_valid_value_for_each_environment(name):
    for label, value in bad_values(name).items():
        # Two arrays without dimensions would be two valid flags.
        for column in (value, [value] * (3 if label == "0-d" else 2)):
            with pytest.raises(UnusableStepError, match=rf"\b{name}\b"):
                trained(Points(**{name: column}))
    assert trained(Points(**{name: [False, False]})).n_steps == 20


@pytest.mark.parametrize(
    "observation", [None, {"a": 1}, np.array([0, "a"], object), np.zeros((1, 2))]
)
def test_invalid_observations_of_a_vector_are_refused_with_the_number_of_the_step(observation):
    bad = Point(lambda results: (observation, *results[1:]))
    envs = gym.vector.SyncVectorEnv([Point, lambda: bad])
    # Two environments have learned two steps each, 0 to 3; the bad one has number 5 of 4 and 5.
    with pytest.raises(UnusableStepError, match="in step 5: next_observation must"):
        trained(envs)


@pytest.mark.parametrize("use", [trained, evaluated])
def test_results_of_step_of_another_length_and_malformed_ones_of_reset_are_refused(use):
    for n_results in (1, 4, 6):  # instead of five
        with pytest.raises(UnusableStepError, match=rf"\b{n_results}\b"):
            use(Point(lambda results, n_results=n_results: (results * 2)[:n_results]))
    for bad_reset in (np.zeros(2), (np.zeros(2),), (np.zeros(2), None), (0.0, 0.0)):
        env = Point(change_reset=lambda results, bad_reset=bad_reset: bad_reset)
        refuses("observation", use, env, error=UnusableStepError)
