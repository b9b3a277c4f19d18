"""Recordings of an evaluation episode as GIF and MP4."""

import re
import subprocess

import gymnasium as gym
import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image

import drifting_env
from refusals import refuses
from run_specs import run_spec
from sdnn.runs import EnvironmentSpec, Run, RunError
from sdnn.runs.recording import record
from sdnn.training.episodes import EVALUATION, episode_seed


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    config = run_spec(
        environment=EnvironmentSpec(
            id="tests/Drifting-v0", ranges={"all": (-4.0, 4.0)}, noise=0.01
        ),
        agent="rbf",
        settings={"approximator": {"n_actions": 5}},
        steps=100,
        evaluate_every=0,
    )
    made = Run.create(tmp_path_factory.mktemp("recording") / "run", config)
    made.train()
    return made


def test_a_gif_shows_every_state_of_an_evaluation_episode(run, tmp_path):
    recording = record(run, tmp_path / "x.gif", seed=5)
    evaluation = run.evaluate(1, seed=5)
    assert recording.n_frames == evaluation.lengths[0] + 1
    assert recording.total_reward == pytest.approx(evaluation.returns[0], rel=1e-12)
    with Image.open(tmp_path / "x.gif") as picture:
        assert picture.size == (65, 33), "as the environment draws it"
        durations = 0
        for number in range(picture.n_frames):
            picture.seek(number)
            durations += picture.info["duration"]
        # Equal frames in a row are one that is shown longer; the last one is for a second more.
        frame = 1000 / drifting_env.DriftingEnv.metadata["render_fps"]  # in milliseconds
        assert durations == frame * recording.n_frames + 1000
        picture.seek(0)
        first = np.asarray(picture.convert("RGB"))
    env = gym.make("tests/Drifting-v0", render_mode="rgb_array")
    env.reset(seed=episode_seed(5, EVALUATION, 0))
    assert np.array_equal(first, env.render())


def test_max_steps_limits_the_frames_of_a_recording(run, tmp_path):
    assert record(run, tmp_path / "x.gif", max_steps=5).n_frames == 1 + 5


def test_an_mp4_has_even_sides_and_every_frame(run, tmp_path):
    recording = record(run, tmp_path / "x.mp4", seed=5)
    program = imageio_ffmpeg.get_ffmpeg_exe()
    command = [program, "-i", tmp_path / "x.mp4", "-f", "null", "-"]
    process = subprocess.run(command, capture_output=True, text=True)
    assert "66x34" in process.stderr, "one more than the 65 x 33 of the environment"
    assert "10 fps" in process.stderr
    assert re.findall(r"frame= *(\d+)", process.stderr)[-1] == str(recording.n_frames)
    assert [path.name for path in tmp_path.iterdir()] == ["x.mp4"]


@pytest.mark.filterwarnings("ignore:.*render_modes")
def test_environments_without_render_metadata_are_recorded(run, tmp_path, monkeypatch):
    monkeypatch.setattr(drifting_env.DriftingEnv, "metadata", {})
    assert record(run, tmp_path / "x.gif", max_steps=3).n_frames == 1 + 3  # the reset's, and steps'
    assert run.train(steps=101).has_pictures is False


def test_recordings_show_frames_between_decisions(tmp_path):
    config = run_spec(
        environment=EnvironmentSpec(id="sdnn/AcrobotSwingUp-v0"), agent="rbf", steps=60
    )
    run = Run.create(tmp_path / "run", config)
    run.train()
    recording = record(run, tmp_path / "x.gif", max_steps=2)
    assert recording.n_frames == 1 + 2 * 25  # the reset's, and 25 of each decision
    with Image.open(tmp_path / "x.gif") as picture:
        assert picture.n_frames == recording.n_frames
        assert picture.info["duration"] == 1000 / 25  # milliseconds: a decision takes a second


def test_a_missing_imageio_ffmpeg_is_named(run, tmp_path, monkeypatch):
    monkeypatch.setattr("sdnn.runs.recording.find_spec", lambda name: None)
    refuses("imageio-ffmpeg", record, run, tmp_path / "x.gif", error=RunError)


def test_unknown_formats_and_invalid_frames_are_refused(run, tmp_path, monkeypatch):
    refuses(".gif", record, run, tmp_path / "x.avi", error=RunError)
    for picture in (None, "text", np.zeros((3, 3)), []):
        monkeypatch.setattr(drifting_env.DriftingEnv, "render", lambda self, p=picture: p)
        for name in ("x.gif", "x.mp4"):
            refuses("render", record, run, tmp_path / name, error=RunError)
    assert list(tmp_path.iterdir()) == []
