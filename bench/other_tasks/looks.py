"""Looks at a learner while it learns: greedy episodes, kept out of its processor time."""

from __future__ import annotations

import time
from typing import Any

import numpy as np

N_LOOKS, N_EPISODES = 20, 20
N_LAST_EPISODES = 100
N_FIRST_EPISODES = 10


class _Watch:
    """Processor time of the learner alone, and greedy episodes that take no part in it."""

    def __init__(self, env, seed: int) -> None:
        self._env, self._seed = env, seed
        self._began = time.process_time()

    def _pause(self) -> float:
        """Stop the clock; give the learner's seconds until now."""
        self._paused = time.process_time()
        return round(self._paused - self._began, 2)

    def _go_on(self) -> None:
        self._began += time.process_time() - self._paused

    def _mean_return(self, policy, n_episodes: int) -> float:
        returns = [self._episode(policy, number) for number in range(n_episodes)]
        return round(float(np.mean(returns)), 2)

    def _episode(self, policy, number: int) -> float:
        observation, _ = self._env.reset(seed=10**6 * (self._seed + 1) + number)
        total, is_over = 0.0, False
        while not is_over:
            observation, reward, terminated, truncated, _ = self._env.step(policy(observation))
            total += float(reward)
            is_over = terminated or truncated
        return total


class Looks(_Watch):
    """20 looks at equal distances, each a row that is added to ``rows``."""

    def __init__(self, env, steps: int, seed: int, rows: list[dict[str, Any]]) -> None:
        self._rows = rows
        self._due = [steps * (i + 1) // N_LOOKS for i in range(N_LOOKS)]
        super().__init__(env, seed)

    def __call__(self, n_steps, policy, memory) -> None:
        """Evaluate where it is due."""
        if not self._due or n_steps < self._due[0]:
            return
        seconds = self._pause()
        while self._due and n_steps >= self._due[0]:
            self._due.pop(0)
        self._rows.append(
            {
                "steps": n_steps,
                "cpu_seconds": seconds,
                "mean_return": self._mean_return(
                    policy, N_EPISODES if self._due else N_LAST_EPISODES
                ),
                "bytes": memory() if not self._due else "",
            }
        )
        self._go_on()


class SolvedError(Exception):
    """Ends a training that need not go on."""


class UntilSolved(_Watch):
    """Looks every so many steps, until 100 greedy episodes have a mean return that solves the task.

    Ten episodes tell whether the hundred are worth playing. ``row`` takes the last look, and
    `SolvedError` ends the training.
    """

    def __init__(self, env, interval: int, solved: float, seed: int, row: dict[str, Any]) -> None:
        self._row = row
        self._interval, self._solved, self._due = interval, solved, interval
        super().__init__(env, seed)

    def __call__(self, n_steps, policy, memory) -> None:
        """Evaluate where it is due."""
        if n_steps < self._due:
            return
        seconds = self._pause()
        self._due = n_steps - n_steps % self._interval + self._interval
        mean = self._mean_return(policy, N_FIRST_EPISODES)
        if mean >= self._solved:
            mean = self._mean_return(policy, N_LAST_EPISODES)
        is_solved = mean >= self._solved
        self._row.update(
            steps=n_steps, cpu_seconds=seconds, mean_return=mean, solved=int(is_solved)
        )
        if is_solved:
            raise SolvedError
        self._go_on()
