"""Learning curves: which runs differ in their seeds only, the numbers of their rows, and files."""

from __future__ import annotations

import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from io import BytesIO
from pathlib import Path
from typing import Any, Literal, TypeAlias, get_args

import numpy as np
from numpy.typing import NDArray

from sdnn.files import csv_bytes, write_whole
from sdnn.interrupts import stay_interrupts
from sdnn.runs.errors import RunError
from sdnn.runs.figures import draw_curves
from sdnn.runs.run import Run

WINDOW = 20
"""Episodes in the running median of the returns, or all so far where they are fewer."""

SUFFIXES = (".png", ".svg", ".pdf")
"""Kinds of figures that the curves of runs may be written as."""

HEADER = ("task", "agent", "kind", "n_runs", "run", "step", "value", "low", "high")

Kind: TypeAlias = Literal["return", "running median", "evaluation"]

_CHANGES_NOTHING = ("seed", "output")  # of a configuration: may differ within a group
_NOT_NAMED = ("0", "0.0", "none", "false", "null")  # values that a name leaves out


@dataclass(frozen=True, kw_only=True)
class Group:
    """Runs that differ in their seeds only; no other group has both its task and its agent."""

    task: str
    agent: str
    runs: tuple[Run, ...]


def groups_of(runs: Sequence[Run]) -> list[Group]:
    """Put runs together that differ in their seeds only, in the order of the first of each.

    Names have the settings that are not the default; agents of the same name on the same task are
    told apart by all that differs.
    """
    groups: dict[tuple[tuple[str, str], ...], list[Run]] = {}
    for run in runs:
        values = {k: v for k, v in run.spec.full_values().items() if k not in _CHANGES_NOTHING}
        definition = dict(_flat(values)) | {"goals": ", then ".join(_goals(run))}
        groups.setdefault(tuple(sorted(definition.items())), []).append(run)
    names = [_names(members[0]) for members in groups.values()]
    found = []
    for name, own, members in zip(names, groups, groups.values(), strict=True):
        others = [dict(one) for other, one in zip(names, groups, strict=True) if other == name]
        words = [_word(k, v) for k, v in own if any(one.get(k, v) != v for one in others)]
        agent = ", ".join([name[1], *words])
        found.append(Group(task=name[0], agent=agent, runs=tuple(members)))
    return found


def _flat(values: Mapping[str, Any], prefix: str = "") -> Iterator[tuple[str, str]]:
    for name, value in values.items():
        if isinstance(value, Mapping):
            yield from _flat(value, f"{prefix}{name}.")
        elif f"{prefix}{name}" not in ("budget.steps", "budget.episodes"):
            yield f"{prefix}{name}", value if isinstance(value, str) else json.dumps(value)


def _names(run: Run) -> tuple[str, str]:
    """Return the name of the task and that of the agent."""
    task, agent = [run.spec.task], [f"{run.spec.agent.name} {run.spec.agent.preset or ''}".strip()]
    for key, value in _flat(run.spec.values()):
        table = key.partition(".")[0]
        if key in ("environment.id", "agent.name", "agent.preset"):
            continue
        if table in ("environment", "acrobot", "goal", "sensors") and value not in _NOT_NAMED:
            task.append(_word(key, value))
        if table in ("agent", "approximator", "learning"):
            agent.append(_word(key, value))
    return ", ".join(task), ", ".join(agent)


def _word(key: str, value: str) -> str:
    return value if key == "goals" else f"{key.rpartition('.')[2]}={value}"


def _goals(run: Run) -> Iterator[str]:
    """Write its goals, each after the step where it was given, if that was the user's choice."""
    budget = run.spec.budget
    yield f"{budget.episodes} episodes" if budget.steps is None else f"{budget.steps} steps"
    due = None if budget.target_return is not None else budget.steps
    for goal in run.goals:
        start = "" if due is None or goal.at_step >= due else f"from {goal.at_step} on "
        yield start + (f"{goal.episodes} episodes" if goal.steps is None else f"{goal.steps} steps")
        due = goal.steps


@dataclass(frozen=True, kw_only=True, eq=False)
class Curve:
    """Numbers against steps, arrays (n,).

    They are returns of episodes, the running median of these, or evaluations: of one run the mean,
    of several that differ in their seeds the median of their means.
    """

    task: str
    agent: str
    kind: Kind
    n_runs: int = 1
    run: str = ""  # folder of the run, if it is one
    steps: NDArray[np.int64]
    values: NDArray[np.float64]
    # Quartiles over the episodes of each evaluation of one run, or over runs.
    low: NDArray[np.float64] | None = None
    high: NDArray[np.float64] | None = None


def curves_of(runs: Sequence[Run]) -> tuple[list[Curve], list[str]]:
    """Make the curves of runs; those that differ in their seeds only become one.

    With them comes a line about each run of which something could not be drawn. RunError if there
    is nothing to draw yet, or rows cannot be read.
    """
    made = [_curves_of_group(group) for group in groups_of(runs)]
    curves = [curve for own, _ in made for curve in own]
    notes = [note for _, own in made for note in own]
    if not curves:
        raise RunError("; ".join(notes) + ": nothing to draw")
    return curves, notes


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


def _curves_of_group(group: Group) -> tuple[list[Curve], list[str]]:
    """Make the curves of one run, or the one of several, and notes on what it leaves out."""
    rows = {run: run.rows() for run in group.runs}
    kind: Kind = "evaluation"
    series = {run: _series(own, kind) for run, own in rows.items()}
    if not any(len(steps) for steps, _ in series.values()):
        kind = "running median"
        series = {run: _series(own, kind) for run, own in rows.items()}
    what = "no evaluation" if kind == "evaluation" else "no episode and no evaluation"
    notes = [
        f"{run.folder}: {what} is whole yet" for run, (steps, _) in series.items() if not len(steps)
    ]
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
    curves = []
    for kind in get_args(Kind):
        steps, values = _series(rows, kind)
        bounds = {}
        if kind == "evaluation" and len(steps):
            evaluations = (row["returns"] for row in rows if row["kind"] == "evaluation")
            low, high = np.array([np.percentile(one, (25, 75)) for one in evaluations]).T
            bounds = {"low": low, "high": high}
        if len(steps):
            names: dict[str, Any] = {"task": group.task, "agent": group.agent, "kind": kind}
            curves.append(Curve(**names, run=str(run.folder), steps=steps, values=values, **bounds))
    return curves


def _steps_of_all(all_steps: Sequence[NDArray[np.int64]], is_grid: bool) -> NDArray[np.int64]:
    """Find steps at which all have numbers: shared ones, or a hundred within what all reached."""
    if is_grid:
        return reduce(np.intersect1d, all_steps)
    first = max(int(steps[0]) for steps in all_steps)
    last = min(int(steps[-1]) for steps in all_steps)
    steps = np.linspace(first, last, 100 if first <= last else 0)
    return np.unique(steps.astype(np.int64))


def _series(rows: Sequence[Any], kind: Kind) -> tuple[NDArray[np.int64], NDArray[np.float64]]:
    """Return the steps of a curve of a run, and its values."""
    wanted, name = "episode", "return"
    if kind == "evaluation":
        wanted, name = "evaluation", "mean_return"
    own = [row for row in rows if row["kind"] == wanted]
    steps = np.array([row["step"] for row in own], np.int64)
    values = np.array([row[name] for row in own], np.float64)
    if kind == "running median":
        ends = range(1, len(values) + 1)
        values = np.array([np.median(values[max(0, end - WINDOW) : end]) for end in ends])
    return steps, values


def _csv_rows(curves: Sequence[Curve]) -> Iterable[tuple[object, ...]]:
    """Numbers of curves under `HEADER`."""
    for curve in curves:
        names = (curve.task, curve.agent, curve.kind, curve.n_runs, curve.run)
        columns = (curve.values, curve.low, curve.high)
        for place, step in enumerate(curve.steps):
            numbers = ("" if c is None else float(c[place]) for c in columns)
            yield (*names, int(step), *numbers)
