"""Reading logged transitions, in any of the forms in which people have them."""

from __future__ import annotations

import csv
import io
import json
import re
from collections.abc import Callable, Iterable, Iterator, Mapping
from functools import cache
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from sdnn.environments.types import Data, Info
from sdnn.support.arguments import argument_error, array_of, duration_of, path_of, require, shown
from sdnn.support.files import open_regular
from sdnn.support.habits import advice
from sdnn.training.interfaces import Transition

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
"""Names of columns that logs have beside transitions."""
_NUMBERED = re.compile(r"(.+?)[_.\[](\d+)\]?")
"""Name and number of a column, such as ``observation_0``, ``observation.0``, ``observation[0]``."""
_REQUIRED = ("observations", "actions", "rewards")
_ITEMS_OF_TUPLE = (
    "observations", "actions", "rewards", "next_observations", "terminations", "truncations"
)  # fmt: skip
"""The columns in the order of a transition's tuple."""


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
        is_table = path.suffix.lower() == ".csv"
        lines = _table_lines if is_table else _json_lines
        return lambda: _with_next_observations(lines(path))
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


def _json_lines(path: Path) -> Iterator[tuple[str, Data]]:
    """Yield the rows of a JSON Lines file; errors name the line."""
    for number, line in _numbered_lines(path):
        try:
            values = json.loads(line)
        except (ValueError, RecursionError) as error:
            problem = f"must be a JSON object, got {shown(line[:40])}"
            raise ValueError(f"dataset, line {number}: {problem}") from error
        require(isinstance(values, dict), f"dataset, line {number}", "be a JSON object", values)
        place = f"line {number}"
        row = _row_of(values, place)
        for name in {"observations", "next_observations"} & row.keys():
            row[name] = _with_nan(row[name])
        yield place, row


def _with_nan(value: Any) -> Any:
    """Replace null by NaN, a missing reading, in the lists and objects of an observation."""
    if isinstance(value, dict):
        return {name: _with_nan(part) for name, part in value.items()}
    if isinstance(value, list):
        return [np.nan if part is None else _with_nan(part) for part in value]
    return value


def _table_lines(path: Path) -> Iterator[tuple[str, Data]]:
    """Read a file of comma-separated values, whose first line has the names."""
    names: list[str] = []
    for number, line in _numbered_lines(path):
        try:
            cells = next(csv.reader(io.StringIO(line.decode("utf-8" if names else "utf-8-sig"))))
        except (UnicodeDecodeError, csv.Error) as error:
            raise ValueError(f"dataset, line {number}: must be text, got {shown(line)}") from error
        if not names:
            names, where = [cell.strip() for cell in cells], f"dataset, line {number}"
            require(len({*names}) == len(names), where, "have different names of columns", names)
            _columns_of({name: [0.0] for name in names}, where)  # refuses unknown names
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

    A missing next observation is the observation of the next row. The last step of a truncated
    episode has none, and is left out, unless the rows are those of an episode (`is_episode`), in
    which a last row has the observation alone.
    """
    pending: tuple[Data, str] | None = None  # the row before, which lacks it, and its place
    for place, row in rows:
        if pending is not None:
            pending[0]["next_observations"] = row["observations"]
            yield _logged(*pending)
            pending = None
        if "rewards" not in row:  # the row of the observation after the last step
            continue
        if "next_observations" in row:
            yield _logged(row, place)
            continue
        is_terminated, is_truncated = _flags_of(row, place)
        if is_episode or not (is_terminated or is_truncated):
            pending = row, place
        elif is_terminated:
            row["next_observations"] = row["observations"]  # any: no value follows
            yield _logged(row, place)


def _parse_cell(text: str) -> Any:
    """Return the bool or number in a cell of a CSV file, or its text; NaN for an empty one."""
    word = text.strip() or "nan"
    if word.lower() in ("true", "false"):
        return word.lower() == "true"
    try:
        return float(word)
    except ValueError:
        return word


def _numbered_lines(path: Path) -> Iterator[tuple[int, bytes]]:
    """Yield each line that is not blank with its number, from 1.

    ValueError for a line above `_MOST_BYTES`.
    """
    with open_regular(path, 2**62) as file:
        number = 0
        while line := file.readline(_MOST_BYTES + 1):
            number += 1
            if len(line) > _MOST_BYTES:
                raise ValueError(f"dataset, line {number}: must be of at most {_MOST_BYTES} bytes")
            if line.strip():
                yield number, line


def _transitions_of_items(items: Iterable[Any]) -> Iterator[Logged]:
    """Read items of an iterable, each of which is a transition or an episode."""
    for number, item in enumerate(items):
        if isinstance(item, Transition):
            yield Logged(f"transition {number}", item, False)
        elif isinstance(item, tuple | list) and len(item) in (5, 6):
            yield _logged(dict(zip(_ITEMS_OF_TUPLE, item, strict=False)), f"transition {number}")
        else:
            values = _columns_in(item)
            if values is None:
                expected = "be a Transition, a mapping, or an episode with observations"
                raise argument_error(f"dataset, transition {number}",
                                     f"must {expected}, got {shown(item)}", TypeError)  # fmt: skip
            if np.ndim(_value(values, "rewards", ())) == 0:
                place = f"transition {number}"
                row = _row_of(values, place)
                has_next = "next_observations" in row
                require(has_next, f"dataset, {place}", "have next_observations", [*values])
                yield _logged(row, place)
            else:
                columns = _columns_of(values, f"dataset, episode {number}", is_episode=True)
                rows = _rows(columns, f"episode {number}, step", is_episode=True)
                yield from _with_next_observations(rows, is_episode=True)


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


def _row_of(values: Info, place: str) -> Data:
    """Return the columns of a mapping of one transition by their usual names."""
    row = {}
    for name, value in values.items():
        if _IGNORED.match(name):
            continue
        column = _columns_by_name().get(name)
        require(column, f"dataset, {place}", f"have no {name!r}: {advice(name, NAMES)}", [*values])
        require(column not in row, f"dataset, {place}", f"have {column} once", [*values])
        row[str(column)] = value
    missing = [name for name in _REQUIRED if name not in row]
    require(not missing, f"dataset, {place}", f"have {', '.join(missing)}", [*values])
    return row


def _logged(row: Info, place: str) -> Logged:
    """Return the transition of a row of columns; ``place`` names the row in errors."""
    terminated, truncated = _flags_of(row, place)
    try:
        dt = duration_of(row.get("dts", 1.0))
    except ValueError as error:
        raise ValueError(f"dataset, {place}: {error}") from error
    observation, action, reward, next_observation = (row[name] for name in _ITEMS_OF_TUPLE[:4])
    is_end = terminated and not truncated  # `dones` of other libraries count time limits as ends
    mask = row.get("next_masks")
    transition = Transition(observation, action, reward, next_observation, is_end, mask, dt)
    return Logged(place, transition, truncated)


def _flags_of(row: Info, place: str) -> tuple[bool, bool]:
    """Return whether an episode is terminated, and whether it is truncated, after a row."""
    try:
        terminated = _flag("terminated", row.get("terminations", False))
        return terminated, _flag("truncated", row.get("truncations", False))
    except ValueError as error:
        raise ValueError(f"dataset, {place}: {error}") from error


def _flag(name: str, value: Any) -> bool:
    """Read True or False of any library, or 1 or 0."""
    number = np.asarray(value)
    is_flag = number.size == 1 and number.dtype.kind in "biuf" and number.item() in (0, 1)
    require(is_flag, name, "be True or False, or 1 or 0", value)
    return bool(number.item())


def _columns_of(values: Info, where: str = "dataset", *, is_episode: bool = False) -> Data:
    """Return arrays of n rows by their usual names; ``observations`` may have n + 1 rows.

    Those of an episode (`is_episode`) must have n + 1, unless there are ``next_observations``.
    Columns such as ``observation_0`` are put together. Memory-mapped arrays stay on disk. ``where``
    is the place for errors.
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
    missing = [name for name in _REQUIRED if name not in columns]
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
    """Yield the rows of arrays with their places, such as "row 3" (`place` is "row").

    Where there is an observation more than rewards, the last row has only that. The last step of an
    episode (`is_episode`) is truncated, unless it terminates.
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
