"""What a study still needs, and how long that takes: the body of ``sdnn sweep --dry-run``."""

from __future__ import annotations

import time
from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

from sdnn.machine import n_cores
from sdnn.runs.engine import describe
from sdnn.runs.errors import RunError
from sdnn.runs.report import duration_words
from sdnn.runs.spec import RunSpec
from sdnn.runs.store import STORE_NAME, ResultStore
from sdnn.runs.sweep import SweepRequest
from sdnn.runs.trial import TrialKey, TrialTime, opened

PROBE_SECONDS = 0.3  # processor time of a probe, about


def forecast(request: SweepRequest) -> dict[str, Any]:
    """Count what is to be run and estimate how long it takes, without making any file.

    Returns values that JSON can hold. The ``upper`` seconds are null where trials are longer than
    those that the estimate is from: later episodes are longer where the task gets harder.

    Raises
    ------
    ConfigError
        If a specification is refused.
    ValueError
        If there is no variant of that name.
    StoreError
        If the result file cannot be used.
    RunError
        If a trial that is begun to see how long it takes fails.
    """
    study, plan = request.study, request.plan
    stored: set[TrialKey] = set()
    times: tuple[TrialTime, ...] = ()
    if (request.out / STORE_NAME).exists() or request.out.is_file():
        with ResultStore(request.out, read_only=True) as store:
            stored, times = store.keys(), store.times()
    study.check(stored)
    durations = Durations(times)
    # The size of a cluster is not known.
    jobs = 1 if request.executor is not None else request.jobs or n_cores()
    works = []
    seconds: dict[tuple[str, str], dict[str, Any]] = {}
    for (case, variant), combination in study.combinations.items():
        if request.only and variant not in request.only:
            continue
        keys, spec = study.keys(case, variant), combination.spec
        n_stored = sum(key in stored for key in keys)
        if n_stored < len(keys):
            seconds[case, spec.config_hash] = durations.of_trial(keys[0], spec)
        works.append(
            {
                "case": case,
                "variant": variant,
                "agent": spec.label,
                "steps": spec.budget.steps,
                "episodes": spec.budget.episodes,
                "config_hash": spec.config_hash,
                "planned": len(keys),
                "stored": n_stored,
                "seconds_of_a_trial": seconds.get((case, spec.config_hash)),
            }
        )
    missing = [planned for planned in plan if planned.key not in stored]
    found = [seconds[one.key.case_id, one.key.config_hash] for one in missing]
    lower = wall_seconds(
        [(one["lower"], p.spec.is_compiled) for one, p in zip(found, missing, strict=True)], jobs
    )
    upper = None if any(one["upper"] is None for one in found) else lower
    return {
        "trials": works,
        "planned": len(plan),
        "stored": len(plan) - len(missing),
        "jobs": jobs,
        "seconds": {"lower": lower, "upper": upper},
    }


def forecast_lines(found: dict[str, Any], out: Path) -> Iterator[str]:
    """Write a forecast for a reader; `out` is the folder of the result file."""
    for one in found["trials"]:
        text = (
            f"{one['case']} {one['variant']}: {one['planned']} trials x"
            f" {one['episodes'] or one['steps']} {'episodes' if one['episodes'] else 'steps'} of"
            f" {one['agent']}, {one['stored']} of them stored in {out}"
        )
        if seconds := one["seconds_of_a_trial"]:
            text += f"; a trial takes {_words(seconds)} (by {seconds['source']})"
        yield text
    yield (
        f"in all {found['planned']} trials, {found['stored']} of them stored; the rest takes"
        f" {_words(found['seconds'])} with {found['jobs']} at the same time"
    )


def _words(seconds: dict[str, Any]) -> str:
    lower = seconds["lower"]
    text = duration_words(lower) if lower >= 10 else f"{lower:.2g} s"
    return f"{text} or more" if seconds["upper"] is None else f"about {text}"


class Durations:
    """Estimates the processor time of trials from those of stored ones.

    Trials of the same configuration count first, then those of the same case and agent, of these
    the ones that are long enough. If there are none, a trial is begun.
    """

    def __init__(self, times: Iterable[TrialTime]) -> None:
        self._times = [one for one in times if one.n_episodes]
        self._probes: dict[tuple[str, str], TrialTime] = {}

    def of_trial(self, key: TrialKey, spec: RunSpec) -> dict[str, Any]:
        """Estimate the time of a trial; a `RunError` if a probe fails."""
        every = spec.protocol.evaluate_every_episodes or 1
        last_test = (spec.budget.episodes or 0) // every * every
        alike = [t for t in self._times if t.key[:2] == key[:2]]
        same = [t for t in alike if t.key.config_hash == key.config_hash]
        found = same or alike
        found = [t for t in found if t.n_episodes >= last_test] or found
        words = "this configuration" if same else "this case and agent"
        source = f"{len(found)} stored trial{'s' if len(found) > 1 else ''} of {words}"
        if not found:
            if key[:2] not in self._probes:
                self._probes[key[:2]] = _probe(key, spec)
            found, source = [self._probes[key[:2]]], "a probe"
        in_steps = spec.budget.steps is not None
        amount = sum(t.n_decisions if in_steps else t.n_episodes for t in found)
        seconds = sum(t.seconds for t in found) / amount * spec.length
        shortest = min(t.n_episodes for t in found)
        if shortest < last_test:
            source += f": as in the first {shortest} episodes"
        upper = seconds if shortest >= last_test else None
        return {"lower": seconds, "upper": upper, "source": source}


def _probe(key: TrialKey, spec: RunSpec) -> TrialTime:
    """Run the start of a trial."""
    try:
        with opened(spec.make_trial(key.seed)) as trial:
            begin = time.thread_time()
            seconds = 0.0
            while seconds < PROBE_SECONDS and not trial.finished:
                trial.advance(spec.protocol.evaluate_every_episodes or 1)
                seconds = time.thread_time() - begin
            n_episodes, n_decisions = int(trial.episode), int(trial.n_decisions)
    except Exception as error:  # whatever a trial raises
        raise RunError(f"{describe(key)} fails: {type(error).__name__}: {error}") from error
    return TrialTime(key=key, seconds=seconds, n_episodes=n_episodes, n_decisions=n_decisions)


def wall_seconds(trials: list[tuple[float, bool]], jobs: int) -> float:
    """Estimate the time that passes while trials run, from processor times and who is compiled.

    Those that are not share one core however many jobs there are, because they hold Python's lock;
    no more jobs than cores are any help.
    """
    times = [seconds for seconds, _ in trials]
    locked = [seconds for seconds, is_compiled in trials if not is_compiled]
    return max(sum(times) / max(1, min(jobs, n_cores())), max(times, default=0.0), sum(locked, 0.0))
