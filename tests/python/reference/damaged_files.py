"""Cells (a name, and a function that returns a fault) about readers of damaged or foreign files.

A reader must read a file, or name it in an error, and need little time and memory.
"""

import functools
import json
import os
import socket
import time
from pathlib import Path
from types import SimpleNamespace

import gymnasium as gym
import numpy as np

import agent_files
from bad_inputs import leaves, replaced
from checksums import with_checksum
from mutated_files import (
    READERS as OTHERS,
    Reader,
    contents_of,
    with_other_bytes,
    with_other_contents,
    with_other_header,
    with_other_rows,
    written,
)
from sdnn import libsdnn
from sdnn.agents import JSONLines, SDNNQLearning, Training
from sdnn.runs import Run, config_file
from sdnn.runs.errors import RunError
from sdnn.support.files import read_file, write_file
from sdnn.training.files import read_statistics

MOST_SECONDS = 5.0
MOST_BYTES = 2**28
"""Limits, chosen, of the processor time and memory that a reader needs for a file."""


def make_env():
    return gym.make("Pendulum-v1")


def save_training(path):
    env = make_env()
    agent = SDNNQLearning(env.observation_space, env.action_space, approximator=agent_files.SMALL)
    training = Training(agent, env, steps=9)
    training.run()
    training.save(path)


def read_lines(path):
    rows = JSONLines(path)
    rows.on_start(SimpleNamespace(n_rows=2))
    rows.on_end(None)


def read_scheduler_file(path):
    from sdnn.runs.dask_executor import DaskExecutor

    return DaskExecutor(str(path))._address()


RUN = (
    b'{"format": "%b", "environment": {"id": "Pendulum-v1"}, "goals": [{"at_step": 3, "steps": 9}]}'
    % config_file.FORMAT.encode()
)

READERS = {
    **OTHERS,
    "training": Reader(
        "checkpoint.safetensors",
        lambda: written(save_training),
        lambda path: Training.load(path, make_env()),
        (ValueError, OSError),
    ),
    "libsdnn parameters": Reader(
        "parameters.txt",
        lambda: [parameters_of(contents_of("tests/python/reference/libsdnn_files", "*.bin")[0])],
        libsdnn.read_parameter_file,
        (ValueError, OSError),
    ),
    "configuration": Reader(
        "config.json", lambda: [RUN], lambda path: Run.open(path.parent), (RunError,)
    ),
    "lines": Reader("rows.jsonl", lambda: [b'{"a": 1}\n' * 4], read_lines, (OSError,)),
    "scheduler": Reader(
        "scheduler.json", lambda: [b'{"address": "tcp://a:1"}'], read_scheduler_file,
        (ValueError, OSError),
    ),
}  # fmt: skip

CHECKED = ("agent", "training", "estimator")
"""Kinds of files in which a checksum covers every byte."""


def parameters_of(model):
    """Return the text of parameters with which a model file of LIBSDNN begins, after its length."""
    length = int.from_bytes(model[:4], "little")
    return model[4 : 4 + length]


@functools.cache
def good_file(name):
    return READERS[name].good()[0]


def make_socket(path):
    with socket.socket(socket.AF_UNIX) as server:
        server.bind(path.name)  # in the current folder; a long path would not fit


def make_sparse_file(path):
    with path.open("wb") as file:
        file.truncate(2**40)


SPECIAL = {
    "pipe": os.mkfifo,
    "folder": Path.mkdir,
    "socket": make_socket,
    "link to a device": lambda path: path.symlink_to("/dev/zero"),
    "link to a terminal": lambda path: path.symlink_to("/dev/tty"),
    "a terabyte": make_sparse_file,
}
"""Functions that make what no reader can accept: no regular file, or far too much of it."""

MIB = 2**20
HEADERS = (b"[study]\n", b"[base]\n", b"[base.learning]\n", b"[axes]\n", b"[cases]\n", b"")

CONTENTS = {
    "nothing": b"",
    "zeros": bytes(MIB),
    "noise": np.random.default_rng(0).bytes(MIB),
    "deep tables": b'{"a":' * 100_000,
    "deep arrays": b"[" * 100_000,
    "deep arrays of a key": b'{"a":' + b"[" * 100_000 + b"]" * 100_000 + b"}",
    "900 levels": b'{"environment": {"id": "Pendulum-v1", "kwargs": {"a":'
    + b"[" * 900 + b"]" * 900 + b"}}}",
    "a long number": b'{"seed": ' + b"9" * MIB + b"}",
    "many keys": b"{" + b",".join(b'"k%d": 1' % i for i in range(80_000)) + b"}",
    "an endless list": b"[" + b"0," * (MIB // 2) + b"0]",
    "deep TOML arrays": b"a = " + b"[" * 100_000 + b"]" * 100_000,
    "deep TOML tables": b"a = " + b"{a = " * 100_000,
    "a TOML key of many parts": b"a." * 50_000 + b"a = 1",
    "a TOML table of many parts": b"[" + b"a." * 50_000 + b"a]\n",
    "TOML within 900 levels": b"[base.environment.kwargs]\na = " + b"[" * 900 + b"]" * 900,
    "a TOML array over many lines": b"[base.learning]\nepsilon = [\n" + b"1,\n" * 100_000 + b"]\n",
    **{
        f"many keys in {header.decode().strip() or 'the file'}": header
        + b"".join(b"k%d = 1\n" % i for i in range(20_000))
        for header in HEADERS
    },
    "10^9 trials": b'[study]\ntrials = 1_000_000_000\n[base]\nenvironment = "Pendulum-v1"\n',
    "a product of 10^12": b'[base]\nenvironment = "Pendulum-v1"\n[axes]\ncombine = "product"\n'
    + b"".join(b"learning.%s = %s\n" % (k, str([i / 1e3 for i in range(1000)]).encode())
               for k in (b"epsilon", b"discount", b"learning_rate", b"final_epsilon")),
    "many cases and variants": b'[base]\nenvironment = "Pendulum-v1"\n'
    + b"".join(b"[cases.c%d]\nseed = %d\n[variants.v%d]\n" % (i, i, i) for i in range(5000)),
    "commas": b"SDNN = [" + b"," * MIB + b"]",
    "commas and brackets": b"SDNN = [" + b"(," * (MIB // 2) + b"]",
    "repeats": b"<SDNN>{\n<PC>{\nrandom_seed = [" + b"1:100000," * 100_000 + b"1]\n}\n}\n",
    "tags": b"<a\n" * 150_000 + b"a = 1\n" * 80_000,
    "a long line": b"a" * MIB,
}  # fmt: skip
"""Contents of at most a few MiB, which a reader refuses or reads."""


def damages(name):
    """Yield names of damages, functions that do them to a path, and whether they are refused."""
    good = good_file(name)
    for title, make in SPECIAL.items():
        yield title, make, True
    for title, content in changed(name, good):
        yield title, functools.partial(Path.write_bytes, data=content), False
    contents = {**CONTENTS, "more": good + b"\0", "twice": good + good}
    rng = np.random.default_rng(1)
    for number in range(30):
        contents[f"cut {number}"] = good[: int(rng.integers(len(good)))]
    for number in range(60):
        flipped = bytearray(good)
        flipped[int(rng.integers(len(good)))] ^= 1 << int(rng.integers(8))
        contents[f"bit {number}"] = bytes(flipped)
    for title, content in contents.items():
        yield title, functools.partial(Path.write_bytes, data=content), name in CHECKED


def changed(name, good):
    """Yield titles and contents of damaged files that only this reader can get."""
    if name.startswith("libsdnn"):
        text = good if name == "libsdnn parameters" else parameters_of(good)
        rest = b"" if name == "libsdnn parameters" else good[4 + len(text) :]
        for old, new in (
            (b"input_number = 2", b"input_number = 10000"),
            (b"input_number = 2", b"input_number = 2147483647"),
            (b"RANDOM_INVERSE(51", b"RANDOM_INVERSE(16777216"),
            (b"RANDOM_INVERSE(51", b"RANDOM_INVERSE(9^9^9^9"),
            (b"combination_setting = mutual", b"combination_setting = file\nfilename = /dev/zero"),
            (b"combination_setting = mutual", b"combination_setting = file\nfilename = ../x"),
        ):
            if old in text:
                other = text.replace(old, new).replace(b":2]", b":10000]")
                length = b"" if not rest else len(other).to_bytes(4, "little")
                yield new.decode(), length + other + rest
    if name in CHECKED:
        yield from with_other_types(good)


OTHER_TYPES = {1: ("F8_E4M3", "F8_E5M2", "BOOL"), 2: ("BF16", "F16", "U16"), 4: ("U32",),
               8: ("C64", "U64")}  # fmt: skip
"""Types of safetensors that the package does not write, by the bytes of a number."""


def with_other_types(good):
    """Yield names and files in which one array has another type, with the right checksum."""
    length = int.from_bytes(good[:8], "little")
    header, data = json.loads(good[8 : 8 + length]), good[8 + length :]
    sizes = {"I8": 1, "U8": 1, "I16": 2, "I32": 4, "F32": 4, "I64": 8, "U64": 8, "F64": 8}
    for name in [name for name in header if name != "__metadata__"]:
        for dtype in OTHER_TYPES[sizes[header[name]["dtype"]]]:
            changed_header = header | {name: header[name] | {"dtype": dtype}}
            text = json.dumps(changed_header, separators=(",", ":")).encode()
            text += b" " * (-len(text) % 8)  # arrays begin at a multiple of 8 bytes
            yield f"{name} of {dtype}", with_checksum(len(text).to_bytes(8, "little") + text + data)


def damage_cells(name):
    """Yield a cell for every damage of a reader's file."""
    for title, damage, is_refused in damages(name):
        yield f"{name}, {title}", functools.partial(read_damaged, name, damage, is_refused)


def read_damaged(name, damage, is_refused):
    """Read a damaged file; return the fault of its reader, or ""."""
    reader = READERS[name]
    path = Path.cwd() / reader.name
    damage(path)
    return verdict(reader, path, is_refused)


def verdict(reader, path, is_refused):
    """Read a file; return the fault: time, memory, a wrongly accepted file, its error; or ""."""
    Path("/proc/self/clear_refs").write_text("5")  # resets VmHWM, the highest resident memory
    before, began = resident("VmRSS"), time.process_time()
    error = None
    try:
        reader.read(path)
    except reader.errors as caught:
        error = caught
    seconds, n_bytes = time.process_time() - began, resident("VmHWM") - before
    if seconds > MOST_SECONDS:
        return f"took {seconds:.1f} s"
    if n_bytes > MOST_BYTES:
        return f"took {n_bytes / MIB:.0f} MiB"
    if error is None:
        return "was read" if is_refused else ""
    names_argument = str(error).startswith(("env ", "evaluation_env ", "repeat_episodes "))
    is_clear = path.name in str(error) or names_argument
    return "" if is_clear else f"does not name the file: {error!r:.200}"


def resident(name):
    """Return the bytes of resident memory that Linux reports under a name."""
    lines = Path("/proc/self/status").read_text().splitlines()
    (line,) = (line for line in lines if line.startswith(name))
    return 1024 * int(line.split()[1])


VALUES = {
    "a text": "x", "2^31": 2**31, "2^70": 2**70, "-1": -1, "0.5": 0.5, "NaN": float("nan"),
    "null": None, "true": True, "a table": {}, "a list": [], "nothing": ...,
    "a deep list": functools.reduce(lambda x, _: [x], range(300), 0),
    "a long text": "x" * 100_000, "many": list(range(100_000)),
}  # fmt: skip


def header_cells(name, number):
    """Yield cells in which one value of a file's description is another, with a right checksum."""
    reader = READERS[name]
    path = Path(reader.name).absolute()
    path.write_bytes(reader.good()[number])
    description, arrays = read_file(path, name)
    path.unlink()
    for keys in leaves(description):
        for title, value in VALUES.items():
            changed_description = replaced(description, keys, value)
            label = f"{name} {number}: {'.'.join(map(str, keys))} = {title}"
            yield label, functools.partial(_header_cell, name, arrays, changed_description)


def _header_cell(name, arrays, description):
    path = Path.cwd() / READERS[name].name
    write_file(path, name, arrays, description)
    return verdict(READERS[name], path, is_refused=False)


def statistics():
    """Return a file of statistics that wrappers of environments learn."""
    numbers = {"dtype": "<f8", "shape": [2], "values": "AAAAAAAA8D8AAAAAAADwPw=="}  # 1.0 twice
    statistics = {"wrapper": "NormalizeObservation", "numbers": {"obs_rms.mean": numbers}}
    return [json.dumps([statistics, statistics]).encode()]


def read_numbers(path):
    try:
        read_statistics(json.loads(path.read_bytes()))
    except ValueError as error:
        raise ValueError(f"{path.name}: {error}") from error


MUTATED = {
    **READERS, "statistics": Reader("statistics.json", statistics, read_numbers, (ValueError,))
}  # fmt: skip
"""Readers of files, and of statistics, which are a part of other files."""

OTHER_CONTENTS = {
    ".safetensors": (with_other_contents, with_other_header),
    ".sqlite": (with_other_rows,),
}


@functools.cache
def good_files(name):
    return MUTATED[name].good()


def read_mutation(name, number):
    """Read the mutation of a good file with this number; return the fault of its reader, or ""."""
    reader, random = MUTATED[name], np.random.RandomState(number % 2**32)
    path = Path.cwd() / reader.name
    changes = (with_other_bytes, *OTHER_CONTENTS.get(path.suffix, ()))
    data = good_files(name)[number % len(good_files(name))]
    path.write_bytes(changes[random.randint(len(changes))](data, random))
    return verdict(reader, path, is_refused=False)


def mutation_cells(name, first, n_mutations):
    """Yield cells of mutations, numbered from ``first`` on, and if it is 0 of the good files."""
    for number, data in enumerate(good_files(name) if first == 0 else ()):
        yield f"{name}, good file {number}", functools.partial(read_good, name, data)
    for number in range(first, first + n_mutations):
        yield f"{name}, mutation {number}", functools.partial(read_mutation, name, number)


def read_good(name, data):
    path = Path.cwd() / MUTATED[name].name
    path.write_bytes(data)
    MUTATED[name].read(path)
    return ""
