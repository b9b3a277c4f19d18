"""Values and actions of an agent over one or two inputs, and over a greedy episode."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sdnn.agents.inspection import MOST_STEPS, AgentInput, Floats, Reader, WatchedAgent
from sdnn.environments.types import Data, Env
from sdnn.training.evaluation import greedy_episode


@dataclass(frozen=True)
class StateMap:
    """Values and greedy actions over one or two inputs, others as they typically are.

    ``axes`` are the numbers of each input; ``values`` have the shape of the axes, the second one
    first; ``actions`` also a last axis of the action's dimensions. ``typical`` are the numbers of
    the other inputs.
    """

    inputs: tuple[AgentInput, ...]
    axes: tuple[Floats, ...]
    values: Floats
    actions: Floats
    typical: dict[str, float]


N_ON_MAP, N_ON_CURVE = 49, 301


def map_of(
    reader: Reader, states: Floats, chosen: Sequence[AgentInput], inputs: Sequence[AgentInput]
) -> StateMap:
    """Return values and actions over one or two chosen inputs, the others as typical of the states.

    A numeric axis covers the states met, a symbolic one the symbols met.
    """
    n_points = N_ON_CURVE if len(chosen) == 1 else N_ON_MAP
    axes = tuple(_axis(agent_input, states, n_points) for agent_input in chosen)
    grids = np.meshgrid(*axes)
    shape = grids[0].shape
    rows = np.repeat(states[:1], grids[0].size, axis=0)
    typical = {}
    for agent_input in inputs:
        if agent_input not in chosen:
            number = agent_input.typical(states)
            agent_input.place(rows, np.full(len(rows), number))
            if agent_input.is_used:
                typical[agent_input.name] = number
    for agent_input, grid in zip(chosen, grids, strict=True):
        agent_input.place(rows, grid.ravel())
    reading = reader.read(rows)
    return StateMap(
        tuple(chosen),
        axes,
        reading.values.reshape(shape),
        reading.actions.reshape(*shape, -1),
        typical,
    )


def _axis(agent_input: AgentInput, states: Floats, n_points: int) -> Floats:
    if agent_input.has_symbols:
        return np.unique(agent_input.numbers(states))
    return np.linspace(*agent_input.limits(states), n_points)


@dataclass(frozen=True)
class Replay:
    """A greedy episode step by step.

    States (n_steps, n_variables) with NaN for missing readings, values (n_steps,), actions
    (n_steps, n_dimensions), and the rewards that followed them (n_steps,).
    """

    states: Floats
    values: Floats
    actions: Floats
    rewards: Floats
    terminated: bool

    @property
    def total_reward(self) -> float:
        """The undiscounted return of the steps."""
        return float(self.rewards.sum())


def replay(reader: Reader, env: Env, seed: int | None = 0, options: Data | None = None) -> Replay:
    """Run a greedy episode, the first of an evaluation with the same seed, of at most `MOST_STEPS`.

    Nothing is learned.
    """
    watched = WatchedAgent(reader.agent, reader=reader)
    totals = [0.0]
    for now in greedy_episode(watched, env, seed, 0, options):
        if now.n_steps:
            totals.append(now.total_reward)
        if now.n_steps == MOST_STEPS:
            break
    return Replay(
        states=np.array(watched.states),
        values=np.array(watched.values),
        actions=np.array(watched.actions),
        rewards=np.diff(totals),
        terminated=now.terminated,
    )
