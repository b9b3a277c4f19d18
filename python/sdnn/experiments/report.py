"""Tables of measures beside the paper's claims: on the screen, as Markdown and as JSON."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from sdnn.experiments.cases import (
    PAPER_EPISODES,
    PAPER_TRIALS,
    Claim,
    Experiment,
    MeasureName,
    agent_title,
)
from sdnn.experiments.results import CaseSummary
from sdnn.experiments.statistics import Estimate

if TYPE_CHECKING:
    from rich.console import Console

HOLDS = "holds"
OPEN = "open: the interval includes the limit"
FAILS = "not supported"
NOT_JUDGED = f"not judged: needs {PAPER_TRIALS} trials x {PAPER_EPISODES:,} episodes"

CASE_HEADER = (
    "case",
    "agent",
    "trials",
    "episodes to learn",
    "of the median curve",
    "final steps",
    "final solved",
    "decisions",
    "us/decision",
)
CLAIM_HEADER = ("claim", "the paper says", "case", "agent", "ours", "verdict")


@dataclass(frozen=True)
class ExperimentReport:
    """An experiment and the summaries of its cases.

    Parameters
    ----------
    experiment
        Which one.
    summaries
        One for each case and agent.
    """

    experiment: Experiment
    summaries: tuple[CaseSummary, ...]


def format_estimate(estimate: Estimate, measure: MeasureName, n_episodes: int) -> str:
    """Write an estimate with its interval; what is censored becomes ``>n_episodes``.

    Examples
    --------
    >>> format_estimate(Estimate(120.0, 90.0, math.inf), "episodes_to_learn", 15000)
    '120 [90, >15000]'
    """

    def number(value: float) -> str:
        if math.isinf(value):
            return f">{n_episodes}"
        return f"{100 * value:.0f} %" if measure == "final_share_solved" else f"{value:g}"

    if math.isnan(estimate.lower):
        return number(estimate.value)
    return f"{number(estimate.value)} [{number(estimate.lower)}, {number(estimate.upper)}]"


def is_paper_scale(summary: CaseSummary) -> bool:
    """Whether there are as many trials and episodes as in the paper, so that claims are judged."""
    return summary.result.n_trials >= PAPER_TRIALS and summary.result.episode[-1] >= PAPER_EPISODES


def judge(claim: Claim, summary: CaseSummary) -> str:
    """Say whether a case supports a claim.

    It holds if the whole interval is at most the limit, is not supported if the whole interval is
    above it, and is open otherwise. Runs smaller than the paper's are not judged.
    """
    if not is_paper_scale(summary):
        return NOT_JUDGED
    estimate = summary.medians[claim.measure]
    if estimate.upper <= claim.limit:
        return HOLDS
    return FAILS if estimate.lower > claim.limit else OPEN


def case_rows(report: ExperimentReport) -> list[tuple[str, ...]]:
    """Rows of the table of measures, under `CASE_HEADER`."""
    rows: list[tuple[str, ...]] = []
    for summary in report.summaries:
        result = summary.result
        last = int(result.episode[-1])
        on_curve = Estimate(summary.median_curve_episodes_to_learn, math.nan, math.nan)
        rows.append(
            (
                result.case.title,
                agent_title(result.agent),
                str(result.n_trials),
                format_estimate(summary.medians["episodes_to_learn"], "episodes_to_learn", last),
                format_estimate(on_curve, "episodes_to_learn", last),
                format_estimate(summary.medians["final_steps"], "final_steps", last),
                format_estimate(summary.medians["final_share_solved"], "final_share_solved", last),
                f"{result.n_decisions:,}",
                f"{result.microseconds_per_decision:.1f}",
            )
        )
    return rows


def claim_rows(report: ExperimentReport) -> list[tuple[str, ...]]:
    """Rows of the table of claims, under `CLAIM_HEADER`."""
    return [
        (
            str(claim.number),
            claim.text,
            summary.result.case.title,
            agent_title(summary.result.agent),
            format_estimate(
                summary.medians[claim.measure], claim.measure, int(summary.result.episode[-1])
            ),
            judge(claim, summary),
        )
        for claim in report.experiment.claims
        for summary in report.summaries
    ]


NOTES = (
    "Medians over trials with 95 % bootstrap intervals over trials. Episodes to learn: first test"
    " episode of at most 10 steps that begins ten tests in a row with a median of at most 10."
    " Final: over the last 50 test episodes. us/decision: processor time of sensing, choosing,"
    " physics and learning."
)


def print_report(reports: Sequence[ExperimentReport], console: Console, *, quick: bool) -> None:
    """Print the tables."""
    from rich import box
    from rich.table import Table

    for report in reports:
        title = report.experiment.title + (" (QUICK LOOK, not the result)" if quick else "")
        for name, header, rows in (
            (title, CASE_HEADER, case_rows(report)),
            ("Beside the paper's claims", CLAIM_HEADER, claim_rows(report)),
        ):
            table = Table(title=name, title_justify="left", box=box.SIMPLE_HEAD)
            for column in header:
                table.add_column(column)
            for row in rows:
                table.add_row(*row)
            console.print(table)
    console.print(NOTES, style="dim", highlight=False)


def to_markdown(reports: Sequence[ExperimentReport], *, quick: bool, footer: str) -> str:
    """Write the tables as Markdown."""

    def table(header: Sequence[str], rows: Sequence[Sequence[str]]) -> list[str]:
        lines = ["| " + " | ".join(row) + " |" for row in (header, *rows)]
        return [lines[0], "|" + "---|" * len(header), *lines[1:], ""]

    lines = []
    for report in reports:
        lines += [f"# {report.experiment.title}", ""]
        if quick:
            lines += ["**A quick look at a fraction of the experiment, not its result.**", ""]
        lines += table(CASE_HEADER, case_rows(report))
        lines += ["Beside the paper's claims:", "", *table(CLAIM_HEADER, claim_rows(report))]
    return "\n".join([*lines, NOTES, "", footer, ""])


def to_json(reports: Sequence[ExperimentReport], *, quick: bool) -> dict[str, Any]:
    """Return the tables as values that JSON can hold.

    A censored value is the text ``">n"`` with n the last episode; an interval that one trial
    cannot give is null.
    """
    return {
        "quick": quick,
        "experiments": [
            {
                "id": report.experiment.id,
                "title": report.experiment.title,
                "cases": [_summary_json(summary) for summary in report.summaries],
                "claims": [dict(zip(CLAIM_HEADER, row, strict=True)) for row in claim_rows(report)],
            }
            for report in reports
        ],
    }


def _summary_json(summary: CaseSummary) -> dict[str, Any]:
    result = summary.result
    last = int(result.episode[-1])

    def number(value: float) -> float | str | None:
        if math.isnan(value):
            return None
        return f">{last}" if math.isinf(value) else value

    def numbers(estimate: Estimate) -> dict[str, float | str | None]:
        ends = {"value": estimate.value, "lower": estimate.lower, "upper": estimate.upper}
        return {name: number(value) for name, value in ends.items()}

    return {
        "case": result.case.id,
        "title": result.case.title,
        "paper_figure": result.case.paper_figure,
        "agent": result.agent,
        "config_hash": result.config_hash,
        "versions": sorted({record.version for record in result.records}),
        "seeds": [record.key.seed for record in result.records],
        "n_trials": result.n_trials,
        "last_episode": last,
        "measures": {
            name: {
                "trials": [number(float(value)) for value in summary.values[name]],
                "median": numbers(summary.medians[name]),
                "iqm": numbers(summary.iqms[name]),
            }
            for name in summary.values
        },
        "median_curve_episodes_to_learn": number(summary.median_curve_episodes_to_learn),
        "n_decisions": result.n_decisions,
        "microseconds_per_decision": number(result.microseconds_per_decision),
    }
