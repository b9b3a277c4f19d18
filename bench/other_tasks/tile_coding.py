"""Sarsa(lambda) with tile coding, the classic among methods that learn one step at a time.

Source: Sutton, R., Barto, A. (2018). Reinforcement learning, sections 9.5.4, 12.7 and its
MountainCar example: replacing traces, a step size of 0.5 / n_tilings, values from 0.
"""

from __future__ import annotations

import itertools
from collections import deque

import gymnasium as gym
import numpy as np


class TileCoding:
    """Tiles of `n_tilings` grids over [0, 1]^l, each displaced by its own odd multiples of a part.

    Parameters
    ----------
    n_inputs
        l.
    n_bins
        Tiles of a grid along a variable.
    n_tilings
        Grids.
    """

    def __init__(self, n_inputs: int, n_bins: int, n_tilings: int) -> None:
        odd = 2 * np.arange(n_inputs) + 1
        self._offset = (np.arange(n_tilings)[:, None] * odd % n_tilings) / n_tilings
        self._n_bins = n_bins
        self._stride = (n_bins + 1) ** np.arange(n_inputs)
        self._first = np.arange(n_tilings) * (n_bins + 1) ** n_inputs
        self.n_tiles = n_tilings * (n_bins + 1) ** n_inputs

    def __call__(self, unit):
        """The active tiles, one of each grid, shape (n_tilings,)."""
        tile = np.floor(np.clip(unit, 0.0, 1.0) * self._n_bins + self._offset).astype(np.int64)
        return self._first + tile @ self._stride


N_VALUES = 5


def listed_actions(space):
    """All actions of a space; a Box's with N_VALUES in each dimension, in all combinations."""
    if not isinstance(space, gym.spaces.Box):
        return list(range(space.n))
    values = np.linspace(space.low, space.high, N_VALUES, dtype=np.float32).T
    return [np.array(action) for action in itertools.product(*values)]


class TileCodingSarsa:
    """Sarsa(lambda) with replacing traces; a Box is cut into 5 actions in each dimension."""

    def __init__(
        self,
        action_space,
        ranges,
        *,
        n_bins,
        n_tilings,
        step_size=0.5,
        trace_decay=0.9,
        discount=0.99,
        epsilon=0.1,
        final_epsilon=0.0,
        seed=0,
    ) -> None:
        self._low, self._high = ranges
        self._code = TileCoding(self._low.size, n_bins, n_tilings)
        self._actions = listed_actions(action_space)
        self.weights = np.zeros((len(self._actions), self._code.n_tiles))
        self._step_size = step_size / n_tilings
        self._fade = discount * trace_decay
        self._discount = discount
        self._epsilons = epsilon, final_epsilon
        self._rng = np.random.default_rng(seed)
        # Traces below a hundredth are forgotten.
        n_kept = 1 if self._fade == 0 else int(np.ceil(np.log(0.01) / np.log(self._fade)))
        self._recent: deque[tuple[int, np.ndarray]] = deque(maxlen=n_kept)
        self._fades = self._fade ** np.arange(n_kept)

    def tiles(self, observation):
        """The active tiles of an observation."""
        return self._code((observation - self._low) / (self._high - self._low))

    def values(self, tiles):
        """Q of every action."""
        return self.weights[:, tiles].sum(axis=1)

    def greedy(self, observation):
        """A best action."""
        return self._actions[int(np.argmax(self.values(self.tiles(observation))))]

    def _choose(self, values, progress):
        first, last = self._epsilons
        if self._rng.random() < first + progress * (last - first):
            return int(self._rng.integers(len(self._actions)))
        return int(self._rng.choice(np.flatnonzero(values == values.max())))

    def learn(self, env, steps, seed, after_step) -> None:
        """Learn for a number of steps; `after_step` is called after each."""
        is_over = True
        for step in range(steps):
            if is_over:
                observation, _ = env.reset(seed=seed if step == 0 else None)
                self._recent.clear()
                tiles = self.tiles(observation)
                action = self._choose(self.values(tiles), step / steps)
            observation, reward, terminated, truncated, _ = env.step(self._actions[action])
            is_over = terminated or truncated
            error = reward - self.weights[action, tiles].sum()
            self._recent.appendleft((action, tiles))
            if not terminated:
                tiles = self.tiles(observation)
                values = self.values(tiles)
                action = self._choose(values, step / steps)
                error += self._discount * values[action]
            self._correct(self._step_size * error)
            after_step(step + 1)

    def _correct(self, change) -> None:
        actions = np.concatenate([np.full(tiles.size, a) for a, tiles in self._recent])
        tiles = np.concatenate([tiles for _, tiles in self._recent])
        n_each = self._recent[0][1].size
        traces = np.repeat(self._fades[: len(self._recent)], n_each)
        # Replacing traces: of a tile that was active more than once the latest counts.
        flat = actions * self.weights.shape[1] + tiles
        _, latest = np.unique(flat, return_index=True)
        self.weights.ravel()[flat[latest]] += change * traces[latest]
