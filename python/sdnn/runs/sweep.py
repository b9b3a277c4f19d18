"""Run a study and write its results: the body of ``sdnn sweep``."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

from sdnn import _core
from sdnn.files import csv_pieces, gzip_pieces, remove_abandoned_files
from sdnn.runs.comparison import Addition, Comparison, compare, study_json, study_page
from sdnn.runs.engine import Executor, Observer, PlannedTrial, ThreadExecutor, run_trials
from sdnn.runs.figures import draw_study, figure_bytes
from sdnn.runs.report import Finished, describe_call, require
from sdnn.runs.store import STORE_NAME, ResultStore
from sdnn.runs.study import Study
from sdnn.runs.trial import ROW_HEADER, records_digest, trial_rows


@dataclass(frozen=True, kw_only=True)
class SweepRequest:
    """A study and how to run it."""

    study: Study
    out: Path  # folder of the result file, figure, tables and page
    executor: Executor = field(default_factory=ThreadExecutor)
    only: tuple[str, ...] = ()  # ids of the variants to run; none: all
    # Makes what else the report has.
    addition: Callable[[Comparison], Addition] = lambda _: Addition()

    @property
    def groups(self) -> dict[tuple[str, str], tuple[PlannedTrial, ...]]:
        """The trials of each variant in each case, by the ids of case and variant."""
        return {pair: self.study.trials(*pair) for pair in self.study.chosen(self.only)}

    @cached_property
    def plan(self) -> tuple[PlannedTrial, ...]:
        """The trials that are asked for; a ValueError if there is no variant of a name."""
        return tuple(self.study.plan(self.only))


def sweep(request: SweepRequest, *, observer: Observer | None = None) -> Finished:
    """Run what is missing, then draw and write everything that is complete.

    A variant in a case is complete when all its trials are stored, whether asked for now or not. A
    trial that raises leaves its variant out of the report and nothing else. There is no report if
    nothing is complete, or the run was interrupted.

    Raises
    ------
    ConfigError
        If the core refuses a configuration; no trial is run then.
    ValueError
        If there is no variant of that name.
    PlotUnavailableError
        If matplotlib or Jinja is not installed; no trial is run then.
    StoreError
        If the result file cannot be used.
    ClusterError
        If the cluster cannot run trials any more; what was finished is stored.
    """
    require("matplotlib", "jinja2")
    begin = time.monotonic()
    study, plan = request.study, request.plan
    is_new = not (request.out / STORE_NAME).exists()
    if is_new:
        study.check()  # before the folder is made
    with ResultStore(request.out) as store:
        if not is_new:
            study.check(store.keys())
        remove_abandoned_files(request.out)
        outcome = run_trials(plan, store, executor=request.executor, observer=observer)
        if outcome.interrupted:
            return Finished(outcome)
        records = store.load({key for pair in study.combinations for key in study.keys(*pair)})
    comparison = compare(study, records)
    if not comparison.measured:
        return Finished(outcome)
    complete = {key for pair in comparison.measured for key in study.keys(*pair)}
    shown = [record for record in records if record.key in complete]
    digest = records_digest(shown)
    addition = request.addition(comparison)
    name = study.file.path.name
    footer = f"{name}; sdnn {_core.__version__}; digest of the rows {digest[:16]}"
    png, svg = figure_bytes(draw_study(comparison, footer))
    done = Finished(
        outcome,
        page=study_page(comparison, digest, addition, svg),
        table=study_json(comparison, digest, addition),
    )
    # Test episodes of variants that are the same come more than once.
    tests = (
        (variant, *row)
        for (_, variant), measured in comparison.measured.items()
        for row in trial_rows(measured.result.records)
    )
    return done.write(
        {
            "figure.png": png,
            "figure.svg": svg,
            "trials.csv": csv_pieces(*trial_table(comparison)),
            "results.csv.gz": gzip_pieces(csv_pieces(("variant", *ROW_HEADER), tests)),
        },
        lambda end: request.out / f"{study.file.path.stem}-{end}",
        describe_call(outcome, time.monotonic() - begin, shown),
    )


def trial_table(comparison: Comparison) -> tuple[tuple[str, ...], list[tuple[object, ...]]]:
    """Header and rows of the measures of each trial; what a task does not have is empty."""
    found = comparison.measured.items()
    names = list(dict.fromkeys(name for _, one in found for name in one.result.values))
    header = (
        "case", "variant", "agent", "trial", "seed", "config_hash", "version", *names, "decisions",
        "seconds",
    )  # fmt: skip
    rows: list[tuple[object, ...]] = [
        (case, variant, r.key.agent, r.key.trial, r.key.seed, r.key.config_hash, r.version,
         *(values[name][n] if name in values else "" for name in names),
         r.n_decisions, round(r.seconds, 3))
        for (case, variant), measured in found
        for values in [measured.result.values]
        for n, r in enumerate(measured.result.records)
    ]  # fmt: skip
    return header, rows
