"""Runs trials on a Dask cluster that others have started.

Dask places trials and runs them again when a worker is lost. The driver admits workers whose build
gives the same rows, submits as many trials as those have threads, and collects results.
"""

from __future__ import annotations

import importlib.util
import json
import logging
import math
import pickle
import time
from collections import deque
from collections.abc import Generator, Sequence
from contextlib import closing
from pathlib import Path
from queue import SimpleQueue
from threading import Event
from typing import TYPE_CHECKING, Any, NamedTuple, TypeAlias

from sdnn import _core
from sdnn.runs.config_file import MOST_BYTES
from sdnn.runs.engine import Advanced, Failed, Finished, Message, Noted, PlannedTrial, run_to_end
from sdnn.runs.errors import ClusterError, WorkerLostError
from sdnn.runs.trial import TrialRecord, opened, rows_of
from sdnn.support.arguments import require
from sdnn.support.files import read_bytes

if TYPE_CHECKING:
    from distributed import Client, Future

ANSWER_SECONDS = 30.0  # a scheduler that does not answer within this time is lost
CONNECT_SECONDS = 5.0  # length of one attempt to connect
WORKERS_SECONDS = 1.0  # between checks of the list of workers
RESULTS_SECONDS = 0.02  # between checks of results
PROGRESS_SECONDS = 2.0  # least time between two reports of a trial's progress
PROGRESS_TOPIC = "sdnn-progress"
PROBE_EPISODES = 10  # few, but they use every part of the agent and the task
MOST_SUBMISSIONS = 3  # a trial that was lost this often has failed

MISMATCH = f"__import__({__name__!r}, fromlist=['mismatch']).mismatch(version, probes)"
"""Expression that workers evaluate, with ``version`` and ``probes``.

Pickling the function itself would fail on workers without this library, before they could answer.
"""


def probe(planned: PlannedTrial) -> str:
    """Return settings and a digest of the first rows of a trial, or the name of its error.

    Builds that return the same give the same rows. A trial in Python is made but not run: it may
    be long, and its libraries may round differently.
    """
    try:
        with opened(planned.spec.make_trial(planned.key.seed)) as trial:
            if planned.spec.is_compiled:
                trial.advance(PROBE_EPISODES)
            return f"{planned.spec.canonical_json()}, {rows_of(trial).digest()}"
    except Exception as error:  # running the trial will report it
        return type(error).__name__


def probes_of(planned: Sequence[PlannedTrial]) -> list[tuple[bytes, str]]:
    """Pickle one trial per agent with its `probe`; ClusterError if one cannot be pickled."""
    # Take the first trial of each agent: in reverse order it replaces the others.
    examples = {(trial.key.agent, trial.spec.is_compiled): trial for trial in reversed(planned)}
    try:
        return [(pickle.dumps(trial), probe(trial)) for trial in examples.values()]
    except Exception as error:  # settings of a user's agent may raise anything
        raise ClusterError(f"trials cannot be sent to workers: {error}") from error


def mismatch(version: str, probes: Sequence[tuple[bytes, str]]) -> str:
    """Return why this worker's build may give other rows; "" if version and probes are equal."""
    if _core.__version__ != version:
        return f"it has sdnn {_core.__version__}, this is sdnn {version}"
    if any(probe(pickle.loads(trial)) != expected for trial, expected in probes):
        return f"its build of sdnn {version} does not give the rows of this one"
    return ""


def run_on_worker(planned: PlannedTrial) -> TrialRecord:
    """Run a trial on a worker; stop if Dask has cancelled it, which may reschedule it."""
    from distributed import Reschedule, get_worker

    worker = get_worker()
    key = worker.get_current_task()
    reported_at = time.monotonic()
    with closing(run_to_end(planned)) as messages:
        for message in messages:
            if isinstance(message, Finished):
                return message.record
            task = worker.state.tasks.get(key)
            if task is None or task.state != "executing":
                break
            if time.monotonic() - reported_at >= PROGRESS_SECONDS:
                reported_at = time.monotonic()
                worker.log_event(PROGRESS_TOPIC, (key, message.episode))
    raise Reschedule


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
        require(scheduler, "scheduler", "be an address or a scheduler file", scheduler)
        is_possible = 0 < scheduler_timeout < math.inf
        require(is_possible, "scheduler_timeout", "be finite and above 0", scheduler_timeout)
        if importlib.util.find_spec("distributed") is None:
            raise ClusterError('trials on a cluster need Dask: pip install "dask[distributed]"')
        self.scheduler = scheduler
        self.scheduler_timeout = scheduler_timeout

    def run(
        self, planned: Sequence[PlannedTrial], stop: Event
    ) -> Generator[Sequence[Message], None, None]:
        """Run the trials; see `sdnn.runs.engine.Executor`.

        ClusterError if the scheduler is lost, or there is no fitting worker for too long.
        """
        from distributed.utils import silence_logging_cmgr

        with silence_logging_cmgr(logging.CRITICAL):  # Dask logs lost connections repeatedly
            client = yield from self._connect(stop)
            if client is None:
                return
            try:
                yield from _Run(self, client, planned).messages(stop)
            except (TimeoutError, OSError) as error:
                raise self.failure(f"lost the scheduler at {self.scheduler}: {error}") from error
            finally:
                client.close(timeout=CONNECT_SECONDS)

    def _connect(self, stop: Event) -> Generator[Sequence[Message], None, Client | None]:
        """Connect in short attempts, so that Ctrl-C can end them; None after Ctrl-C."""
        from distributed import Client

        end = time.monotonic() + self.scheduler_timeout
        attempt = min(CONNECT_SECONDS, self.scheduler_timeout)
        is_waiting = False
        while not stop.is_set():
            try:
                return Client(self._address(), timeout=attempt, set_as_default=False)
            except OSError as error:  # scheduler or its file may not be there yet
                if time.monotonic() > end:
                    raise self.failure(f"no scheduler at {self.scheduler}: {error}") from error
            except ValueError as error:
                expected = f"an address or a scheduler file, got {self.scheduler} ({error})"
                raise ClusterError(f"scheduler must be {expected}") from error
            if not is_waiting:
                yield [Noted(f"waiting for the scheduler at {self.scheduler}")]
            is_waiting = True
            stop.wait(WORKERS_SECONDS)
        return None

    def _address(self) -> str:
        """Return the scheduler's address, read from its file if it has one."""
        path = Path(self.scheduler)
        if path.suffix != ".json" and not path.is_file():
            return self.scheduler
        try:
            return str(json.loads(read_bytes(path, MOST_BYTES))["address"])
        except (ValueError, LookupError, TypeError, RecursionError) as error:
            raise ValueError(f"{path}: {type(error).__name__}: {error}") from error

    def failure(self, problem: str) -> ClusterError:
        """Return the error that ends the run."""
        return ClusterError(
            f"{problem}; finished trials are stored, the same command continues from there"
        )


Key: TypeAlias = tuple[str | int, ...]
"""Dask's key of a submitted trial."""


class _Placed(NamedTuple):
    """A submitted trial: the number of its submission, from 1, and the workers it may run on."""

    planned: PlannedTrial
    submission: int
    workers: frozenset[str]
    future: Future


class _Run:
    """The trials of one run."""

    def __init__(
        self, executor: DaskExecutor, client: Client, planned: Sequence[PlannedTrial]
    ) -> None:
        self.executor = executor
        self.client = client
        self.probes = probes_of(planned)
        # Trials to be submitted, each with the number of this submission.
        self.waiting = deque((trial, 1) for trial in planned)
        self.placed: dict[Key, _Placed] = {}  # submitted trials by Dask's key
        self.threads: dict[str, int] = {}  # number of threads of each admitted worker
        self.problems: dict[str, str] = {}  # why a worker gets no trials; "" if it is admitted
        self.unserved_since: float | None = None  # since when no worker is admitted

    def messages(self, stop: Event) -> Generator[Sequence[Message], None, None]:
        """Run until every trial is finished or failed, or `stop` is set."""
        from distributed import as_completed

        completed = as_completed(loop=self.client.loop, with_results=True, raise_errors=False)
        progress: SimpleQueue[tuple[Key, int]] = SimpleQueue()
        self.client.subscribe_topic(PROGRESS_TOPIC, lambda event: progress.put(event[1]))
        updated_at = -math.inf
        while self.waiting or self.placed:
            if time.monotonic() - updated_at > WORKERS_SECONDS:
                updated_at = time.monotonic()
                yield list(self.update_workers())
            submitted = list(self._submit_waiting())
            for placed in submitted:
                completed.add(placed.future)
            yield [Advanced(placed.planned, 0) for placed in submitted]
            if stop.wait(RESULTS_SECONDS):
                return
            reports = [progress.get() for _ in range(progress.qsize())]
            yield [
                Advanced(self.placed[key].planned, episode)
                for key, episode in reports
                if key in self.placed
            ]
            batch: list[Message] = []
            try:
                for future, result in completed.next_batch(block=False):
                    if future.key in self.placed:
                        batch.append(ended(self.placed.pop(future.key), result))
            finally:  # an error ends the run, and what was finished before it is stored
                yield batch

    def _submit_waiting(self) -> Generator[_Placed, None, None]:
        """Submit waiting trials, as many as the threads of admitted workers can run at once."""
        while self.waiting and len(self.placed) < sum(self.threads.values()):
            planned, submission = self.waiting.popleft()
            # The key is the trial's identity, so that several drivers share it. The number of
            # the submission is part of it, because Dask never runs a key again.
            # Dask keeps statistics of each group of keys, which is a tuple's first element.
            key = ("sdnn", _core.__version__, *planned.key, submission)
            workers = list(self.threads)
            future = self.client.submit(run_on_worker, planned, key=key, workers=workers)
            self.placed[key] = _Placed(planned, submission, frozenset(workers), future)
            yield self.placed[key]

    def update_workers(self) -> Generator[Message, None, None]:
        """Admit new workers with the same build; resubmit trials whose workers are all lost.

        ClusterError if there has been no fitting worker for too long.
        """
        client = self.client
        threads = client.sync(client.scheduler.ncores, callback_timeout=ANSWER_SECONDS)
        self.problems = {worker: why for worker, why in self.problems.items() if worker in threads}
        yield from self._check_workers([w for w in threads if w not in self.problems])
        self.threads = {
            worker: n for worker, n in threads.items() if self.problems.get(worker) == ""
        }
        yield from self._resubmit_lost()
        yield from self._await_workers()

    def _check_workers(self, workers: list[str]) -> Generator[Noted, None, None]:
        """Note in `problems` whether new workers have the same build; report those that do not."""
        if not workers:
            return
        build = {"version": _core.__version__, "probes": self.probes}
        answers: dict[str, str | BaseException] = self.client.run(
            eval, MISMATCH, build, workers=workers, on_error="return"
        )
        for worker, answer in answers.items():
            if isinstance(answer, OSError):  # the worker was lost meanwhile
                continue
            if isinstance(answer, BaseException):
                answer = f"it cannot run these trials: {type(answer).__name__}: {answer}"
            self.problems[worker] = ""
            if answer:
                self.problems[worker] = f"worker {worker} was refused, {answer}"
                yield Noted(self.problems[worker])

    def _resubmit_lost(self) -> Generator[Failed, None, None]:
        """Let trials wait again whose workers are all lost; report those lost too often."""
        for key, (trial, submission, workers, future) in list(self.placed.items()):
            if not workers.isdisjoint(self.threads):
                continue
            del self.placed[key]
            future.cancel()
            if submission < MOST_SUBMISSIONS:
                self.waiting.appendleft((trial, submission + 1))
            else:
                problem = f"all its workers were lost, {submission} times"
                yield Failed(trial, WorkerLostError(problem))

    def _await_workers(self) -> Generator[Noted, None, None]:
        """Report that there is no fitting worker; ClusterError if there is none for too long."""
        scheduler, seconds = self.executor.scheduler, self.executor.scheduler_timeout
        if self.threads:
            self.unserved_since = None
        elif self.unserved_since is None:
            self.unserved_since = time.monotonic()
            yield Noted(f"waiting for workers at {scheduler}")
        elif time.monotonic() - self.unserved_since > seconds:
            fits = f" fits: {'; '.join(self.problems.values())}" if self.problems else ""
            raise self.executor.failure(f"no worker at {scheduler}{fits}; waited {seconds:g} s")


def ended(placed: _Placed, result: Any) -> Message:
    """Return the message about the end of a trial, finished or failed."""
    from distributed import KilledWorker

    if placed.future.status == "finished":
        planned = placed.planned
        identity = (result.version, result.key, result.config)
        if identity != (_core.__version__, planned.key, planned.spec.canonical_json()):
            # The worker was restarted with other code after it had been admitted.
            problem = f"its worker's sdnn {result.version} ran other settings than were asked for"
            return Failed(planned, ClusterError(problem))
        return Finished(planned, result)
    if placed.future.status != "error":
        raise OSError("it does not know the trials any more")
    error = result[1]
    if isinstance(error, KilledWorker):
        error = WorkerLostError(f"worker after worker was lost: {error}")
    return Failed(placed.planned, error)
