"""What a Dask worker is asked to do: prove that it computes the same, and run trials.

A worker that cannot unpickle a task falls silent instead of reporting an error. So trials come as
bytes and are unpickled by the task itself; then an agent that the worker cannot import, or a
missing library, is an error like any other.
"""

from __future__ import annotations

import pickle
import time

from sdnn import _core
from sdnn.runs.errors import RunError
from sdnn.runs.executor import run_to_end
from sdnn.runs.planned_trial import PlannedTrial
from sdnn.runs.records import TrialRecord, TrialRows
from sdnn.runs.trial import opened

PROBE_EPISODES = 10
"""Learning episodes of a probe: few, but every part of agent and task takes part."""

PROBE_WORKER = f"__import__('importlib').import_module({__name__!r}).probe_worker(*arguments)"
"""To be evaluated where the library may be missing, with `arguments` for `probe_worker`."""


def probe(planned: PlannedTrial) -> str:
    """Run the beginning of a trial and return what must be the same on every machine.

    A trial in C++ gives the same bits everywhere, so its settings and first rows are returned. One
    in Python may be long and owes nobody the same bits: it is only made.

    Raises
    ------
    Exception
        Whatever the trial raises; an agent that is not registered is a ValueError.
    """
    with opened(planned.spec.make_trial(planned.key.seed)) as trial:
        if not planned.spec.is_compiled:
            return planned.spec.canonical_json()
        trial.advance(PROBE_EPISODES)
    rows = TrialRows.of_tests(**trial.test_rows())
    return f"{planned.spec.canonical_json()} {trial.n_decisions} {rows.digest()}"


def probe_worker(version: str, pickled: list[bytes]) -> tuple[str, list[str]]:
    """Return the worker's version and, if it is the asked one, what its probes give.

    Parameters
    ----------
    version
        The driver's version.
    pickled
        The trials to probe, one by one.
    """
    own: str = _core.__version__
    if own != version:
        return own, []
    return own, [probe(pickle.loads(one)) for one in pickled]


class MismatchError(RunError):
    """A worker has another version, or reads other settings out of a trial."""


def run_on_worker(
    version: str, settings: str, pickled: bytes, topic: str, attempt: int, progress_seconds: float
) -> TrialRecord | None:
    """Run one trial; there is no record if it is not wanted any more.

    Parameters
    ----------
    version
        The driver's version.
    settings
        The trial's settings as the driver writes them.
    pickled
        The trial.
    topic
        Topic of the events that tell its progress.
    attempt
        Number that the events carry.
    progress_seconds
        Least time between two of them.

    Raises
    ------
    MismatchError
        If version or settings are not the driver's: a build that lacks a setting would ignore it.

    Notes
    -----
    The GIL is free while a trial in C++ advances, so the worker's heartbeat goes on.
    """
    from distributed import get_worker

    if _core.__version__ != version:
        raise MismatchError(f"it has sdnn {_core.__version__}, this is sdnn {version}")
    planned: PlannedTrial = pickle.loads(pickled)
    if planned.spec.canonical_json() != settings:
        raise MismatchError(
            f"its build of sdnn {version} does not know all settings of agent {planned.key.agent}"
        )
    worker = get_worker()
    key = worker.get_current_task()
    reported = time.monotonic()

    def wanted() -> bool:
        # A task whose driver gave it up, or is gone, is no longer "executing".
        task = worker.state.tasks.get(key)
        return task is not None and task.state == "executing"

    def advanced(episode: int) -> None:
        nonlocal reported
        now = time.monotonic()
        if now - reported >= progress_seconds:
            reported = now
            worker.log_event(topic, {"attempt": attempt, "episode": episode})

    return run_to_end(planned, wanted=wanted, advanced=advanced)
