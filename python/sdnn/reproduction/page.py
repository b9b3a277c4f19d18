"""The report as pages: one self-contained HTML page with figures, settings and seeds; Markdown.

Jinja is an extra and is imported when it is needed.
"""

from __future__ import annotations

import base64
import json
from collections import Counter
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from importlib.util import find_spec
from typing import Any

from sdnn.reproduction.cases import PAPER_EPISODES, PAPER_TRIALS
from sdnn.reproduction.report import (
    CASE_HEADER,
    CLAIM_HEADER,
    COST_NOTE,
    MEASURES,
    MORE_HEADER,
    NOTE,
    POWER_HEADER,
    POWER_NOTE,
    QUICK_WARNING,
    RULE_NOTE,
    Report,
    case_rows,
    claim_rows,
    cost_header,
    cost_rows,
    more_note,
    more_rows,
    power_rows,
)
from sdnn.reproduction.results import CaseResult
from sdnn.reproduction.verdicts import Verdict
from sdnn.runs.registry import agent_entry
from sdnn.runs.trial_errors import PlotUnavailableError

_TEMPLATE = "report.html.jinja"

VERDICT_KINDS = {
    Verdict.HOLDS: "good",
    Verdict.FAILS: "bad",
    Verdict.CHANCE: "open",
    Verdict.UNDECIDED: "open",
    Verdict.NOT_JUDGED: "none",
    Verdict.NOT_RUN: "none",
}
"""How the page shows a verdict."""

TALLY_WORDS = {
    Verdict.HOLDS: "hold",
    Verdict.FAILS: "do not hold",
    Verdict.CHANCE: "are a matter of chance with ten trials",
    Verdict.UNDECIDED: "undecided",
    Verdict.NOT_JUDGED: "not judged",
    Verdict.NOT_RUN: "not judged",
}
"""What so many claims do."""


@dataclass(frozen=True, kw_only=True)
class Call:
    """The call of the command that made the page.

    Parameters
    ----------
    machine
        Processor and instruction set.
    seconds
        Wall time.
    n_run
        Trials it ran.
    n_planned
        Trials it needed.
    processor_seconds
        Processor time of all trials on the page.
    """

    machine: str
    seconds: float
    n_run: int
    n_planned: int
    processor_seconds: float

    def describe(self) -> str:
        """Say how long it took."""
        of_trials = f"Processor time of the trials shown: {duration_words(self.processor_seconds)}."
        if self.n_run < self.n_planned:
            return (
                f"{of_trials} {self.n_planned - self.n_run} of {self.n_planned} trials were stored"
                " before the call that made this page."
            )
        return f"Everything asked for was run in {duration_words(self.seconds)}. {of_trials}"


def require_jinja() -> None:
    """Check that the page can be made.

    Raises
    ------
    PlotUnavailableError
        If Jinja is not installed.
    """
    if find_spec("jinja2") is None:
        raise PlotUnavailableError(
            'the report needs Jinja, which is not installed: pip install "sdnn[reproduce]"'
        )


def to_html(report: Report, pictures: Mapping[str, bytes], call: Call) -> str:
    """Make the page.

    Parameters
    ----------
    report
        The results.
    pictures
        SVG of each figure, by the name of its file without suffix.
    call
        How it came about.

    Raises
    ------
    PlotUnavailableError
        If Jinja is not installed.
    """
    summaries = [summary for one in report.experiments for summary in one.summaries]
    verdicts = {verdict.value: kind for verdict, kind in VERDICT_KINDS.items()}
    return render(
        _TEMPLATE,
        report=report,
        call=call,
        warning=QUICK_WARNING,
        is_paper_scale=all(summary.is_paper_scale for summary in summaries),
        paper_scale=f"{PAPER_TRIALS} trials x {PAPER_EPISODES:,} episodes",
        tally=tally(one.verdict for one in report.settled),
        sections=[
            {
                "title": one.experiment.title,
                "picture": data_url(pictures[f"experiment-{one.experiment.id}"]),
                "rows": case_rows(one.summaries),
            }
            for one in report.experiments
        ],
        cost_picture=data_url(pictures["cost"]) if report.costs else None,
        cost_header=cost_header(),
        cost_rows=cost_rows(report.costs),
        case_header=CASE_HEADER,
        claim_header=CLAIM_HEADER,
        claim_rows=claim_rows(report.claims),
        more_header=MORE_HEADER,
        more_rows=more_rows(report),
        more_note=more_note(report),
        power_header=POWER_HEADER,
        power_rows=power_rows(report),
        power_note=POWER_NOTE,
        kind_of=verdicts,
        measures={name.replace("_", " "): text for name, text in MEASURES.items()},
        note=NOTE,
        rule_note=RULE_NOTE,
        cost_note=COST_NOTE,
        settings=[
            settings_of(f"{agent_entry(s.result.agent).title}, {s.result.case.title}", s.result)
            for s in summaries
        ],
    )


def tally(verdicts: Iterable[Verdict]) -> list[tuple[str, int, str]]:
    """Count verdicts: how the page shows each kind, how many there are, and what they do.

    Examples
    --------
    >>> tally([Verdict.HOLDS, Verdict.NOT_RUN, Verdict.HOLDS, Verdict.NOT_JUDGED])
    [('good', 2, 'hold'), ('none', 2, 'not judged')]
    """
    counts = Counter((VERDICT_KINDS[verdict], TALLY_WORDS[verdict]) for verdict in verdicts)
    order = {word: place for place, word in enumerate(TALLY_WORDS.values())}
    return sorted(
        ((kind, n, word) for (kind, word), n in counts.items()), key=lambda one: order[one[2]]
    )


def to_markdown(report: Report) -> str:
    """Write the tables as Markdown."""
    head = [f"**{QUICK_WARNING}**"] if report.quick else []
    if note := report.agents_note():
        head.append(note)
    return markdown_page(
        "The paper's experiments",
        head,
        report.tables(),
        report.notes(),
        f"Root seed {report.seed}; digest of the rows {report.digest[:16]}; sdnn {report.version}.",
    )


def markdown_page(
    title: str,
    head: Sequence[str],
    tables: Iterable[tuple[str, Sequence[str], Sequence[Sequence[str]]]],
    notes: Iterable[str],
    end: str,
) -> str:
    """Write a page of tables as Markdown.

    Parameters
    ----------
    title
        Its title.
    head
        Paragraphs before the tables.
    tables
        Title, header and rows of each.
    notes
        A list below them.
    end
        The last line.
    """

    def line(cells: Sequence[str]) -> str:
        return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"

    lines = [f"# {title}", ""]
    for text in head:
        lines += [text, ""]
    for table, header, rows in tables:
        lines += [f"## {table}", "", line(header), "|" + "---|" * len(header)]
        lines += [*map(line, rows), ""]
    lines += [f"- {text}" for text in notes]
    return "\n".join([*lines, "", end, ""])


def render(template: str, **values: Any) -> str:
    """Fill a template of this package.

    Parameters
    ----------
    template
        Its path from here.
    values
        What it speaks of.

    Raises
    ------
    PlotUnavailableError
        If Jinja is not installed.
    """
    require_jinja()
    from jinja2 import Environment, PackageLoader, StrictUndefined

    environment = Environment(
        loader=PackageLoader("sdnn.reproduction", "."),
        autoescape=True,
        undefined=StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template(template).render(**values)


def settings_of(title: str, result: CaseResult) -> dict[str, Any]:
    """Say for a page what fixes the rows of a result."""
    return {
        "title": title,
        "hash": result.config_hash,
        "seeds": [record.key.seed for record in result.records],
        "versions": sorted({record.version for record in result.records}),
        "config": json.dumps(json.loads(result.records[0].config), indent=2),
    }


def data_url(svg: bytes) -> str:
    """Put a picture into the page: its names then cannot clash with those of another."""
    return "data:image/svg+xml;base64," + base64.b64encode(svg).decode()


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
