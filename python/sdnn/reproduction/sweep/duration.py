"""How long trials will take: from the stored ones that are most like them, else from a probe."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass

from sdnn.machine import n_cores
from sdnn.runs.progress import describe
from sdnn.runs.records import TrialKey, TrialTime
from sdnn.runs.trial import opened
from sdnn.runs.trial_config import TrialSettings
from sdnn.runs.trial_errors import ExperimentError

PROBE_SECONDS = 0.3
"""Processor time of a probe, about."""


@dataclass(frozen=True)
class Duration:
    """Processor time of something.

    Parameters
    ----------
    lower, upper
        Seconds; infinite where nothing limits an episode.
    source
        What they are derived from, for a reader.
    """

    lower: float
    upper: float
    source: str


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
        """Estimate the time of a trial.

        Parameters
        ----------
        key
            Which trial; its number does not matter.
        config
            Its settings.

        Raises
        ------
        ExperimentError
            If a probe fails, as the trial would.
        """
        alike = [t for t in self._times if t.key[:2] == key[:2]]
        same = [t for t in alike if t.key.config_hash == key.config_hash]
        for found, words in ((same, "this configuration"), (alike, "this case and agent")):
            if found:
                chosen = [t for t in found if t.n_episodes >= _last_test(config)] or found
                counted = f"{len(chosen)} stored trial{'s' if len(chosen) > 1 else ''}"
                return _duration(chosen, config, f"{counted} of {words}")
        pair = (key.case_id, key.agent)
        if pair not in self._probes:
            try:
                self._probes[pair] = _probe(key, config)
            except Exception as error:  # whatever a trial raises
                message = f"{type(error).__name__}: {error}"
                raise ExperimentError(f"{describe(key)} fails: {message}") from error
        return _duration([self._probes[pair]], config, "a probe")


def _last_test(config: TrialSettings) -> int:
    protocol = config.protocol
    return protocol.n_learning_episodes // protocol.test_interval * protocol.test_interval


def _duration(times: Sequence[TrialTime], config: TrialSettings, source: str) -> Duration:
    n_episodes = config.protocol.n_learning_episodes
    seconds = sum(t.seconds for t in times)
    lower = n_episodes * seconds / sum(t.n_episodes for t in times)
    shortest = min(t.n_episodes for t in times)
    if shortest >= _last_test(config):
        return Duration(lower, lower, source)
    n_tests = n_episodes // config.protocol.test_interval
    longest = config.max_decisions
    of_decision = seconds / sum(t.n_decisions for t in times)
    upper = math.inf if longest is None else (n_episodes + n_tests) * longest * of_decision
    return Duration(
        lower, upper, f"{source}: episodes as short as the first {shortest}, to as long as allowed"
    )


def _probe(key: TrialKey, config: TrialSettings) -> TrialTime:
    """Run the start of a trial."""
    with opened(config.make_trial(key.seed)) as trial:
        begin = time.thread_time()
        seconds = 0.0
        while seconds < PROBE_SECONDS and not trial.finished:
            trial.advance(config.protocol.test_interval)
            seconds = time.thread_time() - begin
    return TrialTime(
        key=key,
        seconds=seconds,
        n_episodes=int(trial.episode),
        n_decisions=int(trial.n_decisions),
    )


def wall_seconds(trials: Iterable[tuple[Duration, bool]], jobs: int) -> tuple[float, float]:
    """Estimate the time that passes while trials run, least and most.

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

    def seconds(of_one: Callable[[Duration], float]) -> float:
        times = [of_one(duration) for duration, _ in found]
        locked = [of_one(duration) for duration, is_compiled in found if not is_compiled]
        return max(sum(times) / n_parallel, max(times, default=0.0), sum(locked))

    return seconds(lambda one: one.lower), seconds(lambda one: one.upper)
