"""Runs the trials that a store does not hold yet, several at once.

A trial releases Python's lock while it advances, so threads scale over the cores. Worker threads
compute and send messages; the calling thread alone writes the store and tells the observer.
"""

from __future__ import annotations

import signal
import threading
import time
from collections.abc import Iterable, Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from datetime import datetime, timezone
from queue import Empty, SimpleQueue
from types import FrameType

from sdnn import _core
from sdnn.experiments.config import PlannedTrial
from sdnn.experiments.records import TrialKey, TrialRecord, TrialRows
from sdnn.experiments.store import ResultStore
from sdnn.machine import n_cores

CHUNK_SECONDS = 0.1
"""A trial reports about this often; it is also how long an interruption waits."""

POLL_SECONDS = 0.1
"""How often the calling thread looks up while no message comes."""


@dataclass(frozen=True)
class Failure:
    """A trial that raised.

    Parameters
    ----------
    key
        Which trial it was.
    error
        What it raised.
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
        Trials that raised.
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

    def finished(self, planned: PlannedTrial) -> None:
        """Note that a trial is stored."""

    def failed(self, planned: PlannedTrial, error: Exception) -> None:
        """Note that a trial raised."""

    def costs_begun(self, n_missing: int) -> None:
        """Note that the measurement of costs begins, with `n_missing` of them before it."""

    def cost_measured(self, description: str) -> None:
        """Note that a cost is measured, and of what."""


@dataclass(frozen=True)
class _Started:
    planned: PlannedTrial


@dataclass(frozen=True)
class _Advanced:
    planned: PlannedTrial
    episode: int


@dataclass(frozen=True)
class _Finished:
    planned: PlannedTrial
    record: TrialRecord


@dataclass(frozen=True)
class _Failed:
    planned: PlannedTrial
    error: Exception


@dataclass(frozen=True)
class _Abandoned:
    planned: PlannedTrial


_Message = _Started | _Advanced | _Finished | _Failed | _Abandoned


def run_trials(
    plan: Iterable[PlannedTrial],
    store: ResultStore,
    *,
    jobs: int | None = None,
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
    jobs
        Trials at the same time; default one for each core.
    observer
        Told what happens.

    Raises
    ------
    ValueError
        If `jobs` is less than 1.
    StoreError
        If the store cannot be read or written; running trials are given up.
    """
    n_jobs = n_cores() if jobs is None else jobs
    if n_jobs < 1:
        raise ValueError(f"jobs must be at least 1, got {n_jobs}")
    watcher = Observer() if observer is None else observer
    planned = tuple(plan)
    stored = store.keys()
    missing = tuple(p for p in planned if p.key not in stored)
    n_episodes = sum(p.config.protocol.n_learning_episodes for p in missing)
    watcher.begun(len(planned), len(planned) - len(missing), n_episodes)
    messages: SimpleQueue[_Message] = SimpleQueue()
    stop = threading.Event()
    failures: list[Failure] = []
    n_run = 0
    with (
        _stop_on_interrupt(stop),
        ThreadPoolExecutor(n_jobs, thread_name_prefix="trial") as pool,
        _set_at_exit(stop),
    ):
        for item in missing:
            pool.submit(_run_one, item, messages, stop)
        # Every submitted trial sends one last message, also after a stop.
        n_open = len(missing)
        while n_open:
            try:
                message = messages.get(timeout=POLL_SECONDS)
            except Empty:
                continue
            n_open -= not isinstance(message, _Started | _Advanced)
            if isinstance(message, _Started):
                watcher.started(message.planned)
            elif isinstance(message, _Advanced):
                watcher.advanced(message.planned, message.episode)
            elif isinstance(message, _Finished):
                store.add(message.record)
                n_run += 1
                watcher.finished(message.planned)
            elif isinstance(message, _Failed):
                failures.append(Failure(message.planned.key, message.error))
                watcher.failed(message.planned, message.error)
        interrupted = stop.is_set()
    return RunOutcome(
        n_planned=len(planned),
        n_reused=len(planned) - len(missing),
        n_run=n_run,
        failures=tuple(failures),
        interrupted=interrupted,
    )


def _run_one(planned: PlannedTrial, messages: SimpleQueue[_Message], stop: threading.Event) -> None:
    """Advance one trial to its end; runs in a worker thread."""
    if stop.is_set():
        messages.put(_Abandoned(planned))
        return
    try:
        messages.put(_Started(planned))
        begin = time.thread_time()
        trial = planned.config.make_trial(planned.key.seed)
        chunk = 1
        while not trial.finished:
            if stop.is_set():
                messages.put(_Abandoned(planned))
                return
            chunk_begin = time.monotonic()
            trial.advance(chunk)
            chunk = _next_chunk(chunk, time.monotonic() - chunk_begin)
            messages.put(_Advanced(planned, int(trial.episode)))
        record = TrialRecord(
            key=planned.key,
            config=planned.config.canonical_json(),
            version=_core.__version__,
            n_decisions=int(trial.n_decisions),
            seconds=time.thread_time() - begin,
            finished_at=datetime.now(timezone.utc).isoformat(timespec="seconds"),
            rows=TrialRows.from_arrays(trial.test_rows()),
        )
    except Exception as error:
        messages.put(_Failed(planned, error))
    else:
        messages.put(_Finished(planned, record))


def _next_chunk(chunk: int, seconds: float) -> int:
    """Episodes of the next chunk, so that it lasts about `CHUNK_SECONDS`."""
    if seconds < CHUNK_SECONDS / 2:
        return 2 * chunk
    if seconds > 2 * CHUNK_SECONDS:
        return max(1, chunk // 2)
    return chunk


@contextmanager
def _set_at_exit(event: threading.Event) -> Iterator[None]:
    """Let an error in the calling thread stop the workers before the pool waits for them."""
    try:
        yield
    except BaseException:
        event.set()
        raise


@contextmanager
def _stop_on_interrupt(stop: threading.Event) -> Iterator[None]:
    """Set `stop` on the first Ctrl-C; a second one raises KeyboardInterrupt.

    An exception at any instruction could lose a result between queue and store; a flag cannot.
    Only the main thread may do this; elsewhere Ctrl-C is the caller's affair.
    """
    if threading.current_thread() is not threading.main_thread():
        yield
        return

    def handle(_signal: int, _frame: FrameType | None) -> None:
        if stop.is_set():
            raise KeyboardInterrupt
        stop.set()

    previous = signal.signal(signal.SIGINT, handle)
    try:
        yield
    finally:
        signal.signal(signal.SIGINT, previous)
