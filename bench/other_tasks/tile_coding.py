"""Tile coding with Sarsa(lambda), the classic of learning one step at a time, and Swift-Sarsa.

Sources: Sutton, R., Barto, A. (2018). Reinforcement learning, sections 9.5.4, 12.7 and its
MountainCar example: replacing traces, a step size of 0.5 over the number of tilings, values from 0.
Javed, K., Sutton, R. (2025). Swift-Sarsa (arXiv:2507.19539), with the update of SwiftTD by its
author (github.com/khurramjaved96/SwiftTD) and the settings of its example.
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


class PairTiles:
    """Tiles of every pair of inputs: their number grows with the square of the inputs."""

    def __init__(self, n_inputs: int, n_bins: int, n_tilings: int) -> None:
        self._pairs = np.array(list(itertools.combinations(range(n_inputs), 2)))
        self._code = TileCoding(2, n_bins, n_tilings)
        self._first = self._code.n_tiles * np.arange(len(self._pairs))
        self.n_tiles = self._code.n_tiles * len(self._pairs)

    def __call__(self, unit):
        """The active tiles, one of each grid of each pair, shape (n_pairs * n_tilings,)."""
        tiles = [self._code(unit[pair]) for pair in self._pairs]
        return (np.array(tiles) + self._first[:, None]).ravel()


class HashedTiles(TileCoding):
    """Tiles whose numbers are hashed into a table, for many inputs."""

    def __init__(self, n_inputs: int, n_bins: int, n_tilings: int, n_tiles: int) -> None:
        super().__init__(n_inputs, n_bins, n_tilings)
        mixed = np.random.default_rng(0).integers(1, 2**62, n_inputs + n_tilings)
        self._stride, self._first, self.n_tiles = mixed[:n_inputs], mixed[n_inputs:], n_tiles

    def __call__(self, unit):
        """The active tiles, one of each grid, shape (n_tilings,)."""
        mixed = super().__call__(unit).view(np.uint64) >> np.uint64(8)
        return (mixed % np.uint64(self.n_tiles)).astype(np.int64)


class Table:
    """A tile for each of listed observations."""

    def __init__(self, n_tiles: int) -> None:
        self.n_tiles = n_tiles

    def __call__(self, observation):
        """The tile of an observation, shape (1,)."""
        return np.array([observation])


N_VALUES, MOST_DIMENSIONS, N_VALUES_OF_MANY = 5, 3, 3
MOST_BYTES = 2**30


def listed_actions(space):
    """All actions of a space; a Box's with 5 values in each dimension, 3 in each of many."""
    if not isinstance(space, gym.spaces.Box):
        return list(range(space.n))
    n_values = N_VALUES if space.shape[0] <= MOST_DIMENSIONS else N_VALUES_OF_MANY
    values = np.linspace(space.low, space.high, n_values, dtype=np.float32).T
    return [np.array(action) for action in itertools.product(*values)]


@dataclass(frozen=True, kw_only=True)
class TilesConfig:
    """Settings of the tiles; see `TileCoding`."""

    n_inputs: int = 1
    n_bins: int = 8
    n_tilings: int = 16
    on_pairs: bool = False  # of inputs, instead of all together
    n_hashed: int = 0  # tiles in a hashed table; 0: all there are


def code_of(space, settings: TilesConfig):
    """Make the tiles of settings for the observations of a space."""
    if isinstance(space, gym.spaces.Discrete):
        return Table(int(space.n))
    n_inputs = gym.spaces.flatdim(space)
    sizes = n_inputs, settings.n_bins, settings.n_tilings
    if settings.n_hashed:
        return HashedTiles(*sizes, settings.n_hashed)
    return PairTiles(*sizes) if settings.on_pairs and n_inputs > 2 else TileCoding(*sizes)


@dataclass(frozen=True, kw_only=True)
class SarsaConfig:
    """Settings of the learning."""

    step_size: float = 0.5
    trace_decay: float = 0.9
    discount: float = 0.99
    epsilon: float = 0.1
    final_epsilon: float = 0.0


class TileCodingSarsa:
    """Sarsa(lambda) with replacing traces, over `listed_actions`.

    Variables without ends are squashed by the arc tangent.
    """

    n_numbers = 1
    """Numbers that are kept of each weight."""

    def __init__(
        self, observation_space, action_space, *, approximator, learning, seed,
        observation_range=None,
    ) -> None:  # fmt: skip
        ends = flat_bounds(observation_space) if observation_range is None else observation_range
        self._is_finite = np.isfinite(np.subtract(ends[1], ends[0]))
        self._low, self._high = np.where(self._is_finite, ends, [[0.0], [1.0]])
        self._code = code_of(observation_space, approximator)
        self._actions = listed_actions(action_space)
        if 8 * self.n_numbers * len(self._actions) * self._code.n_tiles > MOST_BYTES:
            raise ValueError(f"n_tiles {self._code.n_tiles} are too many for {MOST_BYTES} bytes")
        self.weights = np.zeros((len(self._actions), self._code.n_tiles))
        n_active = self.tiles(observation_space.sample()).size
        self._step_size = learning.step_size / n_active
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
        return self.n_numbers * self.weights.nbytes

    def tiles(self, observation):
        """The active tiles of an observation."""
        if isinstance(self._code, Table):
            return self._code(observation)
        unit = (observation - self._low) / (self._high - self._low)
        if not self._is_finite.all():
            unit = np.where(self._is_finite, unit, 0.5 + np.arctan(unit) / np.pi)
        return self._code(unit)

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


@dataclass(frozen=True, kw_only=True)
class SwiftConfig(SarsaConfig):
    """Settings of Swift-Sarsa; the step size is each weight's at the start."""

    step_size: float = 1e-2
    trace_decay: float = 0.95
    meta_step_size: float = 1e-3
    largest_rate: float = 0.1  # eta: no step of learning corrects more than this share of its error
    smallest_step_size: float = 1e-10
    step_size_decay: float = 0.999  # where that bound is met
    smallest_trace: float = 1e-5  # in parts of the step size with which a trace began


class SwiftSarsa(TileCodingSarsa):
    """True-online Sarsa(lambda) that learns a step size for each weight."""

    n_numbers = 11

    def __init__(self, *spaces, learning, **options) -> None:
        super().__init__(*spaces, learning=learning, **options)
        self._settings, n = learning, self.weights.size
        self._log_steps = np.full(n, np.log(learning.step_size))
        # Traces of the weights, of their derivatives by the step sizes, and these derivatives.
        self._z, self._z_delta, self._z_bar, self._p, self._delta_w = np.zeros((5, n))
        self._h, self._h_old, self._h_next, self._begun = np.zeros((4, n))
        self._eligible, self._value, self._v_delta = np.zeros(0, int), 0.0, 0.0

    def begin_episode(self) -> None:
        """Forget the traces."""
        super().begin_episode()
        for trace in (self._z, self._z_delta, self._z_bar, self._p, self._delta_w):
            trace[self._eligible] = 0.0
        self._eligible, self._value, self._v_delta = np.zeros(0, int), 0.0, 0.0
        self._is_first = True

    def learn(self, transition) -> None:
        """Learn a step, with the action that follows it."""
        if self._is_first:
            self.step(self._flat(*self._next[:2]), 0.0)
            self._is_first = False
        following = np.zeros(0, int)
        if not transition.terminated:
            self._next = self._choose_at(self.tiles(transition.next_observation))
            following = self._flat(*self._next[:2])
        self.step(following, transition.reward)

    def _flat(self, action, tiles):
        return action * self.weights.shape[1] + tiles

    def step(self, active, reward: float) -> None:
        """Learn a reward and the value of the weights that are active after it."""
        weights, own, e = self.weights.ravel(), self._settings, self._eligible
        value = weights[active].sum()
        error = reward + self._discount * value - self._value
        self._delta_w[e] = error * self._z[e] - self._z_delta[e] * self._v_delta
        weights[e] += self._delta_w[e]
        change = own.meta_step_size * (error - self._v_delta) * self._p[e]
        self._log_steps[e] = np.clip(
            self._log_steps[e] + change * np.exp(-self._log_steps[e]),
            np.log(own.smallest_step_size), np.log(own.largest_rate),
        )  # fmt: skip
        self._h_old[e] = self._h[e]
        self._h[e] = self._h_next[e] + error * self._z_bar[e] - self._z_delta[e] * self._v_delta
        self._h_next[e] = self._h[e]
        self._z_delta[e] = 0.0
        for trace in (self._z, self._p, self._z_bar):
            trace[e] *= self._fade
        lost = e[self._z[e] <= self._begun[e] * own.smallest_trace]
        for trace in (self._z, self._p, self._z_bar, self._delta_w):
            trace[lost] = 0.0
        self._begin_traces(active)
        self._eligible = np.union1d(e[self._z[e] != 0.0], active)
        self._value = value

    def _begin_traces(self, a) -> None:
        own, steps = self._settings, np.exp(self._log_steps[a])
        self._v_delta = self._delta_w[a].sum()
        overlap, rate = self._z[a].sum(), steps.sum()
        self._z_delta[a] = self._begun[a] = steps * min(1.0, own.largest_rate / max(rate, 1e-300))
        if rate > own.largest_rate:
            for derivative in (self._h_next, self._h, self._h_old, self._z_bar):
                derivative[a] = 0.0
            self._log_steps[a] += np.log(own.step_size_decay)
        begun = self._z_delta[a]
        self._z[a] += begun * (1.0 - overlap)
        self._p[a] += self._h_old[a]
        self._z_bar[a] += begun * (1.0 - overlap - self._z_bar[a])
        kept = self._h_old[a] * (self._z[a] - begun)
        self._h_next[a] = self._h[a] - kept - self._h[a] * begun


for name, title, learning, agent in (
    ("tiles", "Sarsa(lambda), tile coding", SarsaConfig, TileCodingSarsa),
    ("swift-sarsa", "Swift-Sarsa, tile coding", SwiftConfig, SwiftSarsa),
):
    register(
        AgentEntry(
            id=name,
            title=title,
            approximator=TilesConfig,
            learning=learning,
            agent=agent,
        )
    )
