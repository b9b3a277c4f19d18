"""The functions that Dask workers call: compare a build with the driver's, and run a trial.

A worker that cannot unpickle a task falls silent instead of reporting an error. So trials are sent
as bytes and unpickled inside the task: a missing module is then an error like any other.
"""

from __future__ import annotations

import pickle
import time

from sdnn import _core
from sdnn.runs.engine import PlannedTrial, run_to_end
from sdnn.runs.errors import ClusterError
from sdnn.runs.trial import TrialRecord, TrialRows, opened

PROBE_EPISODES = 10
"""Learning episodes of a probe: few, but they use every part of the agent and the task."""

PROBE_CALL = f"__import__({__name__!r}, fromlist=['probe']).probe_all(trials)"
"""An expression for `eval`, which workers without this library have, too."""

PROGRESS_TOPIC = "sdnn-progress"
PROGRESS_SECONDS = 2.0
"""Least time between two reports of a trial's progress."""


def probe(planned: PlannedTrial) -> str:
    """Return version, settings and first rows of a trial: equal where all its rows are equal.

    A trial in Python is only made: it may be long, and its libraries may round differently.
    """
    with opened(planned.spec.make_trial(planned.key.seed)) as trial:
        digest = ""
        if planned.spec.is_compiled:
            trial.advance(PROBE_EPISODES)
            digest = TrialRows.of_tests(**trial.test_rows()).digest()
    return f"sdnn {_core.__version__}, {planned.spec.canonical_json()}, {digest}"


def probe_all(trials: list[bytes]) -> tuple[str, list[str] | str]:
    """Return the version of this build, and the results of the probes or what one raised."""
    try:
        return _core.__version__, [probe(pickle.loads(trial)) for trial in trials]
    except Exception as error:
        return _core.__version__, f"{type(error).__name__}: {error}"


def run_on_worker(version: str, settings: str, trial: bytes) -> TrialRecord | None:
    """Run a trial; None if it was cancelled.

    Raises
    ------
    ClusterError
        If this worker's version, or the settings it reads, are not the driver's.
    """
    from distributed import get_worker

    worker = get_worker()
    planned: PlannedTrial = pickle.loads(trial)
    if (_core.__version__, planned.spec.canonical_json()) != (version, settings):
        raise ClusterError(
            f"worker {worker.address} (sdnn {_core.__version__}) does not read the settings of"
            f" this trial as the driver (sdnn {version}) does; install the same build on both"
        )
    key = worker.get_current_task()
    reported = time.monotonic()

    def wanted() -> bool:
        task = worker.state.tasks.get(key)
        return task is not None and task.state == "executing"

    def advanced(episode: int) -> None:
        nonlocal reported
        if time.monotonic() - reported >= PROGRESS_SECONDS:
            reported = time.monotonic()
            worker.log_event(PROGRESS_TOPIC, (key, episode))

    return run_to_end(planned, wanted=wanted, advanced=advanced)
