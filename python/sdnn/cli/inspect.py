"""The command ``sdnn inspect``: what the agent of a run has learned."""

from __future__ import annotations

from pathlib import Path

import click

from sdnn.cli import common
from sdnn.cli.runs import run_argument, seed_option
from sdnn.runs.errors import ConfigError


@click.command(short_help="Show what the agent of a run has learned, on a page.")
@run_argument
@click.option(
    "--input",
    "names",
    metavar="NAME",
    multiple=True,
    help="An input of the map, by its name or the number of an observed variable; one or two."
    "  [default: the two most influential ones]",
)
@click.option("--best", is_flag=True, help="The agent that --keep-best kept, not the present one.")
@seed_option
@click.option(
    "--out", metavar="FILE", type=common.NEW_FILE, help="The page, a .html file.  [default: in RUN]"
)
@common.json_option
def inspect(
    folder: Path, names: tuple[str, ...], best: bool, seed: int | None, out: Path | None,
    as_json: bool,
) -> None:  # fmt: skip
    """Show what the agent of RUN has learned: values, actions, and which inputs matter.

    A page with a map of values and greedy actions over two inputs, the influence of each input, a
    greedy episode, the course of learning, and warnings. The agent stays as it is.
    """
    from sdnn.runs.inspection import FILE_NAME, inspect_run, write_inspection
    from sdnn.runs.run import Run

    path = out or folder / FILE_NAME
    if path.suffix != ".html":
        raise click.UsageError(f"--out must end in .html, got {path}")
    in_files = common.words_of_run(folder)

    def message(error: ConfigError) -> str:
        return f"--input: {error.problem}" if error.key == "inputs" else in_files(error)

    with common.run_command(message):
        inspection = inspect_run(Run.open(folder), names=names, seed=seed, best=best)
        write_inspection(inspection, path)
    if as_json:
        click.echo(common.json_text({**inspection.to_json(), "page": str(path)}))
        return
    inspection.input_table().print(common.make_console(), full=False)
    for warning in inspection.warnings():
        click.echo(f"warning: {warning}")
    click.echo(f"wrote {path}")
