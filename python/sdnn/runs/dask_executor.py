"""Runs trials on a Dask cluster that others have started.

Dask carries tasks to workers and results back; what runs where is decided here, one trial for each
thread of each worker. So it is known which trial a lost worker had, how often a trial was lost, and
nothing depends on how the scheduler is configured. What Dask says about a task is never believed
beyond "here is its result": a trial without a result is simply submitted again.
"""

from __future__ import annotations

import asyncio
import importlib.util
import json
import logging
import pickle
import re
import threading
import time
import uuid
from collections import Counter
from collections.abc import Callable, Coroutine, Generator, Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from dataclasses import dataclass, field
from itertools import count
from pathlib import Path
from queue import Empty, SimpleQueue
from typing import TYPE_CHECKING, Any

from sdnn import _core
from sdnn.runs.dask_worker import PROBE_WORKER, MismatchError, probe, run_on_worker
from sdnn.runs.errors import ClusterError, WorkerLostError
from sdnn.runs.executor import (
    POLL_SECONDS,
    Advanced,
    Failed,
    Finished,
    Lost,
    Message,
    Noted,
    Started,
)
from sdnn.runs.planned_trial import PlannedTrial

if TYPE_CHECKING:
    from distributed import Client

SCHEDULER_TIMEOUT = 300.0
WORKER_TIMEOUT = 60.0
ATTEMPTS = 5

CONNECT_SECONDS = 5.0
"""Longest try to connect; then the address is looked up again."""
RETRY_SECONDS = 1.0
ANSWER_SECONDS = 30.0
"""A scheduler that leaves a question unanswered for so long counts as lost."""
PATIENCE_SECONDS = 5.0
"""How long to wait for a worker before saying so."""
REFUSAL_SECONDS = 10.0
"""How long to wait for a fitting worker after the last refusal, where none has fitted yet."""
LOOK_SECONDS = 1.0
"""How often the list of workers is asked for ..."""
LOOK_SECONDS_PER_WORKER = 0.01
"""... and how much less often for each of them, because the answer grows."""
PROGRESS_SECONDS = 1.0
"""How often a trial tells its progress ..."""
PROGRESS_EVENTS_PER_SECOND = 100
"""... unless all of them would tell more than this, which the driver has to read."""


class DaskExecutor:
    """Runs trials on the workers of a Dask scheduler.

    Workers may come and go. One with another version of this library, or whose build gives other
    bits, gets no trials. The scheduler may die and come back.

    Parameters
    ----------
    scheduler
        Its address, such as ``tcp://10.0.0.1:8786``, or the path of its scheduler file, which is
        read again whenever the scheduler was lost.
    scheduler_timeout
        Seconds to wait for the scheduler, and for a worker that fits, before the run fails.
    worker_timeout
        Seconds without a heartbeat after which a worker counts as lost.
    attempts
        A trial fails when so many workers were lost while they had it.

    Raises
    ------
    ClusterError
        If Dask is not installed.
    ValueError
        If a value is out of its range.
    """

    def __init__(
        self,
        scheduler: str,
        *,
        scheduler_timeout: float = SCHEDULER_TIMEOUT,
        worker_timeout: float = WORKER_TIMEOUT,
        attempts: int = ATTEMPTS,
    ) -> None:
        if not scheduler:
            raise ValueError("scheduler must be an address or a scheduler file, got ''")
        for name, seconds in (
            ("scheduler_timeout", scheduler_timeout),
            ("worker_timeout", worker_timeout),
        ):
            if not 0 < seconds < float("inf"):
                raise ValueError(f"{name} must be finite and above 0, got {seconds}")
        if attempts < 1:
            raise ValueError(f"attempts must be at least 1, got {attempts}")
        if importlib.util.find_spec("distributed") is None:
            raise ClusterError(
                'trials on a cluster need Dask, which is not installed: pip install "sdnn[dask]"'
            )
        self.scheduler = scheduler
        self.scheduler_timeout = scheduler_timeout
        self.worker_timeout = worker_timeout
        self.attempts = attempts

    def run(
        self, planned: Sequence[PlannedTrial], stop: threading.Event
    ) -> Generator[Message, None, None]:
        """Run the trials; see `sdnn.runs.executor.Executor`.

        Raises
        ------
        ClusterError
            If there was no scheduler or no fitting worker for too long.
        """
        import distributed  # noqa: F401  (before `_quiet`, for it sets up logging)

        run = _Run(self, planned)
        thread = threading.Thread(target=run.in_thread, name="dask driver", daemon=True)
        with _quiet():
            thread.start()
            try:
                while thread.is_alive() or not run.messages.empty():
                    if stop.is_set():
                        run.give_up()
                    with suppress(Empty):
                        yield run.messages.get(timeout=POLL_SECONDS)
            finally:
                run.give_up()
                thread.join(2 * CONNECT_SECONDS)
        if run.error is not None:
            raise run.error


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence Dask's own words on lost connections: the run tells of them once, in its own."""
    loggers = [logging.getLogger(f"distributed{part}") for part in ("", ".client", ".core")]
    levels = [logger.level for logger in loggers]
    for logger in loggers:
        logger.setLevel(logging.CRITICAL)
    try:
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


class _SchedulerLostError(Exception):
    """The connection to the scheduler is gone, or what it knew of this run."""


class _WorkerDiedError(Exception):
    """Dask says that a worker died of a task."""


class _TaskError(Exception):
    """A task raised an error."""

    def __init__(self, error: Exception) -> None:
        super().__init__(str(error))
        self.error = error


class _Run:
    """One run of trials, in a thread with an event loop; trials are numbers in the plan."""

    def __init__(self, executor: DaskExecutor, planned: Sequence[PlannedTrial]) -> None:
        self.executor = executor
        self.planned = planned
        self.messages: SimpleQueue[Message] = SimpleQueue()
        self.error: Exception | None = None
        self.name = f"sdnn-{uuid.uuid4().hex[:8]}"
        self.n_open = len(planned)
        self.waiting: asyncio.Queue[int] = asyncio.Queue()
        for trial in range(len(planned)):
            self.waiting.put_nowait(trial)
        self.woken = asyncio.Event()
        self.attempts = count()
        self.probes: list[tuple[str, bytes, str]] = []
        self.served_at = time.monotonic()
        self.has_served = False
        self._n_lost: Counter[int] = Counter()
        self._stopping = False
        self._loop: asyncio.AbstractEventLoop | None = None
        self._main: asyncio.Task[None] | None = None

    # Called from other threads.

    def in_thread(self) -> None:
        """Run until every trial is finished or failed, or the run is given up."""
        try:
            asyncio.run(self._drive())
        except asyncio.CancelledError:
            pass
        except Exception as error:
            self.error = error

    def give_up(self) -> None:
        """Stop as soon as possible; further calls change nothing."""
        if not self._stopping:
            self._stopping = True
            if self._loop is not None and self._main is not None:
                with suppress(RuntimeError):  # the loop is closed: the run has ended
                    self._loop.call_soon_threadsafe(self._main.cancel)

    # What becomes of trials.

    def note(self, text: str) -> None:
        """Tell the user."""
        self.messages.put(Noted(text))

    def finish(self, message: Finished | Failed) -> None:
        """Close a trial with its last message."""
        self.messages.put(message)
        self.n_open -= 1
        if not self.n_open:
            self.woken.set()

    def put_back(self, trial: int, lost_with: str | None = None) -> None:
        """Let a trial start again, unless too many workers were lost with it."""
        planned = self.planned[trial]
        self._n_lost[trial] += lost_with is not None
        if self._n_lost[trial] < self.executor.attempts:
            self.messages.put(Lost(planned))
            self.waiting.put_nowait(trial)
            return
        error = WorkerLostError(
            f"workers lost while they had it: {self._n_lost[trial]}, the last one {lost_with}"
        )
        self.finish(Failed(planned, error))

    def be_patient(self, reason: str, since: float, seconds: float) -> None:
        """Raise the error that ends a run, if `since` is more than so many seconds ago."""
        if time.monotonic() - since > seconds:
            raise ClusterError(
                f"{reason}; waited {seconds:g} s. What was finished is stored,"
                " the same command goes on from there"
            )

    # The connection.

    async def _drive(self) -> None:
        self._loop, self._main = asyncio.get_running_loop(), asyncio.current_task()
        self._make_probes()
        self.served_at = time.monotonic()
        while self.n_open and not self._stopping:
            client = await self._connect()
            try:
                await _Session(self, client).serve()
            except (_SchedulerLostError, OSError, asyncio.TimeoutError) as error:
                self.note(f"lost the scheduler at {self.executor.scheduler} ({_in_words(error)})")
                await asyncio.sleep(RETRY_SECONDS)
            finally:
                await _close(client)

    def _make_probes(self) -> None:
        """Choose one trial of each agent and kind, with what it gives here."""
        probed: set[tuple[str, bool]] = set()
        for planned in self.planned:
            agent, kind = planned.key.agent, planned.spec.environment is None
            if (agent, kind) not in probed:
                # A trial that raises here fails later, as everywhere.
                with suppress(Exception):
                    self.probes.append((agent, pickle.dumps(planned), probe(planned)))
                    probed.add((agent, kind))

    async def _connect(self) -> Client:
        noted = False
        while True:
            where = self.executor.scheduler
            try:
                return await self._try_to_connect()
            except ValueError as error:
                raise ClusterError(f"cannot use {where} as scheduler: {error}") from error
            except Exception as error:
                reason = f"no scheduler at {where}: {_in_words(error)}"
                self.be_patient(reason, self.served_at, self.executor.scheduler_timeout)
                if not noted:
                    left = self.executor.scheduler_timeout - (time.monotonic() - self.served_at)
                    self.note(f"{reason}; waiting for up to {left:.0f} s")
                    noted = True
                await asyncio.sleep(RETRY_SECONDS)

    async def _try_to_connect(self) -> Client:
        from distributed import Client

        client = Client(
            self._address(), asynchronous=True, set_as_default=False, name=self.name,
            timeout=min(CONNECT_SECONDS, self.executor.scheduler_timeout),
        )  # fmt: skip
        try:
            return await client
        except BaseException:
            await _close(client)
            raise

    def _address(self) -> str:
        text = self.executor.scheduler
        if re.fullmatch(r"[\w.+-]+://.+|[^/\\]+:\d+", text):
            return text
        try:
            return str(json.loads(Path(text).read_text())["address"])
        except (ValueError, KeyError, TypeError) as error:
            raise OSError(f"{text} is not (yet) a scheduler file") from error


async def _close(client: Client) -> None:
    """Close a connection to its end, or Dask complains when it is collected."""
    closing = asyncio.ensure_future(asyncio.wait_for(client.close(), CONNECT_SECONDS))
    with suppress(Exception):  # what cannot be closed is lost already
        try:
            await asyncio.shield(closing)
        except asyncio.CancelledError:
            with suppress(Exception):
                await closing
            raise


@dataclass(eq=False)
class _Worker:
    """A worker as the driver sees it, from its joining to its loss."""

    address: str
    n_threads: int
    last_seen: float
    heard_at: float
    refused: str = ""
    refused_at: float = 0.0
    serves: bool = False
    given_up: bool = False
    available: asyncio.Event = field(default_factory=asyncio.Event)
    tasks: list[asyncio.Task[None]] = field(default_factory=list)

    def give_up(self) -> None:
        """Take its trials away: they count as lost with it."""
        self.serves = False
        self.given_up = True
        for task in self.tasks:
            task.cancel()


class _Session:
    """One connection to a scheduler: finds workers, and keeps each of their threads busy."""

    def __init__(self, run: _Run, client: Client) -> None:
        self._run = run
        self._client = client
        self._workers: dict[tuple[str, str], _Worker] = {}
        self._running: dict[int, PlannedTrial] = {}
        self._broken: Exception | None = None
        self._noted = False

    async def serve(self) -> None:
        """Run trials until none is open.

        Raises
        ------
        _SchedulerLostError, OSError
            If the connection broke.
        ClusterError
            If there was no fitting worker for too long.
        """
        self._client.subscribe_topic(self._run.name, self._on_progress)
        try:
            while self._run.n_open:
                info = await asyncio.wait_for(self._client.scheduler.identity(), ANSWER_SECONDS)
                self._look_at(info["workers"])
                pause = LOOK_SECONDS + LOOK_SECONDS_PER_WORKER * len(self._workers)
                with suppress(asyncio.TimeoutError):
                    await asyncio.wait_for(self._run.woken.wait(), pause)
                if self._broken is not None:
                    raise self._broken
        finally:
            self._run.woken.clear()
            tasks = [task for worker in self._workers.values() for task in worker.tasks]
            for task in tasks:
                task.cancel()
            await asyncio.gather(*tasks, return_exceptions=True)

    def _look_at(self, workers: Mapping[str, Mapping[str, Any]]) -> None:
        """Note who came, who went and who is silent."""
        now = time.monotonic()
        # A worker started again at the same port has another folder.
        found = {(a, str(info.get("local_directory"))): info for a, info in workers.items()}
        for key in self._workers.keys() - found.keys():
            self._workers.pop(key).give_up()
        for key, info in found.items():
            worker = self._workers.get(key)
            if worker is not None and info["last_seen"] != worker.last_seen:
                worker.last_seen, worker.heard_at = info["last_seen"], now
                if worker.given_up and not worker.refused:
                    worker = None  # it was frozen, and is back
            if worker is None:
                worker = _Worker(key[0], info["nthreads"], info["last_seen"], now)
                self._workers[key] = worker
                worker.tasks.append(self._task(self._admit, worker))
            elif now - worker.heard_at > self._run.executor.worker_timeout and not worker.given_up:
                self._run.note(
                    f"worker {worker.address} has sent nothing for"
                    f" {self._run.executor.worker_timeout:g} s; its trials start elsewhere"
                )
                worker.give_up()
            if info.get("status", "running") == "running":
                worker.available.set()
            else:
                worker.available.clear()
        self._be_patient(now)

    def _be_patient(self, now: float) -> None:
        """Raise an error if there was no fitting worker for too long."""
        run, seconds = self._run, self._run.executor.scheduler_timeout
        if any(worker.serves for worker in self._workers.values()):
            run.served_at, run.has_served = now, True
            return
        where = run.executor.scheduler
        refused = [worker for worker in self._workers.values() if worker.refused]
        if not refused:
            run.be_patient(f"no worker at {where}", run.served_at, seconds)
            if not self._noted and now - run.served_at > PATIENCE_SECONDS:
                run.note(f"waiting for workers at {where}")
                self._noted = True
            return
        reason = f"no worker at {where} fits: {refused[-1].refused}"
        run.be_patient(reason, run.served_at, seconds)
        if not run.has_served and len(refused) == len(self._workers):
            since = max(worker.refused_at for worker in refused)
            run.be_patient(reason, since, REFUSAL_SECONDS)

    def _task(
        self, function: Callable[[_Worker], Coroutine[Any, Any, None]], worker: _Worker
    ) -> asyncio.Task[None]:
        async def guarded() -> None:
            try:
                await function(worker)
            except Exception as error:
                self._broken = error
                self._run.woken.set()

        return asyncio.create_task(guarded())

    async def _admit(self, worker: _Worker) -> None:
        """Let a worker serve if it computes as this process does."""
        try:
            version, found = await self._result(
                worker, "probe", eval, PROBE_WORKER,
                {"arguments": (_core.__version__, [trial for _, trial, _ in self._run.probes])},
            )  # fmt: skip
        except _WorkerDiedError:
            return
        except _TaskError as raised:
            self._refuse(worker, f"it cannot run these trials: {_in_words(raised.error)}")
            return
        if version != _core.__version__:
            self._refuse(worker, f"it has sdnn {version}, this is sdnn {_core.__version__}")
            return
        for (agent, _, ours), theirs in zip(self._run.probes, found, strict=True):
            if ours != theirs:
                self._refuse(
                    worker,
                    f"its build of sdnn {version} does not give the rows of this one for agent"
                    f" {agent}",
                )
                return
        worker.serves = True
        worker.tasks.extend(self._task(self._keep_busy, worker) for _ in range(worker.n_threads))

    def _refuse(self, worker: _Worker, reason: str) -> None:
        worker.refused = f"worker {worker.address} was refused, {reason}"
        worker.refused_at = time.monotonic()
        self._run.note(worker.refused)

    async def _keep_busy(self, worker: _Worker) -> None:
        """Give one thread of a worker one trial after another."""
        while True:
            await worker.available.wait()
            await self._run_trial(worker, await self._run.waiting.get())

    async def _run_trial(self, worker: _Worker, trial: int) -> None:
        run, planned = self._run, self._run.planned[trial]
        run.messages.put(Started(planned))
        try:
            settings, pickled = planned.spec.canonical_json(), pickle.dumps(planned)
        except Exception as error:
            run.finish(Failed(planned, error))
            return
        attempt = next(run.attempts)
        self._running[attempt] = planned
        key = planned.key
        try:
            record = await self._result(
                worker,
                f"{key.case_id}-{key.agent}-{key.trial}-{key.config_hash}-{attempt}",
                run_on_worker,
                _core.__version__,
                settings,
                pickled,
                run.name,
                attempt,
                self._progress_seconds(),
            )
        except asyncio.CancelledError:
            run.put_back(trial, worker.address if worker.given_up else None)
            raise
        except _WorkerDiedError:
            run.put_back(trial, worker.address)
        except _TaskError as raised:
            if isinstance(raised.error, MismatchError):
                self._refuse(worker, str(raised.error))
                run.put_back(trial)
                worker.give_up()
            else:
                run.finish(Failed(planned, raised.error))
        except Exception:
            run.put_back(trial)
            raise
        else:
            if record is None:
                run.put_back(trial)
            else:
                run.messages.put(Advanced(planned, planned.spec.length))
                run.finish(Finished(planned, record))
        finally:
            del self._running[attempt]

    async def _result(
        self, worker: _Worker, name: str, function: Callable[..., Any], *arguments: object
    ) -> Any:
        """Run a function on a worker and nowhere else.

        Its key is used once: Dask must never take it for another task, of this run or another.
        """
        from distributed.scheduler import KilledWorker

        future = self._client.submit(
            function, *arguments, key=f"{self._run.name}-{name}-{uuid.uuid4().hex[:8]}",
            workers=[worker.address], allow_other_workers=False, pure=False,
        )  # fmt: skip
        try:
            return await future
        except KilledWorker as error:
            raise _WorkerDiedError from error
        except Exception as error:
            if future.status == "error":
                raise _TaskError(error) from error
            raise _SchedulerLostError from error
        finally:
            future.release()

    def _progress_seconds(self) -> float:
        n_threads = sum(worker.n_threads for worker in self._workers.values() if worker.serves)
        return max(PROGRESS_SECONDS, n_threads / PROGRESS_EVENTS_PER_SECOND)

    def _on_progress(self, event: tuple[float, dict[str, int]]) -> None:
        _, content = event
        planned = self._running.get(content["attempt"])
        if planned is not None:
            self._run.messages.put(Advanced(planned, content["episode"]))


def _in_words(error: BaseException) -> str:
    """One line about an error."""
    if isinstance(error, _SchedulerLostError):
        return "it does not know the trials any more"
    text = str(error).partition("\n")[0]
    return f"{type(error).__name__}: {text}" if text else type(error).__name__
