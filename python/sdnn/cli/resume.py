"""The command ``sdnn resume``: a run continues where it stopped."""

from __future__ import annotations

from pathlib import Path

import click

from sdnn.cli.common import json_option, run_argument, run_command, train_run, words_of_run


@click.command(short_help="Resume a run from its last checkpoint.")
@run_argument
@click.option(
    "--steps", type=click.IntRange(min=1), help="A new goal: steps in all; a target is dropped."
)
@click.option("--episodes", type=click.IntRange(min=1), help="The same in episodes.")
@click.option(
    "--new-episode", is_flag=True,
    help="Begin a new episode instead of repeating the present one: for robots, and for"
    " environments that do not repeat themselves.",
)  # fmt: skip
@json_option
def resume(
    folder: Path, steps: int | None, episodes: int | None, new_episode: bool, as_json: bool
) -> None:
    """Resume RUN, a folder of `sdnn train`, from its last checkpoint.

    The result is that of a run without the stop, bit for bit: the episode in which it stopped is
    repeated first, with the actions that were taken. A run that is done stays as it is unless
    --steps or --episodes is larger.
    """
    from sdnn.runs import Run

    with run_command(words_of_run(folder), folder=folder):
        run = Run.open(folder)
        train_run(run, as_json, steps=steps, episodes=episodes, repeat_episodes=not new_episode)
