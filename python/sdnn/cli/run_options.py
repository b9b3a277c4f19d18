"""What the commands on runs share: options made from a specification, values, errors, outcomes."""

from __future__ import annotations

import os
import sys
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from signal import SIGINT, SIGTERM
from typing import TYPE_CHECKING, Any

import click

from sdnn.cli.output import exit_code, json_text

if TYPE_CHECKING:
    from sdnn.agents.scaling import Scaling
    from sdnn.runs import ConfigError, Run, RunOutcome

KEYS = (
    "agent.name", "agent.preset", "budget.steps", "budget.episodes", "budget.target_return", "seed",
    "protocol.n_envs", "protocol.evaluate_every", "protocol.evaluate_every_episodes",
    "protocol.evaluation_episodes", "environment.noise", "environment.redundant",
    "agent.angle_pairs", "output.checkpoint_every", "output.tensorboard",
)  # fmt: skip
"""Settings with an option of their own; ``--set KEY=VALUE`` sets any."""

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


class SpecCommand(click.Command):
    """A command with the options of `KEYS`, which are made when they are first needed."""

    _made: list[click.Parameter] | None = None

    @property
    def params(self) -> list[click.Parameter]:
        """All parameters; those of a specification come after the command's own."""
        if self._made is None:
            self._made = [*self._own, *_options()]
        return self._made

    @params.setter
    def params(self, own: list[click.Parameter]) -> None:
        self._own = own
        self._made = None


def _options() -> Iterator[click.Option]:
    """Make the options of `KEYS` from the schema of the specification's fields."""
    import msgspec

    from sdnn.runs import RunSpec

    _, schemas = msgspec.json.schema_components([RunSpec])
    for key in KEYS:
        found: dict[str, Any] = {"$ref": "RunSpec"}
        for name in key.split("."):
            parts = (found, *found.get("anyOf", ()))
            table = next(one["$ref"] for one in parts if "$ref" in one).rpartition("/")[2]
            found = schemas[table]["properties"][name]
        kind = next((one for one in found.get("anyOf", ()) if one.get("type") != "null"), found)
        is_flag, default = kind.get("type") == "boolean", found.get("default")
        shown = "" if default is None or is_flag else f"  [default: {default}]"
        yield click.Option(
            [option_of(key), key.replace(".", "_")],
            type=None if is_flag else _option_type(kind),
            is_flag=is_flag,
            default=None,
            help=found["description"].replace("`", "") + shown,
        )


def _option_type(kind: Mapping[str, Any]) -> Any:
    low, high = kind.get("minimum"), kind.get("maximum")
    if "enum" in kind:
        return click.Choice([word for word in kind["enum"] if word is not None])
    if kind.get("type") == "integer":
        return click.IntRange(low, None if high == 2**53 else high)
    if kind.get("type") == "number":
        return click.FLOAT if low is None else click.FloatRange(low, high)
    return click.STRING


def given_values(options: dict[str, Any]) -> dict[str, Any]:
    """Take the options of a specification out of those of a command: given values by their keys."""
    found = {key: options.pop(key.replace(".", "_")) for key in KEYS}
    return {key: value for key, value in found.items() if value is not None and value is not False}


def option_of(key: str) -> str:
    """Return the option that sets a key of a specification, or the argument."""
    key = key.partition("[")[0]
    if key == "agent.name":
        return "--agent"
    if key in (*KEYS, "steps", "episodes"):
        return "--" + key.rpartition(".")[2].replace("_", "-")
    if key.startswith("environment.kwargs"):
        return " ".join(["--env-arg", *key.split(".")[2:]])
    if key.startswith("environment.ranges"):
        return " ".join(["--range", *key.split(".")[2:]])
    return "ENV_ID" if key in ("environment", "environment.id") else f"--set {key}"


def option_words(error: ConfigError) -> str:
    """Return an error's message with the option that gave the value."""
    return f"{option_of(error.key)}: {error.problem}"


def words_of_run(folder: Path) -> Callable[[ConfigError], str]:
    """Return the function for messages about a run's own configuration; its goal is an option."""

    def words(error: ConfigError) -> str:
        if error.key in ("steps", "episodes"):
            return option_words(error)
        return f"{folder / 'config.json'}: {error.key}: {error.problem}"

    return words


def value_of(text: str) -> Any:
    """Read a value as TOML has it, such as 0.5, true or [1, 2], or True; others are texts."""
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
    """Let environments be modules of the present folder; make errors a line and an exit code.

    ``words`` returns the message about a configuration whose file is not known. ``folder`` is the
    run that is resumed after an interrupt.
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
        raise click.exceptions.Exit(exit_code(SIGTERM)) from error
    except RunError as error:
        raise click.ClickException(str(error)) from error
    except KeyboardInterrupt as error:
        _tell_how_to_resume("interrupted", folder)
        raise click.exceptions.Exit(exit_code(SIGINT)) from error
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
    """Print how to resume beside the traceback, which the environment's author needs."""
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
    way = f"; {command_line('sdnn', 'resume', folder)} continues it" if is_begun else ""
    click.echo(what + way, err=True)


def train_run(
    run: Run,
    as_json: bool,
    *,
    steps: int | None = None,
    episodes: int | None = None,
    repeat_episodes: bool = True,
) -> None:
    """Train a run, with a line of progress on a terminal, and print the result."""
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
    """Return an outcome as JSON has it."""
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
    """Describe the observations that the agent needs elsewhere."""
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
            f" {command_line('sdnn', 'resume', run.folder, '--steps', 'N')} continues it"
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
