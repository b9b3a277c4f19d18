"""Run studies or estimate their time, and write the report of a study that was read from a file."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TypeAlias

import sdnn.runs.report as report
from sdnn import _core
from sdnn.agents.registry import title_of
from sdnn.reports.pages import Page, Section, Table
from sdnn.reports.plots import NARROW_DPI, figure_bytes, png_bytes
from sdnn.runs.engine import Executor, Observer, PlannedTrial, run_trials
from sdnn.runs.errors import RunError
from sdnn.runs.figures import draw_study
from sdnn.runs.results import FINAL_WINDOW, MEASURES, SHARE_STABLE, MeasureName
from sdnn.runs.store import STORE_NAME, ResultStore
from sdnn.runs.study import MIN_TRIALS_TO_DIFFER, Comparison, Measured, Study, compare
from sdnn.runs.trial import ROW_HEADER, TrialKey, opened, records_digest, trial_rows
from sdnn.support.csv_files import csv_pieces, gzip_pieces
from sdnn.support.files import remove_abandoned_files, write_whole
from sdnn.support.machine import n_cores

DIFFERENCE_NOTE = (
    "Differences are paired: a trial minus the reference's trial of the same number, which has the"
    f" same seed; the mean over trials with its {report.PERCENT} bootstrap interval over trials,"
    " censored episodes as the last one. * marks intervals without 0 over at least"
    f" {MIN_TRIALS_TO_DIFFER} trials; where nothing differs, about one in twenty of them does so by"
    " chance."
)
SOLVED_NOTE = (
    "end solved: trials that solve at least"
    f" {100 * SHARE_STABLE:.0f} % of their last {FINAL_WINDOW} tests."
)


def run_study(
    study: Study, out: Path, *, executor: Executor | None = None, observer: Observer | None = None
) -> report.WrittenReport:
    """Run the missing trials of a study, then write the report of its complete parts.

    A variant in a case is complete when all its trials are stored, also by earlier calls. If a
    trial raises an error, only its variant is missing in the report. There is no report if
    nothing is complete, or the run was interrupted.

    RunError before any trial if a configuration is refused, matplotlib is not installed or
    the result file cannot be used; later if the cluster cannot run trials any more: what was
    finished is stored. ``executor`` and ``observer``: see `sdnn.runs.engine.run_trials`.
    """
    report.require_matplotlib()
    begin = time.monotonic()
    is_new = not (out / STORE_NAME).exists()
    if is_new:
        study.check()  # raises before the folder is made
    with ResultStore(out) as store:
        if not is_new:
            study.check(store.keys())
        remove_abandoned_files(out)
        outcome = run_trials(study.plan(), store, executor=executor, observer=observer)
        if outcome.interrupted:
            return report.WrittenReport(outcome)
        study.measure(store, observer or (lambda _: None))
        keys = {key for pair in study.combinations for key in study.keys(*pair)}
        content = study.report(compare(study, store.load(keys)), store)
    if content is None:
        return report.WrittenReport(outcome)
    call = report.describe_call(outcome, time.monotonic() - begin, content.shown)
    data_by_name = dict(content.files) | {
        "results.md": content.page.to_markdown().encode(),
        "table.json": (json.dumps(content.table, indent=2, allow_nan=False) + "\n").encode(),
        "report.html": content.page.to_html(call).encode(),
    }
    files = {out / study.file_name(name): data for name, data in data_by_name.items()}
    for path, data in files.items():
        write_whole(path, data)
    return report.WrittenReport(outcome, content.page, tuple(files), content.table)


PROBE_SECONDS = 0.3  # approximate processor time of a probe


def forecast(study: Study, out: Path, jobs: int) -> dict[str, object]:
    """Count the missing trials and estimate their time, without making any file.

    Returns values that JSON can hold. Times are estimated from the start of trials: they are too
    low where later episodes are longer. RunError if a configuration is impossible, the start of a
    trial raises an error, or the result file cannot be used.
    """
    stored: dict[TrialKey, float] = {}
    if (out / STORE_NAME).exists() or out.is_file():
        with ResultStore(out, read_only=True) as store:
            stored = store.seconds()
    study.check(stored)
    pairs: list[dict[str, object]] = []  # a row of the table for each variant in each case
    # Seconds of each missing trial, and whether it is compiled; equal variants share trials.
    missing: dict[TrialKey, tuple[float, bool]] = {}
    probes: dict[tuple[str, str, bool], tuple[float, int]] = {}  # results of `_probe`
    for pair in study.pairs:
        keys, spec = study.keys(*pair), study.combinations[pair].spec
        to_run = [key for key in keys if key not in stored]
        times = [stored[key] for key in keys if key in stored]
        source = f"{len(times)} stored trial{'s' if len(times) > 1 else ''}"
        if not times:
            # Variants of an agent in a case share a probe, if their budgets count the same.
            probe_key = (pair[0], spec.label, spec.budget.steps is None)
            if probe_key not in probes:
                probes[probe_key] = _probe(PlannedTrial(keys[0], spec))
            rate, n_episodes = probes[probe_key]
            times, source = [rate * spec.length], f"the first {n_episodes} episodes of one"
        seconds = sum(times) / len(times)
        missing |= dict.fromkeys(to_run, (seconds, spec.is_compiled))
        pairs.append(
            {
                "case": pair[0],
                "variant": pair[1],
                "agent": spec.label,
                "steps": spec.budget.steps,
                "episodes": spec.budget.episodes,
                "config_hash": spec.config_hash,
                "planned": len(keys),
                "stored": len(keys) - len(to_run),
                "seconds_of_a_trial": seconds,
                "source": source,
            }
        )
    n_planned = len(study.plan())
    return {
        "trials": pairs,
        "planned": n_planned,
        "stored": n_planned - len(missing),
        "jobs": jobs,
        "seconds": wall_seconds([*missing.values()], jobs),
        **study.other_work(out),
    }


def _probe(planned: PlannedTrial) -> tuple[float, int]:
    """Run the start of a trial; return its processor time per unit of its budget, and its episodes.

    Time is in seconds; the unit is a step or, where the budget counts these, an episode.
    """
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
    except Exception as error:  # a user's environment may raise anything
        raise RunError(f"{planned.title} fails: {type(error).__name__}: {error}") from error


def wall_seconds(trials: list[tuple[float, bool]], jobs: int) -> float:
    """Estimate the wall time of trials from their processor times and whether they are compiled.

    It is the largest of three bounds: all cores are busy, the longest trial runs on a single core,
    and trials in Python share a core whatever the number of jobs, because they hold Python's lock.

    >>> wall_seconds([(6.0, True), (2.0, False), (1.0, False)], jobs=1)
    9.0
    """
    times = [seconds for seconds, _ in trials]
    of_python = sum(seconds for seconds, is_compiled in trials if not is_compiled)
    n_parallel = max(1, min(jobs, n_cores()))
    return max(sum(times) / n_parallel, max(times, default=0.0), of_python)


Addition: TypeAlias = tuple[Sequence[Section], Mapping[str, object]]
"""Additions to a report, such as verdicts: sections of the page, and values of the JSON."""


def study_content(comparison: Comparison, addition: Addition) -> report.Content | None:
    """Make the report of the complete parts of a study that was read from a file."""
    if not comparison.measured:
        return None
    digest, source = records_digest(comparison.records), comparison.study.source
    footer = f"{source}; sdnn {_core.__version__}; digest of the rows {digest[:16]}"
    png, svg = figure_bytes(draw_study(comparison, footer))
    narrow = png_bytes(draw_study(comparison, footer, narrow=True), NARROW_DPI)
    # Equal variants repeat their test episodes here.
    tests = (
        (variant, *row)
        for (_, variant), measured in comparison.measured.items()
        for row in trial_rows(measured.result.records)
    )
    return report.Content(
        page=study_page(comparison, digest, addition, svg, narrow),
        table=study_json(comparison, digest, addition),
        files={
            "figure.png": png,
            "figure.svg": svg,
            "trials.csv": csv_pieces(*trial_table(comparison)),
            "results.csv.gz": gzip_pieces(csv_pieces(("variant", *ROW_HEADER), tests)),
        },
        shown=comparison.records,
    )


def study_page(
    comparison: Comparison, digest: str, addition: Addition, picture: bytes, narrow: bytes = b""
) -> Page:
    """Return the page of a study, with the digest of its rows and its figures, SVG and PNG."""
    study = comparison.study
    n_all, n_measured = len(study.combinations), len(comparison.measured)
    counts = {"variant": len(study.variants), "case": len(study.cases), "trial": study.n_trials}
    variants, cases, trials = (f"{n} {noun}{'' if n == 1 else 's'}" for noun, n in counts.items())
    missing = (
        f"Not complete: {n_all - n_measured} of {n_all} combinations of case and variant lack"
        " trials and are left out."
    )
    alt = f"{study.title}: each variant in each case, trial by trial"
    file = Section(title=study.source, text=study.text)
    titles = (
        (f"{m.variant.title}, {m.result.title}, {title_of(m.result.agent)}", m.result)
        for m in comparison.measured.values()
    )
    return Page(
        title=study.title,
        intro=f"{variants} in {cases}, {trials} each; reference: {study.reference}.",
        warnings=[missing] if n_measured < n_all else [],
        sections=[
            Section(title="At a glance", picture=picture, narrow_picture=narrow, alt=alt),
            *addition[0],
            *_case_sections(comparison),
            _measures_section(comparison),
            Section(title="The study", folded=[file]),
            report.settings_section(titles),
        ],
        source=f"Study {study.source}; root seed {study.seed}; digest of the rows"
        f" {digest[:16]}; sdnn {_core.__version__}. {report.VERIFY_NOTE}",
    )


ONLY_IN_FULL = ("early steps", "final steps")  # measures that a terminal leaves out by default


def _case_sections(comparison: Comparison) -> Iterator[Section]:
    """Yield for each case the table of measures, and that of differences if there are any."""
    for case in comparison.cases:
        measured = comparison.of_case(case.id)
        names = [n for n in MEASURES if any(n in m.result.values for m in measured)]
        titles = tuple(name.replace("_", " ") for name in names)
        judges_end = any(m.solved_at_end is not None for m in measured)
        end = ("end solved",) if judges_end else ()
        rows = [
            (m.variant.title, title_of(m.result.agent), str(m.result.n_trials),
             *((m.end_solved,) if judges_end else ()), *report.measure_cells(m.result, names))
            for m in measured
        ]  # fmt: skip
        header = ("variant", "agent", "trials", *end, *titles, *report.MEASURE_END)
        brief = ("variant", *end, *(title for title in titles if title not in ONLY_IN_FULL))
        yield Section(table=Table(case.title, header, rows, brief=brief))
        title = f"{case.title}: minus {comparison.study.reference}, trial by trial"
        compared = [m for m in measured if m.differences]
        rows = [(m.variant.title, *(_difference(m, n) for n in names)) for m in compared]
        if rows:
            yield Section(level=0, table=Table(title, ("variant", *titles), rows, brief=brief))


def _difference(measured: Measured, name: MeasureName) -> str:
    """Write the mean difference from the reference; an asterisk marks what differs from it."""
    text = report.format_estimate(measured.differences.get(name), name, sign="+")
    return text + (" *" if measured.differs(name) else "")


def _measures_section(comparison: Comparison) -> Section:
    """Return the section that explains the measures of the tables above."""
    measured, study = comparison.measured.values(), comparison.study
    copies = study.copies().items()
    notes = [f"The variant {variant} is the same as {first}." for variant, first in copies]
    notes += [DIFFERENCE_NOTE] if any(m.differences for m in measured) else []
    notes += [SOLVED_NOTE] if any(m.solved_at_end is not None for m in measured) else []
    names = {name for m in measured for name in m.result.values}
    return report.measures_section((name for name in MEASURES if name in names), notes)


def study_json(comparison: Comparison, digest: str, addition: Addition) -> dict[str, object]:
    """Return the results as values that JSON can hold; see `CaseResult.to_json`."""
    study, copies = comparison.study, comparison.study.copies()
    return {
        "title": study.title,
        "file": study.source,
        "n_trials": study.n_trials,
        "seed": study.seed,
        "reference": study.reference,
        "version": _core.__version__,
        "digest": digest,
        "cases": [{"id": case.id, "title": case.title} for case in study.cases],
        "variants": [
            {"id": v.id, "title": v.title, "same_as": copies.get(v.id)} for v in study.variants
        ],
        "results": [
            {
                "case": case,
                "variant": variant,
                "n_end_solved": None if m.solved_at_end is None else int(m.solved_at_end.sum()),
                **m.result.to_json(),
                "differences": {
                    name: estimate.to_json(m.result.last_episode)
                    for name, estimate in m.differences.items()
                },
            }
            for (case, variant), m in comparison.measured.items()
        ],
        **addition[1],  # what the study's report adds, such as the paper's claims
    }


def trial_table(comparison: Comparison) -> tuple[tuple[str, ...], list[tuple[object, ...]]]:
    """Return header and rows with the measures of each trial; measures it lacks are empty."""
    pairs = comparison.measured.items()
    names = list(dict.fromkeys(name for _, m in pairs for name in m.result.values))
    header = (
        "case", "variant", "agent", "trial", "seed", "config_hash", "version", *names, "decisions",
        "seconds",
    )  # fmt: skip
    rows: list[tuple[object, ...]] = []
    for pair, measured in pairs:
        for n, record in enumerate(measured.result.records):
            values = {name: column[n] for name, column in measured.result.values.items()}
            measures = (values.get(name, "") for name in names)
            end = record.n_decisions, round(record.seconds, 3)
            rows.append((*pair, *record.key[1:], record.version, *measures, *end))
    return header, rows
