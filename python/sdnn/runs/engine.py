"""Runs the trials that a store does not hold yet.

Where they run is an executor's affair: threads of this process, or a cluster. The calling thread
alone writes the store and tells the observer. What is stored is the truth: whatever else happens to
a trial, it is missing until it is in the store.
"""

from __future__ import annotations

import threading
from collections.abc import Iterable
from contextlib import closing
from dataclasses import dataclass

from sdnn.interrupts import Interrupts
from sdnn.runs.executor import (
    Advanced,
    Executor,
    Failed,
    Finished,
    Lost,
    Noted,
    Started,
    ThreadExecutor,
)
from sdnn.runs.planned_trial import PlannedTrial
from sdnn.runs.records import TrialKey
from sdnn.runs.store import ResultStore


@dataclass(frozen=True)
class Failure:
    """A trial that raised, or was lost too often.

    Parameters
    ----------
    key
        Which trial it was.
    error
        What it raised, or how it was lost.
    """

    key: TrialKey
    error: Exception


@dataclass(frozen=True, kw_only=True)
class RunOutcome:
    """What became of a run.

    Parameters
    ----------
    n_planned
        Trials the run needs.
    n_reused
        Trials that were stored before.
    n_run
        Trials finished and stored now.
    failures
        Trials that raised, or were lost too often.
    interrupted
        Whether the run was stopped before its end.
    """

    n_planned: int
    n_reused: int
    n_run: int
    failures: tuple[Failure, ...]
    interrupted: bool


class Observer:
    """Told about a run, from the thread that runs it. This one ignores everything."""

    def begun(self, n_planned: int, n_reused: int, n_episodes: int) -> None:
        """Note that the run begins, with `n_episodes` learning episodes before it."""

    def started(self, planned: PlannedTrial) -> None:
        """Note that a trial starts."""

    def advanced(self, planned: PlannedTrial, episode: int) -> None:
        """Note how many learning episodes a trial has done."""

    def lost(self, planned: PlannedTrial) -> None:
        """Note that a trial was lost with its worker; it starts again later, or fails."""

    def finished(self, planned: PlannedTrial) -> None:
        """Note that a trial is stored."""

    def failed(self, planned: PlannedTrial, error: Exception) -> None:
        """Note that a trial raised, or was lost too often."""

    def noted(self, text: str) -> None:
        """Pass on what a person should know, such as a worker that was refused."""

    def costs_begun(self, n_missing: int) -> None:
        """Note that the measurement of costs begins, with `n_missing` of them before it."""

    def cost_measured(self, description: str) -> None:
        """Note that a cost is measured, and of what."""


def run_trials(
    plan: Iterable[PlannedTrial],
    store: ResultStore,
    *,
    executor: Executor | None = None,
    jobs: int | None = None,
    stop: threading.Event | None = None,
    observer: Observer | None = None,
) -> RunOutcome:
    """Run the planned trials that are not stored, and store each as soon as it is finished.

    Ctrl-C ends the run after the chunks under way; finished trials are stored before it returns.
    A trial that raises does not stop the others.

    Parameters
    ----------
    plan
        Trials the run needs.
    store
        Where they go.
    executor
        Where they run; default threads of this process.
    jobs
        Threads of the default executor; default one for each core.
    stop
        Set by Ctrl-C; whoever sets it ends the run, too.
    observer
        Told what happens.

    Raises
    ------
    ValueError
        If `jobs` is less than 1, or is given beside an executor.
    StoreError
        If the store cannot be read or written; running trials are given up.
    RunError
        If the executor can run no trial any more; what was finished is stored.
    """
    if executor is None:
        executor = ThreadExecutor(jobs)
    elif jobs is not None:
        raise ValueError(f"jobs must be left out where an executor is given, got {jobs}")
    watcher = Observer() if observer is None else observer
    planned = tuple(plan)
    stored = store.keys()
    missing = tuple(p for p in planned if p.key not in stored)
    n_episodes = sum(p.spec.length for p in missing)
    watcher.begun(len(planned), len(planned) - len(missing), n_episodes)
    stop = threading.Event() if stop is None else stop
    failures: list[Failure] = []
    n_run = 0
    if missing:
        # An exception at any instruction could lose a result between queue and store.
        with Interrupts(stop.set), closing(executor.run(missing, stop)) as messages:
            for message in messages:
                match message:
                    case Started(trial):
                        watcher.started(trial)
                    case Advanced(trial, episode):
                        watcher.advanced(trial, episode)
                    case Lost(trial):
                        watcher.lost(trial)
                    case Finished(trial, record):
                        store.add(record, is_exact=trial.spec.is_compiled)
                        n_run += 1
                        watcher.finished(trial)
                    case Failed(trial, error):
                        failures.append(Failure(trial.key, error))
                        watcher.failed(trial, error)
                    case Noted(text):
                        watcher.noted(text)
    return RunOutcome(
        n_planned=len(planned),
        n_reused=len(planned) - len(missing),
        n_run=n_run,
        failures=tuple(failures),
        interrupted=stop.is_set(),
    )
