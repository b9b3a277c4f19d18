"""Pages of figures and tables for terminals, in Markdown and in HTML.

Jinja and rich are imported when they are needed.
"""

from __future__ import annotations

import base64
import re
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import Console

_MARKUP = re.compile(r"[\\`*_#<|~&@$]|\](?=[(\[])|:(?=//)|(?<=www)\.", re.IGNORECASE)
"""Characters that Markdown interprets; brackets only where they would make a link."""


@dataclass(frozen=True)
class Table:
    """A table of a page; its cells are texts."""

    title: str
    header: tuple[str, ...]
    rows: Sequence[tuple[str, ...]]
    kinds: Mapping[str, str] = field(default_factory=dict)
    """Colors of cells on an HTML page, by their text: "good", "bad", "open" or "none"."""
    brief: Sequence[str] = ()
    """Columns that a terminal shows by default; empty: all."""

    def print(self, console: Console, *, full: bool = True) -> None:
        """Print all columns (`full`), or the brief ones, which fit 80 characters."""
        from rich import box
        from rich.table import Table as RichTable
        from rich.text import Text

        shown = RichTable(title=Text(self.title), title_justify="left", box=box.SIMPLE_HEAD)
        columns = [
            i for i, name in enumerate(self.header) if full or not self.brief or name in self.brief
        ]
        for i in columns:
            shown.add_column(Text(self.header[i]), overflow="fold")
        for row in self.rows:
            shown.add_row(*(Text(row[i]) for i in columns))
        console.print(shown)


@dataclass(frozen=True, kw_only=True)
class Section:
    """A part of a page, shown in the order of its fields; empty fields are left out.

    The default title is that of the table; its level is that of the HTML heading, or 0 for a faint
    paragraph. Pictures are SVG, with ``alt`` as their description; a narrow one, PNG, replaces them
    on telephones. ``is_narrow`` sections have pictures that do not fill the page. Folded sections
    have notes, terms, text and a table, and open on demand.
    """

    title: str = ""
    level: int = 2
    picture: bytes = b""
    narrow_picture: bytes = b""
    alt: str = ""
    is_narrow: bool = False
    table: Table | None = None
    notes: Sequence[str] = ()
    terms: Mapping[str, str] = field(default_factory=dict)
    text: str = ""
    folded: Sequence[Section] = ()

    @property
    def heading(self) -> str:
        """The title, by default that of the table."""
        return self.title or (self.table.title if self.table else "")

    @property
    def picture_url(self) -> str:
        """The figure as a data URL: inlined SVGs of a page would share their identifiers."""
        return "data:image/svg+xml;base64," + base64.b64encode(self.picture).decode()

    @property
    def narrow_picture_url(self) -> str:
        """The figure for narrow screens as a data URL."""
        return "data:image/png;base64," + base64.b64encode(self.narrow_picture).decode()


@dataclass(frozen=True, kw_only=True)
class Page:
    """A report: its head, its sections, and the source of its rows."""

    title: str
    intro: str
    warnings: Sequence[str] = ()
    sections: Sequence[Section]
    source: str

    @property
    def tables(self) -> Iterator[Table]:
        """All tables, those of folded sections last."""
        folded = (part for section in self.sections for part in section.folded)
        yield from (section.table for section in (*self.sections, *folded) if section.table)

    @property
    def notes(self) -> list[str]:
        """Explanations below the tables, except those of folded sections with a text."""
        folded = (part for section in self.sections for part in section.folded if not part.text)
        sections = [*self.sections, *folded]
        notes = [note for section in sections for note in section.notes]
        terms = [term for section in sections for term in section.terms.items()]
        return notes + [f"{name}: {meaning}." for name, meaning in terms]

    def print(self, console: Console, *, full: bool = False) -> None:
        """Print the page without figures: tables that fit 80 characters, or everything (`full`)."""
        for line in (self.title, self.intro, *self.warnings):
            console.print(line, highlight=False, markup=False)
        tables = (section.table for section in self.sections if section.table)
        for table in self.tables if full else tables:
            table.print(console, full=full)
        notes = (note for section in self.sections for note in section.notes)
        for note in self.notes if full else notes:
            console.print(note, style="dim", highlight=False, markup=False)

    def to_markdown(self) -> str:
        """Return the page in Markdown, without figures."""
        return _rendered("page.md.jinja", page=self)

    def to_html(self, call: str) -> str:
        """Return the page as self-contained HTML; `call` is the command that made it."""
        return _rendered("page.html.jinja", page=self, call=call)


def _rendered(template: str, **values: object) -> str:
    """Fill in a template of this package; HTML is escaped."""
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("sdnn.reports", "."), autoescape=".html." in template,
        undefined=StrictUndefined, trim_blocks=True, lstrip_blocks=True, keep_trailing_newline=True,
    )  # fmt: skip
    environment.filters["markdown"] = markdown_text
    return environment.get_template(template).render(values)


def markdown_text(text: str) -> str:
    r"""Escape a text for a line of Markdown, so that it has no markup, HTML or links.

    >>> markdown_text("<b> [1, 2] | [a](b)")
    '\\<b> [1, 2] \\| [a\\](b)'
    """
    return _MARKUP.sub(r"\\\g<0>", " ".join(text.split()))


def plain_number(value: float, decimals: int, sign: str = "") -> str:
    """Format a number with a maximum number of decimals.

    >>> plain_number(2.50, 2), plain_number(-0.01, 1), plain_number(1234.25, 2, sign="+")
    ('2.5', '0', '+1,234.25')
    """
    rounded = round(value, decimals) or 0.0  # no -0.0
    text = f"{rounded:{sign},.{decimals}f}".rstrip("0").rstrip(".")
    return text if rounded else "0"


def duration_words(seconds: float) -> str:
    """Format a duration in words.

    >>> duration_words(61.4), duration_words(3661.4)
    ('1 min 1 s', '1 h 1 min')
    """
    if seconds >= 3600:
        hours, minutes = divmod(round(seconds / 60), 60)
        return f"{hours} h {minutes} min"
    minutes, rest = divmod(round(seconds), 60)
    return f"{minutes} min {rest} s" if minutes else f"{rest} s"
