"""Draw the learning curves of runs into files."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from io import BytesIO
from pathlib import Path
from typing import TYPE_CHECKING

from sdnn.reports.plots import color_of, new_figure
from sdnn.runs.curves import Curve
from sdnn.runs.errors import RunError
from sdnn.runs.report import require_matplotlib
from sdnn.support.csv_files import csv_bytes
from sdnn.support.files import write_whole
from sdnn.support.interrupts import stay_interrupts

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

SUFFIXES = (".png", ".svg", ".pdf")
"""Kinds of figures that the curves of runs may be written as."""

HEADER = ("task", "agent", "kind", "n_runs", "run", "step", "value", "low", "high")


def write_curves(curves: Sequence[Curve], path: Path) -> tuple[Path, Path]:
    """Draw the curves of runs into a file, and write their numbers beside it as CSV; return both.

    Raises RunError if the name has another ending than those of `SUFFIXES`.
    """
    if path.suffix not in SUFFIXES:
        raise RunError(f"out must end in one of {', '.join(SUFFIXES)}, got {path}")
    content = BytesIO()
    figure = draw_curves(curves)
    with stay_interrupts():
        figure.savefig(content, format=path.suffix[1:], dpi=150)
    path.parent.mkdir(parents=True, exist_ok=True)
    numbers = path.with_suffix(".csv")
    write_whole(path, content.getvalue())
    write_whole(numbers, csv_bytes(HEADER, _csv_rows(curves)))
    return path, numbers


def draw_curves(curves: Sequence[Curve]) -> Figure:
    """Draw the curves of runs: a panel per task, a color per agent.

    Raises a `PlotUnavailableError` if matplotlib is not installed.
    """
    require_matplotlib()
    tasks = list(dict.fromkeys(curve.task for curve in curves))
    agents = list(dict.fromkeys(curve.agent for curve in curves))
    colors = {agent: color_of(place) for place, agent in enumerate(agents)}
    figure = new_figure(7.5, 3.6 * len(tasks))
    panels = figure.subplots(len(tasks), squeeze=False)[:, 0]
    for task, axes in zip(tasks, panels, strict=True):
        for curve in (c for c in curves if c.task == task):
            _draw_curve(axes, curve, colors[curve.agent])
        axes.set_title(task, fontsize=10)
        axes.set(xlabel="steps", ylabel="return")
        axes.grid(alpha=0.25)
        axes.legend(fontsize=8, frameon=False)
    return figure


def _draw_curve(axes: Axes, curve: Curve, color: str) -> None:
    of = f" ({curve.n_runs} runs)" if curve.n_runs > 1 else ""
    label = f"{curve.agent}: {curve.kind}{of}"
    if curve.kind == "return":
        axes.plot(curve.steps, curve.values, ".", ms=2, color=color, alpha=0.25, label=label)
        return
    is_main = curve.kind == "evaluation"
    width, dashes, marker = (1.8, "-", "o") if is_main else (1.0, "--", "")
    axes.plot(
        curve.steps, curve.values, dashes, lw=width, marker=marker, ms=3, color=color, label=label
    )
    if curve.low is not None and curve.high is not None:
        axes.fill_between(curve.steps, curve.low, curve.high, color=color, alpha=0.2, lw=0)


def _csv_rows(curves: Sequence[Curve]) -> Iterable[tuple[object, ...]]:
    """Numbers of curves under `HEADER`."""
    for curve in curves:
        names = (curve.task, curve.agent, curve.kind, curve.n_runs, curve.run)
        columns = (curve.values, curve.low, curve.high)
        for place, step in enumerate(curve.steps):
            numbers = ("" if c is None else float(c[place]) for c in columns)
            yield (*names, int(step), *numbers)
