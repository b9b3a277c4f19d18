"""The command ``sdnn export``: an agent or estimator in a form for other programs."""

from __future__ import annotations

import dataclasses
import math
import warnings
from collections.abc import Iterator, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sdnn.cli.common import (
    NEW_FILE,
    SEED,
    Options,
    error_of_set,
    json_option,
    json_text,
    named_values,
    option_of,
    option_words,
    run_command,
    value_of,
    words_of_run,
)
from sdnn.support.arguments import blamed

if TYPE_CHECKING:
    import gymnasium as gym

    from sdnn.agents.agent import AnyAgent
    from sdnn.environments.spaces import Missing
    from sdnn.environments.types import Data
    from sdnn.estimators.fitted import Fitted
    from sdnn.export import CHeader, EstimatorHeader

_ESTIMATORS = ("SDNNRegressor", "SDNNClassifier")
_MOST_ACTIONS = 2**16  # of --actions N, so that a mistyped number takes no memory; chosen
_LARGEST = 2**31  # bounds of --range and --actions are below it: headers have 32-bit numbers


@click.command(short_help="Write an agent or estimator as a C header, for small processors.")
@click.argument(
    "source", metavar="[RUN]", required=False, type=click.Path(exists=True, path_type=Path)
)
@click.option(
    "--c-header",
    "path",
    metavar="FILE",
    required=True,
    type=NEW_FILE,
    help="A C99 header with the greedy policy, in integers: for small processors.",
)
@click.option(
    "--learning",
    is_flag=True,
    help="The header has the agent itself, which continues to learn. For the agents q-lambda,"
    " actor-critic, and sdnn-c with approximator.averaging_interval=0 and"
    " approximator.weight_limit=127.",
)
@click.option(
    "--durations",
    is_flag=True,
    help="With --learning or --new: the header also learns steps of unequal length, by"
    " NAME_learn_over. Not for sdnn-c.",
)
@click.option(
    "--new",
    is_flag=True,
    help="Instead of RUN, an agent that has learned nothing and learns on the processor.",
)
@click.option(
    "--range",
    "ranges",
    metavar="LOW:HIGH|angle|running",
    multiple=True,
    help="With --new: range of a sensor's values; repeat it for each sensor, in their order."
    " angle: in radians, from -pi to pi, which are the same. running: for an actor-critic, follows"
    " the readings, as for all sensors that are no angles.",
)
@click.option(
    "--actions",
    metavar="N|LOW:HIGH",
    multiple=True,
    help="With --new: the number of actions, or the range of a continuous one, which is cut into"
    " approximator.n_actions; repeat it for each motor.",
)
@click.option(
    "--agent",
    "kind",
    type=click.Choice(["q-lambda", "actor-critic", "sdnn-c"]),
    help="With --new: which agent.  [default: q-lambda]",
)
@click.option(
    "--ram",
    metavar="BYTES",
    type=click.IntRange(1, 2**31),
    help="With --new: most memory that the agent may take.  [default: 20000, or 60000 for sdnn-c]",
)
@click.option(
    "--missing",
    type=click.Choice(["error", "hold", "code"]),
    help="With --new: whether missing readings are refused, count as the last ones of the episode,"
    " or have a pattern.  [default: error]",
)
@click.option(
    "--set",
    "settings",
    metavar="TABLE.NAME=VALUE",
    multiple=True,
    help="With --new: a setting of approximator or learning, such as learning.discount=0.95; may"
    " be repeated.",
)
@click.option(
    "--seed", type=SEED, help="With --new: root of the agent's random numbers.  [default: 0]"
)
@click.option(
    "--flash",
    metavar="BYTES",
    type=click.IntRange(1, 2**40),
    help="Most flash that the header's constants may take, and of an estimator its code.",
)
@click.option(
    "--name", metavar="PREFIX", help="Prefix of its names.  [default: FILE without ending]"
)
@click.option(
    "--fraction-bits",
    type=click.IntRange(min=0, max=30),
    help="Fraction bits of observations, actions and rewards."
    "  [default: 16, or fewer where a range needs it]",
)
@json_option
def export(
    source: Path | None,
    path: Path,
    learning: bool,
    durations: bool,
    name: str | None,
    fraction_bits: int | None,
    flash: int | None,
    as_json: bool,
    new: bool,
    **options: Any,
) -> None:
    """Write the agent of RUN, a run's folder or an agent's file, in a form for other programs.

    The header observes what the agent did: with --noise or --redundant, variables scaled to [0, 1].
    Its comments name the ranges.

    RUN may also be the file of an SDNNRegressor or SDNNClassifier, which predicts, and with
    --learning learns.

    A new agent needs no RUN, only what it senses and does, here a cart with a pole and two actions:

    \b
    sdnn export --new --range -2.4:2.4 --range -3:3 --range -0.21:0.21
      --range -3.5:3.5 --actions 2 --c-header pole.h
    """  # noqa: D301
    _check_source(source, new, options)
    learning = learning or new
    if durations and not learning:
        raise click.UsageError("--durations needs --learning or --new: policies learn nothing")
    with run_command(option_words if source is None else words_of_run(source)):
        model = None if source is None or source.is_dir() else _estimator_in(source)
        if model is not None:
            if durations:
                raise click.UsageError("--durations is for agents: an estimator has no steps")
            if fraction_bits is not None:
                raise click.UsageError("--fraction-bits is for agents: an estimator has doubles")
            header = _write_estimator(model, path, name, learning, flash)
            click.echo(_description_of(path, header, learning, {} if as_json else None))
            return
        if source is None:
            agent = _new_agent(durations=durations, **options)
        else:
            agent = _read_agent_of(source)
        try:
            agent_header = _write_agent(
                agent, path, name, learning, flash, durations, fraction_bits
            )
        except (TypeError, RuntimeError) as error:
            place = "" if source is None else f"{source}: "
            raise click.ClickException(f"{place}{error}") from error
    if as_json:
        more = {"scaling": None if agent.scaling is None else agent.scaling.values()}
        click.echo(_description_of(path, agent_header, learning, more))
        return
    description = _description_of(path, agent_header, learning)
    click.echo(f"{description}, {agent_header.n_words:,} words of weights read per decision")
    for line in _observed(agent):
        click.echo(line)


def _check_source(source: Path | None, new: bool, options: Options) -> None:
    """Check that there is either a RUN or --new; ``options`` are those of new agents.

    UsageError if not, if a new agent lacks its ranges or actions, or if RUN has such options.
    """
    if new and source is not None:
        raise click.UsageError(f"--new makes an agent that needs no RUN: omit {source}, or --new")
    if not new and source is None:
        raise click.UsageError("RUN must be given, or --new for an agent that has learned nothing")
    names = {"ranges": "--range", "settings": "--set", "kind": "--agent"}
    for key, value in options.items():
        option, is_given = names.get(key, f"--{key}"), value not in ((), None)
        if new and key in ("ranges", "actions") and not is_given:
            raise click.UsageError(f"--new needs {option}, once or more: see sdnn export --help")
        if not new and is_given:
            raise click.UsageError(f"{option} needs --new: the agent of RUN has its own")


def _write_estimator(
    model: Fitted, path: Path, name: str | None, learning: bool, flash: int | None
) -> EstimatorHeader:
    """Write the header of an estimator; errors name the options."""
    from sdnn.export import export_estimator_header

    prefix = path.stem if name is None else name
    with _errors_of_options(name, flash_bytes="--flash"):
        return export_estimator_header(
            model, path, name=prefix, learning=learning, flash_bytes=flash
        )


def _write_agent(
    agent: AnyAgent,
    path: Path,
    name: str | None,
    learning: bool,
    flash: int | None,
    durations: bool,
    fraction_bits: int | None,
) -> CHeader:
    """Write the header of an agent; errors and warnings name the options.

    TypeError if it has no header.
    """
    from sdnn.export import c_header
    from sdnn.support.files import write_whole

    prefix = path.stem if name is None else name
    with (
        _errors_of_options(name, fraction_bits="--fraction-bits", durations="--durations"),
        warnings.catch_warnings(record=True) as caught,
    ):
        warnings.simplefilter("always")
        header = c_header(
            agent, prefix, fraction_bits=fraction_bits, learning=learning, durations=durations
        )
    if flash is not None and header.flash_bytes > flash:
        raise click.UsageError(
            f"--flash must be at least {header.flash_bytes}, for the constants of this agent,"
            f" got {flash}: make it with fewer units or inputs, such as by --ram with --new"
        )
    write_whole(path, header.text.encode())
    for warning in caught:
        message = str(warning.message).replace("fraction_bits", "--fraction-bits")
        click.echo(f"warning: {message}", err=True)
    return header


def _observed(agent: AnyAgent) -> Iterator[str]:
    """Yield lines about what an agent observes in place of an environment's observations."""
    for statistics in agent.wrappers:
        if lines := statistics.observation_lines():
            yield (
                f"it observes what the wrapper {statistics.wrapper} gave, (value - mean) /"
                " sqrt(variance):"
            )
            yield from (f"  {line}" for line in lines)
    if agent.scaling is not None:
        yield "it observes each variable scaled from its range to [0, 1], as its run did:"
        yield from (f"  {line}" for line in agent.scaling.lines())


@contextmanager
def _errors_of_options(name: str | None, **options: str) -> Iterator[None]:
    """Turn errors about arguments of a header into those of the command's options.

    ``name`` is the value of --name, ``options`` are the options of other arguments by their names.
    """
    options["name"] = "--c-header gives no name; use --name, which" if name is None else "--name"
    try:
        yield
    except ValueError as error:
        argument, problem = blamed(error)
        if argument not in options:
            raise click.ClickException(str(error)) from error
        raise click.UsageError(f"{options[argument]} {problem}") from error


def _description_of(
    path: Path, header: CHeader | EstimatorHeader, learning: bool, more: Data | None = None
) -> str:
    """Describe a header: in a line, or as JSON with the values ``more`` if these are not None.

    ``learning`` is whether its agent or estimator learns, and so keeps its arrays.
    """
    if more is not None:
        values = {k: v for k, v in dataclasses.asdict(header).items() if k != "text"}
        return json_text({"file": str(path), **values, **more})
    return (
        f"wrote {path}: {header.flash_bytes:,} bytes of constants, {header.ram_bytes:,} bytes of"
        f" {'memory' if learning else 'arrays on the stack'}"
    )


def _estimator_in(source: Path) -> Fitted | None:
    """Read the estimator of a file; None if it holds something else, or is damaged."""
    from sdnn.support.files import read_file

    name = None
    with suppress(ValueError):
        name = read_file(source, "agent", "training", "estimator")[0].get("class")
    if name not in _ESTIMATORS:
        return None
    from sdnn import estimators  # scikit-learn is slow to import

    # Users export files of their own: 4 GiB admit larger estimators than the default of `load`.
    model: Fitted = getattr(estimators, name).load(source, memory_limit=2**32)
    return model


def _read_agent_of(source: Path) -> AnyAgent:
    """Read the agent of a run's folder or of an agent's file."""
    from sdnn.agents import load_agent
    from sdnn.runs.run import agent_of

    try:
        return agent_of(source) if source.is_dir() else load_agent(source)
    except ValueError as error:
        raise click.ClickException(str(error)) from error


def _new_agent(
    ranges: Sequence[str],
    actions: Sequence[str],
    kind: str | None,
    ram: int | None,
    settings: Sequence[str],
    seed: int | None,
    missing: Missing | None,
    *,
    durations: bool,
) -> AnyAgent:
    """Make an untrained agent from the options of ``sdnn export`` without a file."""
    import gymnasium as gym
    import numpy as np

    from sdnn.export import new_agent
    from sdnn.export.new import new_settings
    from sdnn.runs.settings import with_changes

    is_running = "running" in ranges
    if is_running and not {*ranges} <= {"running", "angle"}:
        raise click.UsageError("--range running must be that of all sensors that are no angles")
    if is_running and kind != "actor-critic":
        raise click.UsageError("--range running needs --agent actor-critic: state LOW:HIGH")
    more: dict[str, Any] = {"observation_range": "running"} if is_running else {}
    bounds_by_name = {"angle": (-math.pi, math.pi), "running": (-1.0, 1.0)}
    bounds = [bounds_by_name.get(text) or _bounds_in("--range", text) for text in ranges]
    tables: dict[str, dict[str, object]] = {"approximator": {}, "learning": {}}
    for name, text in named_values("--set", settings):
        table, _, key = name.partition(".")
        if table not in tables or not key:
            raise error_of_set(name, "approximator.NAME or learning.NAME")
        tables[table][key] = value_of(text)
    kind = kind or "q-lambda"
    parts = {name: with_changes(new_settings(kind)[name], tables[name], name) for name in tables}
    low, high = np.array(bounds).T
    try:
        return new_agent(
            gym.spaces.Box(low, high, dtype=np.float64),
            _action_space(actions),
            kind=kind,
            ram_bytes=ram,
            seed=seed or 0,
            missing=missing or "error",
            durations=durations,
            **more,
            angles=[i for i, text in enumerate(ranges) if text == "angle"],
            **parts,
        )
    except (ValueError, OverflowError, MemoryError) as error:
        name, problem = blamed(error)
        options_of = {"ram_bytes": "--ram", "durations": "--durations"}
        options_of |= {"observation_space": "--range", "action_space": "--actions"}
        for table, part in parts.items():
            if hasattr(part, name):
                options_of[name] = option_of(f"{table}.{name}")
        raise click.UsageError(
            f"{options_of[name]} {problem}" if name in options_of else str(error)
        ) from error


def _action_space(texts: Sequence[str]) -> gym.Space[Any]:
    """Return the space of --actions: a Box of ranges, a Discrete, or a MultiDiscrete."""
    import gymnasium as gym
    import numpy as np

    if all(":" in text for text in texts):
        low, high = np.array([_bounds_in("--actions", text) for text in texts]).T
        return gym.spaces.Box(low, high, dtype=np.float64)
    if any(not text.isdecimal() or not 2 <= float(text) <= _MOST_ACTIONS for text in texts):
        raise click.UsageError(
            f"--actions must be numbers of actions, 2 to {_MOST_ACTIONS}, or all ranges LOW:HIGH,"
            f" got {', '.join(texts)!r}"
        )
    sizes = [int(text) for text in texts]
    return gym.spaces.Discrete(sizes[0]) if len(sizes) == 1 else gym.spaces.MultiDiscrete(sizes)


def _bounds_in(option: str, text: str) -> tuple[float, float]:
    """Return the numbers of LOW:HIGH; a usage error names the option."""
    low, _, high = text.partition(":")
    try:
        bounds = float(low), float(high)
    except ValueError:
        bounds = math.nan, math.nan
    if not -_LARGEST < bounds[0] < bounds[1] < _LARGEST:
        word = ", angle or running" if option == "--range" else ""
        raise click.UsageError(
            f"{option} must be LOW:HIGH{word}, LOW below HIGH and both within 2^31, got {text!r}"
        )
    return bounds
