"""The paper's claims as data, and the rule by which results speak about them.

Source: method.md, section 5.4; the paper's sections 4.2.2 and 4.3.3. Ranges with their margins
(`claims.toml`) and this rule were written down before the trials of Experiment B were run:

- a check *holds* if the whole 95 % interval of the quantity lies in the range, *does not hold* if
  the whole interval lies outside on one side, and is *undecided* otherwise;
- a claim holds if all its checks hold, does not hold if one of them does not, and is undecided
  otherwise;
- runs smaller than the paper's (10 trials x 15,000 episodes) are not judged, nor are costs measured
  with other settings than `CostConfig()`.

What follows was added after the first 200 trials of each case had been seen, since ten trials, and
a hundred, leave three claims undecided:

- more trials of the same settings overrule fewer;
- a claim that these leave undecided, too, is judged by how often ten of them show it, as the
  paper's ten did (`TenTrials`): it holds if 95 % of the draws or more show it, does
  not hold if 5 % or fewer do, and is *inconclusive* in between: it depends on the seeds.
"""

from __future__ import annotations

import csv
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from enum import Enum
from functools import cache, reduce
from importlib.resources import files
from typing import TypeAlias

import msgspec
import numpy as np
from numpy.typing import NDArray

from sdnn.agents.registry import title_of
from sdnn.reports.statistics import (
    BOOTSTRAP_SEED,
    Estimate,
    FloatArray,
    estimate_contrast,
    interval_limits,
    json_number,
)
from sdnn.reproduction.cases import PAPER_CASES, PAPER_EPISODES, PAPER_TRIALS
from sdnn.reproduction.cost import SERIES, CostConfig, CostRecord
from sdnn.runs.results import STEP_MEASURES, CaseResult, MeasureName, TrialMeasures, on_equal_terms

N_DRAWS = 10_000  # of ten trials; this and the next two numbers are chosen
_N_RESAMPLES, _N_DRAWS_OF_EACH = 200, 250
"""Resamples of the trials, for the interval of a chance, and draws of ten from each of them."""

_FILES = files("sdnn.reproduction")


Subject: TypeAlias = tuple[str, str]
"""An agent in a case, by the ids of case and agent."""


def subject_words(subject: Subject) -> str:
    """Return the text of a subject for readers."""
    case = PAPER_CASES[subject[0]]
    noisy = "noisy " if case.noise else ""
    return f"{title_of(subject[1])}, {case.n_sensors} {noisy}inputs"


class Check(msgspec.Struct, frozen=True, kw_only=True, forbid_unknown_fields=True):
    """A quantity, the paper's words, and the range in which it must lie, ends included.

    The quantity is the median of a `measure` over the trials of an agent in a case, `minus` that in
    another case if given; or the time of a step of a `series` with `n_inputs` over that with
    `n_fewer`: a ratio of medians.

    Censored values in a difference count as the last episode of their trial, so a difference
    between late collapses is rather too small than too large.
    """

    paper: str
    at_least: float = -math.inf
    at_most: float = math.inf
    measure: MeasureName | None = None
    case: str = ""
    agent: str = "sdnn-c"
    minus: str = ""
    series: str = ""
    n_inputs: int = 0
    n_fewer: int = 0

    def __str__(self) -> str:
        """Return the quantity in words, as the report's table names it."""
        if self.measure is None:  # the quantity is a ratio of times
            title = next(series.title for series in SERIES if series.id == self.series)
            return f"time per step, {self.n_inputs} inputs / {self.n_fewer} inputs: {title}"
        first, *other = map(subject_words, self.subjects)
        label = f"{self.measure.replace('_', ' ')}: {first}"
        return " minus ".join(
            [label, *(o.removeprefix(f"{title_of(self.agent)}, ") for o in other)]
        )

    @property
    def subjects(self) -> tuple[Subject, ...]:
        """The agents and cases whose trials are compared; empty for times."""
        return tuple((case, self.agent) for case in (self.case, self.minus) if case)

    def samples(self, measured: Mapping[Subject, TrialMeasures]) -> tuple[FloatArray, ...]:
        """Return the trials' values of each subject, (n_trials,)."""
        assert self.measure is not None
        results = [measured[subject] for subject in self.subjects]
        if self.minus:
            return on_equal_terms(self.measure, *results)
        return (results[0].values[self.measure],)

    def contains(self, values: FloatArray) -> NDArray[np.bool_]:
        """Return which values lie in the range."""
        return np.asarray((values >= self.at_least) & (values <= self.at_most))

    def excludes(self, lower: FloatArray, upper: FloatArray) -> NDArray[np.bool_]:
        """Return which intervals lie completely outside of the range, on one side."""
        return np.asarray((upper < self.at_least) | (lower > self.at_most))


class Claim(msgspec.Struct, frozen=True):
    """A claim of the paper: its number in REPRODUCTION.md, its text, and its checks."""

    number: int
    text: str
    checks: tuple[Check, ...]


CLAIMS = msgspec.toml.decode(
    _FILES.joinpath("claims.toml").read_bytes(), type=dict[str, tuple[Claim, ...]]
)["claim"]
"""The paper's nine claims, by their numbers in REPRODUCTION.md."""


class Verdict(Enum):
    """Outcome for a claim or a check; the value is the text for readers.

    Only a claim can be inconclusive: ten of very many trials neither show it nearly always nor
    hardly ever. Undecided are those about which more trials are needed.
    """

    HOLDS = "holds"
    FAILS = "does not hold"
    INCONCLUSIVE = "inconclusive"
    UNDECIDED = "undecided"
    NOT_JUDGED = "not judged"
    NOT_RUN = "not run"


ALWAYS, NEVER = 0.95, 0.05
"""A claim holds from the first share of draws of ten trials on, and does not up to the second."""

_DECISIVE = (Verdict.FAILS, Verdict.NOT_RUN, Verdict.NOT_JUDGED, Verdict.UNDECIDED)
"""Verdicts on a check that are those of its claim, the first one first; otherwise it holds."""


def is_paper_scale(measured: TrialMeasures) -> bool:
    """Return whether there are at least as many trials and episodes as in the paper."""
    return measured.n_trials >= PAPER_TRIALS and measured.last_episode >= PAPER_EPISODES


def verdict_of(check: Check, estimate: Estimate) -> Verdict:
    """Judge a check by its interval: holds inside the range, fails outside, else undecided."""
    interval = np.array([estimate.lower, estimate.upper])
    if check.contains(interval).all():
        return Verdict.HOLDS
    return Verdict.FAILS if check.excludes(interval[:1], interval[1:]).all() else Verdict.UNDECIDED


@dataclass(frozen=True)
class CheckOutcome:
    """A check with the estimate of its quantity, None where its trials were not run.

    `samples` are the values by which it was judged, one array (n_trials,) or the two of a
    difference, none for times. Censored values are infinite, in a difference `last_episode`.
    """

    check: Check
    estimate: Estimate | None
    verdict: Verdict
    samples: tuple[FloatArray, ...] = field(default=(), compare=False, repr=False)
    last_episode: int = PAPER_EPISODES

    def to_json(self) -> dict[str, object]:
        """Return it as values that JSON can hold; what is censored becomes ``">last_episode"``."""
        return {
            "measured": str(self.check),
            "paper": self.check.paper,
            "at_least": json_number(self.check.at_least, None),
            "at_most": json_number(self.check.at_most, None),
            "ours": self.estimate and self.estimate.to_json(self.last_episode),
            "verdict": self.verdict.value,
        }


@dataclass(frozen=True)
class ClaimOutcome:
    """A claim with its checks' outcomes, and its outcome by the larger reference results, if any.

    `chance` is the share of draws of ten trials, from the largest results, that show the claim.
    """

    claim: Claim
    checks: tuple[CheckOutcome, ...]
    more: ClaimOutcome | None = None
    chance: Estimate | None = None

    @property
    def verdict(self) -> Verdict:
        """The verdict by the checks of these trials alone."""
        verdicts = {outcome.verdict for outcome in self.checks}
        return next((verdict for verdict in _DECISIVE if verdict in verdicts), Verdict.HOLDS)

    @property
    def decided(self) -> Verdict:
        """The verdict by the whole rule of this module, including reference results."""
        if self.verdict in (Verdict.NOT_JUDGED, Verdict.NOT_RUN):
            return self.verdict
        best = (self.more or self).verdict
        if best is not Verdict.UNDECIDED or self.chance is None:
            return best
        if self.chance.value >= ALWAYS:
            return Verdict.HOLDS
        return Verdict.FAILS if self.chance.value <= NEVER else Verdict.INCONCLUSIVE

    def to_json(self) -> dict[str, object]:
        """Return it as values that JSON can hold."""
        return {
            "number": self.claim.number,
            "text": self.claim.text,
            "verdict": self.verdict.value,
            "checks": [checked.to_json() for checked in self.checks],
        }


def judge_claims(
    measured: Iterable[TrialMeasures],
    costs: Sequence[CostRecord] = (),
    reference: Iterable[TrialMeasures] = (),
) -> tuple[ClaimOutcome, ...]:
    """Judge the claims with at least one check that the results contain.

    Results may repeat a case that experiments share. Each claim is also judged by the reference
    results, if these contain all of its checks.
    """
    by_subject = {(result.case_id, result.agent): result for result in measured}
    with_more_trials = {(result.case_id, result.agent): result for result in reference}
    draws = TenTrials(with_more_trials.values())
    outcomes = []
    for claim in CLAIMS:
        checks = tuple(_judge_check(check, by_subject, costs) for check in claim.checks)
        outcome = ClaimOutcome(claim, checks)
        reference_checks = (_judge_check(check, with_more_trials, ()) for check in claim.checks)
        by_reference = ClaimOutcome(claim, tuple(reference_checks))
        if by_reference.verdict is not Verdict.NOT_RUN:
            outcome = replace(outcome, more=by_reference, chance=draws.chance(claim))
        outcomes.append(outcome)
    return tuple(o for o in outcomes if any(check.estimate is not None for check in o.checks))


def _judge_check(
    check: Check, measured: Mapping[Subject, TrialMeasures], costs: Sequence[CostRecord]
) -> CheckOutcome:
    """Estimate the quantity of a check, and judge it if it was measured in full."""
    if check.measure is None:
        return _judge_times(check, costs)
    if not measured.keys() >= set(check.subjects):
        return CheckOutcome(check, None, Verdict.NOT_RUN)
    results = [measured[subject] for subject in check.subjects]
    samples = check.samples(measured)
    estimate = (
        estimate_contrast(samples[0], samples[1])
        if check.minus
        else results[0].medians[check.measure]
    )
    is_judged = all(map(is_paper_scale, results))
    verdict = verdict_of(check, estimate) if is_judged else Verdict.NOT_JUDGED
    last_episode = min(result.last_episode for result in results)
    return CheckOutcome(check, estimate, verdict, samples, last_episode)


def _judge_times(check: Check, costs: Sequence[CostRecord]) -> CheckOutcome:
    """Estimate a ratio of times, and judge it if all costs were measured with full effort."""
    times = {c.n_inputs: c.microseconds for c in costs if c.series == check.series}
    if not {check.n_inputs, check.n_fewer} <= times.keys():
        return CheckOutcome(check, None, Verdict.NOT_RUN)
    estimate = estimate_contrast(times[check.n_inputs], times[check.n_fewer], np.divide)
    is_full = all(cost.config_hash == CostConfig().config_hash for cost in costs)
    verdict = verdict_of(check, estimate) if is_full else Verdict.NOT_JUDGED
    return CheckOutcome(check, estimate, verdict)


class TenTrials:
    """Simulated experiments of ten trials, drawn with replacement from a larger number.

    The paper's ten trials are one such draw. A draw shows a claim if the medians lie in the ranges
    of all its checks. The share of draws that show it estimates the chance of an experiment to
    show the claim, also where the trials leave it undecided. All claims share the draws.
    """

    def __init__(self, measured: Iterable[TrialMeasures]) -> None:
        self._measured = {(result.case_id, result.agent): result for result in measured}
        self._draws = cache(self._draw)  # the draws of a subject, made once
        self._met = cache(self._is_met)  # the draws that meet a check

    def chance(self, *claims: Claim) -> Estimate | None:
        """Return the share of the draws that show all the claims.

        The interval is a bootstrap over the trials that are drawn from. None if trials of a check
        are missing, or a claim is about costs.
        """
        checks = [check for claim in claims for check in claim.checks]
        for check in checks:
            if check.measure is None or set(check.subjects) - self._measured.keys():
                return None
        # Draws that meet all checks: from the trials, and from resamples of them.
        met = zip(*map(self._met, checks), strict=True)
        drawn, redrawn = (np.logical_and.reduce(arrays) for arrays in met)
        lower, upper = interval_limits(redrawn.mean(axis=1))
        return Estimate(float(drawn.mean()), float(lower), float(upper))

    def _draw(self, subject: Subject) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
        """Draw indices from the trials, (N_DRAWS, 10), and from resamples of them, (..., 10).

        Each subject has a separate generator.
        """
        generator = np.random.default_rng([BOOTSTRAP_SEED, *subject_words(subject).encode()])
        size = self._measured[subject].n_trials
        drawn = generator.integers(size, size=(N_DRAWS, PAPER_TRIALS))
        resampled = generator.integers(size, size=(_N_RESAMPLES, size))
        shape = (_N_RESAMPLES, _N_DRAWS_OF_EACH * PAPER_TRIALS)
        redrawn = np.take_along_axis(resampled, generator.integers(size, size=shape), axis=1)
        return drawn, redrawn.reshape(_N_RESAMPLES, _N_DRAWS_OF_EACH, PAPER_TRIALS)

    def _is_met(self, check: Check) -> tuple[NDArray[np.bool_], ...]:
        """Return which draws meet a check, (N_DRAWS,), and which draws from resamples do."""
        samples = zip(check.subjects, check.samples(self._measured), strict=True)
        medians = [
            [np.median(values[drawn], axis=-1) for drawn in self._draws(subject)]
            for subject, values in samples
        ]
        # By kind of draw: the median, or the difference of the medians of two subjects.
        quantities = [reduce(np.subtract, by_subject) for by_subject in zip(*medians, strict=True)]
        return tuple(map(check.contains, quantities))


# Reference results: more trials than a run of the paper's ten, on other seeds. They were run by
# ``sdnn reproduce b --trials 100 --seed 1``.

FILE_NAME = "reference-results.csv"
HEADER = ("case", "agent", "config_hash", "root_seed", "trial", "rows_digest", *STEP_MEASURES)
"""Columns of the file beside this one: a row for each trial, with the digest of its rows."""


@dataclass(frozen=True, kw_only=True)
class ReferenceResult(TrialMeasures):
    """The reference results of an agent in a case, with a digest of the rows of each trial."""

    config_hash: str
    root_seed: int
    rows_digests: tuple[str, ...]


@cache
def reference_results() -> tuple[ReferenceResult, ...]:
    """Read the reference results, grouped by case and agent."""
    text = _FILES.joinpath(FILE_NAME).read_text("utf-8")
    groups: dict[tuple[str, ...], list[dict[str, str]]] = {}
    for row in csv.DictReader(text.splitlines()):
        groups.setdefault(tuple(row[name] for name in HEADER[:4]), []).append(row)
    return tuple(
        ReferenceResult(
            case_id=case_id,
            agent=agent,
            last_episode=PAPER_EPISODES,
            values={name: np.array([float(row[name]) for row in group]) for name in STEP_MEASURES},
            config_hash=config_hash,
            root_seed=int(root_seed),
            rows_digests=tuple(row["rows_digest"] for row in group),
        )
        for (case_id, agent, config_hash, root_seed), group in groups.items()
    )


def more_trials(results: Iterable[CaseResult]) -> tuple[ReferenceResult, ...]:
    """Return the reference results with the same settings as, and more trials than, a result."""
    run = {(r.case_id, r.agent, r.config_hash): r.n_trials for r in results}
    return tuple(
        result
        for result in reference_results()
        if result.n_trials > run.get((result.case_id, result.agent, result.config_hash), math.inf)
    )
