"""The figure of the clean cases' curves."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from report import OURS, score
from studies import Curves
from tasks import CLEAN, TASKS, parts_of

from sdnn.reports.plots import COLORS, png_bytes
from sdnn.runs.report import require_matplotlib
from sdnn.runs.study import Study
from sdnn.support.files import write_whole

ACTOR_CRITIC = "actor-critic"


def draw(study: Study, results: Curves, path: Path) -> None:
    """Draw return against steps and against processor time, a column for each task."""
    require_matplotlib()
    from matplotlib.figure import Figure

    clean = {case for case, _ in results if parts_of(case)[1] == CLEAN}
    names = [name for name in TASKS if name in clean]
    if not names:
        return
    n_columns = min(len(names), 4)
    n_blocks = -(-len(names) // n_columns)
    figure = Figure(figsize=(3.4 * n_columns, 5.2 * n_blocks), layout="constrained")
    grid = figure.subplots(2 * n_blocks, n_columns, squeeze=False)
    for number, name in enumerate(names):
        block, column = divmod(number, n_columns)
        panels = grid[2 * block : 2 * block + 2, column]
        _draw_task(panels, study, results, name)
        if column == 0:
            for panel in panels:
                panel.set_ylabel("mean return, greedy")
    for panel in grid.ravel():
        if not panel.has_data():
            panel.set_axis_off()
    handles = {}
    for panel in grid.ravel():
        handles.update(zip(*reversed(panel.get_legend_handles_labels()), strict=True))
    figure.legend(handles.values(), handles.keys(), loc="outside lower center", ncols=5, fontsize=9)
    write_whole(path, png_bytes(figure, dpi=130))


def draw_overview(study: Study, results: Curves, path: Path) -> None:
    """Draw the median return of each agent at the end: a line for each task, a dot for each agent.

    Returns are on the scale of `Task.score`, on which 0 is that of random actions and 1 solves the
    task; lower ones than random actions' are drawn at 0.
    """
    require_matplotlib()
    from matplotlib.figure import Figure

    ours = {name: results.get((name, OURS)) or results.get((name, ACTOR_CRITIC)) for name in TASKS}
    order = sorted((n for n, trials in ours.items() if trials), key=lambda n: score(n, ours[n]))
    figure = Figure(figsize=(8.0, 0.6 + 0.33 * len(order)), layout="constrained")
    axes = figure.subplots()
    legend = {}
    for line, name in enumerate(order):
        for variant in study.variants:
            trials = results.get((name, variant.id))
            if not trials:
                continue
            label, look = _dot(variant.id)
            x = min(max(score(name, trials), 0.0), MOST_SHOWN)
            legend[label] = axes.plot(x, line, "o", clip_on=False, **look)[0]
    axes.axvline(1.0, color="0.4", lw=0.8, ls=":")
    axes.set_yticks(range(len(order)), order)
    axes.set_xticks([0, 0.5, 1], ["random actions", "half way", "solved"])
    axes.set_xlim(-0.02, MOST_SHOWN)
    axes.grid(axis="y", color="0.9", lw=0.7)
    axes.set_axisbelow(True)
    axes.spines[["top", "right", "left"]].set_visible(False)
    axes.tick_params(axis="y", length=0)
    figure.legend(legend.values(), legend.keys(), loc="outside upper right", ncols=3, frameon=False)
    write_whole(path, png_bytes(figure, dpi=150))


MOST_SHOWN = 1.3
"""The largest score that is drawn; better ones lie there."""


def _dot(variant: str) -> tuple[str, dict[str, Any]]:
    """Return the legend's text of an agent and the look of its dots."""
    if variant == OURS:
        return "SDNNQLambda", {"ms": 9, "color": COLORS[0], "zorder": 4}
    if variant == ACTOR_CRITIC:
        return "SDNNActorCritic", {"ms": 7, "color": COLORS[1], "zorder": 3}
    return "others", {"ms": 5, "color": "0.6", "mec": "white", "mew": 0.5, "zorder": 2}


def _draw_task(panels, study: Study, results: Curves, name: str) -> None:
    """Draw a task's curves into two panels."""
    from matplotlib import colormaps
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    shades = colormaps["tab20"].colors  # each colour dark and light
    for variant, color in zip(study.variants, [*shades[::2], *shades[1::2]], strict=False):
        trials = results.get((name, variant.id))
        if not trials:
            continue
        returns = np.array([trial["mean_return"] for trial in trials])
        lower, median, upper = np.percentile(returns, (25, 50, 75), axis=0)
        for panel, field in zip(panels, ("steps", "cpu_seconds"), strict=True):
            x = np.median([trial[field] for trial in trials], axis=0)
            (line,) = panel.plot(
                x, median, "-" if x.size > 1 else "o", color=color,
                label=variant.title, lw=1.6,
            )  # fmt: skip
            panel.fill_between(x, lower, upper, color=line.get_color(), alpha=0.2, lw=0)
    for panel in panels:
        panel.axhline(TASKS[name].solved, color="0.4", lw=0.8, ls=":")
        panel.set_xscale("log")
        panel.xaxis.set_major_locator(LogLocator(subs=(1.0, 3.0)))
        panel.xaxis.set_major_formatter(FuncFormatter(lambda x, _: f"{x:,g}"))
        panel.xaxis.set_minor_formatter(NullFormatter())
    panels[0].set_title(name, loc="left", fontsize=10.5)
    panels[0].set_xlabel("steps")
    panels[1].set_xlabel("processor seconds")
