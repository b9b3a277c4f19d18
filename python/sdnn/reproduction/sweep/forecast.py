"""What a study needs, and how long that takes: the body of ``sdnn sweep --dry-run``."""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sdnn import machine
from sdnn.reproduction.page import duration_words
from sdnn.reproduction.sweep.duration import Duration, Durations, wall_seconds
from sdnn.reproduction.sweep.run import SweepRequest
from sdnn.reproduction.sweep.study import Combination
from sdnn.runs.records import TrialKey
from sdnn.runs.store import STORE_NAME, ResultStore


@dataclass(frozen=True)
class PlannedWork:
    """What a variant in a case needs.

    Parameters
    ----------
    combination
        Which.
    n_planned, n_stored
        Its trials.
    of_trial
        Processor time of one of them; none if nothing is to be run.
    """

    combination: Combination
    n_planned: int
    n_stored: int
    of_trial: Duration | None


@dataclass(frozen=True)
class Forecast:
    """What a request needs.

    Parameters
    ----------
    works
        Of every variant and case that was asked for.
    n_planned, n_stored
        Trials in all; variants that are the same share theirs.
    jobs
        Trials at the same time; 1 on a cluster, whose size is not known.
    lower, upper
        Seconds that will pass, least and most.
    """

    works: tuple[PlannedWork, ...]
    n_planned: int
    n_stored: int
    jobs: int
    lower: float
    upper: float


def forecast(request: SweepRequest) -> Forecast:
    """Count what is to be run and estimate how long it takes, without making any file.

    Raises
    ------
    StudyError
        If the file says something unknown or impossible, or the core refuses a configuration.
    ValueError
        If there is no variant of that name.
    StoreError
        If the result file cannot be used.
    ExperimentError
        If a trial that is begun to see how long it takes fails.
    """
    study = request.study
    plan = request.plan
    stored: set[TrialKey] = set()
    durations = Durations(())
    if (request.out / STORE_NAME).exists() or request.out.is_file():
        with ResultStore(request.out, read_only=True) as store:
            stored = store.keys()
            durations = Durations(store.times())
    study.check(stored)
    missing = {planned.key: planned.config for planned in plan if planned.key not in stored}
    works = []
    by_hash: dict[tuple[str, str], Duration] = {}
    for (case_id, variant_id), combination in study.combinations.items():
        if request.only and variant_id not in request.only:
            continue
        keys = study.keys(case_id, variant_id)
        n_stored = sum(key in stored for key in keys)
        one: Duration | None = None
        if n_stored < len(keys):
            one = durations.of_trial(keys[0], combination.config)
            by_hash[case_id, keys[0].config_hash] = one
        works.append(PlannedWork(combination, len(keys), n_stored, one))
    jobs = machine.n_cores() if request.jobs is None else request.jobs
    if request.executor is not None:
        jobs = 1
    lower, upper = wall_seconds(
        (
            (by_hash[key.case_id, key.config_hash], config.is_compiled)
            for key, config in missing.items()
        ),
        jobs,
    )
    return Forecast(tuple(works), len(plan), len(plan) - len(missing), jobs, lower, upper)


def forecast_lines(found: Forecast, out: Path) -> Iterator[str]:
    """Write a forecast for a reader.

    Parameters
    ----------
    found
        The forecast.
    out
        Folder of the result file.
    """
    for work in found.works:
        case, variant = work.combination.case.id, work.combination.variant.id
        config = work.combination.config
        text = (
            f"{case} {variant}: {work.n_planned} trials x {config.protocol.n_learning_episodes}"
            f" episodes of {config.agent}, {work.n_stored} of them stored in {out}"
        )
        if work.of_trial is not None:
            text += f"; a trial takes {_span(work.of_trial.lower, work.of_trial.upper)}"
            text += f" (by {work.of_trial.source})"
        yield text
    yield (
        f"in all {found.n_planned} trials, {found.n_stored} of them stored; the rest takes"
        f" {_span(found.lower, found.upper)} with {found.jobs} at the same time"
    )


def forecast_json(found: Forecast) -> dict[str, Any]:
    """Return a forecast as values that JSON can hold; times in seconds, null where unlimited."""
    return {
        "trials": [
            {
                "case": work.combination.case.id,
                "variant": work.combination.variant.id,
                "agent": work.combination.config.agent,
                "n_learning_episodes": work.combination.config.protocol.n_learning_episodes,
                "config_hash": work.combination.config.config_hash,
                "planned": work.n_planned,
                "stored": work.n_stored,
                "seconds_of_a_trial": None
                if work.of_trial is None
                else {
                    "lower": work.of_trial.lower,
                    "upper": _finite(work.of_trial.upper),
                    "source": work.of_trial.source,
                },
            }
            for work in found.works
        ],
        "planned": found.n_planned,
        "stored": found.n_stored,
        "jobs": found.jobs,
        "seconds": {"lower": found.lower, "upper": _finite(found.upper)},
    }


def _finite(seconds: float) -> float | None:
    return seconds if math.isfinite(seconds) else None


def _span(lower: float, upper: float) -> str:
    first, last = _words(lower), _words(upper)
    if math.isinf(upper):
        return f"{first} or more"
    return f"about {first}" if first == last else f"{first} to {last}"


def _words(seconds: float) -> str:
    if math.isinf(seconds):
        return ""
    return duration_words(seconds) if seconds >= 10 else f"{seconds:.2g} s"
