"""The rule by which our data speak about the paper's claims.

It was written down before the trials of Experiment B were run:

- a check *holds* if the whole 95 % interval of the quantity lies in the range, *does not hold* if
  the whole interval lies outside on one side, and is *undecided* otherwise;
- a claim holds if all its checks hold, does not hold if one of them does not, and is undecided
  otherwise;
- runs smaller than the paper's (10 trials x 15,000 episodes) are not judged, nor are costs measured
  with other settings than `CostConfig()`.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdnn.experiments.cases import PAPER_EPISODES
from sdnn.experiments.claims import CLAIMS, Check, Claim, Difference, Growth, Subject, describe
from sdnn.experiments.cost import CostConfig
from sdnn.experiments.records import CostRecord
from sdnn.experiments.results import CaseSummary, on_equal_terms
from sdnn.experiments.statistics import Estimate, estimate_contrast, json_number


class Verdict(Enum):
    """What our data say about a claim; the value is the word for a reader."""

    HOLDS = "holds"
    FAILS = "does not hold"
    UNDECIDED = "undecided"
    NOT_JUDGED = "not judged"
    NOT_RUN = "not run"


def verdict_of(check: Check, estimate: Estimate) -> Verdict:
    """Judge one check by the rule of this module."""
    if check.at_least <= estimate.lower and estimate.upper <= check.at_most:
        return Verdict.HOLDS
    if estimate.upper < check.at_least or estimate.lower > check.at_most:
        return Verdict.FAILS
    return Verdict.UNDECIDED


@dataclass(frozen=True)
class CheckOutcome:
    """A check with what our data give; no estimate where its trials were not run.

    ``samples`` are the trials' values that it was judged by: one array, or two of a difference.
    ``last_episode`` is that of the trials, where what is censored is cut off.
    """

    check: Check
    estimate: Estimate | None
    verdict: Verdict
    samples: tuple[NDArray[np.float64], ...] = field(default=(), compare=False, repr=False)
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
        for decisive in (
            Verdict.FAILS,
            Verdict.NOT_RUN,
            Verdict.NOT_JUDGED,
            Verdict.UNDECIDED,
        ):
            if decisive in verdicts:
                return decisive
        return Verdict.HOLDS

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


def judge_claims(
    summaries: Iterable[CaseSummary], costs: Sequence[CostRecord]
) -> tuple[ClaimOutcome, ...]:
    """Judge the claims that the given results speak about, at least in part.

    Parameters
    ----------
    summaries
        One for each case and agent; a case that experiments share may come more than once.
    costs
        Measured costs.
    """
    by_subject = {Subject(s.result.case.id, s.result.agent): s for s in summaries}
    outcomes = (
        ClaimOutcome(claim, tuple(_judge(check, by_subject, costs) for check in claim.checks))
        for claim in CLAIMS
    )
    return tuple(o for o in outcomes if any(check.estimate is not None for check in o.checks))


def _judge(
    check: Check, summaries: Mapping[Subject, CaseSummary], costs: Sequence[CostRecord]
) -> CheckOutcome:
    quantity = check.quantity
    if isinstance(quantity, Growth):
        times = {c.key.n_inputs: c.microseconds for c in costs if c.key.series == quantity.series}
        if not {quantity.n_inputs, quantity.n_fewer} <= times.keys():
            return CheckOutcome(check, None, Verdict.NOT_RUN)
        growth = estimate_contrast(times[quantity.n_inputs], times[quantity.n_fewer], np.divide)
        wanted = CostConfig().config_hash
        return _outcome(check, growth, all(c.key.config_hash == wanted for c in costs))
    subjects = [quantity.subject]
    if isinstance(quantity, Difference):
        subjects.append(quantity.other)
    if not summaries.keys() >= set(subjects):
        return CheckOutcome(check, None, Verdict.NOT_RUN)
    found = [summaries[subject] for subject in subjects]
    samples: tuple[NDArray[np.float64], ...]
    if len(found) == 1:
        samples = (found[0].values[quantity.measure],)
        estimate = found[0].medians[quantity.measure]
    else:
        samples = values, others = on_equal_terms(quantity.measure, *found)
        estimate = estimate_contrast(values, others)
    is_full = all(summary.result.is_paper_scale for summary in found)
    last_episode = min(summary.result.last_episode for summary in found)
    return replace(_outcome(check, estimate, is_full, samples), last_episode=last_episode)


def _outcome(
    check: Check,
    estimate: Estimate,
    is_full: bool,
    samples: tuple[NDArray[np.float64], ...] = (),
) -> CheckOutcome:
    verdict = verdict_of(check, estimate) if is_full else Verdict.NOT_JUDGED
    return CheckOutcome(check, estimate, verdict, samples)
