"""Readers of files, good files for them, and random changes of these files."""

import contextlib
import dataclasses
import hashlib
import json
import math
import re
import sqlite3
import tempfile
import zlib
from collections.abc import Callable
from pathlib import Path

import gymnasium as gym
import numpy as np
from safetensors.numpy import load, save

from checksums import BEFORE, with_checksum
from made_records import make_record
from sdnn import SDNNClassifier, SDNNRegressor, libsdnn
from sdnn.agents import load_agent
from sdnn.coding import Symbolic, WithMissing
from sdnn.reproduction.reproduce import ClaimStudy
from sdnn.runs import ResultStore, StoreError, TrialRows
from sdnn.runs.config_file import read_spec
from sdnn.runs.errors import RunError
from sdnn.runs.trial import HASH_DIGITS, ROW

ROOT = Path(__file__).parents[3]
X = np.random.RandomState(0).uniform(size=(40, 2))
SMALL = {"n_pattern_units": 10, "max_iter": 2, "random_state": 0}

NUMBER = re.compile(rb"-?\d+(\.\d+)?")
EXTREME = (b"0", b"-1", b"1", b"1e400", b"-1e308", b"NaN", b"2147483648", b"9999999999999999999",
           b"1e-320", b"null", b"true", b"[]", b"{}", b'""', b"[[[[[[[[")  # fmt: skip


@dataclasses.dataclass(frozen=True)
class Reader:
    """Name of a kind of files, contents of good ones, how to read one, and the errors of that."""

    name: str
    good: Callable[[], list[bytes]]
    read: Callable[[Path], object]
    errors: tuple[type[Exception], ...]


def written(*writers):
    """Call functions that write a file to a path; return the contents of the files."""
    contents = []
    for write in writers:
        with tempfile.TemporaryDirectory() as folder:
            write(Path(folder) / "file")
            contents.append((Path(folder) / "file").read_bytes())
    return contents


def contents_of(folder, pattern):
    return [path.read_bytes() for path in sorted((ROOT / folder).glob(pattern))]


def estimators():
    coding = [("circular", [0]), (WithMissing(base=Symbolic()), [1])]
    rounded = np.round(X, 1)
    models = (
        SDNNRegressor(n_output_units=9, **SMALL).fit(X, X[:, 0]),
        SDNNRegressor(coding, n_output_units=9, **SMALL).fit(rounded, X[:, 0]),
        SDNNClassifier(n_units_per_class=2, **SMALL).fit(X, X[:, 0] > X[:, 1]),
    )
    return written(*(model.save for model in models))


def read_estimator(path):
    for kind in (SDNNRegressor, SDNNClassifier):
        try:
            model = kind.load(path)
        except ValueError as error:
            if "holds an SDNN" not in str(error):
                raise
        else:
            model.predict(np.round(X[:4], 1))


def read_agent(path):
    agent = load_agent(path)
    space = agent.observation_space
    is_box = isinstance(space, gym.spaces.Box)
    action = agent.act(np.zeros(space.shape, space.dtype) if is_box else space.sample())
    assert action in agent.action_space, f"the action is {action!r}"


def read_libsdnn_model(path):
    model = libsdnn.read_model_file(path)
    model.predict(X[:4, : len(model.parameters.inputs)])


def store():
    with tempfile.TemporaryDirectory() as folder:
        with ResultStore(folder) as results:
            for trial in range(4):
                results.add(make_record(trial, steps=range(1, 40)))
        return [results.path.read_bytes()]


def read_store(path):
    with ResultStore(path.parent) as results:
        results.load()
        results.seconds()
        results.measurements("cost")


RUN = b"""budget.steps = 1000
seed = 3
agent = "sdnn-c-general"
[environment]
id = "Pendulum-v1"
[approximator]
n_pattern_units = 40
[learning]
discount = 0.95
"""

READERS = {
    "estimator": Reader("model.safetensors", estimators, read_estimator, (ValueError, OSError)),
    "agent": Reader(
        "agent.safetensors",
        lambda: contents_of("tests/data/agents", "*.safetensors"),
        read_agent,
        (ValueError, OSError),
    ),
    "libsdnn model": Reader(
        "model.bin",
        lambda: contents_of("tests/python/reference/libsdnn_files", "*.bin"),
        read_libsdnn_model,
        (ValueError, OSError),
    ),
    "store": Reader("results.sqlite", store, read_store, (StoreError,)),
    "study": Reader(
        "study.toml", lambda: contents_of("docs/studies", "*.toml"), ClaimStudy, (RunError,)
    ),
    "run": Reader("run.toml", lambda: [RUN], read_spec, (RunError,)),
}


def with_other_bytes(data, random):
    """Flip, replace, remove or repeat bytes at a few positions, or write extreme numbers there."""
    changed = bytearray(data)
    for _ in range(random.randint(1, 4)):
        place = random.randint(len(changed) + 1)
        length = min(int(random.geometric(0.1)), len(changed) - place)
        kind = random.randint(8)
        if kind == 0 and place < len(changed):
            changed[place] ^= 1 << random.randint(8)
        elif kind == 1:
            changed[place : place + length] = random.bytes(length)
        elif kind == 2:
            del changed[place : place + length]
        elif kind == 3:
            changed[place:place] = changed[place : place + length] * random.randint(1, 50)
        elif kind == 4 and random.randint(4) == 0:
            del changed[place:]
        elif kind == 5:
            number = (0, 1, 127, 2**31 - 1, 2**63 - 1, 2**64 - 1)[random.randint(6)]
            changed[place : place + 8] = number.to_bytes(8, "little")
        else:
            number_at = NUMBER.search(changed, place)
            if number_at:
                changed[number_at.start() : number_at.end()] = EXTREME[random.randint(len(EXTREME))]
    return bytes(changed)


def with_other_contents(data, random):
    """Change the description or an array of a file, and give it the right checksum."""
    header = json.loads(data[8 : 8 + int.from_bytes(data[:8], "little")])
    metadata = header["__metadata__"]["sdnn"]
    tensors = load(data)
    name = sorted(tensors)[random.randint(len(tensors))]
    kind = random.randint(5)
    if kind == 0:
        dtype = (np.int8, np.int32, np.int64, np.float64)[random.randint(4)]
        tensors[name] = tensors[name].astype(dtype)
    elif kind == 1:
        tensors[name] = tensors[name].ravel()[: random.randint(tensors[name].size + 1)]
    elif kind == 2 and tensors[name].size:
        array = tensors[name].copy().ravel()
        is_whole = array.dtype.kind in "iu"
        array[random.randint(array.size)] = np.iinfo(array.dtype).max if is_whole else np.nan
        tensors[name] = array.reshape(tensors[name].shape)
    else:
        start = len('{"checksum":"00000000"')
        changed = with_other_bytes(metadata[start:].encode(), random).decode("utf-8", "replace")
        metadata = metadata[:start] + changed
    return with_checksum(save(tensors, metadata={"sdnn": metadata}))


def with_other_header(data, random):
    """Change bytes of the header or of the arrays of a file, and give it the right checksum."""
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
    """Give an array in the header another type or shape with the same number of bytes."""
    values = json.loads(header)
    names = sorted(values.keys() - {"__metadata__"})
    array = values[names[random.randint(len(names))]]
    shape = array["shape"]
    (dtypes,) = (dtypes.split() for dtypes in SAME_SIZE if array["dtype"] in dtypes.split())
    if random.randint(2):
        array["dtype"] = dtypes[random.randint(len(dtypes))]
    else:
        shapes = [*shape, 1], [1, *shape], [math.prod(shape)], shape[::-1]
        array["shape"] = shapes[random.randint(4)]
    return json.dumps(values, separators=(",", ":")).encode()


VALUES = (0, 1, -1, 2**31, 2**63 - 1, -(2**63), 0.5, 1e400, None, "", "x", "{}", "[]", "NaN",
          "\ud800".encode("utf-8", "surrogatepass"), b"", b"\0" * 9, "x" * 9999,
          "[" * 5000)  # fmt: skip


def with_other_rows(data, random):
    """Change values in the tables of a store, in three of four cases with the right checksums."""
    with contextlib.closing(sqlite3.connect(":memory:")) as connection:
        connection.deserialize(data)
        with contextlib.suppress(sqlite3.Error):
            change_rows(connection, random)
        connection.commit()
        return connection.serialize()


def change_rows(connection, random):
    for _ in range(random.randint(1, 4)):
        table = ("runs", "rows", "measurements")[random.randint(3)]
        columns = [row[1] for row in connection.execute(f"PRAGMA table_info({table})")]
        column = columns[random.randint(len(columns))]
        value = VALUES[random.randint(len(VALUES))]
        if random.randint(3) == 0:  # changed bytes of an old value, instead
            (old,) = connection.execute(f'SELECT "{column}" FROM {table} LIMIT 1').fetchone() or "x"
            value = with_other_bytes(str(old).encode(), random).decode("utf-8", "replace")
        connection.execute(f'UPDATE OR IGNORE {table} SET "{column}" = ?', (value,))
    if random.randint(4):
        repair_checksums(connection)


def repair_checksums(connection):
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
