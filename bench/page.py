"""Tables in the page that shows them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from sdnn.files import write_whole
from sdnn.runs.report import Table
from sdnn.runs.results import Estimate

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


def replaced(page: str, begin: str, text: str, end: str = END) -> str:
    """Replace what stands between a mark and the next end.

    Raises
    ------
    ValueError
        If the mark or its end is missing.
    """
    before, begun, rest = page.partition(begin)
    _, ended, after = rest.partition(end)
    if not begun or not ended:
        raise ValueError(f"the page must have the lines {begin} and {end}")
    return f"{before}{begin}\n\n{text}\n{end}{after}"


def with_tables(page: str, tables: Mapping[str, str]) -> str:
    """Replace each table by its name."""
    for name, table in tables.items():
        page = replaced(page, f"<!-- table: {name} -->", table)
    return page


def show(tables: Mapping[str, str], folder: Path) -> None:
    """Print tables, and put them into the page if the folder has it."""
    print(*tables.values(), sep="\n")
    page = folder / PAGE
    if page.exists():
        write_whole(page, with_tables(page.read_text(), tables).encode())
