"""The options of a run's specification, made from its fields."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any

import click

__all__ = ["SpecCommand", "given_values", "option_of"]

KEYS = (
    "agent.name", "agent.preset", "budget.steps", "budget.episodes", "budget.target_return", "seed",
    "protocol.n_envs", "protocol.evaluate_every", "protocol.evaluate_every_episodes",
    "protocol.evaluation_episodes", "environment.noise", "environment.redundant",
    "agent.angle_pairs", "output.checkpoint_every", "output.tensorboard",
)  # fmt: skip
"""Settings with an option of their own; ``--set KEY=VALUE`` sets any."""

_NAMES = {"agent.name": "--agent"}


class SpecCommand(click.Command):
    """A command with the options of `KEYS`, which are made when they are first needed."""

    _made: list[click.Parameter] | None = None

    @property
    def params(self) -> list[click.Parameter]:
        """All parameters; those of a specification come after the command's own arguments."""
        if self._made is None:
            self._made = [*self._own, *_options()]
        return self._made

    @params.setter
    def params(self, own: list[click.Parameter]) -> None:
        self._own = own
        self._made = None


def given_values(options: dict[str, Any]) -> dict[str, Any]:
    """Take the options of a specification out of those of a command: given values by their keys."""
    found = {key: options.pop(_variable(key)) for key in KEYS}
    return {key: value for key, value in found.items() if value is not None and value is not False}


def option_of(key: str) -> str:
    """Find the option that sets a key of a specification."""
    key = key.partition("[")[0]
    if key in KEYS:
        return _name(key)
    if key.startswith("environment.kwargs"):
        return " ".join(["--env-arg", *key.split(".")[2:]])
    if key.startswith("environment.ranges"):
        return "--range"
    if key in ("environment", "environment.id"):
        return "ENV_ID"
    if key in ("steps", "episodes"):
        return f"--{key}"
    return f"--set {key}"


def _name(key: str) -> str:
    return _NAMES.get(key) or "--" + key.rpartition(".")[2].replace("_", "-")


def _variable(key: str) -> str:
    return _name(key)[2:].replace("-", "_")


def _options() -> Iterator[click.Option]:
    from sdnn.runs.spec_schema import property_of, spec_schema

    schema = spec_schema()
    for key in KEYS:
        found = property_of(schema, key)
        kind = next((one for one in found.get("anyOf", ()) if one.get("type") != "null"), found)
        is_flag = kind.get("type") == "boolean"
        text = found.get("description", "").replace("`", "")
        default = found.get("default")
        if default is not None and not is_flag:
            text += (
                f"  [default: {default:g}]"
                if isinstance(default, float)
                else f"  [default: {default}]"
            )
        yield click.Option(
            [_name(key), _variable(key)],
            type=None if is_flag else _type(kind),
            is_flag=is_flag,
            default=None,
            help=text,
        )


def _type(kind: dict[str, Any]) -> Any:
    low, high = kind.get("minimum"), kind.get("maximum")
    high = None if high == 2**53 else high
    if "enum" in kind:
        return click.Choice([word for word in kind["enum"] if word is not None])
    if kind.get("type") == "integer":
        return click.IntRange(low, high)
    if kind.get("type") == "number":
        return click.FLOAT if low is None else click.FloatRange(low, high)
    return click.STRING
