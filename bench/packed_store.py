"""Packs a store of results into a small file, and unpacks it.

    python bench/packed_store.py docs/studies/assumptions.npz.xz results
    python bench/packed_store.py --pack docs/studies/assumptions.npz.xz results

The file is compressed and has each column of all finished trials in one piece, so it is a sixth of
a compressed store. Only this script reads it: what is unpacked is a store like any other.
"""

from __future__ import annotations

import argparse
import json
import lzma
import sqlite3
import tempfile
from contextlib import closing
from io import BytesIO
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdnn.runs.errors import StoreError
from sdnn.runs.store import STORE_NAME, ResultStore
from sdnn.runs.trial import ROW, TrialKey, TrialRecord, TrialRows
from sdnn.support.files import write_whole

FIELDS = ("key", "config", "version", "n_decisions", "seconds", "finished_at")
COUNTERS = ("number", "part", "episode", "step", "environment")
"""Columns of rows in which neighbours differ by little."""
GOAL_REWARD = 10.0
"""The acrobot's; what remains of a return are penalties."""


def pack(folder: Path) -> bytes:
    """Return the finished trials and the measurements of a folder's store."""
    with ResultStore(folder, read_only=True) as store:
        records = store.load()
        measurements = {kind: store.measurements(kind) for kind in _kinds(store.path)}
    configs = sorted({record.config for record in records})
    places = {config: place for place, config in enumerate(configs)}
    about: dict[str, Any] = {name: [getattr(record, name) for record in records] for name in FIELDS}
    about["config"] = [places[config] for config in about["config"]]
    about["length"] = [len(record.rows.table) for record in records]
    text = json.dumps({"configs": configs, "runs": about, "measurements": measurements})
    arrays = {"text": np.frombuffer(text.encode(), np.uint8)}
    if records:
        tables = [record.rows.table for record in records]
        arrays |= _columns(tables)
        pairs = zip(tables, _tables(arrays, about["length"]), strict=True)
        if not all(table.tobytes() == unpacked.tobytes() for table, unpacked in pairs):
            raise ValueError(f"the rows in {folder} are not those of episodes that can be packed")
    content = BytesIO()
    np.savez(content, **arrays)
    return lzma.compress(content.getvalue(), preset=9 | lzma.PRESET_EXTREME)


def unpack(content: bytes, folder: Path) -> None:
    """Make the store that `pack` read; FileExistsError if the folder has one."""
    if (folder / STORE_NAME).exists():
        raise FileExistsError(f"{folder} already has results: choose another folder")
    with np.load(BytesIO(lzma.decompress(content)), allow_pickle=False) as arrays:
        about = json.loads(arrays["text"].tobytes())
        runs = about["runs"]
        tables = _tables(arrays, runs["length"]) if runs["length"] else []
    folder.mkdir(parents=True, exist_ok=True)
    with tempfile.TemporaryDirectory(dir=folder) as beside:
        with ResultStore(beside) as store:
            store._connection.execute("PRAGMA synchronous = OFF")  # nothing to lose yet
            for number, table in enumerate(tables):
                record = {name: runs[name][number] for name in FIELDS}
                record["config"] = about["configs"][record["config"]]
                record["key"] = TrialKey(*record["key"])
                store.add(TrialRecord(**record, rows=TrialRows(table)))
            for kind, results in about["measurements"].items():
                for key, measurement in results.items():
                    store.put(kind, key, measurement)
        store.path.replace(folder / STORE_NAME)


def _kinds(path: Path) -> list[str]:
    """Return the kinds of a store's measurements."""
    with closing(sqlite3.connect(f"{path.absolute().as_uri()}?mode=ro", uri=True)) as connection:
        results = connection.execute("SELECT DISTINCT kind FROM measurements ORDER BY kind")
        return [kind for (kind,) in results]


def _columns(tables: list[NDArray[np.void]]) -> dict[str, NDArray[Any]]:
    """Return the columns of rows such that they compress well."""
    rows = {name: np.concatenate([table[name] for table in tables]) for name in ROW.names or ()}
    kinds, rows["kind"] = np.unique(rows["kind"], return_inverse=True)
    rows["kinds"] = kinds
    if _small(rows["return"]).dtype.kind != "f":
        rows["return"] = rows["return"] - GOAL_REWARD * rows["terminated"]
    rows["terminated"] = rows["terminated"] ^ (rows["length"] < _longest(tables))
    for name in COUNTERS:
        rows[name] = np.diff(rows[name], prepend=0)
    return {name: _small(column) for name, column in rows.items()}


def _tables(arrays: Any, lengths: list[int]) -> list[NDArray[np.void]]:
    """Return the rows of each trial."""
    table = np.empty(sum(lengths), ROW)
    for name in ROW.names or ():
        table[name] = arrays[name]
    for name in COUNTERS:
        table[name] = np.cumsum(table[name])
    table["kind"] = arrays["kinds"][arrays["kind"]]
    tables = np.split(table, np.cumsum(lengths)[:-1])
    table["terminated"] ^= table["length"] < _longest(tables)
    if arrays["return"].dtype.kind != "f":
        table["return"] += GOAL_REWARD * table["terminated"]
    return tables


def _longest(tables: list[NDArray[np.void]]) -> NDArray[np.int64]:
    """Return the longest episode of each row's trial, which as a rule reached a time limit."""
    longest = [table["length"].max(initial=0) for table in tables]
    return np.repeat(longest, [len(table) for table in tables])


def _small(column: NDArray[Any]) -> NDArray[Any]:
    """Return a column in the smallest type of whole numbers that has its values, if one has."""
    if column.dtype.kind not in "iuf":
        return column
    for kind in (np.uint8, np.int8, np.int16, np.int32):
        with np.errstate(invalid="ignore"):
            small = column.astype(kind)
        if np.array_equal(small, column):
            return small
    return column


def main() -> None:
    """Pack or unpack."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("file", type=Path, help="packed file")
    parser.add_argument("folder", type=Path, help="folder of the store")
    parser.add_argument("--pack", action="store_true", help="write the file")
    options = parser.parse_args()
    try:
        if options.pack:
            write_whole(options.file, pack(options.folder))
        else:
            unpack(options.file.read_bytes(), options.folder)
    except (OSError, ValueError, lzma.LZMAError, StoreError, sqlite3.Error) as error:
        parser.error(str(error))


if __name__ == "__main__":
    main()
