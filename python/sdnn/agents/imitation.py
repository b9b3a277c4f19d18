"""Imitation: an agent takes over the policy of a teacher from a log, before it learns itself."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from itertools import islice
from typing import TypeAlias

from sdnn import _core
from sdnn.agents.actor_critic import SDNNActorCritic
from sdnn.agents.datasets import Dataset, checked_length, learn_log, learned_transition
from sdnn.agents.logs import Logged, reader_of
from sdnn.agents.q_lambda import SDNNQLambda
from sdnn.support.arguments import is_of_class, require, whole
from sdnn.training.interfaces import Transition, explained

LinearAgent: TypeAlias = SDNNQLambda | SDNNActorCritic
Steps: TypeAlias = Sequence[Transition]

_MOST_STEPS = 10_000  # the number of steps that are in memory at once; longer episodes are split
_LARGEST_RETURN = 1e300  # like the largest reward that an agent accepts


@explained
def imitate(agent: SDNNQLambda | SDNNActorCritic, dataset: Dataset, *, epochs: int = 10) -> int:
    """Take over the policy of a teacher from a log. The agent can then learn on from there.

    `learn_from` learns how good the logged actions were; `imitate` learns to choose them, which
    takes far fewer transitions where the teacher is good. The values that the agent needs to learn
    on are those of the teacher's returns, which continue by the agent's estimate where an episode
    was cut off.

    Parameters
    ----------
    agent : SDNNQLambda or SDNNActorCritic
        With any actions; of a ``Box`` the nearest action of the agent counts. In a warm-up it takes
        its ranges from the log: three times as wide as what the first transitions show, and more,
        as the agent will leave the teacher's path.
    dataset : path, mapping, table, MinariDataset or iterable
        Logged transitions in any form that `learn_from` reads. Some random actions in them
        help: they show how the teacher recovers.
    epochs : int
        How often the dataset is imitated. Each transition counts for the schedules of the rates.

    Returns
    -------
    int
        Number of transitions imitated, in all epochs.

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
    >>> from sdnn.agents import SDNNQLambda, Transition, imitate
    >>> agent = SDNNQLambda(gym.spaces.Box(0, 1, (2,)), gym.spaces.Discrete(4), inputs="all")
    >>> imitate(agent, [Transition([0.2, 0.4], 3, 1.0, [0.3, 0.5], True)])
    10
    >>> int(agent.act([0.2, 0.4], explore=False))
    3
    """
    is_linear = is_of_class(agent, SDNNQLambda) or is_of_class(agent, SDNNActorCritic)
    expected = "be an SDNNQLambda or SDNNActorCritic (learn_from is for others, too)"
    require(is_linear, "agent", expected, agent, TypeError)
    epochs = whole("epochs", epochs, 1, 2**31)
    read = reader_of(dataset)
    n = checked_length(agent, read())
    if n == 0:
        return 0
    margin = _margin(agent, read)
    if agent.is_warming_up:
        _end_warm_up(agent, read())
    for _ in range(epochs):
        for steps, terminated in _episodes(agent, read()):
            last_value = 0.0 if terminated else _value(agent, steps)
            agent.begin_episode()
            for transition, target in zip(steps, _returns(agent, steps, last_value), strict=True):
                agent._imitate_step(transition, target, margin)
    agent.begin_episode()
    return n * epochs


def _end_warm_up(agent: LinearAgent, log: Iterator[Logged]) -> None:
    """Learn the log's first transitions, one fewer than the warm-up needs, then end the warm-up.

    Learning the last one, too, would end it with the ranges of an agent without a teacher.
    """
    learn_log(agent, islice(log, max(1, agent._n_warm_up_steps_left - 1)))
    if agent.is_warming_up:
        agent._end_warm_up_of_teacher()


def _episodes(agent: LinearAgent, log: Iterator[Logged]) -> Iterator[tuple[Steps, bool]]:
    """Yield the steps of each episode and whether it terminated; long episodes come in parts."""
    steps: list[Transition] = []
    for logged in log:
        steps.append(learned_transition(agent, logged))
        terminated = steps[-1].terminated
        if terminated or logged.truncated or len(steps) == _MOST_STEPS:
            yield steps, terminated
            steps = []
    if steps:
        yield steps, False


def _returns(agent: LinearAgent, steps: Steps, value: float) -> list[float]:
    """Return the discounted return of each step; `value` is the return after the last step."""
    discount = agent.learning.discount
    returns = []
    for transition in reversed(steps):
        dt = transition.dt
        remaining = discount if dt == 1.0 else float(_core.power(discount, dt))
        value = float(transition.reward) + remaining * value
        returns.append(value)
    return returns[::-1]


def _value(agent: LinearAgent, steps: Steps) -> float:
    """Return the agent's estimate of the discounted return after the last step of an episode."""
    last = steps[-1]
    if agent._remembers:
        agent.begin_episode()
        for transition in steps:
            agent._follow_teacher(transition)
    if isinstance(agent, SDNNActorCritic):
        return agent.value(last.next_observation)
    values = [agent.q_values(last.next_observation, d) for d in range(agent.n_dimensions)]
    return float(sum(part.max() for part in values))


def _margin(agent: LinearAgent, read: Callable[[], Iterator[Logged]]) -> float:
    """Return the root mean square of the returns, or 1 where all are 0.

    Imitation makes other actions worse by at least this margin. Less would let the noise
    of later learning undo what was imitated. ValueError for returns that cannot be learned.
    """
    total, n, largest = 0.0, 0, 0.0
    for steps, _ in _episodes(agent, read()):
        returns = _returns(agent, steps, 0.0)
        total, n = total + sum(value * value for value in returns), n + len(returns)
        largest = max(largest, *map(abs, returns))
    expected = "have rewards whose discounted sums are within 1e300: divide them by a number"
    require(largest <= _LARGEST_RETURN, "dataset", expected, largest)
    if math.isinf(total):  # squares of the returns are too large
        episodes = (_returns(agent, steps, 0.0) for steps, _ in _episodes(agent, read()))
        total = sum((value / largest) ** 2 for returns in episodes for value in returns)
        return largest * math.sqrt(total / n)
    size = math.sqrt(total / n)
    return size if size > 0.0 else 1.0
