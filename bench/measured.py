"""What benchmarks measured, in the engine's store: a trial is run once.

The store stands packed in a folder (docs/ has the published one) as benchmarks.sqlite.xz, beside
which the unpacked one, results.sqlite, is while trials are run. Trials are measured in processes of
their own, because their processor time and memory are compared.
"""

from __future__ import annotations

import lzma
import tempfile
from collections.abc import Callable, Iterable, Iterator
from concurrent.futures import ProcessPoolExecutor, as_completed
from contextlib import contextmanager
from pathlib import Path
from typing import Any

from sdnn.files import write_whole
from sdnn.runs.store import STORE_NAME, ResultStore

DOCS = Path(__file__).parents[1] / "docs"
PACKED = "benchmarks.sqlite.xz"

Work = tuple[Any, ...]
"""Which trial it is: words and, at the end, a seed or a number."""
Trials = dict[Work, dict[str, Any]]


def _unpack(folder: Path, into: Path) -> None:
    if not (into / STORE_NAME).exists() and (folder / PACKED).exists():
        write_whole(into / STORE_NAME, lzma.decompress((folder / PACKED).read_bytes()))


def measured(kind: str, folder: Path) -> Trials:
    """Read the trials of a benchmark, sorted; also while it runs."""
    with tempfile.TemporaryDirectory() as unpacked:
        place = folder if (folder / STORE_NAME).exists() else Path(unpacked)
        _unpack(folder, place)
        with ResultStore(place, read_only=True) as store:
            found = store.measurements(kind)
    trials = {}
    for key, content in found.items():
        *words, seed = key.split()
        trials[(*words, int(seed))] = content
    return dict(sorted(trials.items()))


@contextmanager
def _open_store(folder: Path) -> Iterator[ResultStore]:
    """Unpack the store, and pack it again, whatever happens."""
    _unpack(folder, folder)
    try:
        with ResultStore(folder) as store:
            yield store
    finally:
        unpacked = folder / STORE_NAME
        write_whole(folder / PACKED, lzma.compress(unpacked.read_bytes(), preset=9))
        unpacked.unlink()


def measure_missing(
    kind: str,
    measure: Callable[[Work], dict[str, Any]],
    asked: Iterable[Work],
    folder: Path,
    n_jobs: int = 1,
) -> None:
    """Measure the trials that are not stored, side by side; each is stored when it is done."""
    done = measured(kind, folder)
    missing = [work for work in asked if work not in done]
    if not missing:
        return
    folder.mkdir(parents=True, exist_ok=True)
    with (
        _open_store(folder) as store,
        ProcessPoolExecutor(n_jobs, max_tasks_per_child=1) as pool,
    ):
        futures = {pool.submit(measure, work): work for work in missing}
        for future in as_completed(futures):
            name = " ".join(map(str, futures[future]))
            store.put(kind, name, future.result())
            print(name, future.result(), flush=True)
