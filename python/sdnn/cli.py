"""The command ``sdnn``. It reads options and prints; the work is done in the rooms."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NoReturn

import click

from sdnn.executor_options import executor_options
from sdnn.experiments.cases import PRESET_AGENTS, WORDS, includes_cost, select_experiments

if TYPE_CHECKING:
    from rich.console import Console

    from sdnn.experiments.engine import RunOutcome
    from sdnn.experiments.executor import Executor
    from sdnn.experiments.report import Report
    from sdnn.experiments.reproduce import ReproduceRequest, Reproduction
    from sdnn.experiments.sweep.report import StudyReport
    from sdnn.experiments.sweep.run import Sweep, SweepRequest

EXIT_FAILURE = 1
EXIT_INTERRUPTED = 130
PLAIN_WIDTH = 160
"""Width of tables that go to a file or pipe."""


def _library_version() -> str:
    import sdnn

    version: str = sdnn.__version__
    return version


def _print_version(context: click.Context, _parameter: click.Parameter, value: bool) -> None:
    if value:
        click.echo(f"sdnn {_library_version()}")
        context.exit()


def _print_cmake_dir(context: click.Context, _parameter: click.Parameter, value: bool) -> None:
    if not value:
        return
    import sdnn

    # An editable install has two folders: the sources and the installed files.
    for folder in sdnn.__path__:
        found = Path(folder) / "share" / "cmake" / "sdnn"
        if found.is_dir():
            click.echo(found)
            context.exit()
    raise click.ClickException("this copy of sdnn has no CMake package; install it with pip")


@click.group(context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_print_version,
    help="Print the version and exit.",
)
@click.option(
    "--cmakedir",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_print_cmake_dir,
    help="Print the folder of the CMake package, for -Dsdnn_ROOT=..., and exit.",
)
def main() -> None:
    """Reproduce the paper's experiments with selective desensitization neural networks."""


@main.command()
@click.argument("experiment", type=click.Choice(WORDS), default="all")
@click.option(
    "--trials",
    type=click.IntRange(min=1),
    help="Trials per case and agent.  [default: 10, as in the paper]",
)
@click.option(
    "--episodes",
    type=click.IntRange(min=1),
    help="Learning episodes per trial.  [default: 15000, as in the paper]",
)
@executor_options
@click.option(
    "--seed", type=click.IntRange(min=0), default=0, show_default=True, help="Root of all seeds."
)
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("results"),
    show_default=True,
    help="Folder for the result file, figures, tables and report.html.",
)
@click.option(
    "--quick",
    is_flag=True,
    help="A look at a fraction: 2 trials x 300 episodes. Not the result.",
)
@click.option("--json", "as_json", is_flag=True, help="Print the table as JSON.")
@click.option("--dry-run", is_flag=True, help="Only say what would be run.")
@click.option(
    "--agent",
    "agents",
    metavar="ID",
    multiple=True,
    help="Run this agent in every case instead of the case's own; may be repeated.",
)
@click.option(
    "--preset",
    "presets",
    type=click.Choice(tuple(PRESET_AGENTS)),
    multiple=True,
    help="Draw SDNN-C under these settings beside the paper's; may be repeated.",
)
@click.pass_context
def reproduce(
    context: click.Context,
    experiment: str,
    trials: int | None,
    episodes: int | None,
    jobs: int | None,
    executor: Executor | None,
    seed: int,
    out: Path,
    quick: bool,
    as_json: bool,
    dry_run: bool,
    agents: tuple[str, ...],
    presets: tuple[str, ...],
) -> None:
    """Run the paper's experiments and write a report with its figures and claims.

    a: redundant inputs. b: noisy inputs, against fuzzy Q-learning. cost: time of a step against the
    number of inputs. all: everything, which is the default.

    Finished trials are kept in OUT/results.sqlite; the same command goes on where it stopped.
    """
    from sdnn.experiments.errors import ExperimentError
    from sdnn.experiments.reproduce import ReproduceRequest

    request = ReproduceRequest(
        experiments=select_experiments(experiment),
        cost=includes_cost(experiment),
        out=out,
        n_trials=trials,
        n_episodes=episodes,
        seed=seed,
        jobs=jobs,
        executor=executor,
        quick=quick,
        agents=agents,
        presets=presets,
    )
    try:
        _ = request.plan
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    try:
        if dry_run:
            _print_plan(request, as_json)
        else:
            _finish(context, _run(request), out, as_json)
    except (ExperimentError, OSError) as error:
        raise click.ClickException(str(error)) from error
    except KeyboardInterrupt:
        _exit_interrupted(context, "interrupted; what was finished is stored")


@main.command()
@click.argument("file", type=click.Path(exists=True, dir_okay=False, path_type=Path))
@click.option(
    "--trials",
    type=click.IntRange(min=1),
    help="Trials per case and variant, instead of the file's.",
)
@click.option(
    "--seed", type=click.IntRange(min=0), help="Root of all seeds, instead of the file's."
)
@executor_options
@click.option(
    "--out",
    type=click.Path(file_okay=False, path_type=Path),
    default=Path("results"),
    show_default=True,
    help="Folder for the result file, figure, tables and page.",
)
@click.option(
    "--only", metavar="VARIANT", multiple=True, help="Run this variant only; may be repeated."
)
@click.option("--json", "as_json", is_flag=True, help="Print the table as JSON.")
@click.option("--dry-run", is_flag=True, help="Only say what would be run, and how long it takes.")
@click.pass_context
def sweep(
    context: click.Context,
    file: Path,
    trials: int | None,
    seed: int | None,
    jobs: int | None,
    executor: Executor | None,
    out: Path,
    only: tuple[str, ...],
    as_json: bool,
    dry_run: bool,
) -> None:
    """Run the study in FILE: variants of any setting, compared trial by trial.

    FILE is TOML; docs/sweep.md describes it. Tables, a figure and a page are written to OUT under
    the name of the file.

    Finished trials are kept in OUT/results.sqlite, which `reproduce` may share; the same command
    goes on where it stopped.
    """
    from sdnn.experiments.errors import ExperimentError, StudyError
    from sdnn.experiments.sweep.run import SweepRequest

    request = SweepRequest(
        file=file,
        out=out,
        n_trials=trials,
        seed=seed,
        jobs=jobs,
        executor=executor,
        only=tuple(dict.fromkeys(only)),
    )
    try:
        _ = request.plan
    except (StudyError, ValueError) as error:
        raise click.UsageError(str(error)) from error
    try:
        if dry_run:
            _print_forecast(request, as_json)
        else:
            _finish_sweep(context, _run_sweep(request), out, as_json)
    except StudyError as error:
        raise click.UsageError(str(error)) from error
    except (ExperimentError, OSError) as error:
        raise click.ClickException(str(error)) from error
    except KeyboardInterrupt:
        _exit_interrupted(context, "interrupted; what was finished is stored")


@main.command()
@click.option("--quick", is_flag=True, help="Few repetitions: to see that it works.")
@click.option("--json", "as_json", is_flag=True, help="Print the results as JSON.")
def bench(quick: bool, as_json: bool) -> None:
    """Measure how quick the library is here, and what this machine allows.

    Takes about half a minute. SDNN_INSTRUCTION_SET=portable, avx2 or avx512 forces a level.
    """
    from sdnn.benchmarks import BenchmarkError, run_benchmarks
    from sdnn.benchmarks.report import print_results

    try:
        results = run_benchmarks(quick=quick)
    except BenchmarkError as error:
        raise click.ClickException(str(error)) from error
    if as_json:
        click.echo(json.dumps(results, indent=2))
        return
    print_results(results, _console())


def _run(request: ReproduceRequest) -> Reproduction:
    from rich.console import Console

    from sdnn.experiments.progress import ProgressObserver
    from sdnn.experiments.reproduce import reproduce as run

    with ProgressObserver(Console(stderr=True)) as observer:
        return run(request, observer=observer)


def _print_plan(request: ReproduceRequest, as_json: bool) -> None:
    from sdnn.experiments.reproduce import count_stored

    counts = count_stored(request)
    n_episodes = request.protocol.n_learning_episodes
    n_costs, n_costs_stored = counts.costs
    if as_json:
        trials = [
            {"case": case, "agent": agent, "planned": planned, "stored": stored}
            for (case, agent), (planned, stored) in counts.trials.items()
        ]
        costs = {"planned": n_costs, "stored": n_costs_stored}
        plan = {"n_learning_episodes": n_episodes, "trials": trials, "costs": costs}
        click.echo(json.dumps(plan, indent=2))
        return
    for (case, agent), (planned, stored) in counts.trials.items():
        click.echo(
            f"{case} {agent}: {planned} trials x {n_episodes} episodes,"
            f" {stored} of them stored in {request.out}"
        )
    if n_costs:
        click.echo(
            f"cost of a step: {n_costs} measurements, {n_costs_stored} of them stored in"
            f" {request.out}"
        )


def _finish(context: click.Context, done: Reproduction, out: Path, as_json: bool) -> None:
    stored = _report_outcome(context, done.outcome, out)
    if done.outcome.failures:
        click.echo(f"Error: no figure drawn; {stored}", err=True)
        context.exit(EXIT_FAILURE)
    if as_json:
        click.echo(json.dumps(done.table, indent=2))
        return
    if done.report is not None:
        _print_report(done.report)
    _print_files(done.outcome, done.files, stored)


def _report_outcome(context: click.Context, outcome: RunOutcome, out: Path) -> str:
    """Tell what failed, exit if interrupted, and say how much is stored."""
    from sdnn.experiments.progress import describe

    n_stored = outcome.n_reused + outcome.n_run
    stored = f"{n_stored} of {outcome.n_planned} trials are stored in {out}"
    for failure in outcome.failures:
        message = f"{type(failure.error).__name__}: {failure.error}"
        click.echo(f"Error: {describe(failure.key)} failed: {message}", err=True)
    if outcome.interrupted:
        _exit_interrupted(context, f"interrupted; {stored}; the same command goes on from there")
    return stored


def _print_files(outcome: RunOutcome, files: tuple[Path, ...], stored: str) -> None:
    page = next(str(file) for file in files if file.suffix == ".html")
    done_now = f"{stored} ({outcome.n_run} run now); " if outcome.n_planned else ""
    click.echo(f"{done_now}wrote {len(files)} files: see {page}")


def _print_report(report: Report) -> None:
    mark = " (QUICK LOOK, not the result)" if report.quick else ""
    console = _console()
    if note := report.agents_note():
        console.print(note, highlight=False)
    _print_tables(console, report.tables(), report.notes(), mark)


def _print_tables(
    console: Console,
    tables: Iterable[tuple[str, Sequence[str], Sequence[Sequence[str]]]],
    notes: Iterable[str],
    mark: str = "",
) -> None:
    from rich import box
    from rich.table import Table
    from rich.text import Text

    for title, header, rows in tables:
        table = Table(title=Text(title + mark), title_justify="left", box=box.SIMPLE_HEAD)
        for column in header:
            table.add_column(Text(column), overflow="fold")
        for row in rows:
            table.add_row(*map(Text, row))
        console.print(table)
    for note in notes:
        console.print(note, style="dim", highlight=False, markup=False)


def _run_sweep(request: SweepRequest) -> Sweep:
    from rich.console import Console

    from sdnn.experiments.progress import ProgressObserver
    from sdnn.experiments.sweep.run import sweep as run

    with ProgressObserver(Console(stderr=True)) as observer:
        return run(request, observer=observer)


def _print_forecast(request: SweepRequest, as_json: bool) -> None:
    from sdnn.experiments.sweep.forecast import forecast, forecast_json, forecast_lines

    found = forecast(request)
    if as_json:
        click.echo(json.dumps(forecast_json(found), indent=2))
        return
    for line in forecast_lines(found, request.out):
        click.echo(line)


def _finish_sweep(context: click.Context, done: Sweep, out: Path, as_json: bool) -> None:
    stored = _report_outcome(context, done.outcome, out)
    if done.report is None:
        click.echo(f"Error: nothing is complete; {stored}", err=True)
        context.exit(EXIT_FAILURE)
    if as_json:
        click.echo(json.dumps(done.table, indent=2))
    else:
        _print_study(done.report)
        _print_files(done.outcome, done.files, stored)
    if done.outcome.failures:
        context.exit(EXIT_FAILURE)


def _print_study(report: StudyReport) -> None:
    console = _console()
    lines = [report.title, report.scope(), *filter(None, [report.missing()])]
    console.print("\n".join(lines), highlight=False, markup=False)
    _print_tables(console, report.tables(), report.notes())


def _console() -> Console:
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else PLAIN_WIDTH)


def _exit_interrupted(context: click.Context, message: str) -> NoReturn:
    click.echo(message, err=True)
    context.exit(EXIT_INTERRUPTED)
