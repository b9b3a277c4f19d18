"""Runs what a store of benchmarks lacks, by the engine's loop, and reads what it holds.

The store is packed in a folder (docs/evidence/ has the published one): benchmarks.npz.xz. While
something runs it is unpacked beside it, and stays so after a kill or an error: the same command
continues from there, and packs it once it ends.

Each script has the options of `options`. Its work is a list of keys; what the store holds under a
key is not measured again.
"""

from __future__ import annotations

import argparse
import importlib
import json
import multiprocessing
import pickle
import signal
import sys
import tempfile
import threading
from collections import defaultdict, deque
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from contextlib import AbstractContextManager, contextmanager
from dataclasses import dataclass
from multiprocessing.connection import wait
from pathlib import Path
from typing import Any

from packed_store import pack, unpack
from rich.console import Console

import sdnn
from sdnn.runs.engine import (
    Advanced,
    Executor,
    Failed,
    Finished,
    PlannedTrial,
    TrialBars,
    run_trials,
)
from sdnn.runs.store import STORE_NAME, ResultStore
from sdnn.support.files import write_whole

EVIDENCE = Path(__file__).parents[1] / "docs" / "evidence"
PACKED = "benchmarks.npz.xz"
POLL_SECONDS = 0.1  # longest wait for messages before an interrupt is noticed

Key = tuple[Any, ...]
"""The name of a measurement among those of its kind: texts and numbers that JSON can hold."""


def options(doc: str, *, seeds: int, jobs: int = 1) -> argparse.ArgumentParser:
    """Make the parser of a script."""
    parser = argparse.ArgumentParser(description=doc.partition("\n")[0])
    parser.add_argument("--seeds", type=int, default=seeds, help="repetitions (%(default)s)")
    parser.add_argument("--only", nargs="*", default=(), metavar="WORD", help="words of the keys")
    parser.add_argument("--jobs", type=int, default=jobs, help="processes (%(default)s)")
    parser.add_argument("--folder", type=Path, default=EVIDENCE, help="of store, figures and pages")
    parser.add_argument("--redraw", action="store_true", help="measure nothing")
    parser.add_argument("--full", action="store_true", help="print what pages leave out, too")
    return parser


def is_wanted(key: Key, arguments: argparse.Namespace) -> bool:
    """Return whether a key has all the words of --only."""
    return set(arguments.only) <= set(" ".join(map(str, key)).split())


def measured(kind: str, folder: Path = EVIDENCE) -> dict[Key, dict[str, Any]]:
    """Read the measurements of a kind, sorted; also while they are being made."""
    with tempfile.TemporaryDirectory() as unpacked:
        place = folder if (folder / STORE_NAME).exists() else Path(unpacked)
        _unpack(folder, place)
        with ResultStore(place, read_only=True) as store:
            results = store.measurements(kind)
    return dict(sorted((tuple(json.loads(key)), content) for key, content in results.items()))


def grouped(kind: str, folder: Path, n_dropped: int = 1) -> defaultdict[Key, list[dict[str, Any]]]:
    """Read the measurements of a kind by their keys without the last part: seed, fold or trial.

    ``n_dropped`` such parts are dropped. Other keys have no measurements.
    """
    groups = defaultdict(list)
    for key, row in measured(kind, folder).items():
        groups[key[:-n_dropped]].append(row)
    return groups


def measure_missing(
    kind: str,
    measure: Callable[..., Mapping[str, Any]],
    keys: Iterable[Key],
    arguments: argparse.Namespace,
    *,
    apart: bool = False,
) -> None:
    """Measure what is not stored; store each result immediately.

    A measurement that fails is reported, and does not stop the others.

    Parameters
    ----------
    kind
        The name of these measurements in the store.
    measure
        Returns the measurement of a key, whose parts are its arguments.
    keys
        The measurements to make.
    arguments
        The command's, as of `options`: --only chooses among the keys, --redraw measures nothing.
    apart
        Whether each is measured in a separate process, `jobs` at a time.
    """
    plan = [Work(key, Measure(measure)) for key in keys if is_wanted(key, arguments)]
    executor = Processes(_measure, arguments.jobs) if apart else Here(_measure)
    if not arguments.redraw:
        run_missing(plan, executor, arguments.folder, lambda store: _Measurements(store, kind))


def run_missing(
    plan: Sequence[PlannedTrial],
    executor: Executor,
    folder: Path,
    view: Callable[[ResultStore], Any],
) -> None:
    """Run what is missing in a view of the folder's store; exit if it was interrupted."""
    with (
        opened(folder) as store,
        TrialBars(Console(stderr=True)) as bars,
    ):
        outcome = run_trials(plan, view(store), executor=executor, observer=bars)
    for failure in outcome.failures:
        print(f"{failure.planned.key} failed: {failure.error!r}", file=sys.stderr)
    print(f"{outcome.n_run} measured, {outcome.n_reused} were stored", file=sys.stderr)
    if outcome.interrupted:
        raise SystemExit(130)


def _unpack(folder: Path, into: Path) -> None:
    """Unpack a folder's store into a folder that has none; nothing where there is none packed."""
    if not (into / STORE_NAME).exists() and (folder / PACKED).exists():
        unpack((folder / PACKED).read_bytes(), into)


@contextmanager
def opened(folder: Path) -> Iterator[ResultStore]:
    """Unpack a folder's store; pack it at the end of the block, and remove the unpacked one.

    After an error in the block the unpacked store stays, and is continued next time.
    """
    folder.mkdir(parents=True, exist_ok=True)
    _unpack(folder, folder)
    unpacked = folder / STORE_NAME
    before = unpacked.read_bytes() if unpacked.exists() else b""
    with ResultStore(folder) as store:
        yield store
    if unpacked.read_bytes() != before or not (folder / PACKED).exists():
        write_whole(folder / PACKED, pack(folder))
    unpacked.unlink()


@dataclass(frozen=True)
class Measure:
    """A measurement for a key, in the place of the engine's specification."""

    measure: Callable[..., Mapping[str, Any]]
    length: int = 1
    is_compiled: bool = False


@dataclass(frozen=True)
class Work(PlannedTrial):
    """A measurement, as the engine plans a trial."""

    @property
    def title(self) -> str:
        """Its key."""
        return " ".join(map(str, self.key))


def _measure(work: Work, advanced: Callable[[int], None]) -> tuple[Key, dict[str, Any]]:
    return work.key, {**work.spec.measure(*work.key), "version": sdnn.__version__}


@dataclass(frozen=True)
class _Measurements:
    """The measurements of a kind, as the engine sees a store."""

    store: ResultStore
    kind: str

    def keys(self) -> set[Key]:
        return {tuple(json.loads(key)) for key in self.store.measurements(self.kind)}

    def together(self) -> AbstractContextManager[None]:
        return self.store.together()

    def add(self, results: tuple[Key, dict[str, Any]], *, is_exact: bool) -> None:
        key, content = results
        self.store.put(self.kind, json.dumps(key), content)


Run = Callable[[Any, Callable[[int], None]], Any]
"""Runs a planned trial and returns its results; its second argument reports finished episodes."""


@dataclass(frozen=True)
class Here:
    """An executor that runs in this process, one trial after the other."""

    run_one: Run

    def run(self, planned: Sequence[PlannedTrial], stop: threading.Event) -> Iterator[Any]:
        """Run them; see `sdnn.runs.engine.Executor`."""
        for item in planned:
            if stop.is_set():
                return
            yield [Advanced(item, 0)]
            yield [_outcome(self.run_one, item, lambda done: None)]


@dataclass(frozen=True)
class Processes:
    """An executor that runs each trial in a new process, with separate memory and processor time.

    The process first imports the modules that register agents: a pickled trial may need them.
    """

    run_one: Run
    jobs: int
    imports: tuple[str, ...] = ()

    def run(self, planned: Sequence[PlannedTrial], stop: threading.Event) -> Iterator[Any]:
        """Run them; see `sdnn.runs.engine.Executor`."""
        context = multiprocessing.get_context("spawn")
        waiting, running = deque(planned), {}
        try:
            while (waiting or running) and not stop.is_set():
                while waiting and len(running) < self.jobs:
                    item = waiting.popleft()
                    receiver, sender = context.Pipe(duplex=False)
                    content = pickle.dumps((self.run_one, item))
                    process = context.Process(target=_work, args=(sender, self.imports, content))
                    process.start()
                    sender.close()
                    running[receiver] = process, item
                    yield [Advanced(item, 0)]
                for receiver in wait(list(running), POLL_SECONDS):
                    process, item = running[receiver]
                    try:
                        kind, *values = receiver.recv()
                    except EOFError:
                        process.join()
                        kind, values = Failed, [RuntimeError(f"ended with {process.exitcode}")]
                    if kind is not Advanced:
                        del running[receiver]
                    yield [kind(item, *values)]
        finally:
            for process, _ in running.values():
                process.kill()


def _work(sender: Any, imports: Sequence[str], content: bytes) -> None:
    """Run a pickled pair of `Run` and trial, and send messages: the life of a process."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the first process decides
    try:
        for module in imports:
            importlib.import_module(module)
        run, item = pickle.loads(content)
        outcome = _outcome(run, item, lambda done: sender.send((Advanced, done)))
    except Exception as error:
        outcome = Failed(None, error)
    sender.send((type(outcome), outcome[1]))


def _outcome(run: Run, item: Any, advanced: Callable[[int], None]) -> Finished | Failed:
    try:
        return Finished(item, run(item, advanced))
    except Exception as error:
        return Failed(item, error)
