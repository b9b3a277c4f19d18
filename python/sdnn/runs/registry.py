"""The agents that take part in experiments: one entry for each, and nothing about them elsewhere.

A new agent is one class and one entry. An agent of one's own takes part after it is registered::

    register(AgentEntry(id="mine", title="Mine", approximator=MyTable, learning=MyRule, agent=Mine))
    sdnn.cli.main(["reproduce", "b", "--agent", "mine", "--agent", "sdnn-c"])
"""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from sdnn import _core
from sdnn.agents import (
    PRESETS,
    FuzzyQLearning,
    FuzzyQLearningConfig,
    Preset,
    QLearningConfig,
    RBFQLearning,
    SDNNQLearning,
    Training,
)
from sdnn.agents.episode import Learner
from sdnn.approximators import FuzzyRulesConfig, RBFNetworkConfig, SDNNCConfig

if TYPE_CHECKING:
    from sdnn.runs.trial import Trial

_BYTES_OF_FLOAT, _BYTES_OF_DOUBLE = 4, 8


@dataclass(frozen=True, kw_only=True)
class CostSeries:
    """A curve in the figure of costs: an agent, evaluated in one way.

    Parameters
    ----------
    id
        The word used in the result file.
    title
        The word used in figures and tables.
    growth
        What the number of operations is proportional to, for a reader (mathtext).
    learned_bytes
        Gives the memory of what the agent learns, from its approximator's settings.
    settings
        Settings of the approximator that are not the default.
    core_agent
        Makes the compiled agent from the core's ``approximator=``, ``learning=`` and ``seed=``;
        default the one inside the Python agent (its ``core``).
    is_plain
        Whether its product structure is left unused: seconds a step with many inputs.
    """

    id: str
    title: str
    growth: str
    learned_bytes: Callable[[Any], int]
    settings: Mapping[str, Any] = field(default_factory=dict)
    core_agent: Callable[..., Any] | None = None
    is_plain: bool = False


@dataclass(frozen=True, kw_only=True)
class AgentEntry:
    """Everything that experiments have to know about an agent.

    Parameters
    ----------
    id
        The word used on the command line and in the result file.
    title
        The word used in figures and tables.
    version
        Of the agent's code: another one where it changed, so that trials of before do not count as
        its own. It is part of what is stored of a trial.
    approximator
        Settings of what the agent learns with: a frozen dataclass of plain values whose defaults
        are those of the experiments; it has a field ``n_inputs``.
    learning
        Settings of how the agent learns and explores: another such dataclass.
    presets
        Settings of both by their names, of which a run chooses one; none: their defaults.
    agent
        The agent in Python, a `Learner`: made from an observation space, an action space and
        ``approximator=``, ``learning=``, ``seed=``.
    training
        What it learns in, with the arguments of `sdnn.agents.Training`: a subclass for an agent
        that brings its own loop.
    core_trial
        The trial in C++, made from the core's structs of the settings; an agent without one runs in
        its training.
    costs
        Its curves in the figure of costs, for agents of the core: the time of a Python agent would
        be the interpreter's.
    """

    id: str
    title: str
    approximator: type[Any]
    learning: type[Any]
    agent: Callable[..., Learner]
    training: Callable[..., Training] = Training
    core_trial: Callable[..., Trial] | None = None
    presets: Mapping[str, Preset] = field(default_factory=dict)
    costs: tuple[CostSeries, ...] = ()
    version: str = ""

    def parts(self, preset: str | None) -> tuple[Any, Any]:
        """Return the settings of approximator and learning under a preset; None: the defaults."""
        if preset is None:
            return self.approximator(), self.learning()
        return self.presets[preset].approximator, self.presets[preset].learning


AGENTS: dict[str, AgentEntry] = {}
"""All agents by id, in the order in which they were registered."""


def register(entry: AgentEntry) -> None:
    """Let an agent take part.

    Raises
    ------
    ValueError
        If the id is no word for file names, or an agent or series of that id is there already.
    """
    if not re.fullmatch(r"\w[\w.-]*", entry.id):
        raise ValueError(f"id must be of letters, digits, '_', '.' and '-', got {entry.id!r}")
    if entry.id in AGENTS:
        raise ValueError(f"an agent {entry.id!r} is already registered")
    known = {series.id for _, series in cost_series()}
    for series in entry.costs:
        if series.id in known:
            raise ValueError(f"a series {series.id!r} is already registered")
        known.add(series.id)
    AGENTS[entry.id] = entry


def labels() -> tuple[str, ...]:
    """Return the words for all agents: ids, and ``ID-PRESET`` for presets but ``"paper"``."""
    presets = (f"{e.id}-{name}" for e in AGENTS.values() for name in e.presets if name != "paper")
    return (*AGENTS, *presets)


def label_of(agent_id: str, preset: str | None) -> str:
    """Return the word for an agent with a preset.

    Examples
    --------
    >>> label_of("sdnn-c", "robust"), label_of("sdnn-c", "paper")
    ('sdnn-c-robust', 'sdnn-c')
    """
    return agent_id if preset in (None, "paper") else f"{agent_id}-{preset}"


def split_label(label: str) -> tuple[str, str | None]:
    """Return the agent and the preset that a word stands for; None: the default.

    Raises
    ------
    ValueError
        If there is no such agent.

    Examples
    --------
    >>> split_label("sdnn-c-robust")
    ('sdnn-c', 'robust')
    """
    if label in AGENTS:
        return label, None
    for entry in AGENTS.values():
        for preset in entry.presets:
            if label == f"{entry.id}-{preset}":
                return entry.id, preset
    raise ValueError(f"agent must be one of {', '.join(labels())}, got {label!r}")


def agent_entry(label: str) -> AgentEntry:
    """Look up an agent by its word.

    Raises
    ------
    ValueError
        If there is no such agent.

    Examples
    --------
    >>> agent_entry("sdnn-c-robust").title
    'SDNN-C'
    """
    return AGENTS[split_label(label)[0]]


def title_of(label: str) -> str:
    """Return the title of an agent by its word; ValueError if there is no such agent.

    Examples
    --------
    >>> title_of("sdnn-c-robust")
    'SDNN-C, robust'
    """
    name, preset = split_label(label)
    return AGENTS[name].title + (f", {preset}" if preset else "")


def cost_series(agents: Iterable[str] | None = None) -> tuple[tuple[AgentEntry, CostSeries], ...]:
    """List the curves of some agents (default: all) in the figure of costs, each with its agent.

    Raises
    ------
    ValueError
        If no agent has one of the ids.
    """
    words = AGENTS if agents is None else agents
    entries = [agent_entry(word) for word in words if split_label(word)[1] is None]
    return tuple((entry, series) for entry in entries for series in entry.costs)


def _sdnn_c_bytes(network: SDNNCConfig) -> int:
    return network.n_pattern_units * network.n_pairs * network.n_hidden_units


def _rules_bytes(rules: FuzzyRulesConfig) -> int:
    return int(rules.n_sets**rules.n_inputs) * rules.n_actions * _BYTES_OF_FLOAT


def _rbf_bytes(network: RBFNetworkConfig) -> int:
    return int(network.n_bases ** (network.n_inputs + 1)) * _BYTES_OF_DOUBLE


register(
    AgentEntry(
        id="sdnn-c",
        title="SDNN-C",
        approximator=SDNNCConfig,
        learning=QLearningConfig,
        agent=SDNNQLearning,
        core_trial=_core.AcrobotTrial,
        presets=PRESETS,
        costs=(
            CostSeries(
                id="sdnn-c",
                title="SDNN-C",
                growth="$d(d-1)$ groups of columns",
                learned_bytes=_sdnn_c_bytes,
            ),
        ),
    )
)
register(
    AgentEntry(
        id="fuzzy",
        title="FQL",
        approximator=FuzzyRulesConfig,
        learning=FuzzyQLearningConfig,
        agent=FuzzyQLearning,
        core_trial=_core.FuzzyAcrobotTrial,
        costs=(
            CostSeries(
                id="fuzzy",
                title="FQL",
                growth="$2^d$ fired rules of $9^d$",
                learned_bytes=_rules_bytes,
                # With 8 inputs it has 3.6 GB, nearly all untouched.
                settings={"max_table_bytes": 2**32},
            ),
        ),
    )
)
register(
    AgentEntry(
        id="rbf",
        title="RBFN",
        approximator=RBFNetworkConfig,
        learning=QLearningConfig,
        agent=RBFQLearning,
        core_trial=_core.RBFAcrobotTrial,
        costs=(
            CostSeries(
                id="rbf",
                title="RBFN, factored",
                growth="$4^{d+1}$ weights",
                learned_bytes=_rbf_bytes,
            ),
            CostSeries(
                id="rbf-plain",
                title="RBFN, plain",
                growth="$601 \\cdot 4^{d+1}$ basis values",
                learned_bytes=_rbf_bytes,
                core_agent=_core.PlainRBFQLearning,
                is_plain=True,
            ),
        ),
    )
)
