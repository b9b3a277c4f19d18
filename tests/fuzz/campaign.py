"""Runs fuzz targets, in C++ and Python, and counts their executions in a file.

    python tests/fuzz/campaign.py --out FOLDER [--seconds 60] [--executions N] [--max-bytes N]
        [TARGET ...]

Each target runs for so many seconds or executions. ``FOLDER/counts.json`` has the executions of
each commit and target. A later call continues with the corpora and numbers of the earlier ones and
adds its executions. Small inputs in C++ are up to ten times as quick. What fails is in
``FOLDER/TARGET``; ``--number N`` repeats one execution of a reader in Python.
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
"""Folders of tests/data, beside the target's corpus."""

MOST_FAULTS = 50
PER_WORKER = 2000
"""Executions of a reader in a process."""


def run_cpp(name, seconds, executions, out, max_bytes):
    """Run a target of libFuzzer; return its executions and faults."""
    found = out / name
    found.mkdir(parents=True, exist_ok=True)
    corpora = [found, ROOT / "tests" / "fuzz" / "corpus" / name]
    corpora += [ROOT / "tests" / "data" / folder for folder in SEEDS.get(name, ())]
    limits = ["-rss_limit_mb=1024", "-timeout=10", f"-max_len={max_bytes}", "-len_control=10"]
    limits += [f"-max_total_time={seconds}", f"-runs={executions or -1}"]
    done = subprocess.run(
        [BUILD / name, *limits, f"-artifact_prefix={found}/fault-", "-print_final_stats=1",
         "-verbosity=0", *corpora],
        stderr=subprocess.PIPE, text=True, errors="replace", check=False,
    )  # fmt: skip
    count = re.search(r"number_of_executed_units: (\d+)", done.stderr)
    faults = [] if done.returncode == 0 else [done.stderr[-8000:]]
    return int(count[1]) if count else 0, faults


def run_python(name, seconds, executions, out, first):
    """Let a reader read mutations from a number on; return how many, and faults."""
    number, faults = first, []
    last = first + executions if executions else sys.maxsize
    until = time.monotonic() + seconds
    while number < last and time.monotonic() < until and len(faults) < MOST_FAULTS:
        n_mutations = min(last - number, PER_WORKER)
        faults += failures(mutation_cells, name, number, n_mutations)[1]
        number += n_mutations
    if faults:
        (out / name).mkdir(parents=True, exist_ok=True)
        with (out / name / "faults.txt").open("a") as file:
            file.writelines(f"{fault}\n" for fault in faults)
    return number - first, faults


def timed(name, cpp, given, first):
    """Run a target; return its executions, its faults and the seconds."""
    began = time.monotonic()
    if cpp:
        done, faults = run_cpp(name, given.seconds, given.executions, given.out, given.max_bytes)
    else:
        done, faults = run_python(name, given.seconds, given.executions, given.out, first)
    return done, faults, time.monotonic() - began


def count(counts, name, **numbers):
    """Add what a target did to the counts of the present commit."""
    own = counts.setdefault(commit(), {}).setdefault(name, dict.fromkeys(numbers, 0))
    for key, number in numbers.items():
        own[key] = round(own[key] + number)


def commit():
    """The commit of the work tree."""
    arguments = ["git", "-C", ROOT, "rev-parse", "--short", "HEAD"]
    done = subprocess.run(arguments, capture_output=True, text=True, check=False)
    return done.stdout.strip() or "unknown"


def main():
    cpp = sorted(path.stem for path in (ROOT / "tests" / "fuzz").glob("*_fuzz.cpp"))
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("targets", nargs="*", metavar="TARGET", help="default: all")
    parser.add_argument("--out", type=Path, required=True)
    parser.add_argument("--seconds", type=int, default=60, help="at most, of a target")
    parser.add_argument("--executions", type=int, help="at most, of a target; default: no limit")
    parser.add_argument("--max-bytes", type=int, default=16384, help="of an input in C++")
    parser.add_argument("--jobs", type=int, default=1, help="targets at a time")
    parser.add_argument("--number", type=int, help="an execution of a reader to repeat")
    given = parser.parse_args()
    known = [*cpp, *MUTATED]
    if unknown := set(given.targets).difference(known):
        parser.error(f"unknown: {', '.join(sorted(unknown))}; possible: {', '.join(known)}")
    if given.number is not None:
        with tempfile.TemporaryDirectory(dir="/dev/shm") as folder:
            os.chdir(folder)
            sys.exit(read_mutation(given.targets[0], given.number) or 0)
    given.out.mkdir(parents=True, exist_ok=True)
    path = given.out / "counts.json"
    counts = json.loads(path.read_text()) if path.exists() else {}
    n_faults = 0
    with concurrent.futures.ThreadPoolExecutor(given.jobs) as pool:
        runs = {}
        for name in given.targets or known:
            first = sum(own.get(name, {}).get("executions", 0) for own in counts.values())
            runs[pool.submit(timed, name, name in cpp, given, first)] = name
        for run in concurrent.futures.as_completed(runs):
            done, faults, took = run.result()
            name = runs[run]
            count(counts, name, executions=done, seconds=took, faults=len(faults))
            path.write_text(json.dumps(counts, indent=1) + "\n")
            n_faults += len(faults)
            rate = done / took
            print(f"{name}: {done:,} executions, {rate:,.0f} a second, {len(faults)} faults")
            print("".join(f"{fault}\n" for fault in faults[:5]), end="", flush=True)
    total = sum(own["executions"] for of in counts.values() for own in of.values())
    print(f"{total:,} executions in all")
    return 1 if n_faults else 0


if __name__ == "__main__":
    sys.exit(main())
