"""A finished trial as data: its key, its rows, and what goes with them."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray


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


def records_digest(records: Iterable[TrialRecord]) -> str:
    """SHA-256 of records as `ResultStore.content_digest` defines it."""
    sha = hashlib.sha256()
    for record in sorted(records, key=lambda r: r.key):
        fields = (*record.key, record.config, record.n_decisions, record.rows.digest())
        sha.update(repr(fields).encode())
    return sha.hexdigest()
