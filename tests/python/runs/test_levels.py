"""Levels beside learning curves: goals, random actions and stored baselines."""

import gymnasium as gym
import pytest

from refusals import refuses
from sdnn.runs import EnvironmentSpec, RunError
from sdnn.runs.levels import baseline_names, goal_of, levels_of, mean_random_return

CARTPOLE = EnvironmentSpec(id="CartPole-v1")


def test_goals_are_those_of_registrations_unless_arguments_change_the_environment():
    assert goal_of(CARTPOLE) == gym.spec("CartPole-v1").reward_threshold == 475
    assert goal_of(CARTPOLE.replace(noise=0.1, ranges={"all": (-1.0, 1.0)})) == 475
    assert goal_of(CARTPOLE.replace(kwargs={"sutton_barto_reward": True})) is None
    assert goal_of(EnvironmentSpec(id="Pendulum-v1")) is None
    assert goal_of(EnvironmentSpec(id="a_module:Unknown-v0")) is None


def test_random_actions_in_an_environment_of_known_returns():
    # Without reaching the goal, an episode of MountainCar has 200 steps of reward -1.
    assert mean_random_return(EnvironmentSpec(id="MountainCar-v0")) == -200
    limited = EnvironmentSpec(id="Pendulum-v1", kwargs={"max_episode_steps": 10})
    assert -170 < mean_random_return(limited) < 0
    mean_random_return.cache_clear()
    assert mean_random_return(CARTPOLE) == mean_random_return(CARTPOLE.replace(noise=0.0))
    assert 15 < mean_random_return(CARTPOLE) < 30


@pytest.fixture
def foreign_environment():
    """An environment that must not be stepped without being asked for."""

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
    refuses("PPO", levels_of, {"clean": CARTPOLE}, ["ppo"], error=RunError)
