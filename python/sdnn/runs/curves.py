"""Learning curves of runs, in numbers and figures; runs that differ in seeds only become one."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from io import BytesIO
from pathlib import Path
from typing import Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from sdnn.reports.plots import Axes, Figure, color_of, new_figure
from sdnn.runs.errors import RunError
from sdnn.runs.report import require_matplotlib
from sdnn.runs.run import Run
from sdnn.support.csv_files import csv_bytes
from sdnn.support.files import write_whole
from sdnn.support.interrupts import stay_interrupts
from sdnn.training.loop import Row

WINDOW = 20
"""Episodes in the running median of the returns, or all if there are fewer."""

SUFFIXES = (".png", ".svg", ".pdf")
"""Kinds of figures that the curves of runs may be written as."""

HEADER = ("task", "agent", "kind", "n_runs", "run", "step", "value", "low", "high")

Kind: TypeAlias = Literal["return", "running median", "evaluation"]

_IGNORED = ("seed", "output", "budget.steps", "budget.episodes")  # goals are compared separately


@dataclass(frozen=True, kw_only=True)
class Group:
    """Runs that differ in their seeds only, labelled by task and agent."""

    task: str
    agent: str
    runs: tuple[Run, ...]


def groups_of(runs: Sequence[Run]) -> list[Group]:
    """Group runs that differ in their seeds only, in the order of their first runs.

    Labels of tasks and agents contain the settings in which groups differ.
    """
    members: dict[tuple[tuple[str, str], ...], list[Run]] = {}
    for run in runs:
        settings = dict(_flat_settings(run.spec.full_values())) | {
            "goals": ", then ".join(_goal_labels(run))
        }
        members.setdefault(tuple(sorted(settings.items())), []).append(run)
    groups = []
    for key_values, same in members.items():
        spec = same[0].spec
        task, agent = [spec.task], [f"{spec.agent.name} {spec.agent.preset or ''}".strip()]
        alike = [(dict(s), r[0].spec) for s, r in members.items() if r[0].spec.task == spec.task]
        for key, value in key_values:
            is_of_task = key.startswith("environment.")
            others = (s for s, other in alike if is_of_task or other.label == spec.label)
            if any(other.get(key) != value for other in others):
                word = value if key == "goals" else f"{key.rpartition('.')[2]}={value}"
                (task if is_of_task else agent).append(word)
        groups.append(Group(task=", ".join(task), agent=", ".join(agent), runs=tuple(same)))
    return groups


def _flat_settings(values: Mapping[str, object], prefix: str = "") -> Iterator[tuple[str, str]]:
    for name, value in values.items():
        if f"{prefix}{name}" in _IGNORED:
            continue
        if isinstance(value, Mapping):
            yield from _flat_settings(value, f"{prefix}{name}.")
        else:
            yield f"{prefix}{name}", value if isinstance(value, str) else json.dumps(value)


def _goal_labels(run: Run) -> Iterator[str]:
    """Describe a run's goals; later goals with the step at which the user has set them."""
    budget = run.spec.budget
    yield f"{budget.episodes} episodes" if budget.steps is None else f"{budget.steps} steps"
    due = None if budget.target_return is not None else budget.steps
    for goal in run.goals:
        start = "" if due is None or goal.at_step >= due else f"from {goal.at_step} on "
        yield start + (f"{goal.episodes} episodes" if goal.steps is None else f"{goal.steps} steps")
        due = goal.steps


@dataclass(frozen=True, kw_only=True, eq=False)
class Curve:
    """A curve of numbers against steps, arrays (n,).

    The numbers are returns of episodes, their running median, or evaluations: the mean return of
    a single run, or the median over runs that differ in their seeds.
    """

    task: str
    agent: str
    kind: Kind
    n_runs: int = 1
    run: str = ""  # folder of the run; empty for several runs
    steps: NDArray[np.int64]
    values: NDArray[np.float64]
    # Quartiles over the episodes of an evaluation (single run), or over runs.
    low: NDArray[np.float64] | None = None
    high: NDArray[np.float64] | None = None

    def rows(self) -> Iterator[tuple[object, ...]]:
        """Yield the numbers under `HEADER`."""
        names = (self.task, self.agent, self.kind, self.n_runs, self.run)
        empty = [""] * len(self.steps)
        columns = [empty if c is None else c.tolist() for c in (self.values, self.low, self.high)]
        for step, *numbers in zip(self.steps.tolist(), *columns, strict=True):
            yield (*names, step, *numbers)


def curves_of(runs: Sequence[Run]) -> tuple[list[Curve], list[str]]:
    """Return the curves of runs, and notes about runs of which something could not be drawn.

    Runs that differ in their seeds only share a curve. RunError if there is nothing to draw yet,
    or rows cannot be read.
    """
    made = [_curves_of_group(group) for group in groups_of(runs)]
    curves = [curve for run_curves, _ in made for curve in run_curves]
    notes = [note for _, run_notes in made for note in run_notes]
    if not curves:
        raise RunError("; ".join(notes) + ": nothing to draw")
    return curves, notes


def _curves_of_group(group: Group) -> tuple[list[Curve], list[str]]:
    """Return the curves of a group: the median over evaluated runs, or each run's; and notes."""
    rows = {run: run.rows() for run in group.runs}
    series = {run: _steps_and_values(run_rows, "evaluation") for run, run_rows in rows.items()}
    evaluated = {run: pair for run, pair in series.items() if len(pair[0])}
    what = "no evaluation" if evaluated else "no episode and no evaluation"
    shown = [*evaluated] or [run for run, run_rows in rows.items() if run_rows]
    notes = [f"{run.folder}: {what} is whole yet" for run in group.runs if run not in shown]
    if len(evaluated) < 2:
        return [curve for run in shown for curve in _curves_of_run(group, run, rows[run])], notes
    folders = ", ".join(str(run.folder) for run in evaluated)
    steps = reduce(np.intersect1d, [run_steps for run_steps, _ in evaluated.values()])
    if not len(steps):
        return [], [*notes, f"{folders}: they have no step in common"]
    if any(run_steps[-1] > steps[-1] for run_steps, _ in evaluated.values()):
        notes.append(f"{folders}: drawn to step {steps[-1]}, which all of them have reached")
    values = np.array([means[np.isin(run_steps, steps)] for run_steps, means in evaluated.values()])
    low, middle, high = np.percentile(values, (25, 50, 75), axis=0)
    curve = Curve(
        task=group.task, agent=group.agent, n_runs=len(evaluated),
        kind="evaluation", steps=steps, values=middle, low=low, high=high,
    )  # fmt: skip
    return [curve], notes


def _curves_of_run(group: Group, run: Run, rows: Sequence[Row]) -> Iterator[Curve]:
    for kind in get_args(Kind):
        steps, values = _steps_and_values(rows, kind)
        bounds = {}
        if kind == "evaluation" and len(steps):
            evaluations = (row["returns"] for row in rows if row["kind"] == "evaluation")
            low, high = np.array([np.percentile(means, (25, 75)) for means in evaluations]).T
            bounds = {"low": low, "high": high}
        if len(steps):
            yield Curve(
                task=group.task, agent=group.agent, run=str(run.folder),
                kind=kind, steps=steps, values=values, **bounds,
            )  # fmt: skip


def _steps_and_values(
    rows: Sequence[Row], kind: Kind
) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    wanted, name = "episode", "return"
    if kind == "evaluation":
        wanted, name = "evaluation", "mean_return"
    matching = [row for row in rows if row["kind"] == wanted]
    steps = np.array([row["step"] for row in matching], np.int64)
    values = np.array([row[name] for row in matching], np.float64)
    if kind == "running median":
        lengths = range(1, len(values) + 1)
        values = np.array([np.median(values[max(0, end - WINDOW) : end]) for end in lengths])
    return steps, values


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
    write_whole(numbers, csv_bytes(HEADER, (row for curve in curves for row in curve.rows())))
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
