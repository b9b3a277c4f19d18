"""Sarsa(lambda) with tile coding, the classic among methods that learn one step at a time.

Source: Sutton, R., Barto, A. (2018). Reinforcement learning, sections 9.5.4, 12.7 and its
MountainCar example: replacing traces, a step size of 0.5 / n_tilings, values from 0.
"""

from __future__ import annotations

import itertools
from collections import deque
from dataclasses import dataclass

import gymnasium as gym
import numpy as np

from sdnn.bounds import flat_bounds
from sdnn.runs.registry import AgentEntry, register


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


@dataclass(frozen=True, kw_only=True)
class TilesConfig:
    """Settings of the tiles; see `TileCoding`."""

    n_inputs: int = 1
    n_bins: int = 8
    n_tilings: int = 16


@dataclass(frozen=True, kw_only=True)
class SarsaConfig:
    """Settings of the learning."""

    step_size: float = 0.5
    trace_decay: float = 0.9
    discount: float = 0.99
    epsilon: float = 0.1
    final_epsilon: float = 0.0


class TileCodingSarsa:
    """Sarsa(lambda) with replacing traces; a Box is cut into 5 actions in each dimension."""

    def __init__(
        self, observation_space, action_space, *, approximator, learning, seed,
        observation_range=None,
    ) -> None:  # fmt: skip
        ends = flat_bounds(observation_space) if observation_range is None else observation_range
        self._low, self._high = ends
        self._code = TileCoding(self._low.size, approximator.n_bins, approximator.n_tilings)
        self._actions = listed_actions(action_space)
        self.weights = np.zeros((len(self._actions), self._code.n_tiles))
        self._step_size = learning.step_size / approximator.n_tilings
        self._fade = learning.discount * learning.trace_decay
        self._discount = learning.discount
        self._epsilons = learning.epsilon, learning.final_epsilon
        self.progress = 0.0
        self._rng = np.random.default_rng(seed)
        # Traces below a hundredth are forgotten.
        n_kept = 1 if self._fade == 0 else int(np.ceil(np.log(0.01) / np.log(self._fade)))
        self._recent: deque[tuple[int, np.ndarray]] = deque(maxlen=n_kept)
        self._fades = self._fade ** np.arange(n_kept)

    @property
    def n_bytes(self) -> int:
        """Bytes of what is learned."""
        return self.weights.nbytes

    def tiles(self, observation):
        """The active tiles of an observation."""
        return self._code((observation - self._low) / (self._high - self._low))

    def values(self, tiles):
        """Q of every action."""
        return self.weights[:, tiles].sum(axis=1)

    def begin_episode(self) -> None:
        """Forget the traces."""
        self._recent.clear()
        self._next = None

    def act(self, observation, explore=True):
        """Choose an action, a best one or the one that was learned with."""
        if not explore:
            return self._actions[int(np.argmax(self.values(self.tiles(observation))))]
        if self._next is None:
            self._next = self._choose_at(self.tiles(observation))
        return self._actions[self._next[0]]

    def _choose_at(self, tiles):
        """Choose an action, with its tiles and its value."""
        values = self.values(tiles)
        first, last = self._epsilons
        if self._rng.random() < first + self.progress * (last - first):
            action = int(self._rng.integers(len(self._actions)))
        else:
            action = int(self._rng.choice(np.flatnonzero(values == values.max())))
        return action, tiles, values[action]

    def learn(self, transition) -> None:
        """Learn a step, with the action that follows it."""
        action, tiles, _ = self._next
        error = transition.reward - self.weights[action, tiles].sum()
        self._recent.appendleft((action, tiles))
        if not transition.terminated:
            self._next = self._choose_at(self.tiles(transition.next_observation))
            error += self._discount * self._next[2]
        self._correct(self._step_size * error)

    def _correct(self, change) -> None:
        actions = np.concatenate([np.full(tiles.size, a) for a, tiles in self._recent])
        tiles = np.concatenate([tiles for _, tiles in self._recent])
        n_each = self._recent[0][1].size
        traces = np.repeat(self._fades[: len(self._recent)], n_each)
        # Replacing traces: of a tile that was active more than once the latest counts.
        flat = actions * self.weights.shape[1] + tiles
        _, latest = np.unique(flat, return_index=True)
        self.weights.ravel()[flat[latest]] += change * traces[latest]


register(
    AgentEntry(
        id="tiles",
        title="Sarsa(lambda), tile coding",
        approximator=TilesConfig,
        learning=SarsaConfig,
        agent=TileCodingSarsa,
    )
)
