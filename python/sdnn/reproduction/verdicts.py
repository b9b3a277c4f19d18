"""The rule by which our data speak about the paper's claims.

It was written down before the trials of Experiment B were run:

- a check *holds* if the whole 95 % interval of the quantity lies in the range, *does not hold* if
  the whole interval lies outside on one side, and is *undecided* otherwise;
- a claim holds if all its checks hold, does not hold if one of them does not, and is undecided
  otherwise;
- runs smaller than the paper's (10 trials x 15,000 episodes) are not judged, nor are costs measured
  with other settings than `CostConfig()`.

What follows was added after the first 200 trials of each case had been seen, since ten trials, and
a hundred, leave three claims undecided:

- more trials of the same settings overrule fewer;
- a claim that these leave undecided, too, is judged by how often ten of them show it, as the
  paper's ten did (`chances`): it holds if 95 % of the draws or more show it, does not hold if 5 %
  or fewer do, and is a matter of *chance* in between.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from enum import Enum
from typing import Any

import numpy as np

from sdnn.reproduction.cases import PAPER_EPISODES, PAPER_TRIALS
from sdnn.reproduction.chances import TenTrials
from sdnn.reproduction.claims import CLAIMS, Check, Claim, Difference, Growth, Subject, describe
from sdnn.reproduction.cost import CostConfig, CostRecord
from sdnn.runs.results import TrialMeasures, on_equal_terms
from sdnn.runs.statistics import Estimate, FloatArray, estimate_contrast, json_number


class Verdict(Enum):
    """What our data say about a claim; the value is the word for a reader."""

    HOLDS = "holds"
    FAILS = "does not hold"
    CHANCE = "a matter of chance"
    UNDECIDED = "undecided"
    NOT_JUDGED = "not judged"
    NOT_RUN = "not run"


ALWAYS, NEVER = 0.95, 0.05
"""Shares of draws of ten trials from which on, and up to which, a claim holds, and does not."""

_DECISIVE = (Verdict.FAILS, Verdict.NOT_RUN, Verdict.NOT_JUDGED, Verdict.UNDECIDED)


def is_paper_scale(measured: TrialMeasures) -> bool:
    """Whether there are as many trials and episodes as in the paper: else nothing is judged."""
    return measured.n_trials >= PAPER_TRIALS and measured.last_episode >= PAPER_EPISODES


def verdict_of(check: Check, estimate: Estimate) -> Verdict:
    """Judge one check by the rule of this module."""
    if check.at_least <= estimate.lower and estimate.upper <= check.at_most:
        return Verdict.HOLDS
    if estimate.upper < check.at_least or estimate.lower > check.at_most:
        return Verdict.FAILS
    return Verdict.UNDECIDED


@dataclass(frozen=True)
class CheckOutcome:
    """A check with the estimate of its quantity, None where its trials were not run.

    `samples` are the trials' values that it was judged by, one array or two of a difference;
    censored values are cut off at `last_episode`.
    """

    check: Check
    estimate: Estimate | None
    verdict: Verdict
    samples: tuple[FloatArray, ...] = field(default=(), compare=False, repr=False)
    last_episode: int = PAPER_EPISODES


@dataclass(frozen=True)
class ClaimOutcome:
    """A claim with its checks' outcomes."""

    claim: Claim
    checks: tuple[CheckOutcome, ...]

    @property
    def verdict(self) -> Verdict:
        """The verdict about the whole claim, by the rule of this module."""
        verdicts = {outcome.verdict for outcome in self.checks}
        return next((verdict for verdict in _DECISIVE if verdict in verdicts), Verdict.HOLDS)

    def to_json(self) -> dict[str, Any]:
        """Return it as values that JSON can hold; what is censored becomes ``">last_episode"``."""
        return {
            "number": self.claim.number,
            "text": self.claim.text,
            "verdict": self.verdict.value,
            "checks": [
                {
                    "measured": describe(checked.check.quantity),
                    "paper": checked.check.paper,
                    "at_least": json_number(checked.check.at_least, None),
                    "at_most": json_number(checked.check.at_most, None),
                    "ours": None
                    if checked.estimate is None
                    else checked.estimate.to_json(checked.last_episode),
                    "verdict": checked.verdict.value,
                }
                for checked in self.checks
            ],
        }


@dataclass(frozen=True)
class SettledClaim:
    """A claim with what the trials that were run say of it, and what more trials do, if any.

    `chance` is the share of draws of ten of these in which it is shown.
    """

    own: ClaimOutcome
    more: ClaimOutcome | None = None
    chance: Estimate | None = None

    @property
    def claim(self) -> Claim:
        """The claim."""
        return self.own.claim

    @property
    def best(self) -> ClaimOutcome:
        """What the most trials give."""
        return self.own if self.more is None else self.more

    @property
    def verdict(self) -> Verdict:
        """The verdict about the claim, by the whole rule of this module."""
        if self.own.verdict in (Verdict.NOT_JUDGED, Verdict.NOT_RUN):
            return self.own.verdict
        if self.best.verdict is not Verdict.UNDECIDED or self.chance is None:
            return self.best.verdict
        if self.chance.value >= ALWAYS:
            return Verdict.HOLDS
        return Verdict.FAILS if self.chance.value <= NEVER else Verdict.CHANCE


def decide(
    outcomes: Iterable[ClaimOutcome], more: Iterable[TrialMeasures]
) -> tuple[SettledClaim, ...]:
    """Put beside each claim what more trials of the same settings say of it.

    A claim is judged by them if all cases and agents that it speaks of are among them.
    """
    trials = tuple(more)
    judged = {one.claim.number: one for one in judge_claims(trials)}
    draws = TenTrials(trials)
    judged = {number: one for number, one in judged.items() if one.verdict is not Verdict.NOT_RUN}
    return tuple(
        SettledClaim(own, judged[own.claim.number], draws.chance(own.claim))
        if own.claim.number in judged
        else SettledClaim(own)
        for own in outcomes
    )


def judge_claims(
    measured: Iterable[TrialMeasures], costs: Sequence[CostRecord] = ()
) -> tuple[ClaimOutcome, ...]:
    """Judge the claims that the given results speak about, at least in part.

    A case that experiments share may come more than once.
    """
    by_subject = {Subject(one.case_id, one.agent): one for one in measured}
    outcomes = (
        ClaimOutcome(claim, tuple(_judge(check, by_subject, costs) for check in claim.checks))
        for claim in CLAIMS
    )
    return tuple(o for o in outcomes if any(check.estimate is not None for check in o.checks))


def _judge(
    check: Check, measured: Mapping[Subject, TrialMeasures], costs: Sequence[CostRecord]
) -> CheckOutcome:
    quantity = check.quantity
    samples: tuple[FloatArray, ...] = ()
    last_episode = PAPER_EPISODES
    if isinstance(quantity, Growth):
        times = {c.n_inputs: c.microseconds for c in costs if c.series == quantity.series}
        if not {quantity.n_inputs, quantity.n_fewer} <= times.keys():
            return CheckOutcome(check, None, Verdict.NOT_RUN)
        estimate = estimate_contrast(times[quantity.n_inputs], times[quantity.n_fewer], np.divide)
        is_full = all(one.config_hash == CostConfig().config_hash for one in costs)
    else:
        if not measured.keys() >= set(quantity.subjects):
            return CheckOutcome(check, None, Verdict.NOT_RUN)
        found = [measured[subject] for subject in quantity.subjects]
        if isinstance(quantity, Difference):
            samples = values, others = on_equal_terms(quantity.measure, *found)
            estimate = estimate_contrast(values, others)
        else:
            samples = (found[0].values[quantity.measure],)
            estimate = found[0].medians[quantity.measure]
        is_full = all(map(is_paper_scale, found))
        last_episode = min(one.last_episode for one in found)
    verdict = verdict_of(check, estimate) if is_full else Verdict.NOT_JUDGED
    return CheckOutcome(check, estimate, verdict, samples, last_episode)
