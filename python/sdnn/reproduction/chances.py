"""What other numbers of trials would show, by drawing so many from those that are there.

`TenTrials` draws ten trials, with replacement, and takes their medians: the paper's ten seen as one
such draw. A draw shows a claim if the medians lie in the ranges of all its checks, so a claim that
the trials leave undecided has a chance, too. `powers` draws more trials than there are and judges
each draw: the power of a check. Both take the trials for ones like those to come; from ten trials
that is a guess.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdnn.reproduction.cases import PAPER_TRIALS
from sdnn.reproduction.claims import Check, Claim, Difference, Growth, Subject
from sdnn.runs.results import TrialMeasures, on_equal_terms
from sdnn.runs.statistics import DEFAULT_BOOTSTRAP, Estimate, FloatArray, tails

N_DRAWS = 10_000
_N_RESAMPLES, _N_DRAWS_OF_EACH = 200, 250

MULTIPLES = (2, 4, 8, 16, 32)
"""Numbers of trials whose power is estimated, as multiples of those that are there."""

N_POWER_DRAWS = 200
_N_MEDIANS = 1000

_Places = NDArray[np.intp]
_Met = NDArray[np.bool_]


class TenTrials:
    """Experiments of ten trials, drawn from more: the same draws for all that is asked of them."""

    def __init__(self, measured: Iterable[TrialMeasures]) -> None:
        self._measured = {Subject(one.case_id, one.agent): one for one in measured}
        self._places: dict[Subject, tuple[_Places, _Places]] = {}
        self._met: dict[Check, tuple[_Met, _Met]] = {}

    def chance(self, *claims: Claim) -> Estimate | None:
        """Return in which share of the draws all the claims are shown.

        The interval is a bootstrap over the trials that are drawn from. It is None where trials of
        one that a claim speaks of are missing, or a claim is about costs.
        """
        checks = [check for claim in claims for check in claim.checks]
        for check in checks:
            if isinstance(check.quantity, Growth) or not self._measured.keys() >= set(
                check.quantity.subjects
            ):
                return None
        met = [self._whether_met(check) for check in checks]
        drawn, redrawn = (np.logical_and.reduce(arrays) for arrays in zip(*met, strict=True))
        lower, upper = tails(redrawn.mean(axis=1), DEFAULT_BOOTSTRAP.confidence)
        return Estimate(float(drawn.mean()), float(lower), float(upper))

    def _draws(self, subject: Subject) -> tuple[_Places, _Places]:
        """Draw from the trials, (N_DRAWS, 10), and from resamples of them, (..., 10).

        Each subject has a generator of its own, whoever else is drawn.
        """
        if subject not in self._places:
            generator = np.random.default_rng([DEFAULT_BOOTSTRAP.seed, *str(subject).encode()])
            size = self._measured[subject].n_trials
            drawn = generator.integers(size, size=(N_DRAWS, PAPER_TRIALS))
            resampled = generator.integers(size, size=(_N_RESAMPLES, size))
            shape = (_N_RESAMPLES, _N_DRAWS_OF_EACH * PAPER_TRIALS)
            redrawn = np.take_along_axis(resampled, generator.integers(size, size=shape), axis=1)
            redrawn = redrawn.reshape(_N_RESAMPLES, _N_DRAWS_OF_EACH, PAPER_TRIALS)
            self._places[subject] = drawn, redrawn
        return self._places[subject]

    def _whether_met(self, check: Check) -> tuple[_Met, _Met]:
        """Find in which draws a check is met, (N_DRAWS,), and in which of resamples."""
        if check not in self._met:
            quantity = check.quantity
            assert not isinstance(quantity, Growth)
            measured = [self._measured[subject] for subject in quantity.subjects]
            values = (
                on_equal_terms(quantity.measure, *measured)
                if isinstance(quantity, Difference)
                else (measured[0].values[quantity.measure],)
            )
            draws = [self._draws(subject) for subject in quantity.subjects]
            first, second = (
                is_in_range(
                    check,
                    difference_of(
                        [np.median(v[d[kind]], axis=-1) for v, d in zip(values, draws, strict=True)]
                    ),
                )
                for kind in (0, 1)
            )
            self._met[check] = first, second
        return self._met[check]


@dataclass(frozen=True)
class Power:
    """Shares of the draws of a number of trials in which a check holds, and does not."""

    n_trials: int
    holds: float
    fails: float


def powers(check: Check, samples: Sequence[FloatArray]) -> tuple[Power, ...]:
    """Return the power of a check that was judged by these samples, with each of `MULTIPLES`."""
    found = []
    for multiple in MULTIPLES:
        generator = np.random.default_rng(DEFAULT_BOOTSTRAP.seed)
        medians = difference_of([drawn_medians(one, multiple, generator) for one in samples])
        lower, upper = tails(medians, DEFAULT_BOOTSTRAP.confidence)
        holds = is_in_range(check, lower) & is_in_range(check, upper)
        fails = (upper < check.at_least) | (lower > check.at_most)
        n_trials = multiple * samples[0].size
        found.append(Power(n_trials, float(holds.mean()), float(fails.mean())))
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


def difference_of(medians: Sequence[FloatArray]) -> FloatArray:
    """Return the first medians minus the second ones, if there are any."""
    return medians[0] - medians[1] if len(medians) == 2 else medians[0]


def is_in_range(check: Check, quantity: FloatArray) -> _Met:
    """Return where a quantity lies in the range of a check."""
    return np.asarray((check.at_least <= quantity) & (quantity <= check.at_most))
