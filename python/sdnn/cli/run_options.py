"""What the commands on run folders have in common: texts to values, and how errors are told."""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sdnn.cli.output import EXIT_INTERRUPTED, json_text

if TYPE_CHECKING:
    from sdnn.agents.scaling import Scaling
    from sdnn.runs import ConfigError, Run, RunOutcome

EXIT_TERMINATED = 143

WARMING_UP = "the agent is still warming up: it acts at random and has learned nothing yet"

run_argument = click.argument(
    "folder", metavar="RUN", type=click.Path(exists=True, file_okay=False, path_type=Path)
)

json_option = click.option("--json", "as_json", is_flag=True, help="Print the outcome as JSON.")

seed_option = click.option(
    "--seed",
    type=click.IntRange(min=0, max=2**64 - 1),
    help="Root of the episodes' seeds.  [default: others than those of the training]",
)


def option_words(error: ConfigError) -> str:
    """Tell an error in the option that gave the value."""
    from sdnn.cli.spec_options import option_of

    return f"{option_of(error.key)}: {error.problem}"


def words_of_run(folder: Path) -> Callable[[ConfigError], str]:
    """Tell errors in what a run's own configuration says; its goal may be an option."""

    def words(error: ConfigError) -> str:
        if error.key in ("steps", "episodes"):
            return option_words(error)
        return f"{folder / 'config.json'}: {error.key}: {error.problem}"

    return words


def value_of(text: str) -> Any:
    """Read a value as TOML has it, such as 0.5, true or [1, 2]; anything else is a text.

    True and False are as Python writes them, too.
    """
    if sys.version_info >= (3, 11):
        import tomllib
    else:
        import tomli as tomllib
    if "\n" in text:
        return text
    if text in ("True", "False"):
        return text == "True"
    try:
        return tomllib.loads(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text


def check_ending(option: str, path: Path, endings: Sequence[str]) -> None:
    """Check what a file is to become; UsageError with the option's name if it is something else."""
    if path.suffix not in endings:
        raise click.UsageError(f"{option} must end in one of {', '.join(endings)}, got {path}")


def named_values(option: str, pairs: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Split texts like ``name=value``; UsageError with the option's name if one is none."""
    for pair in pairs:
        name, equals, text = pair.partition("=")
        if not equals or not name.strip():
            raise click.UsageError(f"{option} must be NAME=VALUE, got {pair!r}")
        yield name.strip(), text.strip()


@contextmanager
def run_command(
    words: Callable[[ConfigError], str], *, folder: Path | None = None
) -> Iterator[None]:
    """Let environments be modules of the present folder, and tell errors that users can mend.

    They become a line and an exit code. ``words`` tells those of a configuration that do not say
    where it stands; ``folder`` is what an interrupted run goes on from.
    """
    from sdnn.runs import ConfigError, RunError, RunTerminatedError

    if not {"", os.getcwd()} & set(sys.path):
        sys.path.append(os.getcwd())
    try:
        yield
    except ConfigError as error:
        raise click.UsageError(str(error) if error.place else words(error)) from error
    except RunTerminatedError as error:
        _tell_how_to_resume("terminated", folder)
        raise click.exceptions.Exit(EXIT_TERMINATED) from error
    except RunError as error:
        raise click.ClickException(str(error)) from error
    except KeyboardInterrupt as error:
        _tell_how_to_resume("interrupted", folder)
        raise click.exceptions.Exit(EXIT_INTERRUPTED) from error
    except (click.ClickException, click.exceptions.Exit):
        raise
    except OSError as error:
        if not _is_of_environment(error):
            raise  # a file's of ours
        _tell_failure(folder)
        raise RuntimeError(f"the environment failed: {error}") from error
    except Exception:
        _tell_failure(folder)
        raise


def _tell_failure(folder: Path | None) -> None:
    """Of an environment, whose author needs all of the error, too."""
    if folder is not None and folder.exists():
        _tell_how_to_resume("failed", folder)


def _is_of_environment(error: BaseException) -> bool:
    """Whether a method of an environment was at work when it was raised."""
    import gymnasium as gym

    frames = traceback.walk_tb(error.__traceback__)
    return any(isinstance(frame.f_locals.get("self"), gym.Env) for frame, _ in frames)


def _tell_how_to_resume(what: str, folder: Path | None) -> None:
    from sdnn.runs.errors import command_line

    is_begun = folder is not None and folder.exists()
    goes_on = f"; {command_line('sdnn', 'resume', folder)} goes on" if is_begun else ""
    click.echo(what + goes_on, err=True)


def train_run(
    run: Run,
    as_json: bool,
    *,
    steps: int | None = None,
    episodes: int | None = None,
    repeat_episodes: bool = True,
) -> None:
    """Train a run, with a line of progress on a terminal, and print what came of it."""
    callbacks = []
    if sys.stderr.isatty():
        from rich.console import Console

        from sdnn.agents.callbacks import ProgressBarCallback

        callbacks.append(ProgressBarCallback(Console(stderr=True), run.spec.task))
    outcome = run.train(
        steps=steps, episodes=episodes, callbacks=callbacks, repeat_episodes=repeat_episodes
    )
    if as_json:
        click.echo(json_text({"folder": str(run.folder), **outcome_values(outcome)}))
        return
    for line in _outcome_lines(run, outcome):
        click.echo(line)


def outcome_values(outcome: RunOutcome) -> Mapping[str, Any]:
    """Give an outcome as JSON has it."""
    report = outcome.learning_report
    return {
        "n_steps": outcome.n_steps,
        "n_episodes": outcome.n_episodes,
        "reason": outcome.reason,
        "is_warming_up": outcome.is_warming_up,
        "last_evaluation": outcome.last_evaluation,
        "learning_report": None if report is None else dict(report),
    }


_LITTLE_OF_A_RANGE = 0.1
_OFTEN_BEYOND_A_RANGE = 0.1


def _lines_of_ranges(report: Mapping[str, Any]) -> Iterator[str]:
    """Name variables whose ranges do not suit what was observed."""
    shares = enumerate(report["share_of_range"])
    narrow = [i for i, share in shares if share is not None and 0.0 < share < _LITTLE_OF_A_RANGE]
    if narrow:
        yield (
            f"{_variables(narrow)} moved within {_LITTLE_OF_A_RANGE:.0%} of the range:"
            " the network can hardly tell such values apart; --range adaptive narrows ranges"
        )
    shares = enumerate(report["share_beyond_range"])
    clipped = [i for i, share in shares if share is not None and share > _OFTEN_BEYOND_A_RANGE]
    if clipped:
        yield (
            f"{_variables(clipped)} left the range more than {_OFTEN_BEYOND_A_RANGE:.0%} of the"
            " time: the network cannot tell what is beyond; --range makes it wider"
        )


def _lines_of_scaling(run: Run, scaling: Scaling | None) -> Iterator[str]:
    """Say what the agent needs wherever else it acts."""
    if scaling is not None:
        yield (
            f"the agent observes variables scaled to [0, 1], {scaling.words()}: elsewhere it needs"
            f" the same, as sdnn.runs.Run.open({str(run.folder)!r}).spec.make_env()"
            " gives it"
        )


def _listed(words: Sequence[str]) -> str:
    most = 8
    return ", ".join(words[:most]) + (", ..." if len(words) > most else "")


def _variables(numbers: Sequence[int]) -> str:
    named = _listed([str(number) for number in numbers])
    return f"observed variable{'s' if len(numbers) > 1 else ''} {named}"


def _outcome_lines(run: Run, outcome: RunOutcome) -> Iterator[str]:
    from sdnn.runs.errors import command_line

    why = " (the target is reached)" if outcome.reason == "target" else ""
    yield f"{run.folder}: {outcome.n_steps} steps, {outcome.n_episodes} episodes{why}"
    if outcome.is_warming_up:
        yield (
            f"{WARMING_UP}; that takes {run.spec.agent.warm_up_steps} steps:"
            f" {command_line('sdnn', 'resume', run.folder, '--steps', 'N')} goes on"
        )
    row = outcome.last_evaluation
    if row is not None:
        yield (
            f"last evaluation, after {row['step']} steps: mean return"
            f" {row['mean_return']:.6g} over {len(row['returns'])} greedy episodes"
        )
    report = outcome.learning_report
    if report is not None and report["n_corrections"]:
        yield (
            f"of {report['n_corrections']} corrections {report['share_changed']:.0%} changed the"
            f" network, {report['share_rounded_away']:.0%} were rounded away and"
            f" {report['share_out_of_range']:.0%} out of its range of values"
        )
    if report is not None:
        yield from _lines_of_ranges(report)
    yield from _lines_of_scaling(run, outcome.scaling)
    commands: list[tuple[object, ...]] = [("plot", run.folder), ("evaluate", run.folder)]
    if outcome.has_pictures:
        commands.append(("record", run.folder, "x.gif"))
    yield "next: " + ", ".join(command_line("sdnn", *words) for words in commands)
