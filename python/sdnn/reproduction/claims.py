"""The paper's claims as data: quantities that our data give, and the ranges they must lie in.

Source: method.md, section 5.4; the paper's sections 4.2.2 and 4.3.3. Ranges and
margins were written down before the trials of Experiment B were run; `sdnn.reproduction.verdicts`
says by which rule they are judged.
"""

from __future__ import annotations

import math
from collections.abc import Iterable
from dataclasses import dataclass
from typing import TypeAlias

from sdnn.reproduction.cases import EXPERIMENTS
from sdnn.runs.measures import SHARE_STABLE, MeasureName
from sdnn.runs.registry import cost_series, title_of

EQUAL_STEPS = 2.0
"""Steps by which two agents that do "almost the same" may differ."""


@dataclass(frozen=True)
class Subject:
    """An agent in a case, by their ids."""

    case_id: str
    agent: str = "sdnn-c"

    def __str__(self) -> str:
        """Name of both for a reader."""
        case = next(c for e in EXPERIMENTS for c in e.cases if c.id == self.case_id)
        noisy = "noisy " if case.noise else ""
        return f"{title_of(self.agent)}, {case.n_sensors} {noisy}inputs"


@dataclass(frozen=True)
class Median:
    """The median of a measure over the trials of a subject."""

    measure: MeasureName
    subject: Subject

    @property
    def subjects(self) -> tuple[Subject, ...]:
        """Whose trials are compared."""
        return (self.subject,)


@dataclass(frozen=True)
class Difference:
    """The median of a measure of one subject minus that of another.

    Censored values count as the last episode of their trial, so a difference between late collapses
    is rather too small than too large.
    """

    measure: MeasureName
    subject: Subject
    other: Subject

    @property
    def subjects(self) -> tuple[Subject, ...]:
        """Whose trials are compared."""
        return self.subject, self.other


@dataclass(frozen=True)
class Growth:
    """The time of a step with `n_inputs` over that with `n_fewer`: a ratio of medians."""

    series: str
    n_inputs: int
    n_fewer: int


Quantity: TypeAlias = Median | Difference | Growth


@dataclass(frozen=True)
class Check:
    """A quantity, what the paper says of it, and the range in which it must lie, ends included."""

    quantity: Quantity
    paper: str
    at_least: float = -math.inf
    at_most: float = math.inf


@dataclass(frozen=True)
class Claim:
    """A claim of the paper: its number in the spec's list, its text, and what has to hold."""

    number: int
    text: str
    checks: tuple[Check, ...]


_NOISY = ("s4-noise", "s5-noise", "s6-noise")
_BELOW_STABLE = SHARE_STABLE - 0.02  # the step of a share of 50 tests


def _medians(
    measure: MeasureName, cases: Iterable[str], paper: str, agent: str = "sdnn-c", **limits: float
) -> tuple[Check, ...]:
    return tuple(Check(Median(measure, Subject(case, agent)), paper, **limits) for case in cases)


def _difference(
    measure: MeasureName, case: str, other: str, paper: str, **limits: float
) -> tuple[Check, ...]:
    return (Check(Difference(measure, Subject(case), Subject(other)), paper, **limits),)


CLAIMS = (
    Claim(
        1,
        "SDNN-C learns the swing-up within about 150 learning episodes, with 4 and 6 inputs",
        _medians("episodes_to_learn", ("s4", "s6"), "about 150", at_most=150),
    ),
    Claim(
        2,
        "At the end SDNN-C reaches the goal within 10 steps in both",
        _medians("final_steps", ("s4", "s6"), "within 10", at_most=10),
    ),
    Claim(
        3,
        "FQL learns within about 100 episodes without noise",
        _medians("episodes_to_learn", ("s4",), "about 100", "fuzzy", at_most=100),
    ),
    Claim(
        4,
        "FQL never learns a stable swing-up with noise",
        _medians("final_share_solved", _NOISY, "unstable", "fuzzy", at_most=_BELOW_STABLE),
    ),
    Claim(
        5,
        "SDNN-C in Case II does as well as in Case I in early episodes, worsens from about episode"
        " 7,500 and ends not stably solving",
        (
            *_difference("early_steps", "s4-noise", "s4", "almost equal", at_most=EQUAL_STEPS),
            *_medians(
                "episode_of_collapse", ("s4-noise",), "about 7,500", at_least=5_000, at_most=10_000
            ),
            *_medians("final_share_solved", ("s4-noise",), "not stable", at_most=_BELOW_STABLE),
        ),
    ),
    Claim(
        6,
        "SDNN-C in Case III keeps solving until later than in Case II",
        _difference("episode_of_collapse", "s5-noise", "s4-noise", "later", at_least=10),
    ),
    Claim(
        7,
        "SDNN-C in Case IV ends at about 4 steps, about as in Case I",
        (
            *_medians("final_steps", ("s6-noise",), "about 4", at_most=4 + EQUAL_STEPS),
            *_difference(
                "final_steps", "s6-noise", "s4", "almost the same",
                at_least=-EQUAL_STEPS, at_most=EQUAL_STEPS,
            ),
        ),
    ),
    Claim(
        8,
        "The time SDNN-C needs to learn does not grow with redundant inputs",
        (
            *_difference("episodes_to_learn", "s6", "s4", "does not grow", at_most=15),
            *_difference("episodes_to_learn", "s5-noise", "s4-noise", "does not grow", at_most=15),
            *_difference("episodes_to_learn", "s6-noise", "s4-noise", "does not grow", at_most=15),
        ),
    ),
    Claim(
        9,
        "Cost per step grows quadratically with the number of inputs for SDNN-C, exponentially for"
        " RBFN",
        (
            # l (l - 1) groups of columns: 56 / 12 = 4.7 times as many; half and twice that.
            Check(Growth("sdnn-c", 8, 4), "4.7 times", at_least=2.3, at_most=9.4),
            # At least twice with each input: 16 times with four more.
            Check(Growth("rbf", 8, 4), "exponential", at_least=16),
            Check(Growth("rbf-plain", 8, 4), "exponential", at_least=16),
        ),
    ),
)  # fmt: skip
"""The paper's nine claims, by their numbers in the spec's list."""


def describe(quantity: Quantity) -> str:
    """Describe for a reader what is measured on whom.

    >>> describe(Growth("rbf", 8, 4))
    'time per step, 8 inputs / 4 inputs: RBFN, factored'
    """
    if isinstance(quantity, Growth):
        titles = {series.id: series.title for _, series in cost_series()}
        return (
            f"time per step, {quantity.n_inputs} inputs / {quantity.n_fewer} inputs:"
            f" {titles[quantity.series]}"
        )
    words = quantity.measure.replace("_", " ")
    if isinstance(quantity, Difference):
        title = title_of(quantity.subject.agent)
        fewer = str(quantity.other).removeprefix(f"{title}, ")
        return f"{words}: {quantity.subject} less {fewer}"
    return f"{words}: {quantity.subject}"
