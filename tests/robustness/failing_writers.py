"""Writes files while one call after the other fails; run by test_faults.py under faults.c.

``python failing_writers.py ACTION FOLDER ERRNO...`` prints how many calls were made to fail.
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


def write_agent(folder, version):
    write_file(folder / "file", "agent", {"a": np.full(10_000, version)}, {"version": version})


def read_agent(folder):
    description, arrays = read_file(folder / "file", "agent")
    assert (arrays["a"] == description["version"]).all()
    return description["version"]


def add_trial(folder, version):
    with ResultStore(folder) as store:
        store.add(make_record(version, steps=range(1, 300)))


def extend_run(folder, version):
    with ResultStore(folder) as store:
        rows = TrialRows.from_training(ROWS[: 100 * version], 0)
        store.extend(KEY, rows, 0, config="{}", version="0.1")


def read_store(folder):
    with ResultStore(folder) as store:
        return len(store.load()), len(store.rows(KEY).table)


ACTIONS = {
    "file": (write_agent, read_agent, OSError),
    "finished trial": (add_trial, read_store, StoreError),
    "run in progress": (extend_run, read_store, StoreError),
}
"""How to write version 1 or 2 to a folder, how to read it, and the error of failed writes."""


def count_faults(action, folder, error_number):
    """Write version 2 over version 1 while call 1, 2, ... fails; return the number of calls.

    Checks after each that the folder has either version, and no other files; and that an error
    names the folder.
    """
    write, read, error_type = ACTIONS[action]
    faults = ctypes.CDLL(None)  # the functions of faults.c, which is preloaded
    before, work = folder / "before", folder / "work"
    before.mkdir()
    write(before, 1)
    names, old = sorted(path.name for path in before.iterdir()), read(before)
    shutil.copytree(before, work)
    write(work, 2)
    new = read(work)
    assert old != new
    for number in itertools.count(1):
        shutil.rmtree(work)
        shutil.copytree(before, work)
        error = None
        faults.fault_arm(str(work).encode(), ctypes.c_long(number), error_number)
        try:
            write(work, 2)
        except error_type as caught:
            error = caught
        n_calls = faults.fault_disarm()
        case = f"{action}, call {number}: {error!r}"
        assert read(work) in ((old, new) if error else (new,)), case
        assert error is None or str(work) in str(error), case
        assert sorted(path.name for path in work.iterdir()) == names, case
        if n_calls < number:  # all calls have failed in their turn, and this time none did
            return number - 1


if __name__ == "__main__":
    action, folder, *error_numbers = sys.argv[1:]
    numbers = [count_faults(action, Path(folder, e), int(e)) for e in error_numbers]
    print(sum(numbers))
