"""Figures like the paper's, and that of costs, drawn from stored rows only.

matplotlib is an extra and is imported when it is needed. Figures are made without pyplot, so no
window, backend or style of the user's session is touched.
"""

from __future__ import annotations

from collections.abc import Sequence
from importlib.util import find_spec
from io import BytesIO
from typing import TYPE_CHECKING

import numpy as np

from sdnn.interrupts import stay_interrupts
from sdnn.palette import colors_of
from sdnn.reproduction.cases import EXPERIMENTS, PAPER_EPISODES, PAPER_TRIALS, Experiment
from sdnn.reproduction.results import CaseResult
from sdnn.runs.records import CostRecord
from sdnn.runs.registry import AGENTS, agent_entry, cost_series
from sdnn.runs.statistics import running_median
from sdnn.runs.trial_errors import PlotUnavailableError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

MAX_STEPS = 50
"""Upper end of the steps axis: an episode's limit."""

START_EPISODES = 500
"""Learning episodes shown in the panels of the start."""

SMOOTHED_TESTS = 25
"""Test episodes in the running median of a long run, which lies over the thin median curve."""

_PANEL_HEIGHT = 3.3
_START_HEIGHT = 1.9

WARNING_COLOR = "#a31515"
INK = "#2b2b2b"
FAINT = "#6f6f6f"
_MARKERS = ("o", "s", "^", "v")


def require_matplotlib() -> None:
    """Check that figures can be drawn.

    Raises
    ------
    PlotUnavailableError
        If matplotlib is not installed.
    """
    if find_spec("matplotlib") is None:
        raise PlotUnavailableError(
            'figures need matplotlib, which is not installed: pip install "sdnn[reproduce]"'
        )


def draw_experiment(
    experiment: Experiment, results: Sequence[CaseResult], *, quick: bool = False
) -> Figure:
    """Draw an experiment: a panel per case, a line and an interquartile band per agent.

    Parameters
    ----------
    experiment
        Its cases give the panels.
    results
        One for each case and agent.
    quick
        Whether to mark the figure as a quick look, which is no result.

    Raises
    ------
    PlotUnavailableError
        If matplotlib is not installed.
    """
    require_matplotlib()
    from matplotlib.figure import Figure

    n_columns = min(2, len(experiment.cases))
    n_rows = -(-len(experiment.cases) // n_columns)
    smooth = _is_long(results)
    with_start = experiment.start_panels and smooth
    heights = (_PANEL_HEIGHT, _START_HEIGHT) if with_start else (_PANEL_HEIGHT,)
    height = 1.1 + n_rows * sum(heights)
    figure = Figure(figsize=(5.4 * n_columns, height))
    figure.subplots_adjust(
        left=0.133 / n_columns, right=0.97, top=1 - 0.82 / height, bottom=0.86 / height,
        wspace=0.1, hspace=0.4,
    )  # fmt: skip
    grid = figure.subplots(
        n_rows * len(heights), n_columns, sharey=True, squeeze=False,
        gridspec_kw={"height_ratios": heights * n_rows},
    )  # fmt: skip
    panels = grid[:: len(heights)].ravel()
    starts = grid[1::2].ravel() if with_start else None
    agents = list(dict.fromkeys(result.agent for result in results))
    colors = agent_colors(agents)
    for number, (case, axes) in enumerate(zip(experiment.cases, panels, strict=False)):
        shown = [result for result in results if result.case == case]
        axes.set_title(case.title, fontsize=10.5, loc="left", color=INK)
        axes.set_title(f"paper: {case.paper_figure}", fontsize=8, loc="right", color=FAINT)
        _draw_case(axes, shown, colors, smooth)
        if number % n_columns == 0:
            axes.set_ylabel("steps per test episode")
        if with_start or number >= len(experiment.cases) - n_columns:
            axes.set_xlabel("learning episodes")
        if quick:
            _watermark(axes)
        if starts is not None:
            _draw_start(starts[number], shown, colors)
    for row in (panels, starts if starts is not None else ()):
        for axes in row[len(experiment.cases) :]:
            axes.set_visible(False)
    if len(agents) > 1 or experiment not in EXPERIMENTS:
        lines, titles = panels[0].get_legend_handles_labels()
        figure.legend(
            lines[::-1], titles[::-1], frameon=False, fontsize=9.5, loc="upper right",
            bbox_to_anchor=(0.975, 1 - 0.08 / height), ncols=len(agents),
        )  # fmt: skip
    _label(figure, experiment, results, quick)
    return as_written(figure)


def as_written(figure: Figure) -> Figure:
    """Leave dollar signs in a figure's words as they are: the user's titles hold no formulas."""
    from matplotlib.text import Text

    for text in figure.findobj(Text):
        text.set_parse_math(False)
    return figure


def draw_cost(costs: Sequence[CostRecord], *, quick: bool = False) -> Figure:
    """Draw the time of a step against the number of inputs, a line per series, on a log scale.

    Exponential growth is a straight line there; quadratic growth bends. A dotted line continues
    what SDNN-C needs with 4 inputs by its number of columns.

    Parameters
    ----------
    costs
        Measured costs, at least one.
    quick
        Whether to mark the figure as a quick look, which is no result.

    Raises
    ------
    PlotUnavailableError
        If matplotlib is not installed.
    """
    require_matplotlib()
    from matplotlib.figure import Figure

    figure = Figure(figsize=(9.4, 4.7))
    figure.subplots_adjust(left=0.085, right=0.7, top=0.9, bottom=0.2)
    axes = figure.add_subplot()
    colors = colors_of(range(len(cost_series())))
    for number, (_, series) in enumerate(cost_series()):
        own = sorted((c for c in costs if c.key.series == series.id), key=lambda c: c.key.n_inputs)
        if not own:
            continue
        x = [cost.key.n_inputs for cost in own]
        lower, middle, upper = np.transpose(
            [np.percentile(cost.microseconds, (25, 50, 75)) for cost in own]
        )
        axes.errorbar(
            x, middle, (middle - lower, upper - middle), color=colors[number],
            marker=_MARKERS[number % len(_MARKERS)], markersize=5, capsize=3, linewidth=1.2,
            label=f"{series.title}\n{series.growth}",
        )  # fmt: skip
        if series.id == "sdnn-c" and 4 in x:
            fine = np.linspace(x[0], x[-1], 100)
            scale = middle[x.index(4)] / (4 * 3)
            axes.plot(
                fine, scale * fine * (fine - 1), ":", color=colors[number], linewidth=1.2,
                label="proportional to $d(d-1)$",
            )  # fmt: skip
    axes.set_yscale("log")
    axes.set_xticks(sorted({cost.key.n_inputs for cost in costs}))
    axes.set_xlabel("number of inputs d")
    axes.set_ylabel("time of a step [µs]")
    _style(axes)
    axes.legend(
        frameon=False, fontsize=9, loc="upper left", bbox_to_anchor=(1.01, 1.02), labelspacing=1.0
    )  # fmt: skip
    axes.set_title("Cost of a step against the number of inputs", loc="left", color=INK)
    if quick:
        _watermark(axes)
    machines = ", ".join(sorted({cost.machine for cost in costs}))
    figure.text(
        0.012, 0.02,
        "Medians, bars: quartiles of rounds. A step: acting in a new random state and learning the"
        f" transition to it.\nsdnn {costs[0].version}; {machines}; one thread.",
        fontsize=6.5, va="bottom", color=FAINT, linespacing=1.4,
    )  # fmt: skip
    return figure


def figure_bytes(figure: Figure) -> tuple[bytes, bytes]:
    """Return a figure as PNG and as SVG; the same rows give the same bytes."""
    from matplotlib import rc_context

    png, svg = BytesIO(), BytesIO()
    with stay_interrupts(), rc_context({"svg.hashsalt": "sdnn"}):
        figure.savefig(png, format="png", dpi=200, metadata={"Software": None})
        figure.savefig(svg, format="svg", metadata={"Date": None})
    return png.getvalue(), svg.getvalue()


def _draw_curves(
    axes: Axes, shown: Sequence[CaseResult], colors: dict[str, str], smooth: bool
) -> None:
    """Draw the curves, the first agent on top; `smooth` puts running medians over them."""
    for depth, result in enumerate(reversed(shown)):
        curve, color = result.curve, colors[result.agent]
        lower, upper = curve.lower, curve.upper
        title = agent_entry(result.agent).title
        if smooth:
            lower, middle, upper = (
                running_median(values, SMOOTHED_TESTS) for values in (lower, curve.median, upper)
            )
            axes.plot(
                curve.episode, middle, color=color, linewidth=1.6, zorder=4 + depth, label=title
            )
        axes.plot(
            curve.episode, curve.median, color=color, zorder=2 + depth,
            linewidth=0.4 if smooth else 0.9, alpha=0.45 if smooth else 1.0,
            label=None if smooth else title,
        )  # fmt: skip
        axes.fill_between(curve.episode, lower, upper, color=color, alpha=0.2, linewidth=0)


def _draw_case(
    axes: Axes, shown: Sequence[CaseResult], colors: dict[str, str], smooth: bool
) -> None:
    from matplotlib.ticker import FuncFormatter, MaxNLocator

    _draw_curves(axes, shown, colors, smooth)
    axes.set_xlim(0, max(int(result.episode[-1]) for result in shown))
    axes.set_ylim(0, MAX_STEPS)
    axes.xaxis.set_major_locator(MaxNLocator(nbins=4, steps=[1, 2, 5, 10]))
    axes.xaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:,.0f}"))
    _style(axes)


def _draw_start(axes: Axes, shown: Sequence[CaseResult], colors: dict[str, str]) -> None:
    _draw_case(axes, shown, colors, smooth=False)
    axes.set_xlim(0, START_EPISODES)
    axes.set_title(
        f"the first {START_EPISODES} learning episodes", fontsize=8.5, loc="left", color=FAINT
    )


def _is_long(results: Sequence[CaseResult]) -> bool:
    """Whether the start is too small a part of the panels to be seen in them."""
    return max(int(result.episode[-1]) for result in results) >= 4 * START_EPISODES


def agent_colors(agents: Sequence[str]) -> dict[str, str]:
    """Give agents the colors of their places in the registry."""
    places = list(AGENTS)
    return dict(zip(agents, colors_of([places.index(agent) for agent in agents]), strict=True))


def _style(axes: Axes) -> None:
    axes.grid(axis="y", color="#e4e4e4", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.tick_params(colors=INK, labelsize=8.5)
    axes.spines[["top", "right"]].set_visible(False)


def _watermark(axes: Axes) -> None:
    """Write across a panel that it is a quick look."""
    axes.text(
        0.5, 0.6, "quick", transform=axes.transAxes, ha="center", va="center",
        fontsize=44, color=WARNING_COLOR, alpha=0.13, weight="bold", zorder=0,
    )  # fmt: skip


def _label(
    figure: Figure, experiment: Experiment, results: Sequence[CaseResult], quick: bool
) -> None:
    """Write title, what kind of run it is, and where the rows come from."""
    height = figure.get_figheight()
    counts = sorted({result.n_trials for result in results})
    trials = f"{counts[0]}" if len(counts) == 1 else f"{counts[0]} to {counts[-1]}"
    n_episodes = max(int(result.episode[-1]) for result in results)
    scale = f"{trials} {'trial' if trials == '1' else 'trials'} x {n_episodes:,} episodes"
    paper_scale = f"{PAPER_TRIALS} x {PAPER_EPISODES:,}"
    figure.text(0.012, 1 - 0.13 / height, experiment.title, fontsize=12, va="top", color=INK)
    if quick or counts[0] < PAPER_TRIALS or n_episodes < PAPER_EPISODES:
        what = "QUICK LOOK, not the result" if quick else "smaller than the paper's experiment"
        figure.text(
            0.012, 1 - 0.36 / height, f"{what}: {scale} instead of {paper_scale}",
            fontsize=9, va="top", color=WARNING_COLOR,
        )  # fmt: skip
    hashes = [f"{r.case.id}/{r.agent} {r.config_hash[:8]}" for r in results]
    lines = [", ".join(hashes[i : i + 4]) for i in range(0, len(hashes), 4)]
    lines_are = "Line: median over trials; band: quartiles."
    if _is_long(results):
        lines_are = (
            "Thin line: median over trials; thick line and band: its running median and that of the"
            f" quartiles over {SMOOTHED_TESTS} tests."
        )
    versions = ", ".join(sorted({rec.version for res in results for rec in res.records}))
    figure.text(
        0.012, 0.07 / height,
        f"{lines_are} {scale} per case and agent."
        f"\nsdnn {versions}; configuration " + ",\n".join(lines),
        fontsize=6.5, va="bottom", color=FAINT, linespacing=1.4,
    )  # fmt: skip
