"""The options that say where trials run, for every command that runs trials."""

from __future__ import annotations

import functools
from collections.abc import Callable
from typing import TYPE_CHECKING, Any

import click

if TYPE_CHECKING:
    from sdnn.runs.dask_executor import DaskExecutor
    from sdnn.runs.engine import ThreadExecutor

EXECUTORS = ("threads", "dask")

Function = Callable[..., Any]

_OPTIONS = (
    click.option(
        "--executor",
        "where",
        type=click.Choice(EXECUTORS),
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
        help="Wait so long for the scheduler and for a worker that fits.  [default: 300]",
    ),
)
_OF_DASK = ("scheduler", "scheduler_timeout")


def executor_options(command: Function) -> Function:
    """Add the options to a command, which receives an `executor`."""

    @functools.wraps(command)
    def wrapped(*arguments: Any, where: str, jobs: int | None, **options: Any) -> Any:
        of_dask = {name: options.pop(name) for name in _OF_DASK}
        given = {name: value for name, value in of_dask.items() if value is not None}
        executor = _make_executor(where, jobs, given)
        return command(*arguments, executor=executor, **options)

    for option in reversed(_OPTIONS):
        wrapped = option(wrapped)
    return wrapped


def _make_executor(
    where: str, jobs: int | None, of_dask: dict[str, Any]
) -> ThreadExecutor | DaskExecutor:
    if where == "threads":
        if of_dask:
            name = next(iter(of_dask)).replace("_", "-")
            raise click.UsageError(f"--{name} needs --executor dask")
        from sdnn.runs.engine import ThreadExecutor

        return ThreadExecutor(jobs)
    if jobs is not None:
        raise click.UsageError("--jobs is for threads; a cluster runs one trial a worker thread")
    if "scheduler" not in of_dask:
        raise click.UsageError("--executor dask needs --scheduler ADDRESS")
    from sdnn.runs.dask_executor import DaskExecutor
    from sdnn.runs.errors import ClusterError

    try:
        return DaskExecutor(of_dask.pop("scheduler"), **of_dask)
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    except ClusterError as error:
        raise click.ClickException(str(error)) from error
