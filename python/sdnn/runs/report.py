"""Tables whose cells are written once, on the screen, as Markdown and as an HTML page.

Jinja and rich are imported when they are needed; Jinja is an extra.
"""

from __future__ import annotations

import base64
import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from typing import TYPE_CHECKING

import numpy as np

from sdnn.runs.errors import PlotUnavailableError
from sdnn.runs.measures import MEASURES, RETURN_MEASURES, MeasureName
from sdnn.runs.results import CaseResult
from sdnn.runs.statistics import DEFAULT_BOOTSTRAP, Estimate

if TYPE_CHECKING:
    from rich.console import Console

PERCENT = f"{100 * DEFAULT_BOOTSTRAP.confidence:.0f} %"
NOTE = (
    f"Medians over trials with {PERCENT} bootstrap intervals over trials. us/decision: processor"
    " time of sensing, choosing, physics and learning."
)
_TEMPLATE = "page.html.jinja"


@dataclass(frozen=True)
class Table:
    """A table of texts.

    Parameters
    ----------
    title
        Its title.
    header, rows
        Texts of all cells.
    kinds
        How a page colors a cell of such a text: ``"good"``, ``"bad"``, ``"open"`` or ``"none"``.
    """

    title: str
    header: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    kinds: Mapping[str, str] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Folded:
    """A part of a page that opens on demand: a summary with an aside, a note, a text or a table."""

    summary: str
    aside: str = ""
    note: str = ""
    text: str = ""
    table: Table | None = None


@dataclass(frozen=True, kw_only=True)
class Section:
    """A part of a page, shown in the order of its fields; what is empty is left out.

    Parameters
    ----------
    title, level
        Heading and its level; level 0 is a faint paragraph.
    text
        A paragraph.
    tally
        How a count is colored, the count, and what is counted.
    picture, alt
        SVG of a figure and its description.
    is_narrow
        Whether the figure takes a part of the width only.
    table
        A table.
    notes
        Faint paragraphs.
    terms
        Explanations of words.
    folded
        Parts that open on demand.
    """

    title: str = ""
    level: int = 2
    text: str = ""
    tally: Sequence[tuple[str, int, str]] = ()
    picture: bytes = b""
    alt: str = ""
    is_narrow: bool = False
    table: Table | None = None
    notes: Sequence[str] = ()
    terms: Mapping[str, str] = field(default_factory=dict)
    folded: Sequence[Folded] = ()

    @property
    def picture_url(self) -> str:
        """The figure as an address that holds it: its names cannot clash with those of another."""
        return "data:image/svg+xml;base64," + base64.b64encode(self.picture).decode()


@dataclass(frozen=True, kw_only=True)
class Call:
    """The call of the command that made a page.

    Parameters
    ----------
    machine
        Processor and instruction set.
    seconds
        Wall time.
    n_run, n_planned
        Trials that it ran, and that it needed.
    processor_seconds
        Processor time of all trials on the page.
    """

    machine: str
    seconds: float
    n_run: int
    n_planned: int
    processor_seconds: float

    def describe(self) -> str:
        """Write how long it took."""
        of_trials = f"Processor time of the trials shown: {duration_words(self.processor_seconds)}."
        if self.n_run < self.n_planned:
            return (
                f"{of_trials} {self.n_planned - self.n_run} of {self.n_planned} trials were stored"
                " before the call that made this page."
            )
        return f"Everything asked for was run in {duration_words(self.seconds)}. {of_trials}"


def require_jinja() -> None:
    """Raise a `PlotUnavailableError` if Jinja is not installed."""
    if find_spec("jinja2") is None:
        raise PlotUnavailableError(
            'the report needs Jinja, which is not installed: pip install "sdnn[reproduce]"'
        )


def to_html(
    *, title: str, heading: str, intro: str, warnings: Iterable[str], provenance: str,
    code: str, sections: Iterable[Section],
) -> str:  # fmt: skip
    """Make one self-contained HTML page.

    Parameters
    ----------
    title, heading
        Title of the window and of the page.
    intro, warnings
        Paragraphs at the top.
    provenance, code
        Where the rows come from, a text that ends with a code.
    sections
        All else.
    """
    require_jinja()
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("sdnn.runs", "."), autoescape=True, undefined=StrictUndefined,
        trim_blocks=True, lstrip_blocks=True,
    )  # fmt: skip
    return environment.get_template(_TEMPLATE).render(
        title=title, heading=heading, intro=intro, warnings=list(warnings), provenance=provenance,
        code=code, sections=list(sections),
    )  # fmt: skip


def to_markdown(
    title: str, head: Iterable[str], tables: Iterable[Table], notes: Iterable[str], end: str
) -> str:
    """Write a page of tables as Markdown: a title, paragraphs, tables, a list of notes, an end."""

    def line(cells: Sequence[str]) -> str:
        return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"

    lines = [f"# {title}", ""]
    for text in head:
        lines += [text, ""]
    for table in tables:
        lines += [f"## {table.title}", "", line(table.header), "|" + "---|" * len(table.header)]
        lines += [*map(line, table.rows), ""]
    lines += [f"- {text}" for text in notes]
    return "\n".join([*lines, "", end, ""])


def print_tables(
    console: Console, tables: Iterable[Table], notes: Iterable[str], mark: str = ""
) -> None:
    """Print tables, their titles followed by a mark, then notes."""
    from rich import box
    from rich.table import Table as RichTable
    from rich.text import Text

    for table in tables:
        shown = RichTable(title=Text(table.title + mark), title_justify="left", box=box.SIMPLE_HEAD)
        for column in table.header:
            shown.add_column(Text(column), overflow="fold")
        for row in table.rows:
            shown.add_row(*map(Text, row))
        console.print(shown)
    for note in notes:
        console.print(note, style="dim", highlight=False, markup=False)


def measure_terms(names: Iterable[MeasureName]) -> dict[str, str]:
    """Return what measures mean, by their names in words."""
    return {name.replace("_", " "): MEASURES[name][0] for name in names}


def measures_section(terms: Mapping[str, str], notes: Sequence[str] = ()) -> Section:
    """Return the section that explains measures."""
    return Section(title="What is measured", text=NOTE, notes=notes, terms=terms)


def settings_section(results: Iterable[tuple[str, CaseResult]]) -> Section:
    """Return the section of what fixes the rows of results, each with a title."""
    return Section(
        title="Settings and seeds",
        text="Everything that fixes the rows. The same settings and seeds give the same rows on any"
        " machine, with any number of jobs.",
        folded=[
            Folded(
                summary=title,
                aside=f"· configuration {result.config_hash}",
                note=f"sdnn {', '.join(sorted({one.version for one in result.records}))}; seeds of"
                f" the trials: {', '.join(str(one.key.seed) for one in result.records)}",
                text=json.dumps(json.loads(result.records[0].config), indent=2),
            )
            for title, result in results
        ],
    )


def measure_cells(result: CaseResult, names: Iterable[MeasureName]) -> tuple[str, ...]:
    """Write the medians of measures, then `COST_CELLS`; what a result does not have is ``"-"``."""
    return (
        *(
            format_estimate(result.medians[name], name, result.last_episode)
            if name in result.values
            else "-"
            for name in names
        ),
        f"{result.n_decisions:,}",
        f"{result.microseconds_per_decision:.1f}",
    )


COST_CELLS = ("decisions", "us/decision")


def format_estimate(
    estimate: Estimate, measure: MeasureName, last_episode: int | None = None, sign: str = ""
) -> str:
    """Write an estimate with its interval; what is censored becomes ``>last_episode``.

    Examples
    --------
    >>> format_estimate(Estimate(120.0, 90.0, math.inf), "episodes_to_learn", 15000)
    '120 [90, >15000]'
    >>> format_estimate(Estimate(0.9, 0.8, 1.0), "final_share_solved")
    '90 % [80, 100]'
    >>> format_estimate(Estimate(-0.5, -2.0, 1.0), "final_steps", sign="+")
    '-0.5 [-2, +1]'
    """
    scale, unit = (100, " %") if measure == "final_share_solved" else (1, "")
    decimals = decimals_of(estimate, measure)

    def number(value: float) -> str:
        if math.isinf(value):
            return f">{last_episode}"
        return plain_number(scale * value, decimals, sign)

    if math.isnan(estimate.value):
        return "-"
    if math.isnan(estimate.lower):
        return number(estimate.value) + unit
    return f"{number(estimate.value)}{unit} [{number(estimate.lower)}, {number(estimate.upper)}]"


def format_share(estimate: Estimate | None) -> str:
    """Write a share with its interval; None is ``"-"``.

    Examples
    --------
    >>> format_share(Estimate(0.479, 0.26, 0.712))
    '47.9 % [26, 71.2]'
    """
    return "-" if estimate is None else format_estimate(estimate, "final_share_solved")


def decimals_of(estimate: Estimate, measure: MeasureName) -> int:
    """Choose the decimals of an estimate: two digits of a return's interval, else one decimal."""
    ends = np.array([estimate.value, estimate.lower, estimate.upper])
    ends = ends[np.isfinite(ends)]
    if measure not in RETURN_MEASURES or not ends.any():
        return 1
    extent = float(np.ptp(ends)) or float(np.abs(ends).max()) / 100
    return min(max(1, 1 - math.floor(math.log10(extent))), 300)


def plain_number(value: float, decimals: int, sign: str = "") -> str:
    """Write a number with so many decimals at most.

    Examples
    --------
    >>> plain_number(2.50, 2), plain_number(-0.01, 1), plain_number(0.25, 2, sign="+")
    ('2.5', '0', '+0.25')
    """
    rounded = round(value, decimals) or 0.0
    text = f"{rounded:{sign}.{decimals}f}".rstrip("0").rstrip(".")
    return text if rounded else "0"


def duration_words(seconds: float) -> str:
    """Write a time for a reader.

    Examples
    --------
    >>> duration_words(61.4), duration_words(3661.4)
    ('1 min 1 s', '1 h 1 min')
    """
    if seconds >= 3600:
        hours, minutes = divmod(round(seconds / 60), 60)
        return f"{hours} h {minutes} min"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"
