"""Studies of the paper's cases, and what their results say about its claims."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

from sdnn.reproduction.cases import PAPER_CASES, PAPER_EPISODES, PAPER_TRIALS
from sdnn.reproduction.claims import Claim, ClaimOutcome, TenTrials, Verdict, judge_claims
from sdnn.reproduction.report import RULE_NOTE, VERDICT_KINDS, format_quantity
from sdnn.runs.comparison import Addition, Comparison
from sdnn.runs.report import Section, Table, format_share
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


@dataclass(frozen=True)
class StudyClaims:
    """The paper's claims about the variants of a study.

    A case counts as the paper's by its id, an agent by its own: what a variant has changed is what
    is judged.
    """

    comparison: Comparison

    @cached_property
    def by_variant(self) -> Mapping[str, Mapping[int, ClaimOutcome]]:
        """Claims of which every quantity is measured, by variant and number of the claim."""
        return {
            variant: {
                outcome.claim.number: replace(outcome, chance=self._chance(variant, outcome.claim))
                for outcome in judge_claims(results)
                if all(checked.estimate is not None for checked in outcome.checks)
            }
            for variant, results in self._results.items()
        }

    @cached_property
    def shown(self) -> tuple[Claim, ...]:
        """The claims about any variant."""
        found = {n: one.claim for own in self.by_variant.values() for n, one in own.items()}
        return tuple(found[number] for number in sorted(found))

    def moved(self, variant: str, outcome: ClaimOutcome) -> bool | None:
        """Whether the verdict is not the one about the reference; None if one is missing."""
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
        measured = (f"{one.quantity} (paper: {one.paper})" for one in claim.checks)
        header = ("variant", *measured, "verdict")
        return Table(f"Claim {claim.number}: {claim.text}", header, rows)

    def _chance(self, variant: str, *claims: Claim) -> Estimate | None:
        if self.comparison.study.n_trials < MIN_TRIALS_TO_DRAW or not claims:
            return None
        return self._ten_trials[variant].chance(*claims)

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
