"""The results of a run as a page and as JSON."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from sdnn import _core
from sdnn.agents.registry import title_of
from sdnn.reports.pages import Page, Section, Table, plain_number
from sdnn.reproduction.cases import PAPER_EPISODES, PAPER_TRIALS, Experiment
from sdnn.reproduction.claims import (
    ALWAYS,
    NEVER,
    Check,
    CheckOutcome,
    ClaimOutcome,
    ReferenceResult,
    Verdict,
    is_paper_scale,
    judge_claims,
)
from sdnn.reproduction.cost import SERIES, CostRecord
from sdnn.runs.report import (
    MEASURE_END,
    PERCENT,
    VERIFY_NOTE,
    format_estimate,
    measure_cells,
    measures_section,
    settings_section,
)
from sdnn.runs.results import STEP_MEASURES, CaseResult, records_of
from sdnn.runs.trial import TrialRecord, records_digest

QUICK_WARNING = "QUICK LOOK: a fraction of the experiments, not their result."
RULE_NOTE = (
    "A line about a claim holds if the whole interval lies in the range that was written down"
    " before the trials were run, does not hold if the whole interval lies outside on one side, and"
    " is undecided otherwise. Runs smaller than"
    f" {PAPER_TRIALS} trials x {PAPER_EPISODES:,} episodes are not judged. A claim of several lines"
    " holds if all of them do, and does not hold if one of them does not."
)
INTERVALS_NOTE = (
    f"Ours: medians over trials, in brackets their {PERCENT} bootstrap intervals; differences and"
    " ratios are those of medians."
)
TOO_SHORT = "too short to tell"
TOO_SHORT_NOTE = (
    f"{TOO_SHORT.capitalize()}: the measure needs more episodes than these trials have; see what is"
    " measured, below."
)
DECIDED_NOTE = (
    f"Medians with {PERCENT} intervals over trials. A verdict is by stored reference results, too,"
    " where there are any: the rule and every number are below."
)
CHANCE_NOTE = (
    "Ten trials show it: in how many draws of ten of these trials, as the paper's ten were one, the"
    " medians lie in all ranges of the claim. What these trials leave undecided holds if"
    f" {100 * ALWAYS:.0f} % of the draws or more show it, does not hold if {100 * NEVER:.0f} % or"
    " fewer do, and is inconclusive in between: what ten trials show then depends on their seeds."
)
COST_NOTE = (
    "Median time of a step (acting in a new random state and learning the transition to it, without"
    " the environment) with the quartiles of rounds, and its ratio to that with one input fewer."
)

VERDICT_KINDS = {
    Verdict.HOLDS.value: "good",
    Verdict.FAILS.value: "bad",
    Verdict.INCONCLUSIVE.value: "open",
    Verdict.UNDECIDED.value: "open",
    Verdict.NOT_JUDGED.value: "none",
    Verdict.NOT_RUN.value: "none",
}
"""Color of a verdict's word on a page."""


@dataclass(frozen=True)
class Report:
    """The results of a run."""

    experiments: tuple[tuple[Experiment, tuple[CaseResult, ...]], ...]  # those that are complete
    costs: tuple[CostRecord, ...]
    quick: bool
    seed: int  # root of all seeds
    agents: tuple[str, ...] = ()  # that were run instead of those of the cases
    reference: tuple[ReferenceResult, ...] = ()  # more trials of the same settings

    @property
    def results(self) -> list[CaseResult]:
        """The results of all experiments."""
        return [result for _, results in self.experiments for result in results]

    @property
    def records(self) -> tuple[TrialRecord, ...]:
        """Their trials, each once, sorted."""
        return records_of(self.results)

    @cached_property
    def digest(self) -> str:
        """The digest of their rows."""
        return records_digest(self.records)

    @cached_property
    def claims(self) -> tuple[ClaimOutcome, ...]:
        """The claims about which there are results, judged by these and by reference results."""
        return judge_claims(self.results, self.costs, self.reference)

    def page(self, pictures: Mapping[str, bytes], narrow: Mapping[str, bytes] = {}) -> Page:
        """Return the page; ``pictures`` are figures as SVG, by file name without suffix.

        ``narrow`` are those for telephones, as PNG.
        """
        warnings = []
        if self.quick:
            warnings.append(QUICK_WARNING)
        elif not all(map(is_paper_scale, self.results)):
            warnings.append(
                f"Smaller than the paper's experiments ({PAPER_TRIALS} trials x"
                f" {PAPER_EPISODES:,} episodes): nothing is judged."
            )
        if self.agents:
            titles = ", ".join(title_of(agent) for agent in self.agents)
            warnings.append(
                f"Not the paper's comparison: {titles} instead of the agents of its cases."
            )
        return Page(
            title="Q-learning with noisy and redundant inputs by SDNN-C: the paper's experiments,"
            " run again",
            intro="Every figure of T. Kobayashi, T. Shibuya and M. Morita (JACIII 19(6), 825-832,"
            " 2015) redrawn from stored rows, and each of its claims beside what these rows say.",
            warnings=warnings,
            sections=[*self._first_sections(pictures, narrow), *self._details()],
            source=f"Root seed {self.seed}; digest of the rows {self.digest[:16]}; sdnn"
            f" {_core.__version__}. {VERIFY_NOTE}",
        )

    def _first_sections(
        self, pictures: Mapping[str, bytes], narrow: Mapping[str, bytes]
    ) -> Iterator[Section]:
        """Yield the sections before the appendix: claims, learning curves, costs."""
        if self.claims:
            table = _claim_table(self.claims)
            notes = [DECIDED_NOTE] if "verdict" in table.header else [INTERVALS_NOTE]
            if any(TOO_SHORT in row[-1] for row in table.rows):
                notes.append(TOO_SHORT_NOTE)
            yield Section(table=table, notes=notes)
        for experiment, _ in self.experiments:
            yield Section(
                title=experiment.title,
                picture=pictures[f"experiment-{experiment.id}"],
                narrow_picture=narrow.get(f"experiment-{experiment.id}", b""),
                alt=f"{experiment.title}: steps per test episode against learning episodes",
            )
        if self.costs:
            yield Section(
                title="Cost of a step",
                picture=pictures["cost"],
                narrow_picture=narrow.get("cost", b""),
                alt="Time of a step against the number of inputs, logarithmic",
                is_narrow=True,
            )

    def _details(self) -> Iterator[Section]:
        """Yield the folded tables of all quantities, and the sections about measures, settings."""
        folded = []
        if self.claims:
            title = "Each quantity of the claims, by these trials alone"
            table = Table(title, CHECKS_HEADER, [*check_rows(self.claims)], VERDICT_KINDS)
            folded.append(Section(table=table, notes=[RULE_NOTE]))
        more = _more_table(self.claims)
        if more.rows:
            seeds = sorted({result.root_seed for result in self.reference})
            note = (
                "The same settings with more trials on other seeds (root"
                f" seed{'s' if len(seeds) > 1 else ''} {' and '.join(map(str, seeds))}), whose"
                f" measures are kept with the library. {CHANCE_NOTE}"
            )
            folded.append(Section(table=more, notes=[note]))
        names = tuple(name.replace("_", " ") for name in STEP_MEASURES)
        header = ("case", "agent", "trials", *names, *MEASURE_END)
        for experiment, results in self.experiments:
            rows = [
                (result.title, title_of(result.agent), str(result.n_trials),
                 *measure_cells(result, STEP_MEASURES))
                for result in results
            ]  # fmt: skip
            folded.append(Section(table=Table(f"{experiment.title}: medians", header, rows)))
        if self.costs:
            folded.append(Section(table=cost_table(self.costs), notes=[COST_NOTE]))
        yield Section(title="Every number", folded=folded)
        if self.experiments:
            yield measures_section(STEP_MEASURES)
            yield settings_section(
                (f"{title_of(result.agent)}, {result.title}", result) for result in self.results
            )

    def to_json(self) -> dict[str, object]:
        """Return the results as values that JSON can hold.

        A censored value is the text ``">n"`` with n the last episode; an interval that one trial
        cannot give is null.
        """
        return {
            "quick": self.quick,
            "seed": self.seed,
            "version": _core.__version__,
            "digest": self.digest,
            "experiments": [
                {
                    "id": experiment.id,
                    "title": experiment.title,
                    "cases": [_case_json(experiment, result) for result in results],
                }
                for experiment, results in self.experiments
            ],
            "costs": [cost.to_json() for cost in self.costs],
            "claims": [
                {
                    **claim.to_json(),
                    "with_more_trials": claim.more and claim.more.to_json(),
                    "ten_trials_show_it": claim.chance and claim.chance.to_json(PAPER_EPISODES),
                    "decided": claim.decided.value,
                }
                for claim in self.claims
            ],
        }


def _claim_table(claims: Iterable[ClaimOutcome]) -> Table:
    """Return a row for each claim, with its verdict by the whole rule."""
    claims = list(claims)
    is_judged = any(claim.decided not in (Verdict.NOT_JUDGED, Verdict.NOT_RUN) for claim in claims)
    rows = []
    for claim in claims:
        quantities: dict[str, list[str]] = {}
        for check in claim.checks:
            if (text := format_quantity(check)) != "-":
                values = quantities.setdefault(_quantity_name(check.check), [])
                if text != TOO_SHORT or text not in values:
                    values.append(text)
        ours = "; ".join(f"{name}: {', '.join(values)}" for name, values in quantities.items())
        paper = "; ".join(dict.fromkeys(check.check.paper for check in claim.checks))
        row = (str(claim.claim.number), claim.claim.text, paper, ours or "-")
        rows.append((*row, claim.decided.value) if is_judged else row)
    ours_is = f"ours [{PERCENT} interval]" if is_judged else f"ours, so far [{PERCENT} interval]"
    header = ("claim", "the paper says", "paper", ours_is)
    return Table(
        "The paper's claims",
        (*header, "verdict") if is_judged else header,
        rows,
        VERDICT_KINDS,
        brief=("claim", "the paper says", *(("verdict",) if is_judged else ()), header[-1]),
    )


def _quantity_name(check: Check) -> str:
    """Return the name of a check's quantity, without the agents that the claim's text names."""
    if check.measure is None:
        title = next(series.title for series in SERIES if series.id == check.series)
        return f"{title}, time of a step with {check.n_inputs} inputs / with {check.n_fewer}"
    return check.measure.replace("_", " ") + (", difference" if check.minus else "")


CHECKS_HEADER = ("claim", "measured", "paper", "ours", "verdict")


def check_rows(claims: Iterable[ClaimOutcome]) -> Iterator[tuple[str, ...]]:
    """Yield a row under `CHECKS_HEADER` for each check, with its verdict by these trials alone."""
    for claim in claims:
        for check in claim.checks:
            cells = (str(claim.claim.number), str(check.check), check.check.paper)
            yield (*cells, format_quantity(check), check.verdict.value)


def _more_table(claims: Iterable[ClaimOutcome]) -> Table:
    """Return the table of verdicts by reference results, on each claim and on its checks."""
    rows: list[tuple[str, ...]] = []
    for claim in claims:
        if claim.more is None:
            continue
        start = (str(claim.claim.number), claim.claim.text, "", "", "")
        rows.append((*start, claim.decided.value, format_estimate(claim.chance)))
        for check in claim.more.checks:
            cells = (str(check.check), str(min(samples.size for samples in check.samples)))
            rows.append(("", "", *cells, format_quantity(check), check.verdict.value, ""))
    header = (
        "claim", "the paper says", "measured", "trials", "ours", "verdict", "ten trials show it"
    )  # fmt: skip
    return Table("With more trials", header, rows, VERDICT_KINDS)


def _case_json(experiment: Experiment, result: CaseResult) -> dict[str, object]:
    """Return a result as values for JSON, with its case and the paper's figure of it."""
    figure = next(c.paper_figure for c in experiment.cases if c.id == result.case_id)
    names = {"case": result.case_id, "title": result.title, "paper_figure": figure}
    return names | result.to_json()


def format_quantity(checked: CheckOutcome) -> str:
    """Write the estimate of a check's quantity with its interval; ``"-"`` if it was not run."""
    measure, estimate = checked.check.measure, checked.estimate
    if estimate is None:
        return "-"
    if math.isnan(estimate.value):
        return TOO_SHORT
    if measure is not None:
        return format_estimate(estimate, measure, checked.last_episode)
    value, lower, upper = map(_growth, vars(estimate).values())
    return value if math.isnan(estimate.lower) else f"{value} [{lower}, {upper}]"


def cost_table(costs: Sequence[CostRecord]) -> Table:
    """Return the table of costs: a row for each number of inputs, a column for each series."""
    by_key = {(cost.series, cost.n_inputs): cost for cost in costs}
    rows = []
    for n_inputs in sorted({cost.n_inputs for cost in costs}):
        table = by_key.get(("fuzzy", n_inputs))
        size = "-" if table is None else f"{table.table_bytes / 1e6:,.3g} MB"
        pairs = [(by_key.get((s.id, n_inputs)), by_key.get((s.id, n_inputs - 1))) for s in SERIES]
        rows.append((str(n_inputs), *(_cost_cell(*pair) for pair in pairs), size))
    header = ("inputs", *(series.title for series in SERIES), "FQL's table")
    return Table("Cost of a step", header, rows)


def _cost_cell(cost: CostRecord | None, with_one_less: CostRecord | None) -> str:
    """Return the median time and its quartiles, and the growth since one input less."""
    if cost is None:
        return "-"
    lower, middle, upper = np.percentile(cost.microseconds, (25, 50, 75))
    low, text, high = (plain_number(time, 1) for time in (lower, middle, upper))
    text = f"{text} us [{low}, {high}]"
    if with_one_less is None:
        return text
    return f"{text}, {_growth(middle / float(np.median(with_one_less.microseconds)))}"


def _growth(ratio: float) -> str:
    """Write how many times as long something takes, such as "1.5x" or "1,200x"."""
    return f"{ratio:.1f}x" if ratio < 100 else f"{ratio:,.0f}x"
