"""Records of trials that were never run, and changes of a store from outside."""

import hashlib
import sqlite3
import subprocess
import sys
from contextlib import closing
from dataclasses import replace

import numpy as np

from sdnn.runs import TrialKey, TrialRecord, TrialRows


def hash_of(config):
    return hashlib.sha256(config.encode()).hexdigest()[:16]


def execute(path, statement):
    """Execute a statement of SQL as another program would, commit it, and return its first row."""
    with closing(sqlite3.connect(path, isolation_level=None)) as connection:
        return connection.execute(statement).fetchone()


def make_record(trial=0, config="{}", steps=(50, 7), returns=None, **changes):
    """Return a record whose evaluations, every 10 episodes, took these steps; 50 is a failure."""
    n = len(steps)
    rows = TrialRows.of_tests(
        episode=10 * np.arange(1, n + 1, dtype=np.int32),
        steps=np.array(steps, np.int32),
        episode_return=np.linspace(-5.0, 0.1, n) if returns is None else np.asarray(returns, float),
        solved=np.array(steps) < 50,
    )
    record = TrialRecord(
        key=TrialKey("s4", "sdnn-c", trial, 2**63 - 1, hash_of(config)),
        config=config,
        version="0.1",
        n_decisions=57,
        seconds=0.5,
        finished_at="2026-01-01T00:00:00+00:00",
        rows=rows,
    )
    return replace(record, **changes)


KILLED = """
import os, sqlite3, sys
connection = sqlite3.connect(sys.argv[1], isolation_level=None)
connection.execute("PRAGMA cache_size = 1")
connection.execute("BEGIN IMMEDIATE")
for i in range(300):
    connection.execute(f"CREATE TABLE t{i} (x)")
os._exit(0)
"""


def hot_journal(path):
    """Leave the database and journal of a process that was killed in its first transaction."""
    subprocess.run([sys.executable, "-c", KILLED, str(path)], check=True)
    return path.with_name(f"{path.name}-journal")
