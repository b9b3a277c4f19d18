"""Makes the network of `docs/examples/sdnn_q_learning.py` with the core's random numbers."""

from __future__ import annotations

import math
from fractions import Fraction
from typing import Any

import numpy as np
import sdnn_q_learning as page

from sdnn import _core


class RoundedAway(page.SDNNC):
    """Rounds counts away from the present one instead of to the nearest."""

    def update(self, state: Any, action: int, q_hat: float) -> int:
        s, u = self.settings, int(self.counts(state)[action])
        q_low, q_high = Fraction(s.q_low), Fraction(s.q_high)
        clipped = Fraction(min(max(q_hat, s.q_low), s.q_high))
        exact = s.u_low + (clipped - q_low) * (s.u_high - s.u_low) / (q_high - q_low)
        if abs(exact - u) >= Fraction(1, 10**9):
            u = math.ceil(exact) if exact > u else math.floor(exact)
        return super().update(state, action, page.g(u, s))


def transcribe(core: _core.SDNNC, **learning: Any) -> page.SDNNC:
    """Return the page's network with the core's code books, permutations, weights and thresholds.

    Its settings are the core's and ``learning``.
    """
    config = core.config
    n, n_active, n_actions = config.n_hidden_units, config.n_active_units, core.n_actions
    u_low = n_active // 15 if config.u_low is None else config.u_low
    is_away = config.rounding == "away"
    network = object.__new__(RoundedAway if is_away else page.SDNNC)
    network.settings = page.Settings(
        n_active_units=n_active,
        u_low=u_low,
        u_high=n_active - u_low if config.u_high is None else config.u_high,
        q_low=config.q_low,
        q_high=config.q_high,
        **learning,
    )
    network.code_books = [core.table(mu) for mu in range(config.n_inputs)]
    network.permutations = {pair: core.permutation(*pair) for pair in core.pairs}
    network.weights = core.weights().astype(np.float32)
    network.thresholds = core.thresholds()
    network.step = config.lattice
    network.first_units = np.arange(n_actions) * (n - n_active) // max(n_actions - 1, 1)
    return network
