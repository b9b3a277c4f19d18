"""Readers of files in Python, each with small good files and changes that get past checksums.

An execution has a number, which gives its input again: `execute` says what is wrong with how a
reader takes it, or nothing. Files are in the present folder, best one in memory.
"""

import dataclasses
import functools
import hashlib
import json
import math
import os
import sqlite3
import sys
import tempfile
import zlib
from contextlib import suppress
from pathlib import Path

import gymnasium as gym
import numpy as np

sys.path.append(str(Path(__file__).parents[1] / "python" / "reference"))
import damaged_files
from agent_files import SMALL
from checksums import BEFORE, with_checksum
from made_records import make_record
from mutated_files import Reader, with_other_bytes, with_other_contents, written
from sdnn.agents import (
    FuzzyQLearning,
    RBFQLearning,
    SDNNQLambda,
    SDNNQLearning,
    Training,
    load_agent,
)
from sdnn.approximators import FuzzyRulesConfig, LinearSDNNConfig, RBFNetworkConfig
from sdnn.runs import ResultStore, StoreError, TrialRows
from sdnn.runs.trial import HASH_DIGITS, ROW
from sdnn.training.files import read_statistics

BOX = gym.spaces.Box(-1.0, 1.0, (2,), np.float64)
GEAR = gym.spaces.Discrete(3)


class Env(gym.Env):
    """Ends after five steps; never gets an action that it does not have."""

    observation_space = BOX

    def __init__(self, action_space):
        self.action_space = action_space

    def reset(self, *, seed=None, options=None):
        self.n_steps = 0
        return np.full(2, 0.125), {}

    def step(self, action):
        assert action in self.action_space, f"the environment got {action!r}"
        self.n_steps += 1
        return np.full(2, 0.125 * self.n_steps), 1.0, self.n_steps == 5, False, {}


def made_agents():
    rules = FuzzyRulesConfig(n_sets=3, n_actions=3)
    bases = RBFNetworkConfig(n_bases=3, n_actions=3)
    linear = LinearSDNNConfig(n_pattern_units=12, n_anchor_patterns=4, n_interpolated=6)
    return (
        SDNNQLearning(BOX, GEAR, approximator=SMALL),
        SDNNQLearning(BOX, BOX, approximator=SMALL),
        RBFQLearning(BOX, GEAR, approximator=bases),
        FuzzyQLearning(BOX, BOX, approximator=rules),
        SDNNQLambda(BOX, GEAR, approximator=linear),
    )


def trainings():
    def save(agent, path):
        training = Training(agent, Env(agent.action_space), steps=8)
        training.run()
        training.save(path)

    return written(*(functools.partial(save, agent) for agent in made_agents()))


def read_agent(path):
    agent = load_agent(path)
    space = agent.observation_space
    if space == BOX:  # others may be of any size
        action = agent.act(np.zeros(2))
        assert action in agent.action_space, f"the action is {action!r}"


ENVS = (Env(GEAR), Env(BOX))


def read_training(path):
    Training.load(path, ENVS[rb"action_space\":{\"discrete" not in path.read_bytes()])


def statistics():
    numbers = {"dtype": "<f8", "shape": [2], "values": "AAAAAAAA8D8AAAAAAADwPw=="}
    one = {"wrapper": "NormalizeObservation", "numbers": {"obs_rms.mean": numbers}}
    return [json.dumps([one, one]).encode()]


def read_numbers(path):
    read_statistics(json.loads(path.read_bytes()))


@functools.cache
def small_store():
    """The bytes of a store whose pages are small, and so few."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "results.sqlite"
        connection = sqlite3.connect(path)
        connection.execute("PRAGMA page_size = 512")
        connection.execute("VACUUM")
        connection.close()
        with ResultStore(folder) as results:
            for trial in range(2):
                results.add(make_record(trial))
            results.put("cost", "key", {"seconds": 1.5})
        return path.read_bytes()


def read_results(results):
    results.load()
    results.seconds()
    results.keys(unfinished=True)
    results.measurements("cost")


def read_store(path):
    with ResultStore(path.parent, read_only=True) as results:
        read_results(results)


STUDY = b"""[study]
title = "Two"
trials = 2
reference = "base"
[base]
environment = "Pendulum-v1"
budget.steps = 1000
protocol.evaluate_every = 500
[cases.a]
learning.epsilon = 0.2
[axes]
"learning.discount" = [0.9, 0.5]
[variants.rbf]
agent = "rbf"
title = "RBF"
"""


def with_other_header(data, random):
    """Change the header or the numbers of a file, whatever fits, under the right checksum."""
    length = int.from_bytes(data[:8], "little")
    start = len(BEFORE) + 8
    beginning, header, body = data[8 : 8 + start], data[8 + start : 8 + length], data[8 + length :]
    kind = random.randint(8)
    if kind == 0:
        body = with_other_bytes(body, random)
    elif kind == 1:
        header = with_other_array(beginning + header, random)[start:]
    else:
        header = with_other_bytes(header, random)
    header += b" " * (-(start + len(header)) % 8)
    whole = (start + len(header)).to_bytes(8, "little") + beginning + header + body
    return with_checksum(whole)


SAME_SIZE = ("BOOL U8 I8", "U16 I16 F16", "U32 I32 F32", "U64 I64 F64")


def with_other_array(header, random):
    """Let an array have another type or shape, of as many bytes."""
    values = json.loads(header)
    names = sorted(values.keys() - {"__metadata__"})
    array = values[names[random.randint(len(names))]]
    shape = array["shape"]
    (kinds,) = (one.split() for one in SAME_SIZE if array["dtype"] in one.split())
    if random.randint(2):
        array["dtype"] = kinds[random.randint(len(kinds))]
    else:
        array["shape"] = ([*shape, 1], [1, *shape], [math.prod(shape)], shape[::-1])[
            random.randint(4)
        ]
    return json.dumps(values, separators=(",", ":")).encode()


REFUSALS = (ValueError, OSError)
TARGETS = {
    **damaged_files.READERS,
    "agent": Reader(
        "agent.safetensors",
        lambda: written(*(agent.save for agent in made_agents())),
        read_agent,
        REFUSALS,
    ),
    "training": Reader("checkpoint.safetensors", trainings, read_training, REFUSALS),
    "statistics": Reader("statistics.json", statistics, read_numbers, REFUSALS),
    "store": Reader("results.sqlite", lambda: [small_store()], read_store, (StoreError,)),
    "study": dataclasses.replace(damaged_files.READERS["study"], good=lambda: [STUDY]),
}
"""Readers of the matrix of damaged files, some with files that are quicker to read."""

VALUES = (0, 1, -1, 2**31, 2**63 - 1, -(2**63), 0.5, 1e400, None, "", "x", "{}", "[]", "NaN",
          "\ud800".encode("utf-8", "surrogatepass"), b"", b"\0" * 9, "x" * 9999,
          "[" * 5000)  # fmt: skip


@functools.cache
def opened_store():
    Path("results.sqlite").write_bytes(small_store())
    return ResultStore(Path.cwd())


def change_rows(connection, random):
    """Set some values of the tables to others, and most checksums right again."""
    for _ in range(random.randint(1, 4)):
        table = ("runs", "rows", "measurements")[random.randint(3)]
        columns = [row[1] for row in connection.execute(f"PRAGMA table_info({table})")]
        column = columns[random.randint(len(columns))]
        value = VALUES[random.randint(len(VALUES))]
        if random.randint(3) == 0:  # a little changed
            (old,) = connection.execute(f'SELECT "{column}" FROM {table} LIMIT 1').fetchone() or "x"
            value = with_other_bytes(str(old).encode(), random).decode("utf-8", "replace")
        connection.execute(f'UPDATE OR IGNORE {table} SET "{column}" = ?', (value,))
    if random.randint(4):
        repair(connection)


def repair(connection):
    for run_id, config in connection.execute("SELECT id, config FROM runs").fetchall():
        rows = connection.execute(
            "SELECT number, part, kind, episode, ifnull(step, -1), length, \"return\", terminated,"
            " ifnull(environment, -1) FROM rows WHERE run_id = ? ORDER BY number, part", (run_id,)
        ).fetchall()  # fmt: skip
        table = np.zeros(len(rows), ROW)
        try:
            for i, row in enumerate(rows):
                table[i] = row
            checksum = TrialRows(table).checksum()
        except (TypeError, ValueError, OverflowError):
            checksum = "none"
        digest = hashlib.sha256(str(config).encode("utf-8", "replace")).hexdigest()
        connection.execute(
            "UPDATE OR IGNORE runs SET config_hash = ?, checksum = ? WHERE id = ?",
            (digest[:HASH_DIGITS], checksum, run_id),
        )
    for table, key in (("runs", "id"), ("measurements", "key")):
        for row in connection.execute(f"SELECT * FROM {table}").fetchall():
            crc = zlib.crc32(repr(row[:-1]).encode("utf-8", "surrogatepass"))
            index = 0 if key == "id" else 1
            connection.execute(f"UPDATE {table} SET crc = ? WHERE {key} = ?", (crc, row[index]))


def execute_rows(number):
    """Read a store whose rows were changed by SQL; at last they are as before."""
    results, random = opened_store(), random_of(number)
    connection = results._connection
    try:
        with suppress(sqlite3.Error):
            change_rows(connection, random)
        read_results(results)
    except StoreError as error:
        return said(error)
    finally:
        connection.rollback()
    return ""


def said(error):
    return "" if len(str(error)) > 10 else f"says no more than {error!r}"


BITS = np.random.PCG64(0)
RANDOM = np.random.RandomState(BITS)


def random_of(number):
    """The random numbers of an execution; to seed new ones would take a third of its time."""
    state = BITS.state
    state["state"]["state"] = number * 0x9E3779B97F4A7C15F39CC0605CEDC835 % 2**128
    state["has_uint32"] = 0
    BITS.state = state
    return RANDOM


@functools.cache
def good_files(name):
    return TARGETS[name].good()


FAULTY = "faulty"
WRONG = {
    2: lambda: "was wrong",
    4: lambda: 1 / 0,
    6: lambda: [None for _ in iter(int, 1)],
    8: os.abort,
    10: lambda: "" * len(b"x" * 2**29),
}
"""Executions that fail in every way, without a reader."""


def execute(name, number):
    """Let a reader read the input of a number; say what is wrong, or nothing."""
    if name == "store rows":
        return execute_rows(number)
    if name == FAULTY:
        return WRONG.get(number, str)()
    target, good = TARGETS[name], good_files(name)
    path = Path(target.name)
    random = random_of(number)
    data = good[number % len(good)]
    changes = [with_other_bytes]
    if path.suffix == ".safetensors":
        changes += [with_other_contents, *[with_other_header] * 4]
    path.write_bytes(changes[random.randint(len(changes))](data, random))
    path = path.absolute()
    try:
        target.read(path)
    except target.errors as error:
        return said(error)
    return ""


NAMES = (*TARGETS, "store rows")
