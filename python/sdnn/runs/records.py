"""The rows of runs as data, with their keys.

Nothing here knows how a trial is run, or where records are kept.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn.agents.callbacks import Row
from sdnn.agents.evaluation import Evaluation

ROW_HEADER = (
    "case", "agent", "trial", "seed", "config_hash", "version", "episode", "steps",
    "episode_return", "solved",
)  # fmt: skip
"""Columns of the file of all test episodes."""


class TrialKey(NamedTuple):
    """What makes two trials the same: stored once, never run again."""

    case_id: str
    agent: str
    trial: int
    seed: int
    config_hash: str


ROW = np.dtype(
    [
        ("number", "i8"),
        ("part", "i8"),
        ("kind", "U10"),
        ("episode", "i8"),
        ("step", "i8"),
        ("length", "i8"),
        ("return", "f8"),
        ("terminated", "?"),
        ("environment", "i8"),
    ]
)
"""A row of any run: an episode that was learned from, or one of an evaluation.

``number`` counts episodes and evaluations, ``part`` the episodes of an evaluation. ``kind`` is
``"episode"`` or ``"evaluation"``. ``episode`` is the number of a learning episode, from 0, or how
many were learned before an evaluation; ``step`` how many steps were learned by then, or `UNKNOWN`,
as in compiled trials; ``terminated`` whether the episode ended in a terminal state: the task was
solved. ``environment`` is `UNKNOWN` where there is one only.
"""

UNKNOWN = -1


@dataclass(frozen=True, eq=False)
class TrialRows:
    """The rows of a run, and its evaluations as columns.

    An evaluation of one episode is a test episode of the paper. Columns of larger ones are means.

    Parameters
    ----------
    table : (n,) ROW
        All rows, in order.
    """

    table: NDArray[np.void]

    @classmethod
    def of_tests(
        cls, episode: ArrayLike, steps: ArrayLike, episode_return: ArrayLike, solved: ArrayLike
    ) -> TrialRows:
        """Make it of the columns of test episodes, each (n_tests,), as a compiled trial gives them.

        Raises
        ------
        ValueError
            If the columns are not of one length.
        """
        columns = {
            "episode": np.asarray(episode),
            "length": np.asarray(steps),
            "return": np.asarray(episode_return),
            "terminated": np.asarray(solved),
        }
        shapes = {column.shape for column in columns.values()}
        if shapes != {(columns["episode"].size,)}:
            raise ValueError(f"test rows must be columns of one length, got shapes {shapes}")
        table = np.zeros(columns["episode"].size, ROW)
        table["number"], table["kind"] = np.arange(table.size), "evaluation"
        table["step"] = table["environment"] = UNKNOWN
        for name, column in columns.items():
            table[name] = column
        return cls(table)

    @classmethod
    def from_training(cls, rows: Sequence[Row], first: int = 0) -> TrialRows:
        """Make it of rows of a `sdnn.agents.Training`, the first of which has this number."""
        listed: list[tuple[Any, ...]] = []
        for number, row in enumerate(rows, first):
            start = (row["kind"], row["episode"], row["step"])
            if row["kind"] == "episode":
                end = row["length"], row["return"], row["terminated"]
                listed.append((number, 0, *start, *end, row.get("environment", UNKNOWN)))
            else:
                parts = zip(row["lengths"], row["returns"], row["terminated"], strict=True)
                listed += [(number, k, *start, *end, UNKNOWN) for k, end in enumerate(parts)]
        return cls(np.array(listed, ROW))

    def to_training(self) -> list[Row]:
        """Return what `from_training` was given."""
        rows: list[Row] = []
        starts = np.flatnonzero(self.table["part"] == 0)
        for own in np.split(self.table, starts[1:]) if len(starts) else []:
            first = own[0]
            row: dict[str, Any] = {
                "kind": str(first["kind"]), "step": int(first["step"]),
                "episode": int(first["episode"]),
            }  # fmt: skip
            if row["kind"] == "episode":
                if first["environment"] != UNKNOWN:
                    row["environment"] = int(first["environment"])
                row["return"] = float(first["return"])
                row["length"] = int(first["length"])
                row["terminated"] = bool(first["terminated"])
            else:
                found = Evaluation(
                    returns=own["return"].copy(),
                    lengths=own["length"].copy(),
                    terminated=own["terminated"].copy(),
                )
                row |= found.row()
            rows.append(row)
        return rows

    @cached_property
    def _tests(self) -> tuple[NDArray[np.void], NDArray[np.int64]]:
        """The rows of evaluations, and where each begins."""
        tests = self.table[self.table["kind"] == "evaluation"]
        return tests, np.flatnonzero(tests["part"] == 0)

    def _column(self, name: str, kind: type[Any]) -> NDArray[Any]:
        tests, starts = self._tests
        if len(starts) == len(tests):
            return tests[name].astype(kind)
        sums = np.add.reduceat(tests[name].astype(np.float64), starts)
        means: NDArray[Any] = sums / np.diff([*starts, len(tests)])
        return means

    @cached_property
    def episode(self) -> NDArray[Any]:
        """Learning episodes done before each evaluation, (n_tests,) int32."""
        tests, starts = self._tests
        return tests["episode"][starts].astype(np.int32)

    @cached_property
    def steps(self) -> NDArray[Any]:
        """Decisions until the goal, or the limit where it was not reached, (n_tests,) int32."""
        return self._column("length", np.int32)

    @cached_property
    def episode_return(self) -> NDArray[Any]:
        """Sum of rewards, (n_tests,) float64."""
        return self._column("return", np.float64)

    @cached_property
    def solved(self) -> NDArray[Any]:
        """Whether the goal was reached, (n_tests,) bool; of larger evaluations the share."""
        return self._column("terminated", np.bool_)

    @property
    def n_evaluated(self) -> int:
        """Decisions in evaluations."""
        return int(self._tests[0]["length"].sum())

    def digest(self) -> str:
        """SHA-256 of the test episodes, independent of the machine's byte order."""
        tests, _ = self._tests
        sha = hashlib.sha256()
        for name, kind in zip(("episode", "length", "return", "terminated"), _BYTES, strict=True):
            sha.update(tests[name].astype(kind).tobytes())
        return sha.hexdigest()

    def checksum(self) -> str:
        """SHA-256 of all rows."""
        return hashlib.sha256(repr(self.table.tolist()).encode()).hexdigest()


_BYTES = ("<i4", "<i4", "<f8", "u1")


@dataclass(frozen=True, kw_only=True)
class TrialRecord:
    """A finished trial.

    Parameters
    ----------
    key
        Which trial it is.
    config
        Canonical JSON of its configuration.
    version
        Version of the library that ran it.
    n_decisions
        Decisions in learning and test episodes.
    seconds
        Processor time of the trial.
    finished_at
        Time of the end, ISO 8601, UTC.
    rows
        Its rows; of a run in progress that is finished by this record, those not yet stored.
    """

    key: TrialKey
    config: str
    version: str
    n_decisions: int
    seconds: float
    finished_at: str
    rows: TrialRows


@dataclass(frozen=True, kw_only=True)
class TrialTime:
    """How long a finished trial took.

    Parameters
    ----------
    key
        Which trial it is.
    seconds
        Its processor time.
    n_episodes
        Learning episodes before its last test.
    n_decisions
        Decisions in learning and test episodes.
    """

    key: TrialKey
    seconds: float
    n_episodes: int
    n_decisions: int


def records_digest(records: Iterable[TrialRecord]) -> str:
    """SHA-256 of the results of trials, to compare runs.

    It covers cases, trials, seeds, decisions and rows, in the order of the keys. It leaves out
    names, settings, times and the version, so runs with other jobs, interruptions or order agree.
    """
    sha = hashlib.sha256()
    for record in sorted(records, key=lambda r: r.key):
        key = record.key
        told = (key.case_id, key.trial, key.seed, record.n_decisions, record.rows.digest())
        sha.update(repr(told).encode())
    return sha.hexdigest()


def trial_rows(records: Iterable[TrialRecord]) -> Iterator[tuple[object, ...]]:
    """All test episodes of trials, each once, under `ROW_HEADER`."""
    for record in records:
        key, rows = record.key, record.rows
        start = (key.case_id, key.agent, key.trial, key.seed, key.config_hash, record.version)
        columns = (rows.episode, rows.steps, rows.episode_return, rows.solved.astype(int))
        for row in zip(*(column.tolist() for column in columns), strict=True):
            yield (*start, *row)
