"""The errors that a user can cause and mend."""

from __future__ import annotations

import shlex

__all__ = [
    "ClusterError",
    "ConfigError",
    "PlotUnavailableError",
    "RunError",
    "RunTerminatedError",
    "StoreError",
    "WorkerLostError",
    "command_line",
    "problem_of",
]


class RunError(Exception):
    """Base of the errors whose message alone tells a user what to mend."""


class ConfigError(RunError):
    """A run's configuration says something that cannot be run.

    Parameters
    ----------
    key
        Of what is wrong, with dots between tables: ``"environment.noise"``.
    problem
        What was expected and what came.
    place
        The file, and the line if it is known.
    """

    def __init__(self, key: str, problem: str, place: str = "") -> None:
        self.key = key
        self.problem = problem
        self.place = place
        super().__init__(": ".join(part for part in (place, key, problem) if part))

    def __reduce__(self) -> tuple[type[ConfigError], tuple[str, str, str]]:
        """Be pickled as it was made: exceptions come back from other processes so."""
        return type(self), (self.key, self.problem, self.place)


class RunTerminatedError(RunError):
    """SIGTERM came; the run was saved after the present step."""


class StoreError(RunError):
    """The result file cannot be opened, read or written."""


class PlotUnavailableError(RunError):
    """A figure or page needs a library that is not installed."""


class ClusterError(RunError):
    """A cluster was asked for, but it cannot be reached or has no worker that fits."""


class WorkerLostError(RunError):
    """A trial was given up because worker after worker was lost while running it."""


def problem_of(error: ValueError) -> str:
    """Give the message of a check in `sdnn.arguments` without the argument's name, its first word.

    >>> problem_of(ValueError("steps must be at least 1, got 0"))
    'must be at least 1, got 0'
    """
    return str(error).partition(" ")[2]


def command_line(*words: object) -> str:
    """Write a command as a shell takes it, whatever is in its words.

    >>> command_line("sdnn", "plot", "my runs/first")
    "sdnn plot 'my runs/first'"
    """
    return shlex.join(map(str, words))
