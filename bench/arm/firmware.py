"""Firmware of emulated boards that calls a model on rows, and what it takes.

Counts of instructions are exact; of time an emulator says nothing. Needs what tests/boards needs,
and for rl-tools libstdc++-arm-none-eabi-picolibc.
"""

import re
import subprocess
import sys
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

HERE = Path(__file__).parent
sys.path.append(str(HERE.parents[1] / "tests" / "python" / "reference"))

from boards import BOARDS  # noqa: E402
from c_policies import run  # noqa: E402

MEASURED = {
    "cortex-m0": ("-mfloat-abi=soft",),
    "cortex-m4": ("-mfloat-abi=hard", "-mfpu=fpv4-sp-d16"),
}
"""The boards, and options for floating point."""
EMPTY = """
#define BEGIN (void)0
#define CALL(in, out) (void)in, (void)out
"""


@dataclass(frozen=True)
class Firmware:
    """A model in C, and the rows that it is called on."""

    row: str
    """Members of a row's struct; `result_member` is that of a result."""
    result_member: str
    model: str
    """The model's file, which defines BEGIN and CALL(in, out)."""
    rows: np.ndarray
    result: str
    """NumPy's type of a result."""
    cpp: str = ""
    """A file in C++ besides."""
    options: tuple[str | Path, ...] = ()


def measure(firmware, board, folder):
    """Return sizes and instructions a call, and the results; None if it does not fit the board."""
    empty = replace(firmware, model=EMPTY, cpp="", options=())
    base_command = _compiled(empty, board, folder / "base")
    try:
        command = _compiled(firmware, board, folder / "model")
    except AssertionError as error:
        if "overflowed" in str(error) or "will not fit" in str(error):
            return None, None
        raise
    base, sizes = _sizes(base_command[-1]), _sizes(command[-1])
    plugin = folder / "instruction_count.so"
    run("gcc", "-O2", "-shared", "-fPIC", HERE / "instruction_count.c", "-o", plugin)
    counts, outputs = [], b""
    for n_calls in (0, 1):
        with_plugin = [command[0], "-plugin", plugin, *command[1:]]
        done = subprocess.run(
            list(map(str, with_plugin)), capture_output=True, check=True,
            input=np.uint32(n_calls).tobytes() + firmware.rows.tobytes(),
        )  # fmt: skip
        counts.append(int(re.search(rb"instructions (\d+)", done.stderr)[1]))
        outputs = done.stdout
    stack = int(np.frombuffer(outputs[-4:], "<u4")[0])
    cost = {
        "flash": sizes[0] - base[0],
        "ram": sizes[1] - base[1] + stack,
        "instructions": round((counts[1] - counts[0]) / len(firmware.rows)),
    }
    return cost, np.frombuffer(outputs[:-4], firmware.result)


def _compiled(firmware, board, folder):
    folder.mkdir(parents=True, exist_ok=True)
    types = f"typedef struct {{ {firmware.row}; }} IN;\n"
    types += f"typedef struct {{ {firmware.result_member}; }} OUT;\n"
    (folder / "model.h").write_text(f"{types}{firmware.model}\n")
    (folder / "calls.c").write_bytes((HERE / "calls.c").read_bytes())
    target = BOARDS[board].target(MEASURED[board])
    options = ["-Os", "-DNDEBUG", "-I", HERE, *firmware.options]
    if firmware.cpp:
        (folder / "model.cpp").write_text(firmware.cpp)
        cpp = ("-std=c++17", "-fno-exceptions", "-fno-rtti", "-c", folder / "model.cpp")
        compiler = target.compiler.replace("gcc", "g++")
        run(compiler, *target.options, *options, *cpp, "-o", folder / "model.o")
        options.append(folder / "model.o")
    return target.compile(folder / "calls.c", *options, "-lm")


def _sizes(program):
    """Return a program's bytes of flash and of static memory."""
    text, data, bss = map(int, run("arm-none-eabi-size", program).split(b"\n")[1].split()[:3])
    return text + data, data + bss
