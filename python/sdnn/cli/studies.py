"""The commands that run studies: ``sweep`` and, for the paper's experiments, ``reproduce``."""

from __future__ import annotations

import functools
import json
from collections.abc import Callable
from pathlib import Path
from signal import SIGINT
from typing import TYPE_CHECKING, Any

import click

from sdnn._core import presets
from sdnn.cli import common
from sdnn.reproduction.cases import MOST_EPISODES, WORDS
from sdnn.support.arguments import blamed

if TYPE_CHECKING:
    from sdnn.runs.engine import Executor
    from sdnn.runs.report import WrittenReport
    from sdnn.runs.study import Study


Function = Callable[..., object]

_OPTIONS = (
    click.option(
        "--executor",
        "where",
        type=click.Choice(("threads", "dask")),
        default="threads",
        show_default=True,
        help="Where trials run: threads of this process, or the workers of a Dask cluster.",
    ),
    click.option(
        "--jobs",
        type=click.IntRange(1, 10_000),
        help="Trials to run at the same time, with threads.  [default: all cores]",
    ),
    click.option(
        "--scheduler",
        metavar="ADDRESS",
        help="The Dask scheduler: host:port, tcp://host:port, or its scheduler file.",
    ),
    click.option(
        "--scheduler-timeout",
        type=click.FloatRange(min=0, min_open=True),
        metavar="SECONDS",
        help="Longest wait for the scheduler and a suitable worker.  [default: 300]",
    ),
    click.option(
        "--out",
        type=click.Path(file_okay=False, path_type=Path),
        default=Path("results"),
        show_default=True,
        help="Folder for the result file, figures, tables and page.",
    ),
    click.option("--json", "as_json", is_flag=True, help="Print the table as JSON."),
    click.option(
        "--full", is_flag=True, help="Print all tables and columns, wider than 80 characters."
    ),
    click.option("--dry-run", is_flag=True, help="Print what would be run and how long it takes."),
)


def study_command(make_study: Callable[..., Study]) -> Function:
    """Make a command that runs the study which a function returns, or with --dry-run forecasts it.

    The command has the options of `_OPTIONS` besides those of the function.
    """

    @functools.wraps(make_study)
    def command(
        *, where: str, jobs: int | None, scheduler: str | None, scheduler_timeout: float | None,
        out: Path, as_json: bool, full: bool, dry_run: bool, **options: object,
    ) -> None:  # fmt: skip
        """Run the study that the options describe, print its results, and exit with a status.

        The status is 1 if a trial failed or nothing is complete.
        """
        from rich.console import Console

        from sdnn.reports.pages import duration_words
        from sdnn.runs.engine import TrialBars
        from sdnn.runs.sweep import forecast, run_study

        with common.errors_in_a_line():
            try:
                executor = _make_executor(where, jobs, scheduler, scheduler_timeout)
                study = make_study(**options)
            except ValueError as error:
                argument, problem = blamed(error)
                parameters = click.get_current_context().command.params
                is_option = any(f"--{argument}" in parameter.opts for parameter in parameters)
                text = f"--{argument} {problem}" if is_option else str(error)
                raise click.UsageError(text) from error
            if dry_run:
                estimate = forecast(study, out, executor.jobs)
                text = json.dumps(estimate, indent=2)
                if not as_json:
                    values = {"out": out, "duration": duration_words, **estimate}
                    text = common.rendered("forecast.txt.jinja", **values)
                click.echo(text, nl=bool(text))
                return
            with TrialBars(Console(stderr=True)) as observer:
                written = run_study(study, out, executor=executor, observer=observer)
        _show(written, study, out, as_json=as_json, full=full)
        if written.page is None or written.outcome.failures:
            raise click.exceptions.Exit(1)

    for option in reversed(_OPTIONS):
        option(command)
    return command


def _show(written: WrittenReport, study: Study, out: Path, *, as_json: bool, full: bool) -> None:
    """Print failures and results of a study; exit if a signal interrupted it."""
    outcome = written.outcome
    n_stored = outcome.n_reused + outcome.n_run
    stored = f"{n_stored} of {outcome.n_planned} trials are stored in {out}"
    for failure in outcome.failures:
        message = f"{type(failure.error).__name__}: {failure.error}"
        variants = ", ".join(study.variants_of(failure.planned.key))
        click.echo(f"Error: {failure.planned.title} ({variants}) failed: {message}", err=True)
    if outcome.interrupted:
        then = f"; {stored}; the same command continues from there"
        common.exit_interrupted(then, outcome.signal or SIGINT)
    if written.page is None:
        click.echo(f"Error: nothing is complete, no figure drawn; {stored}", err=True)
    elif as_json:
        click.echo(json.dumps(written.table, indent=2))
    else:
        written.page.print(common.make_console(), full=full)
        page = next(str(file) for file in written.files if file.suffix == ".html")
        summary = ""
        if outcome.n_planned:  # not only costs
            digest = str(written.table["digest"])[:16]
            summary = f"{stored} ({outcome.n_run} run now); digest of the rows {digest}; "
        click.echo(f"{summary}wrote {len(written.files)} files: see {page}")


def _make_executor(
    where: str, jobs: int | None, scheduler: str | None, timeout: float | None
) -> Executor:
    """Return the executor of threads or of a Dask cluster; refuse options of the other one."""
    if where == "threads":
        for name, value in (("scheduler", scheduler), ("scheduler-timeout", timeout)):
            if value is not None:
                raise click.UsageError(f"--{name} needs --executor dask")
        from sdnn.runs.engine import ThreadExecutor

        return ThreadExecutor(jobs)
    if jobs is not None:
        raise click.UsageError("--jobs is for threads; a cluster runs one trial a worker thread")
    if scheduler is None:
        raise click.UsageError("--executor dask needs --scheduler ADDRESS")
    from sdnn.runs.dask_executor import DaskExecutor

    options = {} if timeout is None else {"scheduler_timeout": timeout}
    return DaskExecutor(scheduler, **options)


@click.command(short_help="Run a study: variants of any setting, trial by trial.")
@click.argument("file", type=common.OLD_FILE)
@click.option(
    "--trials",
    type=click.IntRange(1, 100_000),
    help="Trials per case and variant, instead of the file's.",
)
@click.option("--seed", type=common.SEED, help="Root of all seeds, instead of the file's.")
@click.option(
    "--only", metavar="VARIANT", multiple=True, help="Run this variant only; may be repeated."
)
@study_command
def sweep(file: Path, trials: int | None, seed: int | None, only: tuple[str, ...]) -> Study:
    """Run the study in FILE: variants of any setting, compared trial by trial.

    FILE is TOML; docs/how-to/studies.md describes it. Tables, a figure and a page are written to
    OUT under the name of the file.

    Finished trials are kept in OUT/results.sqlite, which `reproduce` may share; the same command
    continues where it stopped.
    """
    from sdnn.reproduction.reproduce import ClaimStudy

    return ClaimStudy(file, n_trials=trials, seed=seed, only=only)


@click.command(short_help="Run the paper's experiments and write a report.")
@click.argument("experiment", type=click.Choice(WORDS), default="all")
@click.option(
    "--trials",
    "n_trials",
    type=click.IntRange(1, 100_000),
    help="Trials per case and agent.  [default: 10, as in the paper]",
)
@click.option(
    "--episodes",
    "n_episodes",
    type=click.IntRange(1, MOST_EPISODES),
    help="Learning episodes per trial.  [default: 15000, as in the paper]",
)
@click.option("--seed", type=common.SEED, default=0, show_default=True, help="Root of all seeds.")
@click.option(
    "--quick", is_flag=True, help="Run a fraction: 2 trials x 300 episodes; not the result."
)
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
    type=click.Choice(tuple(presets())),
    multiple=True,
    help="Draw SDNN-C under these settings beside the paper's; may be repeated.",
)
@click.option(
    "--sensors",
    type=click.IntRange(4, 6),
    help="With b: a single case with these sensors.  [default: 4, where --noise is used]",
)
@click.option(
    "--noise",
    type=click.FloatRange(0, 1),
    metavar="SIGMA",
    help="With b: a single case with this noise.  [default: 0.02, where --sensors is used]",
)
@study_command
def reproduce(experiment: str, **options: Any) -> Study:
    """Run the paper's experiments and write a report with its figures and claims.

    a: redundant inputs. b: noisy inputs, against fuzzy Q-learning. cost: time of a step against the
    number of inputs. all: everything, which is the default.

    Finished trials are stored in OUT/results.sqlite; the same command continues where it stopped.
    Files of other agents, trials, episodes or seeds than the paper's have these in their names.
    """
    from sdnn.reproduction.reproduce import PaperStudy

    return PaperStudy(experiment, **options)
