"""The results of a run as a page and as JSON."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from sdnn import _core
from sdnn.reproduction.cases import PAPER_EPISODES, PAPER_TRIALS, Experiment
from sdnn.reproduction.claims import (
    ALWAYS,
    NEVER,
    CheckOutcome,
    ClaimOutcome,
    Growth,
    Verdict,
    is_paper_scale,
    judge_claims,
)
from sdnn.reproduction.cost import SERIES, CostRecord
from sdnn.reproduction.reference_results import ReferenceResult
from sdnn.runs.registry import title_of
from sdnn.runs.report import (
    MEASURE_END,
    Page,
    Section,
    Table,
    format_estimate,
    format_share,
    measure_cells,
    measures_section,
    settings_section,
)
from sdnn.runs.results import STEP_MEASURES, CaseResult

QUICK_WARNING = "QUICK LOOK: a fraction of the experiments, not their result."
RULE_NOTE = (
    "A line about a claim holds if the whole interval lies in the range that was written down"
    " before the trials were run, does not hold if the whole interval lies outside on one side, and"
    " is undecided otherwise. Runs smaller than"
    f" {PAPER_TRIALS} trials x {PAPER_EPISODES:,} episodes are not judged. A claim of several lines"
    " holds if all of them do, and does not hold if one of them does not."
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

_SHOWN = {
    Verdict.HOLDS: ("good", "hold"),
    Verdict.FAILS: ("bad", "do not hold"),
    Verdict.INCONCLUSIVE: ("open", "inconclusive"),
    Verdict.UNDECIDED: ("open", "undecided"),
    Verdict.NOT_JUDGED: ("none", "not judged"),
    Verdict.NOT_RUN: ("none", "not judged"),
}
VERDICT_KINDS = {verdict.value: kind for verdict, (kind, _) in _SHOWN.items()}
"""How a page colors the word of a verdict."""


@dataclass(frozen=True)
class Report:
    """The results of a run."""

    experiments: tuple[tuple[Experiment, tuple[CaseResult, ...]], ...]  # those that are complete
    costs: tuple[CostRecord, ...]
    quick: bool
    seed: int  # root of all seeds
    digest: str  # of the experiments' rows
    agents: tuple[str, ...] = ()  # that were run instead of those of the cases
    reference: tuple[ReferenceResult, ...] = ()  # more trials of the same settings

    @property
    def results(self) -> list[CaseResult]:
        """The results of all experiments."""
        return [result for _, results in self.experiments for result in results]

    @cached_property
    def claims(self) -> tuple[ClaimOutcome, ...]:
        """The claims that these results speak about, with what reference results say of them."""
        return judge_claims(self.results, self.costs, self.reference)

    def page(self, pictures: Mapping[str, bytes]) -> Page:
        """Return the page, with the SVG of figures by the names of their files without suffix."""
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
            sections=[*self._claim_sections(), *self._result_sections(pictures)],
            source=f"Root seed {self.seed}; digest of the rows {self.digest[:16]}; sdnn"
            f" {_core.__version__}.",
        )

    def _claim_sections(self) -> Iterator[Section]:
        if self.claims:
            counts = tally(one.decided for one in self.claims)
            yield Section(tally=counts, table=_claim_table(self.claims), notes=[RULE_NOTE])
        more = _more_table(self.claims)
        if more.rows:
            seeds = sorted({one.root_seed for one in self.reference})
            note = (
                "The same settings with more trials on other seeds (root"
                f" seed{'s' if len(seeds) > 1 else ''} {' and '.join(map(str, seeds))}), whose"
                f" measures are kept with the library. {CHANCE_NOTE}"
            )
            yield Section(level=3, table=more, notes=[note])

    def _result_sections(self, pictures: Mapping[str, bytes]) -> Iterator[Section]:
        words = tuple(name.replace("_", " ") for name in STEP_MEASURES)
        header = ("case", "agent", "trials", *words, *MEASURE_END)
        for experiment, results in self.experiments:
            rows = [
                (one.title, title_of(one.agent), str(one.n_trials),
                 *measure_cells(one, STEP_MEASURES))
                for one in results
            ]  # fmt: skip
            yield Section(
                picture=pictures[f"experiment-{experiment.id}"],
                alt=f"{experiment.title}: steps per test episode against learning episodes",
                table=Table(experiment.title, header, rows),
            )
        if self.experiments:
            yield measures_section(STEP_MEASURES)
        if self.costs:
            yield Section(
                picture=pictures["cost"],
                alt="Time of a step against the number of inputs, logarithmic",
                is_narrow=True,
                table=cost_table(self.costs),
                notes=[COST_NOTE],
            )
        if self.experiments:
            yield settings_section(
                (f"{title_of(one.agent)}, {one.title}", one) for one in self.results
            )

    def to_json(self) -> dict[str, Any]:
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
                    **one.to_json(),
                    "with_more_trials": one.more and one.more.to_json(),
                    "ten_trials_show_it": one.chance and one.chance.to_json(PAPER_EPISODES),
                    "decided": one.decided.value,
                }
                for one in self.claims
            ],
        }


def _claim_table(claims: Iterable[ClaimOutcome]) -> Table:
    """Return the verdicts; a claim of several checks has a row of its own before theirs."""
    rows: list[tuple[str, ...]] = []
    for claim in claims:
        start: tuple[str, str] = (str(claim.claim.number), claim.claim.text)
        if len(claim.checks) > 1:
            rows.append((*start, "", "", "", claim.verdict.value))
            start = ("", "")
        for one in claim.checks:
            words = (str(one.check.quantity), one.check.paper, format_quantity(one))
            rows.append((*start, *words, one.verdict.value))
    header = ("claim", "the paper says", "measured", "paper", "ours", "verdict")
    return Table("What the paper claims, and what our data say", header, rows, VERDICT_KINDS)


def _more_table(claims: Iterable[ClaimOutcome]) -> Table:
    """Return verdicts by reference results: of each claim by the whole rule, then of its checks."""
    rows: list[tuple[str, ...]] = []
    for claim in claims:
        if claim.more is None:
            continue
        start = (str(claim.claim.number), claim.claim.text, "", "", "")
        rows.append((*start, claim.decided.value, format_share(claim.chance)))
        for one in claim.more.checks:
            words = (str(one.check.quantity), str(min(s.size for s in one.samples)))
            rows.append(("", "", *words, format_quantity(one), one.verdict.value, ""))
    header = (
        "claim", "the paper says", "measured", "trials", "ours", "verdict", "ten trials show it"
    )  # fmt: skip
    return Table("With more trials", header, rows, VERDICT_KINDS)


def _case_json(experiment: Experiment, result: CaseResult) -> dict[str, Any]:
    figure = next(c.paper_figure for c in experiment.cases if c.id == result.case_id)
    names = {"case": result.case_id, "title": result.title, "paper_figure": figure}
    return names | result.to_json()


def tally(verdicts: Iterable[Verdict]) -> list[tuple[str, int, str]]:
    """Count verdicts: how the page colors each kind, how many there are, and their word.

    >>> tally([Verdict.HOLDS, Verdict.NOT_RUN, Verdict.HOLDS, Verdict.NOT_JUDGED])
    [('good', 2, 'hold'), ('none', 2, 'not judged')]
    """
    counts = Counter(_SHOWN[verdict] for verdict in verdicts)
    shown = dict.fromkeys(_SHOWN.values())
    return [(kind, counts[kind, word], word) for kind, word in shown if counts[kind, word]]


def format_quantity(checked: CheckOutcome) -> str:
    """Write what our data give of a check's quantity, with its interval."""
    quantity, estimate = checked.check.quantity, checked.estimate
    if estimate is None:
        return "-"
    if not isinstance(quantity, Growth):
        return format_estimate(estimate, quantity.measure, checked.last_episode)
    value, lower, upper = map(_growth, vars(estimate).values())
    return value if math.isnan(estimate.lower) else f"{value} [{lower}, {upper}]"


def cost_table(costs: Sequence[CostRecord]) -> Table:
    """Return the table of costs: a row for each number of inputs, a column for each series."""
    by_key = {(cost.series, cost.n_inputs): cost for cost in costs}
    rows = []
    for n_inputs in sorted({cost.n_inputs for cost in costs}):
        table = by_key.get(("fuzzy", n_inputs))
        size = "-" if table is None else _scaled(table.table_bytes, _BYTES, "B")
        found = [(by_key.get((s.id, n_inputs)), by_key.get((s.id, n_inputs - 1))) for s in SERIES]
        rows.append((str(n_inputs), *(_cost(*pair) for pair in found), size))
    return Table("Cost of a step", ("inputs", *(one.title for one in SERIES), "FQL's table"), rows)


def _cost(cost: CostRecord | None, with_one_less: CostRecord | None) -> str:
    if cost is None:
        return "-"
    lower, middle, upper = np.percentile(cost.microseconds, (25, 50, 75))
    text, *ends = (_scaled(time, _TIMES, "us") for time in (middle, lower, upper))
    text = f"{text} [{', '.join(ends)}]"
    if with_one_less is None:
        return text
    return f"{text}, {_growth(middle / float(np.median(with_one_less.microseconds)))}"


_TIMES = (("s", 1e6), ("ms", 1e3))
_BYTES = (("GB", 1e9), ("MB", 1e6), ("kB", 1e3))


def _scaled(value: float, units: Iterable[tuple[str, float]], unit: str) -> str:
    """Write a value in the first unit that it reaches, else in another one."""
    name, size = next(((name, size) for name, size in units if value >= size), (unit, 1))
    return f"{value / size:.3g} {name}"


def _growth(ratio: float) -> str:
    return f"{ratio:.1f}x" if ratio < 100 else f"{ratio:,.0f}x"
