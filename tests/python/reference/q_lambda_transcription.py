"""Q(lambda) and Sarsa(lambda) with a linear readout, again in integers of Python, slowly."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

TRACE_ONE, LARGEST_TRACE = 1 << 12, (1 << 17) - 1


def shifted(product: int, n_bits: int) -> int:
    """Return product / 2^n_bits, rounded to the nearest, halves up."""
    return product if n_bits == 0 else (product + (1 << (n_bits - 1))) >> n_bits


def clipped(x: int, limit: int) -> int:
    return max(-limit, min(limit, x))


class QLambda:
    """One environment; `code(state)` gives the code's -1, 0 and +1, shape (n_columns,)."""

    def __init__(self, code: Any, n_actions: list[int], window: int, learning: Any) -> None:
        self.code = lambda state: [int(x) for x in code(state)]
        self.first_row = np.cumsum([0, *(n + window - 1 for n in n_actions)]).tolist()
        self.n_actions, self.window, self.learning = n_actions, window, learning
        n_columns = len(self.code([0.5] * learning["n_inputs"]))
        self.weights = [[0] * n_columns for _ in range(self.first_row[-1])]
        self.exponent: int | None = None
        self.n_learned = 0
        self.waiting: Any = None
        self._end()

    def _end(self) -> None:
        self.trace = [[0] * len(row) for row in self.weights]
        self.old_value = 0
        self.waiting = None

    def _rows(self, action: list[int]) -> list[int]:
        return [self.first_row[d] + a + i for d, a in enumerate(action) for i in range(self.window)]

    def _sum(self, code: list[int], action: list[int]) -> int:
        rows = self._rows(action)
        return sum(w * x for row in rows for w, x in zip(self.weights[row], code, strict=True))

    def _best(self, code: list[int]) -> int:
        best = 0
        for d, n in enumerate(self.n_actions):
            sums = [
                sum(w * x for w, x in zip(self.weights[row], code, strict=True))
                for row in range(self.first_row[d], self.first_row[d + 1])
            ]
            best += max(sum(sums[a : a + self.window]) for a in range(n))
        return best

    def value(self, state, action) -> int:
        return self._sum(self.code(state), action)

    def best_value(self, state) -> int:
        return self._best(self.code(state))

    def _double_unit(self) -> None:
        self.exponent = (self.exponent or 0) + 1
        self.weights = [[(w + 1) >> 1 for w in row] for row in self.weights]
        self.old_value = (self.old_value + 1) >> 1

    def _units(self, reward: float) -> int:
        if self.exponent is None:
            return 0
        return math.floor(math.ldexp(reward, -self.exponent) + 0.5)

    def learn(self, state, action, reward, next_state, terminated) -> None:
        code = self.code(state)
        if self.waiting is not None:
            if list(self.waiting[3]) == list(state):
                self._finish(code, action)
            else:
                self.begin_episode()
        if reward != 0.0:
            if self.exponent is None:
                self.exponent = math.frexp(abs(reward))[1] - 1 - 30
            while abs(math.ldexp(reward, -self.exponent)) >= 2**32:
                self._double_unit()
        self.waiting = (code, action, reward, next_state)
        self.n_learned += 1
        if terminated:
            self._correct(0)
            self._end()
        elif self.learning["bootstrap"] == "q_learning":
            self._correct(self._best_in_range(self.code(next_state)))

    def begin_episode(self) -> None:
        if self.waiting is not None:
            if self.learning["bootstrap"] == "sarsa":
                self._correct(self._best_in_range(self.code(self.waiting[3])))
            self._end()

    def _best_in_range(self, code: list[int]) -> int:
        while abs(self._best(code)) >= 2**33:
            self._double_unit()
        return self._best(code)

    def _finish(self, code: list[int], action: list[int]) -> None:
        if self.learning["bootstrap"] == "q_learning":
            if self._sum(code, action) < self._best(code):
                self._end()
        else:
            while abs(self._sum(code, action)) >= 2**33:
                self._double_unit()
            self._correct(self._sum(code, action))
        self.waiting = None

    def _rate(self) -> int:
        first = round(self.learning["learning_rate"] * 65536)
        last = round(self.learning["final_learning_rate"] * 65536)
        end = self.n_learned + self.learning["schedule_steps"]
        return max(1, first + (2 * (last - first) * self.n_learned + end) // (2 * end))

    def _correct(self, following: int) -> None:
        code, action, reward, _ = self.waiting
        while abs(self._sum(code, action)) >= 2**33:
            self._double_unit()
            following = (following + 1) >> 1
        value = self._sum(code, action)
        discount, decay = self.learning["discount"], self.learning["trace_decay"]
        target = self._units(reward) + shifted(following * round(discount * 32768), 15)
        is_dutch = self.learning["traces"] == "dutch"
        drift = value - self.old_value if is_dutch else 0
        self.old_value = following
        rows = set(self._rows(action))
        n = max(1, sum(map(abs, code)) * len(rows))
        rate = (self._rate() << 12) // n
        decay = round(discount * decay * 8192)
        gain = TRACE_ONE
        if is_dutch:
            along = sum(z * x for row in rows for z, x in zip(self.trace[row], code, strict=True))
            gain -= clipped(shifted(shifted(along * rate, 28) * decay, 13), LARGEST_TRACE)
        error = clipped(target - value + drift, 2**34 - 1)
        drift = clipped(drift, 2**34 - 1)
        while max(abs(shifted(error * rate, 28)), abs(shifted(drift * rate, 28))) >= 2**23:
            self._double_unit()
            error, drift = (error + 1) >> 1, (drift + 1) >> 1
        move = shifted(error * rate, 28)
        n_bits = 0
        while abs(move) >> n_bits >= (1 << 13) - 1:
            n_bits += 1
        step, shift = shifted(move, n_bits), 12 - n_bits
        correction = shifted(drift * rate, 28)
        for i, (weights, trace) in enumerate(zip(self.weights, self.trace, strict=True)):
            for j, x in enumerate(code):
                z = int(math.copysign(abs(trace[j]) * decay >> 13, trace[j]))  # towards 0
                if i in rows:
                    z = (0 if x and not is_dutch else z) + gain * x
                trace[j] = clipped(z, LARGEST_TRACE)
                weights[j] += (step * trace[j] + (1 << (shift - 1))) >> shift
                if i in rows:
                    weights[j] -= correction * x
        used = 0
        for row in self.weights:
            for w in row:
                used |= w if w >= 0 else ~w
        while used >= 2**23:
            self._double_unit()
            used >>= 1
