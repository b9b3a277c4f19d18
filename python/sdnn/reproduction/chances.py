"""How often ten trials show what the paper says: the paper's ten seen as one such draw.

Ten trials are drawn from many, with replacement, and their medians looked at; a draw shows a claim
if they lie in the ranges of all its checks. So a claim of which the trials themselves leave
undecided whether it holds has a chance all the same.
"""

from __future__ import annotations

from collections.abc import Iterable
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from sdnn.reproduction.cases import PAPER_TRIALS
from sdnn.reproduction.claims import Check, Claim, Difference, Growth, Subject
from sdnn.reproduction.results import TrialMeasures, on_equal_terms
from sdnn.runs.statistics import DEFAULT_BOOTSTRAP, Estimate, tails

N_DRAWS = 10_000
_N_RESAMPLES, _N_DRAWS_OF_EACH = 200, 250

_Places = NDArray[np.intp]


class _Draws:
    """Which of a subject's trials are drawn: a generator of its own, whoever else is drawn."""

    def __init__(self, subject: Subject, measured: TrialMeasures) -> None:
        self.measured = measured
        self._seed = [DEFAULT_BOOTSTRAP.seed, *str(subject).encode()]

    @cached_property
    def places(self) -> tuple[_Places, _Places]:
        """Draws from the trials, (N_DRAWS, 10), and from resamples of them, (..., 10)."""
        generator = np.random.default_rng(self._seed)
        size = self.measured.n_trials
        drawn = generator.integers(size, size=(N_DRAWS, PAPER_TRIALS))
        resampled = generator.integers(size, size=(_N_RESAMPLES, size))
        shape = (_N_RESAMPLES, _N_DRAWS_OF_EACH * PAPER_TRIALS)
        redrawn = np.take_along_axis(resampled, generator.integers(size, size=shape), axis=1)
        return drawn, redrawn.reshape(_N_RESAMPLES, _N_DRAWS_OF_EACH, PAPER_TRIALS)


class TenTrials:
    """Experiments of ten trials, drawn from more: the same ones for all that is asked of them.

    Parameters
    ----------
    measured
        Trials to draw from, of each case and agent.
    """

    def __init__(self, measured: Iterable[TrialMeasures]) -> None:
        subjects = ((Subject(one.case_id, one.agent), one) for one in measured)
        self._draws = {subject: _Draws(subject, one) for subject, one in subjects}
        self._met: dict[Check, tuple[NDArray[np.bool_], NDArray[np.bool_]]] = {}

    def chance(self, *claims: Claim) -> Estimate | None:
        """Return in which share of the draws all the claims are shown.

        The interval is a bootstrap over the trials that are drawn from.

        Parameters
        ----------
        claims
            At least one.

        Returns
        -------
        Estimate or None
            None where trials of one that a claim speaks of are missing, or one is about costs.
        """
        checks = [check for claim in claims for check in claim.checks]
        if not all(self._draws.keys() >= set(_subjects(check)) for check in checks):
            return None
        if any(isinstance(check.quantity, Growth) for check in checks):
            return None
        met = [self._whether_met(check) for check in checks]
        drawn, redrawn = (np.logical_and.reduce(arrays) for arrays in zip(*met, strict=True))
        lower, upper = tails(redrawn.mean(axis=1), DEFAULT_BOOTSTRAP.confidence)
        return Estimate(float(drawn.mean()), float(lower), float(upper))

    def _whether_met(self, check: Check) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Tell in which draws a check is met, (N_DRAWS,), and in which of resamples."""
        if check not in self._met:
            draws = [self._draws[subject] for subject in _subjects(check)]
            first, second = (
                self._is_in_range(check, draws, [one.places[kind] for one in draws])
                for kind in (0, 1)
            )
            self._met[check] = first, second
        return self._met[check]

    @staticmethod
    def _is_in_range(check: Check, draws: list[_Draws], places: list[_Places]) -> NDArray[np.bool_]:
        assert not isinstance(check.quantity, Growth)
        measure = check.quantity.measure
        values = (
            on_equal_terms(measure, *(one.measured for one in draws))
            if isinstance(check.quantity, Difference)
            else (draws[0].measured.values[measure],)
        )
        medians = [
            np.median(one[where], axis=-1) for one, where in zip(values, places, strict=True)
        ]
        quantity = medians[0] - medians[1] if len(medians) == 2 else medians[0]
        return np.asarray((check.at_least <= quantity) & (quantity <= check.at_most))


def _subjects(check: Check) -> tuple[Subject, ...]:
    quantity = check.quantity
    if isinstance(quantity, Growth):
        return ()
    if isinstance(quantity, Difference):
        return quantity.subject, quantity.other
    return (quantity.subject,)
