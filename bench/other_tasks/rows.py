"""Rows of trials in a CSV file: what is there is not run again."""

from __future__ import annotations

import csv
from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import ProcessPoolExecutor, as_completed
from pathlib import Path
from typing import Any

Row = dict[str, str]
Work = tuple[str, str, str, int]
"""Task, condition, agent, seed."""


def read_rows(path: Path) -> list[Row]:
    """Rows of trials that are done."""
    if not path.exists():
        return []
    with path.open(newline="") as file:
        return list(csv.DictReader(file))


def run_missing(
    trial: Callable[[Work], list[dict[str, Any]]],
    asked: Iterable[Work],
    path: Path,
    fields: Sequence[str],
    n_jobs: int,
) -> None:
    """Run trials side by side; those that are done are kept, whatever happens to others."""
    done = {(r["task"], r["condition"], r["agent"], int(r["seed"])) for r in read_rows(path)}
    is_new = not path.exists()
    with (
        path.open("a", newline="") as file,
        ProcessPoolExecutor(n_jobs, max_tasks_per_child=1) as pool,
    ):
        writer = csv.DictWriter(file, fields, lineterminator="\n")
        if is_new:
            writer.writeheader()
        missing = [work for work in asked if work not in done]
        for future in as_completed([pool.submit(trial, work) for work in missing]):
            rows = future.result()
            writer.writerows(rows)
            file.flush()
            print(*rows[-1].values(), flush=True)
