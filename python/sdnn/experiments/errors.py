"""The errors a user of the experiments can cause and mend."""

from __future__ import annotations


class ExperimentError(Exception):
    """Base of the errors whose message alone tells a user what to mend."""


class StoreError(ExperimentError):
    """The result file cannot be opened, read or written."""


class PlotUnavailableError(ExperimentError):
    """Figures were asked for, but matplotlib is not installed."""


class StudyError(ExperimentError):
    """A study file says something that cannot be run."""
