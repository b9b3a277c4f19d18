"""Tables in the pages that show them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path

import numpy as np

from sdnn.reports.statistics import Estimate
from sdnn.support.files import write_whole

END = "<!-- end of table -->"


def markdown(header: Sequence[str], rows: Iterable[Sequence[str]]) -> str:
    """Return a table, whose cells may have Markdown."""
    lines = (" | ".join(row) for row in (header, ["---"] * len(header), *rows))
    return "".join(f"| {line} |\n" for line in lines)


def interval(estimate: Estimate, digits: int) -> str:
    """Write a value and its interval; what is infinite was never reached."""
    value, lower, upper = (
        f"{x:,.{digits}f}" if np.isfinite(x) else "never"
        for x in (estimate.value, estimate.lower, estimate.upper)
    )
    return f"{value} [{lower}, {upper}]"


def with_tables(page: str, tables: Mapping[str, str]) -> str:
    """Replace each table by its name; ValueError if the page has no place for it."""
    for name, table in tables.items():
        begin = f"<!-- table: {name} -->"
        before, begun, rest = page.partition(begin)
        _, ended, after = rest.partition(END)
        if not begun or not ended:
            raise ValueError(f"the page must have the lines {begin} and {END}")
        page = f"{before}{begin}\n\n{table}\n{END}{after}"
    return page


def show(tables: Mapping[str, str], page: Path) -> None:
    """Print tables, and put them into the page if it is there."""
    print(*tables.values(), sep="\n")
    if page.exists():
        write_whole(page, with_tables(page.read_text(), tables).encode())
