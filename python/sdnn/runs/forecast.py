"""Missing trials of experiments and their time: the output of ``--dry-run``."""

from __future__ import annotations

import time
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import Any

from sdnn.machine import n_cores
from sdnn.runs.engine import PlannedTrial
from sdnn.runs.errors import RunError
from sdnn.runs.spec import RunSpec
from sdnn.runs.store import STORE_NAME, ResultStore
from sdnn.runs.trial import TrialKey, TrialTime, opened

PROBE_SECONDS = 0.3  # processor time of a probe, about

Times = dict[tuple[str, str], tuple[str, list[TrialTime]]]
"""Times of trials by case and agent, and whether these are stored trials or a probe."""


def forecast(
    out: Path,
    groups: Mapping[tuple[str, str], Sequence[PlannedTrial]],
    jobs: int,
    check: Callable[[set[TrialKey]], None] = lambda stored: None,
) -> dict[str, Any]:
    """Count what is to be run and estimate how long it takes, without making any file.

    `groups` are trials of one specification each, by the ids of the case and of what runs in it;
    `check` receives what is stored in `out` before any trial is begun, and may raise. Returns
    values that JSON can hold. The ``upper`` seconds are null where the trials that they are from
    are shorter: later episodes are longer where the task gets harder. A RunError says that a trial
    that is begun to see how long it takes fails, or that the result file cannot be used.
    """
    stored: set[TrialKey] = set()
    times: Times = {}
    if (out / STORE_NAME).exists() or out.is_file():
        with ResultStore(out, read_only=True) as store:
            stored = store.keys()
            for one in store.times():
                if one.n_episodes:
                    times.setdefault(one.key[:2], ("stored trial", []))[1].append(one)
    check(stored)
    works: list[dict[str, Any]] = []
    planned: set[TrialKey] = set()
    missing: dict[TrialKey, tuple[float, bool]] = {}  # variants that are the same share trials
    for (case, variant), group in groups.items():
        keys, spec = [one.key for one in group], group[0].spec
        left = [key for key in keys if key not in stored]
        estimate = trial_seconds(keys[0], spec, times) if left else None
        if estimate:
            missing |= dict.fromkeys(left, (estimate["lower"], spec.is_compiled))
        planned.update(keys)
        works.append(
            {
                "case": case,
                "variant": variant,
                "agent": spec.label,
                "steps": spec.budget.steps,
                "episodes": spec.budget.episodes,
                "config_hash": spec.config_hash,
                "planned": len(keys),
                "stored": len(keys) - len(left),
                "seconds_of_a_trial": estimate,
            }
        )
    lower = wall_seconds([*missing.values()], jobs)
    estimates = [one["seconds_of_a_trial"] for one in works if one["seconds_of_a_trial"]]
    upper = None if any(one["upper"] is None for one in estimates) else lower
    return {
        "trials": works,
        "planned": len(planned),
        "stored": len(planned) - len(missing),
        "jobs": jobs,
        "seconds": {"lower": lower, "upper": upper},
    }


def trial_seconds(key: TrialKey, spec: RunSpec, times: Times) -> dict[str, Any]:
    """Estimate the processor time of a trial from trials of its configuration, else of its agent.

    If there are none of its case and agent, a trial is begun, and added to `times`.
    """
    if key[:2] not in times:
        times[key[:2]] = "probe", [_probe(key, spec)]
    kind, alike = times[key[:2]]
    same = [one for one in alike if one.key.config_hash == key.config_hash]
    found = same or alike
    source = f"{len(found)} {kind}{'s' if len(found) > 1 else ''}"
    source += f" of this {'configuration' if same else 'case and agent'}"
    amount = sum(t.n_episodes if spec.budget.steps is None else t.n_decisions for t in found)
    every = spec.protocol.evaluate_every_episodes or 1
    shortest = min(one.n_episodes for one in found)
    seconds = sum(one.seconds for one in found) / amount * spec.length
    if shortest >= (spec.budget.episodes or 0) // every * every:
        return {"lower": seconds, "upper": seconds, "source": source}
    source += f": as in the first {shortest} episodes"
    return {"lower": seconds, "upper": None, "source": source}


def _probe(key: TrialKey, spec: RunSpec) -> TrialTime:
    """Run the start of a trial."""
    try:
        with opened(spec.make_trial(key.seed)) as trial:
            begin = time.thread_time()
            seconds = 0.0
            while seconds < PROBE_SECONDS and not trial.finished:
                trial.advance(spec.protocol.evaluate_every_episodes or 1)
                seconds = time.thread_time() - begin
            n_episodes, n_decisions = int(trial.episode), int(trial.n_decisions)
    except Exception as error:  # whatever a trial raises
        raise RunError(
            f"{PlannedTrial(key, spec).title} fails: {type(error).__name__}: {error}"
        ) from error
    return TrialTime(key=key, seconds=seconds, n_episodes=n_episodes, n_decisions=n_decisions)


def wall_seconds(trials: list[tuple[float, bool]], jobs: int) -> float:
    """Estimate the time that passes while trials run, from processor times and who is compiled.

    Those that are not share one core however many jobs there are, because they hold Python's lock;
    no more jobs than cores are any help.
    """
    times = [seconds for seconds, _ in trials]
    locked = sum(seconds for seconds, is_compiled in trials if not is_compiled)
    return max(sum(times) / max(1, min(jobs, n_cores())), max(times, default=0.0), locked)
