"""The figure of costs: time of a step against the number of inputs, drawn from stored rows."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from sdnn.experiments.cost import SERIES, CostRecord
from sdnn.experiments.figures import FAINT, INK, SERIES_COLORS, require_matplotlib, watermark

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_MARKERS = ("o", "s", "^", "v")


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
    for number, series in enumerate(SERIES):
        own = sorted((c for c in costs if c.key.series == series.id), key=lambda c: c.key.n_inputs)
        if not own:
            continue
        x = [cost.key.n_inputs for cost in own]
        lower, middle, upper = np.transpose(
            [np.percentile(cost.microseconds, (25, 50, 75)) for cost in own]
        )
        axes.errorbar(
            x, middle, (middle - lower, upper - middle), color=SERIES_COLORS[number],
            marker=_MARKERS[number], markersize=5, capsize=3, linewidth=1.2,
            label=f"{series.title}\n{series.growth}",
        )  # fmt: skip
        if series.id == "sdnn-c" and 4 in x:
            fine = np.linspace(x[0], x[-1], 100)
            scale = middle[x.index(4)] / (4 * 3)
            axes.plot(
                fine, scale * fine * (fine - 1), ":", color=SERIES_COLORS[number], linewidth=1.2,
                label="proportional to $d(d-1)$",
            )  # fmt: skip
    axes.set_yscale("log")
    axes.set_xticks(sorted({cost.key.n_inputs for cost in costs}))
    axes.set_xlabel("number of inputs d")
    axes.set_ylabel("time of a step [µs]")
    axes.grid(axis="y", color="#e4e4e4", linewidth=0.7)
    axes.set_axisbelow(True)
    axes.tick_params(colors=INK, labelsize=8.5)
    axes.spines[["top", "right"]].set_visible(False)
    axes.legend(
        frameon=False, fontsize=9, loc="upper left", bbox_to_anchor=(1.01, 1.02), labelspacing=1.0
    )  # fmt: skip
    axes.set_title("Cost of a step against the number of inputs", loc="left", color=INK)
    if quick:
        watermark(axes)
    machines = ", ".join(sorted({cost.machine for cost in costs}))
    figure.text(
        0.012, 0.02,
        "Medians, bars: quartiles of rounds. A step: acting in a new random state and learning the"
        f" transition to it.\nsdnn {costs[0].version}; {machines}; one thread.",
        fontsize=6.5, va="bottom", color=FAINT, linespacing=1.4,
    )  # fmt: skip
    return figure
