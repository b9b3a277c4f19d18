"""Where trials are run: what the engine needs of an executor, and those of this process.

An executor runs trials and tells about them; it knows no store. The engine stores a finished trial
before it takes the next message, so what an executor has not reported as finished is not stored.
A trial in C++ releases Python's lock while it advances, so threads scale over the cores.
"""

from __future__ import annotations

import threading
import time
from collections.abc import Callable, Generator, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import closing, contextmanager
from dataclasses import dataclass
from datetime import datetime, timezone
from queue import Empty, SimpleQueue
from typing import Protocol

from sdnn import _core
from sdnn.machine import n_cores
from sdnn.runs.planned_trial import PlannedTrial
from sdnn.runs.records import TrialRecord, TrialRows
from sdnn.runs.trial import TrainingTrial, Trial, opened

CHUNK_SECONDS = 0.1
"""A trial reports about this often; it is also how long an interruption waits."""

POLL_SECONDS = 0.1
"""How often the calling thread looks up while no message comes."""


@dataclass(frozen=True)
class Started:
    """A trial starts."""

    planned: PlannedTrial


@dataclass(frozen=True)
class Advanced:
    """A trial has done so many learning episodes."""

    planned: PlannedTrial
    episode: int


@dataclass(frozen=True)
class Lost:
    """A trial was lost with what ran it; it starts again later, or fails."""

    planned: PlannedTrial


@dataclass(frozen=True)
class Finished:
    """A trial is done."""

    planned: PlannedTrial
    record: TrialRecord


@dataclass(frozen=True)
class Failed:
    """A trial raised, or was lost too often."""

    planned: PlannedTrial
    error: Exception


@dataclass(frozen=True)
class Noted:
    """Something that a person should know."""

    text: str


Message = Started | Advanced | Lost | Finished | Failed | Noted


class Executor(Protocol):
    """Runs trials somewhere."""

    def run(
        self, planned: Sequence[PlannedTrial], stop: threading.Event
    ) -> Generator[Message, None, None]:
        """Run the trials and yield what happens, until each is finished or failed or `stop` is set.

        The generator runs in the calling thread. Closing it gives up what is running.

        Parameters
        ----------
        planned
            Trials to run, in this order as far as possible.
        stop
            Once it is set, running trials are given up and no further one starts.

        Raises
        ------
        RunError
            If no trial can be run any more.
        """


def run_to_end(
    planned: PlannedTrial,
    *,
    wanted: Callable[[], bool],
    advanced: Callable[[int], None],
) -> TrialRecord | None:
    """Run one trial, in pieces of about `CHUNK_SECONDS`; None where it did not come to its end.

    Parameters
    ----------
    planned
        The trial.
    wanted
        Asked before every piece; if it says no, the trial is given up and there is no record.
    advanced
        Told the number of learning episodes done, after every piece.
    """
    begin = time.thread_time()
    with opened(planned.spec.make_trial(planned.key.seed)) as trial:
        with closing(_pieces(trial)) as pieces:
            for _ in pieces:
                advanced(trial.done if isinstance(trial, TrainingTrial) else int(trial.episode))
                if not wanted():
                    return None
        if not trial.finished:
            return None
    return TrialRecord(
        key=planned.key,
        config=planned.spec.canonical_json(),
        version=_core.__version__,
        n_decisions=int(trial.n_decisions),
        seconds=time.thread_time() - begin,
        finished_at=datetime.now(timezone.utc).isoformat(timespec="seconds"),
        rows=_rows(trial),
    )


def _pieces(trial: Trial | TrainingTrial) -> Generator[None, None, None]:
    """Run a trial to its end; yield about every `CHUNK_SECONDS`, and first of all."""
    yield
    if isinstance(trial, TrainingTrial):  # whose episodes may be long
        yield from trial.pieces(CHUNK_SECONDS)
        return
    chunk = 1
    while not trial.finished:
        begin = time.monotonic()
        trial.advance(chunk)
        chunk = _next_chunk(chunk, time.monotonic() - begin)
        yield


def _rows(trial: Trial | TrainingTrial) -> TrialRows:
    if isinstance(trial, TrainingTrial):
        return trial.rows()
    return TrialRows.of_tests(**trial.test_rows())


def _next_chunk(chunk: int, seconds: float) -> int:
    """Episodes of the next chunk, so that it lasts about `CHUNK_SECONDS`."""
    if seconds < CHUNK_SECONDS / 2:
        return 2 * chunk
    if seconds > 2 * CHUNK_SECONDS:
        return max(1, chunk // 2)
    return chunk


@dataclass(frozen=True)
class _Abandoned:
    """A trial was given up after a stop."""


class ThreadExecutor:
    """Runs trials in threads of this process: the executor that needs nothing else.

    Parameters
    ----------
    jobs
        Trials at the same time; default one for each core.

    Raises
    ------
    ValueError
        If `jobs` is less than 1.
    """

    def __init__(self, jobs: int | None = None) -> None:
        self.jobs = n_cores() if jobs is None else jobs
        if self.jobs < 1:
            raise ValueError(f"jobs must be at least 1, got {self.jobs}")

    def run(
        self, planned: Sequence[PlannedTrial], stop: threading.Event
    ) -> Generator[Message, None, None]:
        """Run the trials; see `sdnn.runs.executor.Executor`."""
        messages: SimpleQueue[Message | _Abandoned] = SimpleQueue()
        with (
            ThreadPoolExecutor(self.jobs, thread_name_prefix="trial") as pool,
            _set_at_exit(stop),
        ):
            for item in planned:
                pool.submit(_run_one, item, messages, stop)
            # Every submitted trial sends one last message, also after a stop.
            n_open = len(planned)
            while n_open:
                try:
                    message = messages.get(timeout=POLL_SECONDS)
                except Empty:
                    continue
                n_open -= not isinstance(message, Started | Advanced)
                if not isinstance(message, _Abandoned):
                    yield message


class SerialExecutor:
    """Runs trials one after another in the calling thread, as an environment may need it."""

    def run(
        self, planned: Sequence[PlannedTrial], stop: threading.Event
    ) -> Generator[Message, None, None]:
        """Run the trials; see `sdnn.runs.executor.Executor`."""
        for item in planned:
            yield Started(item)
            try:
                record = run_to_end(
                    item, wanted=lambda: not stop.is_set(), advanced=lambda episode: None
                )
            except Exception as error:
                yield Failed(item, error)
                continue
            if stop.is_set() and record is None:
                return
            if record is not None:
                yield Finished(item, record)


def _run_one(
    planned: PlannedTrial, messages: SimpleQueue[Message | _Abandoned], stop: threading.Event
) -> None:
    """Run one trial; runs in a worker thread."""
    if stop.is_set():
        messages.put(_Abandoned())
        return
    try:
        messages.put(Started(planned))
        record = run_to_end(
            planned,
            wanted=lambda: not stop.is_set(),
            advanced=lambda episode: messages.put(Advanced(planned, episode)),
        )
    except Exception as error:
        messages.put(Failed(planned, error))
    except BaseException as error:  # SystemExit and the like end a thread without a word
        failure = RuntimeError(f"the trial raised {error!r}")
        failure.__cause__ = error
        messages.put(Failed(planned, failure))
    else:
        messages.put(_Abandoned() if record is None else Finished(planned, record))


@contextmanager
def _set_at_exit(event: threading.Event) -> Iterator[None]:
    """Let an error in the calling thread stop the workers before the pool waits for them."""
    try:
        yield
    except BaseException:
        event.set()
        raise
