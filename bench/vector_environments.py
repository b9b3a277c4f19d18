"""Compare learning in several environments at once: a table of docs/how-to/agents.md.

    python bench/vector_environments.py [--seeds 10] [--only WORD ...] [--jobs 2] [--redraw]

The study is vector_environments.toml.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np
from measured import options
from page import markdown
from studies import Curves, curves, run_study

from sdnn.reports.statistics import estimate_median
from sdnn.runs.study_file import StudyFile

KIND = "vector environments"
STUDY = Path(__file__).with_suffix(".toml")


def table_rows(results: Curves) -> Iterator[Sequence[str]]:
    """Yield medians over the seeds, with 95 % bootstrap intervals."""
    for (task, n_environments), trials in results.items():
        middles = map(estimate_median, np.array([curve["mean_return"] for curve in trials]).T)
        returns = (f"{m.value:.0f} ({m.lower:.0f} to {m.upper:.0f})" for m in middles)
        us = np.median([1e6 * curve["cpu_seconds"][-1] / curve["steps"][-1] for curve in trials])
        yield task, n_environments, str(len(trials)), *returns, f"{us:.0f}"


def main() -> None:
    arguments = options(__doc__ or "", seeds=10, jobs=2).parse_args()
    study = StudyFile(STUDY, n_trials=arguments.seeds)
    run_study(KIND, study, arguments)
    heads = (f"after {step:,}" for step in (20_000, 40_000, 60_000))
    header = ("task", "environments", "seeds", *heads, "us per step")
    print(markdown(header, table_rows(curves(KIND, study, arguments))))


if __name__ == "__main__":
    main()
