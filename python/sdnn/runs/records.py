"""What is measured, as data: finished trials and costs, with their keys.

Nothing here knows how a trial is run, how a time is taken, or where records are kept.
"""

from __future__ import annotations

import hashlib
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

ROW_HEADER = (
    "case", "agent", "trial", "seed", "config_hash", "version", "episode", "steps",
    "episode_return", "solved",
)  # fmt: skip
"""Columns of the file of all test episodes."""

COST_ROW_HEADER = (
    "series", "n_inputs", "round", "microseconds", "n_steps", "table_bytes", "version", "machine"
)  # fmt: skip
"""Columns of the file of all rounds of cost measurements."""


class TrialKey(NamedTuple):
    """What makes two trials the same: stored once, never run again."""

    case_id: str
    agent: str
    trial: int
    seed: int
    config_hash: str


@dataclass(frozen=True, kw_only=True)
class TrialRows:
    """Test episodes of a trial, in order.

    Parameters
    ----------
    episode : (n_tests,) int32
        Learning episodes done before the test.
    steps : (n_tests,) int32
        Decisions until the goal; the limit where it was not reached.
    episode_return : (n_tests,) float64
        Sum of rewards.
    solved : (n_tests,) bool
        Whether the goal was reached.
    """

    episode: NDArray[np.int32]
    steps: NDArray[np.int32]
    episode_return: NDArray[np.float64]
    solved: NDArray[np.bool_]

    @classmethod
    def from_arrays(cls, arrays: dict[str, NDArray[Any]]) -> TrialRows:
        """Copy the columns out of a dictionary of arrays, each (n_tests,).

        Raises
        ------
        ValueError
            If the columns are not of one length.
        """
        rows = cls(
            episode=np.array(arrays["episode"], np.int32),
            steps=np.array(arrays["steps"], np.int32),
            episode_return=np.array(arrays["episode_return"], np.float64),
            solved=np.array(arrays["solved"], np.bool_),
        )
        shapes = {c.shape for c in (rows.episode, rows.steps, rows.episode_return, rows.solved)}
        if shapes != {(rows.episode.size,)}:
            raise ValueError(f"test rows must be columns of one length, got shapes {shapes}")
        return rows

    def digest(self) -> str:
        """SHA-256 of the values, independent of the machine's byte order."""
        sha = hashlib.sha256()
        sha.update(self.episode.astype("<i4").tobytes())
        sha.update(self.steps.astype("<i4").tobytes())
        sha.update(self.episode_return.astype("<f8").tobytes())
        sha.update(self.solved.astype("u1").tobytes())
        return sha.hexdigest()


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
        Its test episodes.
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

    It covers keys, configurations, decisions and rows, sorted by key; it leaves out times and the
    version, so runs with other jobs, interruptions or order agree.
    """
    sha = hashlib.sha256()
    for record in sorted(records, key=lambda r: r.key):
        fields = (*record.key, record.config, record.n_decisions, record.rows.digest())
        sha.update(repr(fields).encode())
    return sha.hexdigest()


def trial_rows(records: Iterable[TrialRecord]) -> Iterator[tuple[object, ...]]:
    """All test episodes of trials, each once, under `ROW_HEADER`."""
    for record in records:
        key, rows = record.key, record.rows
        start = (key.case_id, key.agent, key.trial, key.seed, key.config_hash, record.version)
        columns = (rows.episode, rows.steps, rows.episode_return, rows.solved.astype(int))
        for row in zip(*(column.tolist() for column in columns), strict=True):
            yield (*start, *row)


class CostKey(NamedTuple):
    """What makes two measurements the same: stored once, not measured again."""

    series: str
    n_inputs: int
    config_hash: str


@dataclass(frozen=True, kw_only=True)
class StepTimes:
    """Measured times of an agent's steps.

    Parameters
    ----------
    microseconds : (n_rounds,)
        Median time of a step in each round.
    n_steps
        Steps in a round.
    table_bytes
        Memory of what the agent learns.
    """

    microseconds: NDArray[np.float64]
    n_steps: int
    table_bytes: int


@dataclass(frozen=True, kw_only=True)
class CostRecord:
    """The cost of a series at one number of inputs.

    Parameters
    ----------
    key
        Which measurement it is.
    version
        Version of the library.
    machine
        Processor and instruction set.
    finished_at
        Time of the end, ISO 8601, UTC.
    times
        What was measured.
    """

    key: CostKey
    version: str
    machine: str
    finished_at: str
    times: StepTimes

    @property
    def microseconds(self) -> NDArray[np.float64]:
        """Median time of a step in each round, (n_rounds,)."""
        return self.times.microseconds

    def to_json(self) -> dict[str, Any]:
        """Return it as values that JSON can hold."""
        return {
            "series": self.key.series,
            "n_inputs": self.key.n_inputs,
            "microseconds": self.microseconds.tolist(),
            "n_steps": self.times.n_steps,
            "table_bytes": self.times.table_bytes,
            "machine": self.machine,
            "version": self.version,
        }


def round_rows(costs: Iterable[CostRecord]) -> Iterator[tuple[object, ...]]:
    """All rounds of cost measurements under `COST_ROW_HEADER`."""
    for cost in costs:
        end = (cost.times.n_steps, cost.times.table_bytes, cost.version, cost.machine)
        for number, microseconds in enumerate(cost.microseconds.tolist()):
            yield (cost.key.series, cost.key.n_inputs, number, microseconds, *end)
