"""SDNN-C and its Q-learning as the paper writes them: slow, plain NumPy, one function an equation.

Source: T. Kobayashi, T. Shibuya, M. Morita, "Q-Learning in Continuous State-Action Space with
Noisy and Redundant Inputs by Using a Selective Desensitization Neural Network", JACIII 19(6),
825-832, 2015. The C++ core must agree with it bit for bit.

What the paper draws at random (code books, permutations, first weights) is handed over. Weights,
thresholds and potentials are in units of c / lattice: whole numbers, held in floats wide enough to
be exact, so that NumPy may use fast matrix products.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from fractions import Fraction

import numpy as np
from numpy.typing import NDArray

EXACT_BELOW = 2**24
"""Whole numbers up to here are exact in 32-bit floats."""


def anchor_pattern_of_bin(n_interpolated: int, bin_number: int) -> tuple[int, int]:
    """Which anchor starts the stretch of a bin, and how many portions are flipped (section 3.1)."""
    return divmod(bin_number, n_interpolated + 1)


def desensitize(x_mu: NDArray[np.int8], by: NDArray[np.int8]) -> NDArray[np.int8]:
    """Section 3.1, layer 3: x^mu(nu)_k = (1 + x^nu_k) / 2 * x^mu_k; ``by`` is permuted already."""
    return (1 + by) // 2 * x_mu


def window_pattern(first_unit: int, n_active: int, n_hidden: int) -> NDArray[np.int8]:
    """Section 3.1, layer 4: y is +1 on n' neighbouring units, -1 elsewhere."""
    y = -np.ones(n_hidden, dtype=np.int8)
    y[first_unit : first_unit + n_active] = 1
    return y


def evenly_spread_windows(n_hidden: int, n_active: int, n_actions: int) -> list[int]:
    """First units of the windows; all of them in the paper, so that window k starts at unit k."""
    n_free = n_hidden - n_active
    if n_actions == 1:
        return [0]
    return [action * n_free // (n_actions - 1) for action in range(n_actions)]


def g(u: int, u_low: int, u_high: int, q_low: float, q_high: float) -> float:
    """Section 4.2: a straight line, saturating; (2 u - 300) / 13 for 20 <= u <= 280."""
    if u > u_high:
        return q_high
    if u < u_low:
        return q_low
    slope = (Fraction(q_high) - Fraction(q_low)) / (u_high - u_low)
    return float(Fraction(q_low) + slope * (u - u_low))


def g_inverse(q: float, u_low: int, u_high: int, q_low: float, q_high: float) -> int:
    """The count of units for a value, halves rounded up (section 3.2)."""
    clipped = min(max(q, q_low), q_high)
    return math.floor(u_low + (clipped - q_low) * (u_high - u_low) / (q_high - q_low) + 0.5)


def next_count(u: int, q_hat: float, line: tuple[int, int, float, float]) -> int:
    """The count of units for a value, at least one unit from u towards it: another rounding."""
    u_low, u_high, q_low, q_high = line
    clipped = Fraction(min(max(q_hat, q_low), q_high))
    exact = u_low + (clipped - Fraction(q_low)) * (u_high - u_low) / (
        Fraction(q_high) - Fraction(q_low)
    )
    if abs(exact - u) < Fraction(1, 10**9):
        return u
    return math.ceil(exact) if exact > u else math.floor(exact)


class SDNNC:
    """Layers 1 to 6 of section 3.1 and the learning procedure of Fig. 2.

    Parameters
    ----------
    code_books : sequence of l arrays, shape (n_bins, m), of -1 and +1
    permutations : (mu, nu) -> array, shape (m,)
        sigma_mu_nu: unit k of the permuted pattern is unit ``permutation[k]``.
    weights, thresholds : arrays of whole numbers, shapes (n, D) and (n,)
    first_units : sequence of n_actions numbers
        Where the window of each action begins.
    always_moves
        Round u_hat by `next_count` instead of to the nearest.
    """

    def __init__(
        self,
        *,
        code_books: Sequence[NDArray[np.int8]],
        permutations: Mapping[tuple[int, int], NDArray[np.uint32]],
        weights: NDArray[np.int32],
        thresholds: NDArray[np.int32],
        n_active_units: int,
        first_units: Sequence[int],
        u_low: int,
        u_high: int,
        q_low: float,
        q_high: float,
        step: int,
        always_moves: bool = False,
    ) -> None:
        self.code_books = code_books
        self.permutations = permutations
        self.weights = weights.astype(np.float32)
        self.thresholds = thresholds.astype(np.float32)
        self.n_active_units = n_active_units
        self.first_units = list(first_units)
        patterns = [window_pattern(first, n_active_units, len(thresholds)) for first in first_units]
        self.windows = ((1 + np.array(patterns)) // 2).astype(np.float32)
        self.line = (u_low, u_high, q_low, q_high)
        self.value_of_count = np.array([g(u, *self.line) for u in range(n_active_units + 1)])
        self.step = step
        self.always_moves = always_moves

    def pattern(self, mu: int, value: float) -> NDArray[np.int8]:
        """Layers 1 and 2: the range [0, 1] is cut into equal half-open bins; 1 is in the last."""
        book = self.code_books[mu]
        return book[min(math.floor(value * len(book)), len(book) - 1)]

    def x_sd(self, state: NDArray[np.float64]) -> NDArray[np.float32]:
        """Layer 3: every pattern desensitized by every other one that it has a pair with: (D,)."""
        patterns = [self.pattern(mu, float(value)) for mu, value in enumerate(state)]
        groups = [
            desensitize(x_mu, x_nu[self.permutations[mu, nu]])
            for mu, x_mu in enumerate(patterns)
            for nu, x_nu in enumerate(patterns)
            if (mu, nu) in self.permutations
        ]
        return np.concatenate(groups).astype(np.float32)

    def potentials(self, state: NDArray[np.float64]) -> NDArray[np.float32]:
        """Layer 4: h_i = w_i . x_SD - w_i0, shape (n,)."""
        h = self.weights @ self.x_sd(state) - self.thresholds
        assert np.abs(h).max() < EXACT_BELOW
        return h

    def counts(self, state: NDArray[np.float64]) -> NDArray[np.int64]:
        """Layers 4 and 5: z_i(y_i) = (1 + y_i) / 2 z_i summed over i, shape (n_actions,)."""
        z = (self.potentials(state) > 0).astype(np.float32)
        return (self.windows @ z).astype(np.int64)

    def values(self, state: NDArray[np.float64]) -> NDArray[np.float64]:
        """Layer 6: Q(s, a) = g(u) for every action, shape (n_actions,)."""
        return self.value_of_count[self.counts(state)]

    def correct(self, state: NDArray[np.float64], action: int, q_hat: float) -> int:
        """Fig. 2 and Eqs. (2), (3): returns the number of corrected units."""
        h = self.potentials(state)
        first = self.first_units[action]
        window = h[first : first + self.n_active_units]
        u = int((window > 0).sum())
        u_hat = (
            next_count(u, q_hat, self.line) if self.always_moves else g_inverse(q_hat, *self.line)
        )
        d = u_hat - u
        x_sd = self.x_sd(state)
        sign = 1 if d > 0 else -1
        n_corrected = 0
        for i in range(abs(d)):
            begin = i * self.n_active_units // abs(d)
            end = (i + 1) * self.n_active_units // abs(d)
            subset = window[begin:end]
            candidates = (subset > 0) if d < 0 else (subset <= 0)
            if not candidates.any():
                continue
            nearest = begin + int(np.where(candidates, np.abs(subset), np.inf).argmin())
            self.weights[first + nearest] += self.step * sign * x_sd
            self.thresholds[first + nearest] -= self.step * sign
            n_corrected += 1
        # Every partial sum of a potential is below this bound, so all of them were exact.
        assert h.size == 0 or np.abs(self.weights[first]).sum() < EXACT_BELOW
        return n_corrected


class QLearning:
    """Eq. (1): q_hat = (1 - alpha) Q(s, a) + alpha (r + gamma max_a' Q(s', a'))."""

    def __init__(self, network: SDNNC, *, alpha: float, gamma: float) -> None:
        self.network = network
        self.alpha = alpha
        self.gamma = gamma

    def learn(
        self,
        state: NDArray[np.float64],
        action: int,
        reward: float,
        next_state: NDArray[np.float64],
        terminated: bool,
    ) -> int:
        """One transition; a terminated one has no successor. Returns the corrected units."""
        target = reward
        if not terminated:
            target = reward + self.gamma * float(self.network.values(next_state).max())
        value = float(self.network.values(state)[action])
        q_hat = (1.0 - self.alpha) * value + self.alpha * target
        return self.network.correct(state, action, q_hat)
