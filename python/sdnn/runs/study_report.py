"""A study's results as a page and as JSON."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from sdnn import _core
from sdnn.runs.comparison import MIN_TRIALS_TO_DIFFER, Comparison, Measured
from sdnn.runs.measures import DEFAULT_MEASURES, MEASURES, SHARE_STABLE, MeasureName
from sdnn.runs.registry import title_of
from sdnn.runs.report import (
    MEASURE_END,
    PERCENT,
    Folded,
    Page,
    Section,
    Table,
    format_estimate,
    measure_cells,
    measures_section,
    settings_section,
)

DIFFERENCE_NOTE = (
    "Differences are paired: a trial less the reference's trial of the same number, which has the"
    f" same seed; the mean over trials with its {PERCENT} bootstrap interval over trials, censored"
    f" episodes as the last one. * marks intervals without 0 over at least {MIN_TRIALS_TO_DIFFER}"
    " trials; where nothing differs, about one in twenty of them does so by chance."
)
SOLVED_NOTE = (
    "end solved: trials that solve at least"
    f" {100 * SHARE_STABLE:.0f} % of their last {DEFAULT_MEASURES.final_window} tests."
)


@dataclass(frozen=True, kw_only=True)
class Addition:
    """What else the results of a study say, such as about claims: for the page and the JSON."""

    sections: Sequence[Section] = ()
    json: dict[str, Any] = field(default_factory=dict)


def study_page(comparison: Comparison, digest: str, addition: Addition, picture: bytes) -> Page:
    """Return the page of a study, with the digest of its rows and the SVG of its figure."""
    study = comparison.study
    n_all, n_measured = len(study.combinations), len(comparison.measured)
    counts = {"variant": study.variants, "case": study.cases, "trial": range(study.n_trials)}
    variants, cases, trials = (
        f"{len(found)} {word}{'' if len(found) == 1 else 's'}" for word, found in counts.items()
    )
    missing = (
        f"Not complete: {n_all - n_measured} of {n_all} combinations of case and variant lack"
        " trials and are left out."
    )
    alt = f"{study.title}: each variant in each case, trial by trial"
    return Page(
        title=study.title,
        intro=f"{variants} in {cases}, {trials} each; reference: {study.reference}.",
        warnings=[missing] if n_measured < n_all else [],
        sections=[
            Section(title="At a glance", picture=picture, alt=alt),
            *addition.sections,
            *_case_sections(comparison),
            _measures(comparison),
            Section(
                title="The study",
                folded=[Folded(summary=study.file.path.name, text=study.file.text)],
            ),
            settings_section(
                (f"{m.variant.title}, {m.result.title}, {_title(m)}", m.result)
                for m in comparison.measured.values()
            ),
        ],
        source=f"Study {study.file.path.name}; root seed {study.seed}; digest of the rows"
        f" {digest[:16]}; sdnn {_core.__version__}.",
    )


def _title(measured: Measured) -> str:
    return title_of(measured.result.agent)


def _case_sections(comparison: Comparison) -> Iterator[Section]:
    """For each case the table of measures, and that of differences if there are any."""
    for case in comparison.cases:
        measured = comparison.of_case(case.id)
        names = [n for n in MEASURES if any(n in m.result.values for m in measured)]
        words = tuple(name.replace("_", " ") for name in names)
        with_end = any(m.solved_at_end is not None for m in measured)
        rows = [
            (
                m.variant.title,
                _title(m),
                str(m.result.n_trials),
                *([m.end_solved] if with_end else []),
                *measure_cells(m.result, names),
            )
            for m in measured
        ]
        end = ("end solved",) if with_end else ()
        header = ("variant", "agent", "trials", *end, *words, *MEASURE_END)
        yield Section(table=Table(case.title, header, rows))
        title = f"{case.title}: less {comparison.study.reference}, trial by trial"
        rows = [
            (m.variant.title, *(_difference(m, n) for n in names))
            for m in measured
            if m.differences
        ]
        if rows:
            yield Section(level=0, table=Table(title, ("variant", *words), rows))


def _difference(measured: Measured, name: MeasureName) -> str:
    if name not in measured.differences:
        return "-"
    text = format_estimate(measured.differences[name], name, sign="+")
    return text + (" *" if measured.differs(name) else "")


def _measures(comparison: Comparison) -> Section:
    """Explain the measures shown, and which variants are the same."""
    found, study = comparison.measured.values(), comparison.study
    copies = ((v.id, study.same_as(v.id)) for v in study.variants)
    notes = [f"{variant} is the same as {first}." for variant, first in copies if first]
    notes += [DIFFERENCE_NOTE] if any(m.differences for m in found) else []
    notes += [SOLVED_NOTE] if any(m.solved_at_end is not None for m in found) else []
    shown = {name for m in found for name in m.result.values}
    return measures_section((name for name in MEASURES if name in shown), notes)


def study_json(comparison: Comparison, digest: str, addition: Addition) -> dict[str, Any]:
    """Return the results as values that JSON can hold; see `CaseResult.to_json`."""
    study = comparison.study
    return {
        "title": study.title,
        "file": study.file.path.name,
        "n_trials": study.n_trials,
        "seed": study.seed,
        "reference": study.reference,
        "version": _core.__version__,
        "digest": digest,
        "cases": [{"id": case.id, "title": case.title} for case in study.cases],
        "variants": [
            {"id": v.id, "title": v.title, "same_as": study.same_as(v.id)} for v in study.variants
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
        **addition.json,
    }
