"""Output and exit codes of the commands."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from signal import SIGINT, SIGTERM
from typing import TYPE_CHECKING, Any, NoReturn

import click

if TYPE_CHECKING:
    from rich.console import Console

    from sdnn.runs.report import Finished

EXIT_FAILURE = 1
PLAIN_WIDTH = 160
"""Width of tables that go to a file or pipe."""


def json_text(values: Any) -> str:
    """Write values as JSON; numbers that it does not have, NaN and infinite ones, as null."""
    return json.dumps(_finite(values), indent=2, allow_nan=False)


def _finite(value: Any) -> Any:
    if isinstance(value, float):
        return value if math.isfinite(value) else None
    if isinstance(value, Mapping):
        return {name: _finite(one) for name, one in value.items()}
    return [_finite(one) for one in value] if isinstance(value, list | tuple) else value


def run_and_report(
    context: click.Context, run: Callable[..., Finished], request: Any, *, as_json: bool
) -> None:
    """Run trials with a line of progress; print the results, what failed and how much is stored."""
    from rich.console import Console

    from sdnn.progress import ProgressBars

    with ProgressBars(Console(stderr=True)) as observer:
        done = run(request, observer=observer)
    outcome = done.outcome
    n_stored = outcome.n_reused + outcome.n_run
    stored = f"{n_stored} of {outcome.n_planned} trials are stored in {request.out}"
    for failure in outcome.failures:
        message = f"{type(failure.error).__name__}: {failure.error}"
        click.echo(f"Error: {failure.planned.title} failed: {message}", err=True)
    if outcome.interrupted:
        what = "terminated" if outcome.signal == SIGTERM else "interrupted"
        message = f"{what}; {stored}; the same command continues from there"
        exit_interrupted(context, message, outcome.signal)
    if done.page is None:
        click.echo(f"Error: nothing is complete, no figure drawn; {stored}", err=True)
    elif as_json:
        click.echo(json.dumps(done.table, indent=2))
    else:
        done.page.print(make_console())
        page = next(str(file) for file in done.files if file.suffix == ".html")
        done_now = f"{stored} ({outcome.n_run} run now); " if outcome.n_planned else ""
        click.echo(f"{done_now}wrote {len(done.files)} files: see {page}")
    if done.page is None or outcome.failures:
        context.exit(EXIT_FAILURE)


def print_forecast(
    request: Any, *, as_json: bool, more: Mapping[str, Any] | None = None, **options: Any
) -> None:
    """Print what is still to be run and how long that takes; as JSON with more values."""
    from sdnn.machine import n_cores
    from sdnn.runs.forecast import forecast, forecast_lines

    # The size of a cluster is not known.
    jobs = 1 if request.executor is not None else request.jobs or n_cores()
    found = forecast(request.out, request.groups, jobs, **options) | (more or {})
    lines = [json.dumps(found, indent=2)] if as_json else forecast_lines(found, request.out)
    for line in lines:
        click.echo(line)


def make_console() -> Console:
    """Make the console that tables are printed on: as wide as the terminal, if it is one."""
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else PLAIN_WIDTH)


@contextmanager
def experiment_command(context: click.Context) -> Iterator[None]:
    """Make a line and an exit code of what can end a run of trials."""
    from sdnn.runs.errors import ConfigError, RunError

    try:
        yield
    except ConfigError as error:
        raise click.UsageError(str(error)) from error
    except RunError as error:
        raise click.ClickException(str(error)) from error
    except KeyboardInterrupt:
        exit_interrupted(context, "interrupted; what was finished is stored")


def exit_interrupted(context: click.Context, message: str, number: int | None = None) -> NoReturn:
    """Print what is kept, and exit as a command that a signal, by default Ctrl-C, has ended."""
    click.echo(message, err=True)
    context.exit(exit_code(number or SIGINT))


def exit_code(number: int) -> int:
    """Return the exit code of a command that a signal has ended, as shells have it."""
    return 128 + number
