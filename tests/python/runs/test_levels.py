"""Levels beside learning curves: goals, random actions and stored baselines."""

import gymnasium as gym
import numpy as np
import pytest

from refusals import refuses
from sdnn.runs import ConfigError, EnvironmentSpec
from sdnn.runs.levels import baseline_names, goal_of, levels_of, mean_random_return

CARTPOLE = EnvironmentSpec(id="CartPole-v1")


def test_goals_are_those_of_registrations_unless_arguments_change_the_environment():
    registered = gym.spec("CartPole-v1").reward_threshold
    assert goal_of(CARTPOLE) == registered == 475
    assert goal_of(CARTPOLE.replace(noise=0.1, ranges={"all": (-1.0, 1.0)})) == registered
    assert goal_of(CARTPOLE.replace(kwargs={"sutton_barto_reward": True})) is None
    assert goal_of(EnvironmentSpec(id="Pendulum-v1")) is None
    assert goal_of(EnvironmentSpec(id="a_module:Unknown-v0")) is None


def test_the_mean_return_of_random_actions_is_that_of_environments_where_it_is_known():
    # Without reaching the goal, an episode of MountainCar has 200 steps of reward -1.
    assert mean_random_return(EnvironmentSpec(id="MountainCar-v0")) == -200
    n_steps = 10
    limited = EnvironmentSpec(id="Pendulum-v1", kwargs={"max_episode_steps": n_steps})
    lowest_reward = -(np.pi**2 + 0.1 * 8.0**2 + 0.001 * 2.0**2)  # angle, speed, torque of Pendulum
    assert n_steps * lowest_reward < mean_random_return(limited) < 0
    assert 15 < mean_random_return(CARTPOLE) < 30, "a random episode of CartPole has about 22 steps"


def test_the_mean_return_of_random_actions_is_the_same_each_time():
    first = mean_random_return(CARTPOLE)
    mean_random_return.cache_clear()
    assert mean_random_return(CARTPOLE) == first


@pytest.fixture
def foreign_environment():
    """A registered environment of a user, which raises an error when it is made."""

    def make(**kwargs):
        raise AssertionError

    gym.register("Foreign-v0", entry_point=make)
    yield EnvironmentSpec(id="Foreign-v0")
    del gym.registry["Foreign-v0"]


def test_environments_of_users_are_not_stepped(foreign_environment):
    assert mean_random_return(foreign_environment) is None
    assert mean_random_return(EnvironmentSpec(id="not_imported:X-v0")) is None


def test_stored_baselines_are_those_of_the_unchanged_environment():
    names = baseline_names()
    assert {"PPO", "SAC", "stream AC", "tile coding"} <= set(names)
    noisy = CARTPOLE.replace(noise=0.1)
    levels, notes = levels_of({"clean": CARTPOLE, "noisy": noisy}, ["PPO"], plain=True)
    assert [(level.task, level.title, level.value) for level in levels] == [("clean", "PPO", 500)]
    assert notes == ["noisy: no stored return of PPO"]
    levels, _ = levels_of({"clean": CARTPOLE})
    assert [level.title for level in levels] == ["goal", "random actions"]
    refuses("PPO", levels_of, {"clean": CARTPOLE}, ["ppo"], error=ConfigError)
