"""Runs trials on a Dask cluster that others have started.

Dask places trials and runs them again when a worker is lost. The driver admits workers whose build
gives the same rows, submits as many trials as those have threads, and collects results.

Trials are sent as bytes: a worker that cannot unpickle a task falls silent, but a task that cannot
unpickle its argument reports an error.
"""

from __future__ import annotations

import asyncio
import importlib.util
import json
import logging
import math
import pickle
import threading
import time
from collections import Counter, deque
from collections.abc import Generator, Iterable, Iterator, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any

from sdnn import _core
from sdnn.files import read_bytes
from sdnn.runs.config_file import MOST_BYTES
from sdnn.runs.engine import (
    Advanced,
    Failed,
    Finished,
    Message,
    Noted,
    PlannedTrial,
    run_to_end,
)
from sdnn.runs.errors import ClusterError, WorkerLostError
from sdnn.runs.trial import TrialKey, TrialRecord, opened, rows_of

if TYPE_CHECKING:
    from distributed import Client, Future

ANSWER_SECONDS = 30.0  # a scheduler that leaves a question unanswered for so long is lost
CONNECT_SECONDS = 5.0  # of one attempt
WORKERS_SECONDS = 1.0  # between checks of the list of workers
RESULTS_SECONDS = 0.02  # between checks of results
PROGRESS_SECONDS = 2.0  # at least between two reports of a trial's progress
PROGRESS_TOPIC = "sdnn-progress"
PROBE_EPISODES = 10  # few, but they use every part of the agent and the task

MISMATCH = f"__import__({__name__!r}, fromlist=['mismatch']).mismatch(version, probes)"
"""An expression for `eval`, which workers without this library have, too."""


def probe(planned: PlannedTrial) -> str:
    """Return settings and first rows of a trial: equal where all its rows are equal.

    A trial in Python is only made: it may be long, and its libraries may round differently.
    """
    with opened(planned.spec.make_trial(planned.key.seed)) as trial:
        if planned.spec.is_compiled:
            trial.advance(PROBE_EPISODES)
        return f"{planned.spec.canonical_json()}, {rows_of(trial).digest()}"


def mismatch(version: str, probes: Sequence[tuple[bytes, str]]) -> str:
    """Return why this build gets no trials; nothing if it has the version and gives the probes."""
    if _core.__version__ != version:
        return f"it has sdnn {_core.__version__}, this is sdnn {version}"
    if any(probe(pickle.loads(trial)) != expected for trial, expected in probes):
        return f"its build of sdnn {version} does not give the rows of this one"
    return ""


def run_on_worker(version: str, pickled: bytes) -> TrialRecord:
    """Run a trial; Dask places it again if it was cancelled and is wanted once more.

    ClusterError if this worker's version, or the settings it reads, are not the driver's.
    """
    from distributed import Reschedule, get_worker

    worker = get_worker()
    planned: PlannedTrial = pickle.loads(pickled)
    if (_core.__version__, planned.spec.config_hash) != (version, planned.key.config_hash):
        raise ClusterError(
            f"worker {worker.address} (sdnn {_core.__version__}) does not read the settings of"
            f" this trial as the driver (sdnn {version}) does; install the same build on both"
        )
    key = worker.get_current_task()
    reported = time.monotonic()

    def wanted() -> bool:
        task = worker.state.tasks.get(key)
        return task is not None and task.state == "executing"

    def advanced(episode: int) -> None:
        nonlocal reported
        if time.monotonic() - reported >= PROGRESS_SECONDS:
            reported = time.monotonic()
            worker.log_event(PROGRESS_TOPIC, (key, episode))

    record = run_to_end(planned, wanted=wanted, advanced=advanced)
    if record is None:
        raise Reschedule
    return record


class DaskExecutor:
    """Runs trials on the workers of a Dask scheduler.

    ClusterError if Dask is not installed. ValueError if a value is out of its range.

    Parameters
    ----------
    scheduler
        Its address, such as ``tcp://10.0.0.1:8786``, or the path of its scheduler file.
    scheduler_timeout
        Seconds to wait for the scheduler, and for a worker that fits, before the run fails.
    """

    jobs = 1  # the size of the cluster is not known

    def __init__(self, scheduler: str, *, scheduler_timeout: float = 300.0) -> None:
        if not scheduler:
            raise ValueError("scheduler must be an address or a scheduler file, got ''")
        if not 0 < scheduler_timeout < math.inf:
            raise ValueError(
                f"scheduler_timeout must be finite and above 0, got {scheduler_timeout}"
            )
        if importlib.util.find_spec("distributed") is None:
            raise ClusterError('trials on a cluster need Dask: pip install "dask[distributed]"')
        self.scheduler = scheduler
        self.scheduler_timeout = scheduler_timeout

    def run(
        self, planned: Sequence[PlannedTrial], stop: threading.Event
    ) -> Generator[Message, None, None]:
        """Run the trials; see `sdnn.runs.engine.Executor`.

        ClusterError if the scheduler is lost, or there is no fitting worker for too long.
        """
        from distributed.utils import silence_logging_cmgr

        with silence_logging_cmgr(logging.CRITICAL):  # a lost connection ends with one message
            client = yield from self._connect(stop)
            if client is None:
                return
            try:
                run = _Run(self, client, list(_probes(planned)), deque(planned))
                yield from run.messages(stop)
            except (OSError, asyncio.TimeoutError) as error:
                raise self.failure(f"lost the scheduler at {self.scheduler}: {error}") from error
            finally:
                client.close(timeout=CONNECT_SECONDS)

    def _connect(self, stop: threading.Event) -> Generator[Message, None, Client | None]:
        """Connect, in short attempts, so that Ctrl-C ends them."""
        from distributed import Client

        begin = time.monotonic()
        notes = [f"waiting for the scheduler at {self.scheduler}"]
        attempt = min(CONNECT_SECONDS, self.scheduler_timeout)
        while not stop.is_set():
            try:
                return Client(self._address(), timeout=attempt, set_as_default=False)
            except OSError as error:
                if time.monotonic() - begin > self.scheduler_timeout:
                    raise self.failure(
                        f"no scheduler at {self.scheduler}: {error}; waited"
                        f" {self.scheduler_timeout:g} s"
                    ) from error
                yield from map(Noted, notes)
                notes = []
                stop.wait(WORKERS_SECONDS)
            except ValueError as error:
                raise self._refusal(error) from error
        return None

    def _address(self) -> str:
        """Return the address, from a scheduler file if it is one; OSError if it is not there."""
        path = Path(self.scheduler)
        if path.suffix != ".json" and not path.is_file():
            return self.scheduler
        try:
            return str(json.loads(read_bytes(path, MOST_BYTES))["address"])
        except FileNotFoundError:  # it may come
            raise
        except (OSError, ValueError, LookupError, TypeError, RecursionError) as error:
            raise self._refusal(error) from error

    def _refusal(self, error: Exception) -> ClusterError:
        return ClusterError(
            f"scheduler must be an address or a scheduler file, got {self.scheduler}"
            f" ({type(error).__name__}: {error})"
        )

    def failure(self, problem: str) -> ClusterError:
        """Return the error that ends the run."""
        return ClusterError(
            f"{problem}; finished trials are stored, the same command continues from there"
        )


def _probes(planned: Iterable[PlannedTrial]) -> Iterator[tuple[bytes, str]]:
    """Make probes of the first trial of each kind, but of those that will fail anyway."""
    kinds: dict[tuple[str, bool], PlannedTrial] = {}
    for one in planned:
        kinds.setdefault((one.key.agent, one.spec.is_compiled), one)
    for one in kinds.values():
        try:
            yield pickle.dumps(one), probe(one)
        except Exception:  # reported when it is run, as with every executor
            continue


@dataclass
class _Run:
    """The trials of one run.

    Those that were lost with worker after worker are suspects: they run after all others, alone.
    """

    executor: DaskExecutor
    client: Client
    probes: list[tuple[bytes, str]]
    waiting: deque[PlannedTrial]
    running: dict[Future, tuple[PlannedTrial, frozenset[str]]] = field(default_factory=dict)
    suspects: set[TrialKey] = field(default_factory=set)
    n_submitted: Counter[TrialKey] = field(default_factory=Counter)
    threads: dict[str, int] = field(default_factory=dict)  # of the workers that fit
    refused: dict[str, str] = field(default_factory=dict)  # why others do not
    unserved_since: float | None = None

    def messages(self, stop: threading.Event) -> Generator[Message, None, None]:
        """Run until every trial is finished or failed, or `stop` is set."""
        from distributed import as_completed

        completed = as_completed(loop=self.client.loop, with_results=True, raise_errors=False)
        progress: SimpleQueue[tuple[str, int]] = SimpleQueue()
        self.client.subscribe_topic(PROGRESS_TOPIC, lambda event: progress.put(event[1]))
        looked = -math.inf
        while self.waiting or self.running:
            if time.monotonic() - looked > WORKERS_SECONDS:
                yield from self.look_at_workers()
                looked = time.monotonic()
            for planned in self.next_trials():
                yield from self.submit(planned, completed)
            if stop.wait(RESULTS_SECONDS):
                return
            trials = {future.key: planned for future, (planned, _) in self.running.items()}
            while not progress.empty():
                key, episode = progress.get()
                if key in trials:
                    yield Advanced(trials[key], episode)
            for future, result in completed.next_batch(block=False):
                if future in self.running:
                    yield from self.complete(future, result)

    def look_at_workers(self) -> Generator[Message, None, None]:
        """Admit new workers that fit, and take back what waits for lost ones only."""
        client = self.client
        threads = client.sync(client.scheduler.ncores, callback_timeout=ANSWER_SECONDS)
        self.threads = {one: n for one, n in threads.items() if one in self.threads}
        self.refused = {one: why for one, why in self.refused.items() if one in threads}
        new = threads.keys() - self.threads.keys() - self.refused.keys()
        given = {"version": _core.__version__, "probes": self.probes}
        answers: dict[str, Any] = {}
        if new:
            answers = client.run(eval, MISMATCH, given, workers=list(new), on_error="return")
        for worker, answer in answers.items():
            if answer == "":
                self.threads[worker] = threads[worker]
            elif not isinstance(answer, OSError):  # else it was lost meanwhile
                if isinstance(answer, BaseException):
                    answer = f"it cannot run these trials: {type(answer).__name__}: {answer}"
                self.refused[worker] = f"worker {worker} was refused, {answer}"
                yield Noted(self.refused[worker])
        for future, (planned, workers) in list(self.running.items()):
            if workers.isdisjoint(self.threads):
                del self.running[future]
                future.cancel()
                self.waiting.appendleft(planned)
        if self.threads:
            self.unserved_since = None
        elif self.unserved_since is None:
            self.unserved_since = time.monotonic()
            yield Noted(f"waiting for workers at {self.executor.scheduler}")
        elif time.monotonic() - self.unserved_since > self.executor.scheduler_timeout:
            fits = f" fits: {'; '.join(self.refused.values())}" if self.refused else ""
            waited = f"waited {self.executor.scheduler_timeout:g} s"
            raise self.executor.failure(f"no worker at {self.executor.scheduler}{fits}; {waited}")

    def next_trials(self) -> Iterator[PlannedTrial]:
        """Yield a trial for each free thread; suspects, which come last, one by one."""
        n_threads = sum(self.threads.values())
        while self.waiting:
            is_alone = self.waiting[0].key in self.suspects
            if len(self.running) >= (min(1, n_threads) if is_alone else n_threads):
                return
            yield self.waiting.popleft()

    def submit(self, planned: PlannedTrial, completed: Any) -> Generator[Message, None, None]:
        """Submit a trial; its identity is its key, so that drivers with the same trial share it."""
        # A trial that is submitted again has a number, because Dask remembers how a key ended.
        number = self.n_submitted[planned.key]
        self.n_submitted[planned.key] += 1
        yield Advanced(planned, 0)
        try:
            pickled = pickle.dumps(planned)
        except Exception as error:
            yield Failed(planned, error)
            return
        key = "-".join(map(str, ("trial", _core.__version__, *planned.key, number)))
        future = self.client.submit(
            run_on_worker, _core.__version__, pickled, key=key, workers=list(self.threads)
        )
        self.running[future] = planned, frozenset(self.threads)
        completed.add(future)

    def complete(self, future: Future, result: Any) -> Generator[Message, None, None]:
        """Report how a trial ended."""
        from distributed.scheduler import KilledWorker

        planned, _ = self.running.pop(future)
        status = future.status
        future.release()
        if status == "finished":
            yield Advanced(planned, planned.spec.length)
            yield Finished(planned, result)
        elif status != "error":
            raise OSError("it does not know the trials any more")
        elif not isinstance(result[1], KilledWorker):
            yield Failed(planned, result[1])
        elif planned.key in self.suspects:
            yield Failed(planned, WorkerLostError(f"worker after worker was lost: {result[1]}"))
        else:
            self.suspects.add(planned.key)
            self.waiting.append(planned)
