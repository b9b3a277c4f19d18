"""Kill ``sdnn reproduce`` or ``sdnn sweep`` at random instants; it must resume to the same rows.

    python tests/robustness/kill_and_resume.py --kills 200
    python tests/robustness/kill_and_resume.py --kills 50 -- sweep STUDY.toml

The instants are spread over the whole command: start, trials, costs, figures and files. A round
runs the command in one folder and stops it again and again by one of `WAYS`, until a run succeeds.
Rounds follow, each in a new folder, until there were enough kills. At the end of every round the
folder must hold the rows and files that an uninterrupted run leaves, and nothing else. Measured
times of costs differ between runs: only the keys of costs are compared.
"""

from __future__ import annotations

import argparse
import collections
import gzip
import json
import os
import random
import resource
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

PROGRAM = (sys.executable, "-m", "sdnn")

WAYS = {
    "KILL": (signal.SIGKILL,),
    "TERM": (signal.SIGTERM,),
    "HUP": (signal.SIGHUP,),
    "INT": (signal.SIGINT,),
    "INT twice": (signal.SIGINT,) * 2,
    "INT three times": (signal.SIGINT,) * 3,
    "STOP, CONT": (signal.SIGSTOP, signal.SIGCONT),
    "STOP, KILL": (signal.SIGSTOP, signal.SIGKILL),
}
"""Signals that are sent one after the other, by the names of the ways to stop a command."""

END_SECONDS = 60.0
"""Time within which a command must end after the signals."""

HANDLED_SIGNALS = {128 + signal.SIGINT, 128 + signal.SIGTERM}
FATAL_SIGNALS = {-signal.SIGHUP, -signal.SIGINT, -signal.SIGKILL, -signal.SIGTERM}
EXIT_CODES = {0} | HANDLED_SIGNALS | FATAL_SIGNALS
"""Exit codes of stopped commands: done; ended in order after a signal; ended by the signal."""

CRASHES = ("terminate called", "Fatal Python error", "FATAL:", "core dumped")


def content(folder: Path) -> dict[str, object]:
    """Return the results that must not depend on kills: rows, keys of costs, names of files."""
    results: dict[str, object] = {"files": sorted(path.name for path in folder.iterdir())}
    for path in folder.glob("results*.csv"):
        results["rows"] = path.read_bytes()
    for path in folder.glob("*results.csv.gz"):  # of a sweep
        results["rows"] = gzip.decompress(path.read_bytes())
    for path in folder.glob("*table*.json"):
        table = json.loads(path.read_text())
        results["digest"] = table["digest"]
        results["costs"] = [(cost["series"], cost["n_inputs"]) for cost in table.get("costs", [])]
    return results


def run(
    folder: Path, arguments: list[str], seconds: float | None = None, way: str = "KILL"
) -> bool:
    """Run the command, and stop it after `seconds` (None: never) by a way of `WAYS`.

    Returns whether it succeeded: by itself, or in spite of the signals.

    Raises
    ------
    RuntimeError
        If it fails, crashes, or still runs `END_SECONDS` after the signals.
    """
    process = subprocess.Popen(
        [*PROGRAM, *arguments, "--out", str(folder)],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True,
    )  # fmt: skip
    signals, allowed_codes = "without a signal", {0}
    try:
        output, _ = process.communicate(timeout=seconds)
    except subprocess.TimeoutExpired:
        signals, allowed_codes = f"{way} after {seconds:.2f} s", EXIT_CODES
        for number in WAYS[way]:
            os.killpg(process.pid, number)
            time.sleep(0.05)
        try:
            output, _ = process.communicate(timeout=END_SECONDS)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            output, _ = process.communicate()
            raise RuntimeError(f"{signals}: it did not end\n{output}") from None
    if process.returncode not in allowed_codes or any(crash in output for crash in CRASHES):
        raise RuntimeError(f"{signals}: it ended with {process.returncode}\n{output}")
    return process.returncode == 0


def run_with_small_files(
    folder: Path, arguments: list[str], max_bytes: int
) -> subprocess.CompletedProcess[str]:
    """Run the command where no file can be larger, as on a full disk; return what it did."""

    def restrict() -> None:
        # Without its handler a write beyond the limit ends the process instead of failing.
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
        resource.setrlimit(resource.RLIMIT_FSIZE, (max_bytes, max_bytes))

    return subprocess.run(
        [*PROGRAM, *arguments, "--out", str(folder)],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False,
        preexec_fn=restrict,
    )  # fmt: skip


def kill_and_resume(arguments: list[str], n_kills: int, seed: int) -> str:
    """Stop the command at least `n_kills` times; return a line that reports the kills.

    Raises
    ------
    AssertionError
        If a resumed run differs from an uninterrupted one.
    RuntimeError
        If a run fails or does not end: see `run`.
    """
    instants = random.Random(seed)
    killed: collections.Counter[str] = collections.Counter()
    rounds = 0
    with tempfile.TemporaryDirectory() as parent:
        begin = time.monotonic()
        run(Path(parent) / "whole", arguments)
        whole_seconds = time.monotonic() - begin
        expected = content(Path(parent) / "whole")
        assert "rows" in expected
        while killed.total() < n_kills:
            folder = Path(parent) / f"round-{rounds}"
            rounds += 1
            way = instants.choice(list(WAYS))
            while not run(folder, arguments, instants.uniform(0.0, whole_seconds), way):
                killed[way] += 1
                way = instants.choice(list(WAYS))
                print(f"\rkilled {killed.total()} times", end="", file=sys.stderr, flush=True)
            results = content(folder)
            for name, value in expected.items():
                assert results[name] == value, (
                    f"{name} of {folder.name} differ after kills: {results[name]!r:.2000} instead"
                    f" of {value!r:.2000}"
                )
    print(file=sys.stderr)
    ways = ", ".join(f"{way} {number}" for way, number in sorted(killed.items()))
    return (
        f"{killed.total()} kills ({ways}) in {rounds} rounds of {whole_seconds:.1f} s: the same"
        " rows, files and costs as without"
    )


def main() -> None:
    """Kill and resume the command of the options."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0, help="of the random instants")
    parser.add_argument("arguments", nargs="*", default=["reproduce", "all", "--quick"])
    options = parser.parse_args()
    print(kill_and_resume(options.arguments, options.kills, options.seed))


if __name__ == "__main__":
    main()
