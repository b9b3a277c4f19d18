"""Style and types of the Python code, by the tools' own judgement."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

import sdnn

ROOT = Path(__file__).parents[2]


@pytest.mark.parametrize(
    "command",
    [
        ("ruff", "check", "--no-cache", "."),
        ("ruff", "format", "--check", "--no-cache", "."),
        ("mypy", "--strict", "-p", "sdnn"),
    ],
    ids=["lint", "format", "types"],
)
def test_tools_find_nothing(command, tmp_path):
    environment = os.environ | {"MYPY_CACHE_DIR": str(tmp_path)}
    folder = Path(sdnn.__file__).parents[1]
    if folder.name != "site-packages":  # there mypy finds the package by itself
        environment["MYPYPATH"] = str(folder)
    done = subprocess.run(
        [sys.executable, "-m", *command], cwd=ROOT, env=environment, capture_output=True, text=True
    )
    assert done.returncode == 0, done.stdout + done.stderr
