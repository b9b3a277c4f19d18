"""The paper's figures, and that of costs, drawn from stored rows only."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from sdnn.reports import plots
from sdnn.reproduction.cases import EXPERIMENTS, PAPER_EPISODES, PAPER_TRIALS, Experiment
from sdnn.reproduction.cost import SERIES, CostRecord
from sdnn.runs.figures import SMOOTHED_TESTS, agent_colors, draw_steps
from sdnn.runs.results import CaseResult

MAX_STEPS = 50  # an episode's limit: the upper end of the steps axis
LONG_EPISODES = 2_000  # from this number of learning episodes on, running medians are drawn
_TITLE_HEIGHT, _PANEL_HEIGHT = 1.1, 3.3  # inches; title and footer together
_WARNING_COLOR = "#a31515"
_MARKERS = ("o", "s", "^", "v")


def draw_experiment(
    experiment: Experiment,
    results: Sequence[CaseResult],
    *,
    quick: bool = False,
    narrow: bool = False,
) -> plots.Figure:
    """Draw an experiment: a panel per case, a line and an interquartile band per agent.

    With `quick` the figure is marked as preliminary. With `narrow` all panels are in one column,
    for telephones.
    """
    n_columns = 1 if narrow else min(2, len(experiment.cases))
    n_rows = -(-len(experiment.cases) // n_columns)
    is_long = max(result.last_episode for result in results) >= LONG_EPISODES
    has_legend = len({result.agent for result in results}) > 1 or experiment not in EXPERIMENTS
    height = _TITLE_HEIGHT + n_rows * _PANEL_HEIGHT
    figure = plots.new_figure(plots.NARROW_WIDTH * n_columns, height)
    panels = figure.subplots(n_rows, n_columns, sharey=True, squeeze=False).ravel()
    colors = agent_colors(result.agent for result in results)
    for number, (case, axes) in enumerate(zip(experiment.cases, panels, strict=False)):
        of_case = [result for result in results if result.case_id == case.id]
        axes.set_title(case.title, fontsize=10.5, loc="left", color=plots.INK)
        axes.set_title(f"paper: {case.paper_figure}", fontsize=8, loc="right", color=plots.FAINT)
        draw_steps(axes, of_case, colors, smooth=is_long)
        axes.set_ylim(0, MAX_STEPS)
        if number % n_columns == 0:
            axes.set_ylabel("steps per test episode")
        if number >= len(experiment.cases) - n_columns:
            axes.set_xlabel("learning episodes")
        if quick:
            _watermark(axes)
    for axes in panels[len(experiment.cases) :]:
        axes.set_visible(False)
    if has_legend:
        lines, titles = panels[0].get_legend_handles_labels()
        # `draw_steps` draws the last agent first, so that the first is on top.
        legend: dict[str, Any] = {"handles": lines[::-1], "labels": titles[::-1]}
        legend |= {"frameon": False, "loc": "upper right", "ncols": len(colors)}
        if narrow:
            panels[0].legend(fontsize=9, **legend)
        else:  # beside the title, 0.08 inches below the top
            figure.legend(fontsize=9.5, bbox_to_anchor=(0.99, 1 - 0.08 / height), **legend)
    _label(figure, experiment.title, results, smooth=is_long, quick=quick, narrow=narrow)
    return figure


def draw_cost(
    costs: Sequence[CostRecord], *, quick: bool = False, narrow: bool = False
) -> plots.Figure:
    """Draw the time of a step against the number of inputs, a line per series, on a log scale.

    Exponential growth is a straight line there; quadratic growth bends. A dotted line extrapolates
    SDNN-C's time with 4 inputs in proportion to its number of columns. With `quick` the figure is
    marked as preliminary. With `narrow` the legend is above the panel, for telephones.
    """
    figure = plots.new_figure(plots.NARROW_WIDTH, 6.2) if narrow else plots.new_figure(9.4, 4.7)
    axes = figure.add_subplot()
    colors = [plots.color_of(number) for number in range(len(SERIES))]
    for number, series in enumerate(SERIES):
        series_costs = sorted((c for c in costs if c.series == series.id), key=lambda c: c.n_inputs)
        if not series_costs:
            continue
        x = [cost.n_inputs for cost in series_costs]
        lower, middle, upper = np.transpose(
            [np.percentile(cost.microseconds, (25, 50, 75)) for cost in series_costs]
        )
        axes.errorbar(
            x, middle, (middle - lower, upper - middle), color=colors[number],
            marker=_MARKERS[number % len(_MARKERS)], markersize=5, capsize=3, linewidth=1.2,
            label=f"{series.title}\n{series.growth}",
        )  # fmt: skip
        if series.id == "sdnn-c" and 4 in x:
            fine = np.linspace(x[0], x[-1], 100)
            scale = middle[x.index(4)] / (4 * 3)  # d inputs have d (d - 1) pairs
            axes.plot(
                fine, scale * fine * (fine - 1), ":", color=colors[number], linewidth=1.2,
                label="proportional to $d(d-1)$",
            )  # fmt: skip
    axes.set_yscale("log")
    axes.set_xticks(sorted({cost.n_inputs for cost in costs}))
    axes.set_xlabel("number of inputs d")
    axes.set_ylabel("time of a step [µs]")
    plots.style(axes)
    figure.legend(
        frameon=False, fontsize=9, labelspacing=1.0, ncols=2 if narrow else 1,
        loc="outside upper center" if narrow else "outside right upper",
    )  # fmt: skip
    axes.set_title("Cost of a step against the number of inputs", loc="left", color=plots.INK)
    if quick:
        _watermark(axes)
    machines = ", ".join(sorted({cost.machine for cost in costs}))
    footer = (
        "Medians, bars: quartiles of rounds. A step: acting in a new random state and learning the"
        f" transition to it.\nsdnn {costs[0].version}; {machines}; one thread."
    )
    if narrow:
        footer = plots.wrapped(footer)
    figure.supxlabel(footer, x=0.012, ha="left", fontsize=6.5, color=plots.FAINT, linespacing=1.4)
    return figure


def _watermark(axes: plots.Axes) -> None:
    """Mark a figure of a quick reproduction, so that it is not taken for the result."""
    axes.text(
        0.5, 0.6, "quick", transform=axes.transAxes, ha="center", va="center",
        fontsize=44, color=_WARNING_COLOR, alpha=0.13, weight="bold", zorder=0,
    )  # fmt: skip


def _label(
    figure: plots.Figure,
    title: str,
    results: Sequence[CaseResult],
    *,
    smooth: bool,
    quick: bool,
    narrow: bool,
) -> None:
    """Write title, warning and footer: the scale of the study and its configurations.

    Flags are those of the figure: whether there are running medians, few trials, a single column.
    """
    fewest, most = min(r.n_trials for r in results), max(r.n_trials for r in results)
    trials = f"{fewest}" if fewest == most else f"{fewest} to {most}"
    n_episodes = max(result.last_episode for result in results)
    scale = f"{trials} {'trial' if trials == '1' else 'trials'} x {n_episodes:,} episodes"
    below = ""
    if quick or fewest < PAPER_TRIALS or n_episodes < PAPER_EPISODES:
        warning = "QUICK LOOK, not the result" if quick else "smaller than the paper's experiment"
        below = f"{warning}: {scale} instead of {PAPER_TRIALS} x {PAPER_EPISODES:,}"
    hashes = [f"{r.case_id}/{r.agent} {r.config_hash[:8]}" for r in results]
    lines = [", ".join(hashes[i : i + 4]) for i in range(0, len(hashes), 4)]
    legend = "Line: median over trials; band: quartiles."
    if smooth:
        legend = "Thin line: median over trials; thick line and band: its running median and that"
        legend += f" of the quartiles over {SMOOTHED_TESTS} tests."
    versions = ", ".join(sorted({record.version for r in results for record in r.records}))
    footer = f"{legend} {scale} per case and agent.\nsdnn {versions}; configuration "
    footer += ",\n".join(lines)
    plots.label(figure, title, below, plots.wrapped(footer) if narrow else footer, _WARNING_COLOR)
