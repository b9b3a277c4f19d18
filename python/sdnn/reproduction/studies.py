"""Studies of the paper's cases, and what their results say about its claims."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from sdnn.reproduction.cases import PAPER_CASES, PAPER_TRIALS
from sdnn.reproduction.chances import TenTrials
from sdnn.reproduction.claims import Claim, describe
from sdnn.reproduction.report import RULE_NOTE, VERDICT_KINDS, chance_json, format_quantity
from sdnn.reproduction.verdicts import ClaimOutcome, Verdict, judge_claims
from sdnn.runs import study
from sdnn.runs.comparison import Comparison
from sdnn.runs.report import Folded, Section, Table, format_share
from sdnn.runs.results import CaseResult
from sdnn.runs.statistics import Estimate
from sdnn.runs.study import Study
from sdnn.runs.study_file import KnownCase
from sdnn.runs.study_report import Addition

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
_KINDS = {
    "-": "none",
    **VERDICT_KINDS,
    **{f"{word} (moved)": kind for word, kind in VERDICT_KINDS.items()},
}


def read_study(path: Path, *, n_trials: int | None = None, seed: int | None = None) -> Study:
    """Read a study that may name the paper's cases; see `sdnn.runs.study.read_study`."""
    known_cases = {
        case.id: KnownCase(
            case.title, {"sensors.n_sensors": case.n_sensors, "sensors.noise": case.noise}
        )
        for case in PAPER_CASES.values()
    }
    return study.read_study(path, n_trials=n_trials, seed=seed, known_cases=known_cases)


@dataclass(frozen=True)
class VariantClaim:
    """A claim of the paper about a variant.

    `moved` is whether the verdict about the reference is another one, None where there is none;
    `chance` the share of draws of ten of its trials in which the claim is shown, None where there
    are fewer than `MIN_TRIALS_TO_DRAW`.
    """

    outcome: ClaimOutcome
    moved: bool | None
    chance: Estimate | None = None

    @property
    def verdict(self) -> str:
        """The verdict, and whether it moved."""
        return self.outcome.verdict.value + (" (moved)" if self.moved else "")


@dataclass(frozen=True)
class StudyClaims:
    """The paper's claims about the variants of a study.

    A case counts as the paper's by its id, an agent by its own: what a variant has changed is what
    is judged.
    """

    comparison: Comparison

    @cached_property
    def by_variant(self) -> Mapping[str, Mapping[int, VariantClaim]]:
        """Claims of which every quantity is measured, by variant and number of the claim."""
        outcomes = {variant.id: self._outcomes(variant.id) for variant in self.comparison.variants}
        reference = self.comparison.study.reference
        of_reference = outcomes.get(reference, {})
        return {
            variant: {
                number: VariantClaim(
                    outcome,
                    None if variant == reference else _moved(outcome, of_reference.get(number)),
                    self._chance(variant, outcome.claim),
                )
                for number, outcome in of_variant.items()
            }
            for variant, of_variant in outcomes.items()
        }

    @cached_property
    def shown(self) -> tuple[Claim, ...]:
        """The claims about any variant."""
        claims = self.by_variant.values()
        found = {n: one.outcome.claim for of_one in claims for n, one in of_one.items()}
        return tuple(found[number] for number in sorted(found))

    def chance_of_all(self, variant_id: str) -> Estimate | None:
        """In which share of draws of ten trials a variant shows all claims about it together.

        None where there are none, or fewer than `MIN_TRIALS_TO_DRAW` trials.
        """
        claims = [one.outcome.claim for one in self.by_variant[variant_id].values()]
        return self._chance(variant_id, *claims) if claims else None

    def overview(self) -> Table:
        """Return verdicts about all claims, a row for each variant."""
        return Table(
            "The paper's claims",
            ("variant", *(f"claim {claim.number}" for claim in self.shown)),
            [
                (v.title, *(f.verdict if (f := self._found(v.id, c)) else "-" for c in self.shown))
                for v in self.comparison.variants
            ],
            _KINDS,
        )

    def chances(self) -> Table:
        """Return how often ten trials show the claims, a row for each variant that has chances."""
        rows = []
        for variant in self.comparison.variants:
            together = self.chance_of_all(variant.id)
            if together is not None:
                found = (self._found(variant.id, claim) for claim in self.shown)
                ones = (format_share(one.chance if one else None) for one in found)
                rows.append((variant.title, *ones, format_share(together)))
        header = ("variant", *(f"claim {claim.number}" for claim in self.shown), "all of these")
        return Table("How often ten trials show the claims", header, rows)

    def details(self, claim: Claim) -> Table:
        """Return the quantities of a claim, a row for each variant."""
        rows = []
        for variant in self.comparison.variants:
            if found := self._found(variant.id, claim):
                checks = found.outcome.checks
                cells = (f"{format_quantity(one)}: {one.verdict.value}" for one in checks)
                rows.append((variant.title, *cells, found.verdict))
        measured = (f"{describe(one.quantity)} (paper: {one.paper})" for one in claim.checks)
        header = ("variant", *measured, "verdict")
        return Table(f"Claim {claim.number}: {claim.text}", header, rows)

    def _found(self, variant_id: str, claim: Claim) -> VariantClaim | None:
        return self.by_variant[variant_id].get(claim.number)

    def _chance(self, variant_id: str, *claims: Claim) -> Estimate | None:
        if self.comparison.study.n_trials < MIN_TRIALS_TO_DRAW:
            return None
        return self._ten_trials[variant_id].chance(*claims)

    @cached_property
    def _ten_trials(self) -> dict[str, TenTrials]:
        variants = self.comparison.variants
        return {variant.id: TenTrials(self._results(variant.id)) for variant in variants}

    def _results(self, variant_id: str) -> list[CaseResult]:
        """Return what is measured of a variant in the paper's cases."""
        return [
            measured.result
            for (case, variant), measured in self.comparison.measured.items()
            if variant == variant_id
            and case in PAPER_CASES
            and measured.combination.spec.environment is None
        ]

    def _outcomes(self, variant_id: str) -> dict[int, ClaimOutcome]:
        return {
            outcome.claim.number: outcome
            for outcome in judge_claims(self._results(variant_id))
            if all(checked.estimate is not None for checked in outcome.checks)
        }


def _moved(outcome: ClaimOutcome, reference: ClaimOutcome | None) -> bool | None:
    if reference is None or Verdict.NOT_JUDGED in (outcome.verdict, reference.verdict):
        return None
    return outcome.verdict is not reference.verdict


def add_claims(comparison: Comparison) -> Addition:
    """Make the addition about the paper's claims to the report of a study."""
    claims = StudyClaims(comparison)
    sections = []
    if claims.shown:
        sections.append(Section(table=claims.overview(), notes=[CLAIMS_NOTE, RULE_NOTE]))
    chances = claims.chances()
    if chances.rows:
        sections.append(Section(level=3, table=chances, notes=[CHANCES_NOTE]))
    tables = map(claims.details, claims.shown)
    sections.append(Section(folded=[Folded(summary=one.title, table=one) for one in tables]))
    return Addition(
        sections=sections,
        json={
            "claims": [
                {
                    "variant": variant,
                    "moved": claim.moved,
                    "ten_trials_show_it": chance_json(claim.chance),
                    **claim.outcome.to_json(),
                }
                for variant, of_variant in claims.by_variant.items()
                for claim in of_variant.values()
            ]
        },
    )
