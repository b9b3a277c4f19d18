"""The figure of a study: every trial a dot, every variant a line of them, side by side by case."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from sdnn.reproduction.figures import FAINT, INK, agent_colors, as_written, require_matplotlib
from sdnn.reproduction.sweep.comparison import Comparison, Measured
from sdnn.reproduction.sweep.report import end_solved
from sdnn.reproduction.sweep.study import StudyCase
from sdnn.runs.measures import CENSORED_MEASURES, MeasureName
from sdnn.runs.statistics import estimate_mean

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

CASES_PER_ROW = 5
"""More cases go on below."""

_LINE_HEIGHT = 0.27
_PANEL_WIDTH = 2.9
_TITLES: dict[MeasureName, str] = {
    "final_share_solved": "share solved at the end",
    "episode_of_collapse": "episode of collapse",
    "final_return": "mean return at the end",
    "mean_return": "mean return of all tests",
}
_OF_STEPS: tuple[MeasureName, ...] = ("final_share_solved", "episode_of_collapse")
_OF_RETURNS: tuple[MeasureName, ...] = ("final_return", "mean_return")
_SPREAD = 0.3
"""Half the height over which the dots of a variant are spread."""


def draw_study(comparison: Comparison, footer: str) -> Figure:
    """Draw a study: for each case two panels, one below the other, with a line for each variant.

    Faint dots are trials, since outcomes often lie in two heaps; a large dot is their median, of
    shares their mean, and a bar its interval. It is filled for the reference and where a variant
    differs from it.

    Parameters
    ----------
    comparison
        The results, at least one.
    footer
        Where the rows come from.

    Raises
    ------
    PlotUnavailableError
        If matplotlib is not installed.
    """
    require_matplotlib()
    from matplotlib.figure import Figure

    cases = comparison.cases
    blocks = [cases[i : i + CASES_PER_ROW] for i in range(0, len(cases), CASES_PER_ROW)]
    n_columns = max(len(block) for block in blocks)
    n_rows = 2 * len(blocks)
    panel_height = 0.35 + _LINE_HEIGHT * len(comparison.variants)
    labels = 0.3 + 0.072 * max(len(variant.title) for variant in comparison.variants)
    width = max(6.4, labels + n_columns * _PANEL_WIDTH + 0.3)
    top, bottom, gap = 0.95, 0.95, 0.75
    height = top + bottom + n_rows * panel_height + (n_rows - 1) * gap
    figure = Figure(figsize=(width, height))
    figure.subplots_adjust(
        left=labels / width, right=1 - 0.3 / width, top=1 - top / height, bottom=bottom / height,
        hspace=gap / panel_height, wspace=0.14,
    )  # fmt: skip
    grid = figure.subplots(n_rows, n_columns, squeeze=False)
    for number, block in enumerate(blocks):
        for column in range(n_columns):
            pair = grid[2 * number : 2 * number + 2, column]
            if column >= len(block):
                for axes in pair:
                    axes.set_visible(False)
                continue
            _draw_case(pair, comparison, block[column], with_names=column == 0)
    study = comparison.study
    figure.text(0.012, 1 - 0.12 / height, study.title, fontsize=12, va="top", color=INK)
    figure.text(
        0.012, 1 - 0.36 / height,
        f"{study.n_trials} trials per case and variant; compared with {study.reference} (dotted)",
        fontsize=8.5, va="top", color=FAINT,
    )  # fmt: skip
    figure.text(
        0.012, 0.07 / height,
        "Faint dots: trials. Large dot: their median (of the share solved: mean) with its 95 %"
        " interval; filled: the reference, and what\ndiffers from it trial by trial (the interval"
        " of the mean paired difference leaves 0 out)."
        " Numbers at the right: trials that end solved.\n" + _of_lengths(comparison) + footer,
        fontsize=6.5, va="bottom", color=FAINT, linespacing=1.4,
    )  # fmt: skip
    return as_written(figure)


def _of_lengths(comparison: Comparison) -> str:
    """Say what triangles are, where trials differ in length and so where they are cut off."""
    ends = {one.summary.result.last_episode for one in comparison.measured.values()}
    return "Triangles: beyond the last episode. " if len(ends) > 1 else ""


def _draw_case(
    pair: NDArray[np.object_], comparison: Comparison, case: StudyCase, *, with_names: bool
) -> None:
    measured = comparison.of_case(case.id)
    names = _OF_STEPS if "final_steps" in measured[0].measures else _OF_RETURNS
    ids = [variant.id for variant in comparison.variants]
    agents = (one.combination.config.agent for one in comparison.measured.values())
    colors = agent_colors(list(dict.fromkeys(agents)))
    for axes, name in zip(pair, names, strict=True):
        # Where all trials are of one length, what is censored lies at the end of the axis.
        ends = {one.summary.result.last_episode for one in measured}
        marks_censored = name in CENSORED_MEASURES and len(ends) > 1
        for one in measured:
            variant = one.combination.variant.id
            color = colors[one.combination.config.agent]
            _draw_variant(
                axes, one, name, ids.index(variant), color, variant == comparison.study.reference,
                marks_censored,
            )  # fmt: skip
        _style(axes, measured, name, len(ids))
        titles = [variant.title for variant in comparison.variants] if with_names else []
        axes.set_yticks(range(len(ids)), titles or [""] * len(ids))
        for label, variant in zip(axes.get_yticklabels(), ids, strict=True):
            if variant == comparison.study.reference:
                label.set_fontweight("bold")
    pair[0].set_title(case.title, fontsize=9, loc="left", color=INK)


def _draw_variant(
    axes: Axes, measured: Measured, name: MeasureName, line: int, color: str, is_reference: bool,
    marks_censored: bool,
) -> None:  # fmt: skip
    summary = measured.summary
    if name not in summary.values:
        return
    scale = 100 if name == "final_share_solved" else 1
    last = summary.result.last_episode
    values = scale * summary.uncensored(name)
    # By rank, so that equal values lie side by side and the picture is the same each time.
    order = np.argsort(np.argsort(values, kind="stable"))
    offsets = np.linspace(-_SPREAD, _SPREAD, values.size)[order] if values.size > 1 else np.zeros(1)
    is_beyond = marks_censored & np.isinf(summary.values[name])
    for mark, shown in (("o", ~is_beyond), (">", is_beyond)):
        if not shown.any():
            continue
        axes.scatter(
            values[shown], (line + offsets)[shown], s=9, color=color, alpha=0.28, linewidths=0,
            zorder=2, marker=mark,
        )  # fmt: skip
    estimate = summary.medians[name]
    if name == "final_share_solved":
        # Most trials end near 0 or 1: their median would jump from one to the other.
        estimate = estimate_mean(summary.values[name])
    value, lower, upper = (
        scale * (last if np.isinf(x) else x)
        for x in (estimate.value, estimate.lower, estimate.upper)
    )
    axes.plot([lower, upper], [line, line], color=color, linewidth=1.6, zorder=3)
    is_filled = is_reference or measured.differs(name)
    is_mark_beyond = marks_censored and np.isinf(estimate.value)
    axes.plot(
        value, line, ">" if is_mark_beyond else "o", markersize=5.5, color=color, zorder=4,
        clip_on=False, markerfacecolor=color if is_filled else "white", markeredgewidth=1.3,
    )  # fmt: skip
    if is_reference:
        axes.axvline(value, color=color, linewidth=0.9, linestyle=":", zorder=1)
    if name == "final_share_solved":
        axes.text(
            1.01, line, end_solved(measured).replace(" of ", "/"), fontsize=6.5, color=FAINT,
            va="center", transform=axes.get_yaxis_transform(),
        )  # fmt: skip


def _style(axes: Axes, measured: tuple[Measured, ...], name: MeasureName, n_lines: int) -> None:
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    last = max(one.summary.result.last_episode for one in measured)
    axes.set_ylim(n_lines - 0.4, -0.6)
    axes.set_xlabel(_TITLES[name], fontsize=8, color=INK)
    axes.xaxis.set_major_locator(MaxNLocator(nbins=4, steps=[1, 2, 2.5, 5, 10]))
    if name == "final_share_solved":
        axes.set_xlim(-3, 103)
        axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g} %"))
    elif name == "episode_of_collapse":
        axes.set_xlim(-0.03 * last, 1.03 * last)
        axes.xaxis.set_major_formatter(
            FuncFormatter(lambda value, _: f">{value:,.0f}" if value >= last else f"{value:,.0f}")
        )
    axes.grid(axis="x", color="#e4e4e4", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.tick_params(colors=INK, labelsize=8)
    axes.tick_params(axis="y", length=0)
    axes.spines[["top", "right", "left"]].set_visible(False)
