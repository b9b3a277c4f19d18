"""A goal that tightens with the number of the learning episode."""

import pickle
import warnings

import gymnasium as gym
import numpy as np
import pytest
from gymnasium.utils.env_checker import check_env

from refusals import refuses
from sdnn.environments import (
    AcrobotConfig,
    AcrobotSwingUpEnv,
    GoalSchedule,
    GoalScheduleConfig,
    NoisySensors,
    RedundantSensors,
    TighteningGoal,
)

ID = "sdnn/AcrobotSwingUp-v0"


def tolerance_after_reset(env, **arguments):
    return env.reset(**arguments)[1]["goal_tolerance"]


@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_gymnasiums_check_env_finds_no_fault(dtype):
    env = TighteningGoal(AcrobotSwingUpEnv(dtype=dtype))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        warnings.filterwarnings("ignore", message=".*different from the unwrapped version")
        check_env(env, skip_render_check=True)


def test_the_goal_tolerance_follows_the_schedule_of_the_episode():
    env = TighteningGoal(AcrobotSwingUpEnv())
    schedule = GoalSchedule()
    for episode in (1, 2, 100, 10000, 10001, 3):
        assert tolerance_after_reset(env, options={"episode": episode}) == schedule(episode)
        assert env.episode == episode


def test_a_reset_without_an_episode_keeps_the_last_one():
    env = TighteningGoal(gym.make(ID))
    assert env.episode == 1
    assert tolerance_after_reset(env) == GoalSchedule()(1)
    assert tolerance_after_reset(env, options={"episode": 300}) == 0.25  # 1 / (1 + 300 / 100)
    for reset in ({}, {"seed": 3}, {"options": {}}):
        assert tolerance_after_reset(env, **reset) == 0.25
        assert env.episode == 300


def test_an_episode_that_is_set_holds_from_the_next_reset_on():
    env = TighteningGoal(AcrobotSwingUpEnv())
    env.reset()
    env.episode = 100
    assert env.step([0.0])[4]["goal_tolerance"] == GoalSchedule()(1)
    assert [tolerance_after_reset(env) for _ in range(2)] == [0.5, 0.5], "1 / (1 + 100 / 100)"


def test_a_schedule_may_be_a_function_or_a_configuration():
    env = TighteningGoal(AcrobotSwingUpEnv(), lambda episode: 0.5**episode)
    assert [tolerance_after_reset(env, options={"episode": k}) for k in (1, 2, 3)] == [
        0.5,
        0.25,
        0.125,
    ]
    constant = GoalSchedule(GoalScheduleConfig(kind="constant", constant_value=0.3))
    assert tolerance_after_reset(TighteningGoal(AcrobotSwingUpEnv(), schedule=constant)) == 0.3
    assert "constant" in repr(constant)
    assert pickle.loads(pickle.dumps(constant))(7) == 0.3


def test_the_number_of_the_episode_reaches_the_schedule_through_other_wrappers():
    env = NoisySensors(TighteningGoal(RedundantSensors(gym.make(ID, config=AcrobotConfig()))))
    assert tolerance_after_reset(env, options={"episode": 100}) == 0.5  # 1 / (1 + 100 / 100)
    env.set_wrapper_attr("episode", 300)
    assert tolerance_after_reset(env) == 0.25  # 1 / (1 + 300 / 100)
    assert env.get_wrapper_attr("goal_tolerance") == 0.25


def test_environments_of_a_vector_have_separate_goals():
    envs = gym.make_vec(
        ID,
        num_envs=2,
        vectorization_mode="sync",
        wrappers=[TighteningGoal],
        config=AcrobotConfig(max_decisions=1),
    )
    infos = envs.reset(options={"episode": 100})[1]
    assert infos["goal_tolerance"].tolist() == [0.5, 0.5]  # 1 / (1 + 100 / 100)
    envs.set_attr("episode", [300, 1])
    no_torque = np.zeros((2, 1), np.float32)
    # Episodes have one step, so that the second step begins the episodes 300 and 1.
    assert envs.step(no_torque)[4]["goal_tolerance"].tolist() == [0.5, 0.5]
    assert envs.step(no_torque)[4]["goal_tolerance"].tolist() == [0.25, GoalSchedule()(1)]


def test_the_wrapper_is_recreated_from_the_spec():
    env = TighteningGoal(gym.make(ID), schedule=lambda episode: 1.0 / episode)
    recreated = gym.make(env.spec)
    assert tolerance_after_reset(recreated, options={"episode": 4}) == 0.25


def test_bad_episodes_options_schedules_and_environments_are_refused():
    env = TighteningGoal(AcrobotSwingUpEnv())
    for episode in (0, -1, 1.5):
        refuses("episode", env.reset, options={"episode": episode})
        refuses("episode", setattr, env, "episode", episode)
    refuses("'episode'", env.reset, options={"goal_tolerance": 0.5})
    refuses("epsiode", env.reset, options={"episode": 5, "epsiode": 3})
    refuses("goal_tolerance", TighteningGoal(AcrobotSwingUpEnv(), lambda episode: -1.0).reset)
    assert env.episode == 1
    refuses("env", TighteningGoal, gym.make("CartPole-v1"))
