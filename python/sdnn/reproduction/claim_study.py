"""Studies that may name the paper's cases, and whose report judges the paper's claims."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import ClassVar

from sdnn.reports.pages import Section, Table
from sdnn.reproduction.cases import PAPER_CASES, PAPER_EPISODES, PAPER_TRIALS
from sdnn.reproduction.claims import ClaimOutcome, TenTrials, judge_claims
from sdnn.reproduction.report import CHECKS_HEADER, RULE_NOTE, VERDICT_KINDS, check_rows
from sdnn.reproduction.reproduce import with_paper_defaults
from sdnn.runs.report import format_share
from sdnn.runs.settings import Values
from sdnn.runs.study import Comparison, StudyCase
from sdnn.runs.study_file import KnownCase, StudyFile
from sdnn.runs.sweep import Addition

MIN_TRIALS_TO_DRAW = 2 * PAPER_TRIALS
"""Fewer trials are too few to draw ten from."""

CLAIMS_NOTE = "A claim is shown where the study has every case and agent that it speaks of."
CHANCES_NOTE = (
    f"In how many draws of {PAPER_TRIALS} of a variant's trials, as the paper's ten were one, the"
    " medians lie in all ranges of a claim; with intervals over the trials that are drawn from."
    f" Shown from {MIN_TRIALS_TO_DRAW} trials on."
)


class ClaimStudy(StudyFile):
    """A study that may name the paper's cases, and whose report has verdicts on its claims."""

    known_cases: ClassVar[dict[str, KnownCase]] = {
        case.id: KnownCase(case.title, case.settings) for case in PAPER_CASES.values()
    }

    def completed(self, case: StudyCase, values: Values) -> Values:
        """Return the values of a specification, in the paper's cases with the paper's defaults."""
        return with_paper_defaults(values) if case.id in PAPER_CASES else values

    def additions(self, comparison: Comparison) -> Addition:
        """Make verdicts about all claims, how often ten trials show them, and the quantities."""
        judged = judge_variants(comparison)
        values = [
            {
                "variant": variant,
                "ten_trials_show_it": outcome.chance and outcome.chance.to_json(PAPER_EPISODES),
                **outcome.to_json(),
            }
            for variant, claims in judged.items()
            for outcome in claims.values()
        ]
        numbers = sorted({number for claims in judged.values() for number in claims})
        if not numbers:
            return [], {"claims": values}
        titles = {variant.id: variant.title for variant in comparison.variants}
        header = ("variant", *(f"claim {number}" for number in numbers))

        def rows(cell: Callable[[ClaimOutcome], str]) -> list[tuple[str, ...]]:
            return [
                (titles[variant], *(cell(claims[n]) if n in claims else "-" for n in numbers))
                for variant, claims in judged.items()
            ]

        verdicts = rows(lambda outcome: outcome.verdict.value)
        table = Table("The paper's claims", header, verdicts, {"-": "none", **VERDICT_KINDS})
        sections = [Section(table=table, notes=[CLAIMS_NOTE, RULE_NOTE])]
        if self.n_trials >= MIN_TRIALS_TO_DRAW:
            chances = rows(lambda outcome: format_share(outcome.chance))
            table = Table("How often ten trials show the claims", header, chances)
            sections.append(Section(level=3, table=table, notes=[CHANCES_NOTE]))
        checks = [
            (titles[variant], *row)
            for variant, claims in judged.items()
            for row in check_rows(claims.values())
        ]
        table = Table(
            "Each quantity of the claims", ("variant", *CHECKS_HEADER), checks, VERDICT_KINDS
        )
        return [*sections, Section(folded=[Section(table=table)])], {"claims": values}


def judge_variants(comparison: Comparison) -> dict[str, dict[int, ClaimOutcome]]:
    """Judge the paper's claims about each variant of a study, by its id and the claim's number.

    A case counts as the paper's by its id, an agent by its own: what a variant has changed is what
    is judged. Claims of which a quantity is not measured are left out.
    """
    judged = {}
    for variant in comparison.variants:
        results = [
            measured.result
            for (case, name), measured in comparison.measured.items()
            if name == variant.id and case in PAPER_CASES
            if measured.combination.spec.environment.is_paper_acrobot
        ]
        draws = TenTrials(results if comparison.study.n_trials >= MIN_TRIALS_TO_DRAW else ())
        judged[variant.id] = {
            outcome.claim.number: replace(outcome, chance=draws.chance(outcome.claim))
            for outcome in judge_claims(results)
            if all(checked.estimate is not None for checked in outcome.checks)
        }
    return judged
