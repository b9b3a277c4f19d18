"""Tables and a figure from the stored rows."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np
from agents import CONTENDERS
from numpy.typing import NDArray
from rows import Row
from scipy.stats import trim_mean
from tasks import CONDITIONS, TASKS

from sdnn.experiments.figures import figure_bytes, require_matplotlib
from sdnn.experiments.statistics import Estimate, estimate_median
from sdnn.whole_files import write_whole

CONFIDENCE, N_RESAMPLES = 0.95, 2000


def trials(rows: Iterable[Row], name: str, condition: str, kind: str) -> list[list[Row]]:
    """The looks of each trial, in their order, by seed."""
    by_seed: dict[int, list[Row]] = {}
    for row in rows:
        if (row["task"], row["condition"], row["agent"]) == (name, condition, kind):
            by_seed.setdefault(int(row["seed"]), []).append(row)
    return [by_seed[seed] for seed in sorted(by_seed)]


def last_returns(looks: Iterable[Sequence[Row]]) -> NDArray[np.float64]:
    """Mean returns at the end, shape (n_trials,)."""
    return np.array([float(trial[-1]["mean_return"]) for trial in looks])


def seconds_to_solve(looks: Iterable[Sequence[Row]], solved: float) -> NDArray[np.float64]:
    """Processor seconds until a look first finds the task solved, infinite if none does."""
    return np.array(
        [
            next(
                (float(r["cpu_seconds"]) for r in trial if float(r["mean_return"]) >= solved),
                np.inf,
            )
            for trial in looks
        ]
    )


def interquartile_mean(scores: Sequence[NDArray[np.float64]]) -> Estimate:
    """Interquartile mean over tasks and seeds, with a bootstrap interval stratified by task.

    Source: Agarwal, R. et al. (2021). Deep reinforcement learning at the edge of the statistical
    precipice, section 4.3.

    Parameters
    ----------
    scores
        Of each task, shape (n_seeds,).
    """
    rng = np.random.default_rng(2015)
    drawn = [trim_mean(np.concatenate([rng.choice(s, s.size) for s in scores]), 0.25)
             for _ in range(N_RESAMPLES)]  # fmt: skip
    lower, upper = np.quantile(drawn, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return Estimate(float(trim_mean(np.concatenate(scores), 0.25)), float(lower), float(upper))


def markdown(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Give a table."""
    lines = [header, ["---"] * len(header), *rows]
    return "".join("| " + " | ".join(cells) + " |\n" for cells in lines)


def _interval(estimate: Estimate, digits: int) -> str:
    return f"{estimate.value:.{digits}f} [{estimate.lower:.{digits}f}, {estimate.upper:.{digits}f}]"


def _task_rows(rows: Sequence[Row]) -> Iterator[Sequence[str]]:
    for name, task in TASKS.items():
        for condition in CONDITIONS:
            for kind, contender in CONTENDERS.items():
                looks = trials(rows, name, condition, kind)
                if not looks:
                    continue
                returns = last_returns(looks)
                seconds = np.median(seconds_to_solve(looks, task.solved))
                n_bytes = np.median([float(trial[-1]["bytes"]) for trial in looks])
                yield (
                    name,
                    condition,
                    contender.title,
                    str(len(looks)),
                    f"{int(looks[0][-1]['steps']):,}",
                    _interval(estimate_median(returns), 1),
                    str(int((returns >= task.solved).sum())),
                    f"{np.median([float(trial[-1]['cpu_seconds']) for trial in looks]):.1f} s",
                    f"{seconds:.1f} s" if np.isfinite(seconds) else "not reached",
                    f"{n_bytes / 2**20:.2f} MiB",
                )


def _overall_rows(rows: Sequence[Row]) -> Iterator[Sequence[str]]:
    for kind, contender in CONTENDERS.items():
        clean = {n for n in TASKS if trials(rows, n, "clean", kind)}
        for condition in CONDITIONS:
            names = [n for n in TASKS if trials(rows, n, condition, kind) and n in clean]
            if not names:
                continue
            scores, shares = [], []
            for name in names:
                score = np.vectorize(TASKS[name].score)
                own = score(last_returns(trials(rows, name, condition, kind)))
                scores.append(own)
                base = float(np.median(score(last_returns(trials(rows, name, "clean", kind)))))
                shares.append(float(np.median(own)) / base if base > 0 else np.nan)
            yield (
                contender.title,
                condition,
                ", ".join(names),
                _interval(interquartile_mean(scores), 2),
                "" if condition == "clean" else f"{100 * np.median(shares):.0f} %",
            )


def tables(rows: Sequence[Row]) -> str:
    """Task by task, and over tasks."""
    each = markdown(
        (
            "task", "sensors", "agent", "seeds", "steps", "return at the end", "seeds that solve",
            "processor time", "of which until solved", "memory",
        ),
        _task_rows(rows),
    )  # fmt: skip
    overall = markdown(
        ("agent", "sensors", "tasks", "score (IQM)", "share of the clean score"),
        _overall_rows(rows),
    )
    return f"{each}\n{overall}"


def draw(rows: Sequence[Row], path: Path) -> None:
    """Draw return against steps and against processor time, a column for each task."""
    require_matplotlib()
    from matplotlib.figure import Figure

    names = [n for n in TASKS if any(trials(rows, n, "clean", kind) for kind in CONTENDERS)]
    if not names:
        return
    n_columns = min(len(names), 4)
    n_blocks = -(-len(names) // n_columns)
    figure = Figure(figsize=(3.4 * n_columns, 5.2 * n_blocks), layout="constrained")
    grid = figure.subplots(2 * n_blocks, n_columns, squeeze=False)
    for number, name in enumerate(names):
        block, column = divmod(number, n_columns)
        panels = grid[2 * block : 2 * block + 2, column]
        _draw_task(panels, rows, name)
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
    write_whole(path, figure_bytes(figure)[0])


def _draw_task(panels, rows: Sequence[Row], name: str) -> None:
    """Draw a task's curves into two panels."""
    from matplotlib import colormaps
    from matplotlib.ticker import FuncFormatter, LogLocator, NullFormatter

    shades = colormaps["tab20"].colors  # each colour dark and light
    for (kind, contender), color in zip(
        CONTENDERS.items(), [*shades[::2], *shades[1::2]], strict=False
    ):
        looks = trials(rows, name, "clean", kind)
        if not looks:
            continue
        returns = np.array([[float(r["mean_return"]) for r in trial] for trial in looks])
        lower, median, upper = np.percentile(returns, (25, 50, 75), axis=0)
        for panel, field in zip(panels, ("steps", "cpu_seconds"), strict=True):
            x = np.median([[float(r[field]) for r in trial] for trial in looks], axis=0)
            (line,) = panel.plot(
                x, median, "-" if x.size > 1 else "o", color=color,
                label=contender.title, lw=1.6,
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
