"""Learning curves: the numbers of runs' rows, and a figure of them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from sdnn.interrupts import stay_interrupts
from sdnn.runs.errors import RunError
from sdnn.runs.figures import draw_curves
from sdnn.runs.groups import Group, groups_of
from sdnn.runs.run import Run
from sdnn.whole_files import csv_bytes, write_whole

__all__ = ["SUFFIXES", "Curve", "curves_of", "write_curves"]

WINDOW = 20
"""Episodes in the running median of the returns, or all so far where they are fewer."""

SUFFIXES = (".png", ".svg", ".pdf")
"""Kinds of figures that the curves of runs may be written as."""

HEADER = ("task", "agent", "kind", "n_runs", "run", "step", "value", "low", "high")

Kind: TypeAlias = Literal["return", "running median", "evaluation"]
_Series: TypeAlias = tuple[NDArray[np.int64], NDArray[np.float64]]
_NOTHING = "no episode and no evaluation"


@dataclass(frozen=True, kw_only=True, eq=False)
class Curve:
    """Numbers against steps, arrays (n,).

    They are returns of episodes, the running median of these, or evaluations: of one run, whose
    folder is `run`, the mean, of several that differ in their seeds the median of their means.
    `low` and `high` are quartiles over the episodes of each evaluation of one run, or over runs.
    """

    task: str
    agent: str
    kind: Kind
    n_runs: int = 1
    run: str = ""
    steps: NDArray[np.int64]
    values: NDArray[np.float64]
    low: NDArray[np.float64] | None = None
    high: NDArray[np.float64] | None = None


def curves_of(runs: Sequence[Run]) -> tuple[list[Curve], list[str]]:
    """Make the curves of runs; those that differ in their seeds only become one.

    With them comes a line about each run of which something could not be drawn.

    Raises
    ------
    RunError
        If there is nothing to draw yet, or rows cannot be read.
    """
    curves: list[Curve] = []
    notes: list[str] = []
    for group in groups_of(runs):
        made, told = _curves_of_group(group)
        curves += made
        notes += told
    if not curves:
        raise RunError("; ".join(notes) + ": nothing to draw")
    return curves, notes


def write_curves(curves: Sequence[Curve], path: Path) -> tuple[Path, Path]:
    """Draw the curves of runs into a file, and write their numbers beside it as CSV; return both.

    A RunError says that the name has another ending than those of `SUFFIXES`.
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


def _curves_of_group(group: Group) -> tuple[list[Curve], list[str]]:
    """Make the curves of one run, or the one of several, and notes on what it leaves out."""
    rows = {run: run.rows() for run in group.runs}
    if len(rows) == 1:
        (run,) = rows
        made = _curves_of_run(group, run, rows[run])
        return made, [] if made else [f"{run.folder}: {_NOTHING} is whole yet"]
    kind: Kind = "evaluation"
    series = {run: _evaluations(own) for run, own in rows.items()}
    if not any(len(steps) for steps, _ in series.values()):
        kind = "running median"
        for run, own in rows.items():
            steps, returns = _episodes(own)
            series[run] = steps, _running_median(returns)
    what = "no evaluation" if kind == "evaluation" else _NOTHING
    notes = [f"{run.folder}: {what} is whole yet" for run in series if not len(series[run][0])]
    series = {run: one for run, one in series.items() if len(one[0])}
    if len(series) < 2:
        return [curve for run in series for curve in _curves_of_run(group, run, rows[run])], notes
    folders = ", ".join(str(run.folder) for run in series)
    steps = _steps_of_all([own for own, _ in series.values()], is_grid=kind == "evaluation")
    if not len(steps):
        return [], [*notes, f"{folders}: they have no step in common"]
    if kind == "evaluation" and any(own[-1] > steps[-1] for own, _ in series.values()):
        notes.append(f"{folders}: drawn to step {steps[-1]}, which all of them have reached")
    values = np.array([np.interp(steps, own, numbers) for own, numbers in series.values()])
    low, middle, high = np.percentile(values, (25, 50, 75), axis=0)
    names: dict[str, Any] = {"task": group.task, "agent": group.agent, "n_runs": len(series)}
    return [Curve(**names, kind=kind, steps=steps, values=middle, low=low, high=high)], notes


def _curves_of_run(group: Group, run: Run, rows: Sequence[Any]) -> list[Curve]:
    names: dict[str, Any] = {"task": group.task, "agent": group.agent, "run": str(run.folder)}
    curves = []
    steps, returns = _episodes(rows)
    if len(steps):
        medians = _running_median(returns)
        curves.append(Curve(**names, kind="return", steps=steps, values=returns))
        curves.append(Curve(**names, kind="running median", steps=steps, values=medians))
    steps, means = _evaluations(rows)
    if len(steps):
        evaluations = (row["returns"] for row in rows if row["kind"] == "evaluation")
        low, high = np.array([np.percentile(one, (25, 75)) for one in evaluations]).T
        bounds = {"low": low, "high": high}
        curves.append(Curve(**names, kind="evaluation", steps=steps, values=means, **bounds))
    return curves


def _steps_of_all(all_steps: Sequence[NDArray[np.int64]], is_grid: bool) -> NDArray[np.int64]:
    """Find steps at which all have numbers: shared ones, or a hundred within what all reached."""
    if is_grid:
        shared = set.intersection(*(set(steps.tolist()) for steps in all_steps))
        return np.array(sorted(shared), np.int64)
    first = max(int(steps[0]) for steps in all_steps)
    last = min(int(steps[-1]) for steps in all_steps)
    steps = np.linspace(first, last, 100 if first <= last else 0)
    return np.unique(steps.astype(np.int64))


def _episodes(rows: Sequence[Any]) -> _Series:
    own = [(row["step"], row["return"]) for row in rows if row["kind"] == "episode"]
    return _series(own)


def _evaluations(rows: Sequence[Any]) -> _Series:
    own = [(row["step"], row["mean_return"]) for row in rows if row["kind"] == "evaluation"]
    return _series(own)


def _series(pairs: Sequence[tuple[int, float]]) -> _Series:
    steps, values = np.array([p[0] for p in pairs], np.int64), np.array([p[1] for p in pairs])
    return steps, values.astype(np.float64)


def _running_median(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Median of each number and those before it, `WINDOW` in all."""
    return np.array([np.median(values[max(0, i + 1 - WINDOW) : i + 1]) for i in range(len(values))])


def _csv_rows(curves: Sequence[Curve]) -> Iterable[tuple[object, ...]]:
    """Numbers of curves under `HEADER`."""
    for curve in curves:
        names = (curve.task, curve.agent, curve.kind, curve.n_runs, curve.run)
        for place, (step, value) in enumerate(zip(curve.steps, curve.values, strict=True)):
            low = "" if curve.low is None else repr(float(curve.low[place]))
            high = "" if curve.high is None else repr(float(curve.high[place]))
            yield (*names, int(step), repr(float(value)), low, high)
