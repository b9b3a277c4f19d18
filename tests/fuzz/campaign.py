"""Runs fuzz targets, in C++ and Python, and counts their executions in a file.

    python tests/fuzz/campaign.py --out FOLDER [--seconds 60] [--executions N] [--max-bytes N]
        [TARGET ...]

A target is a program of libFuzzer in C++, or a reader of damaged_files.py in Python, whose
executions are numbered mutations of good files. Each runs for that many seconds or executions, and
writes its faults to ``FOLDER/TARGET``; ``--number N`` repeats one execution of a reader.

``FOLDER/counts.json`` has the executions of each commit and target. A later call continues with the
corpora and numbers of the earlier ones and adds its executions. Small inputs in C++ are up to ten
times as quick.
"""

import argparse
import concurrent.futures
import json
import os
import re
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).parents[2]
sys.path.append(str(ROOT / "tests" / "python" / "reference"))

from damaged_files import MUTATED, mutation_cells, read_mutation  # noqa: E402
from watched_cells import failures  # noqa: E402

BUILD = ROOT / "build" / "fuzz" / "tests" / "fuzz"
SEEDS = {"agent_file_fuzz": ["agents", "files"], "safetensors_fuzz": ["agents", "files"]}
"""Folders of tests/data with further seeds of a target, beside its corpus."""

MOST_FAULTS = 50
"""Number of faults after which a reader is not tried further."""

EXECUTIONS_OF_PROCESS = 2000
"""Executions of a reader in one process; the time is looked at after each."""


def run_cpp(name, seconds, executions, out, max_bytes):
    """Run a target of libFuzzer; return its executions and faults."""
    folder = out / name  # new inputs that reach other code, and faults
    folder.mkdir(parents=True, exist_ok=True)
    corpora = [folder, ROOT / "tests" / "fuzz" / "corpus" / name]
    corpora += [ROOT / "tests" / "data" / folder for folder in SEEDS.get(name, ())]
    limits = ["-rss_limit_mb=1024", "-timeout=10", f"-max_len={max_bytes}", "-len_control=10"]
    limits += [f"-max_total_time={seconds}", f"-runs={executions or -1}"]
    done = subprocess.run(
        [BUILD / name, *limits, f"-artifact_prefix={folder}/fault-", "-print_final_stats=1",
         "-verbosity=0", *corpora],
        stderr=subprocess.PIPE, text=True, errors="replace", check=False,
    )  # fmt: skip
    count = re.search(r"number_of_executed_units: (\d+)", done.stderr)
    faults = [] if done.returncode == 0 else [done.stderr[-8000:]]
    return int(count[1]) if count else 0, faults


def run_python(name, seconds, executions, out, first):
    """Let a reader read mutations with the numbers from ``first`` on.

    Without ``executions`` the number of mutations is not limited. Returns how many it read, and the
    faults.
    """
    number, faults = first, []
    last = first + executions if executions else sys.maxsize
    until = time.monotonic() + seconds
    while number < last and time.monotonic() < until and len(faults) < MOST_FAULTS:
        n_mutations = min(last - number, EXECUTIONS_OF_PROCESS)
        faults += failures(mutation_cells, name, number, n_mutations)[1]
        number += n_mutations
    if faults:
        (out / name).mkdir(parents=True, exist_ok=True)
        with (out / name / "faults.txt").open("a") as file:
            file.writelines(f"{fault}\n" for fault in faults)
    return number - first, faults


def timed(name, is_cpp, options, first):
    """Run a target; return its executions, its faults and the seconds."""
    began = time.monotonic()
    limits = options.seconds, options.executions, options.out
    if is_cpp:
        n_executions, faults = run_cpp(name, *limits, options.max_bytes)
    else:
        n_executions, faults = run_python(name, *limits, first)
    return n_executions, faults, time.monotonic() - began


def add_counts(counts, name, **numbers):
    """Add the numbers of a run to the counts of a target and the present commit."""
    totals = counts.setdefault(commit(), {}).setdefault(name, dict.fromkeys(numbers, 0))
    for key, number in numbers.items():
        totals[key] = round(totals[key] + number)


def n_executions_of(counts, name):
    """Return the executions of a target in all commits."""
    return sum(targets[name]["executions"] for targets in counts.values() if name in targets)


def commit():
    """Return the short hash of the commit of the work tree, or "unknown"."""
    arguments = ["git", "-C", ROOT, "rev-parse", "--short", "HEAD"]
    done = subprocess.run(arguments, capture_output=True, text=True, check=False)
    return done.stdout.strip() or "unknown"


def main():
    cpp_targets = sorted(path.stem for path in (ROOT / "tests" / "fuzz").glob("*_fuzz.cpp"))
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("targets", nargs="*", metavar="TARGET", help="default: all")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seconds", type=int, default=60, help="at most, of a target")
    parser.add_argument("--executions", type=int, help="at most, of a target; default: no limit")
    parser.add_argument("--max-bytes", type=int, default=16384, help="of an input in C++")
    parser.add_argument("--jobs", type=int, default=1, help="targets at a time")
    parser.add_argument("--number", type=int, help="an execution of a reader to repeat")
    options = parser.parse_args()
    known = [*cpp_targets, *MUTATED]
    if unknown := set(options.targets).difference(known):
        parser.error(f"unknown: {', '.join(sorted(unknown))}; possible: {', '.join(known)}")
    if options.number is not None:
        with tempfile.TemporaryDirectory(dir="/dev/shm") as folder:
            os.chdir(folder)
            sys.exit(read_mutation(options.targets[0], options.number) or 0)
    options.out.mkdir(parents=True, exist_ok=True)
    path = options.out / "counts.json"
    counts = json.loads(path.read_text()) if path.exists() else {}
    n_faults = 0
    with concurrent.futures.ThreadPoolExecutor(options.jobs) as pool:
        runs = {}
        for name in options.targets or known:
            first = n_executions_of(counts, name)
            runs[pool.submit(timed, name, name in cpp_targets, options, first)] = name
        for run in concurrent.futures.as_completed(runs):
            n_executions, faults, seconds = run.result()
            name = runs[run]
            add_counts(counts, name, executions=n_executions, seconds=seconds, faults=len(faults))
            path.write_text(json.dumps(counts, indent=1) + "\n")
            n_faults += len(faults)
            rate = n_executions / seconds
            print(
                f"{name}: {n_executions:,} executions, {rate:,.0f} a second, {len(faults)} faults"
            )
            print("".join(f"{fault}\n" for fault in faults[:5]), end="", flush=True)
    names = {name for targets in counts.values() for name in targets}
    print(f"{sum(n_executions_of(counts, name) for name in names):,} executions in all")
    return 1 if n_faults else 0


if __name__ == "__main__":
    sys.exit(main())
