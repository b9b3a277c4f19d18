"""The errors a user of the experiments can cause and mend."""

from __future__ import annotations

from sdnn.runs.errors import RunError


class ExperimentError(RunError):
    """Base of the errors whose message alone tells a user what to mend."""


class StoreError(ExperimentError):
    """The result file cannot be opened, read or written."""


class PlotUnavailableError(ExperimentError):
    """A figure or page needs a library that is not installed."""


class ClusterError(ExperimentError):
    """A cluster was asked for, but it cannot be reached or has no worker that fits."""


class WorkerLostError(ExperimentError):
    """A trial was given up because worker after worker was lost while running it."""


class StudyError(ExperimentError):
    """A study file says something that cannot be run."""
