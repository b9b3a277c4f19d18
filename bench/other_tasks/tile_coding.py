"""Tile coding with Sarsa(lambda), the classic of learning one step at a time, and Swift-Sarsa.

Sources: Sutton, R., Barto, A. (2018). Reinforcement learning, sections 9.5.4, 12.7 and its
MountainCar example: replacing traces, a step size of 0.5 over the number of tilings, values from 0.
Javed, K., Sutton, R. (2025). Swift-Sarsa (arXiv:2507.19539), with the update of SwiftTD by its
author (github.com/khurramjaved96/SwiftTD) and the settings of its example.
"""

from __future__ import annotations

import itertools
from dataclasses import dataclass

import gymnasium as gym
import numpy as np

from sdnn.agents.registry import AgentEntry, register
from sdnn.environments.space_kinds import flat_bounds

try:
    from numba import njit
except ImportError:  # the same, but slow

    def njit(function):
        """Leave a function as it is."""
        return function


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
        """Return the active tiles, one of each grid: (n_tilings,), or (..., n_tilings) of rows."""
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
        """Return the active tiles, one of each grid of each pair, (n_pairs * n_tilings,)."""
        return (self._code(unit[self._pairs][:, None]) + self._first[:, None]).ravel()


class HashedTiles(TileCoding):
    """Tiles whose numbers are hashed into a table, for many inputs."""

    def __init__(self, n_inputs: int, n_bins: int, n_tilings: int, n_tiles: int) -> None:
        super().__init__(n_inputs, n_bins, n_tilings)
        mixed = np.random.default_rng(0).integers(1, 2**62, n_inputs + n_tilings)
        self._stride, self._first, self.n_tiles = mixed[:n_inputs], mixed[n_inputs:], n_tiles

    def __call__(self, unit):
        """Return the active tiles, one of each grid, shape (n_tilings,)."""
        mixed = super().__call__(unit).view(np.uint64) >> np.uint64(8)
        return (mixed % np.uint64(self.n_tiles)).astype(np.int64)


class Table:
    """A tile for each of listed observations."""

    def __init__(self, n_tiles: int) -> None:
        self.n_tiles = n_tiles

    def __call__(self, observation):
        """Return the tile of an observation, shape (1,)."""
        return np.array([observation])


N_VALUES, MOST_DIMENSIONS, N_VALUES_OF_MANY = 5, 3, 3
MOST_BYTES = 2**30


def listed_actions(space):
    """Return all actions of a space; a Box's with 5 values in each dimension, 3 in each of many."""
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
class QLambdaConfig:
    """Settings of the learning."""

    step_size: float = 0.5
    trace_decay: float = 0.9
    discount: float = 0.99
    epsilon: float = 0.1
    final_epsilon: float = 0.0


class TileCodingSarsa:
    """Sarsa(lambda) with replacing traces, over `listed_actions`.

    Variables without finite bounds are mapped to (0, 1) by the arc tangent.
    """

    n_numbers = 1
    """Numbers that are kept of each weight."""

    def __init__(
        self, observation_space, action_space, *, approximator, learning, seed,
        observation_range=None,
    ) -> None:  # fmt: skip
        bounds = flat_bounds(observation_space) if observation_range is None else observation_range
        self._is_finite = np.isfinite(np.subtract(bounds[1], bounds[0]))
        self._low, self._high = np.where(self._is_finite, bounds, [[0.0], [1.0]])
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
        # Traces below a hundredth are dropped; the hundredth is chosen.
        n_kept = 1 if self._fade == 0 else int(np.ceil(np.log(0.01) / np.log(self._fade)))
        self._fades = self._fade ** np.arange(n_kept)
        self._recent = np.full((n_kept, n_active), -1)  # tiles of the last steps, a ring
        self._last = np.full(self.weights.size, -1)  # step in which a tile was active last
        self._now = self._n_steps = 0

    @property
    def n_bytes(self) -> int:
        """Bytes of what is learned."""
        return self.n_numbers * self.weights.nbytes

    def tiles(self, observation):
        """Return the active tiles of an observation."""
        if isinstance(self._code, Table):
            return self._code(observation)
        unit = (observation - self._low) / (self._high - self._low)
        if not self._is_finite.all():
            unit = np.where(self._is_finite, unit, 0.5 + np.arctan(unit) / np.pi)
        return self._code(unit)

    def values(self, tiles):
        """Return Q of every action."""
        return self.weights[:, tiles].sum(axis=1)

    def begin_episode(self) -> None:
        """Forget the traces."""
        self._n_steps, self._next = 0, None

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
        self._now, self._n_steps = self._now + 1, self._n_steps + 1
        active = action * self.weights.shape[1] + tiles
        remember(self._recent[self._now % len(self._recent)], self._last, active, self._now)
        if not transition.terminated:
            self._next = self._choose_at(self.tiles(transition.next_observation))
            error += self._discount * self._next[2]
        correct(
            self.weights.ravel(), self._recent, self._last, self._now, self._n_steps,
            self._step_size * error * self._fades,
        )  # fmt: skip


@njit
def remember(row, last, active, now):
    """Put the active tiles into a row of the recent ones, each once."""
    for n, tile in enumerate(active):
        row[n] = -1 if last[tile] == now else tile
        last[tile] = now


@njit
def correct(weights, recent, last, now, n_steps, changes):
    """Change the tiles of an episode's last steps; of what was active twice the latest counts."""
    for age in range(min(n_steps, len(recent))):
        for tile in recent[(now - age) % len(recent)]:
            if tile >= 0 and last[tile] == now - age:
                weights[tile] += changes[age]


@dataclass(frozen=True, kw_only=True)
class SwiftConfig(QLambdaConfig):
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
        self._numbers = np.zeros((n, len(NUMBERS)))
        self._numbers[:, LOG_STEP] = np.log(learning.step_size)
        self.weights = self._numbers[:, W].reshape(self.weights.shape)
        self._eligible, self._n_eligible = np.zeros(n, np.int64), 0
        self._value, self._v_delta = 0.0, 0.0

    def begin_episode(self) -> None:
        """Forget the traces."""
        super().begin_episode()
        for trace in TRACES:
            self._numbers[self._eligible[: self._n_eligible], trace] = 0.0
        self._n_eligible, self._value, self._v_delta = 0, 0.0, 0.0
        self._is_first = True

    def learn(self, transition) -> None:
        """Learn a step, with the action that follows it."""
        if self._is_first:
            self.step(self._flat(*self._next[:2]), 0.0)
            self._is_first = False
        following = np.zeros(0, np.int64)
        if not transition.terminated:
            self._next = self._choose_at(self.tiles(transition.next_observation))
            following = self._flat(*self._next[:2])
        self.step(following, transition.reward)

    def _flat(self, action, tiles):
        return action * self.weights.shape[1] + tiles

    def step(self, active, reward: float) -> None:
        """Learn a reward and the value of the weights that are active after it."""
        settings = self._settings
        value = self._numbers[active, W].sum()
        error = reward + self._discount * value - self._value
        self._n_eligible = follow(
            self._numbers, self._eligible, self._n_eligible, error, self._v_delta, self._fade,
            settings.meta_step_size, np.log(settings.smallest_step_size),
            np.log(settings.largest_rate), settings.smallest_trace,
        )  # fmt: skip
        self._v_delta, self._n_eligible = begin(
            self._numbers, self._eligible, self._n_eligible, active, settings.largest_rate,
            np.log(settings.step_size_decay),
        )  # fmt: skip
        self._value = value


NUMBERS = range(11)
# A weight; the logarithm of its step size; the traces of the weight, of the change by its step, of
# its derivative by the step size and of the step size's gradient; the last change; the derivative
# as it is, was and will be; and what the trace began with.
W, LOG_STEP, Z, Z_DELTA, Z_BAR, P, DELTA_W, H, H_OLD, H_NEXT, BEGUN = NUMBERS
TRACES = (Z, Z_DELTA, Z_BAR, P, DELTA_W)


@njit
def follow(
    numbers, eligible, n_eligible, error, v_delta, fade, meta_step, low, high, smallest_trace
):
    """Change the eligible weights; returns how many stay eligible, at the front of the list."""
    n_kept = 0
    for i in eligible[:n_eligible]:
        x = numbers[i]
        x[DELTA_W] = error * x[Z] - x[Z_DELTA] * v_delta
        x[W] += x[DELTA_W]
        change = meta_step * (error - v_delta) * x[P]
        x[LOG_STEP] = min(max(x[LOG_STEP] + change * np.exp(-x[LOG_STEP]), low), high)
        x[H_OLD] = x[H]
        x[H] = x[H_NEXT] + error * x[Z_BAR] - x[Z_DELTA] * v_delta
        x[H_NEXT] = x[H]
        x[Z_DELTA] = 0.0
        for trace in (Z, P, Z_BAR):
            x[trace] *= fade
        if x[Z] > x[BEGUN] * smallest_trace:
            eligible[n_kept] = i
            n_kept += 1
        else:
            x[Z] = x[P] = x[Z_BAR] = x[DELTA_W] = 0.0
    return n_kept


@njit
def begin(numbers, eligible, n_eligible, active, largest_rate, decay):
    """Begin the traces of active weights; returns their last change and how many are eligible."""
    v_delta = overlap = rate = 0.0
    for i in active:
        v_delta += numbers[i, DELTA_W]
        overlap += numbers[i, Z]
        rate += np.exp(numbers[i, LOG_STEP])
    for i in active:
        x = numbers[i]
        if x[Z] == 0.0:
            eligible[n_eligible] = i
            n_eligible += 1
        begun = np.exp(x[LOG_STEP])
        if rate > largest_rate:
            begun *= largest_rate / rate
            x[H_NEXT] = x[H] = x[H_OLD] = x[Z_BAR] = 0.0
            x[LOG_STEP] += decay
        x[Z_DELTA] = x[BEGUN] = begun
        x[Z] += begun * (1.0 - overlap)
        x[P] += x[H_OLD]
        x[Z_BAR] += begun * (1.0 - overlap - x[Z_BAR])
        x[H_NEXT] = x[H] - x[H_OLD] * (x[Z] - begun) - x[H] * begun
    return v_delta, n_eligible


for name, title, learning, agent in (
    ("tiles", "Sarsa(lambda), tile coding", QLambdaConfig, TileCodingSarsa),
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
