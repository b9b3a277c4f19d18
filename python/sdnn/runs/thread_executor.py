"""Runs trials in threads of this process, or in the calling one.

A trial releases Python's lock while it advances, so threads scale over the cores.
"""

from __future__ import annotations

import threading
from collections.abc import Generator, Iterator, Sequence
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from dataclasses import dataclass
from queue import Empty, SimpleQueue

from sdnn.machine import n_cores
from sdnn.runs.executor import (
    POLL_SECONDS,
    Advanced,
    Failed,
    Finished,
    Message,
    Started,
    run_to_end,
)
from sdnn.runs.planned_trial import PlannedTrial


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
