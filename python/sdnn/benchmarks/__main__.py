"""The process that measures: prints its results as JSON (see `run_benchmarks`)."""

from __future__ import annotations

import json
import sys

from sdnn.benchmarks.measurements import measure

if __name__ == "__main__":
    json.dump(measure(quick="--quick" in sys.argv[1:]), sys.stdout)
