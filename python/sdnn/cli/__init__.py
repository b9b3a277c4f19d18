"""The command ``sdnn``. Its commands read options; the packages do the work."""

from __future__ import annotations

import errno
from pathlib import Path

import click

from sdnn.cli.bench import bench
from sdnn.cli.common import exit_interrupted, explained_option
from sdnn.cli.export import export
from sdnn.cli.inspect import inspect
from sdnn.cli.runs import evaluate, plot, record, resume
from sdnn.cli.studies import reproduce, sweep
from sdnn.cli.train import train
from sdnn.cli.verify import verify

__all__ = ["main"]


def _check_instruction_set() -> None:
    """Check SDNN_INSTRUCTION_SET first: later, its error would look like one of an option."""
    from sdnn.support.machine import instruction_set

    try:
        instruction_set()
    except ValueError as error:
        raise click.ClickException(str(error)) from error


def _print_version(context: click.Context, _parameter: click.Parameter, value: bool) -> None:
    """Print the version and the build, then exit: the callback of ``--version``."""
    if value:
        from sdnn.support.machine import build

        _check_instruction_set()
        for name, text in build().items():
            click.echo(f"{name} {text}")
        context.exit()


def _print_cmake_dir(context: click.Context, _parameter: click.Parameter, value: bool) -> None:
    """Print where the CMake package is, then exit: the callback of ``--cmakedir``."""
    if not value:
        return
    import sdnn

    # An editable install has two folders: the sources and the installed files.
    for folder in sdnn.__path__:
        cmake_folder = Path(folder) / "share" / "cmake" / "sdnn"
        if cmake_folder.is_dir():
            click.echo(cmake_folder)
            context.exit()
    raise click.ClickException("this copy of sdnn has no CMake package; install it with pip")


class _Commands(click.Group):
    def invoke(self, ctx: click.Context) -> object:
        """Run a command; Ctrl-C has the same exit code at any time.

        Errors in reading and writing files and standard output become one line.
        """
        try:
            return super().invoke(ctx)
        except click.NoSuchOption as error:
            raise explained_option(error) from None
        except KeyboardInterrupt:
            exit_interrupted("")
        except OSError as error:
            if error.errno == errno.EPIPE:  # the reader of a pipe has ended: Click exits quietly
                raise
            raise click.ClickException(str(error)) from error


@click.group(cls=_Commands, context_settings={"help_option_names": ["-h", "--help"]})
@click.option(
    "--version",
    is_flag=True,
    is_eager=True,
    expose_value=False,
    callback=_print_version,
    help="Print the version, how it was built and where it runs, and exit.",
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
    """Learn with selective desensitization neural networks, and reproduce the paper about them."""
    _check_instruction_set()


for command in (
    train, resume, evaluate, plot, record, inspect, export, reproduce, sweep, verify, bench,
):  # fmt: skip
    main.add_command(command)
