"""The acrobot swing-up as a Gymnasium environment."""

import itertools
import warnings
from typing import ClassVar

import gymnasium as gym
import numpy as np
import pygame
import pytest
from gymnasium.utils.env_checker import check_env

from processes import python
from refusals import refuses
from sdnn import _core
from sdnn.environments import AcrobotConfig, AcrobotSwingUpEnv
from sdnn.environments.picture import AcrobotMotion

ID = "sdnn/AcrobotSwingUp-v0"


class FakeClock:
    """A clock of pygame that does not wait, and records the frame rates."""

    frame_rates: ClassVar[list[float]] = []

    def tick(self, frame_rate):
        self.frame_rates.append(frame_rate)


@pytest.fixture(autouse=True)
def no_screen(monkeypatch):
    monkeypatch.setenv("SDL_VIDEODRIVER", "dummy")
    monkeypatch.setattr(pygame.time, "Clock", FakeClock)


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
    process = python("-W", "error", "-c", code)
    assert process.returncode == 0, process.stderr


def test_a_missing_gymnasium_is_named():
    code = "import sys, sdnn; sys.modules['gymnasium'] = None; sdnn.environments"
    assert "gymnasium" in python("-c", code).stderr.splitlines()[-1]


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
        # Actions are shares of the largest torque.
        for share in np.random.default_rng(episode).uniform(-1.0, 1.0, 50):
            observation, *result, info = env.step(np.array([share]))
            assert tuple(result) == core.step(AcrobotConfig().max_torque * share, tolerance)
            np.testing.assert_array_equal(info["state"], core.state())
            np.testing.assert_array_equal(observation, sensors.observe(core.state()))
            assert info["tip_height"] == core.tip_height()
            _, terminated, truncated = result
            assert info["is_success"] == terminated
            if terminated or truncated:
                n_finished += 1
                break
    assert n_finished == n_episodes


def test_an_episode_is_truncated_after_50_decisions_and_then_needs_a_reset():
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


def test_the_goal_tolerance_is_a_share_of_the_speed_limits_of_both_joints():
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
    for action in (np.nan, np.inf, -np.inf, 1.01, -1.01):
        refuses("action", env.step, [action])
    refuses("action", env.step, [0.0, 0.0])
    for tolerance in (-0.1, np.nan):
        refuses("goal_tolerance", env.reset, options={"goal_tolerance": tolerance})
        refuses("goal_tolerance", setattr, env, "goal_tolerance", tolerance)
    refuses("goal_tolerance", env.reset, options={"goal_tolerance": "low"})
    refuses("'episode'", env.reset, options={"episode": 3})
    assert env.goal_tolerance == 1.0


def test_frames_change_only_with_the_state_and_show_the_torque():
    env = AcrobotSwingUpEnv(render_mode="rgb_array")
    env.reset()
    hanging = env.render()
    assert hanging.shape == (500, 500, 3)
    assert hanging.dtype == np.uint8
    assert len(np.unique(hanging.reshape(-1, 3), axis=0)) > 20, "colours"
    np.testing.assert_array_equal(env.render(), hanging)
    env.step([1.0])
    moved = env.render()
    assert (moved != hanging).any(axis=2).mean() > 0.01

    def n_orange_pixels(frame):  # of the torque's arrow
        red, green, blue = np.moveaxis(frame.astype(int), 2, 0)
        return ((red > 200) & (green > 90) & (green < 160) & (blue < 90)).sum()

    assert n_orange_pixels(hanging) == 0
    assert n_orange_pixels(moved) > 300
    env.close()
    env.close()  # a second time, without an error


def test_human_mode_draws_25_frames_per_second_and_render_returns_none(monkeypatch):
    monkeypatch.setattr(FakeClock, "frame_rates", [])
    env = AcrobotSwingUpEnv(render_mode="human")
    env.reset()
    env.step([1.0])
    assert FakeClock.frame_rates == (1 + 25) * [25]  # a frame of the reset, 25 of the decision
    assert env.render() is None
    env.close()


def test_rgb_array_list_has_25_frames_per_decision():
    env, frames = AcrobotSwingUpEnv(render_mode="rgb_array_list"), []
    of_decisions = AcrobotSwingUpEnv(render_mode="rgb_array")  # renders only after decisions
    assert env.metadata["render_fps"] == 25
    assert of_decisions.metadata["render_fps"] == 4  # decisions of 1 s are shown faster
    env.reset()
    of_decisions.reset()
    for torque in (1.0, -1.0):
        frames += env.render()
        np.testing.assert_array_equal(frames[-1], of_decisions.render())
        assert env.render() == [], "all frames have been returned"
        env.step([torque])
        of_decisions.step([torque])
    frames += env.render()
    assert len(frames) == 1 + 2 * 25  # a frame of the reset, and 25 of each decision
    assert all((frame != later).any() for frame, later in itertools.pairwise(frames))
    env.step([0.0])
    env.reset()  # drops the frames before it
    (hanging,) = env.render()
    np.testing.assert_array_equal(hanging, frames[0])
    env.close()
    of_decisions.close()


def test_rgb_array_list_ends_at_the_goal_with_a_greener_frame():
    env = AcrobotSwingUpEnv(render_mode="rgb_array_list", goal_tolerance=1e6)
    rng = np.random.default_rng(0)
    env.reset()
    terminated = False
    while not terminated:
        env.render()
        _, _, terminated, truncated, info = env.step([rng.uniform(-1.0, 1.0)])
        if truncated:
            env.reset()
    frames = env.render()
    assert info["is_success"]
    assert 1 <= len(frames) <= 25

    def n_green_pixels(frame):  # of the tip, the line and the words
        red, green, blue = np.moveaxis(frame.astype(int), 2, 0)
        return ((green > red + 40) & (green > blue + 20)).sum()

    assert n_green_pixels(frames[-1]) > 1.2 * n_green_pixels(frames[0])
    env.close()


@pytest.mark.parametrize(
    ("decision_interval", "integration_step", "n_frames", "frames_per_second"),
    [(1.0, 0.02, 25, 25), (0.5, 0.02, 25, 50), (0.5, 0.05, 10, 20), (0.02, 0.02, 1, 50)],
)
def test_frames_divide_the_decision_interval_evenly(
    decision_interval, integration_step, n_frames, frames_per_second
):
    config = AcrobotConfig(decision_interval=decision_interval, integration_step=integration_step)
    env = AcrobotSwingUpEnv(config=config, render_mode="rgb_array_list")
    env.reset()
    env.render()
    env.step([1.0])
    assert len(env.render()) == n_frames
    assert env.metadata["render_fps"] == frames_per_second
    env.close()


def test_states_between_decisions_are_those_of_shorter_decisions():
    config = AcrobotConfig()
    acrobot = _core.Acrobot(config)
    acrobot.step(3.0, 0.0)
    before = acrobot.state()
    acrobot.step(-7.0, 0.0)
    # A decision of 1 s has 25 frames, 0.04 s apart, the last of which is at its end.
    expected = _core.Acrobot(AcrobotConfig(decision_interval=0.04, max_decisions=99))
    expected.set_state(before)
    for state in AcrobotMotion(config).between(before, -7.0, 0.0):
        expected.step(-7.0, 0.0)
        np.testing.assert_array_equal(state, expected.state())
    expected.step(-7.0, 0.0)
    np.testing.assert_allclose(expected.state(), acrobot.state(), rtol=1e-9)


def test_render_without_a_mode_warns_and_returns_none():
    env = AcrobotSwingUpEnv()
    env.reset()
    with pytest.warns(UserWarning, match="render_mode"):
        assert env.render() is None
