"""What other numbers of trials would show, by drawing so many from those that are there.

The paper's ten trials are one draw. A draw shows a claim if the medians lie in the ranges of all
its checks, so a claim that the trials leave undecided has a chance, too. All this takes the trials
for ones like those to come; from ten trials that is a guess.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from sdnn.reproduction.cases import PAPER_TRIALS
from sdnn.reproduction.claims import (
    ALWAYS,
    NEVER,
    Check,
    Claim,
    ClaimOutcome,
    Median,
    Subject,
    Verdict,
    judge_claims,
)
from sdnn.runs.results import BOOTSTRAP_SEED, Estimate, FloatArray, TrialMeasures, tails

N_DRAWS = 10_000
_N_RESAMPLES, _N_DRAWS_OF_EACH = 200, 250

MULTIPLES = (2, 4, 8, 16, 32)
"""Numbers of trials whose power is estimated, as multiples of those that are there."""

N_POWER_DRAWS = 200
_N_MEDIANS = 1000


class TenTrials:
    """Experiments of ten trials, drawn from more, with replacement: all claims share the draws."""

    def __init__(self, measured: Iterable[TrialMeasures]) -> None:
        self._measured = {Subject(one.case_id, one.agent): one for one in measured}
        self._draws = cache(self._draw)
        self._met = cache(self._is_met)

    def chance(self, *claims: Claim) -> Estimate | None:
        """Return in which share of the draws all the claims are shown.

        The interval is a bootstrap over the trials that are drawn from. It is None where trials of
        one that a claim speaks of are missing, or a claim is about costs.
        """
        checks = [check for claim in claims for check in claim.checks]
        for quantity in (check.quantity for check in checks):
            if not isinstance(quantity, Median) or set(quantity.subjects) - self._measured.keys():
                return None
        met = zip(*map(self._met, checks), strict=True)
        drawn, redrawn = (np.logical_and.reduce(arrays) for arrays in met)
        lower, upper = tails(redrawn.mean(axis=1))
        return Estimate(float(drawn.mean()), float(lower), float(upper))

    def _draw(self, subject: Subject) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Draw from the trials, (N_DRAWS, 10), and from resamples of them, (..., 10).

        Each subject has a generator of its own, whoever else is drawn.
        """
        generator = np.random.default_rng([BOOTSTRAP_SEED, *str(subject).encode()])
        size = self._measured[subject].n_trials
        drawn = generator.integers(size, size=(N_DRAWS, PAPER_TRIALS))
        resampled = generator.integers(size, size=(_N_RESAMPLES, size))
        shape = (_N_RESAMPLES, _N_DRAWS_OF_EACH * PAPER_TRIALS)
        redrawn = np.take_along_axis(resampled, generator.integers(size, size=shape), axis=1)
        return drawn, redrawn.reshape(_N_RESAMPLES, _N_DRAWS_OF_EACH, PAPER_TRIALS)

    def _is_met(self, check: Check) -> tuple[NDArray[np.bool_], ...]:
        """Find in which draws a check is met, (N_DRAWS,), and in which of resamples."""
        quantity = check.quantity
        assert isinstance(quantity, Median)
        values = quantity.samples(self._measured)
        draws = [self._draws(subject) for subject in quantity.subjects]
        return tuple(
            check.contains(
                _difference([np.median(v[d], axis=-1) for v, d in zip(values, kind, strict=True)])
            )
            for kind in zip(*draws, strict=True)
        )


@dataclass(frozen=True)
class Power:
    """Shares of the draws of a number of trials in which a check holds, and does not."""

    n_trials: int
    holds: float
    fails: float


def powers(check: Check, samples: Sequence[FloatArray]) -> tuple[Power, ...]:
    """Draw more trials than these samples of a check, judge each draw, for each of `MULTIPLES`."""
    found = []
    for multiple in MULTIPLES:
        generator = np.random.default_rng(BOOTSTRAP_SEED)
        medians = _difference([drawn_medians(one, multiple, generator) for one in samples])
        lower, upper = tails(medians)
        holds = (check.contains(lower) & check.contains(upper)).mean()
        fails = check.excludes(lower, upper).mean()
        found.append(Power(multiple * samples[0].size, float(holds), float(fails)))
    return tuple(found)


def drawn_medians(sample: FloatArray, multiple: int, generator: np.random.Generator) -> FloatArray:
    """Draw trials repeatedly and return the bootstrap medians of each, (N_POWER_DRAWS, 1000).

    The sorted trials of a resample lie at places that are order statistics of uniform numbers,
    which are drawn instead of the resamples: of the middle one, and given it of the next.
    """
    n = multiple * sample.size
    drawn = np.sort(sample[generator.integers(sample.size, size=(N_POWER_DRAWS, n))], axis=1)
    middle = (n + 1) // 2
    first = generator.beta(middle, n + 1 - middle, _N_MEDIANS)
    low = drawn[:, (n * first).astype(np.intp)]
    if n % 2:
        return low
    second = first + (1.0 - first) * generator.beta(1, n - middle, _N_MEDIANS)
    return (low + drawn[:, (n * second).astype(np.intp)]) / 2.0


def _difference(medians: Sequence[FloatArray]) -> FloatArray:
    return medians[0] - medians[1] if len(medians) == 2 else medians[0]


@dataclass(frozen=True)
class SettledClaim:
    """A claim with what the trials that were run say of it, and what more trials do, if any.

    `chance` is the share of draws of ten of these in which it is shown.
    """

    own: ClaimOutcome
    more: ClaimOutcome | None = None
    chance: Estimate | None = None

    @property
    def best(self) -> ClaimOutcome:
        """What the most trials give."""
        return self.more or self.own

    @property
    def verdict(self) -> Verdict:
        """The verdict about the claim, by the whole rule of `sdnn.reproduction.claims`."""
        if self.own.verdict in (Verdict.NOT_JUDGED, Verdict.NOT_RUN):
            return self.own.verdict
        if self.best.verdict is not Verdict.UNDECIDED or self.chance is None:
            return self.best.verdict
        if self.chance.value >= ALWAYS:
            return Verdict.HOLDS
        return Verdict.FAILS if self.chance.value <= NEVER else Verdict.INCONCLUSIVE


def decide(
    outcomes: Iterable[ClaimOutcome], more: Iterable[TrialMeasures]
) -> tuple[SettledClaim, ...]:
    """Put beside each claim what more trials say, if all that it speaks of is among them."""
    trials = tuple(more)
    judged = {one.claim.number: one for one in judge_claims(trials)}
    draws = TenTrials(trials)
    return tuple(
        SettledClaim(own, found, draws.chance(own.claim))
        if (found := judged.get(own.claim.number)) and found.verdict is not Verdict.NOT_RUN
        else SettledClaim(own)
        for own in outcomes
    )
