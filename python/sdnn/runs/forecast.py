"""Missing trials of experiments and their time: the output of ``--dry-run``."""

from __future__ import annotations

import time
from pathlib import Path

from sdnn.runs.engine import PlannedTrial
from sdnn.runs.errors import RunError
from sdnn.runs.store import STORE_NAME, ResultStore
from sdnn.runs.study import Study
from sdnn.runs.trial import TrialKey, opened
from sdnn.support.machine import n_cores

PROBE_SECONDS = 0.3  # processor time of a probe, about


def forecast(study: Study, out: Path, jobs: int) -> dict[str, object]:
    """Count what is to be run and estimate how long it takes, without making any file.

    Returns values that JSON can hold. Estimates from the start of a trial are too low where the
    task gets harder: later episodes are longer. A RunError says that a configuration is refused,
    that a trial that is begun to see how long it takes fails, or that the result file cannot be
    used.
    """
    stored: dict[TrialKey, float] = {}
    if (out / STORE_NAME).exists() or out.is_file():
        with ResultStore(out, read_only=True) as store:
            stored = store.seconds()
    study.check(stored)
    works: list[dict[str, object]] = []
    missing: dict[TrialKey, tuple[float, bool]] = {}  # variants that are the same share trials
    probes: dict[tuple[str, str, bool], tuple[float, int]] = {}
    for pair in study.pairs:
        keys, spec = study.keys(*pair), study.combinations[pair].spec
        left = [key for key in keys if key not in stored]
        times = [stored[key] for key in keys if key in stored]
        source = f"{len(times)} stored trial{'s' if len(times) > 1 else ''}"
        if not times:
            kind = (*keys[0][:2], spec.budget.steps is None)  # a rate is by the budget's unit
            if kind not in probes:
                probes[kind] = _probe(PlannedTrial(keys[0], spec))
            rate, n_episodes = probes[kind]
            times, source = [rate * spec.length], f"the first {n_episodes} episodes of one"
        seconds = sum(times) / len(times)
        missing |= dict.fromkeys(left, (seconds, spec.is_compiled))
        works.append(
            {
                "case": pair[0],
                "variant": pair[1],
                "agent": spec.label,
                "steps": spec.budget.steps,
                "episodes": spec.budget.episodes,
                "config_hash": spec.config_hash,
                "planned": len(keys),
                "stored": len(keys) - len(left),
                "seconds_of_a_trial": seconds,
                "source": source,
            }
        )
    n_planned = len(study.plan())
    return {
        "trials": works,
        "planned": n_planned,
        "stored": n_planned - len(missing),
        "jobs": jobs,
        "seconds": wall_seconds([*missing.values()], jobs),
        **study.other_work(out),
    }


def _probe(planned: PlannedTrial) -> tuple[float, int]:
    """Run the start of a trial: processor time by its budget's unit, and how many episodes."""
    spec = planned.spec
    try:
        with opened(spec.make_trial(planned.key.seed)) as trial:
            begin = time.thread_time()
            seconds = 0.0
            while seconds < PROBE_SECONDS and not trial.finished:
                trial.advance(spec.protocol.evaluate_every_episodes or 1)
                seconds = time.thread_time() - begin
            n_episodes = int(trial.episode)
            amount = n_episodes if spec.budget.steps is None else int(trial.n_decisions)
            return seconds / amount, n_episodes
    except Exception as error:  # whatever a trial raises
        raise RunError(f"{planned.title} fails: {type(error).__name__}: {error}") from error


def wall_seconds(trials: list[tuple[float, bool]], jobs: int) -> float:
    """Estimate the time that passes while trials run, from processor times and who is compiled.

    Those that are not share one core however many jobs there are, because they hold Python's lock;
    no more jobs than cores are any help.
    """
    times = [seconds for seconds, _ in trials]
    locked = sum(seconds for seconds, is_compiled in trials if not is_compiled)
    return max(sum(times) / max(1, min(jobs, n_cores())), max(times, default=0.0), locked)
