"""The paper's experiments as data: which case, which agents, which figure.

Source: spec section 5 (the table of experiments and the list of claims); the paper's sections
4.2 and 4.3. This module imports nothing heavy, so that the command line may read it at start.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

MeasureName = Literal["episodes_to_learn", "final_steps", "final_share_solved"]

PAPER_TRIALS = 10
"""Trials per case in the paper; fewer support no conclusion."""

PAPER_EPISODES = 15_000
"""Learning episodes per trial in the paper."""


@dataclass(frozen=True)
class Agent:
    """An agent that takes part in the experiments.

    Parameters
    ----------
    id
        The word used on the command line and in the result file.
    title
        The word used in figures and tables.
    """

    id: str
    title: str


@dataclass(frozen=True)
class Case:
    """What the agents observe in one panel of a figure.

    Rows with the same `id` observe the same thing, so their trials are shared by experiments.

    Parameters
    ----------
    id
        The word used in the result file; seeds are derived from it.
    title
        Title of the panel.
    n_sensors
        Number of observed variables: 4, 5 (with s5) or 6 (with s5 and s6).
    noise
        Standard deviation of the sensor noise, in units of the normalized variables.
    agents
        Ids of the agents compared.
    paper_figure
        Where the paper shows this case.
    """

    id: str
    title: str
    n_sensors: int
    noise: float
    agents: tuple[str, ...]
    paper_figure: str


@dataclass(frozen=True)
class Claim:
    """A claim of the paper that says: this measure is at most that large.

    Parameters
    ----------
    number
        Number in the spec's list of claims.
    text
        What the paper says.
    measure
        Which of our measures speaks about it.
    limit
        The claim holds where the median of the measure over trials is at most this.
    """

    number: int
    text: str
    measure: MeasureName
    limit: float


@dataclass(frozen=True)
class Experiment:
    """One figure: its cases side by side, and the claims drawn from it.

    Parameters
    ----------
    id
        The word used on the command line.
    title
        Title of the figure.
    cases
        One panel each, in order.
    claims
        What the paper concludes from the figure.
    start_panels
        Whether a small panel below each case shows its first episodes again.
    """

    id: str
    title: str
    cases: tuple[Case, ...]
    claims: tuple[Claim, ...]
    start_panels: bool = False


AGENTS = (Agent("sdnn-c", "SDNN-C"),)

EXPERIMENTS = (
    Experiment(
        id="a",
        title="Experiment A: redundant inputs without noise",
        cases=(
            Case("s4", "4 inputs", 4, 0.0, ("sdnn-c",), "Fig. 4a"),
            Case("s6", "6 inputs, 2 of them redundant", 6, 0.0, ("sdnn-c",), "Fig. 4b"),
        ),
        claims=(
            Claim(1, "learns within about 150 learning episodes", "episodes_to_learn", 150.0),
            Claim(2, "at the end reaches the goal within 10 steps", "final_steps", 10.0),
        ),
        start_panels=True,
    ),
)


def agent_title(agent_id: str) -> str:
    """Title of an agent.

    Raises
    ------
    ValueError
        If no agent has that id.

    Examples
    --------
    >>> agent_title("sdnn-c")
    'SDNN-C'
    """
    for agent in AGENTS:
        if agent.id == agent_id:
            return agent.title
    raise ValueError(f"agent must be one of {[a.id for a in AGENTS]}, got {agent_id!r}")


def select_experiments(name: str) -> tuple[Experiment, ...]:
    """Experiments a command-line word stands for: one of them, or all for ``"all"``.

    Raises
    ------
    ValueError
        If no experiment has that id.
    """
    chosen = tuple(e for e in EXPERIMENTS if name in (e.id, "all"))
    if not chosen:
        raise ValueError(
            f"experiment must be one of {[e.id for e in EXPERIMENTS]} or 'all', got {name!r}"
        )
    return chosen
