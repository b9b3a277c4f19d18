"""A study's report as pages: HTML with figure, settings and seeds; Markdown."""

from __future__ import annotations

from sdnn.reproduction.page import (
    VERDICT_KINDS,
    Call,
    data_url,
    markdown_page,
    render,
    settings_of,
)
from sdnn.reproduction.report import NOTE, RULE_NOTE
from sdnn.reproduction.sweep.report import CHANCES_NOTE, CLAIMS_NOTE, StudyReport
from sdnn.runs.registry import agent_entry

_TEMPLATE = "sweep/study.html.jinja"


def to_html(report: StudyReport, picture: bytes, call: Call) -> str:
    """Make the page.

    Parameters
    ----------
    report
        The results.
    picture
        SVG of the figure.
    call
        How it came about.

    Raises
    ------
    PlotUnavailableError
        If Jinja is not installed.
    """
    comparison = report.comparison
    return render(
        _TEMPLATE,
        report=report,
        study=comparison.study,
        call=call,
        picture=data_url(picture),
        overview=report.claim_overview(),
        chances=report.chance_table(),
        chances_note=CHANCES_NOTE,
        claim_tables=list(report.claim_tables()),
        case_tables=list(report.case_tables()),
        kind_of={verdict.value: kind for verdict, kind in VERDICT_KINDS.items()},
        claims_note=CLAIMS_NOTE,
        rule_note=RULE_NOTE,
        note=NOTE,
        notes=report.table_notes(),
        measures={name.replace("_", " "): text for name, text in report.measures().items()},
        settings=[
            settings_of(
                f"{measured.combination.variant.title}, {measured.combination.case.title},"
                f" {agent_entry(measured.combination.config.agent).title}",
                measured.summary.result,
            )
            for measured in comparison.measured.values()
        ],
    )


def to_markdown(report: StudyReport) -> str:
    """Write the tables as Markdown."""
    study = report.comparison.study
    missing = report.missing()
    return markdown_page(
        report.title,
        [report.scope(), *([f"**{missing}**"] if missing else [])],
        report.tables(),
        report.notes(),
        f"Study {study.file.path.name}; root seed {study.seed}; digest of the rows"
        f" {report.digest[:16]}; sdnn {report.version}.",
    )
