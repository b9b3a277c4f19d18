"""What a run gave, as tables of texts and as JSON: the same cells for screen, Markdown and HTML."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from functools import cached_property
from typing import Any

import numpy as np

from sdnn.reproduction.cases import PAPER_EPISODES, PAPER_TRIALS, Experiment
from sdnn.reproduction.claims import Claim, Growth, describe
from sdnn.reproduction.kept_trials import KeptTrials
from sdnn.reproduction.power import MULTIPLES, N_DRAWS, Power, powers
from sdnn.reproduction.results import CaseSummary
from sdnn.reproduction.verdicts import (
    ALWAYS,
    NEVER,
    CheckOutcome,
    ClaimOutcome,
    SettledClaim,
    judge_claims,
    settle,
)
from sdnn.runs.measures import DEFAULT_MEASURES, RETURN_MEASURES, MeasureName
from sdnn.runs.records import CostRecord
from sdnn.runs.registry import agent_entry, cost_series
from sdnn.runs.statistics import DEFAULT_BOOTSTRAP, Estimate

QUICK_WARNING = "A quick look at a fraction of the experiments, not their result."

CASE_HEADER = (
    "case",
    "agent",
    "trials",
    "episodes to learn",
    "early steps",
    "episode of collapse",
    "final steps",
    "final share solved",
    "decisions",
    "us/decision",
)
CLAIM_HEADER = ("claim", "the paper says", "measured", "paper", "ours", "verdict")
MORE_HEADER = (
    "claim",
    "the paper says",
    "measured",
    "trials",
    "ours",
    "verdict",
    "ten trials show it",
)
POWER_HEADER = ("claim", "measured", "ours", *(f"{n} x the trials" for n in MULTIPLES))

MEASURES: dict[MeasureName, str] = {
    "episodes_to_learn": (
        f"learning episodes before the first test of at most {DEFAULT_MEASURES.good_steps:g} steps"
        f" that begins {DEFAULT_MEASURES.learned_window} tests in a row with a median of at most"
        f" {DEFAULT_MEASURES.good_steps:g}"
    ),
    "early_steps": (
        "median steps of the tests in the first"
        f" {DEFAULT_MEASURES.early_episodes:,} learning episodes"
    ),
    "episode_of_collapse": (
        f"learning episodes before the end of the last {DEFAULT_MEASURES.stable_window} tests in a"
        f" row with a median of at most {DEFAULT_MEASURES.good_steps:g} steps: until then the agent"
        " can do the task; censored (> the last episode) if it still can at the end"
    ),
    "final_steps": f"median steps of the last {DEFAULT_MEASURES.final_window} tests",
    "final_share_solved": (
        f"share of the last {DEFAULT_MEASURES.final_window} tests that reach the goal"
    ),
}
"""What the measures mean, for a reader."""

NOTE = (
    f"Medians over trials with {100 * DEFAULT_BOOTSTRAP.confidence:.0f} % bootstrap intervals over"
    " trials. us/decision: processor time of sensing, choosing, physics and learning."
)

RULE_NOTE = (
    "A line about a claim holds if the whole interval lies in the range that was written down"
    " before the trials were run, does not hold if the whole interval lies outside on one side, and"
    " is undecided otherwise. Runs smaller than"
    f" {PAPER_TRIALS} trials x {PAPER_EPISODES:,} episodes are not judged."
)

CHANCE_NOTE = (
    "Ten trials show it: in how many draws of ten of these trials, as the paper's ten were one, the"
    " medians lie in all ranges of the claim. What these trials leave undecided holds if"
    f" {100 * ALWAYS:.0f} % of the draws or more show it, does not hold if {100 * NEVER:.0f} % or"
    " fewer do, and is a matter of chance in between: what ten trials then show says nothing for or"
    " against the paper."
)

POWER_NOTE = (
    "What more trials would say, by drawing so many from those that are there,"
    f" {N_DRAWS} times: in how many of these draws the line would hold / would not."
)

COST_NOTE = (
    "Median time of a step (acting in a new random state and learning the transition to it, without"
    " the environment) with the quartiles of rounds, and how often longer than with one input less."
)


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
    agents
        Ids of the agents that were run instead of those of the cases; none if those were.
    kept
        More trials of the same settings than were run, kept with the library.
    """

    experiments: tuple[ExperimentReport, ...]
    costs: tuple[CostRecord, ...]
    quick: bool
    seed: int
    version: str
    digest: str
    agents: tuple[str, ...] = ()
    kept: tuple[KeptTrials, ...] = ()

    @cached_property
    def claims(self) -> tuple[ClaimOutcome, ...]:
        """The claims that these results speak about."""
        return judge_claims([s for e in self.experiments for s in e.summaries], self.costs)

    @cached_property
    def settled(self) -> tuple[SettledClaim, ...]:
        """The claims with all that speaks about them, also trials that are kept."""
        return settle(self.claims, self.kept)

    @cached_property
    def powers(self) -> tuple[tuple[Claim, CheckOutcome, tuple[Power, ...]], ...]:
        """What more trials would say of the checks that the most trials leave undecided."""
        checked = ((one.claim, check) for one in self.settled for check in one.best.checks)
        found = ((claim, one, powers(one)) for claim, one in checked)
        return tuple(row for row in found if row[2])

    def tables(self) -> list[tuple[str, Sequence[str], Sequence[Sequence[str]]]]:
        """Title, header and rows of every table."""
        tables: list[tuple[str, Sequence[str], Sequence[Sequence[str]]]] = [
            (report.experiment.title, CASE_HEADER, case_rows(report.summaries))
            for report in self.experiments
        ]
        if self.costs:
            tables.append(("Cost of a step", cost_header(), cost_rows(self.costs)))
        if self.claims:
            claims = claim_rows(self.claims)
            tables.append(("Beside the paper's claims", CLAIM_HEADER, claims))
        if more := more_rows(self):
            tables.append(("With more trials", MORE_HEADER, more))
        if self.powers:
            tables.append(("What is undecided", POWER_HEADER, power_rows(self)))
        return tables

    def notes(self) -> list[str]:
        """Say what the tables mean."""
        notes = [RULE_NOTE] if self.claims else []
        notes += [more_note(self)] if more_rows(self) else []
        notes += [POWER_NOTE] if self.powers else []
        if self.experiments:
            notes += [NOTE, *(f"{n.replace('_', ' ')}: {text}." for n, text in MEASURES.items())]
        return [*notes, COST_NOTE] if self.costs else notes

    def agents_note(self) -> str | None:
        """Say which agents were run instead of the paper's; None if those were."""
        if not self.agents:
            return None
        titles = ", ".join(agent_entry(agent).title for agent in self.agents)
        return f"Not the paper's comparison: {titles} instead of the agents of its cases."


def format_estimate(estimate: Estimate, measure: MeasureName, last_episode: int) -> str:
    """Write an estimate with its interval; what is censored becomes ``>last_episode``.

    Examples
    --------
    >>> format_estimate(Estimate(120.0, 90.0, math.inf), "episodes_to_learn", 15000)
    '120 [90, >15000]'
    >>> format_estimate(Estimate(0.9, 0.8, 1.0), "final_share_solved", 15000)
    '90 % [80, 100]'
    """
    scale, unit = (100, " %") if measure == "final_share_solved" else (1, "")
    decimals = decimals_of(estimate, measure)

    def number(value: float) -> str:
        return f">{last_episode}" if math.isinf(value) else plain_number(scale * value, decimals)

    if math.isnan(estimate.value):
        return "-"
    if math.isnan(estimate.lower):
        return number(estimate.value) + unit
    return f"{number(estimate.value)}{unit} [{number(estimate.lower)}, {number(estimate.upper)}]"


def format_share(estimate: Estimate) -> str:
    """Write a share with its interval.

    Examples
    --------
    >>> format_share(Estimate(0.479, 0.26, 0.712))
    '47.9 % [26, 71.2]'
    """
    return format_estimate(estimate, "final_share_solved", PAPER_EPISODES)


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


def case_rows(summaries: Sequence[CaseSummary]) -> list[tuple[str, ...]]:
    """Rows of the table of measures, under `CASE_HEADER`."""
    rows: list[tuple[str, ...]] = []
    for summary in summaries:
        result = summary.result
        measured = (
            format_estimate(summary.medians[name], name, result.last_episode) for name in MEASURES
        )
        rows.append(
            (
                result.case.title,
                agent_entry(result.agent).title,
                str(result.n_trials),
                *measured,
                f"{result.n_decisions:,}",
                f"{result.microseconds_per_decision:.1f}",
            )
        )
    return rows


def claim_rows(outcomes: Sequence[ClaimOutcome]) -> list[tuple[str, ...]]:
    """Rows of the table of claims, under `CLAIM_HEADER`.

    A claim of several checks has a row of its own, with the verdict about all, before theirs.
    """
    rows: list[tuple[str, ...]] = []
    for outcome in outcomes:
        start: tuple[str, str] = (str(outcome.claim.number), outcome.claim.text)
        if len(outcome.checks) > 1:
            rows.append((*start, "", "", "", outcome.verdict.value))
            start = ("", "")
        for checked in outcome.checks:
            quantity = checked.check.quantity
            ours = _format_quantity(checked)
            rows.append(
                (*start, describe(quantity), checked.check.paper, ours, checked.verdict.value)
            )
    return rows


def more_rows(report: Report) -> list[tuple[str, ...]]:
    """Rows of the table of claims judged by kept trials, under `MORE_HEADER`.

    Each claim has a row with the verdict by the whole rule, then one for each check.
    """
    rows: list[tuple[str, ...]] = []
    for one in report.settled:
        if one.more is None or one.chance is None:
            continue
        shown = format_share(one.chance)
        head = (str(one.claim.number), one.claim.text)
        rows.append((*head, "", "", "", one.verdict.value, shown))
        for checked in one.more.checks:
            quantity = checked.check.quantity
            n_trials = str(min(sample.size for sample in checked.samples))
            ours = _format_quantity(checked)
            word = checked.verdict.value
            rows.append(("", "", describe(quantity), n_trials, ours, word, ""))
    return rows


def more_note(report: Report) -> str:
    """Say which trials these are, and what their table means."""
    seeds = sorted({one.root_seed for one in report.kept})
    words = " and ".join(map(str, seeds))
    return (
        "The same settings with more trials on other seeds"
        f" (root seed{'s' if len(seeds) > 1 else ''} {words}), whose measures are kept with the"
        f" library. {CHANCE_NOTE}"
    )


def power_rows(report: Report) -> list[tuple[str, ...]]:
    """Rows of the table of what is undecided, under `POWER_HEADER`."""
    rows: list[tuple[str, ...]] = []
    for claim, checked, found in report.powers:
        quantity = checked.check.quantity
        ours = _format_quantity(checked)
        chances = (f"{100 * one.holds:.0f} / {100 * one.fails:.0f} %" for one in found)
        rows.append((str(claim.number), describe(quantity), ours, *chances))
    return rows


def _format_quantity(checked: CheckOutcome) -> str:
    quantity, estimate = checked.check.quantity, checked.estimate
    if estimate is None:
        return "-"
    if isinstance(quantity, Growth):
        return _growth(estimate.value) + (
            "" if math.isnan(estimate.lower)
            else f" [{_growth(estimate.lower)}, {_growth(estimate.upper)}]"
        )  # fmt: skip
    return format_estimate(estimate, quantity.measure, checked.last_episode)


def _growth(ratio: float) -> str:
    return f"{ratio:.1f}x" if ratio < 100 else f"{ratio:,.0f}x"


def cost_header() -> tuple[str, ...]:
    """Header of the table of costs: a column for each series."""
    return ("inputs", *(series.title for _, series in cost_series()), "FQL's table")


def cost_rows(costs: Sequence[CostRecord]) -> list[tuple[str, ...]]:
    """Rows of the table of costs, one for each number of inputs, under `cost_header`."""
    by_key = {(cost.key.series, cost.key.n_inputs): cost for cost in costs}
    rows: list[tuple[str, ...]] = []
    for n_inputs in sorted({cost.key.n_inputs for cost in costs}):
        cells = [str(n_inputs)]
        for _, series in cost_series():
            cost = by_key.get((series.id, n_inputs))
            cells.append(
                "-" if cost is None else _cost(cost, by_key.get((series.id, n_inputs - 1)))
            )
        table = by_key.get(("fuzzy", n_inputs))
        cells.append("-" if table is None else _size(table.times.table_bytes))
        rows.append(tuple(cells))
    return rows


def _cost(cost: CostRecord, with_one_less: CostRecord | None) -> str:
    lower, middle, upper = np.percentile(cost.microseconds, (25, 50, 75))
    text = f"{_time(middle)} [{_time(lower)}, {_time(upper)}]"
    if with_one_less is None:
        return text
    return f"{text}, {_growth(middle / float(np.median(with_one_less.microseconds)))}"


def _time(microseconds: float) -> str:
    for unit, size in (("s", 1e6), ("ms", 1e3)):
        if microseconds >= size:
            return f"{microseconds / size:.3g} {unit}"
    return f"{microseconds:.3g} us"


def _size(n_bytes: int) -> str:
    for unit, size in (("GB", 1e9), ("MB", 1e6), ("kB", 1e3)):
        if n_bytes >= size:
            return f"{n_bytes / size:.3g} {unit}"
    return f"{n_bytes} B"


def to_json(report: Report) -> dict[str, Any]:
    """Return the tables as values that JSON can hold.

    A censored value is the text ``">n"`` with n the last episode; an interval that one trial
    cannot give is null.
    """
    return {
        "quick": report.quick,
        "seed": report.seed,
        "version": report.version,
        "digest": report.digest,
        "experiments": [
            {
                "id": one.experiment.id,
                "title": one.experiment.title,
                "cases": [summary.to_json() for summary in one.summaries],
            }
            for one in report.experiments
        ],
        "costs": [cost.to_json() for cost in report.costs],
        "claims": [_claim_json(one) for one in report.settled],
        "powers": [
            {
                "claim": claim.number,
                "measured": describe(checked.check.quantity),
                "with": [asdict(one) for one in found],
            }
            for claim, checked, found in report.powers
        ],
    }


def _claim_json(one: SettledClaim) -> dict[str, Any]:
    chance = None if one.chance is None else one.chance.to_json(PAPER_EPISODES)
    return {
        **one.own.to_json(),
        "with_more_trials": None if one.more is None else one.more.to_json(),
        "ten_trials_show_it": chance,
        "settled": one.verdict.value,
    }
