"""Kill ``sdnn reproduce`` or ``sdnn sweep`` at random instants; it must resume to the same rows.

    python tests/robustness/kill_and_resume.py --kills 200
    python tests/robustness/kill_and_resume.py --kills 50 -- sweep STUDY.toml

The instants are spread over the whole command: start, trials, costs, figures and files. A round
runs the command in one folder, stopping it again and again by one of `WAYS`, until it ends by
itself; then a new folder is begun, until there were enough kills. At the end of every round the
folder must hold the rows, files and nothing else that an uninterrupted run leaves. Times of costs
are no rows: only their keys count.
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
"""Signals, one after the other."""

END_SECONDS = 60.0
"""In which a command that was asked to end must have ended."""

ENDINGS = {0, 130, 143, *(-number for number in (1, 2, 9, 15))}
"""Done, interrupted, terminated, or ended by a signal that nobody handles."""

CRASHES = ("terminate called", "Fatal Python error", "FATAL:", "core dumped")


def content(folder: Path) -> dict[str, object]:
    """Results that must not depend on kills: rows, keys of costs, and names of files."""
    kept: dict[str, object] = {"files": sorted(path.name for path in folder.iterdir())}
    for path in folder.glob("results*.csv"):
        kept["rows"] = path.read_bytes()
    for path in folder.glob("*results.csv.gz"):  # of a sweep
        kept["rows"] = gzip.decompress(path.read_bytes())
    for path in folder.glob("*table*.json"):
        table = json.loads(path.read_text())
        kept["digest"] = table["digest"]
        kept["costs"] = [(cost["series"], cost["n_inputs"]) for cost in table.get("costs", [])]
    return kept


def run(
    folder: Path, arguments: list[str], seconds: float | None = None, way: str = "KILL"
) -> bool:
    """Run the command; stop it after `seconds`. Returns whether it ended by itself.

    Raises
    ------
    RuntimeError
        If it fails, crashes, or goes on after it was asked to end.
    """
    process = subprocess.Popen(
        [*PROGRAM, *arguments, "--out", str(folder)],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, start_new_session=True,
    )  # fmt: skip
    told = "it was left alone"
    try:
        output, _ = process.communicate(timeout=seconds)
    except subprocess.TimeoutExpired:
        told = f"{way} after {seconds:.2f} s"
        for number in WAYS[way]:
            os.killpg(process.pid, number)
            time.sleep(0.05)
        try:
            output, _ = process.communicate(timeout=END_SECONDS)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
            output, _ = process.communicate()
            raise RuntimeError(f"{told}: it went on\n{output}") from None
    is_whole = process.returncode == 0
    allowed = {0} if seconds is None or told.startswith("it") else ENDINGS
    if process.returncode not in allowed or any(crash in output for crash in CRASHES):
        raise RuntimeError(f"{told}: it ended with {process.returncode}\n{output}")
    return is_whole


def ended(
    folder: Path, arguments: list[str], limit: tuple[int, int]
) -> subprocess.CompletedProcess[str]:
    """Run the command to its end under a limit (resource, most), whatever comes of it."""

    def restrict() -> None:
        signal.signal(signal.SIGXFSZ, signal.SIG_IGN)  # writing fails then, as on a full disk
        resource.setrlimit(limit[0], (limit[1], limit[1]))

    return subprocess.run(
        [*PROGRAM, *arguments, "--out", str(folder)],
        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True, check=False,
        preexec_fn=restrict,
    )  # fmt: skip


def kill_and_resume(arguments: list[str], n_kills: int, seed: int) -> str:
    """Stop the command `n_kills` times at least; returns a line about it.

    Raises
    ------
    AssertionError
        If a resumed run differs from an uninterrupted one.
    RuntimeError
        As of `run`.
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
            found = content(folder)
            for name, value in expected.items():
                assert found[name] == value, (
                    f"{name} of {folder.name} differ after kills: {found[name]!r:.2000} instead of"
                    f" {value!r:.2000}"
                )
    print(file=sys.stderr)
    ways = ", ".join(f"{way} {number}" for way, number in sorted(killed.items()))
    return (
        f"{killed.total()} kills ({ways}) in {rounds} rounds of {whole_seconds:.1f} s: the same"
        " rows, files and costs as without"
    )


def main() -> None:
    """Read the options."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--kills", type=int, default=50)
    parser.add_argument("--seed", type=int, default=0, help="of the instants")
    parser.add_argument("arguments", nargs="*", default=["reproduce", "all", "--quick"])
    options = parser.parse_args()
    print(kill_and_resume(options.arguments, options.kills, options.seed))


if __name__ == "__main__":
    main()
