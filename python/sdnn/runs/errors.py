"""The errors that a user can cause and correct."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from pathlib import Path

    from sdnn.runs.trial import TrialKey, TrialRecord


class RunError(Exception):
    """Base of errors that users can correct by the message alone, without a traceback."""


class ConfigError(RunError):
    """A run's configuration cannot be run.

    Parameters
    ----------
    key
        The setting, with dots between tables: ``"environment.noise"``.
    problem
        What was expected and what was given.
    place
        The file, and the line if it is known.
    """

    def __init__(self, key: str, problem: str, place: str = "") -> None:
        self.key = key
        self.problem = problem
        self.place = place
        super().__init__(": ".join(part for part in (place, key, problem) if part))

    def __reduce__(self) -> tuple[type[ConfigError], tuple[str, str, str]]:
        """Pickle the error by its parts, as exceptions come back from other processes."""
        return type(self), (self.key, self.problem, self.place)


class UnknownKeyError(ConfigError):
    """A table of settings has no such key."""


class RunTerminatedError(RunError):
    """SIGTERM was received; the run was saved after the present step."""


class StoreError(RunError):
    """The result file cannot be opened, read or written."""


class ChangedRowsError(StoreError):
    """The rows of a stored trial do not fit their checksum; ``record`` has them as they are."""

    def __init__(self, path: Path, key: TrialKey, record: TrialRecord) -> None:
        self.path = path
        self.key = key
        self.record = record
        super().__init__(f"{path} is damaged: the rows of {key} have changed")

    def __reduce__(self) -> tuple[type[ChangedRowsError], tuple[Path, TrialKey, TrialRecord]]:
        """Pickle the error by its parts."""
        return type(self), (self.path, self.key, self.record)


class PlotUnavailableError(RunError):
    """A figure or page needs a library that is not installed."""


class ClusterError(RunError):
    """A cluster cannot be reached, or has no worker that fits."""


class WorkerLostError(RunError):
    """A trial was given up after several workers were lost while running it."""
