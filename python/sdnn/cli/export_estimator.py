"""The command ``sdnn export`` for files of regressors and classifiers."""

from __future__ import annotations

import dataclasses
from contextlib import suppress
from pathlib import Path
from typing import TYPE_CHECKING

import click

from sdnn.cli.common import json_text

if TYPE_CHECKING:
    from sdnn.estimators.fitted import Fitted

_CLASSES = ("SDNNRegressor", "SDNNClassifier")


def estimator_in(source: Path) -> Fitted | None:
    """Read the estimator of a file; None if it holds something else, or is damaged."""
    from sdnn.support.files import read_file

    name = None
    with suppress(ValueError):
        name = read_file(source, "agent", "training", "estimator")[0].get("class")
    if name not in _CLASSES:
        return None
    from sdnn import estimators  # scikit-learn is slow to import

    model: Fitted = getattr(estimators, name).load(source, memory_limit=2**32)
    return model


def export_estimator(
    model: Fitted,
    path: Path,
    *,
    name: str | None,
    learning: bool,
    flash: int | None,
    as_json: bool,
) -> None:
    """Write the C header of an estimator and report its size."""
    from sdnn.export import export_estimator_header
    from sdnn.support.arguments import blamed

    options = {"name": "--name", "flash_bytes": "--flash"}
    try:
        header = export_estimator_header(
            model,
            path,
            name=name,
            learning=learning,
            flash_bytes=flash,
        )
    except ValueError as error:
        argument, problem = blamed(error)
        if argument not in options:
            raise click.ClickException(str(error)) from error
        option = options[argument]
        if argument == "name" and name is None:
            option = "--c-header gives no name; use --name, which"
        raise click.UsageError(f"{option} {problem}") from error
    if as_json:
        values = {k: v for k, v in dataclasses.asdict(header).items() if k != "text"}
        click.echo(json_text({"file": str(path), **values}))
        return
    click.echo(
        f"wrote {path}: {header.flash_bytes:,} bytes of constants, {header.ram_bytes:,} bytes of"
        f" {'memory' if learning else 'arrays on the stack'}"
    )
