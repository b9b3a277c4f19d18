"""What the commands print, and how they end."""

from __future__ import annotations

import json
import math
import sys
from collections.abc import Callable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any, NoReturn, TypeVar

import click

if TYPE_CHECKING:
    from rich.console import Console

    from sdnn.runs.engine import RunOutcome
    from sdnn.runs.report import Finished

Done = TypeVar("Done")

EXIT_FAILURE = 1
EXIT_INTERRUPTED = 130
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


def report_outcome(context: click.Context, outcome: RunOutcome, out: Path) -> str:
    """Tell what failed, exit if interrupted, and say how much is stored."""
    from sdnn.runs.engine import describe

    n_stored = outcome.n_reused + outcome.n_run
    stored = f"{n_stored} of {outcome.n_planned} trials are stored in {out}"
    for failure in outcome.failures:
        message = f"{type(failure.error).__name__}: {failure.error}"
        click.echo(f"Error: {describe(failure.key)} failed: {message}", err=True)
    if outcome.interrupted:
        exit_interrupted(context, f"interrupted; {stored}; the same command goes on from there")
    return stored


def print_finished(done: Finished, stored: str, *, as_json: bool) -> None:
    """Print the results, as JSON or with what was run and where to look."""
    if as_json:
        click.echo(json.dumps(done.table, indent=2))
        return
    if done.page is not None:
        done.page.print(make_console())
    page = next(str(file) for file in done.files if file.suffix == ".html")
    done_now = f"{stored} ({done.outcome.n_run} run now); " if done.outcome.n_planned else ""
    click.echo(f"{done_now}wrote {len(done.files)} files: see {page}")


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


def with_progress(run: Callable[..., Done], request: Any) -> Done:
    """Run what was asked for, with a line of progress."""
    from rich.console import Console

    from sdnn.progress import ProgressBars

    with ProgressBars(Console(stderr=True)) as observer:
        return run(request, observer=observer)


def exit_interrupted(context: click.Context, message: str) -> NoReturn:
    """Say what is kept, and exit as a command that was interrupted."""
    click.echo(message, err=True)
    context.exit(EXIT_INTERRUPTED)
