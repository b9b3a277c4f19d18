"""Writes files while one call after the other fails; run by test_faults.py under faults.c.

``python failing_writers.py ACTION FOLDER ERROR...`` prints how many calls were made to fail.
"""

import ctypes
import itertools
import shutil
import sys
from pathlib import Path

import numpy as np

from made_records import make_record
from sdnn.runs import ResultStore, StoreError, TrialRows
from sdnn.support.files import read_file, write_file

ROWS = [
    {"kind": "episode", "step": n, "episode": n, "return": 1.0, "length": 1, "terminated": True}
    for n in range(200)
]
KEY = make_record(9).key


def write(folder, number):
    write_file(folder / "file", "agent", {"a": np.full(10_000, number)}, {"number": number})


def content(folder):
    description, arrays = read_file(folder / "file", "agent")
    assert (arrays["a"] == description["number"]).all()
    return description["number"]


def add(folder, number):
    with ResultStore(folder) as store:
        store.add(make_record(number, steps=range(1, 300)))


def extend(folder, number):
    with ResultStore(folder) as store:
        rows = TrialRows.from_training(ROWS[: 100 * number], 0)
        store.extend(KEY, rows, 0, config="{}", version="0.1")


def stored(folder):
    with ResultStore(folder) as store:
        return len(store.load()), len(store.rows(KEY).table)


ACTIONS = {
    "file": (write, content, OSError),
    "finished trial": (add, stored, StoreError),
    "run in progress": (extend, stored, StoreError),
}


def n_faults(action, folder, error_number):
    """Let every call fail in turn; give their number."""
    act, look, kind = ACTIONS[action]
    faults = ctypes.CDLL(None)
    before, work = folder / "before", folder / "work"
    before.mkdir()
    act(before, 1)
    names, old = sorted(p.name for p in before.iterdir()), look(before)
    shutil.copytree(before, work)
    act(work, 2)
    new = look(work)
    assert old != new
    for number in itertools.count(1):
        shutil.rmtree(work)
        shutil.copytree(before, work)
        error = None
        faults.fault_arm(str(work).encode(), ctypes.c_long(number), error_number)
        try:
            act(work, 2)
        except kind as caught:
            error = caught
        n_calls = faults.fault_disarm()
        where = f"{action}, call {number}: {error!r}"
        content = look(work)
        assert content in ((old, new) if error else (new,)), where
        assert error is None or str(work) in str(error), where
        assert sorted(p.name for p in work.iterdir()) == names, where
        if n_calls < number:
            return number - 1


if __name__ == "__main__":
    print(sum(n_faults(sys.argv[1], Path(sys.argv[2]) / str(e), e) for e in map(int, sys.argv[3:])))
