"""The command ``sdnn train``: an agent learns in an environment."""

from __future__ import annotations

import functools
import json
import re
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import click

from sdnn.cli import common
from sdnn.runs.errors import ConfigError


class SpecCommand(click.Command):
    """A command with the options of `KEYS`, made when used: other commands start faster."""

    def get_params(self, ctx: click.Context) -> list[click.Parameter]:
        """Return all parameters, with those of `KEYS` before the help option."""
        *parameters, help_option = super().get_params(ctx)
        return [*parameters, *_options(), help_option]


@functools.cache
def _options() -> list[click.Option]:
    """Return the options of all settings in `KEYS`, with types and help from their JSON Schema."""
    from sdnn.runs.settings import schemas_of
    from sdnn.runs.spec import RunSpec

    options, schemas = [], schemas_of(RunSpec)
    for key in common.KEYS:
        schema: dict[str, Any] = {"$ref": "RunSpec"}
        for name in key.split("."):
            alternatives = (schema, *schema.get("anyOf", ()))  # `anyOf`: a table that may be null
            table = next(part["$ref"] for part in alternatives if "$ref" in part).rpartition("/")[2]
            schema = schemas[table]["properties"][name]
        types = (part for part in schema.get("anyOf", ()) if part.get("type") != "null")
        value_schema = next(types, schema)
        is_flag, default = value_schema.get("type") == "boolean", schema.get("default")
        default_text = "" if default is None or is_flag else f"  [default: {default}]"
        option = click.Option(
            [common.option_of(key), key.replace(".", "_")],
            type=None if is_flag else _option_type(value_schema),
            is_flag=is_flag,
            default=None,
            help=schema["description"].replace("`", "") + default_text,
        )
        options.append(option)
    return options


def _option_type(schema: Mapping[str, Any]) -> click.ParamType[Any]:
    """Return Click's type for a setting's JSON Schema; 2^53 is the maximum of any whole number."""
    low, high = schema.get("minimum"), schema.get("maximum")
    if "enum" in schema:
        return click.Choice([word for word in schema["enum"] if word is not None])
    if schema.get("type") == "integer":
        return click.IntRange(low, None if high == 2**53 else high)
    if schema.get("type") == "number":
        return click.FLOAT if low is None else click.FloatRange(low, high)
    return click.STRING


@click.command(cls=SpecCommand, short_help="Learn in a Gymnasium environment.")
@click.argument("env_id", metavar="[ENV_ID]", required=False)
@click.option(
    "--out",
    type=click.Path(path_type=Path),
    help="The run's folder.  [default: runs/ENV-AGENT-SEED]",
)
@click.option(
    "--config",
    "file",
    metavar="FILE",
    type=common.OLD_FILE,
    help="A specification in TOML, or another run's config.json; options override it.",
)
@click.option(
    "--range",
    "ranges",
    metavar="[VARIABLE=]LOW:HIGH|adaptive|running",
    multiple=True,
    help="Range of an observed variable, from 0, or of all; repeatable. adaptive: from a warm-up;"
    " running: they follow what is observed.",
)
@click.option(
    "--set",
    "settings",
    metavar="TABLE.NAME=VALUE",
    multiple=True,
    help="Any setting, such as learning.discount=0.95; may be repeated.",
)
@click.option(
    "--env-arg",
    "kwargs",
    metavar="NAME=VALUE",
    multiple=True,
    help="An argument of the environment, or of gymnasium.make; may be repeated.",
)
@click.option("--schema", is_flag=True, help="Print the JSON Schema of a specification, and exit.")
@click.option("--dry-run", is_flag=True, help="Only check and print the specification.")
@common.json_option
def train(
    env_id: str | None,
    out: Path | None,
    file: Path | None,
    schema: bool,
    as_json: bool,
    dry_run: bool,
    **options: Any,
) -> None:
    """Learn in a Gymnasium environment: ENV_ID, such as CartPole-v1 or my_module:my/Env-v0.

    The run's folder holds its configuration, the rows of its episodes and evaluations, a checkpoint
    and, in the end, the agent. Ctrl-C stops after a checkpoint; `sdnn resume` continues, also after
    a crash, as if nothing had happened.
    """
    if schema:
        from sdnn.runs.config_file import spec_schema

        click.echo(json.dumps(spec_schema(), indent=2))
        return
    from sdnn.runs.config_file import ConfigFile
    from sdnn.runs.run import Run, resume_command
    from sdnn.runs.settings import overridden
    from sdnn.runs.spec import RunSpec

    settings = _options_by_key(env_id, options)
    with common.run_command(common.option_words):
        source = None if file is None else ConfigFile.read(file)

    def located_message(error: ConfigError) -> str:
        located = error if source is None else source.located(error, settings)
        return str(located) if located.place else common.option_words(error)

    with common.run_command(located_message):
        values = {} if source is None else source.specification()
        spec = RunSpec.from_values(overridden(values, settings))
        environment = re.sub(r"[^\w.-]+", "-", spec.task)
        folder = out or Path("runs", f"{environment}-{spec.agent.name}-{spec.seed}")
        if dry_run:
            Run(folder, spec).check()
            click.echo(json.dumps({"folder": str(folder), **spec.values()}, indent=2))
            return
    with common.run_command(located_message, folder=folder):
        if (folder / "config.json").exists():
            raise click.UsageError(
                f"--out: {folder} holds a run already: {resume_command(folder)} continues it"
            )
        common.train_run(Run.create(folder, spec), as_json)


def _options_by_key(env_id: str | None, options: common.Options) -> common.Options:
    """Return the values of options by keys of a specification, and remove those of KEYS.

    UsageError for a key that two different options set. If an option is given twice, the last
    value counts.
    """
    from sdnn.runs.spec import RunSpec

    tables = [name for name in RunSpec.__struct_fields__ if name != "seed"]
    by_key = {key: options.pop(key.replace(".", "_")) for key in common.KEYS}
    values = {k: value for k, value in by_key.items() if value is not None and value is not False}
    by_option = {key: (common.option_of(key), value) for key, value in values.items()}

    def set_once(option: str, key: str, value: object) -> None:
        """Set `key` to the value of an option; refuse a key that another option has set."""
        other, before = by_option.setdefault(key, (option, value))
        if other != option:
            raise click.UsageError(
                f"{option} must not set {key}, which {other} sets: got {value!r} and {before!r}"
            )
        values[key] = value

    if env_id is not None:
        set_once("ENV_ID", "environment.id", env_id)
    for name, text in common.named_values("--env-arg", options["kwargs"]):
        set_once(f"--env-arg {name}", f"environment.kwargs.{name}", common.value_of(text))
    for text in options["ranges"]:
        if text in ("adaptive", "running"):
            set_once("--range", "agent.observation_range", text)
        else:
            name, bounds = _named_range(text)
            set_once(f"--range {name}", f"environment.ranges.{name}", bounds)
    for name, text in common.named_values("--set", options["settings"]):
        table, dot, _ = name.partition(".")
        if not dot:
            raise common.error_of_set(name, "TABLE.NAME")
        if table not in tables:
            expected = f"TABLE.NAME with one of the tables {', '.join(tables)}"
            raise common.error_of_set(name, expected)
        set_once(f"--set {name}", name, common.value_of(text))
    return values


def _named_range(text: str) -> tuple[str, list[float]]:
    """Return variable, or "all", and bounds of [VARIABLE=]LOW:HIGH."""
    name, _, bounds = text.rpartition("=")
    low, _, high = bounds.partition(":")  # without a colon `high` is empty, which is no number
    try:
        return name or "all", [float(low), float(high)]
    except ValueError:
        raise click.UsageError(
            f"--range must be [VARIABLE=]LOW:HIGH, adaptive or running, got {text!r}"
        ) from None
