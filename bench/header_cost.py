"""Print what units cost to compile, in CPU seconds and memory, and what a changed header costs.

Compiles units once, one after another, as a build folder would: `python bench/header_cost.py
build/editable` those of the Python core, with the seconds of the units that include each header;
`python bench/header_cost.py FOLDER TARGET ...` those of CMake targets, such as train_agent.
"""

from __future__ import annotations

import json
import os
import shlex
import statistics
import subprocess
import sys
import tempfile
from pathlib import Path

INCLUDE = Path(__file__).resolve().parents[1] / "cpp" / "include"


def compiled(command: str, folder: str, scratch: Path) -> tuple[float, float, set[str]]:
    """Compile a unit; return its CPU seconds, its memory in MB and the files that it includes."""
    arguments = shlex.split(command)
    arguments[arguments.index("-o") + 1] = str(scratch / "unit.o")
    arguments += ["-MD", "-MF", str(scratch / "unit.d")]  # lists the included files
    with subprocess.Popen(
        arguments, cwd=folder, env={**os.environ, "CCACHE_DISABLE": "1"}
    ) as compiler:
        _, status, usage = os.wait4(compiler.pid, 0)
        compiler.returncode = os.waitstatus_to_exitcode(status)
    if compiler.returncode != 0:
        sys.exit(f"a unit does not compile: {command}")
    included = (scratch / "unit.d").read_text().replace("\\\n", " ").split()
    seconds, megabytes = usage.ru_utime + usage.ru_stime, usage.ru_maxrss / 1024
    return seconds, megabytes, {os.path.realpath(name) for name in included}


def units_of(folder: str, targets: list[str]) -> list[dict[str, str]]:
    """Return the commands that compile the units of CMake targets; exit if there are none."""
    listing = subprocess.run(
        ["ninja", "-C", folder, "-t", "compdb"], capture_output=True, text=True, check=True
    )
    start = listing.stdout.index("[\n")  # after the line that names the folder
    units: list[dict[str, str]] = json.loads(listing.stdout[start:])
    folders = {f"{target}.dir" for target in targets}
    named = [
        unit
        for unit in units
        if unit["output"].endswith(".o") and folders & set(Path(unit["output"]).parts)
    ]
    if not named:
        sys.exit(f"{folder} has no units of {' or '.join(targets)}")
    return named


def main() -> None:
    """Compile the units and print the headers by cost."""
    if len(sys.argv) < 2:
        sys.exit("usage: python bench/header_cost.py BUILD_FOLDER [TARGET ...]")
    units = units_of(sys.argv[1], sys.argv[2:] or ["_core"])
    cost = {str(header): 0.0 for header in INCLUDE.rglob("*.hpp")}
    total = peak = 0.0
    with tempfile.TemporaryDirectory() as scratch:
        for unit in units:
            seconds, memory, included = compiled(unit["command"], unit["directory"], Path(scratch))
            print(f"{seconds:6.1f} s {memory:6.0f} MB  {Path(unit['file']).name}", flush=True)
            total, peak = total + seconds, max(peak, memory)
            for header in included & cost.keys():
                cost[header] += seconds
    if sys.argv[2:]:
        return
    for header in sorted(cost, key=lambda header: cost[header]):
        print(f"{cost[header]:6.1f} s  {Path(header).relative_to(INCLUDE)}")
    median = statistics.median(cost.values())
    print(f"{total:.0f} s in all, median header {median:.0f} s, worst {max(cost.values()):.0f} s")
    print(f"{peak:.0f} MB at the peak")


if __name__ == "__main__":
    main()
