"""Runs trials on a Dask cluster that others have started.

Dask places trials and runs them again when a worker is lost. This module admits workers whose
build gives the same rows, submits as many trials as those have threads, and collects results.
"""

from __future__ import annotations

import importlib.util
import json
import logging
import pickle
import threading
import time
from collections import Counter, deque
from collections.abc import Generator, Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from queue import SimpleQueue
from typing import TYPE_CHECKING, Any

from sdnn import _core
from sdnn.files import read_bytes
from sdnn.runs.config_file import MOST_BYTES
from sdnn.runs.dask_worker import PROBE_CALL, PROGRESS_TOPIC, probe, run_on_worker
from sdnn.runs.engine import Advanced, Failed, Finished, Lost, Message, Noted, PlannedTrial, Started
from sdnn.runs.errors import ClusterError, WorkerLostError
from sdnn.runs.trial import TrialKey

if TYPE_CHECKING:
    from distributed import Client, Future

SCHEDULER_TIMEOUT = 300.0
ANSWER_SECONDS = 30.0
"""A scheduler that leaves a question unanswered for so long counts as lost."""
CONNECT_SECONDS = 5.0
NOTE_SECONDS = 5.0
"""How long to wait for a worker before saying so."""
WORKERS_SECONDS = 1.0
"""How often the list of workers is read."""
RESULTS_SECONDS = 0.02
"""How often results are collected."""
RESUME = "finished trials are stored, the same command continues from there"


class DaskExecutor:
    """Runs trials on the workers of a Dask scheduler.

    Parameters
    ----------
    scheduler
        Its address, such as ``tcp://10.0.0.1:8786``, or the path of its scheduler file.
    scheduler_timeout
        Seconds to wait for the scheduler, and for a worker that fits, before the run fails.

    Raises
    ------
    ClusterError
        If Dask is not installed.
    ValueError
        If a value is out of its range.
    """

    def __init__(self, scheduler: str, *, scheduler_timeout: float = SCHEDULER_TIMEOUT) -> None:
        if not scheduler:
            raise ValueError("scheduler must be an address or a scheduler file, got ''")
        if not 0 < scheduler_timeout < float("inf"):
            raise ValueError(
                f"scheduler_timeout must be finite and above 0, got {scheduler_timeout}"
            )
        if importlib.util.find_spec("distributed") is None:
            raise ClusterError(
                'trials on a cluster need Dask, which is not installed: pip install "sdnn[dask]"'
            )
        self.scheduler = scheduler
        self.scheduler_timeout = scheduler_timeout

    def run(
        self, planned: Sequence[PlannedTrial], stop: threading.Event
    ) -> Generator[Message, None, None]:
        """Run the trials; see `sdnn.runs.engine.Executor`.

        Raises
        ------
        ClusterError
            If the scheduler is lost, or there is no fitting worker for too long.
        """
        with _quiet():
            client = yield from self._connect(stop)
            if client is None:
                return
            try:
                yield from _Run(self, client, planned).messages(stop)
            except (OSError, TimeoutError) as error:
                raise ClusterError(
                    f"lost the scheduler at {self.scheduler} ({error}); {RESUME}"
                ) from error
            finally:
                client.close(timeout=CONNECT_SECONDS)

    def _connect(self, stop: threading.Event) -> Generator[Message, None, Client | None]:
        from distributed import Client

        is_noted = False
        deadline = time.monotonic() + self.scheduler_timeout
        while not stop.is_set():
            try:
                address = self._address()
                left = max(0.1, deadline - time.monotonic())
                return Client(address, timeout=min(CONNECT_SECONDS, left), set_as_default=False)
            except OSError as error:
                if time.monotonic() > deadline:
                    raise ClusterError(
                        f"no scheduler at {self.scheduler}: {error}; waited"
                        f" {self.scheduler_timeout:g} s; {RESUME}"
                    ) from error
                if not is_noted:
                    is_noted = True
                    yield Noted(f"waiting for the scheduler at {self.scheduler}")
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


@contextmanager
def _quiet() -> Iterator[None]:
    """Silence what Dask logs about lost connections: the run ends with one message about them."""
    import distributed  # noqa: F401  (its import sets the levels)

    loggers = [logging.getLogger(f"distributed{part}") for part in ("", ".client", ".core")]
    levels = [logger.level for logger in loggers]
    try:
        for logger in loggers:
            logger.setLevel(logging.CRITICAL)
        yield
    finally:
        for logger, level in zip(loggers, levels, strict=True):
            logger.setLevel(level)


@dataclass(frozen=True)
class _Task:
    planned: PlannedTrial
    future: Future
    workers: frozenset[str]
    is_alone: bool


class _Run:
    """The trials of one run."""

    def __init__(
        self, executor: DaskExecutor, client: Client, planned: Sequence[PlannedTrial]
    ) -> None:
        from distributed import as_completed

        self._executor, self._client = executor, client
        self._waiting, self._suspects = deque(planned), deque[PlannedTrial]()
        self._running: dict[str, _Task] = {}
        self._n_submitted: Counter[TrialKey] = Counter()
        self._completed = as_completed(loop=client.loop, with_results=True, raise_errors=False)
        self._progress: SimpleQueue[tuple[str, int]] = SimpleQueue()
        self._threads: dict[str, int] = {}  # of the workers that fit
        self._refused: dict[str, str] = {}
        self._served = time.monotonic()
        self._is_noted = False
        self._probes: list[tuple[bytes, str]] = []
        probed = set()
        for one in planned:
            kind = (one.key.agent, one.spec.is_compiled)
            if kind not in probed:
                try:
                    self._probes.append((pickle.dumps(one), probe(one)))
                except Exception:  # it fails when it is run, as with every executor
                    continue
                probed.add(kind)

    def messages(self, stop: threading.Event) -> Generator[Message, None, None]:
        """Run until every trial is finished or failed, or `stop` is set."""
        self._client.subscribe_topic(
            PROGRESS_TOPIC, lambda event: self._progress.put(tuple(event[1]))
        )
        looked = float("-inf")
        while self._waiting or self._suspects or self._running:
            if time.monotonic() - looked > WORKERS_SECONDS:
                yield from self._look_at_workers()
                looked = time.monotonic()
            yield from self._submit()
            if stop.wait(RESULTS_SECONDS):
                return
            while not self._progress.empty():
                key, episode = self._progress.get()
                if key in self._running:
                    yield Advanced(self._running[key].planned, episode)
            for future, result in self._completed.next_batch(block=False):
                if future.key in self._running:
                    yield from self._complete(self._running.pop(future.key), result)

    def _look_at_workers(self) -> Generator[Message, None, None]:
        """Admit new workers that fit, and submit again what waits for lost ones only."""
        client = self._client
        threads = client.sync(client.scheduler.ncores, callback_timeout=ANSWER_SECONDS)
        new = [one for one in threads if one not in self._threads and one not in self._refused]
        found: dict[str, Any] = {}
        if new:
            given = {"trials": [trial for trial, _ in self._probes]}
            found = client.run(eval, PROBE_CALL, given, workers=new, on_error="return")
        self._threads = {one: threads[one] for one in threads if one in self._threads}
        for worker, answer in found.items():
            if isinstance(answer, OSError):
                continue  # it was lost meanwhile
            reason = self._mismatch(answer)
            if reason:
                self._refused[worker] = f"worker {worker} was refused, {reason}"
                yield Noted(self._refused[worker])
            else:
                self._threads[worker] = threads[worker]
        for key, task in list(self._running.items()):
            if task.workers.isdisjoint(self._threads):
                del self._running[key]
                task.future.cancel()
                yield Lost(task.planned)
                (self._suspects if task.is_alone else self._waiting).appendleft(task.planned)
        if self._threads:
            self._served = time.monotonic()
            self._is_noted = False
            return
        waited = time.monotonic() - self._served
        if waited > NOTE_SECONDS and not self._is_noted:
            self._is_noted = True
            yield Noted(f"waiting for workers at {self._executor.scheduler}")
        if waited > self._executor.scheduler_timeout:
            refusals = [text for one, text in self._refused.items() if one in threads]
            raise ClusterError(
                f"no worker at {self._executor.scheduler}{' fits: ' * bool(refusals)}"
                f"{'; '.join(refusals)}; waited {self._executor.scheduler_timeout:g} s; {RESUME}"
            )

    def _mismatch(self, answer: Any) -> str:
        """Return why a worker gets no trials, or nothing if it fits."""
        if isinstance(answer, BaseException):
            return f"it cannot run these trials: {type(answer).__name__}: {answer}"
        version, probes = answer
        if version != _core.__version__:
            return f"it has sdnn {version}, this is sdnn {_core.__version__}"
        if isinstance(probes, str):
            return f"it cannot run these trials: {probes}"
        if probes != [ours for _, ours in self._probes]:
            return f"its build of sdnn {version} does not give the rows of this one"
        return ""

    def _submit(self) -> Generator[Message, None, None]:
        """Submit a trial for each free thread; suspects one by one, when all others are done."""
        is_alone = not self._waiting and not self._running
        trials = self._suspects if is_alone else self._waiting
        n_free = sum(self._threads.values()) - len(self._running)
        for _ in range(min(n_free, 1 if is_alone else n_free, len(trials))):
            planned = trials.popleft()
            yield Started(planned)
            try:
                settings, trial = planned.spec.canonical_json(), pickle.dumps(planned)
            except Exception as error:
                yield Failed(planned, error)
                continue
            # The identity of a trial is its key: drivers with the same trial share its result. A
            # trial that is submitted again has a number, because Dask remembers how a key ended.
            again = self._n_submitted[planned.key]
            self._n_submitted[planned.key] += 1
            key = "-".join(map(str, ("trial", _core.__version__, *planned.key, again)))
            future = self._client.submit(
                run_on_worker, _core.__version__, settings, trial,
                key=key, workers=list(self._threads), allow_other_workers=False,
            )  # fmt: skip
            self._running[key] = _Task(planned, future, frozenset(self._threads), is_alone)
            self._completed.add(future)

    def _complete(self, task: _Task, result: Any) -> Generator[Message, None, None]:
        """Tell how a trial ended."""
        from distributed.scheduler import KilledWorker

        planned, status = task.planned, task.future.status
        task.future.release()
        if status == "error" and not isinstance(result[1], KilledWorker):
            yield Failed(planned, result[1])
        elif status == "error" and task.is_alone:
            lost = f"worker after worker was lost with this trial: {result[1]}"
            yield Failed(planned, WorkerLostError(lost))
        elif status == "error":
            yield Lost(planned)
            self._suspects.append(planned)
        elif status != "finished":
            raise OSError("it does not know the trials any more")
        elif result is None:  # another driver cancelled it
            yield Lost(planned)
            self._waiting.append(planned)
        else:
            yield Advanced(planned, planned.spec.length)
            yield Finished(planned, result)
