"""Greedy episodes: how good an agent is now."""

from __future__ import annotations

import math
import warnings
from collections.abc import Callable, Iterator
from contextlib import ExitStack, closing
from dataclasses import dataclass
from typing import NamedTuple, Protocol

import numpy as np
from numpy.typing import NDArray

from sdnn.environments.space_kinds import made, require_same_kind, require_single
from sdnn.environments.types import Data, Element, Env
from sdnn.support.arguments import has_methods, require, seed_of, whole
from sdnn.support.display import Displayed
from sdnn.training.episodes import (
    EVALUATION,
    announces,
    checked_outcome,
    episode_seed,
    reset_env,
    step_env,
)
from sdnn.training.files import fixed_statistics
from sdnn.training.interfaces import (
    UnusableStepError,
    explained,
    mask_in,
    warn_of_endless_episode,
)

_LONG = 100_000  # warn after this many steps in one episode; a chosen number


class ActingAgent(Protocol):
    """The interface of agents that can be evaluated."""

    def act(self, observation: Element, explore: bool = True) -> Element:
        """Choose an action."""


@dataclass(frozen=True, kw_only=True, repr=False)
class Evaluation(Displayed):
    """The result of greedy episodes.

    Undiscounted sums of rewards, numbers of steps, and whether each ended in a terminal state
    rather than by a time limit; shapes (n_episodes,).
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

    def _facts(self) -> dict[str, object]:
        low, high = self.returns.min(), self.returns.max()
        spread = f"{self.mean_return:.5g} ({low:.5g} to {high:.5g})"
        return {"episodes": self.returns.size, "mean return": spread}

    def row(self) -> Data:
        """Return it as values that JSON can hold."""
        return {
            "mean_return": self.mean_return,
            "returns": self.returns.tolist(),
            "mean_length": float(self.lengths.mean()),
            "lengths": self.lengths.tolist(),
            "share_terminated": float(self.terminated.mean()),
            "terminated": self.terminated.tolist(),
        }


@explained
def evaluate(
    agent: ActingAgent,
    env: Env | str,
    episodes: int = 10,
    *,
    seed: int | None = 0,
    options: Data | None = None,
) -> Evaluation:
    """Run greedy episodes, in which nothing is learned and nothing of the agent's future changes.

    An episode that seems not to end is warned of, and an agent in its warm-up, whose actions are
    all random. Random draws for greedy actions come from a stream that runs on from call to call
    and that learning does not use. Wrappers that learn, such as ``NormalizeObservation``, keep
    their statistics; those that have seen nothing get what the agent's training had learned, else
    they are warned of.

    Parameters
    ----------
    agent
        An agent, or anything with its method `act`.
    env
        Each episode resets it with a seed of its own: every call meets the same episodes. An id,
        such as ``"CartPole-v1"``, stands for the environment that `gymnasium.make` gives.
    episodes
        How many.
    seed
        Root of the episodes' seeds. None: resets have no seeds, so that the environment's random
        streams run on from call to call.
    options
        Options of every reset.

    Raises
    ------
    TypeError, ValueError
        If an argument cannot be used, such as ``episodes`` below 1, or the environment's spaces are
        not the agent's.
    UnusableStepError
        If a step or reset cannot be used, or rewards do not add up to a finite number: a
        `ValueError` that names step and episode.
    """
    has_methods("agent", agent, "an agent", "act")
    if getattr(agent, "is_warming_up", False):
        warnings.warn(
            "agent is still warming up: it acts at random and has learned nothing yet. Train or"
            " learn more, or make it with observation_range",
            stacklevel=3,
        )
    evaluation = greedy_episodes(agent, env, episodes, seed=seed, options=options)
    assert evaluation is not None  # nothing stops it
    return evaluation


def greedy_episodes(
    agent: ActingAgent,
    env: Env | str,
    episodes: int,
    *,
    seed: int | None,
    options: Data | None,
    should_stop: Callable[[], bool] | None = None,
) -> Evaluation | None:
    """Evaluate like `evaluate`, without its warning of a warm-up.

    None where ``should_stop``, which is called in each step, returns True. The agent's state is
    that from before then, and after an error, so that the same evaluation can be made later.
    """
    if isinstance(env, str):
        with closing(made("env", env)) as env_of_id:
            return greedy_episodes(agent, env_of_id, episodes, seed=seed, options=options)
    require_single("env", env)
    require_same_kind(agent, env)
    root = None if seed is None else seed_of(seed)
    n_episodes = whole("episodes", episodes, 1, 10**9)
    is_options = isinstance(options, dict | None)
    require(is_options, "options", "be a dictionary or None", options, TypeError)
    returns, lengths, terminated = [], [], []
    with ExitStack() as restoring:
        if should_stop is not None and (core := getattr(agent, "_controller", None)):
            restoring.callback(core.restore, core.state())  # greedy actions draw random numbers
        for episode in range(n_episodes):
            for now in greedy_episode(agent, env, root, episode, options):
                if should_stop is not None and should_stop():
                    return None
                if now.n_steps == _LONG:
                    warn_of_endless_episode(_LONG)
            returns.append(now.total_reward)
            lengths.append(now.n_steps)
            terminated.append(now.terminated)
        restoring.pop_all()
    return Evaluation(
        returns=np.array(returns), lengths=np.array(lengths), terminated=np.array(terminated, bool)
    )


class GreedyEpisode(NamedTuple):
    """State of a greedy episode."""

    n_steps: int
    total_reward: float
    terminated: bool


def greedy_episode(
    agent: ActingAgent,
    env: Env,
    seed: int | None,
    number: int,
    options: Data | None = None,
) -> Iterator[GreedyEpisode]:
    """Run an episode of an evaluation; yield its state after the reset and after each step.

    UnusableStepError if a step or reset cannot be used, or the rewards' sum is not finite.
    """
    reset_seed = None if seed is None else episode_seed(seed, EVALUATION, number)
    with fixed_statistics(env, getattr(agent, "wrappers", ())):
        observation, info = reset_env(env, reset_seed, options)
        has_masks = announces(env, "action_masks")
        if hasattr(agent, "begin_greedy_episode"):
            agent.begin_greedy_episode()
        n_steps, total, terminated, truncated = 0, 0.0, False, False

        def unusable(problem: object) -> UnusableStepError:
            """Return the error for a step or reset that cannot be evaluated, with its place."""
            where = f"step {n_steps}" if n_steps else "the reset"
            return UnusableStepError(
                f"env gave what cannot be evaluated, in {where} of greedy episode {number}:"
                f" {problem}"
            )

        yield GreedyEpisode(0, 0.0, False)
        while not (terminated or truncated):
            try:
                mask = {"mask": mask_in(info)} if has_masks else {}
                action = agent.act(observation, explore=False, **mask)
            except ValueError as error:
                raise unusable(error) from error
            observation, *values, info = step_env(env, action)
            n_steps += 1
            try:
                reward, terminated, truncated = checked_outcome(*values)
            except UnusableStepError as error:
                raise unusable(error) from error
            total += reward
            if not math.isfinite(total):
                raise unusable(f"rewards of env must add up to a finite number, got {total}")
            yield GreedyEpisode(n_steps, total, terminated)
