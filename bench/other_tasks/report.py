"""Tables from the curves of the study's trials."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from page import interval, markdown
from studies import Curves
from tasks import GOALS, TASKS, parts_of

from sdnn.reports.statistics import estimate_median
from sdnn.runs import EnvironmentSpec
from sdnn.runs.study import Study

OURS = "q-lambda"
DEFAULT = "q-lambda-auto"
"""Ours with the default history of observations, where that makes a difference."""
STEPS = (10_000, 20_000, 50_000, 100_000, 200_000)
NOTABLE = 0.02
"""A difference worth telling, in parts of the way from random actions to a solved task."""
N_SEEDS = 10
"""Number of seeds in a complete cell; the table shows the number in others."""

Trials = Sequence[Mapping[str, Any]]


def returns_after(trials: Trials, steps: int) -> NDArray[np.float64]:
    """Return mean returns of the evaluations after some steps, (n_trials,); NaN where none is."""
    return np.array(
        [dict(zip(t["steps"], t["mean_return"], strict=True)).get(steps, np.nan) for t in trials]
    )


def last_returns(trials: Trials) -> NDArray[np.float64]:
    """Return the mean returns at the end, shape (n_trials,)."""
    return np.array([trial["mean_return"][-1] for trial in trials])


def score(case: str, trials: Trials) -> float:
    """Return the median return at the end: 0 is that of random actions, 1 solves the task."""
    task = TASKS.get(case) or TASKS[parts_of(case)[0]]
    value: float = task.score(np.median(last_returns(trials)))
    return value


def ours_in(results: Curves, case: str) -> Trials:
    """Return the trials of the default agent in a case."""
    return results.get((case, DEFAULT)) or results.get((case, OURS), ())


def _goal_rows(results: Curves) -> Iterator[Sequence[str]]:
    for case, goal in GOALS.items():
        trials = results.get((case, OURS), ())
        returns = returns_after(trials, goal.steps)
        if np.isnan(returns).any() or not returns.size:
            continue
        n_reached = int((returns >= goal.at_least).sum())
        n_required = round(goal.share * returns.size)
        reached = f"{n_reached} of {returns.size}"
        yield (
            case,
            f"{goal.steps:,}",
            number(goal.at_least),
            f"{number(np.median(returns))} ({number(returns.min())} to {number(returns.max())})",
            reached if n_reached >= n_required else f"**{reached}**",
            f"{n_required}",
        )


def _end_table(
    study: Study, results: Curves, cases: Sequence[str], names: Sequence[str]
) -> tuple[Sequence[str], list[Sequence[str]]]:
    """Return header and rows of the medians in some cases, of the agents that any of them has."""
    variants = [v for v in study.variants if any((case, v.id) in results for case in cases)]
    rows = []
    for case in cases:
        here = {v.id: results[case, v.id] for v in variants if (case, v.id) in results}
        best = max(score(case, trials) for trials in here.values())
        cells = []
        for variant in variants:
            trials = here.get(variant.id, ())
            cell = number(np.median(last_returns(trials))) if trials else ""
            if trials and score(case, trials) >= best - NOTABLE:
                cell = f"**{cell}**"
            if trials and len(trials) < N_SEEDS:
                cell += f" ({len(trials)})"
            cells.append(cell)
        rows.append((*parts_of(case)[: len(names)], *cells))
    return (*names, *(variant.title for variant in variants)), rows


def _ours_rows(
    results: Curves, tasks: Sequence[str], changes: Iterable[str]
) -> Iterator[list[str]]:
    """Yield our medians under each change, a column for each task."""
    for change in changes:
        trials = [results.get((f"{task} {change}", OURS), ()) for task in tasks]
        yield [change, *(number(np.median(last_returns(t))) if t else "" for t in trials)]


def _cost_rows(study: Study, results: Curves) -> Iterator[Sequence[str]]:
    """Yield medians of each agent over the cases."""
    for variant in study.variants:
        cases = [trials for (_, name), trials in results.items() if name == variant.id]
        if cases:
            us = np.median([_microseconds(trials) for trials in cases])
            kibibytes = np.median([_kibibytes(trials) for trials in cases])
            yield variant.title, f"{us:,.0f}", f"{kibibytes:,.0f}"


def _microseconds(trials: Trials) -> float:
    """Return the median of the processor time of a step."""
    return 1e6 * float(np.median([t["cpu_seconds"][-1] / t["steps"][-1] for t in trials]))


def _kibibytes(trials: Trials) -> float:
    """Return the median of the size of the training state."""
    return float(np.median([t["bytes"] for t in trials])) / 1024


def _loss_rows(study: Study, results: Curves) -> Iterator[Sequence[str]]:
    """Tell where an agent's median is notably better than ours, the largest difference first."""
    losses = []
    for (case, variant), trials in results.items():
        ours = ours_in(results, case)
        if ours and variant not in (OURS, DEFAULT):
            difference = score(case, trials) - score(case, ours)
            if difference > NOTABLE:
                losses.append((difference, case, variant))
    for difference, case, variant in sorted(losses, reverse=True):
        medians = (
            last_returns(trials) for trials in (results[case, variant], ours_in(results, case))
        )
        theirs, our = (
            f"{number(np.median(m))} ({m.size} seed{'s' * (m.size > 1)})" for m in medians
        )
        yield (case, title_of(study, variant), theirs, our, f"{100 * difference:.0f} %")


def _row(study: Study, case: str, variant: str, trials: Trials) -> Sequence[str]:
    medians = [np.median(returns_after(trials, steps)) for steps in STEPS]
    last = last_returns(trials)
    return (
        *parts_of(case),
        title_of(study, variant),
        str(len(trials)),
        *("" if np.isnan(median) else number(median) for median in medians),
        interval(estimate_median(last), 1) if last.size > 1 else number(last[0]),
        f"{trials[0]['steps'][-1]:,}",
        f"{_microseconds(trials):,.0f}",
        f"{_kibibytes(trials):,.0f}",
    )


def number(value: float) -> str:
    """Write a return with three digits or more."""
    return f"{value:,.2f}" if abs(value) < 10 else f"{value:,.0f}"


def title_of(study: Study, variant: str) -> str:
    """Return a variant's title."""
    return next(known.title for known in study.variants if known.id == variant)


def tables(study: Study, results: Curves) -> dict[str, str]:
    """Give each table by its name in the page."""
    goals = ("task", "steps", "goal", "median (range)", "seeds", "asked")
    losses = ("task", "agent", "its median", "ours", "of the way")
    with_results = {case for case, _ in results}
    cases = [case.id for case in study.cases if case.id in with_results]
    clean = [case for case in cases if parts_of(case)[1] == "clean"]
    changed = [case for case in cases if case not in clean]
    compared = [case for case in changed if any(k[0] == case and k[1] != OURS for k in results)]
    alone = [parts_of(case) for case in changed if case not in compared]
    tasks, changes = (list(dict.fromkeys(parts[i] for parts in alone)) for i in (0, 1))
    return {
        "goals": markdown(goals, _goal_rows(results)),
        "at the end": markdown(*_end_table(study, results, clean, ["task"])),
        "other sensors": markdown(*_end_table(study, results, compared, ["task", "change"])),
        "ours, other sensors": markdown(["change", *tasks], _ours_rows(results, tasks, changes)),
        "losses": markdown(losses, _loss_rows(study, results)),
        "costs": markdown(("agent", "us a step", "KiB"), _cost_rows(study, results)),
    }


def stored_returns(study: Study, results: Curves) -> dict[str, dict[str, float]]:
    """Return the median return at the end of each baseline, by environment and agent.

    Only of environments without other sensors or arguments: `sdnn plot --baseline` draws them.
    """
    returns: dict[str, dict[str, float]] = {}
    for (case, variant), combination in study.combinations.items():
        environment = combination.spec.environment
        is_registered = environment.replace(ranges={}) == EnvironmentSpec(id=environment.id)
        if variant == OURS or "/" in environment.id or not is_registered:
            continue
        if trials := results.get((case, variant)):
            median = round(float(np.median(last_returns(trials))), 2)
            returns.setdefault(environment.id, {})[combination.variant.title] = median
    return returns


def along_the_way(study: Study, results: Curves) -> str:
    """Give the table of every case and agent after some numbers of steps."""
    header = (
        "task", "sensors", "agent", "seeds", *(f"{steps // 1000}k" for steps in STEPS),
        "at the end", "steps", "us a step", "KiB",
    )  # fmt: skip
    order = [case.id for case in study.cases]
    every = sorted(results, key=lambda key: order.index(key[0]))
    return markdown(header, (_row(study, *key, results[key]) for key in every))
