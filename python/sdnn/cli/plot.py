"""The command ``sdnn plot``: learning curves of runs."""

from __future__ import annotations

from pathlib import Path

import click

from sdnn.cli.common import NEW_FILE, RUN, check_ending, option_words, run_command


@click.command(short_help="Draw the learning curves of runs.")
@click.argument("folders", metavar="RUN...", nargs=-1, required=True, type=RUN)
@click.option(
    "--out",
    metavar="FILE",
    type=NEW_FILE,
    help="A .png, .svg or .pdf file.  [default: curves.png in RUN, or here for several]",
)
def plot(folders: tuple[Path, ...], out: Path | None) -> None:
    """Draw the learning curves of RUN..., and write their numbers beside the figure as CSV.

    One run of its kind: returns of its episodes as points, their running median, and the mean
    return of each evaluation with the quartiles over its episodes. Runs that differ in their seeds
    only: the median of their evaluations with the quartiles over the runs. Runs that differ in
    anything else stay apart. A panel per task.
    """
    from sdnn.runs import Run
    from sdnn.runs.curves import SUFFIXES, curves_of, write_curves

    if out is not None:
        check_ending("--out", out, SUFFIXES)
    chosen = tuple(dict.fromkeys(folders))
    path = out or (chosen[0] / "curves.png" if len(chosen) == 1 else Path("curves.png"))
    with run_command(option_words):
        curves, notes = curves_of([Run.open(folder) for folder in chosen])
        files = write_curves(curves, path)
    for note in notes:
        click.echo(f"note: {note}", err=True)
    click.echo("wrote " + " and ".join(map(str, files)))
