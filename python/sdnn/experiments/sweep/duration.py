"""How long trials will take: from the stored ones that are most like them, else from a probe."""

from __future__ import annotations

import math
import time
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

from sdnn.experiments.config import TrialSettings
from sdnn.experiments.records import TrialKey, TrialTime

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

    Parameters
    ----------
    times
        Of stored trials.
    """

    def __init__(self, times: Iterable[TrialTime]) -> None:
        self._times = tuple(t for t in times if t.n_episodes)
        self._probes: dict[tuple[str, str], _Probe] = {}

    def of_trial(self, key: TrialKey, config: TrialSettings) -> Duration:
        """Estimate the time of a trial.

        Trials of the same configuration count first, then those of the same case and agent. Else a
        trial is begun: if all its episodes were as short as the first ones, which are easy, that is
        the least; if all were as long as allowed, the most.

        Parameters
        ----------
        key
            Which trial; its number does not matter.
        config
            Its settings.
        """
        n_episodes = config.protocol.n_learning_episodes
        alike = [t for t in self._times if t.key[:2] == key[:2]]
        same = [t for t in alike if t.key.config_hash == key.config_hash]
        for found, words in ((same, "this configuration"), (alike, "this case and agent")):
            if found:
                seconds = n_episodes * _seconds_per_episode(found)
                counted = f"{len(found)} stored trial{'s' if len(found) > 1 else ''}"
                return Duration(seconds, seconds, f"{counted} of {words}")
        pair = (key.case_id, key.agent)
        if pair not in self._probes:
            self._probes[pair] = _probe(config, key.seed)
        return self._probes[pair].of_trial(config)


@dataclass(frozen=True)
class _Probe:
    n_episodes: int
    n_decisions: int
    seconds: float
    max_decisions: int | None
    n_whole: int

    def of_trial(self, config: TrialSettings) -> Duration:
        n_episodes = config.protocol.n_learning_episodes
        lower = n_episodes * self.seconds / self.n_episodes
        if self.n_episodes == self.n_whole:
            return Duration(lower, lower, "a whole trial as a probe")
        n_tests = n_episodes // config.protocol.test_interval
        longest = math.inf if self.max_decisions is None else self.max_decisions
        return Duration(
            lower,
            (n_episodes + n_tests) * longest * self.seconds / self.n_decisions,
            f"a probe: episodes as short as the first {self.n_episodes}, to as long as allowed",
        )


def _seconds_per_episode(times: Sequence[TrialTime]) -> float:
    return sum(t.seconds for t in times) / sum(t.n_episodes for t in times)


def _probe(config: TrialSettings, seed: int) -> _Probe:
    trial = config.make_trial(seed)
    begin = time.thread_time()
    seconds = 0.0
    while seconds < PROBE_SECONDS and not trial.finished:
        trial.advance(config.protocol.test_interval)
        seconds = time.thread_time() - begin
    return _Probe(
        n_episodes=int(trial.episode),
        n_decisions=int(trial.n_decisions),
        seconds=seconds,
        max_decisions=config.max_decisions,
        n_whole=config.protocol.n_learning_episodes,
    )


def wall_seconds(trials: Iterable[tuple[Duration, bool]], jobs: int) -> tuple[float, float]:
    """Estimate the time that passes while trials run, least and most.

    Parameters
    ----------
    trials
        Processor time of each, and whether it is compiled. Others share one core however many jobs
        there are: they hold Python's lock.
    jobs
        Trials at the same time.
    """
    lower, upper, lower_locked, upper_locked = 0.0, 0.0, 0.0, 0.0
    for duration, is_compiled in trials:
        lower += duration.lower
        upper += duration.upper
        if not is_compiled:
            lower_locked += duration.lower
            upper_locked += duration.upper
    return max(lower / jobs, lower_locked), max(upper / jobs, upper_locked)
