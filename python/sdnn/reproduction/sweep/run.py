"""Run a study and write what it gave: the body of ``sdnn sweep``."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path
from typing import Any

from sdnn import _core, machine
from sdnn.reproduction import figures
from sdnn.reproduction import page as pages
from sdnn.reproduction.sweep.comparison import Comparison, compare
from sdnn.reproduction.sweep.figure import draw_study
from sdnn.reproduction.sweep.page import to_html, to_markdown
from sdnn.reproduction.sweep.reading import read_study
from sdnn.reproduction.sweep.report import StudyReport, to_json
from sdnn.reproduction.sweep.study import Study
from sdnn.runs.engine import Observer, RunOutcome, run_trials
from sdnn.runs.executor import Executor
from sdnn.runs.measures import MeasureName
from sdnn.runs.records import ROW_HEADER, TrialRecord, records_digest, trial_rows
from sdnn.runs.store import STORE_NAME, ResultStore
from sdnn.runs.trial_config import PlannedTrial
from sdnn.whole_files import csv_pieces, gzip_pieces, remove_abandoned_files, write_whole


@dataclass(frozen=True, kw_only=True)
class SweepRequest:
    """A study and how to run it.

    Parameters
    ----------
    file
        The study.
    out
        Folder of the result file, figure, tables and page.
    n_trials
        Trials of each variant in each case, instead of the file's.
    seed
        Root of all seeds, instead of the file's.
    jobs
        Trials at the same time; default one for each core.
    executor
        Where trials run; default threads of this process.
    only
        Ids of the variants to run; none: all.
    """

    file: Path
    out: Path
    n_trials: int | None = None
    seed: int | None = None
    jobs: int | None = None
    executor: Executor | None = None
    only: tuple[str, ...] = ()

    @cached_property
    def study(self) -> Study:
        """The study: read when first asked for, and once.

        Raises
        ------
        StudyError
            If the file says something unknown or impossible.
        """
        return read_study(self.file, n_trials=self.n_trials, seed=self.seed)

    @cached_property
    def plan(self) -> tuple[PlannedTrial, ...]:
        """The trials that are asked for: listed when first asked for, and once.

        Raises
        ------
        StudyError
            If the file says something unknown or impossible.
        ValueError
            If there is no variant of that name.
        """
        return self.study.plan(self.only)

    def path(self, name: str) -> Path:
        """Return where a file of this study is written: ``OUT/STUDY-report.html``."""
        return self.out / f"{self.file.stem}-{name}"


@dataclass(frozen=True)
class Sweep:
    """What a run gave.

    Parameters
    ----------
    outcome
        What became of the trials.
    report
        The results of all that is complete; none if nothing is, or the run was interrupted.
    files
        Files written.
    table
        Content of the JSON file.
    """

    outcome: RunOutcome
    report: StudyReport | None = None
    files: tuple[Path, ...] = ()
    table: dict[str, Any] = field(default_factory=dict)


def sweep(request: SweepRequest, *, observer: Observer | None = None) -> Sweep:
    """Run what is missing, then draw and write everything that is complete.

    A variant in a case is complete when all its trials are stored, whether asked for now or not. A
    trial that raises leaves its variant out of the report and nothing else.

    Parameters
    ----------
    request
        What to run.
    observer
        Told how the run goes.

    Raises
    ------
    StudyError
        If the file says something unknown or impossible, or the core refuses a configuration; no
        trial is run then.
    ValueError
        If there is no variant of that name.
    PlotUnavailableError
        If matplotlib or Jinja is not installed; no trial is run then.
    StoreError
        If the result file cannot be used.
    ClusterError
        If the cluster cannot run trials any more; what was finished is stored.
    """
    figures.require_matplotlib()
    pages.require_jinja()
    begin = time.monotonic()
    study = request.study
    plan = request.plan
    is_new = not (request.out / STORE_NAME).exists()
    if is_new:
        study.check()  # before the folder is made
    with ResultStore(request.out) as store:
        if not is_new:
            study.check(store.keys())
        remove_abandoned_files(request.out)
        outcome = run_trials(
            plan, store, executor=request.executor, jobs=request.jobs, observer=observer
        )
        if outcome.interrupted:
            return Sweep(outcome)
        wanted = {key for pair in study.combinations for key in study.keys(*pair)}
        records = store.load(wanted)
    comparison = compare(study, records)
    if not comparison.measured:
        return Sweep(outcome)
    complete = {key for pair in comparison.measured for key in study.keys(*pair)}
    shown = [record for record in records if record.key in complete]
    report = StudyReport(
        comparison=comparison, version=_core.__version__, digest=records_digest(shown)
    )
    call = pages.Call(
        machine=machine.description(),
        seconds=time.monotonic() - begin,
        n_run=outcome.n_run,
        n_planned=outcome.n_planned,
        processor_seconds=sum(record.seconds for record in shown),
    )
    return Sweep(outcome, report, *_write(request, report, call))


def _write(
    request: SweepRequest, report: StudyReport, call: pages.Call
) -> tuple[tuple[Path, ...], dict[str, Any]]:
    """Draw and write everything; returns the files and the content of the JSON file."""
    comparison = report.comparison
    footer = f"{request.file.name}; sdnn {report.version}; digest of the rows {report.digest[:16]}"
    png, svg = figures.figure_bytes(draw_study(comparison, footer))
    table = to_json(report)
    contents: dict[str, bytes | Iterator[bytes]] = {
        "figure.png": png,
        "figure.svg": svg,
        "results.md": to_markdown(report).encode(),
        "table.json": (json.dumps(table, indent=2, allow_nan=False) + "\n").encode(),
        "trials.csv": csv_pieces(*_trial_table(comparison)),
        "results.csv.gz": gzip_pieces(csv_pieces(("variant", *ROW_HEADER), _test_rows(comparison))),
        "report.html": to_html(report, svg, call).encode(),
    }
    for name, content in contents.items():
        write_whole(request.path(name), content)
    return tuple(request.path(name) for name in contents), table


def _records(comparison: Comparison) -> Iterator[tuple[str, tuple[TrialRecord, ...]]]:
    for (_, variant), measured in comparison.measured.items():
        yield variant, measured.summary.result.records


def _test_rows(comparison: Comparison) -> Iterator[tuple[object, ...]]:
    """All test episodes, of variants that are the same more than once."""
    for variant, records in _records(comparison):
        for row in trial_rows(records):
            yield (variant, *row)


def _trial_table(
    comparison: Comparison,
) -> tuple[tuple[str, ...], Iterator[tuple[object, ...]]]:
    """Header and rows of the measures of each trial; what a task does not have is empty."""
    names: list[MeasureName] = list(
        dict.fromkeys(name for m in comparison.measured.values() for name in m.measures)
    )
    header = (
        "case", "variant", "agent", "trial", "seed", "config_hash", "version", *names, "decisions",
        "seconds",
    )  # fmt: skip

    def rows() -> Iterator[tuple[object, ...]]:
        for (case, variant), measured in comparison.measured.items():
            values = measured.summary.values
            for number, record in enumerate(measured.summary.result.records):
                key = record.key
                of_trial = (values[n][number] if n in values else "" for n in names)
                yield (
                    case, variant, key.agent, key.trial, key.seed, key.config_hash, record.version,
                    *of_trial, record.n_decisions, round(record.seconds, 3),
                )  # fmt: skip

    return header, rows()
