"""Other sensors, delays and rewards for any task: the environment bench/Sensors-v0."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import gymnasium as gym
import numpy as np

from sdnn.environments.space_kinds import flat_bounds

RANGES = {"CartPole-v1": ((-2.4, -3.0, -0.21, -3.5), (2.4, 3.0, 0.21, 3.5))}
"""Ends that noise is measured by, of tasks whose space has infinite ones."""
LARGEST = 3.0
"""Where autocorrelated inputs, of variance 1, are clipped."""
EVALUATION_STEPS = 200
"""Steps of an episode of an endless task, in evaluations."""


class Sensors(gym.ObservationWrapper):
    """Observations in their own units: all variables, their copies, then irrelevant inputs.

    Parameters
    ----------
    env
        Whose observations are flattened.
    noise
        Standard deviation of independent noise on every variable and copy, in parts of its range;
        sums outside the space saturate.
    hidden
        Indices of variables that are not observed.
    copies
        Number of further sensors of every variable, each with independent noise.
    irrelevant
        Number of further inputs that carry no information, uniform in [-1, 1].
    correlation
        Autocorrelation of these from step to step; above 0 they are a Gaussian AR(1) process.
    ends
        Lowest and highest values by which the noise is measured; default those of the space.
    """

    def __init__(
        self, env: gym.Env, *, noise: float = 0.0, copies: int = 0, irrelevant: int = 0,
        correlation: float = 0.0, ends: Any = None, hidden: Sequence[int] = (),
    ) -> None:  # fmt: skip
        super().__init__(gym.wrappers.FlattenObservation(env))
        low, high = flat_bounds(env.observation_space)
        self._is_sensed = ~np.isin(np.arange(low.size), hidden)
        first, last = (low, high) if ends is None else np.asarray(ends)
        low, high, first, last = (
            np.tile(bound[self._is_sensed], 1 + copies) for bound in (low, high, first, last)
        )
        self._deviation = noise * (last - first)
        if noise and not np.isfinite(self._deviation).all():
            raise ValueError("ends must be given of variables whose range is infinite")
        self._low, self._high, self._n_copies = low, high, copies
        self._irrelevant, self._correlation = np.zeros(irrelevant), correlation
        widest = np.full(irrelevant, LARGEST if correlation else 1.0)
        self.observation_space = gym.spaces.Box(
            np.append(low, -widest).astype(np.float32), np.append(high, widest).astype(np.float32)
        )
        self._random = np.random.default_rng()

    def reset(self, *, seed=None, options=None):
        """Begin an episode; with a seed the random numbers begin anew, too."""
        if seed is not None:
            self._random = np.random.default_rng([seed, 1])
        self._irrelevant = self._random.standard_normal(self._irrelevant.size)
        return super().reset(seed=seed, options=options)

    def observation(self, observation):
        """Observe with noise."""
        sensed = np.tile(observation[self._is_sensed], 1 + self._n_copies)
        if self._deviation.any():
            sensed = sensed + self._deviation * self._random.standard_normal(sensed.size)
            sensed = np.clip(sensed, self._low, self._high)
        return np.append(sensed, self._next_irrelevant()).astype(np.float32)

    def _next_irrelevant(self):
        size, kept = self._irrelevant.size, self._correlation
        if kept == 0:
            return self._random.uniform(-1.0, 1.0, size)
        new = np.sqrt(1 - kept**2) * self._random.standard_normal(size)
        self._irrelevant = kept * self._irrelevant + new
        return np.clip(self._irrelevant, -LARGEST, LARGEST)


class Delayed(gym.Wrapper):
    """Actions take effect a number of steps late; those before the first one are 0."""

    def __init__(self, env: gym.Env, n_steps: int) -> None:
        super().__init__(env)
        self._n_steps = n_steps

    def reset(self, **options):
        """Begin an episode."""
        self._pending = [0 * self.action_space.sample() for _ in range(self._n_steps)]
        return super().reset(**options)

    def step(self, action):
        """Take the action that is due."""
        self._pending.append(action)
        return super().step(self._pending.pop(0))


class GoalOnly(gym.Wrapper):
    """The only reward is 1 where the episode terminates."""

    def step(self, action):
        """Take a step."""
        observation, _, terminated, truncated, info = super().step(action)
        return observation, float(terminated), terminated, truncated, info


class Endless(gym.Wrapper):
    """A task without episodes, except in evaluations; see `studies.Clock`."""

    evaluation_steps = EVALUATION_STEPS


def _make(
    task: str, delay: int = 0, endless: bool = False, goal_only: bool = False, **options: Any
) -> gym.Env:
    env = gym.make(task, max_episode_steps=-1) if endless else gym.make(task)
    if delay:
        env = Delayed(env, delay)
    if goal_only:
        env = GoalOnly(env)
    env = Sensors(env, ends=RANGES.get(task), **options)
    return Endless(env) if endless else env


gym.register("bench/Sensors-v0", entry_point=_make)
