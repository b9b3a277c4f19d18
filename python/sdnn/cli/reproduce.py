"""The command ``sdnn reproduce``: the paper's experiments."""

from __future__ import annotations

from typing import Any

import click

from sdnn._core import presets
from sdnn.cli.common import SEED, Options, run_or_forecast, trial_options
from sdnn.reproduction.cases import MOST_EPISODES, WORDS


@click.command(short_help="Run the paper's experiments and write a report.")
@click.argument("experiment", type=click.Choice(WORDS), default="all")
@click.option(
    "--trials",
    "n_trials",
    type=click.IntRange(1, 100_000),
    help="Trials per case and agent.  [default: 10, as in the paper]",
)
@click.option(
    "--episodes",
    "n_episodes",
    type=click.IntRange(1, MOST_EPISODES),
    help="Learning episodes per trial.  [default: 15000, as in the paper]",
)
@trial_options
@click.option("--seed", type=SEED, default=0, show_default=True, help="Root of all seeds.")
@click.option(
    "--quick",
    is_flag=True,
    help="Run a fraction: 2 trials x 300 episodes; not the result.",
)
@click.option(
    "--agent",
    "agents",
    metavar="ID",
    multiple=True,
    help="Run this agent in every case instead of the case's own; may be repeated.",
)
@click.option(
    "--preset",
    "presets",
    type=click.Choice(tuple(presets())),
    multiple=True,
    help="Draw SDNN-C under these settings beside the paper's; may be repeated.",
)
@click.pass_context
def reproduce(context: click.Context, /, experiment: str, ways: Options, **options: Any) -> None:
    """Run the paper's experiments and write a report with its figures and claims.

    a: redundant inputs. b: noisy inputs, against fuzzy Q-learning. cost: time of a step against the
    number of inputs. all: everything, which is the default.

    Finished trials are stored in OUT/results.sqlite; the same command continues where it stopped.
    Files of other agents, trials, episodes or seeds than the paper's have these in their names.
    """
    from sdnn.reproduction.reproduce import PaperStudy

    try:
        study = PaperStudy(experiment, **options)
    except ValueError as error:
        raise click.UsageError(str(error)) from error
    run_or_forecast(context, study, **ways)
