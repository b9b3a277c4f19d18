"""What a study still needs, and how long that takes: the body of ``sdnn sweep --dry-run``."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from sdnn.machine import n_cores
from sdnn.runs.comparison import Combination
from sdnn.runs.errors import RunError
from sdnn.runs.records import TrialKey, TrialTime
from sdnn.runs.report import duration_words
from sdnn.runs.store import STORE_NAME, ResultStore
from sdnn.runs.sweep import SweepRequest
from sdnn.runs.trial import opened
from sdnn.runs.trial_config import TrialSettings, describe

PROBE_SECONDS = 0.3
"""Processor time of a probe, about."""


@dataclass(frozen=True)
class Duration:
    """Least and most seconds, infinite where nothing limits an episode, and their source."""

    lower: float
    upper: float
    source: str = ""


@dataclass(frozen=True)
class Forecast:
    """What a request needs.

    Parameters
    ----------
    works
        Every variant and case that was asked for: its trials, those of them that are stored, and
        processor time of one trial; None if nothing is to be run.
    n_planned, n_stored
        Trials in all; variants that are the same share theirs.
    jobs
        Trials at the same time; 1 on a cluster, whose size is not known.
    wall
        The time that will pass.
    """

    works: tuple[tuple[Combination, int, int, Duration | None], ...]
    n_planned: int
    n_stored: int
    jobs: int
    wall: Duration

    def lines(self, out: Path) -> Iterator[str]:
        """Write it for a reader; `out` is the folder of the result file."""
        for combination, n_planned, n_stored, duration in self.works:
            config = combination.config
            text = (
                f"{combination.case.id} {combination.variant.id}: {n_planned} trials x"
                f" {config.protocol.n_learning_episodes} episodes of {config.agent}, {n_stored} of"
                f" them stored in {out}"
            )
            if duration is not None:
                text += f"; a trial takes {_span(duration)} (by {duration.source})"
            yield text
        yield (
            f"in all {self.n_planned} trials, {self.n_stored} of them stored; the rest takes"
            f" {_span(self.wall)} with {self.jobs} at the same time"
        )

    def to_json(self) -> dict[str, Any]:
        """Return it as values that JSON can hold; times in seconds, null where unlimited."""
        return {
            "trials": [
                {
                    "case": combination.case.id,
                    "variant": combination.variant.id,
                    "agent": combination.config.agent,
                    "n_learning_episodes": combination.config.protocol.n_learning_episodes,
                    "config_hash": combination.config.config_hash,
                    "planned": n_planned,
                    "stored": n_stored,
                    "seconds_of_a_trial": None
                    if duration is None
                    else {**_span_json(duration), "source": duration.source},
                }
                for combination, n_planned, n_stored, duration in self.works
            ],
            "planned": self.n_planned,
            "stored": self.n_stored,
            "jobs": self.jobs,
            "seconds": _span_json(self.wall),
        }


def forecast(request: SweepRequest) -> Forecast:
    """Count what is to be run and estimate how long it takes, without making any file.

    Raises
    ------
    StudyError
        If the core refuses a configuration.
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
    works = []
    found: dict[tuple[str, str], Duration] = {}
    for (case_id, variant_id), combination in study.combinations.items():
        if not request.only or variant_id in request.only:
            keys = study.keys(case_id, variant_id)
            n_stored = sum(key in stored for key in keys)
            duration = None
            if n_stored < len(keys):
                duration = durations.of_trial(keys[0], combination.config)
                found[case_id, keys[0].config_hash] = duration
            works.append((combination, len(keys), n_stored, duration))
    missing = [planned for planned in plan if planned.key not in stored]
    jobs = n_cores() if request.jobs is None else request.jobs
    if request.executor is not None:
        jobs = 1
    wall = wall_time(
        ((found[one.key.case_id, one.key.config_hash], one.config.is_compiled) for one in missing),
        jobs,
    )
    return Forecast(tuple(works), len(plan), len(plan) - len(missing), jobs, wall)


class Durations:
    """Estimates the processor time of trials.

    Trials of the same configuration count first, then those of the same case and agent. If there
    are none, a trial is begun. Shorter ones give a range, since later episodes are longer where the
    task gets harder or is lost: at least, all episodes are as short as theirs; at most, as long as
    allowed.

    Parameters
    ----------
    times
        Of stored trials.
    """

    def __init__(self, times: Iterable[TrialTime]) -> None:
        self._times = tuple(t for t in times if t.n_episodes and t.n_decisions)
        self._probes: dict[tuple[str, str], TrialTime] = {}

    def of_trial(self, key: TrialKey, config: TrialSettings) -> Duration:
        """Estimate the time of a trial; an `RunError` if a probe fails."""
        alike = [t for t in self._times if t.key[:2] == key[:2]]
        same = [t for t in alike if t.key.config_hash == key.config_hash]
        if not alike:
            if key[:2] not in self._probes:
                self._probes[key[:2]] = _probe(key, config)
            return _duration([self._probes[key[:2]]], config, "a probe")
        found = same or alike
        chosen = [t for t in found if t.n_episodes >= _last_test(config)] or found
        words = "this configuration" if same else "this case and agent"
        plural = "s" if len(chosen) > 1 else ""
        return _duration(chosen, config, f"{len(chosen)} stored trial{plural} of {words}")


def _last_test(config: TrialSettings) -> int:
    protocol = config.protocol
    return protocol.n_learning_episodes // protocol.test_interval * protocol.test_interval


def _duration(times: list[TrialTime], config: TrialSettings, source: str) -> Duration:
    n_episodes = config.protocol.n_learning_episodes
    seconds = sum(t.seconds for t in times)
    lower = n_episodes * seconds / sum(t.n_episodes for t in times)
    shortest = min(t.n_episodes for t in times)
    if shortest >= _last_test(config):
        return Duration(lower, lower, source)
    upper = math.inf
    if config.max_decisions is not None:
        n_tests = n_episodes // config.protocol.test_interval
        of_decision = seconds / sum(t.n_decisions for t in times)
        upper = (n_episodes + n_tests) * config.max_decisions * of_decision
    return Duration(
        lower, upper, f"{source}: episodes as short as the first {shortest}, to as long as allowed"
    )


def _probe(key: TrialKey, config: TrialSettings) -> TrialTime:
    """Run the start of a trial."""
    try:
        with opened(config.make_trial(key.seed)) as trial:
            begin = time.thread_time()
            seconds = 0.0
            while seconds < PROBE_SECONDS and not trial.finished:
                trial.advance(config.protocol.test_interval)
                seconds = time.thread_time() - begin
            n_episodes, n_decisions = int(trial.episode), int(trial.n_decisions)
    except Exception as error:  # whatever a trial raises
        message = f"{type(error).__name__}: {error}"
        raise RunError(f"{describe(key)} fails: {message}") from error
    return TrialTime(key=key, seconds=seconds, n_episodes=n_episodes, n_decisions=n_decisions)


def wall_time(trials: Iterable[tuple[Duration, bool]], jobs: int) -> Duration:
    """Estimate the time that passes while trials run.

    Parameters
    ----------
    trials
        Processor time of each, and whether it is compiled. Others share one core however many jobs
        there are: they hold Python's lock.
    jobs
        Trials at the same time; no more than there are cores are any help.
    """
    found = list(trials)
    n_parallel = max(1, min(jobs, n_cores()))

    def seconds(end: str) -> float:
        times = [float(getattr(duration, end)) for duration, _ in found]
        locked = [t for t, (_, is_compiled) in zip(times, found, strict=True) if not is_compiled]
        return max(sum(times) / n_parallel, max(times, default=0.0), sum(locked))

    return Duration(seconds("lower"), seconds("upper"))


def _span(duration: Duration) -> str:
    first, last = _words(duration.lower), _words(duration.upper)
    if math.isinf(duration.upper):
        return f"{first} or more"
    return f"about {first}" if first == last else f"{first} to {last}"


def _words(seconds: float) -> str:
    if math.isinf(seconds):
        return ""
    return duration_words(seconds) if seconds >= 10 else f"{seconds:.2g} s"


def _span_json(duration: Duration) -> dict[str, float | None]:
    upper = duration.upper
    return {"lower": duration.lower, "upper": upper if math.isfinite(upper) else None}
