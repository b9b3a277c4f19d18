"""Learning from transitions that were logged."""

from __future__ import annotations

import warnings
from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Protocol, TypeAlias

import gymnasium as gym
import numpy as np

from sdnn.agents.agent import Agent, AnyAgent
from sdnn.agents.fuzzy_q_learning import FuzzyQLearning
from sdnn.agents.logs import Logged, reader_of
from sdnn.environments.spaces import allows_no_action
from sdnn.support.arguments import is_of_class, require, whole
from sdnn.training.interfaces import Transition, explained


class MinariDataset(Protocol):
    """A dataset of `Minari <https://minari.farama.org>`_."""

    def iterate_episodes(self) -> Iterator[Any]:
        """Yield episodes with observations, actions, rewards, terminations and truncations."""


Dataset: TypeAlias = str | Path | Mapping[str, Any] | Iterable[Any] | MinariDataset
"""Logged transitions; see `learn_from`."""


@explained
def learn_from(agent: AnyAgent, dataset: Dataset, *, epochs: int = 1) -> int:
    """Learn logged transitions in their order. All of them are checked before any is learned.

    An agent without ranges takes its warm-up from the first transitions; a warning says where that
    needs more. ``agent.progress`` stays as it is.

    Parameters
    ----------
    agent : Agent
        Any but `FuzzyQLearning`, which can learn its own actions only. `SDNNQLambda` with
        ``QLambdaConfig(bootstrap="sarsa")`` learns the values of the policy that acted.
    dataset : path, mapping, table, MinariDataset or iterable
        A file ``.csv`` with a line of names, or of JSON lines, each a transition; both are read
        line by line. An empty cell, or null in an observation, is a missing reading. Arrays of n
        rows, or columns of a table of pandas, by their names: ``observations``, ``actions``,
        ``rewards``, ``terminations`` and ``truncations`` (flags, also as 0 and 1), ``dts``
        (durations; see `Transition`) and ``next_observations``. Without the last ones, also in
        files, rows follow each other, and where an episode is cut off its last step is not
        learned. Names of D4RL, imitation and Stable-Baselines3 (``obs``, ``terminals``,
        ``timeouts``, ``dones``, ...) and columns such as ``observation_0`` are read, too. Or
        transitions: `Transition`, mappings, or tuples of observation, action, reward, next
        observation, terminated and perhaps truncated. Or episodes, also a dataset of Minari:
        objects or mappings with one observation more than rewards. A step that is truncated where
        ``next_masks`` allow no action is learned as terminated.
    epochs : int
        How often the dataset is learned.

    Returns
    -------
    int
        Number of transitions learned, in all epochs.

    Raises
    ------
    TypeError, ValueError
        If an argument or a transition is not usable; names episode and row, and nothing is
        learned.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> import gymnasium as gym
    >>> from sdnn.agents import SDNNQLambda, Transition, learn_from
    >>> agent = SDNNQLambda(gym.spaces.Box(0, 1, (1,)), gym.spaces.Discrete(2))
    >>> learn_from(agent, [Transition([0.2], 1, 1.0, [0.3], True)], epochs=3)
    3
    """
    learns_any = is_of_class(agent, Agent) and not is_of_class(agent, FuzzyQLearning)
    expected = "be an Agent that learns any action, not FuzzyQLearning"
    require(learns_any, "agent", expected, agent, TypeError)
    epochs = whole("epochs", epochs, 1, 2**31)
    read = reader_of(dataset)
    n = checked_length(agent, read())
    if n == 0:
        return 0
    for _ in range(epochs):
        learn_log(agent, read())
    if agent.is_warming_up:
        warnings.warn(
            "agent is still warming up after dataset: it has observed it, but learned nothing yet."
            f" Give {agent._n_warm_up_steps_left} more transitions, more epochs, or make the agent"
            " with observation_range",
            stacklevel=3,
        )
    return n * epochs


def learn_log(agent: AnyAgent, log: Iterable[Logged]) -> None:
    """Learn logged transitions once, with all pending n-step returns."""
    agent.begin_episode()
    for logged in log:
        transition = learned_transition(agent, logged)
        agent.learn(transition)
        if logged.truncated or transition.terminated:
            agent.begin_episode()
    agent.begin_episode()


def checked_length(agent: AnyAgent, log: Iterator[Logged]) -> int:
    """Count transitions after checking each; an error names the place in the log."""
    n = n_episodes = 0
    for logged in log:
        try:
            transition = learned_transition(agent, logged)
            agent.check(transition)
        except (TypeError, ValueError) as error:
            episode = "" if logged.place.startswith("episode") else f"episode {n_episodes}, "
            raise type(error)(f"dataset, {episode}{logged.place}: {error}") from error
        n += 1
        n_episodes += logged.truncated or transition.terminated
    return n


def learned_transition(agent: AnyAgent, logged: Logged) -> Transition:
    """Return a logged transition as the agent learns it; ValueError for an unusable mask.

    A discrete action becomes an int where the log has it as a float or an array. A step that is
    truncated in a state in which no action is allowed terminates: no value can follow it.
    """
    transition, space = logged.transition, agent.action_space
    if logged.truncated and allows_no_action(space, "next_mask", transition.next_mask):
        transition = transition._replace(terminated=True)
    if not isinstance(space, gym.spaces.Discrete) or type(transition.action) is int:
        return transition
    number = np.asarray(transition.action)
    is_whole = number.size == 1 and number.dtype.kind in "iuf" and float(number.item()).is_integer()
    return transition._replace(action=int(number.item())) if is_whole else transition
