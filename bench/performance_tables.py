"""Puts the tables of benchmark runs into docs/performance.md.

    sdnn bench --json > docs/performance.json && python bench/performance_tables.py

The profile in docs/profile.json, made by bench/profile_trial.py, becomes the last table. Of a run
on a processor with AVX-512, docs/performance-avx512.json, the page has the passes only.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from page import markdown, show

from sdnn.benchmarks.report import describe_run, tables
from sdnn.runs.report import Table

DOCS = Path(__file__).parents[1] / "docs"
PAGE = DOCS / "performance.md"
N_OF_PASSES = 2
"""The first tables: the pass, and what the machine allows."""


def stored(name: str) -> dict[str, Any]:
    """Read what a command printed."""
    found: dict[str, Any] = json.loads((DOCS / f"{name}.json").read_text())
    return found


def to_markdown(results: dict[str, Any], n_tables: int | None = None) -> str:
    """Return the first tables or all, after the lines that say on what was measured."""
    about = "".join(f"- {line}\n" for line in describe_run(results))
    return "\n".join([about, *map(_titled, tables(results)[:n_tables])])


def _titled(table: Table) -> str:
    return f"**{table.title}**\n\n{markdown(table.header, table.rows)}"


def profile_table(profile: dict[str, dict[str, float]]) -> Table:
    """Return functions by their share of the time, one column for each trial."""
    functions = sorted(
        {name for shares in profile.values() for name in shares},
        key=lambda name: -sum(shares.get(name, 0.0) for shares in profile.values()),
    )
    rows = [
        (f"`{name}`", *(f"{of[name]:.1f}" if name in of else "" for of in profile.values()))
        for name in functions
    ]
    title = "Where a trial's time goes (per cent of samples; below 1 left out)"
    return Table(title, ("function", *profile), rows)


def page_tables() -> dict[str, str]:
    """Return each table of stored runs by its name in the page."""
    profile = _titled(profile_table(stored("profile")))
    return {
        "performance": f"{to_markdown(stored('performance'))}\n{profile}",
        "performance-avx512": to_markdown(stored("performance-avx512"), N_OF_PASSES),
    }


if __name__ == "__main__":
    show(page_tables(), PAGE)
