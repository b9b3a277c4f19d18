"""Fuzzy Q-learning and the RBF network as their definitions say: slow, plain NumPy.

Source: Jouffe, L. (1998). Fuzzy inference system learning by reinforcement methods. IEEE
Transactions on Systems, Man, and Cybernetics C 28(3), 338-355, as Kobayashi, Shibuya and Morita
(2015) use it; and the RBF network they compare the cost with. The C++ core must agree bit for bit
where both add in the same order. The policy's random draws are the core's (`EpsilonGreedy`), as is
its portable exponential.
"""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

Select = Callable[[NDArray[np.float64]], int]


def in_order(terms: Sequence[float] | NDArray[np.float64]) -> float:
    """The sum from the first term to the last; NumPy's own sum adds in pairs."""
    total = 0.0
    for term in terms:
        total += float(term)
    return total


class FuzzyQLearning:
    """A value per rule and action, all in one array of n_sets^d x n_actions floats."""

    def __init__(
        self, d: int, *, n_sets: int, n_actions: int, coefficient: float, discount: float
    ) -> None:
        self.n_sets = n_sets
        self.v = np.zeros((*[n_sets] * d, n_actions), dtype=np.float32)
        self.torques = [-1.0 + 2.0 * a / (n_actions - 1) for a in range(n_actions)]
        self.coefficient = coefficient
        self.discount = discount

    def fired(self, state: NDArray[np.float64]) -> list[tuple[tuple[int, ...], float]]:
        """The rules (their sets) with a positive truth value, and that value.

        A set's membership is that of a triangle with feet at the neighbouring centres; its two
        sides are written as parts of the way from one centre to the next. The first input
        alternates fastest.
        """
        memberships = []
        for x in state:
            position = float(x) * (self.n_sets - 1)
            sets = []
            for centre in range(self.n_sets):
                if centre <= position < centre + 1:
                    sets.append((centre, 1.0 - (position - centre)))
                elif centre - 1 < position < centre:
                    sets.append((centre, position - (centre - 1)))
            memberships.append(sets)
        rules = []
        for reversed_sets in itertools.product(*reversed(memberships)):
            truth = 1.0
            for _, membership in reversed(reversed_sets):
                truth *= membership
            rules.append((tuple(number for number, _ in reversed(reversed_sets)), truth))
        return rules

    def act(self, state: NDArray[np.float64], select: Select) -> tuple[float, list[int]]:
        """The torque, and what each fired rule picked."""
        fired = self.fired(state)
        picked = [select(self.v[rule].astype(np.float64)) for rule, _ in fired]
        weighted = in_order(
            [self.torques[a] * truth for a, (_, truth) in zip(picked, fired, strict=True)]
        )
        return weighted / in_order([truth for _, truth in fired]), picked

    def value(self, state: NDArray[np.float64]) -> float:
        """V = sum max_a v_i[a] alpha_i / sum alpha_i."""
        fired = self.fired(state)
        weighted = in_order([float(self.v[rule].max()) * truth for rule, truth in fired])
        return weighted / in_order([truth for _, truth in fired])

    def learn(
        self,
        state: NDArray[np.float64],
        picked: list[int],
        reward: float,
        next_state: NDArray[np.float64],
        terminated: bool,
    ) -> None:
        """v_i[a_i] += c (r + gamma V - Q) alpha_i."""
        target = reward if terminated else reward + self.discount * self.value(next_state)
        cells = [
            ((*rule, a), truth) for a, (rule, truth) in zip(picked, self.fired(state), strict=True)
        ]
        q = in_order([float(self.v[cell]) * truth for cell, truth in cells]) / in_order(
            [truth for _, truth in cells]
        )
        step = self.coefficient * (target - q)
        for cell, truth in cells:
            self.v[cell] = np.float32(float(self.v[cell]) + step * truth)


class RBFNetwork:
    """Q(s, a) = sum_j w_j phi_j(s, a) over the joint grid of state and action."""

    def __init__(
        self,
        d: int,
        *,
        n_bases: int,
        n_actions: int,
        width: float,
        rate: float,
        exp: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    ) -> None:
        self.n_bases = n_bases
        self.width = width
        self.rate = rate
        self.exp = exp
        self.w = np.zeros((n_bases**d, n_bases))
        self.psi = np.array([self.bases(a / (n_actions - 1)) for a in range(n_actions)])

    def bases(self, x: float) -> NDArray[np.float64]:
        """Gaussians of one dimension, divided by their sum: shape (n_bases,)."""
        distance = (x * (self.n_bases - 1) - np.arange(self.n_bases)) / self.width
        gaussians = self.exp(-0.5 * distance * distance)
        return gaussians / in_order(gaussians)

    def phi(self, state: NDArray[np.float64]) -> NDArray[np.float64]:
        """The bases of the state: shape (n_bases^d,)."""
        phi = np.ones(1)
        for x in state:
            phi = np.outer(phi, self.bases(float(x))).ravel()
        return phi

    def values(self, state: NDArray[np.float64]) -> NDArray[np.float64]:
        """Q(state, a) for every action, each sum in order: shape (n_actions,)."""
        u = np.add.accumulate(self.phi(state)[:, None] * self.w, axis=0)[-1]
        return np.add.accumulate(self.psi * u, axis=1)[:, -1]

    def update(self, state: NDArray[np.float64], action: int, target: float) -> None:
        """A gradient step of (target - Q)^2 / 2."""
        step = self.rate * (target - float(self.values(state)[action]))
        self.w += np.outer(self.phi(state), step * self.psi[action])
