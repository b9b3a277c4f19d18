"""The command ``sdnn bench``: the library's speed on this machine."""

from __future__ import annotations

import json

import click

from sdnn.cli.common import make_console


@click.command(short_help="Measure the library's speed on this machine.")
@click.option("--quick", is_flag=True, help="Few repetitions, as a check that it works.")
@click.option("--json", "as_json", is_flag=True, help="Print the results as JSON.")
def bench(quick: bool, as_json: bool) -> None:
    """Measure the time of decisions, their parts and trials on this machine.

    Takes about half a minute. SDNN_INSTRUCTION_SET=portable, neon, avx2 or avx512 forces a level.
    """
    from sdnn.benchmarks import run_benchmarks
    from sdnn.benchmarks.report import describe_run, tables

    results = run_benchmarks(quick=quick)
    if as_json:
        click.echo(json.dumps(results, indent=2))
        return
    console = make_console()
    for line in describe_run(results):
        console.print(line, highlight=False)
    for table in tables(results):
        table.print(console)
