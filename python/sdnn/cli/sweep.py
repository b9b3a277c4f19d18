"""The command ``sdnn sweep``: studies."""

from __future__ import annotations

from pathlib import Path

import click

from sdnn.cli.common import OLD_FILE, SEED, Options, run_or_forecast, trial_options


@click.command(short_help="Run a study: variants of any setting, trial by trial.")
@click.argument("file", type=OLD_FILE)
@click.option(
    "--trials",
    type=click.IntRange(1, 100_000),
    help="Trials per case and variant, instead of the file's.",
)
@click.option("--seed", type=SEED, help="Root of all seeds, instead of the file's.")
@trial_options
@click.option(
    "--only", metavar="VARIANT", multiple=True, help="Run this variant only; may be repeated."
)
@click.pass_context
def sweep(
    context: click.Context,
    /,
    file: Path,
    trials: int | None,
    seed: int | None,
    only: tuple[str, ...],
    ways: Options,
) -> None:
    """Run the study in FILE: variants of any setting, compared trial by trial.

    FILE is TOML; docs/how-to/studies.md describes it. Tables, a figure and a page are written to
    OUT under the name of the file.

    Finished trials are kept in OUT/results.sqlite, which `reproduce` may share; the same command
    continues where it stopped.
    """
    from sdnn.reproduction.claim_study import ClaimStudy
    from sdnn.runs.errors import ConfigError

    try:
        study = ClaimStudy(file, n_trials=trials, seed=seed, only=only)
    except (ConfigError, ValueError) as error:
        raise click.UsageError(str(error)) from error
    run_or_forecast(context, study, **ways)
