"""The engine: runs the trials that a store does not hold yet, in threads or on other machines.

An executor runs trials and reports about them; it has no store. The calling thread alone writes
the store and calls the observer, and stores finished trials before it takes the next reports. What
is not stored, whatever happened to it, is missing and runs again. A trial in C++ releases Python's
lock while it advances, so threads scale over the cores.
"""

from __future__ import annotations

import math
import threading
import time
from collections.abc import Callable, Generator, Iterable, Sequence
from contextlib import closing, suppress
from dataclasses import dataclass
from functools import lru_cache
from queue import SimpleQueue
from signal import SIGINT, SIGTERM
from typing import NamedTuple, Protocol

from sdnn.agents.registry import title_of
from sdnn.runs.errors import StoreError
from sdnn.runs.spec import RunSpec
from sdnn.runs.store import ResultStore
from sdnn.runs.trial import TrainingTrial, Trial, TrialKey, TrialRecord, opened, rows_of
from sdnn.support.arguments import whole
from sdnn.support.interrupts import Interrupts, thread_pool
from sdnn.support.machine import instruction_set, n_cores
from sdnn.support.progress import ProgressBars

CHUNK_SECONDS = 0.1
"""Time between two reports of a trial, and the longest time until an interrupt acts."""


@dataclass(frozen=True)
class PlannedTrial:
    """A trial of a study: the key of its result, which has the seed, and the specification."""

    key: TrialKey
    spec: RunSpec

    @property
    def title(self) -> str:
        """The trial's name for readers, such as ``"SDNN-C s4, trial 1"``; trials count from 1."""
        return f"{title_of(self.key.agent)} {self.key.case_id}, trial {self.key.trial + 1}"

    def make(self) -> Trial | TrainingTrial:
        """Make the trial to run; see `RunSpec.make_trial`."""
        return self.spec.make_trial(self.key.seed)


# Events that executors report and observers receive.


class Begun(NamedTuple):
    """The run begins, with ``n_episodes`` to learn, or steps where budgets count these."""

    n_planned: int
    n_reused: int
    n_episodes: int


class Advanced(NamedTuple):
    """Learning episodes, or the budget's steps, that a trial has done; 0 as it starts."""

    planned: PlannedTrial
    episode: int


class Finished(NamedTuple):
    """A trial is finished; it is stored before observers receive the message."""

    planned: PlannedTrial
    record: TrialRecord


class Failed(NamedTuple):
    """A trial raised an error, or was lost with its worker too often."""

    planned: PlannedTrial
    error: Exception


class Noted(NamedTuple):
    """A text for a person, such as about a worker that was refused."""

    text: str


class Counted(NamedTuple):
    """Progress of other work than trials, such as measurements."""

    title: str
    done: int
    total: int


Message = Begun | Advanced | Finished | Failed | Noted | Counted

Observer = Callable[[Message], None]
"""Shows progress; called by the thread that runs."""


class TrialBars(ProgressBars):
    """An observer with a bar for each trial, one for all, and one for other work."""

    _n_open = 0

    def __call__(self, message: Message) -> None:
        """Update the bars by a message."""
        match message:
            case Begun(n_planned, n_reused, n_episodes):
                self._done = dict[TrialKey, int]()
                self._n_open = n_planned - n_reused
                self.add("all", self._title(), n_episodes)
            case Advanced(planned, episode):
                self._advance(planned, episode)
            case Finished(planned, _) | Failed(planned, _):  # all of its episodes count as done
                self._advance(planned, planned.spec.length)
                self.remove(planned.key)
                self._n_open -= 1
                self.update("all", sum(self._done.values()), description=self._title())
            case Noted(text):
                self.print(text)
            case Counted(title, done, total):
                self.add("counted", title, total)
                self.update("counted", done, description=title)

    def _advance(self, planned: PlannedTrial, episode: int) -> None:
        """Show the progress of a trial, and that of all trials together."""
        self.add(planned.key, planned.title, planned.spec.length)
        self._done[planned.key] = episode
        self.update(planned.key, episode)
        self.update("all", sum(self._done.values()))

    def _title(self) -> str:
        return f"[bold]all ({self._n_open} to go)"


class Executor(Protocol):
    """Runs trials somewhere, about ``jobs`` at the same time."""

    jobs: int

    def run(
        self, planned: Sequence[PlannedTrial], stop: threading.Event
    ) -> Generator[Sequence[Message], None, None]:
        """Run the trials, and yield messages until each is finished or failed.

        Messages that are there at the same time come together: their trials are stored in one
        transaction. The generator runs in the calling thread. Closing it, or setting `stop`,
        abandons running trials; no further trial starts.

        RunError if no trial can be run any more.
        """


@dataclass(frozen=True, kw_only=True)
class TrialsOutcome:
    """The result of `run_trials`.

    ``n_planned`` trials were needed, of which ``n_reused`` were stored before and ``n_run`` are
    finished and stored now; ``interrupted`` is whether it was stopped before its end, ``signal``
    the signal that did it, if any.
    """

    n_planned: int
    n_reused: int
    n_run: int
    failures: tuple[Failed, ...]
    interrupted: bool
    signal: int | None = None


@lru_cache(maxsize=1024)
def _work_of(spec: RunSpec) -> int:
    """Return an estimate of a trial's operations, to compare it with others of its study."""
    if not spec.is_compiled or spec.entry.step_work is None:
        return spec.length  # no estimate per step
    return spec.length * spec.entry.step_work(spec.core_settings()["approximator"])


def _minus_work(*team: PlannedTrial) -> int:
    """Return a key that sorts trials, or teams of them, with most work first."""
    return -sum(_work_of(planned.spec) for planned in team)


def run_trials(
    plan: Iterable[PlannedTrial],
    store: ResultStore,
    *,
    executor: Executor | None = None,
    observer: Observer | None = None,
) -> TrialsOutcome:
    """Run the planned trials that are not stored, and store each as soon as it is finished.

    They run by default in threads of this process, one for each core, and those with most work
    begin first: a long one at the end would leave other cores idle. The observer receives what
    happens. Ctrl-C and SIGTERM end the run after the chunks under way; finished trials are stored
    before it returns. A trial that raises does not stop the others.

    ValueError if the environment variable SDNN_INSTRUCTION_SET is wrong. StoreError if the store
    cannot be read or written: running trials are given up. RunError if the executor can run no
    trial any more: what was finished is stored.
    """
    instruction_set()
    planned = tuple(plan)
    stored = store.keys()
    missing = sorted((p for p in planned if p.key not in stored), key=_minus_work)
    n_reused = len(planned) - len(missing)
    failures: list[Failed] = []
    n_run = 0

    def add(finished: Sequence[Finished]) -> None:
        """Store trials one after the other; trials in C++ must have the same rows each time."""
        for message in finished:
            store.add(message.record, is_exact=message.planned.spec.is_compiled)

    def keep(ended: Sequence[Finished | Failed]) -> None:
        """Store trials that have ended together in one transaction, and note the failures."""
        nonlocal n_run
        failures.extend(message for message in ended if isinstance(message, Failed))
        finished = [message for message in ended if isinstance(message, Finished)]
        try:
            if finished:
                with store.together():
                    add(finished)
        except StoreError:  # none is stored: add those before the refused one, which raises again
            add(finished)
        n_run += len(finished)

    interrupted, signal = execute(missing, keep, executor, observer, n_reused=n_reused)
    return TrialsOutcome(
        n_planned=len(planned),
        n_reused=n_reused,
        n_run=n_run,
        failures=tuple(failures),
        interrupted=interrupted,
        signal=signal,
    )


def execute(
    planned: Sequence[PlannedTrial],
    keep: Callable[[Sequence[Finished | Failed]], None],
    executor: Executor | None,
    observer: Observer | None,
    *,
    n_reused: int = 0,
) -> tuple[bool, int | None]:
    """Run trials; ``keep`` receives those that are finished or failed, before the observer does.

    Returns whether it was interrupted, and by which signal. See `run_trials`.
    """
    observe: Observer = observer or (lambda _: None)
    observe(Begun(n_reused + len(planned), n_reused, sum(p.spec.length for p in planned)))
    stop = threading.Event()
    signals = Interrupts(stop.set, (SIGINT, SIGTERM))
    if planned:
        # Signals only set `stop`: an exception could lose a result between queue and store.
        with signals, closing((executor or ThreadExecutor()).run(planned, stop)) as batches:
            for messages in batches:
                keep([message for message in messages if isinstance(message, Finished | Failed)])
                for message in messages:
                    observe(message)
    return stop.is_set(), signals.received


def run_to_end(planned: PlannedTrial) -> Generator[Advanced | Finished, None, None]:
    """Run one trial; yield its progress about every `CHUNK_SECONDS`, and last `Finished`.

    Closing the generator abandons the trial.
    """
    begin = time.thread_time()
    record = None
    with opened(planned.make()) as trial:
        with closing(_run_in_chunks(trial)) as pieces:
            for _ in pieces:
                done = trial.done if isinstance(trial, TrainingTrial) else trial.episode
                yield Advanced(planned, done)
        if trial.finished:
            record = _make_record(planned, trial, time.thread_time() - begin)
    if record is not None:
        yield Finished(planned, record)


def _make_record(
    planned: PlannedTrial, trial: Trial | TrainingTrial, seconds: float
) -> TrialRecord:
    """Return the record of a finished trial for the store."""
    return TrialRecord(
        key=planned.key,
        config=planned.spec.canonical_json(),
        n_decisions=int(trial.n_decisions),
        seconds=seconds,
        rows=rows_of(trial),
    )


def _run_in_chunks(trial: Trial | TrainingTrial | Team) -> Generator[None, None, None]:
    """Run a trial to its end; yield at the beginning and about every `CHUNK_SECONDS`."""
    yield
    if isinstance(trial, TrainingTrial):  # its episodes may be longer than a chunk
        yield from trial.training.pieces(CHUNK_SECONDS)
        return
    chunk = 1  # episodes, adapted to their duration
    while not trial.finished:
        begin = time.monotonic()
        trial.advance(chunk)
        seconds = time.monotonic() - begin
        if seconds < CHUNK_SECONDS / 2:
            chunk *= 2
        elif seconds > 2 * CHUNK_SECONDS:
            chunk = max(1, chunk // 2)
        yield


class Team:
    """Compiled trials that advance together: the same acrobot and agent, other sensors or seeds."""

    def __init__(self, planned: Iterable[PlannedTrial]) -> None:
        self.trials = {
            trial: trial.spec.replace(seed=trial.key.seed).core_trial() for trial in planned
        }
        self._n_decisions = dict.fromkeys(self.trials, 0)
        self._seconds = dict.fromkeys(self.trials, 0.0)

    @property
    def finished(self) -> bool:
        """Whether `take_finished` has yielded every trial."""
        return not self.trials

    def advance(self, n_decisions: int) -> None:
        """Make ``n_decisions`` in every trial; each gets a share of the time by its decisions."""
        begin = time.thread_time()
        trials = tuple(self.trials.values())
        trials[0].advance_together(trials, n_decisions)
        seconds = time.thread_time() - begin
        n_new = {key: t.n_decisions - self._n_decisions[key] for key, t in self.trials.items()}
        for key, n in n_new.items():
            self._n_decisions[key] += n
            self._seconds[key] += seconds * n / sum(n_new.values())

    def take_finished(self) -> Generator[Finished, None, None]:
        """Yield the finished trials and remove them from the team."""
        for planned, trial in tuple(self.trials.items()):
            if trial.finished:
                yield Finished(planned, _make_record(planned, trial, self._seconds[planned]))
                del self.trials[planned]


MOST_TOGETHER = 8  # largest number of trials in a team: the widest vector register holds 8 doubles

MOST_TABLE_BYTES = 2**26  # largest table of an agent that runs in a team, in bytes


def teams_of(planned: Iterable[PlannedTrial], jobs: int) -> Iterable[list[PlannedTrial]]:
    """Divide trials into teams that keep ``jobs`` threads busy, those with most work first.

    Trials that are not faster together are teams of one.
    """
    by_task: dict[object, list[PlannedTrial]] = {}
    for trial in planned:
        spec = trial.spec
        task: object = trial.key  # shared with no other trial
        if spec.entry.advances_together and spec.entry.table_bytes and spec.is_compiled:
            approximator = spec.core_settings()["approximator"]
            if spec.entry.table_bytes(approximator) <= MOST_TABLE_BYTES:
                task = spec.agent.name, spec.environment.paper_settings().acrobot
        by_task.setdefault(task, []).append(trial)
    teams = []
    for similar in by_task.values():
        size = min(MOST_TOGETHER, math.ceil(len(similar) / jobs))
        teams += [similar[first : first + size] for first in range(0, len(similar), size)]
    return sorted(teams, key=lambda team: _minus_work(*team))


class ThreadExecutor:
    """Runs trials in threads of this process; ``jobs`` at a time, by default one for each core.

    ValueError if `jobs` is less than 1.
    """

    def __init__(self, jobs: int | None = None) -> None:
        self.jobs = n_cores() if jobs is None else whole("jobs", jobs, 1, 2**16)

    def run(
        self, planned: Sequence[PlannedTrial], stop: threading.Event
    ) -> Generator[Sequence[Message], None, None]:
        """Run the trials; see `Executor`."""
        messages: SimpleQueue[Message | None] = SimpleQueue()
        with thread_pool(self.jobs) as pool:
            try:
                for team in teams_of(planned, self.jobs):
                    pool.submit(_run_team, team, messages, stop)
                # Every trial ends with a message: Finished, Failed, or None if it was abandoned.
                n_open = len(planned)
                while n_open:
                    batch = [messages.get(), *(messages.get() for _ in range(messages.qsize()))]
                    n_open -= sum(not isinstance(message, Advanced) for message in batch)
                    yield [message for message in batch if message is not None]
            except BaseException:
                stop.set()
                raise


def _run_team(
    planned: Sequence[PlannedTrial], messages: SimpleQueue[Message | None], stop: threading.Event
) -> None:
    """Run trials as a team in a worker thread; after an error, run each unfinished one alone."""
    unfinished = dict.fromkeys(planned)
    if len(unfinished) > 1 and not stop.is_set():
        with suppress(BaseException):  # the trial that raised it raises it again alone
            team = Team(planned)
            for _ in _run_in_chunks(team):
                for member, running in team.trials.items():
                    messages.put(Advanced(member, running.episode))
                for finished in team.take_finished():
                    messages.put(finished)
                    del unfinished[finished.planned]
                if stop.is_set():
                    break
    for trial in unfinished:
        _run_one(trial, messages, stop)


def _run_one(
    planned: PlannedTrial, messages: SimpleQueue[Message | None], stop: threading.Event
) -> None:
    """Run one trial in a worker thread; its last message is None if it was abandoned."""
    last: Message | None = None
    try:
        with closing(run_to_end(planned)) as happening:
            for message in () if stop.is_set() else happening:
                if isinstance(message, Finished):
                    last = message
                elif stop.is_set():
                    break
                else:
                    messages.put(message)
    except Exception as error:
        last = Failed(planned, error)
    except BaseException as error:  # SystemExit would end the thread without any message
        failure = RuntimeError(f"the trial raised {error!r}")
        failure.__cause__ = error
        last = Failed(planned, failure)
    messages.put(last)
