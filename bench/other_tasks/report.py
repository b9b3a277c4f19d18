"""Tables from the stored trials."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from agents import CONTENDERS
from numpy.typing import NDArray
from page import interval, markdown
from scipy.stats import trim_mean
from tasks import CONDITIONS, TASKS

from sdnn.runs.results import Estimate, estimate_median

Trials = Mapping[tuple[str, str, str], Sequence[Mapping[str, Any]]]
"""What was seen in each trial by task, condition and contender, then by seed."""

CONFIDENCE, N_RESAMPLES = 0.95, 2000
OURS = "sdnn-c"


def by_kind(measured: Mapping[tuple[Any, ...], Mapping[str, Any]]) -> Trials:
    """Put the trials of one kind together, sorted by seed as they are."""
    trials: dict[tuple[str, str, str], list[Mapping[str, Any]]] = {}
    for (name, condition, kind, _), found in measured.items():
        trials.setdefault((name, condition, kind), []).append(found)
    return trials


def last_returns(trials: Iterable[Mapping[str, Any]]) -> NDArray[np.float64]:
    """Mean returns at the end, shape (n_trials,)."""
    return np.array([trial["mean_return"][-1] for trial in trials])


def seconds_to_solve(trials: Iterable[Mapping[str, Any]], solved: float) -> NDArray[np.float64]:
    """Processor seconds until a look first finds the task solved, infinite if none does."""
    return np.array(
        [
            next(
                (
                    seconds
                    for seconds, found in zip(t["cpu_seconds"], t["mean_return"], strict=True)
                    if found >= solved
                ),
                np.inf,
            )
            for t in trials
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
    draws = [np.concatenate([rng.choice(s, s.size) for s in scores]) for _ in range(N_RESAMPLES)]
    drawn = trim_mean(draws, 0.25, axis=1)
    lower, upper = np.quantile(drawn, [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return Estimate(float(trim_mean(np.concatenate(scores), 0.25)), float(lower), float(upper))


Middle = Callable[..., NDArray[np.float64]]
"""A function like `numpy.median`."""
MIDDLES: Mapping[str, Middle] = {"median seeds": np.median, "means of seeds": np.mean}


def shares(
    clean: Sequence[NDArray[np.float64]],
    other: Sequence[NDArray[np.float64]],
    middle: Middle,
    rng: np.random.Generator,
) -> NDArray[np.float64]:
    """Share of the clean score that is kept, the mean over tasks, and bootstrap draws of it.

    Parameters
    ----------
    clean, other
        Scores of each task, shape (n_seeds,), as it comes and with noise or redundant sensors.
    middle
        Of a task's seeds.
    rng
        Draws the seeds.

    Returns
    -------
    Shape (1 + N_RESAMPLES,): of all seeds, then of seeds drawn for each task and sensors.
    """

    def drawn(scores):
        samples = rng.choice(scores, (N_RESAMPLES, scores.size))
        return middle(np.concatenate([scores[None], samples]), axis=1)

    return np.mean([drawn(o) / drawn(c) for c, o in zip(clean, other, strict=True)], axis=0)


def interval_of(draws: NDArray[np.float64]) -> Estimate:
    """Give the first of ``draws``, with the interval that the others span."""
    lower, upper = np.quantile(draws[1:], [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return Estimate(float(draws[0]), float(lower), float(upper))


def _task_rows(trials: Trials) -> Iterator[Sequence[str]]:
    for name, task in TASKS.items():
        for condition in CONDITIONS:
            for kind, contender in CONTENDERS.items():
                looks = trials.get((name, condition, kind))
                if not looks:
                    continue
                returns = last_returns(looks)
                seconds = np.median(seconds_to_solve(looks, task.solved))
                n_bytes = np.median([trial["bytes"] for trial in looks])
                yield (
                    name,
                    condition,
                    contender.title,
                    str(len(looks)),
                    f"{looks[0]['steps'][-1]:,}",
                    interval(estimate_median(returns), 1),
                    str(int((returns >= task.solved).sum())),
                    f"{np.median([trial['cpu_seconds'][-1] for trial in looks]):.1f} s",
                    f"{seconds:.1f} s" if np.isfinite(seconds) else "not reached",
                    f"{n_bytes / 2**20:.2f} MiB",
                )


def _overall_rows(trials: Trials) -> Iterator[Sequence[str]]:
    for kind, contender in CONTENDERS.items():
        for condition in CONDITIONS:
            names = [n for n in TASKS if (n, condition, kind) in trials]
            if not names:
                continue
            scores = [_scores(trials, name, condition, kind) for name in names]
            yield (
                contender.title,
                condition,
                ", ".join(names),
                interval(interquartile_mean(scores), 2),
            )


def _scores(trials: Trials, name: str, condition: str, kind: str) -> NDArray[np.float64]:
    return np.vectorize(TASKS[name].score)(last_returns(trials[name, condition, kind]))


def _kept_rows(trials: Trials) -> Iterator[Sequence[str]]:
    """Tell what a rival and ours keep of their clean scores, task by task and in all of them."""
    for condition in list(CONDITIONS)[1:]:
        for kind, contender in CONTENDERS.items():
            if kind == OURS:
                continue
            common = [name for name in TASKS if _can_compare(trials, name, condition, kind)]
            groups = {name: [name] for name in common}
            if len(common) > 1:
                groups[f"mean of {len(common)}"] = common
            for label, names in groups.items():
                cells = _kept_cells(trials, names, condition, kind)
                yield (condition, contender.title, label, *cells)


def _can_compare(trials: Trials, name: str, condition: str, kind: str) -> bool:
    return all((name, c, who) in trials for c in ("clean", condition) for who in (OURS, kind))


def _kept_cells(trials: Trials, names: Sequence[str], condition: str, kind: str) -> Iterator[str]:
    rng = np.random.default_rng(2015)
    for middle in MIDDLES.values():
        ours, rivals = (
            100
            * shares(
                [_scores(trials, name, "clean", who) for name in names],
                [_scores(trials, name, condition, who) for name in names],
                middle,
                rng,
            )
            for who in (OURS, kind)
        )
        yield from (f"{rivals[0]:.1f} %", f"{ours[0]:.1f} %")
        yield interval(interval_of(ours - rivals), 1)


def tables(trials: Trials) -> dict[str, str]:
    """Give each table by its name in the page."""
    each = (
        "task", "sensors", "agent", "seeds", "steps", "return at the end", "seeds that solve",
        "processor time", "of which until solved", "memory",
    )  # fmt: skip
    kept = (
        "sensors", "baseline", "task",
        *(f"{what}, {m}" for m in MIDDLES for what in ("baseline", "SDNN-C", "points more")),
    )  # fmt: skip
    return {
        "task by task": markdown(each, _task_rows(trials)),
        "over tasks": markdown(("agent", "sensors", "tasks", "score (IQM)"), _overall_rows(trials)),
        "share kept": markdown(kept, _kept_rows(trials)),
    }
