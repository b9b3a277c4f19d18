"""The results of a run as a page and as JSON, and a study's verdicts on the paper's claims."""

from __future__ import annotations

import math
from collections import Counter
from collections.abc import Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from sdnn import _core
from sdnn.reproduction.cases import PAPER_CASES, PAPER_EPISODES, PAPER_TRIALS, Experiment
from sdnn.reproduction.claims import (
    ALWAYS,
    NEVER,
    Check,
    CheckOutcome,
    Claim,
    ClaimOutcome,
    ReferenceResult,
    TenTrials,
    Verdict,
    is_paper_scale,
    judge_claims,
)
from sdnn.reproduction.cost import SERIES, CostRecord
from sdnn.runs.registry import title_of
from sdnn.runs.report import (
    MEASURE_END,
    PERCENT,
    Page,
    Section,
    Table,
    format_estimate,
    format_share,
    measure_cells,
    measures_section,
    settings_section,
)
from sdnn.runs.results import STEP_MEASURES, CaseResult, Estimate
from sdnn.runs.study import Study
from sdnn.runs.study_file import KnownCase
from sdnn.runs.sweep import Addition, Comparison

QUICK_WARNING = "QUICK LOOK: a fraction of the experiments, not their result."
RULE_NOTE = (
    "A line about a claim holds if the whole interval lies in the range that was written down"
    " before the trials were run, does not hold if the whole interval lies outside on one side, and"
    " is undecided otherwise. Runs smaller than"
    f" {PAPER_TRIALS} trials x {PAPER_EPISODES:,} episodes are not judged. A claim of several lines"
    " holds if all of them do, and does not hold if one of them does not."
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

_SHOWN = {
    Verdict.HOLDS: ("good", "hold"),
    Verdict.FAILS: ("bad", "do not hold"),
    Verdict.INCONCLUSIVE: ("open", "inconclusive"),
    Verdict.UNDECIDED: ("open", "undecided"),
    Verdict.NOT_JUDGED: ("none", "not judged"),
    Verdict.NOT_RUN: ("none", "not judged"),
}
VERDICT_KINDS = {verdict.value: kind for verdict, (kind, _) in _SHOWN.items()}
"""Color of a verdict's word on a page."""


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
            sections=[*self._first_sections(pictures), *self._details()],
            source=f"Root seed {self.seed}; digest of the rows {self.digest[:16]}; sdnn"
            f" {_core.__version__}.",
        )

    def _first_sections(self, pictures: Mapping[str, bytes]) -> Iterator[Section]:
        """Make what the page opens with: the claims, a line each, and the figures."""
        if self.claims:
            counts = [one for one in tally(c.decided for c in self.claims) if one[0] != "none"]
            notes = [DECIDED_NOTE] if counts else []
            yield Section(tally=counts, table=_claim_table(self.claims), notes=notes)
        for experiment, _ in self.experiments:
            yield Section(
                title=experiment.title,
                picture=pictures[f"experiment-{experiment.id}"],
                alt=f"{experiment.title}: steps per test episode against learning episodes",
            )
        if self.costs:
            yield Section(
                title="Cost of a step",
                picture=pictures["cost"],
                alt="Time of a step against the number of inputs, logarithmic",
                is_narrow=True,
            )

    def _details(self) -> Iterator[Section]:
        """Make what opens on demand: the rule, every quantity, measures and settings."""
        folded = []
        if self.claims:
            folded.append(Section(table=_check_table(self.claims), notes=[RULE_NOTE]))
        more = _more_table(self.claims)
        if more.rows:
            seeds = sorted({one.root_seed for one in self.reference})
            note = (
                "The same settings with more trials on other seeds (root"
                f" seed{'s' if len(seeds) > 1 else ''} {' and '.join(map(str, seeds))}), whose"
                f" measures are kept with the library. {CHANCE_NOTE}"
            )
            folded.append(Section(table=more, notes=[note]))
        words = tuple(name.replace("_", " ") for name in STEP_MEASURES)
        header = ("case", "agent", "trials", *words, *MEASURE_END)
        for experiment, results in self.experiments:
            rows = [
                (one.title, title_of(one.agent), str(one.n_trials),
                 *measure_cells(one, STEP_MEASURES))
                for one in results
            ]  # fmt: skip
            folded.append(Section(table=Table(f"{experiment.title}: medians", header, rows)))
        if self.costs:
            folded.append(Section(table=cost_table(self.costs), notes=[COST_NOTE]))
        yield Section(title="Every number", folded=folded)
        if self.experiments:
            yield measures_section(STEP_MEASURES)
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
    """Return a line for each claim, with its verdict by the whole rule where one is judged."""
    claims = list(claims)
    is_judged = any(one.decided not in (Verdict.NOT_JUDGED, Verdict.NOT_RUN) for one in claims)
    rows = []
    for claim in claims:
        found: dict[str, list[str]] = {}
        for one in claim.checks:
            if (text := format_quantity(one)) != "-":
                found.setdefault(_name(one.check), []).append(text)
        ours = "; ".join(f"{name}: {', '.join(values)}" for name, values in found.items())
        paper = "; ".join(dict.fromkeys(one.check.paper for one in claim.checks))
        row = (str(claim.claim.number), claim.claim.text, paper, ours or "-")
        rows.append((*row, claim.decided.value) if is_judged else row)
    header = ("claim", "the paper says", "paper", "ours" if is_judged else "ours, so far")
    return Table(
        "The paper's claims",
        (*header, "verdict") if is_judged else header,
        rows,
        VERDICT_KINDS,
        brief=("claim", "the paper says", *(("verdict",) if is_judged else ()), header[-1]),
    )


def _name(check: Check) -> str:
    """Name a quantity where its claim says about whom it is."""
    if check.measure is None:
        return f"{check.n_inputs} inputs / {check.n_fewer}"
    return check.measure.replace("_", " ") + (", difference" if check.minus else "")


def _check_table(claims: Iterable[ClaimOutcome]) -> Table:
    """Return the verdict on each check by these trials alone."""
    rows = [
        (str(claim.claim.number), str(one.check), one.check.paper,
         format_quantity(one), one.verdict.value)
        for claim in claims
        for one in claim.checks
    ]  # fmt: skip
    header = ("claim", "measured", "paper", "ours", "verdict")
    return Table("Each quantity of the claims, by these trials alone", header, rows, VERDICT_KINDS)


def _more_table(claims: Iterable[ClaimOutcome]) -> Table:
    """Return verdicts by reference results: of each claim by the whole rule, then of its checks."""
    rows: list[tuple[str, ...]] = []
    for claim in claims:
        if claim.more is None:
            continue
        start = (str(claim.claim.number), claim.claim.text, "", "", "")
        rows.append((*start, claim.decided.value, format_share(claim.chance)))
        for one in claim.more.checks:
            words = (str(one.check), str(min(s.size for s in one.samples)))
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
    measure, estimate = checked.check.measure, checked.estimate
    if estimate is None:
        return "-"
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


MIN_TRIALS_TO_DRAW = 2 * PAPER_TRIALS
"""Fewer trials are too few to draw ten from."""

CLAIMS_NOTE = (
    "A claim is shown where the study has every case and agent that it speaks of. (moved): the"
    " verdict about the reference is another one."
)
CHANCES_NOTE = (
    f"In how many draws of {PAPER_TRIALS} of a variant's trials, as the paper's ten were one, the"
    " medians lie in all ranges of a claim, and of all claims together; with intervals over the"
    f" trials that are drawn from. Shown from {MIN_TRIALS_TO_DRAW} trials on."
)
_MOVED = " (moved)"
_KINDS = {"-": "none", **{word + end: kind for word, kind in VERDICT_KINDS.items()
                          for end in ("", _MOVED)}}  # fmt: skip


def read_study(path: Path, *, n_trials: int | None = None, seed: int | None = None) -> Study:
    """Read a study that may name the paper's cases; see `sdnn.runs.study.Study`."""
    known_cases = {
        case.id: KnownCase(
            case.title, {"sensors.n_sensors": case.n_sensors, "sensors.noise": case.noise}
        )
        for case in PAPER_CASES.values()
    }
    return Study(path, n_trials=n_trials, seed=seed, known_cases=known_cases)


class StudyClaims:
    """The paper's claims about the variants of a study.

    A case counts as the paper's by its id, an agent by its own: what a variant has changed is what
    is judged. `by_variant` has the claims of which every quantity is measured, by variant and
    number of the claim; `shown` are the claims about any variant.
    """

    def __init__(self, comparison: Comparison) -> None:
        self.comparison = comparison
        results: dict[str, list[CaseResult]] = {v.id: [] for v in comparison.variants}
        for (case, variant), measured in comparison.measured.items():
            if case in PAPER_CASES and measured.combination.spec.environment is None:
                results[variant].append(measured.result)
        self._ten_trials = {variant: TenTrials(own) for variant, own in results.items()}
        self.by_variant = {
            variant: {
                outcome.claim.number: replace(outcome, chance=self._chance(variant, outcome.claim))
                for outcome in judge_claims(own)
                if all(checked.estimate is not None for checked in outcome.checks)
            }
            for variant, own in results.items()
        }
        found = {n: one.claim for own in self.by_variant.values() for n, one in own.items()}
        self.shown = tuple(found[number] for number in sorted(found))

    def moved(self, variant: str, outcome: ClaimOutcome) -> bool | None:
        """Return whether the verdict differs from that of the reference; None if one is missing."""
        reference = self.comparison.study.reference
        other = self.by_variant.get(reference, {}).get(outcome.claim.number)
        if variant == reference or other is None:
            return None
        if Verdict.NOT_JUDGED in (outcome.verdict, other.verdict):
            return None
        return outcome.verdict is not other.verdict

    def sections(self) -> Iterator[Section]:
        """Make verdicts about all claims, how often ten trials show them, and the quantities."""
        titles = {variant.id: variant.title for variant in self.comparison.variants}
        header = ("variant", *(f"claim {claim.number}" for claim in self.shown))
        verdicts, chances = [], []
        for variant, claims in self.by_variant.items():
            own = [claims.get(claim.number) for claim in self.shown]
            verdicts.append((titles[variant], *(self._verdict(variant, one) for one in own)))
            if together := self._chance(variant, *(one.claim for one in own if one)):
                shares = (format_share(one.chance if one else None) for one in own)
                chances.append((titles[variant], *shares, format_share(together)))
        if self.shown:
            table = Table("The paper's claims", header, verdicts, _KINDS)
            yield Section(table=table, notes=[CLAIMS_NOTE, RULE_NOTE])
        if chances:
            title = "How often ten trials show the claims"
            table = Table(title, (*header, "all of these"), chances)
            yield Section(level=3, table=table, notes=[CHANCES_NOTE])
        tables = [self._details(claim, titles) for claim in self.shown]
        yield Section(folded=[Section(table=table) for table in tables])

    def _verdict(self, variant: str, outcome: ClaimOutcome | None) -> str:
        if outcome is None:
            return "-"
        return outcome.verdict.value + (_MOVED if self.moved(variant, outcome) else "")

    def _details(self, claim: Claim, titles: Mapping[str, str]) -> Table:
        rows = []
        for variant, claims in self.by_variant.items():
            if found := claims.get(claim.number):
                cells = (f"{format_quantity(one)}: {one.verdict.value}" for one in found.checks)
                rows.append((titles[variant], *cells, self._verdict(variant, found)))
        measured = (f"{one} (paper: {one.paper})" for one in claim.checks)
        header = ("variant", *measured, "verdict")
        return Table(f"Claim {claim.number}: {claim.text}", header, rows)

    def _chance(self, variant: str, *claims: Claim) -> Estimate | None:
        if self.comparison.study.n_trials < MIN_TRIALS_TO_DRAW or not claims:
            return None
        return self._ten_trials[variant].chance(*claims)


def add_claims(comparison: Comparison) -> Addition:
    """Make the addition about the paper's claims to the report of a study."""
    claims = StudyClaims(comparison)
    shown = [
        {
            "variant": variant,
            "moved": claims.moved(variant, one),
            "ten_trials_show_it": one.chance and one.chance.to_json(PAPER_EPISODES),
            **one.to_json(),
        }
        for variant, outcomes in claims.by_variant.items()
        for one in outcomes.values()
    ]
    return Addition(sections=[*claims.sections()], json={"claims": shown})
