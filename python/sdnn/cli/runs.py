"""The commands that work on the folder of a run: ``resume``, ``evaluate``, ``plot``, ``record``."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path

import click

from sdnn.cli import common

RUN = click.Path(exists=True, file_okay=False, path_type=Path)
run_argument = click.argument("folder", metavar="RUN", type=RUN)
seed_option = click.option(
    "--seed",
    type=common.SEED,
    help="Root of the episodes' seeds.  [default: others than those of the training]",
)


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
@common.json_option
def resume(
    folder: Path, steps: int | None, episodes: int | None, new_episode: bool, as_json: bool
) -> None:
    """Resume RUN, a folder of `sdnn train`, from its last checkpoint.

    The result is that of a run without the stop, bit for bit: the episode in which it stopped is
    repeated first, with the actions that were taken. A run that is done stays as it is unless
    --steps or --episodes is larger.
    """
    from sdnn.runs.run import Run

    with common.run_command(common.words_of_run(folder), folder=folder):
        run = Run.open(folder)
        common.train_run(
            run, as_json, steps=steps, episodes=episodes, repeat_episodes=not new_episode
        )


@click.command(short_help="Evaluate the agent of a run as it is now.")
@run_argument
@click.option(
    "--episodes",
    type=click.IntRange(1, 10**9),
    default=100,
    show_default=True,
    help="Greedy episodes.",
)
@click.option("--best", is_flag=True, help="The agent that --keep-best kept, not the present one.")
@seed_option
@common.json_option
def evaluate(folder: Path, episodes: int, best: bool, seed: int | None, as_json: bool) -> None:
    """Evaluate the agent of RUN as it is now: greedy episodes in which nothing is learned."""
    import numpy as np

    from sdnn.runs.run import Run

    with common.run_command(common.words_of_run(folder)):
        evaluation = Run.open(folder).evaluate(episodes, seed, best=best)
    returns = evaluation.returns
    low, median, high = np.percentile(returns, (25, 50, 75)).tolist()
    values = {
        "folder": str(folder),
        "n_episodes": episodes,
        "mean_return": evaluation.mean_return,
        "standard_deviation": float(returns.std(ddof=1)) if episodes > 1 else None,
        "median_return": median,
        "quartiles": [low, high],
        "range": [float(returns.min()), float(returns.max())],
        "mean_length": float(evaluation.lengths.mean()),
        "share_terminated": float(evaluation.terminated.mean()),
        "is_warming_up": evaluation.is_warming_up,
    }
    if as_json:
        click.echo(common.json_text({**values, "returns": returns.tolist()}))
        return
    click.echo(
        f"{folder}: mean return {evaluation.mean_return:.6g} over {episodes} greedy episodes"
    )
    click.echo(
        f"median {median:.6g}, quartiles {low:.6g} to {high:.6g}, all {returns.min():.6g} to"
        f" {returns.max():.6g}"
    )
    click.echo(
        f"{values['mean_length']:.6g} steps on average,"
        f" {values['share_terminated']:.0%} of the episodes terminated"
    )
    if evaluation.is_warming_up:
        click.echo(common.WARMING_UP)


@click.command(short_help="Draw the learning curves of runs.")
@click.argument("folders", metavar="RUN...", nargs=-1, required=True, type=RUN)
@click.option(
    "--out",
    metavar="FILE",
    type=common.NEW_FILE,
    help="A .png, .svg or .pdf file.  [default: curves.png in RUN, or here for several]",
)
@click.option(
    "--baseline",
    "baselines",
    metavar="NAME",
    multiple=True,
    help="Also draw the stored return of a baseline, such as SAC; may be repeated.",
)
@click.option("--plain", is_flag=True, help="Without the lines of the goal and of random actions.")
def plot(
    folders: tuple[Path, ...], out: Path | None, baselines: tuple[str, ...], plain: bool
) -> None:
    """Draw the learning curves of RUN..., and write their numbers beside the figure as CSV.

    Points are episodes; lines are their running median and the mean returns of evaluations, with
    quartiles: over the episodes of each evaluation, or over runs that differ in their seeds only,
    which share their lines. Runs that differ in anything else stay apart. A panel per task.

    Dotted lines show the goal of the environment's registration and, in environments of
    Gymnasium, the mean return of random actions. The stored returns of baselines are those of the
    documentation's results on other tasks.
    """
    from sdnn.runs.curves import SUFFIXES, curves_of, environments_of, write_curves
    from sdnn.runs.levels import levels_of
    from sdnn.runs.run import Run

    if out is not None:
        _check_ending("--out", out, SUFFIXES)
    chosen = tuple(dict.fromkeys(folders))
    path = out or (chosen[0] / "curves.png" if len(chosen) == 1 else Path("curves.png"))
    with common.run_command(common.option_words):
        runs = [Run.open(folder) for folder in chosen]
        curves, notes = curves_of(runs)
        levels, more_notes = levels_of(environments_of(runs), baselines, plain=plain)
        files = write_curves(curves, path, levels)
    for note in (*notes, *more_notes):
        click.echo(f"note: {note}", err=True)
    click.echo("wrote " + " and ".join(map(str, files)))


@click.command(short_help="Record an episode of a run as .gif or .mp4.")
@run_argument
@click.argument("out", metavar="OUT", type=common.NEW_FILE)
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
    os.environ.setdefault("SDL_VIDEODRIVER", "dummy")  # pygame needs no screen for pictures
    from sdnn.runs.recording import SUFFIXES, record as record_run
    from sdnn.runs.run import Run

    _check_ending("OUT", out, SUFFIXES)
    with common.run_command(common.words_of_run(folder)):
        recording = record_run(Run.open(folder), out, seed=seed, max_steps=steps)
    click.echo(f"wrote {out}: {recording.n_frames} frames, return {recording.total_reward:.6g}")
    if recording.is_warming_up:
        click.echo(common.WARMING_UP)


def _check_ending(option: str, path: Path, endings: Sequence[str]) -> None:
    """Raise a usage error that names the option if a file's ending is none of ``endings``."""
    if path.suffix not in endings:
        raise click.UsageError(f"{option} must end in one of {', '.join(endings)}, got {path}")
