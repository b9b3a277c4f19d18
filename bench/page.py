"""Tables in the page that shows them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from sdnn.runs.report import Table
from sdnn.runs.statistics import Estimate
from sdnn.whole_files import write_whole

PAGE = "benchmarks.md"
END = "<!-- end of table -->"


def markdown(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table."""
    return Table("", tuple(header), [tuple(row) for row in rows]).to_markdown()


def interval(estimate: Estimate, digits: int) -> str:
    """Write a value and its interval; what is infinite was never reached."""
    value, lower, upper = (
        f"{x:,.{digits}f}" if np.isfinite(x) else "never"
        for x in (estimate.value, estimate.lower, estimate.upper)
    )
    return f"{value} [{lower}, {upper}]"


def with_tables(page: str, tables: Mapping[str, str]) -> str:
    """Replace each table, which stands in the page between a mark with its name and an end.

    Raises
    ------
    ValueError
        If a mark or its end is missing.
    """
    for name, table in tables.items():
        begin = f"<!-- table: {name} -->"
        before, begun, rest = page.partition(begin)
        _, ended, after = rest.partition(END)
        if not begun or not ended:
            raise ValueError(f"{PAGE} must have the lines {begin} and {END}")
        page = f"{before}{begin}\n\n{table}\n{END}{after}"
    return page


def show(tables: Mapping[str, str], folder: Path) -> None:
    """Print tables, and put them into the page if the folder has it."""
    print(*tables.values(), sep="\n")
    page = folder / PAGE
    if page.exists():
        write_whole(page, with_tables(page.read_text(), tables).encode())
