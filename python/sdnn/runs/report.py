"""Parts of the reports of trials: sections, numbers as text, and the files that are written."""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from sdnn.reports.pages import Page, Section, duration_words, plain_number
from sdnn.reports.statistics import CONFIDENCE, Estimate
from sdnn.runs.engine import TrialsOutcome
from sdnn.runs.errors import PlotUnavailableError
from sdnn.runs.results import MEASURES, RETURN_MEASURES, CaseResult, MeasureName
from sdnn.runs.trial import TrialRecord
from sdnn.support import machine

PERCENT = f"{100 * CONFIDENCE:.0f} %"
NOTE = (
    f"Medians over trials with {PERCENT} bootstrap intervals over trials. us/decision: processor"
    " time of sensing, choosing, physics and learning."
)
VERIFY_NOTE = (
    "sdnn verify FOLDER, with the folder of this page, runs trials again and compares every bit."
)
MEASURE_END = ("decisions", "us/decision")
"""Header of the last two cells that `measure_cells` returns."""


@dataclass(frozen=True)
class WrittenReport:
    """A written report: the outcome of its trials, its page, its files, and the JSON's content."""

    outcome: TrialsOutcome
    page: Page | None = None
    files: tuple[Path, ...] = ()
    table: dict[str, object] = field(default_factory=dict)


@dataclass(frozen=True, kw_only=True)
class Content:
    """A report to be written: its page, the JSON's content, and its files by name.

    ``shown`` are the trials that it describes.
    """

    page: Page
    table: dict[str, object]
    files: Mapping[str, bytes | Iterable[bytes]]
    shown: Sequence[TrialRecord]


def require_matplotlib() -> None:
    """Raise a `PlotUnavailableError` if matplotlib is not installed."""
    if find_spec("matplotlib") is None:
        raise PlotUnavailableError("figures need another package: pip install matplotlib")


def describe_call(outcome: TrialsOutcome, seconds: float, shown: Iterable[TrialRecord]) -> str:
    """Describe the call that made a page: its wall time, processor time of the trials, machine."""
    processor_seconds = sum(record.seconds for record in shown)
    text = f"Processor time of the trials shown: {duration_words(processor_seconds)}."
    n_stored = outcome.n_planned - outcome.n_run
    if n_stored > 0:
        text += f" {n_stored} of {outcome.n_planned} trials were stored before the call that made"
        text += " this page."
    else:
        text = f"Everything asked for was run in {duration_words(seconds)}. {text}"
    return f"{text} Made on {machine.description()}."


def measures_section(names: Iterable[MeasureName], notes: Sequence[str] = ()) -> Section:
    """Return the folded section that explains measures."""
    terms = {name.replace("_", " "): MEASURES[name][0] for name in names}
    return Section(folded=[Section(title="What is measured", notes=[NOTE, *notes], terms=terms)])


def settings_section(results: Iterable[tuple[str, CaseResult]]) -> Section:
    """Return the folded section with settings, versions and seeds of each titled result."""
    folded = [
        Section(
            title=f"{title} · configuration {result.config_hash}",
            notes=[
                f"sdnn {', '.join(sorted({r.version for r in result.records}))}; seeds of the"
                f" trials: {', '.join(str(r.key.seed) for r in result.records)}"
            ],
            text=json.dumps(json.loads(result.records[0].config), indent=2),
        )
        for title, result in results
    ]
    return Section(title="Settings and seeds: all that fixes the rows", folded=folded)


def measure_cells(result: CaseResult, names: Iterable[MeasureName]) -> tuple[str, ...]:
    """Return a row of cells: the medians of measures, decisions, and microseconds of each.

    Measures that the result lacks are ``"-"``.
    """
    medians, last = result.medians, result.last_episode
    cells = (format_estimate(medians.get(name), name, last) for name in names)
    return *cells, f"{result.n_decisions:,}", f"{result.microseconds_per_decision:.1f}"


def format_estimate(
    estimate: Estimate | None, measure: MeasureName = "final_share_solved",
    last_episode: int | None = None, sign: str = "",
) -> str:  # fmt: skip
    """Write an estimate with its interval; ``"-"`` without one, ``>last_episode`` if censored.

    Shares are in percent. Returns have two significant digits of the interval, others a decimal.

    >>> format_estimate(Estimate(120.0, 90.0, math.inf), "episodes_to_learn", 15000)
    '120 [90, >15,000]'
    >>> format_estimate(Estimate(0.9, 0.8, 1.0), "final_share_solved")
    '90 % [80, 100]'
    >>> format_estimate(Estimate(-0.5, -2.0, 1.0), "final_steps", sign="+")
    '-0.5 [-2, +1]'
    """
    if estimate is None or math.isnan(estimate.value):
        return "-"
    scale, unit = (100, " %") if measure == "final_share_solved" else (1, "")
    decimals = _decimals_of_return(estimate) if measure in RETURN_MEASURES else 1

    def number(value: float) -> str:
        """Write a number of the estimate."""
        if math.isinf(value):
            return f">{last_episode:,}"
        return plain_number(scale * value, decimals, sign)

    if math.isnan(estimate.lower):
        return number(estimate.value) + unit
    return f"{number(estimate.value)}{unit} [{number(estimate.lower)}, {number(estimate.upper)}]"


def _decimals_of_return(estimate: Estimate) -> int:
    """Return how many decimals show two digits of the extent of an interval, at least one.

    An interval from 0.12 to 0.15 has the extent 0.03 and needs three. A value without an interval
    has the decimals of an extent of 1 % of it.
    """
    numbers = np.array([estimate.value, estimate.lower, estimate.upper])
    numbers = numbers[np.isfinite(numbers)]
    if not numbers.any():
        return 1
    extent = float(np.ptp(numbers)) or float(np.abs(numbers).max()) / 100
    return min(max(1, 1 - math.floor(math.log10(extent))), 300)  # 300: for the smallest floats
