"""Tables from the curves of the study's trials."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray
from page import interval, markdown
from scipy.stats import trim_mean
from studies import Curves
from tasks import CLEAN, TASKS, parts_of

from sdnn.runs.results import Estimate, estimate_median
from sdnn.runs.study import Study

CONFIDENCE, N_RESAMPLES = 0.95, 2000
OURS = "sdnn-c"


def last_returns(trials: Iterable[Mapping[str, Any]]) -> NDArray[np.float64]:
    """Mean returns at the end, shape (n_trials,)."""
    return np.array([trial["mean_return"][-1] for trial in trials])


def seconds_to_solve(trials: Iterable[Mapping[str, Any]], solved: float) -> NDArray[np.float64]:
    """Processor seconds until an evaluation first finds the task solved, infinite if none does."""
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
        Scores of each task, shape (n_seeds,), without and with noise or redundant sensors.
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
    """Return the first of ``draws``, with the interval that the others span."""
    lower, upper = np.quantile(draws[1:], [(1 - CONFIDENCE) / 2, (1 + CONFIDENCE) / 2])
    return Estimate(float(draws[0]), float(lower), float(upper))


def _task_rows(study: Study, found: Curves) -> Iterator[Sequence[str]]:
    for name, task in TASKS.items():
        for (case, variant), trials in found.items():
            if parts_of(case)[0] != name:
                continue
            returns = last_returns(trials)
            seconds = np.median(seconds_to_solve(trials, task.solved))
            n_bytes = np.median([trial["bytes"] for trial in trials])
            yield (
                *parts_of(case),
                title_of(study, variant),
                str(len(trials)),
                f"{trials[0]['steps'][-1]:,}",
                interval(estimate_median(returns), 1),
                str(int((returns >= task.solved).sum())),
                f"{np.median([trial['cpu_seconds'][-1] for trial in trials]):.1f} s",
                f"{seconds:.1f} s" if np.isfinite(seconds) else "not reached",
                f"{n_bytes / 2**20:.2f} MiB",
            )


def title_of(study: Study, variant: str) -> str:
    """Return a variant's title."""
    return next(one.title for one in study.variants if one.id == variant)


def conditions_of(study: Study) -> list[str]:
    """List what is done to sensors, clean ones first."""
    return list(dict.fromkeys(parts_of(case.id)[1] for case in study.cases))


def case_of(name: str, condition: str) -> str:
    """Return the id of a case."""
    return name if condition == CLEAN else f"{name} {condition}"


def _overall_rows(study: Study, found: Curves) -> Iterator[Sequence[str]]:
    for variant in study.variants:
        for condition in conditions_of(study):
            names = [n for n in TASKS if (case_of(n, condition), variant.id) in found]
            if names:
                scores = [_scores(found, name, condition, variant.id) for name in names]
                estimate = interval(interquartile_mean(scores), 2)
                yield variant.title, condition, ", ".join(names), estimate


def _scores(found: Curves, name: str, condition: str, variant: str) -> NDArray[np.float64]:
    scores: NDArray[np.float64] = TASKS[name].score(
        last_returns(found[case_of(name, condition), variant])
    )
    return scores


def _kept_rows(study: Study, found: Curves) -> Iterator[Sequence[str]]:
    """Tell what a baseline and ours keep of their clean scores, by task and in all of them."""
    for condition in conditions_of(study)[1:]:
        for variant in study.variants:
            if variant.id == OURS:
                continue
            pairs = [(c, who) for c in (CLEAN, condition) for who in (OURS, variant.id)]
            common = [n for n in TASKS if all((case_of(n, c), w) in found for c, w in pairs)]
            groups = {name: [name] for name in common}
            if len(common) > 1:
                groups[f"mean of {len(common)}"] = common
            for label, names in groups.items():
                cells = _kept_cells(found, names, condition, variant.id)
                yield (condition, variant.title, label, *cells)


def _kept_cells(found: Curves, names: Sequence[str], condition: str, variant: str) -> Iterator[str]:
    rng = np.random.default_rng(2015)
    for middle in MIDDLES.values():
        ours, baseline = (
            100
            * shares(
                [_scores(found, name, CLEAN, who) for name in names],
                [_scores(found, name, condition, who) for name in names],
                middle,
                rng,
            )
            for who in (OURS, variant)
        )
        yield from (f"{baseline[0]:.1f} %", f"{ours[0]:.1f} %")
        yield interval(interval_of(ours - baseline), 1)


def tables(study: Study, found: Curves) -> dict[str, str]:
    """Give each table by its name in the page."""
    each = (
        "task", "sensors", "agent", "seeds", "steps", "return at the end", "seeds that solve",
        "processor time", "of which until solved", "memory",
    )  # fmt: skip
    kept = (
        "sensors", "baseline", "task",
        *(f"{what}, {m}" for m in MIDDLES for what in ("baseline", "SDNN-C", "points more")),
    )  # fmt: skip
    overall = ("agent", "sensors", "tasks", "score (IQM)")
    return {
        "task by task": markdown(each, _task_rows(study, found)),
        "over tasks": markdown(overall, _overall_rows(study, found)),
        "share kept": markdown(kept, _kept_rows(study, found)),
    }


def _times(ratio: float) -> str:
    return f"{ratio:,.{0 if ratio >= 10 else 1}f}x" if np.isfinite(ratio) else ""


def _solved_rows(study: Study, found: Curves) -> Iterator[Sequence[str]]:
    for (case, variant), trials in found.items():
        solved = TASKS[parts_of(case)[0]].solved

        def until(field: str, trials: Any, solved: float = solved) -> NDArray[np.float64]:
            ends = last_returns(trials) >= solved
            return np.where(ends, [float(trial[field][-1]) for trial in trials], np.inf)

        steps, seconds = until("steps", trials), until("cpu_seconds", trials)
        ours = np.median(until("cpu_seconds", found[case, OURS]))
        spent = [trial["cpu_seconds"][-1] / trial["steps"][-1] for trial in trials]
        yield (
            case,
            title_of(study, variant),
            f"{np.isfinite(steps).sum()} of {steps.size}",
            interval(estimate_median(steps), 0),
            f"{1000 * np.median(spent):.3g} ms",
            interval(estimate_median(seconds), 1) + " s",
            _times(float(np.median(seconds) / ours)),
        )


def until_solved_table(study: Study, found: Curves) -> str:
    """Medians over seeds, with bootstrap intervals; a seed that never solves counts as never."""
    header = (
        "task", "agent", "seeds that solve it", "steps until then", "a step", "processor time",
        "of SDNN-C's",
    )  # fmt: skip
    return markdown(header, _solved_rows(study, found))
