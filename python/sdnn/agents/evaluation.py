"""Greedy episodes: how good an agent is now."""

from __future__ import annotations

import math
import warnings
from dataclasses import dataclass
from typing import Any, Protocol

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from sdnn.agents.spaces import require_same_kind
from sdnn.agents.transition import reward_of
from sdnn.arguments import has_methods, seed_of, whole

__all__ = ["Evaluation", "episode_seed", "evaluate"]

EVALUATION = 1
"""The kind of episodes that `episode_seed` gives seeds to."""


_LONG = 100_000
"""Steps of an episode that make one wonder."""


class Acts(Protocol):
    """What is evaluated."""

    def act(self, observation: Any, explore: bool = True) -> Any:
        """Choose an action."""


@dataclass(frozen=True, kw_only=True)
class Evaluation:
    """The outcome of some greedy episodes.

    Parameters
    ----------
    returns
        Undiscounted sums of rewards, shape (n_episodes,).
    lengths
        Steps, shape (n_episodes,).
    terminated
        Whether each ended in a terminal state, rather than by a time limit.
    """

    returns: NDArray[np.float64]
    lengths: NDArray[np.int64]
    terminated: NDArray[np.bool_]

    @property
    def mean_return(self) -> float:
        """The mean of the returns."""
        return float(self.returns.mean())

    @property
    def median_return(self) -> float:
        """The median of the returns."""
        return float(np.median(self.returns))


def episode_seed(seed: int, kind: int, episode: int) -> int:
    """Give the seed that an episode's `reset` gets: own ones for learning and evaluation."""
    word = np.random.SeedSequence(seed, spawn_key=(kind, episode)).generate_state(1, np.uint32)[0]
    return int(word) % 2**31  # some environments take no larger ones


def evaluate(
    agent: Acts, env: gym.Env[Any, Any], episodes: int = 10, *, seed: int = 0
) -> Evaluation:
    """Run greedy episodes, in which nothing is learned and nothing of the agent's future changes.

    An episode that seems not to end is warned of.

    Parameters
    ----------
    agent
        What acts.
    env
        Each episode resets it with a seed of its own: every call meets the same episodes. What an
        agent draws for its greedy actions, where several are best or all are random in a warm-up,
        goes on from call to call, in a stream that learning does not use.
    episodes
        How many.
    seed
        Root of the episodes' seeds.

    Raises
    ------
    TypeError, ValueError
        If an argument cannot be used, such as ``episodes`` below 1, the environment's spaces are
        not the agent's, or rewards do not add up to a finite number.
    """
    has_methods("agent", agent, "an agent", "act")
    has_methods("env", env, "a Gymnasium environment", "reset", "step")
    require_same_kind(agent, env)
    seed = seed_of(seed)
    n_episodes = whole("episodes", episodes, 1, 10**9)
    returns, lengths, ends = [], [], []
    for episode in range(n_episodes):
        observation, _ = env.reset(seed=episode_seed(seed, EVALUATION, episode))
        episode_return, length, terminated, truncated = 0.0, 0, False, False
        while not (terminated or truncated):
            action = agent.act(observation, explore=False)
            observation, reward, terminated, truncated, _ = env.step(action)
            episode_return += reward_of(reward)
            length += 1
            if length == _LONG:
                warnings.warn(
                    f"an evaluation's episode has had {_LONG:,} steps and goes on; an environment"
                    " whose episodes may never end needs a time limit (max_episode_steps)",
                    RuntimeWarning,
                    stacklevel=2,
                )
        if not math.isfinite(episode_return):
            raise ValueError(f"rewards of env must add up to a finite number, got {episode_return}")
        returns.append(episode_return)
        lengths.append(length)
        ends.append(terminated)
    return Evaluation(
        returns=np.array(returns), lengths=np.array(lengths), terminated=np.array(ends, bool)
    )
