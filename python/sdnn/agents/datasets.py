"""Learning from transitions that were logged, in any of the forms in which people have them."""

from __future__ import annotations

import csv
import io
import json
import re
import warnings
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple, Protocol, TypeAlias

import gymnasium as gym
import numpy as np

from sdnn.agents.agent import Agent, AnyAgent
from sdnn.agents.fuzzy_q_learning import FuzzyQLearning
from sdnn.environments.types import Data, Info
from sdnn.support.arguments import (
    argument_error,
    array_of,
    duration_of,
    is_of_class,
    path_of,
    require,
    shown,
    whole,
)
from sdnn.support.files import open_regular
from sdnn.support.habits import advice
from sdnn.training.interfaces import Transition, explained

_MOST_BYTES = 2**20  # limit of a line's length when a file is read, so that memory stays bounded

NAMES: Mapping[str, tuple[str, ...]] = {
    "observations": ("observation", "obs", "states", "state"),
    "actions": ("action", "acts", "act"),
    "rewards": ("reward", "rews", "rew"),
    "next_observations": ("next_observation", "next_obs", "next_states", "next_state"),
    "terminations": ("terminated", "terminals", "terminal", "dones", "done"),
    "truncations": ("truncated", "timeouts", "timeout"),
    "next_masks": ("next_mask",),
    "dts": ("dt",),
}
"""Usual names of columns, and their names in D4RL, imitation and Stable-Baselines3."""

_IGNORED = re.compile(r"(infos?|metadata|id|seed|total_steps)\b")
_NUMBERED = re.compile(r"(.+?)[_.\[](\d+)\]?")
_ARRAYS = ("observations", "actions", "rewards")


class Logged(NamedTuple):
    """A transition, its place in the log, and whether the log truncates its episode there."""

    place: str
    transition: Transition
    truncated: bool


@cache
def _columns_by_name() -> dict[str, str]:
    """Map each name of `NAMES` to the usual name of the column."""
    return {other: name for name, others in NAMES.items() for other in (name, *others)}


def reader_of(dataset: Any) -> Callable[[], Iterator[Logged]]:
    """Return a function that reads a dataset from its beginning; see `learn_from`.

    TypeError or ValueError for what is no dataset.
    """
    if isinstance(dataset, str | Path):
        path = path_of("dataset", dataset)
        if path.suffix.lower() == ".csv":
            return lambda: _with_next_observations(_table_lines(path))
        return lambda: _json_lines(path)
    if hasattr(dataset, "columns") and hasattr(dataset, "iloc"):  # a table of pandas
        dataset = {str(name): dataset[name].to_numpy() for name in dataset.columns}
    if isinstance(dataset, Mapping):
        columns = _columns_of(dataset)
        return lambda: _with_next_observations(_rows(columns, "row"))
    if callable(getattr(dataset, "iterate_episodes", None)):
        return lambda: _transitions_of_items(dataset.iterate_episodes())
    if isinstance(dataset, Iterable):
        items = [*dataset] if isinstance(dataset, Iterator) else dataset
        return lambda: _transitions_of_items(items)
    expected = "must be a path, arrays by name, a table, a Minari dataset, transitions or episodes"
    raise argument_error("dataset", f"{expected}, got {shown(dataset)}", TypeError)


def _json_lines(path: Path) -> Iterator[Logged]:
    """Yield the transitions of a JSON Lines file; errors name the line."""
    for number, line in _numbered_lines(path):
        try:
            values = json.loads(line)
        except (ValueError, RecursionError) as error:
            problem = f"must be a JSON object, got {shown(line[:40])}"
            raise ValueError(f"dataset, line {number}: {problem}") from error
        require(isinstance(values, dict), f"dataset, line {number}", "be a JSON object", values)
        yield _transition(values, f"line {number}")


def _table_lines(path: Path) -> Iterator[tuple[str, Data]]:
    """Read a file of comma-separated values, whose first line has the names."""
    names: list[str] = []
    for number, line in _numbered_lines(path):
        try:
            cells = next(csv.reader(io.StringIO(line.decode())), [])
        except (UnicodeDecodeError, csv.Error) as error:
            raise ValueError(f"dataset, line {number}: must be text, got {shown(line)}") from error
        if not names:
            names = [cell.strip() for cell in cells]
            continue
        expected = f"have {len(names)} cells, as many as there are names"
        require(len(cells) == len(names), f"dataset, line {number}", expected, cells)
        values = {name: [_parse_cell(cell)] for name, cell in zip(names, cells, strict=True)}
        for _, row in _rows(_columns_of(values, f"dataset, line {number}"), ""):
            yield f"line {number}", row


def _with_next_observations(
    rows: Iterable[tuple[str, Data]], *, is_episode: bool = False
) -> Iterator[Logged]:
    """Convert rows, of one or several episodes, to transitions.

    A missing next observation is that of the next row. So the last step of a truncated episode has
    none, and is left out, unless the rows have the episode's last observation (`is_episode`).
    """
    pending: tuple[Data, str] | None = None  # the last row and its place, without that observation
    for place, row in rows:
        if pending is not None:
            pending[0]["next_observations"] = row["observations"]
            yield _logged(*pending)
            pending = None
        if "rewards" not in row:  # only the observation after the last step
            continue
        if "next_observations" in row:
            yield _logged(row, place)
            continue
        is_terminated = _flag("terminations", row.get("terminations", False))
        is_truncated = _flag("truncations", row.get("truncations", False))
        if is_episode or not (is_terminated or is_truncated):
            pending = row, place
        elif is_terminated:
            row["next_observations"] = row["observations"]  # not used: no value follows
            yield _logged(row, place)


def _parse_cell(text: str) -> Any:
    """Return the bool or the number that a cell of a CSV file spells, or its text."""
    word = text.strip()
    if word.lower() in ("true", "false"):
        return word.lower() == "true"
    try:
        return float(word)
    except ValueError:
        return word


def _numbered_lines(path: Path) -> Iterator[tuple[int, bytes]]:
    """Yield each line with its number, from 1; ValueError for a line above `_MOST_BYTES`."""
    with open_regular(path, 2**62) as file:
        number = 0
        while line := file.readline(_MOST_BYTES + 1):
            number += 1
            if len(line) > _MOST_BYTES:
                raise ValueError(f"dataset, line {number}: must be of at most {_MOST_BYTES} bytes")
            yield number, line


def _transitions_of_items(items: Iterable[Any]) -> Iterator[Logged]:
    """Read items of an iterable, each of which is a transition or an episode."""
    for number, item in enumerate(items):
        if isinstance(item, Transition):
            yield Logged(f"transition {number}", item, False)
        elif isinstance(item, tuple | list) and len(item) in (5, 6):
            yield _logged(dict(zip(_ROW, item, strict=False)), f"transition {number}")
        else:
            values = _columns_in(item)
            if values is None:
                expected = "be a Transition, a mapping, or an episode with observations"
                raise argument_error(f"dataset, transition {number}",
                                     f"must {expected}, got {shown(item)}", TypeError)  # fmt: skip
            if np.ndim(_value(values, "rewards", ())) == 0:
                yield _transition(values, f"transition {number}")
            else:
                columns = _columns_of(values, f"dataset, episode {number}", is_episode=True)
                rows = _rows(columns, f"episode {number}, step", is_episode=True)
                yield from _with_next_observations(rows, is_episode=True)


_ROW = ("observations", "actions", "rewards", "next_observations", "terminations", "truncations")


def _columns_in(item: Any) -> Data | None:
    """Return the columns of a mapping, or of an object's attributes that `NAMES` lists.

    None for an object without observations or rewards.
    """
    if isinstance(item, Mapping):
        return dict(item)
    columns = {name: getattr(item, name) for name in _columns_by_name() if hasattr(item, name)}
    has_all = all(_value(columns, name) is not None for name in ("observations", "rewards"))
    return columns if has_all else None


def _value(values: Info, name: str, default: Any = None) -> Any:
    """Return the value of a column of `NAMES` under any of its names, or the default."""
    return next((values[other] for other in (name, *NAMES[name]) if other in values), default)


def _transition(values: Info, place: str) -> Logged:
    """Read a mapping of one transition."""
    row = {}
    for name, value in values.items():
        if _IGNORED.match(name):
            continue
        column = _columns_by_name().get(name)
        require(column, f"dataset, {place}", f"have no {name!r}: {advice(name, NAMES)}", [*values])
        require(column not in row, f"dataset, {place}", f"have {column} once", [*values])
        row[str(column)] = value
    missing = [name for name in _ROW[:4] if name not in row]
    require(not missing, f"dataset, {place}", f"have {', '.join(missing)}", [*values])
    return _logged(row, place)


def _logged(row: Info, place: str) -> Logged:
    """Return the transition of a row of columns; ``place`` names the row in errors."""
    try:
        terminated = _flag("terminated", row.get("terminations", False))
        truncated = _flag("truncated", row.get("truncations", False))
        dt = duration_of(row.get("dts", 1.0))
    except ValueError as error:
        raise ValueError(f"dataset, {place}: {error}") from error
    is_end = terminated and not truncated
    observation, action, reward, following = (row[name] for name in _ROW[:4])
    mask = row.get("next_masks")
    transition = Transition(observation, action, reward, following, is_end, mask, dt)
    return Logged(place, transition, truncated)


def _flag(name: str, value: Any) -> bool:
    """Read True or False of any library, or 1 or 0."""
    number = np.asarray(value)
    is_flag = number.size == 1 and number.dtype.kind in "biuf" and number.item() in (0, 1)
    require(is_flag, name, "be True or False, or 1 or 0", value)
    return bool(number.item())


def _columns_of(values: Info, where: str = "dataset", *, is_episode: bool = False) -> Data:
    """Return arrays of n rows by their usual names; ``observations`` may have n + 1 rows.

    Those of an episode (`is_episode`) must have n + 1. Columns such as ``observation_0`` are put
    together. Memory-mapped arrays stay on disk.
    """
    columns: Data = {}
    numbered_columns: dict[str, dict[int, Any]] = {}  # such as observation_0, by name and number
    for name, column in values.items():
        if column is None or _IGNORED.match(str(name)):
            continue
        numbered = _NUMBERED.fullmatch(str(name))
        usual = _columns_by_name().get(str(name))
        if usual is not None:
            require(usual not in columns, where, f"have {usual} once", [*values])
            columns[usual] = _checked_column(f"{where}[{name!r}]", column)
        elif numbered and (usual := _columns_by_name().get(numbered[1])) is not None:
            same_name = numbered_columns.setdefault(usual, {})
            same_name[int(numbered[2])] = array_of(f"{where}[{name!r}]", column)
        else:
            raise argument_error(
                where, f"must have no {name!r}: {advice(str(name), NAMES)}; got {[*values]}"
            )
    for name, numbers in numbered_columns.items():
        expected = f"have columns of {name} numbered from 0"
        require([*sorted(numbers)] == [*range(len(numbers))], where, expected, sorted(numbers))
        columns[name] = np.stack([numbers[i] for i in range(len(numbers))], axis=-1)
    missing = [name for name in _ARRAYS if name not in columns]
    require(not missing, where, f"have {', '.join(missing)}", [*values])
    n = _n_rows_of(columns["rewards"])
    lengths = {name: _n_rows_of(column) for name, column in columns.items()}
    may_have_last = "next_observations" not in columns  # the observation after the last step
    others = {length for name, length in lengths.items() if name != "observations"}
    fits = others == {n} and lengths["observations"] - n in (0, int(may_have_last))
    more = " (of observations one more)" if may_have_last else ""
    require(fits, where, f"have {n} rows of each, as of rewards{more}", lengths)
    if is_episode and may_have_last:
        is_whole = lengths["observations"] == n + 1
        require(is_whole, where, f"have {n + 1} observations for {n} rewards", lengths)
    return columns


def _checked_column(name: str, column: Any) -> Any:
    """Return a column, or the columns of a Dict or Tuple, as arrays or lists of elements."""
    if isinstance(column, Mapping):
        return {key: _checked_column(f"{name}[{key!r}]", part) for key, part in column.items()}
    if isinstance(column, tuple) and column and np.ndim(column[0]) > 0:
        return tuple(_checked_column(f"{name}[{i}]", part) for i, part in enumerate(column))
    has_mappings = isinstance(column, list) and column and isinstance(column[0], Mapping)
    if has_mappings or getattr(getattr(column, "dtype", None), "kind", "") == "O":
        return list(column)  # rows of dictionaries or tuples, which the agent reads
    if isinstance(column, np.ma.MaskedArray):  # the agent reads masks as missing values
        return list(column) if np.ma.is_masked(column) else column.data
    return array_of(name, column)


def _n_rows_of(column: Any) -> int:
    """Return the number of rows of a column; a nested column has those of its shortest part."""
    if isinstance(column, Mapping | tuple):
        parts = column.values() if isinstance(column, Mapping) else column
        return min((_n_rows_of(part) for part in parts), default=0)
    return len(column) if np.ndim(column) or isinstance(column, list) else 0


def _rows(columns: Data, place: str, *, is_episode: bool = False) -> Iterator[tuple[str, Data]]:
    """Yield the rows of arrays with their places; last, an observation that follows them.

    The last step of an episode (`is_episode`) is truncated, unless it terminates.
    """
    n, has_next = _n_rows_of(columns["rewards"]), "next_observations" in columns
    for i in range(n if has_next else _n_rows_of(columns["observations"])):
        names = columns if i < n else ("observations",)
        row = {name: _element_at(columns[name], i) for name in names}
        if is_episode and i == n - 1 and not _flag("terminations", row.get("terminations", False)):
            row["truncations"] = True
        yield f"{place} {i}", row


def _element_at(values: Any, t: int) -> Any:
    """Return element t of an array, or of each array in nested dictionaries and tuples."""
    if isinstance(values, Mapping):
        return {name: _element_at(part, t) for name, part in values.items()}
    if isinstance(values, tuple):
        return tuple(_element_at(part, t) for part in values)
    return values[t]


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
        line by line. Arrays of n rows, or columns of a table of pandas, by their names:
        ``observations``, ``actions``, ``rewards``, ``terminations`` and ``truncations`` (flags,
        also as 0 and 1), ``dts`` (durations; see `Transition`) and ``next_observations``. Without
        the last ones, rows follow each other, and where an episode is cut off its last step is not
        learned. Names of D4RL, imitation and Stable-Baselines3 (``obs``, ``terminals``,
        ``timeouts``, ``dones``, ...) and columns such as ``observation_0`` are read, too. Or
        transitions: `Transition`, mappings, or tuples of observation, action, reward, next
        observation, terminated and perhaps truncated. Or episodes, also a dataset of Minari:
        objects or mappings with one observation more than rewards.
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
        transition = with_action(agent, logged.transition)
        agent.learn(transition)
        if logged.truncated or transition.terminated:
            agent.begin_episode()
    agent.begin_episode()


def checked_length(agent: AnyAgent, log: Iterator[Logged]) -> int:
    """Count transitions after checking each; an error names the place in the log."""
    n = n_episodes = 0
    for place, transition, truncated in log:
        try:
            agent.check(with_action(agent, transition))
        except (TypeError, ValueError) as error:
            episode = "" if place.startswith("episode") else f"episode {n_episodes}, "
            raise type(error)(f"dataset, {episode}{place}: {error}") from error
        n += 1
        n_episodes += truncated or transition.terminated
    return n


def with_action(agent: AnyAgent, transition: Transition) -> Transition:
    """Return a transition whose action is an int if the log has it as a float or an array."""
    if not isinstance(agent.action_space, gym.spaces.Discrete) or type(transition.action) is int:
        return transition
    number = np.asarray(transition.action)
    is_whole = number.size == 1 and number.dtype.kind in "iuf" and float(number.item()).is_integer()
    return transition._replace(action=int(number.item())) if is_whole else transition
