"""What more trials would say of a check that is undecided: its power.

So many trials are drawn, with replacement, from those that are there, and judged as they are, again
and again. That takes the trials to come for ones like those that are there: from ten it is a guess.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from sdnn.reproduction.verdicts import CheckOutcome, Verdict
from sdnn.runs.statistics import DEFAULT_BOOTSTRAP, FloatArray, tails

MULTIPLES = (2, 4, 8, 16, 32)
"""How many times the trials that are there."""

N_DRAWS = 200
_N_RESAMPLES = 1000


@dataclass(frozen=True)
class Power:
    """Chances of a verdict with a number of trials.

    Parameters
    ----------
    n_trials
        In each case.
    holds, fails
        Shares of the draws in which the check holds, and does not.
    """

    n_trials: int
    holds: float
    fails: float


def powers(outcome: CheckOutcome) -> tuple[Power, ...]:
    """Return the power of an undecided check with each of `MULTIPLES`; nothing of others.

    Parameters
    ----------
    outcome
        The check, with the trials by which it was judged.
    """
    if outcome.verdict is not Verdict.UNDECIDED or not outcome.samples:
        return ()
    return tuple(_power(outcome, multiple) for multiple in MULTIPLES)


def _power(outcome: CheckOutcome, multiple: int) -> Power:
    generator = np.random.default_rng(DEFAULT_BOOTSTRAP.seed)
    medians = [drawn_medians(sample, multiple, generator) for sample in outcome.samples]
    distribution = medians[0] if len(medians) == 1 else medians[0] - medians[1]
    lower, upper = tails(distribution, DEFAULT_BOOTSTRAP.confidence)
    check = outcome.check
    holds = (check.at_least <= lower) & (upper <= check.at_most)
    fails = (upper < check.at_least) | (lower > check.at_most)
    return Power(
        n_trials=multiple * outcome.samples[0].size,
        holds=float(holds.mean()),
        fails=float(fails.mean()),
    )


def drawn_medians(sample: FloatArray, multiple: int, generator: np.random.Generator) -> FloatArray:
    """Draw trials `N_DRAWS` times: the bootstrap medians of each, (N_DRAWS, _N_RESAMPLES).

    The sorted trials of a resample lie at places that are order statistics of uniform numbers,
    which are drawn instead of the resamples: of the middle one, and given it of the next.
    """
    n = multiple * sample.size
    drawn = np.sort(sample[generator.integers(sample.size, size=(N_DRAWS, n))], axis=1)
    middle = (n + 1) // 2
    first = generator.beta(middle, n + 1 - middle, _N_RESAMPLES)
    low = drawn[:, (n * first).astype(np.intp)]
    if n % 2:
        return low
    second = first + (1.0 - first) * generator.beta(1, n - middle, _N_RESAMPLES)
    return (low + drawn[:, (n * second).astype(np.intp)]) / 2.0
