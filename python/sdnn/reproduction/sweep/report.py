"""A study's results as tables of texts and as JSON."""

from __future__ import annotations

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Any

from sdnn.reproduction.cases import PAPER_EPISODES, PAPER_TRIALS
from sdnn.reproduction.claims import SHARE_STABLE, Claim, describe
from sdnn.reproduction.report import (
    CASE_HEADER,
    MEASURES,
    NOTE,
    RULE_NOTE,
    decimals_of,
    format_estimate,
    format_share,
    plain_number,
)
from sdnn.reproduction.sweep.comparison import (
    MIN_TRIALS_TO_DIFFER,
    MIN_TRIALS_TO_DRAW,
    Comparison,
    Measured,
    VariantClaim,
)
from sdnn.reproduction.verdicts import CheckOutcome
from sdnn.runs.measures import DEFAULT_MEASURES, MeasureName
from sdnn.runs.registry import agent_entry
from sdnn.runs.statistics import DEFAULT_BOOTSTRAP, Estimate

RETURN_MEASURE_TEXTS: dict[MeasureName, str] = {
    "final_return": "mean return of the last tenth of the tests",
    "mean_return": "mean return of all tests: the area under the learning curve",
}
"""What the measures of environments other than the acrobot mean, for a reader."""

MEASURE_TEXTS = MEASURES | RETURN_MEASURE_TEXTS

_PERCENT = f"{100 * DEFAULT_BOOTSTRAP.confidence:.0f} %"

DIFFERENCE_NOTE = (
    "Differences are paired: a trial less the reference's trial of the same number, which has the"
    f" same seed; the mean over trials with its {_PERCENT} bootstrap interval over trials, censored"
    f" episodes as the last one. * marks intervals without 0 over at least {MIN_TRIALS_TO_DIFFER}"
    " trials; where nothing differs, about one in twenty of them does so by chance."
)
SOLVED_NOTE = (
    "end solved: trials that solve at least"
    f" {100 * SHARE_STABLE:.0f} % of their last {DEFAULT_MEASURES.final_window} tests."
)
CLAIMS_NOTE = (
    "A claim is shown where the study has every case and agent that it speaks of. (moved): the"
    " verdict about the reference is another one."
)

CHANCES_NOTE = (
    f"In how many draws of {PAPER_TRIALS} of a variant's trials, as the paper's ten were one, the"
    " medians lie in all ranges of a claim, and of all claims together; with intervals over the"
    f" trials that are drawn from. Shown from {MIN_TRIALS_TO_DRAW} trials on."
)

Table = tuple[str, Sequence[str], Sequence[Sequence[str]]]
"""Title, header and rows."""


@dataclass(frozen=True, kw_only=True)
class StudyReport:
    """Everything that a study's tables and page are made of.

    Parameters
    ----------
    comparison
        The results.
    version
        Version of the library that made the report.
    digest
        Digest of the trials' rows.
    """

    comparison: Comparison
    version: str
    digest: str

    @property
    def title(self) -> str:
        """Title of the study."""
        return self.comparison.study.title

    def scope(self) -> str:
        """Say how much was run."""
        study = self.comparison.study
        return (
            f"{_count(len(study.variants), 'variant')} in {_count(len(study.cases), 'case')},"
            f" {_count(study.n_trials, 'trial')} each; reference: {study.reference}."
        )

    def missing(self) -> str | None:
        """Say what of the study is not there yet; None if all is."""
        study = self.comparison.study
        open_pairs = [pair for pair in study.combinations if pair not in self.comparison.measured]
        if not open_pairs:
            return None
        return (
            f"Not complete: {len(open_pairs)} of {len(study.combinations)} combinations of case and"
            " variant lack trials and are left out."
        )

    def copies(self) -> list[str]:
        """Name the variants that are the same as another one, and were run once."""
        study = self.comparison.study
        return [
            f"{variant.id} is the same as {first}."
            for variant in study.variants
            if (first := study.same_as(variant.id))
        ]

    def claim_overview(self) -> Table | None:
        """Verdicts about all claims, a row for each variant; None if none can be judged."""
        claims = self.comparison.claims_shown
        if not claims:
            return None
        rows = [
            (
                variant.title,
                *(
                    _verdict(self.comparison.claims[variant.id].get(claim.number))
                    for claim in claims
                ),
            )
            for variant in self.comparison.variants
        ]
        header = ("variant", *(f"claim {claim.number}" for claim in claims))
        return "The paper's claims", header, rows

    def chance_table(self) -> Table | None:
        """How often ten trials show the claims, a row for each variant; None if none can be."""
        claims = self.comparison.claims_shown
        rows = []
        for variant in self.comparison.variants:
            together = self.comparison.chance_of_all(variant.id)
            if together is None:
                continue
            found = self.comparison.claims[variant.id]
            ones = (found[c.number].chance if c.number in found else None for c in claims)
            rows.append((variant.title, *map(_share, ones), _share(together)))
        if not rows:
            return None
        header = ("variant", *(f"claim {claim.number}" for claim in claims), "all of these")
        return "How often ten trials show the claims", header, rows

    def claim_tables(self) -> Iterator[Table]:
        """For each claim its quantities, a row for each variant."""
        for claim in self.comparison.claims_shown:
            yield f"Claim {claim.number}: {claim.text}", *self._claim_table(claim)

    def _claim_table(self, claim: Claim) -> tuple[Sequence[str], Sequence[Sequence[str]]]:
        header = (
            "variant",
            *(f"{describe(c.quantity)} (paper: {c.paper})" for c in claim.checks),
            "verdict",
        )
        rows = []
        for variant in self.comparison.variants:
            found = self.comparison.claims[variant.id].get(claim.number)
            if found is None:
                continue
            cells = [_claim_cell(checked) for checked in found.outcome.checks]
            rows.append((variant.title, *cells, _verdict(found)))
        return header, rows

    def case_tables(self) -> Iterator[tuple[str, Table, Table | None]]:
        """For each case its id, the table of measures, and that of differences if there are any."""
        for case in self.comparison.cases:
            measured = self.comparison.of_case(case.id)
            names = [n for n in MEASURE_TEXTS if any(n in m.measures for m in measured)]
            with_end = any(m.solved_at_end is not None for m in measured)
            header = (
                "variant", "agent", "trials", *(["end solved"] if with_end else []),
                *(name.replace("_", " ") for name in names), *CASE_HEADER[-2:],
            )  # fmt: skip
            table = case.title, header, [_measure_row(m, names, with_end) for m in measured]
            compared = [m for m in measured if m.differences]
            differences: Table | None = None
            if compared:
                differences = (
                    f"{case.title}: less {self.comparison.study.reference}, trial by trial",
                    ("variant", *(name.replace("_", " ") for name in names)),
                    [_difference_row(m, names) for m in compared],
                )
            yield case.id, table, differences

    def tables(self) -> list[Table]:
        """All tables."""
        tables: list[Table] = []
        if overview := self.claim_overview():
            tables.append(overview)
        if chances := self.chance_table():
            tables.append(chances)
        for _, table, differences in self.case_tables():
            tables += [table] if differences is None else [table, differences]
        return [*tables, *self.claim_tables()]

    def table_notes(self) -> list[str]:
        """Say what the tables of the cases mean beside the measures."""
        found = self.comparison.measured.values()
        return [
            *self.copies(),
            *([DIFFERENCE_NOTE] if any(m.differences for m in found) else []),
            *([SOLVED_NOTE] if any(m.solved_at_end is not None for m in found) else []),
        ]

    def notes(self) -> list[str]:
        """Say what all tables mean."""
        return [
            NOTE,
            *self.table_notes(),
            *([CLAIMS_NOTE, RULE_NOTE] if self.comparison.claims_shown else []),
            *([CHANCES_NOTE] if self.chance_table() else []),
            *(f"{name.replace('_', ' ')}: {text}." for name, text in self.measures().items()),
        ]

    def measures(self) -> dict[MeasureName, str]:
        """Say what the measures shown mean."""
        shown = {name for m in self.comparison.measured.values() for name in m.measures}
        return {name: text for name, text in MEASURE_TEXTS.items() if name in shown}


def end_solved(measured: Measured) -> str:
    """Write how many trials end solved.

    Returns
    -------
    str
        ``"18 of 20"``, or ``"-"`` where tasks are judged by their return.
    """
    solved = measured.solved_at_end
    return "-" if solved is None else f"{int(solved.sum())} of {solved.size}"


def _count(number: int, word: str) -> str:
    return f"{number} {word}{'' if number == 1 else 's'}"


def _verdict(claim: VariantClaim | None) -> str:
    if claim is None:
        return "-"
    return claim.outcome.verdict.value + (" (moved)" if claim.moved else "")


def _share(estimate: Estimate | None) -> str:
    return "-" if estimate is None else format_share(estimate)


def _claim_cell(checked: CheckOutcome) -> str:
    quantity = checked.check.quantity
    if checked.estimate is None or not hasattr(quantity, "measure"):
        return "-"
    estimate = format_estimate(checked.estimate, quantity.measure, checked.last_episode)
    return f"{estimate}: {checked.verdict.value}"


def _measure_row(
    measured: Measured, names: Sequence[MeasureName], with_end: bool
) -> tuple[str, ...]:
    summary = measured.summary
    result = summary.result
    return (
        measured.combination.variant.title,
        agent_entry(result.agent).title,
        str(result.n_trials),
        *([end_solved(measured)] if with_end else []),
        *(
            format_estimate(summary.medians[name], name, result.last_episode)
            if name in summary.medians
            else "-"
            for name in names
        ),
        f"{result.n_decisions:,}",
        f"{result.microseconds_per_decision:.1f}",
    )


def _difference_row(measured: Measured, names: Sequence[MeasureName]) -> tuple[str, ...]:
    return (
        measured.combination.variant.title,
        *(
            format_difference(measured.differences[name], name)
            + (" *" if measured.differs(name) else "")
            if name in measured.differences
            else "-"
            for name in names
        ),
    )


def format_difference(difference: Estimate, measure: MeasureName) -> str:
    """Write a difference with its sign and interval.

    Examples
    --------
    >>> format_difference(Estimate(0.25, 0.1, 0.4), "final_share_solved")
    '+25 % [+10, +40]'
    >>> format_difference(Estimate(-0.5, -2.0, 1.0), "final_steps")
    '-0.5 [-2, +1]'
    """
    scale, unit = (100, " %") if measure == "final_share_solved" else (1, "")

    decimals = decimals_of(difference, measure)

    def number(value: float) -> str:
        return plain_number(scale * value, decimals, sign="+")

    if math.isnan(difference.value):
        return "-"
    if math.isnan(difference.lower):
        return number(difference.value) + unit
    return (
        f"{number(difference.value)}{unit} [{number(difference.lower)}, {number(difference.upper)}]"
    )


def to_json(report: StudyReport) -> dict[str, Any]:
    """Return the results as values that JSON can hold; censored ones are ``">last_episode"``."""
    comparison = report.comparison
    study = comparison.study
    return {
        "title": study.title,
        "file": study.file.path.name,
        "n_trials": study.n_trials,
        "seed": study.seed,
        "reference": study.reference,
        "version": report.version,
        "digest": report.digest,
        "cases": [{"id": case.id, "title": case.title} for case in study.cases],
        "variants": [
            {"id": v.id, "title": v.title, "same_as": study.same_as(v.id)} for v in study.variants
        ],
        "results": [
            _result_json(case, variant, measured)
            for (case, variant), measured in comparison.measured.items()
        ],
        "claims": [
            {
                "variant": variant,
                "moved": claim.moved,
                "ten_trials_show_it": None
                if claim.chance is None
                else claim.chance.to_json(PAPER_EPISODES),
                **claim.outcome.to_json(),
            }
            for variant, claims in comparison.claims.items()
            for claim in claims.values()
        ],
    }


def _result_json(case: str, variant: str, measured: Measured) -> dict[str, Any]:
    summary, solved = measured.summary, measured.solved_at_end
    last = summary.result.last_episode
    found = summary.to_json()
    del found["case"], found["paper_figure"], found["title"]
    return {
        "case": case,
        "variant": variant,
        "n_end_solved": None if solved is None else int(solved.sum()),
        **found,
        "differences": {
            name: estimate.to_json(last) for name, estimate in measured.differences.items()
        },
    }
