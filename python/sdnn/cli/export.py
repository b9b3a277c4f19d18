"""The command ``sdnn export``: a trained agent in a form for other programs."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import click

from sdnn.cli.common import json_option, json_text, run_command, words_of_run


@click.command(short_help="Write a run's policy as a C header, for small processors.")
@click.argument("source", metavar="RUN", type=click.Path(exists=True, path_type=Path))
@click.option(
    "--c-header",
    "path",
    metavar="FILE",
    required=True,
    type=click.Path(dir_okay=False, path_type=Path),
    help="A C99 header with the greedy policy, in integers: for small processors.",
)
@click.option(
    "--learning",
    is_flag=True,
    help="The header has the agent itself, which continues to learn. For the agent sdnn-linear.",
)
@click.option(
    "--name", metavar="PREFIX", help="Prefix of its names.  [default: FILE without ending]"
)
@click.option(
    "--fraction-bits",
    type=click.IntRange(min=0, max=30),
    help="Fraction bits of observations, actions and rewards."
    "  [default: 16, or fewer where a range needs it]",
)
@json_option
def export(
    source: Path,
    path: Path,
    learning: bool,
    name: str | None,
    fraction_bits: int | None,
    as_json: bool,
) -> None:
    """Write the agent of RUN, a run's folder or an agent's file, in a form for other programs.

    The header observes what the agent did: with --noise or --redundant, variables scaled to [0, 1].
    Its comments name the ranges.
    """
    from sdnn.agents import load_agent
    from sdnn.export import c_header
    from sdnn.files import write_whole
    from sdnn.runs.run import agent_of

    with run_command(words_of_run(source)):
        try:
            agent = agent_of(source) if source.is_dir() else load_agent(source)
        except ValueError as error:
            raise click.ClickException(str(error)) from error
        try:
            header = c_header(
                agent,
                path.stem if name is None else name,
                fraction_bits=fraction_bits,
                learning=learning,
            )
        except ValueError as error:
            raise _usage_error(error, is_named=name is not None) from error
        except (TypeError, RuntimeError) as error:
            raise click.ClickException(f"{source}: {error}") from error
        write_whole(path, header.text.encode())
    scaling = agent.scaling
    if as_json:
        values = {k: v for k, v in dataclasses.asdict(header).items() if k != "text"}
        values["scaling"] = None if scaling is None else scaling.values()
        click.echo(json_text({"file": str(path), **values}))
        return
    click.echo(
        f"wrote {path}: {header.flash_bytes:,} bytes of constants, {header.ram_bytes:,} bytes of"
        f" {'memory' if learning else 'arrays on the stack'},"
        f" {header.n_words:,} words of weights read per decision"
    )
    if scaling is not None:
        click.echo("it observes each variable scaled from its range to [0, 1], as its run did:")
        for line in scaling.lines():
            click.echo(f"  {line}")


def _usage_error(error: ValueError, is_named: bool) -> click.ClickException:
    """Return an error about an argument as one about its option."""
    from sdnn.arguments import blamed

    name, problem = blamed(error)
    if name == "name" and not is_named:
        return click.UsageError(f"--c-header gives no name; use --name, which {problem}")
    option = {"name": "--name", "fraction_bits": "--fraction-bits"}.get(name)
    if option is None:
        return click.ClickException(str(error))
    return click.UsageError(f"{option} {problem}")
