"""A study's results as tables, as a page and as JSON."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, field
from typing import Any

from sdnn.runs.comparison import MIN_TRIALS_TO_DIFFER, Comparison, Measured
from sdnn.runs.measures import DEFAULT_MEASURES, MEASURES, SHARE_STABLE, MeasureName
from sdnn.runs.registry import agent_entry
from sdnn.runs.report import (
    COST_CELLS,
    NOTE,
    PERCENT,
    Call,
    Folded,
    Section,
    Table,
    format_estimate,
    measure_cells,
    measure_terms,
    measures_section,
    settings_section,
    to_html,
    to_markdown,
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
    """What else the results of a study say, such as about claims.

    Parameters
    ----------
    tables
        Tables before those of the cases, each with its notes.
    details
        Tables after those of the cases, folded on a page.
    json
        Entries of the JSON file.
    """

    tables: Sequence[tuple[Table, Sequence[str]]] = ()
    details: Sequence[Table] = ()
    json: dict[str, Any] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class StudyReport:
    """Everything that a study's tables and page are made of.

    Parameters
    ----------
    comparison
        The results.
    version
        Version of the library that made the report.
    digest
        Digest of the trials' rows.
    addition
        What else they say.
    """

    comparison: Comparison
    version: str
    digest: str
    addition: Addition = field(default_factory=Addition)

    @property
    def title(self) -> str:
        """Title of the study."""
        return str(self.comparison.study.title)

    @property
    def scope(self) -> str:
        """How much was run."""
        study = self.comparison.study
        return (
            f"{_count(len(study.variants), 'variant')} in {_count(len(study.cases), 'case')},"
            f" {_count(study.n_trials, 'trial')} each; reference: {study.reference}."
        )

    @property
    def missing(self) -> str | None:
        """What of the study is not there yet; None if all is."""
        n_all, n_measured = len(self.comparison.study.combinations), len(self.comparison.measured)
        if n_all == n_measured:
            return None
        return (
            f"Not complete: {n_all - n_measured} of {n_all} combinations of case and variant lack"
            " trials and are left out."
        )

    def case_tables(self) -> Iterator[tuple[Table, Table | None]]:
        """For each case the table of measures, and that of differences if there are any."""
        for case in self.comparison.cases:
            measured = self.comparison.of_case(case.id)
            names = [n for n in MEASURES if any(n in m.result.values for m in measured)]
            with_end = any(m.solved_at_end is not None for m in measured)
            words = tuple(name.replace("_", " ") for name in names)
            end = ("end solved",) if with_end else ()
            table = Table(
                case.title,
                ("variant", "agent", "trials", *end, *words, *COST_CELLS),
                [_measure_row(one, names, with_end) for one in measured],
            )
            differences = Table(
                f"{case.title}: less {self.comparison.study.reference}, trial by trial",
                ("variant", *words),
                [_difference_row(one, names) for one in measured if one.differences],
            )
            yield table, differences if differences.rows else None

    def tables(self) -> list[Table]:
        """All tables."""
        of_cases = [table for pair in self.case_tables() for table in pair if table is not None]
        return [*(table for table, _ in self.addition.tables), *of_cases, *self.addition.details]

    def table_notes(self) -> list[str]:
        """Say what the tables of the cases mean beside the measures."""
        found, study = self.comparison.measured.values(), self.comparison.study
        copies = ((v.id, study.same_as(v.id)) for v in study.variants)
        return [
            *(f"{variant} is the same as {first}." for variant, first in copies if first),
            *([DIFFERENCE_NOTE] if any(m.differences for m in found) else []),
            *([SOLVED_NOTE] if any(m.solved_at_end is not None for m in found) else []),
        ]

    def terms(self) -> dict[str, str]:
        """Say what the measures shown mean."""
        shown = {name for m in self.comparison.measured.values() for name in m.result.values}
        return measure_terms(name for name in MEASURES if name in shown)

    def notes(self) -> list[str]:
        """Say what all tables mean."""
        return [
            NOTE,
            *self.table_notes(),
            *(note for _, notes in self.addition.tables for note in notes),
            *(f"{name}: {text}." for name, text in self.terms().items()),
        ]

    def to_markdown(self) -> str:
        """Write the tables as Markdown."""
        study = self.comparison.study
        return to_markdown(
            self.title,
            [self.scope, *([f"**{self.missing}**"] if self.missing else [])],
            self.tables(),
            self.notes(),
            f"Study {study.file.path.name}; root seed {study.seed}; digest of the rows"
            f" {self.digest[:16]}; sdnn {self.version}.",
        )

    def to_html(self, picture: bytes, call: Call) -> str:
        """Make the page, with the SVG of the figure and what is known of the call."""
        study = self.comparison.study
        return to_html(
            title=self.title,
            heading=self.title,
            intro=self.scope,
            warnings=filter(None, [self.missing]),
            provenance=f"{call.describe()} sdnn {self.version} on {call.machine}. Root seed"
            f" {study.seed}, digest of the rows",
            code=self.digest[:16],
            sections=self._sections(picture),
        )

    def _sections(self, picture: bytes) -> Iterator[Section]:
        alt = f"{self.title}: each variant in each case, trial by trial"
        yield Section(title="At a glance", picture=picture, alt=alt)
        for number, (table, notes) in enumerate(self.addition.tables):
            level = 3 if number else 2
            yield Section(title=table.title, level=level, table=table, notes=[" ".join(notes)])
        if self.addition.details:
            details = self.addition.details
            yield Section(folded=[Folded(summary=table.title, table=table) for table in details])
        for table, differences in self.case_tables():
            yield Section(title=table.title, table=table)
            if differences is not None:
                yield Section(title=differences.title, level=0, table=differences)
        yield measures_section(self.terms(), self.table_notes())
        file = self.comparison.study.file
        yield Section(title="The study", folded=[Folded(summary=file.path.name, text=file.text)])
        yield settings_section(
            (
                f"{one.variant.title}, {one.result.title}, {agent_entry(one.result.agent).title}",
                one.result,
            )
            for one in self.comparison.measured.values()
        )

    def to_json(self) -> dict[str, Any]:
        """Return the results as values that JSON can hold; see `CaseResult.to_json`."""
        study = self.comparison.study
        return {
            "title": study.title,
            "file": study.file.path.name,
            "n_trials": study.n_trials,
            "seed": study.seed,
            "reference": study.reference,
            "version": self.version,
            "digest": self.digest,
            "cases": [{"id": case.id, "title": case.title} for case in study.cases],
            "variants": [
                {"id": v.id, "title": v.title, "same_as": study.same_as(v.id)}
                for v in study.variants
            ],
            "results": [
                {
                    "case": case,
                    "variant": variant,
                    "n_end_solved": None
                    if (solved := one.solved_at_end) is None
                    else int(solved.sum()),
                    **one.result.to_json(),
                    "differences": {
                        name: estimate.to_json(one.result.last_episode)
                        for name, estimate in one.differences.items()
                    },
                }
                for (case, variant), one in self.comparison.measured.items()
            ],
            **self.addition.json,
        }


def _count(number: int, word: str) -> str:
    return f"{number} {word}{'' if number == 1 else 's'}"


def _measure_row(
    measured: Measured, names: Sequence[MeasureName], with_end: bool
) -> tuple[str, ...]:
    result = measured.result
    return (
        measured.variant.title,
        agent_entry(result.agent).title,
        str(result.n_trials),
        *([measured.end_solved] if with_end else []),
        *measure_cells(result, names),
    )


def _difference_row(measured: Measured, names: Sequence[MeasureName]) -> tuple[str, ...]:
    return (
        measured.variant.title,
        *(
            format_estimate(measured.differences[name], name, sign="+")
            + (" *" if measured.differs(name) else "")
            if name in measured.differences
            else "-"
            for name in names
        ),
    )
