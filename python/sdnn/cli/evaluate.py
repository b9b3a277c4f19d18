"""The command ``sdnn evaluate``: greedy episodes of a run's agent."""

from __future__ import annotations

from pathlib import Path

import click

from sdnn.cli.common import (
    WARMING_UP,
    json_option,
    json_text,
    run_argument,
    run_command,
    seed_option,
    words_of_run,
)


@click.command(short_help="Evaluate the agent of a run as it is now.")
@run_argument
@click.option(
    "--episodes",
    type=click.IntRange(1, 10**9),
    default=100,
    show_default=True,
    help="Greedy episodes.",
)
@click.option("--best", is_flag=True, help="The agent that --keep-best kept, not the present one.")
@seed_option
@json_option
def evaluate(folder: Path, episodes: int, best: bool, seed: int | None, as_json: bool) -> None:
    """Evaluate the agent of RUN as it is now: greedy episodes in which nothing is learned."""
    import numpy as np

    from sdnn.runs import Run

    with run_command(words_of_run(folder)):
        evaluation = Run.open(folder).evaluate(episodes, seed, best=best)
    returns = evaluation.returns
    low, median, high = np.percentile(returns, (25, 50, 75)).tolist()
    values = {
        "folder": str(folder),
        "n_episodes": episodes,
        "mean_return": evaluation.mean_return,
        "standard_deviation": float(returns.std(ddof=1)) if episodes > 1 else None,
        "median_return": median,
        "quartiles": [low, high],
        "range": [float(returns.min()), float(returns.max())],
        "mean_length": float(evaluation.lengths.mean()),
        "share_terminated": float(evaluation.terminated.mean()),
        "is_warming_up": evaluation.is_warming_up,
    }
    if as_json:
        click.echo(json_text({**values, "returns": returns.tolist()}))
        return
    click.echo(
        f"{folder}: mean return {evaluation.mean_return:.6g} over {episodes} greedy episodes"
    )
    click.echo(
        f"median {median:.6g}, quartiles {low:.6g} to {high:.6g}, all {returns.min():.6g} to"
        f" {returns.max():.6g}"
    )
    click.echo(
        f"{values['mean_length']:.6g} steps on average,"
        f" {values['share_terminated']:.0%} of the episodes terminated"
    )
    if evaluation.is_warming_up:
        click.echo(WARMING_UP)
