"""Puts the tables of benchmark runs into docs/performance.md.

sdnn bench --json > docs/performance.json && python bench/performance_tables.py

The profile in docs/profile.json, made by bench/profile_trial.py, becomes the last table. Of a run
on a processor with AVX-512, docs/performance-avx512.json, the page has the passes only.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path

from page import replaced

from sdnn.benchmarks.report import describe_run, tables

DOCS = Path(__file__).parents[1] / "docs"
RESULTS = DOCS / "performance.json"
PROFILE = DOCS / "profile.json"
AVX512 = DOCS / "performance-avx512.json"
PAGE = DOCS / "performance.md"
BEGIN = "<!-- tables: made by bench/performance_tables.py from performance.json -->"
BEGIN_AVX512 = "<!-- tables: made by bench/performance_tables.py from performance-avx512.json -->"
END = "<!-- end of tables -->"
N_OF_PASSES = 2
"""The first tables: the pass, and what the machine allows."""


def to_markdown(results: dict, n_tables: int | None = None) -> str:
    """The first tables or all, after the lines that say on what was measured."""
    blocks = ["\n".join(f"- {line}" for line in describe_run(results))]
    for table in tables(results)[:n_tables]:
        lines = [f"**{table.title}**", "", _row(table.header)]
        lines += [_row(("---", *("---:",) * (len(table.header) - 1)))]
        lines += [_row(row) for row in table.rows]
        blocks.append("\n".join(lines))
    return "\n\n".join(blocks) + "\n"


def _row(cells: Sequence[str]) -> str:
    return f"| {' | '.join(cells)} |"


def profile_table(profile: dict[str, dict[str, float]]) -> str:
    """Functions by their share of the time, one column per trial."""
    functions = sorted(
        {name for shares in profile.values() for name in shares},
        key=lambda name: -sum(shares.get(name, 0.0) for shares in profile.values()),
    )
    lines = [
        "**Where a trial's time goes (per cent of samples; below 1 left out)**",
        "",
        f"| function | {' | '.join(profile)} |",
        f"| --- |{' ---: |' * len(profile)}",
    ]
    for name in functions:
        shares = (f"{of[name]:.1f}" if name in of else "" for of in profile.values())
        lines.append(f"| `{name}` | {' | '.join(shares)} |")
    return "\n".join(lines) + "\n"


def with_tables(
    page: str, results: dict, profile: dict[str, dict[str, float]], avx512: dict
) -> str:
    """The page with what stands between its marks replaced."""
    page = replaced(page, BEGIN, f"{to_markdown(results)}\n{profile_table(profile)}", END)
    return replaced(page, BEGIN_AVX512, to_markdown(avx512, N_OF_PASSES), END)


if __name__ == "__main__":
    stored = (json.loads(path.read_text()) for path in (RESULTS, PROFILE, AVX512))
    PAGE.write_text(with_tables(PAGE.read_text(), *stored))
