"""The agent of `docs/examples/sdnn_q_lambda.py` with options that are not its defaults."""

from __future__ import annotations

from types import SimpleNamespace
from typing import Any

import numpy as np
import sdnn_q_lambda as page

SMALL = {
    "n_inputs": 2,
    "averaging_interval": 0,
    "n_pattern_units": 6,
    "n_anchor_patterns": 3,
    "n_interpolated": 2,
}


def random_transitions(seed, n_steps, n_actions, scale):
    """Transitions of episodes that end in a terminal state, at a limit, or not at all."""
    rng = np.random.default_rng(seed)
    state = rng.random(2)
    for _ in range(n_steps):
        action = [int(rng.integers(n)) for n in n_actions]
        reward = float(scale ** rng.integers(-1, 3) * rng.normal()) if rng.random() < 0.7 else 0.0
        next_state = rng.random(2)
        end = rng.choice(["none", "terminal", "limit", "jump"], p=[0.8, 0.1, 0.05, 0.05])
        yield state, action, reward, next_state, end
        state = next_state if end == "none" else rng.random(2)


def random_durations(seed, are_1):
    """Yield durations: always 1, or 1, other whole numbers and fractions."""
    rng = np.random.default_rng(seed)
    while True:
        yield 1.0 if are_1 else float(rng.choice([1.0, 2.0, 5.0, 0.3, rng.uniform(0.001, 20)]))


class VariableDiscount:
    """The discount of a transition, by its duration, and that by which traces decay."""

    def __init__(self, settings: Any) -> None:
        self.settings, self.usual = settings, settings.discount
        self.of_trace = self.usual

    def set(self, dt: float) -> None:
        """Begin a transition."""
        self.settings.discount = self.usual**dt

    def end(self) -> None:
        """End it: traces decay by its discount in the next one."""
        self.of_trace = self.settings.discount

    def in_traces(self, update: Any) -> Any:
        """Wrap a function that decays a trace."""

        def call(*arguments: Any) -> None:
            present, self.settings.discount = self.settings.discount, self.of_trace
            update(*arguments)
            self.settings.discount = present

        return call


class Code:
    """A code of `n_columns` features that `code_of(state)` returns."""

    def __init__(self, code_of: Any, n_inputs: int) -> None:
        self.code_of = code_of
        self.n_columns = len(code_of([0.5] * n_inputs))

    def __call__(self, state: Any) -> Any:
        return np.array(self.code_of(state), np.int64)


class QLambda(page.QLambda):
    """Q(lambda) or Sarsa(lambda), with either kind of trace and windows of any width."""

    def __init__(self, code: Code, n_actions: list[int], window: int, options: Any) -> None:
        settings = SimpleNamespace(**vars(page.Settings()) | options)
        self.window, self.transition = window, None
        super().__init__(code, [n + window - 1 for n in n_actions], settings)
        self.discount = VariableDiscount(settings)
        self.dt = 1.0

    def rows(self, action: Any) -> Any:
        return np.add.outer(super().rows(action), range(self.window)).ravel()

    def sums(self, x: Any, weights: Any) -> Any:
        return [np.convolve(s, [1] * self.window, "valid") for s in super().sums(x, weights)]

    def begin_episode(self) -> None:
        if self.transition is not None:
            self.learn_pending(lambda: self.best_value(self.code(self.next_state)))
        super().begin_episode()

    def learn(
        self, state: Any, action: Any, reward: float, next_state: Any, ends: bool, dt: float = 1.0
    ) -> None:
        if self.settings.bootstrap == "q_learning":
            self.dt = dt
            super().learn(state, action, reward, next_state, ends)
            return
        x = self.code(state)
        if self.transition is not None:
            if np.array_equal(self.next_state, state):
                self.learn_pending(lambda: self.value(x, action))
            else:
                self.begin_episode()
        self.fit_unit(reward)
        self.n_learned += 1
        self.transition, self.next_state, self.dt = (x, action, reward), next_state, dt
        if ends:
            self.learn_pending(lambda: 0)
            self.end_trace()

    def learn_pending(self, next_value_of: Any) -> None:
        """Learn the last transition of Sarsa, now that its next value is known."""
        while abs(next_value_of()) >= 2**33:
            self.double_unit()
        self.correct(*self.transition, next_value_of())
        self.transition = None

    def correct(self, x: Any, action: Any, reward: float, next_value: int) -> None:
        self.discount.set(self.dt)
        if self.settings.traces == "replacing":
            while abs(self.value(x, action)) >= 2**33:
                self.double_unit()
                next_value = page.rounded(next_value, 1)
            self.old_value = self.value(x, action)  # without a correction along the features
        super().correct(x, action, reward, next_value)
        self.discount.end()

    def update_trace(self, x: Any, rows: Any, rate: int) -> None:
        self.discount.in_traces(super().update_trace)(x, rows, rate)
        if self.settings.traces == "replacing":
            active = np.ix_(rows, np.flatnonzero(x))
            self.trace[active] = 2**12 * x[x != 0]
