"""Parts that the commands share: options and values, errors and exit codes, and output."""

from __future__ import annotations

import shlex
import sys
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from signal import SIGINT, SIGTERM
from typing import TYPE_CHECKING, Any, NoReturn, TypeAlias

import click

from sdnn.runs.errors import ConfigError, RunError, RunTerminatedError, UnknownKeyError
from sdnn.support.habits import advice

if TYPE_CHECKING:
    from rich.console import Console

    from sdnn.runs.run import Run

Options: TypeAlias = dict[str, Any]
"""The options of a command by their names."""

PLAIN_WIDTH = 160  # width of tables that go to a file or pipe

KEYS = (
    "agent.name", "agent.preset", "budget.steps", "budget.episodes", "budget.target_return", "seed",
    "protocol.n_envs", "protocol.evaluate_every", "protocol.evaluate_every_episodes",
    "protocol.evaluation_episodes", "environment.noise", "environment.redundant",
    "agent.angle_pairs", "agent.inputs", "agent.missing", "agent.history",
    "output.checkpoint_every", "output.keep_best", "output.tensorboard",
)  # fmt: skip
"""Settings with a dedicated option; ``--set KEY=VALUE`` sets any."""

WARMING_UP = "the agent is still warming up: it acts at random and has learned nothing yet"

OLD_FILE = click.Path(exists=True, dir_okay=False, path_type=Path)
NEW_FILE = click.Path(dir_okay=False, path_type=Path)
SEED = click.IntRange(min=0, max=2**64 - 1)

json_option = click.option("--json", "as_json", is_flag=True, help="Print the outcome as JSON.")


def option_of(key: str) -> str:
    """Return how the command line sets a key of a specification: ENV_ID, or an option."""
    key = key.partition("[")[0]  # an option sets a whole list, not one of its items
    if key == "agent.name":
        return "--agent"
    if key in (*KEYS, "steps", "episodes", "baseline"):
        return "--" + key.rpartition(".")[2].replace("_", "-")
    if key.startswith("environment.kwargs"):
        return f"--env-arg {key[len('environment.kwargs.') :]}".rstrip()
    if key.startswith("environment.ranges"):
        return " ".join(["--range", *key.split(".")[2:]])
    return "ENV_ID" if key in ("environment", "environment.id") else f"--set {key}"


def ways_to_set(context: click.Context) -> dict[str, str]:
    """Return how a command line sets each option of a command, and each setting, by their names.

    Settings are only those of commands with ``--set``. Of ``sdnn train``: "steps" is set by
    "--steps", "discount" by "--set learning.discount=...".
    """
    ways = {
        name.lstrip("-").replace("-", "_"): name
        for parameter in context.command.get_params(context)
        for name in (*parameter.opts, *parameter.secondary_opts)
        if name.startswith("--")
    }
    options = set(ways.values())
    if "--set" in options:
        from sdnn.runs.settings import KEYS_BY_NAME

        for name, key in KEYS_BY_NAME.items():
            option = option_of(key)
            if option.startswith("--set"):
                ways.setdefault(name, f"{option}=...")
            elif option in options:  # not every command has all options of `train`
                ways.setdefault(name, option)
        if any(parameter.name == "env_id" for parameter in context.command.params):
            ways["environment"] = "the argument ENV_ID"
    return ways


def explained_option(error: click.NoSuchOption) -> click.UsageError:
    """Return the error about an unknown option; it suggests a similar option or key."""
    ways = {} if error.ctx is None else ways_to_set(error.ctx)
    options = [way for way in ways.values() if way.startswith("--") and " " not in way]
    hint = advice(error.option_name, dict.fromkeys(options), ways)
    return click.UsageError(f"No such option: {error.option_name}: {hint}", error.ctx)


def error_of_set(key: str, expected: str) -> click.UsageError:
    """Return the error about a key that ``--set`` cannot set; it suggests what can be set."""
    ways = ways_to_set(click.get_current_context())
    hint = advice(key.rpartition(".")[2], (), ways)
    hint = f"; {hint}" if hint else ", such as learning.discount"
    return click.UsageError(f"--set {key}: must be {expected}{hint}")


def option_words(error: ConfigError) -> str:
    """Return an error's message, with the option in place of the key."""
    option = option_of(error.key)
    if isinstance(error, UnknownKeyError) and option.startswith("--set"):
        name = error.key.rpartition(".")[2].replace("-", "_")
        intended = ways_to_set(click.get_current_context()).get(name, "--set")
        if not intended.startswith("--set"):  # the key is the name of a dedicated option
            possible = "".join(error.problem.partition("possible: ")[1:])
            return f"{option}: unknown key; did you mean {intended}? {possible}".rstrip()
    return f"{option}: {error.problem}"


def words_of_run(folder: Path) -> Callable[[ConfigError], str]:
    """Return a function for messages of errors: keys are those of the run's file.

    Only ``steps`` and ``episodes``, the goal, are options.
    """

    def words(error: ConfigError) -> str:
        if error.key in ("steps", "episodes"):
            return option_words(error)
        return f"{folder / 'config.json'}: {error.key}: {error.problem}"

    return words


def value_of(text: str) -> object:
    """Parse a value of TOML, such as 0.5, true or [1, 2]; any other text stays a text."""
    import msgspec

    if "\n" in text:
        return text
    if text in ("True", "False"):
        return text == "True"
    try:
        return msgspec.toml.decode(f"value = {text}")["value"]
    except msgspec.DecodeError:
        return text


def named_values(option: str, pairs: Iterable[str]) -> Iterator[tuple[str, str]]:
    """Split texts like ``name=value``; UsageError that names the option for other texts."""
    for pair in pairs:
        name, equals, text = pair.partition("=")
        if not equals or not name.strip():
            raise click.UsageError(f"{option} must be NAME=VALUE, got {pair!r}")
        yield name.strip(), text.strip()


@contextmanager
def errors_in_a_line(
    words: Callable[[ConfigError], str] = str,
    then: Callable[[], str] = lambda: "; what was finished is stored",
) -> Iterator[None]:
    """Turn errors that users can correct, and signals, into one line and an exit code.

    ``words`` returns the message of a `ConfigError` that names no file. ``then`` returns the end
    of the line after a signal, such as how to resume.
    """
    try:
        yield
    except ConfigError as error:
        raise click.UsageError(str(error) if error.place else words(error)) from error
    except RunTerminatedError:
        exit_interrupted(then(), SIGTERM)
    except RunError as error:
        raise click.ClickException(str(error)) from error
    except KeyboardInterrupt:
        exit_interrupted(then())


def exit_interrupted(then: str, number: int = SIGINT) -> NoReturn:
    """Say that a signal has ended the command, and exit with a shell's code for it."""
    click.echo(("terminated" if number == SIGTERM else "interrupted") + then, err=True)
    raise click.exceptions.Exit(128 + number)


@contextmanager
def run_command(
    words: Callable[[ConfigError], str], *, folder: Path | None = None
) -> Iterator[None]:
    """Run the block of a command: modules are also searched in the present folder.

    Errors that users can correct become one line and an exit code, by `errors_in_a_line` with
    ``words``. After other errors and signals a line says how to resume the run in ``folder``.
    """
    import gymnasium as gym

    from sdnn.runs.environment import search_folder

    search_folder(Path.cwd())
    with errors_in_a_line(words, lambda: _how_to_resume(folder)):
        try:
            yield
        except (RunError, click.ClickException, click.exceptions.Exit):
            raise
        except Exception as error:  # an error in a user's environment needs its traceback
            frames = traceback.walk_tb(error.__traceback__)
            is_of_environment = any(isinstance(f.f_locals.get("self"), gym.Env) for f, _ in frames)
            if isinstance(error, OSError) and not is_of_environment:
                raise  # an error of a file, which the group of commands reports in a line
            if remedy := _how_to_resume(folder):
                click.echo("failed" + remedy, err=True)
            if isinstance(error, OSError):
                raise RuntimeError(f"the environment failed: {error}") from error
            raise


def _how_to_resume(folder: Path | None) -> str:
    """Return the end of a message that names the command to resume with, if there is a run."""
    from sdnn.runs.run import resume_command

    if folder is None or not folder.exists():
        return ""
    return f"; {resume_command(folder)} continues it"


def train_run(
    run: Run, as_json: bool, *, steps: int | None = None, episodes: int | None = None,
    repeat_episodes: bool = True,
) -> None:  # fmt: skip
    """Train a run with a bar on terminals; print the result, in words or as JSON (`as_json`)."""
    from sdnn.runs.run import resume_command
    from sdnn.training.training import shows_bar

    callbacks = []
    if shows_bar():
        from sdnn.training.callbacks import ProgressBarCallback

        callbacks.append(ProgressBarCallback(run.spec.task, seconds=0.0))
    outcome = run.train(
        steps=steps, episodes=episodes, callbacks=callbacks, repeat_episodes=repeat_episodes
    )
    if as_json:
        facts = {k: v for k, v in vars(outcome).items() if k not in ("has_pictures", "scaling")}
        click.echo(json_text({"folder": str(run.folder), **facts}))
        return
    report = outcome.learning_report
    too_wide: list[int] = []
    too_narrow: list[int] = []
    if report is not None and not outcome.is_solved:  # a solved task needs no other ranges
        too_wide, too_narrow = _unsuitable_ranges(report)
    text = rendered(
        "outcome.txt.jinja",
        run=run,
        outcome=outcome,
        report=report,
        too_wide=too_wide,
        too_narrow=too_narrow,
        warming_up=WARMING_UP,
        resume=resume_command(run.folder, "--steps", "N"),
        folder=str(run.folder),
        quoted=shlex.quote(str(run.folder)),
    )
    click.echo(text)


def _unsuitable_ranges(report: Mapping[str, Any]) -> tuple[list[int], list[int]]:
    """Return the observed variables whose ranges are much too wide, and those too narrow.

    Too wide: less than a tenth is used, unless the agent fits the range itself. Too narrow: more
    than a tenth of the observations are beyond it. The tenths are chosen. Shares may be None, where
    a variable has no range.
    """
    too_wide = [
        i
        for i, share in enumerate(report["share_of_range"])
        if share and share < 0.1 and i not in report["fitted"]
    ]
    too_narrow = [
        i for i, share in enumerate(report["share_beyond_range"]) if share and share > 0.1
    ]
    return too_wide, too_narrow


def rendered(template: str, **values: object) -> str:
    """Fill in a template of this package; without a line feed at the end."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("sdnn.cli", "."),
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(template).render(values).rstrip("\n")


def json_text(values: object) -> str:
    """Write values as JSON; NaN and infinite numbers, which JSON lacks, become null."""
    import msgspec

    return msgspec.json.format(msgspec.json.encode(values), indent=2).decode()


def make_console() -> Console:
    """Make the console for tables: as wide as a terminal, or `PLAIN_WIDTH` for files and pipes."""
    from rich.console import Console

    return Console(width=None if sys.stdout.isatty() else PLAIN_WIDTH)
