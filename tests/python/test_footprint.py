"""How many files a reader must open to follow a command; lower a limit where it can be lower."""

import json
import subprocess
import sys
from pathlib import Path

import pytest

FOOTPRINT = Path(__file__).parent / "reference" / "footprint.py"


@pytest.mark.parametrize(
    ("command", "limit"),
    [("train CartPole-v1 --steps 60", 22), ("reproduce a --quick", 28)],
    ids=["train", "reproduce"],
)
def test_a_command_executes_few_files_of_the_package(tmp_path, command, limit):
    arguments = [sys.executable, FOOTPRINT, *command.split(), "--out", tmp_path / "out"]
    process = subprocess.run(arguments, capture_output=True, text=True, check=True)
    files = json.loads(process.stderr.splitlines()[-1])
    assert "cli/__init__.py" in files
    assert len(files) <= limit, files
