"""What a run gave, as tables: on the screen, as Markdown and as JSON."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

from sdnn.experiments.cases import PAPER_EPISODES, Experiment
from sdnn.experiments.claims import describe
from sdnn.experiments.cost import CostRecord
from sdnn.experiments.measures import MeasureName
from sdnn.experiments.records import TrialRecord
from sdnn.experiments.results import CaseSummary
from sdnn.experiments.statistics import Estimate
from sdnn.experiments.tables import (
    CASE_HEADER,
    CLAIM_HEADER,
    COST_NOTE,
    MEASURES,
    NOTE,
    RULE_NOTE,
    case_rows,
    claim_rows,
    cost_header,
    cost_rows,
)
from sdnn.experiments.verdicts import ClaimOutcome, judge_claims

if TYPE_CHECKING:
    from rich.console import Console

QUICK_WARNING = "A quick look at a fraction of the experiments, not their result."


ROW_HEADER = (
    "case", "agent", "trial", "seed", "config_hash", "version", "episode", "steps",
    "episode_return", "solved",
)  # fmt: skip
"""Columns of the file of all test episodes."""

COST_ROW_HEADER = (
    "series", "n_inputs", "round", "microseconds", "n_steps", "table_bytes", "version", "machine"
)  # fmt: skip
"""Columns of the file of all rounds of cost measurements."""


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


@dataclass(frozen=True)
class Report:
    """Everything that tables and pages are made of.

    Parameters
    ----------
    experiments
        Those of which every trial is there.
    costs
        Measured costs; none if they were not measured.
    quick
        Whether this is a look at a fraction.
    seed
        Root of all seeds.
    version
        Version of the library that made the report.
    digest
        Digest of the experiments' rows.
    """

    experiments: tuple[ExperimentReport, ...]
    costs: tuple[CostRecord, ...]
    quick: bool
    seed: int
    version: str
    digest: str

    @cached_property
    def claims(self) -> tuple[ClaimOutcome, ...]:
        """The claims that these results speak about."""
        return judge_claims([s for e in self.experiments for s in e.summaries], self.costs)

    @property
    def last_episode(self) -> int:
        """Learning episodes of a trial."""
        episodes = [s.result.last_episode for e in self.experiments for s in e.summaries]
        return max(episodes, default=PAPER_EPISODES)

    def tables(self) -> list[tuple[str, Sequence[str], Sequence[Sequence[str]]]]:
        """Title, header and rows of every table."""
        tables: list[tuple[str, Sequence[str], Sequence[Sequence[str]]]] = [
            (report.experiment.title, CASE_HEADER, case_rows(report.summaries))
            for report in self.experiments
        ]
        if self.costs:
            tables.append(("Cost of a step", cost_header(), cost_rows(self.costs)))
        claims = claim_rows(self.claims, self.last_episode)
        return [*tables, ("Beside the paper's claims", CLAIM_HEADER, claims)]

    def notes(self) -> list[str]:
        """Say what the tables mean."""
        notes = [RULE_NOTE]
        if self.experiments:
            notes += [NOTE, *(f"{n.replace('_', ' ')}: {text}." for n, text in MEASURES.items())]
        return [*notes, COST_NOTE] if self.costs else notes


def print_report(report: Report, console: Console) -> None:
    """Print the tables."""
    from rich import box
    from rich.table import Table

    for title, header, rows in report.tables():
        mark = " (QUICK LOOK, not the result)" if report.quick else ""
        table = Table(title=title + mark, title_justify="left", box=box.SIMPLE_HEAD)
        for column in header:
            table.add_column(column)
        for row in rows:
            table.add_row(*row)
        console.print(table)
    for note in report.notes():
        console.print(note, style="dim", highlight=False)


def to_markdown(report: Report) -> str:
    """Write the tables as Markdown."""

    def line(cells: Sequence[str]) -> str:
        return "| " + " | ".join(cell.replace("|", "\\|") for cell in cells) + " |"

    lines = ["# The paper's experiments", ""]
    if report.quick:
        lines += [f"**{QUICK_WARNING}**", ""]
    for title, header, rows in report.tables():
        lines += [f"## {title}", "", line(header), "|" + "---|" * len(header)]
        lines += [*map(line, rows), ""]
    lines += [f"- {note}" for note in report.notes()]
    lines += [
        "",
        f"Root seed {report.seed}; digest of the rows {report.digest[:16]}; sdnn {report.version}.",
        "",
    ]
    return "\n".join(lines)


def trial_rows(records: Iterable[TrialRecord]) -> Iterator[tuple[object, ...]]:
    """All test episodes of trials, each once, under `ROW_HEADER`."""
    for record in records:
        key, rows = record.key, record.rows
        start = (key.case_id, key.agent, key.trial, key.seed, key.config_hash, record.version)
        columns = (rows.episode, rows.steps, rows.episode_return, rows.solved.astype(int))
        for row in zip(*(column.tolist() for column in columns), strict=True):
            yield (*start, *row)


def round_rows(costs: Iterable[CostRecord]) -> Iterator[tuple[object, ...]]:
    """All rounds of cost measurements under `COST_ROW_HEADER`."""
    for cost in costs:
        end = (cost.times.n_steps, cost.times.table_bytes, cost.version, cost.machine)
        for number, microseconds in enumerate(cost.microseconds.tolist()):
            yield (cost.key.series, cost.key.n_inputs, number, microseconds, *end)


def to_json(report: Report) -> dict[str, Any]:
    """Return the tables as values that JSON can hold.

    A censored value is the text ``">n"`` with n the last episode; an interval that one trial
    cannot give is null.
    """
    last = report.last_episode
    return {
        "quick": report.quick,
        "seed": report.seed,
        "version": report.version,
        "digest": report.digest,
        "experiments": [
            {
                "id": one.experiment.id,
                "title": one.experiment.title,
                "cases": [_summary_json(summary) for summary in one.summaries],
            }
            for one in report.experiments
        ],
        "costs": [
            {
                "series": cost.key.series,
                "n_inputs": cost.key.n_inputs,
                "microseconds": cost.microseconds.tolist(),
                "n_steps": cost.times.n_steps,
                "table_bytes": cost.times.table_bytes,
                "machine": cost.machine,
                "version": cost.version,
            }
            for cost in report.costs
        ],
        "claims": [
            {
                "number": outcome.claim.number,
                "text": outcome.claim.text,
                "verdict": outcome.verdict.value,
                "checks": [
                    {
                        "measured": describe(checked.check.quantity),
                        "paper": checked.check.paper,
                        "at_least": _number(checked.check.at_least, None),
                        "at_most": _number(checked.check.at_most, None),
                        "ours": None
                        if checked.estimate is None
                        else _estimate_json(checked.estimate, last),
                        "verdict": checked.verdict.value,
                    }
                    for checked in outcome.checks
                ],
            }
            for outcome in report.claims
        ],
    }


def _number(value: float, last_episode: int | None) -> float | str | None:
    if math.isnan(value) or (math.isinf(value) and last_episode is None):
        return None
    return f">{last_episode}" if math.isinf(value) else value


def _estimate_json(estimate: Estimate, last_episode: int) -> dict[str, float | str | None]:
    ends = {"value": estimate.value, "lower": estimate.lower, "upper": estimate.upper}
    return {name: _number(value, last_episode) for name, value in ends.items()}


def _summary_json(summary: CaseSummary) -> dict[str, Any]:
    result = summary.result
    last = result.last_episode

    def measure(name: MeasureName) -> dict[str, Any]:
        return {
            "trials": [_number(float(value), last) for value in summary.values[name]],
            "median": _estimate_json(summary.medians[name], last),
        }

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
        "measures": {name: measure(name) for name in summary.values},
        "median_curve_episodes_to_learn": _number(summary.median_curve_episodes_to_learn, last),
        "n_decisions": result.n_decisions,
        "microseconds_per_decision": _number(result.microseconds_per_decision, None),
    }
