"""Run reported trials again, and compare them bit by bit."""

from __future__ import annotations

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray

import sdnn.runs.engine as engine
from sdnn._core import __version__
from sdnn.runs.errors import ConfigError, RunError
from sdnn.runs.reported import Consent, ReportedTrial, Reports
from sdnn.runs.run import Goal
from sdnn.runs.trial import (
    ROW,
    UNKNOWN,
    TrainingTrial,
    TrialKey,
    TrialRecord,
    TrialRows,
    records_digest,
)
from sdnn.support.machine import instruction_set
from sdnn.training.training import Callback, Training

DEFAULT_TRIALS = 10


class _NewGoals(Callback):
    """Gives a training each new goal of its run at the step at which the run was resumed."""

    def __init__(self, goals: Sequence[Goal]) -> None:
        self._goals = {goal.at_step: goal for goal in goals}
        self.step_interval = max(1, math.gcd(*self._goals))

    def on_start(self, training: Training) -> None:
        """Set a goal that was given before the first step."""
        self.on_step(training)

    def on_step(self, training: Training) -> None:
        """Set the goal of this step, if there is one."""
        if goal := self._goals.get(training.n_steps):
            training.steps, training.episodes = goal.steps, goal.episodes


@dataclass(frozen=True)
class ResumedTrial(engine.PlannedTrial):
    """A training whose goal was changed by `sdnn resume`."""

    goals: tuple[Goal, ...] = ()

    def make(self) -> TrainingTrial:
        """Make the training with the run's new goals, the first of which replaced any target."""
        budget = self.spec.budget.replace(target_return=None)
        spec = self.spec.replace(seed=self.key.seed, budget=budget)
        return spec.make_training([_NewGoals(self.goals)])


@dataclass(frozen=True)
class Difference:
    """A reported trial that is not equal here: ``problem`` in a line, ``details`` in more.

    ``was_run`` is whether the trial could be run here.
    """

    key: TrialKey
    problem: str
    details: tuple[str, ...] = ()
    was_run: bool = True


@dataclass(frozen=True, kw_only=True)
class Verification:
    """The result of `verify`.

    ``equal`` are the trials that are equal, with their records here; ``n_chosen`` of
    ``n_reported`` trials were to be run again. ``signal`` is what interrupted them, if anything.
    """

    title: str
    n_reported: int
    n_chosen: int
    n_unfinished: int
    has_rows: bool
    equal: tuple[tuple[ReportedTrial, TrialRecord], ...]
    differences: tuple[Difference, ...]
    signal: int | None = None
    instruction_set: str = field(default_factory=instruction_set)

    @property
    def digest(self) -> str:
        """The digest of the rows of the equal trials, as reports print it."""
        return records_digest(record for _, record in self.equal)

    @property
    def is_equal(self) -> bool:
        """Whether all chosen trials are equal."""
        return len(self.equal) == self.n_chosen and not self.differences

    def __str__(self) -> str:
        """Return the outcome as the line that ``sdnn verify`` prints."""
        is_portable = self.instruction_set == "portable"  # the others are names such as AVX2
        name = self.instruction_set if is_portable else self.instruction_set.upper()
        n_different = sum(difference.was_run for difference in self.differences)
        n_failed = len(self.differences) - n_different
        noun = "trial" if self.n_reported == 1 else "trials"
        n_run = len(self.equal) + n_different
        parts = []
        if n_different:
            parts.append(f"{n_different} differ{'s' if n_different == 1 else ''}")
        if self.equal and n_different:
            parts.append(f"{len(self.equal)} equal")
        elif self.equal:
            parts.append(f"all {'rows' if self.has_rows else 'digests'} equal")
        if n_failed:
            parts.append(f"{n_failed} could not be run")
        start = f"{n_run} of {self.n_reported} {noun} recomputed here on {name}"
        return f"{start}: {', '.join(parts) or 'nothing is compared'}"


def choose_trials(
    keys: Iterable[TrialKey], n_trials: int | None, *, cases: Collection[str] = (),
    seed: int | None = None,
) -> list[TrialKey]:  # fmt: skip
    """Draw trials at random, evenly over the cases, agents and configurations; None: all.

    ``cases`` are ids of the cases to draw from; empty: all. ``seed`` repeats a draw. ConfigError if
    no trial is of a case.
    """
    keys = sorted(keys)
    known = list(dict.fromkeys(key.case_id for key in keys))
    for case in cases:
        if case not in known:
            raise ConfigError("case", f"must be one of {', '.join(known)}, got {case!r}")
    groups: dict[tuple[str, str, str], list[TrialKey]] = {}
    for key in keys:
        if not cases or key.case_id in cases:
            groups.setdefault((key.case_id, key.agent, key.config_hash), []).append(key)
    generator = np.random.default_rng(seed)
    drawn = [[group[i] for i in generator.permutation(len(group))] for group in groups.values()]
    drawn = [drawn[i] for i in generator.permutation(len(drawn))]
    longest = max(map(len, drawn), default=0)
    # The first trial of each group, then the second of each, until all are listed.
    in_turn = [group[turn] for turn in range(longest) for group in drawn if turn < len(group)]
    return sorted(in_turn[:n_trials])


def verify(
    reports: Reports,
    *,
    n_trials: int | None = DEFAULT_TRIALS,
    cases: Collection[str] = (),
    seed: int | None = None,
    consent: Consent | None = None,
    executor: engine.Executor | None = None,
    observer: engine.Observer | None = None,
) -> Verification:
    """Run some reported trials again on this machine, and compare them bit by bit.

    The rows of the other stored trials are compared with their checksums only. Where a training in
    Python differs, it is run once more, to tell environments that do not repeat themselves.

    ``reports`` has the trials: `StoredReports`, `CertifiedReports`; `choose_trials` draws from them
    by ``n_trials``, ``cases`` and ``seed``. ``consent`` names modules that may be imported, by
    default none. For the executor and the observer see `sdnn.runs.engine.run_trials`.

    RunError if there is no finished trial, or a file is damaged in other ways than changed rows.
    """
    instruction_set()  # raises if the environment variable is wrong
    observe: engine.Observer = observer or (lambda _: None)
    if not reports.keys:
        unfinished = f", and {reports.n_unfinished} unfinished" if reports.n_unfinished else ""
        raise RunError(f"{reports.title} holds no finished trial{unfinished}")
    chosen = set(choose_trials(reports.keys, n_trials, cases=cases, seed=seed))
    others = sorted(set(reports.keys) - chosen)
    for number, is_intact in enumerate(reports.check(others)):
        observe(engine.Counted("checksums of the other trials", number + 1, len(others)))
        if not is_intact:
            chosen.add(others[number])  # running it shows which row has changed
    reported = {trial.key: trial for trial in reports.load(chosen)}
    plan, differences = _plan(reported.values(), reports, consent or Consent())
    results, signal = _run(plan, executor, observe)
    equal: list[tuple[ReportedTrial, TrialRecord]] = []
    for key, result in results.items():
        trial = reported[key]
        if isinstance(result, Exception):
            problem = f"it fails here: {type(result).__name__}: {result}"
            differences[key] = Difference(key, problem, _about(trial, reports), was_run=False)
        elif difference := compare(trial, result, reports):
            differences[key] = difference
        else:
            equal.append((trial, result))
    # A difference may come from an environment that does not repeat itself: run those twice.
    unexplained = [p for p in plan if p.key in differences and not p.spec.is_compiled]
    if unexplained and signal is None:
        again, signal = _run(unexplained, executor, observe)
        for key, second in again.items():
            first = results[key]
            if isinstance(first, Exception) or isinstance(second, Exception):
                continue
            if first.rows.checksum() != second.rows.checksum():
                problem = "its environment or agent does not repeat itself: two runs here differ"
                differences[key] = Difference(key, problem, _about(reported[key], reports))
    return Verification(
        title=reports.title,
        n_reported=len(reports.keys),
        n_chosen=len(chosen),
        n_unfinished=reports.n_unfinished,
        has_rows=all(trial.rows is not None for trial in reported.values()),
        equal=tuple(equal),
        differences=tuple(differences[key] for key in sorted(differences)),
        signal=signal,
    )


def _plan(
    reported: Iterable[ReportedTrial], reports: Reports, consent: Consent
) -> tuple[list[engine.PlannedTrial], dict[TrialKey, Difference]]:
    """Return the trials to run, and by key the others, whose configuration cannot be used."""
    plan, differences = [], {}
    for trial in reported:
        key = trial.key
        try:
            spec = trial.spec(consent)
        except ConfigError as error:
            problem = f"its configuration cannot be used here: {error}"
            differences[key] = Difference(key, problem, _about(trial, reports), was_run=False)
            continue
        planned = engine.PlannedTrial(key, spec)
        plan.append(ResumedTrial(key, spec, trial.goals) if trial.goals else planned)
    return plan, differences


def _run(
    plan: Sequence[engine.PlannedTrial], executor: engine.Executor | None, observe: engine.Observer
) -> tuple[Mapping[TrialKey, TrialRecord | Exception], int | None]:
    """Run trials without storing them; return records or errors by key, and a received signal."""
    results: dict[TrialKey, TrialRecord | Exception] = {}

    def keep(ended: Sequence[engine.Finished | engine.Failed]) -> None:
        """Note the record or the error of each trial."""
        for message in ended:
            result = message.error if isinstance(message, engine.Failed) else message.record
            results[message.planned.key] = result

    _, signal = engine.execute(plan, keep, executor, observe)
    return results, signal


def compare(trial: ReportedTrial, record: TrialRecord, reports: Reports) -> Difference | None:
    """Compare a reported trial with its record here; None if they are equal."""
    about = _about(trial, reports)
    digest = trial.digest_of(record.rows)
    if trial.rows is not None and trial.digest != digest:
        problem, lines = _first_difference(trial.rows, record.rows)
        problem = f"{problem}; {trial.problem}" if trial.problem else problem
        return Difference(trial.key, problem, (*lines, *about))
    if trial.digest != digest:
        lines = f"reported: digest {trial.digest[:16]}", f"here:     digest {digest[:16]}"
        return Difference(trial.key, "its rows have another digest", (*lines, *about))
    if trial.n_decisions not in (None, record.n_decisions):
        problem = f"it has {record.n_decisions} decisions, reported are {trial.n_decisions}"
        return Difference(trial.key, problem, about)
    return Difference(trial.key, trial.problem, about) if trial.problem else None


def _first_difference(reported: TrialRows, here: TrialRows) -> tuple[str, tuple[str, ...]]:
    """Return in words which row differs first, and a line with each of the two rows.

    Rows are compared as bytes: equal numbers may have other bits, such as 0.0 and -0.0.
    """
    n_common = min(len(reported.table), len(here.table))

    def bytes_of(table: NDArray[np.void]) -> NDArray[np.uint8]:
        """Return the first rows as bytes, (n_common, bytes of a row)."""
        rows = np.ascontiguousarray(table[:n_common]).astype(ROW.newbyteorder("<"))
        return rows.view(np.uint8).reshape(n_common, ROW.itemsize)

    differs = (bytes_of(reported.table) != bytes_of(here.table)).any(axis=1)
    if not differs.any():
        return f"it has {len(here.table)} rows, reported are {len(reported.table)}", ()
    first = int(np.argmax(differs))
    lines = (
        f"reported: {row_words(reported.table[first])}",
        f"here:     {row_words(here.table[first])}",
    )
    return f"row {first + 1} of {len(reported.table)} differs", lines


def row_words(row: np.void) -> str:
    """Describe a row of a trial in words; numbers have all digits that tell them apart."""
    if row["kind"] == "evaluation":
        text = f"evaluation after {row['episode']} episodes"
        text += f", episode {row['part'] + 1} of it" if row["part"] else ""
    else:
        text = f"{row['kind']} {row['episode']}"
    if row["step"] != UNKNOWN:
        text += f", step {row['step']}"
    if row["environment"] != UNKNOWN:
        text += f", environment {row['environment']}"
    text += f": length {row['length']}, return {float(row['return'])!r}"
    return text + (", terminated" if row["terminated"] else ", not terminated")


def _about(trial: ReportedTrial, reports: Reports) -> tuple[str, ...]:
    """Return lines about version, machine and configuration, as far as they are known."""
    same = "the same" if trial.version == __version__ else f"here {__version__}"
    lines = [f"version: {trial.version}, {same}"]
    machine = reports.machine or "not recorded"
    lines.append(f"instruction set: {machine}; here {instruction_set()}")
    lines.append(f"configuration: {trial.key.config_hash}; seed {trial.key.seed}")
    return tuple(lines)
