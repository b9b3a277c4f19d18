"""Studies of the paper's cases, and what their results say about its claims."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

from sdnn.reproduction.cases import PAPER_CASES, PAPER_TRIALS
from sdnn.reproduction.chances import TenTrials
from sdnn.reproduction.claims import Claim, ClaimOutcome, Verdict, judge_claims
from sdnn.reproduction.report import RULE_NOTE, VERDICT_KINDS, chance_json, format_quantity
from sdnn.runs import study
from sdnn.runs.comparison import Addition, Comparison
from sdnn.runs.report import Folded, Section, Table, format_share
from sdnn.runs.results import CaseResult, Estimate
from sdnn.runs.study import Study
from sdnn.runs.study_file import KnownCase

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
    """A claim of the paper about a variant."""

    outcome: ClaimOutcome
    moved: bool | None  # whether the verdict about the reference is another; None: there is none
    chance: Estimate | None  # share of draws of ten trials that show it; None: too few trials

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
        outcomes = {
            variant: {
                outcome.claim.number: outcome
                for outcome in judge_claims(results)
                if all(checked.estimate is not None for checked in outcome.checks)
            }
            for variant, results in self._results.items()
        }
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

    def sections(self) -> list[Section]:
        """Return verdicts about all claims, how often ten trials show them, and the quantities."""
        sections = []
        titles = {variant.id: variant.title for variant in self.comparison.variants}
        found = [
            (variant, [claims.get(one.number) for one in self.shown])
            for variant, claims in self.by_variant.items()
        ]
        header = ("variant", *(f"claim {claim.number}" for claim in self.shown))
        if self.shown:
            rows = [(titles[v], *(c.verdict if c else "-" for c in own)) for v, own in found]
            overview = Table("The paper's claims", header, rows, _KINDS)
            sections.append(Section(table=overview, notes=[CLAIMS_NOTE, RULE_NOTE]))
        chances = [
            (titles[v], *(format_share(c.chance if c else None) for c in own), format_share(both))
            for v, own in found
            if (both := self._chance(v, *(c.outcome.claim for c in own if c)))
        ]
        if chances:
            title = "How often ten trials show the claims"
            table = Table(title, (*header, "all of these"), chances)
            sections.append(Section(level=3, table=table, notes=[CHANCES_NOTE]))
        tables = [self._details(claim, titles) for claim in self.shown]
        sections.append(Section(folded=[Folded(summary=one.title, table=one) for one in tables]))
        return sections

    def _details(self, claim: Claim, titles: Mapping[str, str]) -> Table:
        rows = []
        for variant, claims in self.by_variant.items():
            if found := claims.get(claim.number):
                checks = found.outcome.checks
                cells = (f"{format_quantity(one)}: {one.verdict.value}" for one in checks)
                rows.append((titles[variant], *cells, found.verdict))
        measured = (f"{one.quantity} (paper: {one.paper})" for one in claim.checks)
        header = ("variant", *measured, "verdict")
        return Table(f"Claim {claim.number}: {claim.text}", header, rows)

    def _chance(self, variant_id: str, *claims: Claim) -> Estimate | None:
        if self.comparison.study.n_trials < MIN_TRIALS_TO_DRAW or not claims:
            return None
        return self._ten_trials[variant_id].chance(*claims)

    @cached_property
    def _ten_trials(self) -> dict[str, TenTrials]:
        return {variant: TenTrials(results) for variant, results in self._results.items()}

    @cached_property
    def _results(self) -> dict[str, list[CaseResult]]:
        """What is measured of each variant in the paper's cases."""
        results: dict[str, list[CaseResult]] = {v.id: [] for v in self.comparison.variants}
        for (case, variant), measured in self.comparison.measured.items():
            if case in PAPER_CASES and measured.combination.spec.environment is None:
                results[variant].append(measured.result)
        return results


def _moved(outcome: ClaimOutcome, reference: ClaimOutcome | None) -> bool | None:
    if reference is None or Verdict.NOT_JUDGED in (outcome.verdict, reference.verdict):
        return None
    return outcome.verdict is not reference.verdict


def add_claims(comparison: Comparison) -> Addition:
    """Make the addition about the paper's claims to the report of a study."""
    claims = StudyClaims(comparison)
    told = [
        {
            "variant": variant,
            "moved": claim.moved,
            "ten_trials_show_it": chance_json(claim.chance),
            **claim.outcome.to_json(),
        }
        for variant, of_variant in claims.by_variant.items()
        for claim in of_variant.values()
    ]
    return Addition(sections=claims.sections(), json={"claims": told})
