"""The acrobot swing-up as a Gymnasium environment."""

import itertools
import subprocess
import sys
import warnings
from typing import ClassVar

import gymnasium as gym
import numpy as np
import pygame
import pytest
from gymnasium.utils.env_checker import check_env

from refusals import refuses
from sdnn import _core
from sdnn.environments import AcrobotConfig, AcrobotSwingUpEnv
from sdnn.environments.picture import AcrobotMotion

ID = "sdnn/AcrobotSwingUp-v0"


class FakeClock:
    """A clock that does not wait, and records the rates."""

    ticks: ClassVar[list[float]] = []

    def tick(self, rate):
        self.ticks.append(rate)


@pytest.fixture(autouse=True)
def no_screen(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setattr(pygame.time, "Clock", FakeClock)


def shares(n, seed=0):
    return np.random.default_rng(seed).uniform(-1.0, 1.0, n)


@pytest.mark.parametrize("render_mode", [None, "rgb_array", "rgb_array_list", "human"])
@pytest.mark.parametrize("dtype", ["float32", "float64"])
def test_gymnasiums_check_env_finds_no_fault(render_mode, dtype):
    env = gym.make(ID, render_mode=render_mode, dtype=dtype)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        check_env(env.unwrapped)
    env.close()


@pytest.mark.parametrize(
    ("imports", "prefix"),
    [("import sdnn.environments", ""), ("import gymnasium", "sdnn.environments:")],
)
def test_importing_the_environments_registers_them(imports, prefix):
    code = (
        f"{imports}, gymnasium\n"
        f"assert gymnasium.make({prefix + ID!r}).observation_space.shape == (4,)\n"
        f"assert gymnasium.make_vec({prefix + ID!r}, num_envs=2).num_envs == 2\n"
    )
    process = subprocess.run(
        [sys.executable, "-W", "error", "-c", code], capture_output=True, text=True
    )
    assert process.returncode == 0, process.stderr


def test_a_missing_gymnasium_is_named():
    code = "import sys, sdnn; sys.modules['gymnasium'] = None; sdnn.environments"
    process = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)
    assert "gymnasium" in process.stderr.splitlines()[-1]


def test_the_spaces_are_unit_boxes_of_the_chosen_dtype():
    env = AcrobotSwingUpEnv()
    assert env.observation_space == gym.spaces.Box(0.0, 1.0, (4,), np.float32)
    assert env.action_space == gym.spaces.Box(-1.0, 1.0, (1,), np.float32)
    env = AcrobotSwingUpEnv(config=AcrobotConfig(max_torque=3.0), dtype="float64")
    assert env.observation_space == gym.spaces.Box(0.0, 1.0, (4,), np.float64)
    assert env.action_space == gym.spaces.Box(-1.0, 1.0, (1,), np.float64)


def test_steps_and_resets_of_the_environment_have_the_bits_of_the_core():
    env = AcrobotSwingUpEnv(dtype="float64")
    core = _core.Acrobot(AcrobotConfig())
    sensors = _core.AcrobotSensors(_core.SensorConfig(), 1, _core.Stream.sensor_noise)
    n_episodes, n_finished = 40, 0
    for episode in range(1, n_episodes + 1):
        tolerance = 1.0 / episode
        observation, info = env.reset(options={"goal_tolerance": tolerance})
        core.reset()
        np.testing.assert_array_equal(observation, sensors.observe(core.state()))
        assert info["goal_tolerance"] == tolerance
        for share in shares(50, episode):
            observation, *result, info = env.step(np.array([share]))
            assert tuple(result) == core.step(AcrobotConfig().max_torque * share, tolerance)
            np.testing.assert_array_equal(info["state"], core.state())
            np.testing.assert_array_equal(observation, sensors.observe(core.state()))
            assert info["tip_height"] == core.tip_height()
            assert info["is_success"] == result[1]
            if result[1] or result[2]:
                n_finished += 1
                break
    assert n_finished == n_episodes


def test_an_episode_is_truncated_after_50_decisions_and_needs_a_reset():
    env = gym.make(ID)
    env.reset()
    flags = [env.step(np.zeros(1, np.float32))[2:4] for _ in range(50)]
    assert flags == [(False, False)] * 49 + [(False, True)]
    refuses("reset", env.step, np.zeros(1, np.float32), error=RuntimeError)


def tolerances_around_reset(env, **reset):
    """Reset; return the goal tolerance of the environment before it, and that of the episode."""
    before = env.goal_tolerance
    return before, env.reset(**reset)[1]["goal_tolerance"]


def test_a_reset_without_the_option_keeps_the_goal_tolerance():
    env = AcrobotSwingUpEnv()
    assert env.goal_tolerance == 1.0
    for reset in ({}, {"seed": 5}, {"options": {}}, {"seed": 5, "options": None}):
        assert tolerances_around_reset(env, **reset) == (1.0, 1.0)
    env = gym.make(ID, goal_tolerance=0.25).unwrapped
    assert [tolerances_around_reset(env) for _ in range(3)] == [(0.25, 0.25)] * 3


def test_a_goal_tolerance_holds_from_the_next_reset_on():
    env = AcrobotSwingUpEnv(goal_tolerance=0.5)
    assert tolerances_around_reset(env, options={"goal_tolerance": 0.01}) == (0.5, 0.01)
    assert tolerances_around_reset(env, seed=1) == (0.01, 0.01)
    env.goal_tolerance = 0.1
    assert env.step([0.0])[4]["goal_tolerance"] == 0.01, "the current episode keeps its tolerance"
    assert tolerances_around_reset(env) == (0.1, 0.1)


def test_the_goal_tolerance_is_a_share_of_the_speed_limits():
    # The tip passes the goal at 0.615 and 1.097 rad/s: at 0.0653 of 3 pi and 0.0699 of 5 pi rad/s.
    terminated = []
    for tolerance in (0.0, 0.0695, 0.0703, np.inf):
        env = AcrobotSwingUpEnv(goal_tolerance=tolerance)
        env.reset()
        env._acrobot.set_state([2.0, 0.0, 2.0, 0.0])
        terminated.append(env.step([0.0])[2])
    assert terminated == [False, False, True, True]


def test_bad_actions_and_reset_options_are_refused_by_name():
    env = AcrobotSwingUpEnv()
    with pytest.raises(gym.error.ResetNeeded):
        env.step([0.0])
    env.reset()
    for bad in (np.nan, np.inf, -np.inf, 1.01, -1.01):
        refuses("action", env.step, [bad])
    refuses("action", env.step, [0.0, 0.0])
    for bad in (-0.1, np.nan):
        refuses("goal_tolerance", env.reset, options={"goal_tolerance": bad})
        refuses("goal_tolerance", setattr, env, "goal_tolerance", bad)
    refuses("goal_tolerance", env.reset, options={"goal_tolerance": "low"})
    refuses("'episode'", env.reset, options={"episode": 3})
    assert env.goal_tolerance == 1.0


def test_frames_change_with_the_state_and_show_the_torque():
    env = AcrobotSwingUpEnv(render_mode="rgb_array")
    env.reset()
    hanging = env.render()
    assert hanging.shape == (500, 500, 3)
    assert hanging.dtype == np.uint8
    assert len(np.unique(hanging.reshape(-1, 3), axis=0)) > 20
    np.testing.assert_array_equal(env.render(), hanging)
    env.step([1.0])
    moved = env.render()
    assert (moved != hanging).any(axis=2).mean() > 0.01

    def is_orange(picture):  # the torque's arrow
        red, green, blue = np.moveaxis(picture.astype(int), 2, 0)
        return (red > 200) & (green > 90) & (green < 160) & (blue < 90)

    assert is_orange(hanging).sum() == 0
    assert is_orange(moved).sum() > 300
    env.close()
    env.close()


def test_human_mode_draws_25_frames_per_second_and_render_returns_none(monkeypatch):
    monkeypatch.setattr(FakeClock, "ticks", [])
    env = AcrobotSwingUpEnv(render_mode="human")
    env.reset()
    env.step([1.0])
    frames_per_second = 25
    assert FakeClock.ticks == (1 + 25) * [frames_per_second]  # the reset's, and 25 of the decision
    assert env.render() is None
    env.close()


def test_rgb_array_list_has_25_frames_per_decision():
    whole, parts = AcrobotSwingUpEnv(render_mode="rgb_array"), []
    env = AcrobotSwingUpEnv(render_mode="rgb_array_list")
    assert env.metadata["render_fps"] == 25
    assert whole.metadata["render_fps"] == 4
    for environment in (whole, env):
        environment.reset()
    for torque in (1.0, -1.0):
        parts += env.render()
        np.testing.assert_array_equal(parts[-1], whole.render())
        assert env.render() == []
        for environment in (whole, env):
            environment.step([torque])
    parts += env.render()
    assert len(parts) == 1 + 2 * 25  # the reset's, and 25 of each decision
    steps = [(a != b).any(axis=2).mean() for a, b in itertools.pairwise(parts)]
    assert min(steps) > 0.0  # every picture differs from the one before
    env.step([0.0])
    env.reset()
    (hanging,) = env.render()
    np.testing.assert_array_equal(hanging, parts[0])
    env.close()
    whole.close()


def test_rgb_array_list_ends_at_the_goal():
    env = AcrobotSwingUpEnv(render_mode="rgb_array_list", goal_tolerance=1e6)
    rng = np.random.default_rng(0)
    env.reset()
    terminated = False
    while not terminated:
        env.render()
        _, _, terminated, truncated, info = env.step([rng.uniform(-1.0, 1.0)])
        if truncated:
            env.reset()
    pictures = env.render()
    assert info["is_success"]
    assert 1 <= len(pictures) <= 25

    def is_green(picture):  # the tip, the line and the words
        red, green, blue = np.moveaxis(picture.astype(int), 2, 0)
        return ((green > red + 40) & (green > blue + 20)).sum()

    assert is_green(pictures[-1]) > 1.2 * is_green(pictures[0])
    env.close()


@pytest.mark.parametrize(
    ("interval", "step", "n_pictures", "rate"),
    [(1.0, 0.02, 25, 25), (0.5, 0.02, 25, 50), (0.5, 0.05, 10, 20), (0.02, 0.02, 1, 50)],
)
def test_frames_divide_the_decision_interval_evenly(interval, step, n_pictures, rate):
    config = AcrobotConfig(decision_interval=interval, integration_step=step)
    env = AcrobotSwingUpEnv(config=config, render_mode="rgb_array_list")
    env.reset()
    env.render()
    env.step([1.0])
    assert len(env.render()) == n_pictures
    assert env.metadata["render_fps"] == rate
    env.close()


def test_states_between_decisions_are_those_of_shorter_decisions():
    config = AcrobotConfig()
    acrobot = _core.Acrobot(config)
    acrobot.step(3.0, 0.0)
    before = acrobot.state()
    states = list(AcrobotMotion(config).between(before, -7.0, 0.0))
    acrobot.step(-7.0, 0.0)
    short = _core.Acrobot(AcrobotConfig(decision_interval=0.04, max_decisions=99))
    short.set_state(before)
    for state in states:
        short.step(-7.0, 0.0)
        np.testing.assert_array_equal(state, short.state())
    short.step(-7.0, 0.0)
    np.testing.assert_allclose(short.state(), acrobot.state(), rtol=1e-9)


def test_render_without_a_mode_warns():
    env = AcrobotSwingUpEnv()
    env.reset()
    with pytest.warns(UserWarning, match="render_mode"):
        assert env.render() is None
