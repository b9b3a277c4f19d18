"""Each system call fails in turn: errors name the file, which has its old or its new content."""

import errno
import os
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

HERE = Path(__file__).parent
ROOT = HERE.parents[1]
SYSTEM = (errno.EIO, errno.ENOSPC)
MEMORY = (errno.ENOMEM,)

CPP_WRITER = r"""
#include <cstdio>
#include <exception>
#include <string>

#include "sdnn/core/detail/whole_file.hpp"

int main(int, char** arguments) {
  try {
    sdnn::core::WholeFile file(arguments[1]);
    const std::string text(100'000, 'n');
    file.write(std::as_bytes(std::span(text)));
    file.write(std::as_bytes(std::span(text)));
    file.finish();
  } catch (const std::exception& error) {
    std::puts(error.what());
    return 2;
  }
}
"""


def compiled(command, *arguments):
    compiler = shutil.which(command)
    if compiler is None or sys.platform != "linux":
        pytest.skip(f"needs Linux and {command}")
    subprocess.run([compiler, *map(str, arguments)], check=True)


@pytest.fixture(scope="module")
def faults(tmp_path_factory):
    library = tmp_path_factory.mktemp("faults") / "faults.so"
    compiled("cc", "-shared", "-fPIC", "-O1", HERE / "faults.c", "-o", library, "-ldl")
    return str(library)


@pytest.mark.parametrize(
    ("action", "errors", "n_least"),
    # The least numbers of failed calls are chosen a little below those that were counted.
    [
        ("file", SYSTEM, 20),
        ("finished trial", SYSTEM, 100),
        ("run in progress", SYSTEM, 80),
        ("finished trial", MEMORY, 1000),
        ("run in progress", MEMORY, 1000),
    ],
)
def test_a_python_writer_leaves_the_old_or_new_file_at_every_failing_call(
    faults, tmp_path, action, errors, n_least
):
    for error in errors:
        (tmp_path / str(error)).mkdir()  # one folder for each error
    path = os.pathsep.join([*(p for p in sys.path if p), str(ROOT / "tests/python/reference")])
    process = subprocess.run(
        [sys.executable, HERE / "failing_writers.py", action, tmp_path, *map(str, errors)],
        env=os.environ | {"LD_PRELOAD": faults, "PYTHONPATH": path},
        capture_output=True,
        text=True,
    )
    assert process.returncode == 0, process.stderr
    assert int(process.stdout) >= n_least


@pytest.mark.parametrize("error", [*SYSTEM, *MEMORY])
def test_the_cpp_writer_leaves_the_old_or_new_file_at_every_failing_call(faults, tmp_path, error):
    source, program, folder = tmp_path / "writer.cpp", tmp_path / "writer", tmp_path / "folder"
    source.write_text(CPP_WRITER)
    compiled("c++", "-std=c++20", f"-I{ROOT / 'cpp/include'}", source, "-o", program)
    folder.mkdir()
    path, new, n_failed = folder / "file", b"n" * 200_000, 0
    for number in range(1, 20):  # the call that fails, if there are so many
        path.write_bytes(b"old")
        faulty = {
            "LD_PRELOAD": faults,
            "FAULT_NUMBER": str(number),
            "FAULT_FOLDER": str(folder),
            "FAULT_ERROR": str(error),
        }
        process = subprocess.run([program, path], env=os.environ | faulty, capture_output=True)
        assert list(folder.iterdir()) == [path], number
        if process.returncode:
            n_failed += 1
            assert str(path).encode() in process.stdout or b"bad_alloc" in process.stdout
            assert path.read_bytes() in (b"old", new)
        else:
            assert path.read_bytes() == new
    assert n_failed >= 4
