"""Kill ``sdnn reproduce`` at random instants and see that it resumes to the same rows.

    python tests/python/experiments/kill_and_resume.py --kills 50

The instants are spread over the whole command: start, trials, costs, figures and files. A round
runs the command in one folder, killing it again and again, until it ends by itself; then a new
folder is begun, until there were enough kills. At the end of every round the folder must hold the
rows, files and nothing else that an uninterrupted run leaves. Times of costs are no rows: only
their keys count.
"""

from __future__ import annotations

import argparse
import json
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

COMMAND = (sys.executable, "-m", "sdnn", "reproduce")


def content(folder: Path) -> dict[str, object]:
    """What must not depend on kills: rows, keys of costs, and names of files."""
    (table,) = (json.loads(path.read_text()) for path in folder.glob("table*.json"))
    (rows,) = (path.read_bytes() for path in folder.glob("results*.csv"))
    return {
        "digest": table["digest"],
        "rows": rows,
        "costs": [(cost["series"], cost["n_inputs"]) for cost in table["costs"]],
        "files": sorted(path.name for path in folder.iterdir()),
    }


def run(folder: Path, arguments: list[str], seconds: float | None = None) -> bool:
    """Run the command; kill it after `seconds`. Returns whether it ended by itself."""
    process = subprocess.Popen(
        [*COMMAND, *arguments, "--out", str(folder)],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True,
    )  # fmt: skip
    try:
        output, _ = process.communicate(timeout=seconds)
    except subprocess.TimeoutExpired:
        os.killpg(process.pid, signal.SIGKILL)
        process.communicate()
        return False
    if process.returncode != 0:
        raise RuntimeError(f"{process.args} ended with {process.returncode}:\n{output}")
    return True


def kill_and_resume(arguments: list[str], n_kills: int, seed: int) -> str:
    """Kill the command `n_kills` times at least; returns a line about it.

    Raises
    ------
    AssertionError
        If a resumed run differs from an uninterrupted one.
    """
    instants = random.Random(seed)
    killed, rounds = 0, 0
    with tempfile.TemporaryDirectory() as parent:
        begin = time.monotonic()
        run(Path(parent) / "whole", arguments)
        whole_seconds = time.monotonic() - begin
        expected = content(Path(parent) / "whole")
        while killed < n_kills:
            folder = Path(parent) / f"round-{rounds}"
            rounds += 1
            while not run(folder, arguments, instants.uniform(0.0, whole_seconds)):
                killed += 1
                print(f"\rkilled {killed} times", end="", file=sys.stderr, flush=True)
            found = content(folder)
            for name, value in expected.items():
                assert found[name] == value, f"{name} of {folder.name} differ after kills"
    print(file=sys.stderr)
    return (
        f"{killed} kills in {rounds} rounds of {whole_seconds:.1f} s: the same rows"
        f" ({expected['digest'][:16]}), files and costs as without"
    )


def main() -> None:
    """Read the options."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0, help="of the instants")
    parser.add_argument("arguments", nargs="*", default=["all", "--quick"])
    options = parser.parse_args()
    print(kill_and_resume(options.arguments, options.kills, options.seed))


if __name__ == "__main__":
    main()
