"""Figures of stored trials: their learning curves, and the variants of a study."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from sdnn.agents.registry import labels, title_of
from sdnn.reports import plots
from sdnn.reports.statistics import estimate_mean, running_median
from sdnn.runs.results import CaseResult, MeasureName
from sdnn.runs.study import Comparison, Measured

SMOOTHED_TESTS = 25
"""Test episodes in the running median that is drawn over the thin median curve of long runs."""

CASES_PER_ROW = 5  # further cases of a study are drawn in the next row
_LINE_HEIGHT, _PANEL_WIDTH = 0.27, 2.9
_SPREAD = 0.3  # half the height over which the dots of a variant are spread

_TITLES: dict[MeasureName, str] = {
    "final_share_solved": "share solved at the end",
    "episode_of_collapse": "episode of collapse",
    "final_return": "mean return at the end",
    "mean_return": "mean return of all tests",
}
_OF_STEPS: tuple[MeasureName, ...] = ("final_share_solved", "episode_of_collapse")
_OF_RETURNS: tuple[MeasureName, ...] = ("final_return", "mean_return")
"""The two measures that are drawn of a case, by whether it has those of steps."""


def agent_colors(agents: Iterable[str]) -> dict[str, str]:
    """Return a color for each agent by its position in the registry, the same in all figures."""
    return {agent: plots.color_of(labels().index(agent)) for agent in agents}


def draw_steps(
    axes: plots.Axes, results: Sequence[CaseResult], colors: dict[str, str], *, smooth: bool
) -> None:
    """Draw steps of test episodes: a median and an interquartile band per agent, the first on top.

    With `smooth` running medians lie over the curves.
    """
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    for depth, result in enumerate(reversed(results)):
        lower, middle, upper = result.quartiles
        color, title = colors[result.agent], title_of(result.agent)
        thin = {"linewidth": 0.4, "alpha": 0.45} if smooth else {"linewidth": 0.9, "label": title}
        axes.plot(result.episode, middle, color=color, zorder=2 + depth, **thin)
        if smooth:
            lower, middle, upper = (running_median(q, SMOOTHED_TESTS) for q in result.quartiles)
            axes.plot(
                result.episode, middle, color=color, linewidth=1.6, zorder=4 + depth, label=title
            )
        axes.fill_between(result.episode, lower, upper, color=color, alpha=0.2, linewidth=0)
    axes.set_xlim(0, max(result.last_episode for result in results))
    axes.xaxis.set_major_locator(MaxNLocator(nbins=4, steps=[1, 2, 5, 10]))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    plots.style(axes)


def draw_study(comparison: Comparison, footer: str, *, narrow: bool = False) -> plots.Figure:
    """Draw a study: for each case two panels, one below the other, with a line for each variant.

    Faint dots are trials, since outcomes often lie in two heaps; a large dot is their median, of
    shares their mean, and a bar its interval. It is filled for the reference and where a variant
    differs from it. Censored values are at the last episode. The footer names the source of the
    rows. With `narrow` all panels are in one column, for telephones.
    """
    cases = comparison.cases
    n_columns = 1 if narrow else min(len(cases), CASES_PER_ROW)
    n_rows = 2 * math.ceil(len(cases) / n_columns)
    # Inches at the left for the longest title, by an estimate of the width of a letter.
    title_width = 0.3 + 0.072 * max(len(variant.title) for variant in comparison.variants)
    width = plots.NARROW_WIDTH if narrow else max(6.4, title_width + n_columns * _PANEL_WIDTH)
    panel_height = 1.0 + _LINE_HEIGHT * len(comparison.variants)
    figure = plots.new_figure(width, 1.2 + n_rows * panel_height)
    grid = figure.subplots(n_rows, n_columns, squeeze=False)
    for axes in grid.ravel():
        axes.set_visible(False)
    for number, case in enumerate(cases):
        row, column = divmod(number, n_columns)
        pair = grid[2 * row : 2 * row + 2, column]
        _draw_case(pair, comparison, case.id, with_names=column == 0)
        pair[0].set_title(case.title, fontsize=9, loc="left", color=plots.INK)
    study = comparison.study
    below = (
        f"{study.n_trials} trials per case and variant; compared with {study.reference} (dotted)"
    )
    text = (
        "Faint dots: trials. Large dot: their median (of the share solved: mean) with its 95 %"
        " interval; filled: the reference, and what\ndiffers from it trial by trial (the interval"
        " of the mean paired difference leaves 0 out)."
        f" Numbers at the right: trials that end solved.\n{footer}"
    )
    plots.label(
        figure,
        study.title,
        below,
        plots.wrapped(text.replace("what\n", "what ")) if narrow else text,
    )
    return figure


def _draw_case(
    pair: NDArray[np.object_], comparison: Comparison, case_id: str, *, with_names: bool
) -> None:
    """Draw the two panels of a case: a row for each variant, whose names may be at the left."""
    measured = comparison.of_case(case_id)
    lines = {variant.id: line for line, variant in enumerate(comparison.variants)}
    reference = comparison.study.reference
    colors = agent_colors(m.result.agent for m in comparison.measured.values())
    names = _OF_STEPS if "final_steps" in measured[0].result.values else _OF_RETURNS
    for axes, name in zip(pair, names, strict=True):
        axes.set_visible(True)
        for m in measured:
            if name in m.result.values:
                _draw_variant(
                    axes, m, name, lines[m.variant.id], colors[m.result.agent],
                    m.variant.id == reference,
                )  # fmt: skip
        _label_case(axes, name, max(m.result.last_episode for m in measured))
        axes.set_ylim(len(lines) - 0.4, -0.6)  # downwards: the first variant is at the top
        labels = [v.title if with_names else "" for v in comparison.variants]
        axes.set_yticks(range(len(lines)), labels)
        if reference in lines:
            axes.get_yticklabels()[lines[reference]].set_fontweight("bold")


def _draw_variant(
    axes: plots.Axes, measured: Measured, name: MeasureName, line: int, color: str,
    is_reference: bool,
) -> None:  # fmt: skip
    """Draw a measure of a variant on its line: a dot per trial, their median, and its interval.

    ``line`` is the height of the line, from 0 at the top.
    """
    result = measured.result
    scale = 100 if name == "final_share_solved" else 1
    values = scale * result.uncensored(name)
    # Dots are spread by rank: equal values lie side by side, and every drawing is the same.
    ranks = np.argsort(np.argsort(values, kind="stable"))
    offsets = np.linspace(-_SPREAD, _SPREAD, values.size)[ranks] if values.size > 1 else np.zeros(1)
    axes.scatter(values, line + offsets, s=9, color=color, alpha=0.28, linewidths=0, zorder=2)
    estimate = result.medians[name]
    if name == "final_share_solved":
        # Shares of most trials are near 0 or 1, between which a median would jump: take the mean.
        estimate = estimate_mean(result.values[name])
    value, lower, upper = (
        scale * (result.last_episode if np.isinf(number) else number)
        for number in (estimate.value, estimate.lower, estimate.upper)
    )
    axes.plot([lower, upper], [line, line], color=color, linewidth=1.6, zorder=3)
    is_filled = is_reference or measured.differs(name)
    axes.plot(
        value, line, "o", markersize=5.5, color=color, zorder=4, clip_on=False,
        markeredgewidth=1.3, markerfacecolor=color if is_filled else "white",
    )  # fmt: skip
    if is_reference:
        axes.axvline(value, color=color, linewidth=0.9, linestyle=":", zorder=1)
    if name == "final_share_solved":
        axes.text(
            1.01, line, measured.end_solved.replace(" of ", "/"), fontsize=6.5, color=plots.FAINT,
            va="center", transform=axes.get_yaxis_transform(),
        )  # fmt: skip


def _label_case(axes: plots.Axes, name: MeasureName, last: int) -> None:
    """Set limits, ticks and labels of a panel by its measure; `last` is the last episode."""
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    axes.set_xlabel(_TITLES[name], fontsize=8, color=plots.INK)
    axes.xaxis.set_major_locator(MaxNLocator(nbins=4, steps=[1, 2, 2.5, 5, 10]))
    if name == "final_share_solved":
        axes.set_xlim(-3, 103)  # percent, with a margin for dots at the limits
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g} %"))
    elif name == "episode_of_collapse":
        axes.set_xlim(-0.03 * last, 1.03 * last)
        axes.xaxis.set_major_formatter(
            FuncFormatter(lambda value, _: f">{value:,.0f}" if value >= last else f"{value:,.0f}")
        )
    plots.style(axes, grid="x")
    axes.tick_params(labelsize=8)
    axes.tick_params(axis="y", length=0)
    axes.spines["left"].set_visible(False)
