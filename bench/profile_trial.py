"""Where a trial's time goes, function by function, with Linux perf, and how quick passes are.

python bench/profile_trial.py build/bench/sdnn_bench   (built with -DSDNN_BUILD_BENCH=ON)

Writes docs/evidence/profile.json and passes.json; bench/performance_tables.py puts them into
performance.md there.
"""

from __future__ import annotations

import json
import re
import subprocess
import sys
import tempfile
from pathlib import Path
from typing import Any

EVIDENCE = Path(__file__).parents[1] / "docs" / "evidence"
TRIALS = {
    "4 inputs": "trial/inputs:4/noise:0/episodes:2000",
    "4 inputs, noise": "trial/inputs:4/noise:2/episodes:2000",
    "6 inputs, noise": "trial/inputs:6/noise:2/episodes:2000",
}
SMALLEST_SHARE = 1.0


def short_name(symbol: str) -> str:
    """Return a function's name without namespaces, arguments and template arguments."""
    symbol = symbol.replace("(anonymous namespace)::", "")
    symbol = re.sub(r"\[clone.*\]|\(.*", "", symbol).strip()
    previous = None
    while previous != symbol:
        previous, symbol = symbol, re.sub(r"<[^<>]*>", "", symbol)
    symbol = re.sub(r"<.*", "", symbol)  # perf cuts long names
    name = symbol.split(" ")[-1].removeprefix("sdnn::").replace("detail::", "")
    return name.partition("::")[2] if name.count("::") and name[0].islower() else name


def profile(program: str, benchmark: str) -> dict[str, float]:
    """Return the per cent of samples of each function that has at least `SMALLEST_SHARE`."""
    with tempfile.TemporaryDirectory() as folder:
        data = str(Path(folder) / "perf.data")
        command = ["perf", "record", "-q", "-F", "1999", "-o", data, program]
        subprocess.run(
            [*command, f"--benchmark_filter={benchmark}$", "--benchmark_min_time=2"],
            check=True,
            stdout=subprocess.DEVNULL,
        )
        report = ["perf", "report", "-i", data, "--no-children", "--stdio", "-F", "overhead,sym"]
        done = subprocess.run(report, check=True, capture_output=True, text=True)
    shares: dict[str, float] = {}
    for share, symbol in re.findall(r"^\s*([\d.]+)%\s+\[[.k]\]\s+(.*)$", done.stdout, re.MULTILINE):
        name = short_name(symbol)
        shares[name] = shares.get(name, 0.0) + float(share)
    return {name: round(share, 1) for name, share in shares.items() if share >= SMALLEST_SHARE}


def passes(program: str) -> list[dict[str, Any]]:
    """Return the median microseconds of processor time of new states, passes and plain loads."""
    done = subprocess.run(
        [program, "--benchmark_filter=^(new_state|pass|plain_loads)/", "--benchmark_format=json",
         "--benchmark_repetitions=9", "--benchmark_min_time=0.02",
         "--benchmark_enable_random_interleaving=true"],
        check=True, capture_output=True, text=True,
    )  # fmt: skip
    rows: dict[tuple[int, int, str], dict[str, Any]] = {}
    for benchmark in json.loads(done.stdout)["benchmarks"]:
        if benchmark.get("aggregate_name") != "median":
            continue
        name, _, inputs, episodes = benchmark["run_name"].split("/")  # as "inputs:4"
        n_inputs, n_episodes = (int(text.partition(":")[2]) for text in (inputs, episodes))
        level = benchmark["label"]
        row = {"inputs": n_inputs, "episodes": n_episodes, "level": level}
        rows.setdefault((n_inputs, n_episodes, level), row)[name] = round(benchmark["cpu_time"], 2)
    return [rows[key] for key in sorted(rows)]


def write(name: str, content: object) -> None:
    (EVIDENCE / f"{name}.json").write_text(json.dumps(content, indent=2) + "\n")
    print(f"wrote {name}.json")


if __name__ == "__main__":
    if len(sys.argv) != 2:
        raise SystemExit(__doc__)
    write("passes", passes(sys.argv[1]))
    write("profile", {title: profile(sys.argv[1], name) for title, name in TRIALS.items()})
