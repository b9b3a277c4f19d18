"""The paper's experiments as data: which case, which agents, which figure.

Source: method.md, section 5.3; the paper's sections 4.2 and 4.3. This module
imports nothing heavy, so that the command line may read it at start.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace

from sdnn.support.arguments import one_of

PAPER_TRIALS = 10  # per case; fewer support no conclusion
PAPER_EPISODES = 15_000  # learning episodes per trial
PAPER_INTERVAL = 10  # learning episodes between evaluations

MOST_EPISODES = 10**8
"""Largest number of learning episodes per trial: rows of more tests would fill the memory."""

SENSOR_NOISE = 0.02  # standard deviation of the noise in the paper's Cases II to IV


@dataclass(frozen=True)
class Case:
    """The observations of the agents in one panel of a figure.

    Seeds are derived from `id`: cases that share it share their trials.
    """

    id: str
    title: str
    n_sensors: int  # 4, 5 (with s5) or 6 (with s5 and s6)
    noise: float  # standard deviation in units of the normalized variables
    agents: tuple[str, ...]
    paper_figure: str

    @property
    def settings(self) -> dict[str, str | float]:
        """The environment, by the keys of a specification."""
        return {
            "environment.id": "sdnn/PaperAcrobot-v0",
            "environment.kwargs.sensors.n_sensors": self.n_sensors,
            "environment.kwargs.sensors.noise": self.noise,
        }


@dataclass(frozen=True)
class Experiment:
    """A figure with a panel for each case."""

    id: str
    title: str
    cases: tuple[Case, ...]

    @property
    def pairs(self) -> frozenset[tuple[str, str]]:
        """Ids of the cases and agents whose trials the experiment needs."""
        return frozenset((case.id, agent) for case in self.cases for agent in case.agents)

    def with_agents(self, agents: Iterable[str], presets: Iterable[str] = ()) -> Experiment:
        """Return the experiment with other agents, if any, and additional presets of SDNN-C."""
        chosen = tuple(agents)
        # Without a suffix the agent's preset is that of the paper.
        names = [f"sdnn-c-{name}".removesuffix("-paper") for name in presets]
        cases = (
            replace(case, agents=tuple(dict.fromkeys((*(chosen or case.agents), *names))))
            for case in self.cases
        )
        return replace(self, cases=tuple(cases))


BOTH = ("sdnn-c", "fuzzy")

EXPERIMENTS = (
    Experiment(
        id="a",
        title="Experiment A: redundant inputs without noise",
        cases=(
            Case("s4", "4 inputs", 4, 0.0, ("sdnn-c",), "Fig. 4a"),
            Case("s6", "6 inputs, 2 of them redundant", 6, 0.0, ("sdnn-c",), "Fig. 4b"),
        ),
    ),
    Experiment(
        id="b",
        title="Experiment B: noisy and redundant inputs",
        cases=(
            Case("s4", "Case I: 4 inputs, no noise", 4, 0.0, BOTH, "Fig. 5"),
            Case("s4-noise", "Case II: 4 noisy inputs", 4, SENSOR_NOISE, BOTH, "Fig. 6a"),
            Case("s5-noise", "Case III: 5 noisy inputs", 5, SENSOR_NOISE, BOTH, "Fig. 6b"),
            Case("s6-noise", "Case IV: 6 noisy inputs", 6, SENSOR_NOISE, BOTH, "Fig. 6c"),
        ),
    ),
)
"""The paper's experiments, A and B."""

PAPER_CASES: dict[str, Case] = {case.id: case for e in EXPERIMENTS for case in e.cases}
"""The paper's cases by their ids; a case of two figures has the title of the later one."""


def case_of_sensors(n_sensors: int, noise: float) -> Case:
    """Return the case with these sensors, the paper's if it has one; agents as in experiment B.

    >>> case_of_sensors(6, 0.02).id, case_of_sensors(6, 0.03).id, case_of_sensors(5, 0).id
    ('s6-noise', 's6-noise-0.03', 's5')
    """
    for case in PAPER_CASES.values():
        if (case.n_sensors, case.noise) == (n_sensors, noise):
            return replace(case, agents=BOTH)
    noise = float(noise)
    case_id = f"s{n_sensors}-noise-{noise!r}" if noise else f"s{n_sensors}"
    noise_text = f"noise {noise!r}" if noise else "no noise"
    title = f"{n_sensors} inputs, {noise_text} (not in the paper)"
    return Case(case_id, title, n_sensors, noise, BOTH, "")


COST = "cost"  # name on the command line of the measurement of costs, which has no trials

WORDS = (*(experiment.id for experiment in EXPERIMENTS), COST, "all")
"""Names on the command line of everything that can be reproduced."""


def select_experiments(word: str) -> tuple[Experiment, ...]:
    """Return the experiments that one of `WORDS` stands for; none for ``"cost"``."""
    one_of("experiment", word, WORDS)
    return tuple(e for e in EXPERIMENTS if word in (e.id, "all"))
