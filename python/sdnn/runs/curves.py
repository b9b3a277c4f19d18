"""Learning curves of runs, in numbers and figures; runs that differ in seeds only become one."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import reduce
from io import BytesIO
from itertools import chain
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal, TypeAlias

import numpy as np
from numpy.typing import NDArray

from sdnn.reports.plots import FAINT, INK, Axes, Figure, color_of, new_figure, style, wrapped
from sdnn.runs.environment import EnvironmentSpec
from sdnn.runs.errors import RunError
from sdnn.runs.levels import Level
from sdnn.runs.report import require_matplotlib
from sdnn.runs.run import Run
from sdnn.support.csv_files import csv_bytes
from sdnn.support.files import write_whole
from sdnn.support.interrupts import stay_interrupts
from sdnn.support.toml import leaves
from sdnn.training.loop import Row

if TYPE_CHECKING:
    from matplotlib.artist import Artist

WINDOW = 20  # episodes in the running median of the returns; at first there are fewer

MAX_POINTS = 500  # the most points of a running median over several runs

SUFFIXES = (".png", ".svg", ".pdf")  # kinds of figures that the curves of runs may be written as

HEADER = ("task", "agent", "kind", "n_runs", "run", "step", "value", "low", "high")

Kind: TypeAlias = Literal["return", "running median", "evaluation"]
Steps: TypeAlias = NDArray[np.int64]
Floats: TypeAlias = NDArray[np.float64]
Series: TypeAlias = tuple[Steps, Floats]
"""Steps and values of a run."""

_IGNORED = ("seed", "budget.steps", "budget.episodes")  # goals are compared separately


@dataclass(frozen=True, kw_only=True)
class Group:
    """Runs that differ in their seeds only, labelled by task and agent."""

    task: str
    agent: str
    runs: tuple[Run, ...]

    def curve(
        self, kind: Kind, steps: Steps, values: Floats, run: Run | None = None, **more: Any
    ) -> Curve:
        """Make a curve of a run of the group, or of all; ``more`` are other fields of `Curve`."""
        folder = "" if run is None else str(run.folder)
        return Curve(
            task=self.task, agent=self.agent, kind=kind, run=folder, steps=steps, values=values,
            **more,
        )  # fmt: skip


def groups_of(runs: Sequence[Run]) -> list[Group]:
    """Group runs that differ in their seeds only, in the order of their first runs.

    Labels of tasks and agents contain the settings in which groups differ.
    """
    members: dict[_Settings, list[Run]] = {}
    for run in runs:
        members.setdefault(_settings_of(run), []).append(run)
    groups = []
    for settings, group_runs in members.items():
        spec = group_runs[0].spec
        same_task = [
            (dict(others), runs[0].spec.label)
            for others, runs in members.items()
            if runs[0].spec.task == spec.task
        ]
        task, agent = [spec.task], [f"{spec.agent.name} {spec.agent.preset or ''}".strip()]
        for key, value in settings:
            is_of_task = key.startswith("environment.")
            # Agents are compared with those of their own label only.
            others = [s for s, label in same_task if is_of_task or label == spec.label]
            if any(other.get(key) != value for other in others):
                word = value if key == "goals" else f"{key.rpartition('.')[2]}={value}"
                (task if is_of_task else agent).append(word)
        groups.append(Group(task=", ".join(task), agent=", ".join(agent), runs=tuple(group_runs)))
    return groups


_Settings: TypeAlias = tuple[tuple[str, str], ...]
"""Settings of a run, but for its seed and output: sorted pairs of key and value as text."""


def _settings_of(run: Run) -> _Settings:
    """Return the settings that runs of a group share, with the goals under the key "goals"."""
    settings = {"goals": ", then ".join(_goal_labels(run))}
    for key, value in leaves(run.spec.full_values()):
        if value != {} and key not in _IGNORED and not key.startswith("output."):
            settings[key] = value if isinstance(value, str) else json.dumps(value)
    return tuple(sorted(settings.items()))


def environments_of(runs: Sequence[Run]) -> dict[str, EnvironmentSpec]:
    """Return the environment of each panel by the label of its task."""
    return {group.task: group.runs[0].spec.environment for group in groups_of(runs)}


def _goal_labels(run: Run) -> Iterator[str]:
    """Describe a run's goals: "9000 steps", later ones with their start, "from 500 on 9000 steps".

    The start is the step at which the user has set the goal; it is left out where the goal before
    had ended there.
    """
    budget = run.spec.budget
    yield f"{budget.episodes} episodes" if budget.steps is None else f"{budget.steps} steps"
    end = None if budget.target_return is not None else budget.steps  # of the goal before, if known
    for goal in run.goals:
        start = "" if end is None or goal.at_step >= end else f"from {goal.at_step} on "
        yield start + (f"{goal.episodes} episodes" if goal.steps is None else f"{goal.steps} steps")
        end = goal.steps


@dataclass(frozen=True, kw_only=True, eq=False)
class Curve:
    """A curve of numbers against steps, arrays (n,).

    The numbers are returns of a run's episodes, their running median, or evaluations: those of a
    single run, or the median over runs that differ in their seeds.
    """

    task: str
    agent: str
    kind: Kind
    n_runs: int = 1
    run: str = ""  # folder of the run; empty for several runs
    steps: Steps
    values: Floats
    # Quartiles over the episodes of an evaluation (single run), or over runs.
    low: Floats | None = None
    high: Floats | None = None

    def rows(self) -> Iterator[tuple[object, ...]]:
        """Yield the numbers under `HEADER`."""
        names = (self.task, self.agent, self.kind, self.n_runs, self.run)
        empty = [""] * len(self.steps)
        columns = [empty if c is None else c.tolist() for c in (self.values, self.low, self.high)]
        for step, *numbers in zip(self.steps.tolist(), *columns, strict=True):
            yield (*names, step, *numbers)


def curves_of(runs: Sequence[Run]) -> tuple[list[Curve], list[str]]:
    """Return the curves of runs, and notes about runs of which something could not be drawn.

    Runs that differ in their seeds only share a curve, but keep their episodes. RunError if there
    is nothing to draw yet, or rows cannot be read.
    """
    curves_and_notes = [_curves_of_group(group) for group in groups_of(runs)]
    curves = [curve for group_curves, _ in curves_and_notes for curve in group_curves]
    notes = [note for _, group_notes in curves_and_notes for note in group_notes]
    if not curves:
        raise RunError("; ".join(notes) + ": nothing to draw")
    return curves, notes


def _curves_of_group(group: Group) -> tuple[list[Curve], list[str]]:
    """Return a group's curves, and notes about what is missing from them.

    Each run has its episodes and their running median. A single run's evaluations are drawn with
    their quartiles, those of several runs as medians at their common steps.
    """
    rows = {run: run.rows() for run in group.runs}
    episodes, evaluated = _series_of(rows, "return"), _series_of(rows, "evaluation")
    missing = "no evaluation" if evaluated else "no episode and no evaluation"
    drawn = evaluated or episodes
    notes = [f"{run.folder}: {missing} is whole yet" for run in group.runs if run not in drawn]
    curves = [group.curve("return", *series, run) for run, series in episodes.items()]
    curves += _running_medians(group, episodes)
    if len(evaluated) == 1:
        ((run, series),) = evaluated.items()
        returns = (row["returns"] for row in rows[run] if row["kind"] == "evaluation")
        low, high = np.array([np.percentile(several, (25, 75)) for several in returns]).T
        return [*curves, group.curve("evaluation", *series, run, low=low, high=high)], notes
    if not evaluated:
        return curves, notes
    folders = ", ".join(str(run.folder) for run in evaluated)
    steps = reduce(np.intersect1d, [run_steps for run_steps, _ in evaluated.values()])
    if not len(steps):
        return curves, [*notes, f"{folders}: their evaluations have no step in common"]
    if any(run_steps[-1] > steps[-1] for run_steps, _ in evaluated.values()):
        notes.append(f"{folders}: drawn to step {steps[-1]}, which all of them have reached")
    values = np.array([means[np.isin(run_steps, steps)] for run_steps, means in evaluated.values()])
    return [*curves, _median_curve(group, "evaluation", steps, values)], notes


def _running_medians(group: Group, episodes: Mapping[Run, Series]) -> Iterator[Curve]:
    """Yield the running median of a single run's returns, or the median over several runs.

    Runs end episodes at different steps: between two of its episodes, a run keeps the value of the
    earlier one. No curve is yielded where runs have no range of steps in common.
    """
    medians = {run: _running_median(values) for run, (_, values) in episodes.items()}
    if len(episodes) < 2:
        for run, (steps, _) in episodes.items():
            yield group.curve("running median", steps, medians[run], run)
        return
    all_steps = [steps for steps, _ in episodes.values()]
    first, last = max(steps[0] for steps in all_steps), min(steps[-1] for steps in all_steps)
    union = np.unique(np.concatenate(all_steps))
    grid = union[(union >= first) & (union <= last)]  # where every run has a value
    if not len(grid):
        return
    grid = grid[np.unique(np.linspace(0, len(grid) - 1, MAX_POINTS).astype(int))]
    values = [
        medians[run][np.searchsorted(steps, grid, side="right") - 1]
        for run, (steps, _) in episodes.items()
    ]
    yield _median_curve(group, "running median", grid, np.array(values))


def _median_curve(group: Group, kind: Kind, steps: Steps, values: Floats) -> Curve:
    """Return the median over runs, with its quartiles, of values of shape (n_runs, n_steps)."""
    low, middle, high = np.percentile(values, (25, 50, 75), axis=0)
    return group.curve(kind, steps, middle, n_runs=len(values), low=low, high=high)


def _running_median(values: Floats) -> Floats:
    """Return the median of the last `WINDOW` values at each of them."""
    ends = range(1, len(values) + 1)
    return np.array([np.median(values[max(0, end - WINDOW) : end]) for end in ends])


def _series_of(rows_of_runs: Mapping[Run, Sequence[Row]], kind: Kind) -> dict[Run, Series]:
    """Return the steps and returns of episodes, or of evaluations, of the runs that have any."""
    row_kind, name = ("episode", "return") if kind == "return" else ("evaluation", "mean_return")
    series = {}
    for run, rows in rows_of_runs.items():
        if matching := [row for row in rows if row["kind"] == row_kind]:
            steps = np.array([row["step"] for row in matching], np.int64)
            series[run] = steps, np.array([row[name] for row in matching], np.float64)
    return series


def write_curves(
    curves: Sequence[Curve], path: Path, levels: Sequence[Level] = ()
) -> tuple[Path, Path]:
    """Draw the curves of runs into a file, and write their numbers beside it as CSV; return both.

    Levels are drawn across their panels; in the CSV they have no step.

    Raises RunError if the name has another ending than those of `SUFFIXES`.
    """
    if path.suffix not in SUFFIXES:
        raise RunError(f"out must end in one of {', '.join(SUFFIXES)}, got {path}")
    content = BytesIO()
    figure = draw_curves(curves, levels)
    with stay_interrupts():
        figure.savefig(content, format=path.suffix[1:], dpi=150)
    path.parent.mkdir(parents=True, exist_ok=True)
    numbers = path.with_suffix(".csv")
    write_whole(path, content.getvalue())
    rows = chain.from_iterable(part.rows() for part in curves)
    rows_of_levels = chain.from_iterable(level.rows() for level in levels)
    write_whole(numbers, csv_bytes(HEADER, chain(rows, rows_of_levels)))
    return path, numbers


_INKS = {"return": FAINT, "running median": INK, "evaluation": INK}
_LABELS = {
    "return": "episodes",
    "running median": f"running median of {WINDOW} episodes",
    "evaluation": "mean of greedy episodes",
}
_WIDTH = 6.0  # inches, so that texts can be read on a telephone
_LABEL_HEIGHT = 0.055  # of the labels of levels, in parts of a panel
_MANY_POINTS = 20_000  # from this number on, points are drawn as a picture, also in SVG and PDF


def draw_curves(curves: Sequence[Curve], levels: Sequence[Level] = ()) -> Figure:
    """Draw the curves of runs: a panel per task, a color per agent, a dotted line per level.

    The legend explains each agent and each type of line once. Raises a `PlotUnavailableError` if
    matplotlib is not installed.
    """
    require_matplotlib()
    tasks = list(dict.fromkeys(curve.task for curve in curves))
    agents = list(dict.fromkeys(curve.agent for curve in curves))
    colors = {agent: color_of(number) for number, agent in enumerate(agents)}
    figure = new_figure(_WIDTH, 0.9 + 3.3 * len(tasks))
    panels = figure.subplots(len(tasks), squeeze=False)[:, 0]
    for task, axes in zip(tasks, panels, strict=True):
        for curve in (c for c in curves if c.task == task):
            _draw_curve(axes, curve, colors[curve.agent])
        _draw_levels(axes, [level for level in levels if level.task == task])
        title = task if len(agents) > 1 else f"{task}: {agents[0]}"
        axes.set_title(title, fontsize=10.5, loc="left", color=INK)
        axes.set(ylabel="return")
        axes.xaxis.set_major_formatter(lambda step, _: f"{step:,.0f}")
        style(axes)
    panels[-1].set_xlabel("steps")
    entries = _legend_entries(curves, colors if len(agents) > 1 else {})
    figure.legend(handles=entries, loc="outside upper left", ncols=2, fontsize=9, frameon=False)
    footer = "Bands: quartiles over the episodes of an evaluation."
    if any(curve.n_runs > 1 for curve in curves):
        footer = "Lines: medians over runs that differ in their seeds; bands: quartiles over them"
        footer += " (of a single run: over the episodes of an evaluation)."
    figure.supxlabel(wrapped(footer, 90), x=0.012, ha="left", fontsize=7.5, color=FAINT)
    return figure


def _draw_curve(axes: Axes, curve: Curve, color: str) -> None:
    """Draw the line of a curve and, over several runs, the band of their quartiles."""
    (line,) = axes.plot(curve.steps, curve.values, color=color)
    line.update(_look(curve.kind, len(curve.steps)))
    if curve.low is not None and curve.high is not None:
        axes.fill_between(curve.steps, curve.low, curve.high, color=color, alpha=0.2, lw=0)


def _look(kind: Kind, n_points: int = 0) -> dict[str, object]:
    """Return matplotlib's properties of a curve, of the names that `Artist.update` expects."""
    if kind == "return":
        has_many_points = n_points > _MANY_POINTS
        return {"ls": "", "marker": ".", "ms": 2.5, "alpha": 0.3, "rasterized": has_many_points}
    if kind == "running median":
        return {"ls": "--", "lw": 1.2}
    return {"ls": "-", "lw": 1.8, "marker": "o", "ms": 3}


def _draw_levels(axes: Axes, levels: Sequence[Level]) -> None:
    """Draw dotted lines with labels at the right, which are moved apart where they are close."""
    for level in levels:
        axes.axhline(level.value, color=FAINT, lw=1.0, ls=":", zorder=1)
    low, high = axes.get_ylim()
    axes.set_ylim(low, high)
    height = low
    for level in sorted(levels, key=lambda level: level.value):
        height = max(level.value, height)
        digits = 0 if abs(level.value) >= 10 else 2  # three significant digits at least
        axes.annotate(
            f"{level.title} {level.value:,.{digits}f}", (1.01, height), color=FAINT, fontsize=8,
            xycoords=axes.get_yaxis_transform(), va="center", annotation_clip=False,
        )  # fmt: skip
        height += _LABEL_HEIGHT * (high - low)


def _legend_entries(curves: Sequence[Curve], colors: Mapping[str, str]) -> list[Artist]:
    """Return an entry for each color and for each type of line."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: list[Artist] = [Patch(color=color, label=agent) for agent, color in colors.items()]
    for kind in dict.fromkeys(curve.kind for curve in curves):
        line = Line2D([], [], color=_INKS[kind], label=_LABELS[kind])
        line.update(_look(kind))
        entries.append(line)
    return entries
