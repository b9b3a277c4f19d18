"""The agents that take part in runs: one entry for each, and nothing about them elsewhere.

A new agent is one class and one entry. An agent of one's own takes part after it is registered::

    register(AgentEntry(id="mine", title="Mine", approximator=MyTable, learning=MyRule, agent=Mine))
    sdnn.cli.main(["reproduce", "b", "--agent", "mine", "--agent", "sdnn-c"])
"""

from __future__ import annotations

import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any

from sdnn import _core
from sdnn.agents.actor_critic import SDNNActorCritic
from sdnn.agents.agent import AnyAgent
from sdnn.agents.fuzzy_q_learning import FuzzyQLearning
from sdnn.agents.presets import Preset
from sdnn.agents.q_lambda import SDNNQLambda
from sdnn.agents.q_learning import RBFQLearning, SDNNQLearning
from sdnn.support.arguments import argument_error, shown
from sdnn.training.interfaces import Learner
from sdnn.training.training import Training


@dataclass(frozen=True, kw_only=True)
class AgentEntry:
    """An agent that runs can choose.

    Parameters
    ----------
    id
        The word used on the command line and in the result file.
    title
        The word used in figures and tables.
    approximator
        Settings of what the agent learns with: a frozen dataclass of plain values, with the
        defaults of the experiments. Its field ``n_inputs``, if any, is filled in.
    learning
        Settings of how the agent learns and explores: another such dataclass.
    agent
        The agent in Python, a `Learner`: made from an observation space, an action space and
        ``approximator=``, ``learning=``, ``seed=``.
    training
        What it learns in, with the arguments of `sdnn.agents.Training`: a subclass for an agent
        that brings its own loop.
    core_trial
        The trial in C++, made from the core's structs of the settings; an agent without one runs in
        its training.
    advances_together
        Whether trials of the agent are faster together, by ``core_trial.advance_together``: its
        steps take little longer than the acrobot's.
    table_bytes
        Memory of what is learned under settings of ``approximator``; None if it is not known.
    step_work
        Estimate of the operations of a step under settings of ``approximator``, beside those of
        other agents; None if it is not known. Of trials, those with more work begin first.
    presets
        Settings of both by their names, of which a run chooses one; none: their defaults.
    version
        Of the agent's code. Stored trials of another version are not reused.
    """

    id: str
    title: str
    approximator: type[Any]
    learning: type[Any]
    agent: Callable[..., Learner]
    training: Callable[..., Training] = Training
    core_trial: Callable[..., Any] | None = None
    advances_together: bool = False
    table_bytes: Callable[[Any], int] | None = None
    step_work: Callable[[Any], int] | None = None
    presets: Mapping[str, Preset] = field(default_factory=dict)
    version: str = ""

    def settings(self, preset: str | None) -> Preset:
        """Return the settings of a preset; None: the defaults."""
        if preset is None:
            return Preset("", self.approximator(), self.learning())
        return self.presets[preset]


AGENTS: dict[str, AgentEntry] = {}
"""All agents by id, in the order in which they were registered."""


def register(entry: AgentEntry) -> None:
    """Register an agent, so that runs and studies can choose it.

    ValueError if the id cannot be part of a file's name, or an agent has it already.
    """
    if not re.fullmatch(r"\w[\w.-]*", entry.id):
        raise ValueError(f"id must be of letters, digits, '_', '.' and '-', got {shown(entry.id)}")
    if entry.id in AGENTS:
        raise ValueError(f"id must be a new one: an agent {entry.id!r} is already registered")
    AGENTS[entry.id] = entry


def label_of(agent_id: str, preset: str | None) -> str:
    """Return the label of an agent with a preset, as the command line has it.

    >>> label_of("sdnn-c", "robust"), label_of("sdnn-c", "paper")
    ('sdnn-c-robust', 'sdnn-c')
    """
    return agent_id if preset in (None, "paper") else f"{agent_id}-{preset}"


def labels() -> tuple[str, ...]:
    """Return all labels: agents' ids, and ``ID-PRESET`` for every preset but ``"paper"``."""
    pairs = ((entry.id, preset) for entry in AGENTS.values() for preset in entry.presets)
    return tuple(dict.fromkeys((*AGENTS, *(label_of(*pair) for pair in pairs))))


def split_label(label: str) -> tuple[str, str | None]:
    """Split a label into the agent's id and its preset; None for the default preset.

    ValueError if there is no such agent.

    >>> split_label("sdnn-c-robust")
    ('sdnn-c', 'robust')
    """
    if isinstance(label, str) and label in AGENTS:
        return label, None
    for entry in AGENTS.values():
        for preset in entry.presets:
            if isinstance(label, str) and label == f"{entry.id}-{preset}":
                return entry.id, preset
    raise argument_error("agent", f"must be one of {', '.join(labels())}, got {shown(label)}")


def agent_entry(label: str) -> AgentEntry:
    """Look up an agent by its label; ValueError if there is no such agent.

    >>> agent_entry("sdnn-c-robust").title
    'SDNN-C'
    """
    return AGENTS[split_label(label)[0]]


def title_of(label: str) -> str:
    """Return the title of a label for readers; ValueError if there is no such agent.

    >>> title_of("sdnn-c-robust")
    'SDNN-C, robust'
    """
    name, preset = split_label(label)
    return AGENTS[name].title + (f", {preset}" if preset else "")


def _register(
    agent: type[AnyAgent], title: str, presets: Mapping[str, Preset] | None = None, **options: Any
) -> None:
    """Register an agent of this package; its id is the name in its files."""
    entry = AgentEntry(
        id=agent.kind,
        title=title,
        approximator=agent.approximator_type,
        learning=agent.learning_type,
        agent=agent,
        core_trial=_core.AcrobotTrial,
        presets=presets or {},
        **options,
    )
    register(entry)


_register(
    SDNNQLearning,
    "SDNN-C",
    SDNNQLearning.presets,
    table_bytes=lambda net: net.n_pattern_units * net.n_pairs * net.n_hidden_units,
    step_work=lambda net: net.n_pairs * net.n_hidden_units,
)
_register(
    FuzzyQLearning,
    "FQL",
    advances_together=True,
    table_bytes=lambda rules: 4 * rules.n_sets**rules.n_inputs * rules.n_actions,
    step_work=lambda rules: 2**rules.n_inputs * rules.n_actions,
)
_register(
    RBFQLearning,
    "RBFN",
    advances_together=True,
    table_bytes=lambda network: 8 * network.n_bases ** (network.n_inputs + 1),
    step_work=lambda network: network.n_bases ** (network.n_inputs + 1),
)
_register(SDNNQLambda, "SDNNQLambda", SDNNQLambda.presets)
_register(SDNNActorCritic, "SDNNActorCritic", SDNNActorCritic.presets)
