"""Learning curves: the numbers of runs' rows."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from sdnn.agents.callbacks import Row
from sdnn.runs.errors import RunError
from sdnn.runs.groups import Group, groups_of
from sdnn.runs.run import Run

__all__ = ["HEADER", "Curve", "csv_rows", "curves_of"]

WINDOW = 20
"""Episodes in the running median of the returns, or all so far where they are fewer."""

_NOTHING = "no episode and no evaluation"

HEADER = ("task", "agent", "kind", "n_runs", "run", "step", "value", "low", "high")

Kind = Literal["return", "running median", "evaluation"]


@dataclass(frozen=True, kw_only=True, eq=False)
class Curve:
    """Numbers against steps.

    Parameters
    ----------
    task, agent
        What was learned by what: of several runs, which differ in their seeds only.
    kind
        Of episodes their returns, or the running median of these; or the evaluations: of one run
        the mean, of several the median of their means.
    n_runs
        How many runs it is of.
    run
        The folder, if it is of one.
    steps, values
        Shape (n,).
    low, high
        Lower and upper quartiles, over the episodes of each evaluation of one run, or over runs;
        None: there are none. Shape (n,).
    """

    task: str
    agent: str
    kind: Kind
    n_runs: int
    run: str
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
        if len(group.runs) == 1:
            made = _curves_of_one(group, group.runs[0], group.runs[0].rows())
            told = [] if made else [f"{group.runs[0].folder}: {_NOTHING} is whole yet"]
        else:
            made, told = _curves_of_several(group)
        curves += made
        notes += told
    if not curves:
        raise RunError("; ".join(notes) + ": nothing to draw")
    return curves, notes


def _curves_of_one(group: Group, run: Run, rows: Sequence[Row]) -> list[Curve]:
    episodes, evaluations = _of_kind(rows, "episode"), _of_kind(rows, "evaluation")
    names: dict[str, Any] = {
        "task": group.task,
        "agent": group.agent,
        "n_runs": 1,
        "run": str(run.folder),
    }
    curves = []
    if episodes:
        steps, returns = _episodes(episodes)
        medians = _running_median(returns)
        curves += [
            Curve(**names, kind="return", steps=steps, values=returns),
            Curve(**names, kind="running median", steps=steps, values=medians),
        ]
    if evaluations:
        quartiles = [np.percentile(row["returns"], (25, 75)) for row in evaluations]
        low, high = np.array(quartiles).T
        steps, means = _evaluations(evaluations)
        curves.append(
            Curve(**names, kind="evaluation", steps=steps, values=means, low=low, high=high)
        )
    return curves


def _curves_of_several(group: Group) -> tuple[list[Curve], list[str]]:
    """Make the one curve of runs, and notes on what it leaves out."""
    rows = {run: run.rows() for run in group.runs}
    kind: Kind = "evaluation"
    series = {run: _evaluations(_of_kind(rows[run], "evaluation")) for run in group.runs}
    if not any(len(steps) for steps, _ in series.values()):
        kind = "running median"
        for run in group.runs:
            steps, returns = _episodes(_of_kind(rows[run], "episode"))
            series[run] = steps, _running_median(returns)
    what = "no evaluation" if kind == "evaluation" else _NOTHING
    notes = [f"{run.folder}: {what} is whole yet" for run in group.runs if not len(series[run][0])]
    series = {run: one for run, one in series.items() if len(one[0])}
    if len(series) < 2:
        return [curve for run in series for curve in _curves_of_one(group, run, rows[run])], notes
    folders = ", ".join(str(run.folder) for run in series)
    steps = _steps_of_all([own for own, _ in series.values()], is_grid=kind == "evaluation")
    if not len(steps):
        return [], [*notes, f"{folders}: they have no step in common"]
    if kind == "evaluation" and any(own[-1] > steps[-1] for own, _ in series.values()):
        notes.append(f"{folders}: drawn to step {steps[-1]}, which all of them have reached")
    values = np.array([np.interp(steps, own, numbers) for own, numbers in series.values()])
    low, middle, high = np.percentile(values, (25, 50, 75), axis=0)
    curve = Curve(
        task=group.task,
        agent=group.agent,
        kind=kind,
        n_runs=len(series),
        run="",
        steps=steps,
        values=middle,
        low=low,
        high=high,
    )
    return [curve], notes


def _steps_of_all(all_steps: Sequence[NDArray[np.int64]], is_grid: bool) -> NDArray[np.int64]:
    """Find steps at which all have numbers: shared ones, or a hundred within what all reached."""
    if is_grid:
        shared = set.intersection(*(set(steps.tolist()) for steps in all_steps))
        return np.array(sorted(shared), np.int64)
    first = max(int(steps[0]) for steps in all_steps)
    last = min(int(steps[-1]) for steps in all_steps)
    return (
        np.unique(np.linspace(first, last, 100).astype(np.int64))
        if first <= last
        else (np.array([], np.int64))
    )


def _of_kind(rows: Sequence[Row], kind: str) -> list[Row]:
    return [row for row in rows if row["kind"] == kind]


def _episodes(rows: Sequence[Any]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    steps = np.array([row["step"] for row in rows], np.int64)
    return steps, np.array([row["return"] for row in rows], np.float64)


def _evaluations(rows: Sequence[Any]) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    steps = np.array([row["step"] for row in rows], np.int64)
    return steps, np.array([row["mean_return"] for row in rows], np.float64)


def _running_median(values: NDArray[np.float64]) -> NDArray[np.float64]:
    """Median of each number and those before it, `WINDOW` in all."""
    return np.array([np.median(values[max(0, i + 1 - WINDOW) : i + 1]) for i in range(len(values))])


def csv_rows(curves: Sequence[Curve]) -> Iterable[tuple[object, ...]]:
    """Numbers of curves under `HEADER`."""
    for curve in curves:
        names = (curve.task, curve.agent, curve.kind, curve.n_runs, curve.run)
        for place, (step, value) in enumerate(zip(curve.steps, curve.values, strict=True)):
            low = "" if curve.low is None else repr(float(curve.low[place]))
            high = "" if curve.high is None else repr(float(curve.high[place]))
            yield (*names, int(step), repr(float(value)), low, high)
