"""The command ``sdnn train``: an agent learns in an environment."""

from __future__ import annotations

import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from sdnn.cli.run_options import (
    Origins,
    json_option,
    named_values,
    run_command,
    train_run,
    value_of,
)

if TYPE_CHECKING:
    from sdnn.runs import RunConfig

AGENTS = ("sdnn-c", "rbf", "fuzzy")
PRESETS = ("general", "small", "robust", "paper")


@click.command(short_help="Learn in a Gymnasium environment.")
@click.argument("env_id", metavar="[ENV_ID]", required=False)
@click.option("--agent", type=click.Choice(AGENTS), help="Who learns.  [default: sdnn-c]")
@click.option(
    "--preset",
    type=click.Choice(PRESETS),
    help="Settings of the agent sdnn-c.  [default: general]",
)
@click.option("--steps", type=click.IntRange(min=1), help="How long it learns.  [default: 200000]")
@click.option("--episodes", type=click.IntRange(min=1), help="The same in episodes.")
@click.option(
    "--seed", type=click.IntRange(min=0, max=2**64 - 1), help="Root of all seeds.  [default: 0]"
)
@click.option(
    "--n-envs",
    type=click.IntRange(min=1, max=4096),
    metavar="N",
    help="Environments to learn in, in turn; steps are counted over all.  [default: 1]",
)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="The run's folder.  [default: runs/ENV-AGENT-SEED]",
)
@click.option(
    "--config",
    "file",
    metavar="FILE",
    type=click.Path(exists=True, dir_okay=False, path_type=Path),
    help="Settings in TOML, or another run's config.json; options come before them.",
)
@click.option(
    "--noise",
    type=click.FloatRange(min=0),
    metavar="SIGMA",
    help="Sensor noise, in parts of the range of each variable.",
)
@click.option(
    "--redundant",
    type=click.IntRange(min=0),
    metavar="K",
    help="Append K means of neighbouring variables to the observation.",
)
@click.option(
    "--range",
    "ranges",
    metavar="[VARIABLE=]LOW:HIGH|seen",
    multiple=True,
    help="Range of an observed variable, from 0, or of all; may be repeated. seen: from a warm-up.",
)
@click.option(
    "--set",
    "settings",
    metavar="SECTION.NAME=VALUE",
    multiple=True,
    help="A setting, such as learning.discount=0.95; may be repeated.",
)
@click.option(
    "--env-arg",
    "kwargs",
    metavar="NAME=VALUE",
    multiple=True,
    help="An argument of the environment, or of gymnasium.make; may be repeated.",
)
@click.option(
    "--evaluate-every",
    type=click.IntRange(min=0),
    metavar="N",
    help="Steps between evaluations; 0: none.  [default: 10000]",
)
@click.option(
    "--evaluation-episodes",
    type=click.IntRange(min=1),
    metavar="N",
    help="Greedy episodes in each.  [default: 10]",
)
@click.option(
    "--checkpoint-every",
    type=click.IntRange(min=1),
    metavar="N",
    help="Steps between checkpoints.  [default: 10000]",
)
@click.option(
    "--target-return",
    type=float,
    metavar="R",
    help="Stop when an evaluation has this mean return.",
)
@click.option(
    "--angle-pairs",
    type=click.Choice(("none", "find")),
    help="Whether cosine and sine of an angle become one input.  [default: none]",
)
@click.option("--tensorboard", is_flag=True, help="Write the numbers for TensorBoard, too.")
@json_option
@click.option("--dry-run", is_flag=True, help="Only check everything, and print the configuration.")
def train(
    env_id: str | None,
    file: Path | None,
    out: Path | None,
    as_json: bool,
    dry_run: bool,
    **options: Any,
) -> None:
    """Learn in a Gymnasium environment: ENV_ID, such as CartPole-v1 or my_module:my/Env-v0.

    The run's folder holds its configuration, the rows of its episodes and evaluations, a checkpoint
    and, in the end, the agent. Ctrl-C stops after a checkpoint; `sdnn resume` goes on, also after a
    crash, as if nothing had happened.
    """
    origins = Origins()
    with run_command(origins.words):
        config = _config(env_id, file, options, origins)
        folder = out or _folder_of(config)
        if dry_run:
            from sdnn.runs import Run

            Run(folder, config).check()
            click.echo(json.dumps({"folder": str(folder), **config.values()}, indent=2))
            return
    with run_command(origins.words, folder=folder):
        from sdnn.runs import Run
        from sdnn.runs.errors import command_line

        if (folder / "config.json").exists():
            goes_on = command_line("sdnn", "resume", folder)
            raise click.UsageError(
                f"--out: {folder} holds a run already: {goes_on} goes on with it"
            )
        run = Run.create(folder, config)
        train_run(run, as_json)


def _config(
    env_id: str | None, file: Path | None, options: Mapping[str, Any], origins: Origins
) -> RunConfig:
    """Make the configuration of a file, and of options, which come before it.

    ``origins`` is told where each value comes from.
    """
    from sdnn.runs import RunConfig

    values: dict[str, Any] = {}
    if file is not None:
        values = RunConfig.read(file, env_id).values()
        origins.add_file(file)
    values.pop("version", None)
    environment = dict(values.get("environment", {}))
    settings = {section: dict(own) for section, own in values.get("settings", {}).items()}
    given = {name: v for name, v in options.items() if v is not None and v is not False}
    for name, text in named_values("--set", given.pop("settings")):
        section, dot, setting = name.partition(".")
        if not dot:
            raise click.UsageError(f"--set {name}: must be SECTION.NAME, such as learning.discount")
        settings.setdefault(section, {})[setting] = value_of(text)
        origins.add_option(f"settings.{name}")
    if env_id is not None:
        environment["id"] = env_id
        origins.add_option("environment.id")
    if "id" not in environment:
        raise click.UsageError("ENV_ID must be given, or a --config that names an environment")
    kwargs = {name: value_of(text) for name, text in named_values("--env-arg", given.pop("kwargs"))}
    environment["kwargs"] = {**environment.get("kwargs", {}), **kwargs}
    for name in kwargs:
        origins.add_option(f"environment.kwargs.{name}")
    texts = given.pop("ranges")
    if "seen" in texts:
        settings.setdefault("agent", {})["observation_range"] = "seen"
        origins.add_option("settings.agent.observation_range")
    ranges = dict(_range(text) for text in texts if text != "seen")
    environment["ranges"] = {**environment.get("ranges", {}), **ranges}
    for name in ranges:
        origins.add_option(f"environment.ranges.{name}")
    for name in ("noise", "redundant"):
        if name in given:
            environment[name] = given.pop(name)
            origins.add_option(f"environment.{name}")
    if "steps" in given and "episodes" in given:
        raise click.UsageError("--steps and --episodes must not be given together")
    if "steps" in given or "episodes" in given:
        values = {name: v for name, v in values.items() if name not in ("steps", "episodes")}
    for name in given:
        origins.add_option(name)
    if given.get("agent", "sdnn-c") != "sdnn-c" and "preset" not in given:
        values.pop("preset", None)
    return RunConfig.from_values(
        {**values, "environment": environment, "settings": settings, **given}
    )


def _range(text: str) -> tuple[str, list[float]]:
    name, _, ends = text.rpartition("=")
    low, colon, high = ends.partition(":")
    try:
        if not colon:
            raise ValueError
        return name or "all", [float(low), float(high)]
    except ValueError:
        raise click.UsageError(
            f"--range must be [VARIABLE=]LOW:HIGH or seen, got {text!r}"
        ) from None


def _folder_of(config: RunConfig) -> Path:
    environment = re.sub(r"[^\w.-]+", "-", config.environment.id)
    return Path("runs") / f"{environment}-{config.agent}-{config.seed}"
