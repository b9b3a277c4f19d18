"""Learning from transitions that were logged, without an environment."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Protocol, TypeAlias

from numpy.typing import NDArray

from sdnn.agents.agent import Agent
from sdnn.agents.episode import Transition
from sdnn.agents.fuzzy_q_learning import FuzzyQLearning
from sdnn.agents.names import explained
from sdnn.arguments import (
    argument_error,
    array_of,
    flag,
    is_of_class,
    path_of,
    require,
    shown,
    whole,
)
from sdnn.files import open_regular

_MOST_BYTES = 2**20
"""Of a line of a file: so much memory is used, whatever the file."""

_ARRAYS = ("observations", "actions", "rewards", "next_observations", "terminations")
_KEYS = Transition._fields[:-1]  # the last one is optional


class MinariDataset(Protocol):
    """A dataset of `Minari <https://minari.farama.org>`_."""

    def iterate_episodes(self) -> Iterator[Any]:
        """Yield episodes with observations, actions, rewards, terminations and truncations."""


Dataset: TypeAlias = str | Path | Mapping[str, Any] | Iterable[Transition] | MinariDataset
"""Logged transitions; see `learn_from`."""

_Logged: TypeAlias = tuple[str, Transition, bool]
"""Where a transition is, the transition, and whether its episode was truncated after it."""


@explained
def learn_from(agent: Agent[Any, Any], dataset: Dataset, *, epochs: int = 1) -> int:
    """Learn logged transitions in their order; they are read one by one, so memory stays small.

    An agent without ranges takes its warm-up from the first transitions. ``agent.progress`` stays
    as it is.

    Parameters
    ----------
    agent : Agent
        Any but `FuzzyQLearning`, which can learn its own actions only. `SDNNSarsa` with
        ``SarsaConfig(bootstrap="sarsa")`` learns the values of the policy that acted.
    dataset : path, mapping, MinariDataset or iterable of Transition
        A file of JSON lines, each an object with the fields of `Transition` and, if its episode was
        cut off after it, ``"truncated": true``. Arrays of n rows each by their names,
        ``observations``, ``actions``, ``rewards``, ``next_observations``, ``terminations`` and
        perhaps ``truncations``. A dataset of Minari. Or transitions.
    epochs : int
        How often the dataset is learned.

    Returns
    -------
    int
        Number of transitions learned, in all epochs.

    Raises
    ------
    TypeError, ValueError
        If an argument, a line or a transition is not usable; what came before it is learned.
    OSError
        If the file cannot be read.

    Examples
    --------
    >>> import gymnasium as gym
    >>> from sdnn.agents import SDNNSarsa, Transition, learn_from
    >>> agent = SDNNSarsa(gym.spaces.Box(0, 1, (1,)), gym.spaces.Discrete(2))
    >>> learn_from(agent, [Transition([0.2], 1, 1.0, [0.3], True)], epochs=3)
    3
    """
    learns_any = is_of_class(agent, Agent) and not is_of_class(agent, FuzzyQLearning)
    expected = "be an Agent that learns any action, not FuzzyQLearning"
    require(learns_any, "agent", expected, agent, TypeError)
    epochs = whole("epochs", epochs, 1, 2**31)
    read = _reader(dataset)
    is_once = isinstance(dataset, Iterator)
    require(epochs == 1 or not is_once, "epochs", "be 1 for an iterator", epochs)
    n = 0
    for _ in range(epochs):
        agent.begin_episode()
        for place, transition, truncated in read():
            try:
                agent.learn(transition)
                ends = flag("truncated", truncated) or transition.terminated
            except (TypeError, ValueError) as error:
                raise type(error)(f"dataset, {place}: {error}") from error
            n += 1
            if ends:
                agent.begin_episode()
        agent.begin_episode()  # learns what still waits
        if n == 0:  # nor will there be anything in the next epochs
            break
    return n


def _reader(dataset: Any) -> Callable[[], Iterator[_Logged]]:
    if isinstance(dataset, str | Path):
        return lambda: _lines(path_of("dataset", dataset))
    if isinstance(dataset, Mapping):
        arrays = _arrays_of(dataset)
        return lambda: _rows(arrays)
    if callable(getattr(dataset, "iterate_episodes", None)):
        return lambda: _episodes(dataset)
    if isinstance(dataset, Iterable):
        return lambda: ((f"transition {i}", one, False) for i, one in enumerate(dataset))
    expected = "must be a path, arrays by name, a Minari dataset or transitions"
    raise argument_error("dataset", f"{expected}, got {shown(dataset)}", TypeError)


def _lines(path: Path) -> Iterator[_Logged]:
    with open_regular(path, 2**62) as file:
        number = 0
        while line := file.readline(_MOST_BYTES + 1):
            number += 1
            if len(line) > _MOST_BYTES:
                raise ValueError(f"dataset, line {number}: must be of at most {_MOST_BYTES} bytes")
            try:
                values = json.loads(line)
            except (ValueError, RecursionError) as error:
                problem = f"must be a JSON object, got {shown(line[:40])}"
                raise ValueError(f"dataset, line {number}: {problem}") from error
            if not isinstance(values, dict) or not _has(values, _KEYS, "truncated", "next_mask"):
                perhaps = "perhaps truncated and next_mask"
                problem = f"must have {', '.join(_KEYS)}, {perhaps}, got {shown(values)}"
                raise ValueError(f"dataset, line {number}: {problem}")
            truncated = values.pop("truncated", False)
            yield f"line {number}", Transition(**values), truncated


def _has(values: Mapping[str, Any], names: tuple[str, ...], *more: str) -> bool:
    return set(names) <= set(values) <= {*names, *more}


def _arrays_of(values: Mapping[str, Any]) -> dict[str, NDArray[Any]]:
    """Return the arrays, of which files mapped to memory are not read yet."""
    expected = f"have {', '.join(_ARRAYS)}, perhaps truncations"
    require(_has(values, _ARRAYS, "truncations"), "dataset", expected, [*values])
    arrays = {name: array_of(f"dataset[{name!r}]", one) for name, one in values.items()}
    lengths = {name: len(one) if one.ndim else 0 for name, one in arrays.items()}
    require(len(set(lengths.values())) == 1, "dataset", "be of arrays of one length", lengths)
    return arrays


def _rows(arrays: Mapping[str, NDArray[Any]]) -> Iterator[_Logged]:
    truncations = arrays.get("truncations")
    for i in range(len(arrays["rewards"])):
        row = (arrays[name][i] for name in _ARRAYS)
        yield f"row {i}", Transition(*row), truncations is not None and truncations[i]


def _episodes(dataset: Any) -> Iterator[_Logged]:
    for number, episode in enumerate(dataset.iterate_episodes()):
        last = len(episode.rewards) - 1
        for t, reward in enumerate(episode.rewards):
            transition = Transition(
                _at(episode.observations, t),
                _at(episode.actions, t),
                reward,
                _at(episode.observations, t + 1),
                episode.terminations[t],
            )
            yield f"episode {number}, step {t}", transition, t == last


def _at(values: Any, t: int) -> Any:
    """Return number t of an array, or of each in dictionaries and tuples, as Gymnasium's spaces."""
    if isinstance(values, dict):
        return {name: _at(part, t) for name, part in values.items()}
    return tuple(_at(part, t) for part in values) if isinstance(values, tuple) else values[t]
