"""The command ``sdnn record``: a moving picture of a run's agent."""

from __future__ import annotations

import os
from pathlib import Path

import click

from sdnn.cli.common import (
    NEW_FILE,
    WARMING_UP,
    check_ending,
    run_argument,
    run_command,
    seed_option,
    words_of_run,
)


@click.command(short_help="Record an episode of a run as .gif or .mp4.")
@run_argument
@click.argument("out", metavar="OUT", type=NEW_FILE)
@seed_option
@click.option(
    "--steps",
    type=click.IntRange(min=1),
    help="Most steps to record.  [default: the whole episode]",
)
def record(folder: Path, out: Path, seed: int | None, steps: int | None) -> None:
    """Record a greedy episode of RUN's agent as OUT, a .gif or .mp4 file.

    It is the first episode of `sdnn evaluate` with the same seed.
    """
    os.environ.setdefault("SDL_VIDEODRIVER", "dummy")  # pictures need no screen
    from sdnn.runs import Run
    from sdnn.runs.recording import SUFFIXES, record as record_run

    check_ending("OUT", out, SUFFIXES)
    with run_command(words_of_run(folder)):
        recording = record_run(Run.open(folder), out, seed=seed, max_steps=steps)
    click.echo(f"wrote {out}: {recording.n_frames} frames, return {recording.total_reward:.6g}")
    if recording.is_warming_up:
        click.echo(WARMING_UP)
