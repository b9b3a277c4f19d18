"""A greedy episode as a moving picture: GIF, or MP4."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import ExitStack, closing
from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from sdnn.agents import UnusableStepError
from sdnn.environments.types import Env
from sdnn.runs.environment import render_modes
from sdnn.runs.errors import RunError
from sdnn.runs.run import Run
from sdnn.support.files import whole_file
from sdnn.training.evaluation import greedy_episode

SUFFIXES = (".gif", ".mp4")

_PALETTES = "split[a][b];[a]palettegen=stats_mode=single[p];[b][p]paletteuse=new=1:dither=none"
"""ffmpeg's filter for a palette per frame: a common one would keep all frames in memory."""

FRAMES_PER_SECOND = 30  # frame rate for environments without one in their metadata

_FASTEST_GIF = 50  # largest frame rate: viewers slow faster GIFs down


@dataclass
class Recording:
    """A recorded episode; ``is_warming_up``: all actions of the agent are random."""

    is_warming_up: bool
    n_frames: int = 0
    total_reward: float = 0.0


def record(
    run: Run, path: Path, *, seed: int | None = None, max_steps: int | None = None
) -> Recording:
    """Record a greedy episode of a run's agent: the first of `Run.evaluate` with the same seed.

    It shows what environments draw between steps, where they have the render mode
    ``"rgb_array_list"`` themselves. The file's suffix chooses the format.

    RunError if the suffix is another, a package is missing, the environment cannot be rendered,
    differs or gives what cannot be evaluated, or there is no agent yet; OSError if the file cannot
    be written.
    """
    if path.suffix not in SUFFIXES:
        raise RunError(f"out must end in one of {', '.join(SUFFIXES)}, got {path}")
    if find_spec("imageio_ffmpeg") is None:
        raise RunError(f"{path} needs imageio-ffmpeg, which is missing: pip install imageio-ffmpeg")
    agent = run.agent()
    root = run.fresh_seed if seed is None else seed
    recording = Recording(agent.is_warming_up)
    env = run.spec.make_env("evaluation_sensor_noise", render_mode="rgb_array")
    if "rgb_array_list" in render_modes(env):  # several pictures a step: smoother motion
        env.close()
        env = run.spec.make_env("evaluation_sensor_noise", render_mode="rgb_array_list")
    with closing(env):
        run.check_spaces(agent, env)

        def frames() -> Iterator[NDArray[np.uint8]]:
            """Yield the pictures of a greedy episode, and count them in `recording`."""
            for now in greedy_episode(agent, env, root, 0, run.reset_options(env)):
                recording.total_reward = now.total_reward
                for frame in _rendered(env):
                    recording.n_frames += 1
                    yield frame
                if now.n_steps == max_steps:
                    break
            if recording.n_frames == 0:
                raise RunError("render() must give pictures, got none")

        rate = float((env.metadata or {}).get("render_fps") or FRAMES_PER_SECOND)
        path.parent.mkdir(parents=True, exist_ok=True)
        try:
            _write_frames(path, frames(), rate)
        except UnusableStepError as error:
            raise RunError(f"{run.spec.task}: {error}") from error
    return recording


def _rendered(env: Env) -> Iterator[NDArray[np.uint8]]:
    """Yield the frames of the present step, shape (height, width, 3)."""
    try:
        rendered: object = env.render()
    except gym.error.DependencyNotInstalled as error:
        raise RunError(f"pictures of this environment need more: {error}") from error
    for picture in rendered if isinstance(rendered, list) else [rendered]:
        frame = np.asarray(picture)
        if frame.ndim != 3 or frame.shape[2] != 3 or frame.dtype != np.uint8:
            expected = "a picture of red, green and blue"
            raise RunError(f"render() must give {expected}, got {frame!r:.80}")
        yield frame


def _write_frames(path: Path, frames: Iterator[NDArray[np.uint8]], rate: float) -> None:
    """Encode pictures as MP4 or GIF with ffmpeg, one at a time to save memory."""
    import imageio_ffmpeg

    is_gif = path.suffix == ".gif"
    options: dict[str, object] = {"quality": 7, "output_params": ["-f", "mp4"]}
    if is_gif:
        rate = min(rate, _FASTEST_GIF)
        delay = str(round(100 / rate) + 100)  # in 1/100 s: the last picture stays a second longer
        parameters = ["-f", "gif", "-vf", _PALETTES, "-final_delay", delay]
        options = {"codec": "gif", "pix_fmt_out": "pal8", "output_params": parameters}
    with whole_file(path) as file, ExitStack() as stack:
        writer = None
        for frame in frames:
            if not is_gif:  # the pictures of MP4 have even sides: repeat the last row or column
                edges = [(0, n % 2) for n in frame.shape[:2]] + [(0, 0)]
                frame = np.pad(frame, edges, mode="edge")
            if writer is None:
                size = (frame.shape[1], frame.shape[0])
                writer = imageio_ffmpeg.write_frames(
                    file.name, size, fps=rate, macro_block_size=1, **options
                )
                stack.enter_context(closing(writer))
                writer.send(None)
            writer.send(np.ascontiguousarray(frame))
