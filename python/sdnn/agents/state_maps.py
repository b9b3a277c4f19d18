"""Values and actions of an agent over one or two inputs, and over a greedy episode."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from sdnn.agents.inspection import (
    MOST_STEPS,
    AgentInput,
    Flags,
    Floats,
    Reader,
    States,
    WatchedAgent,
)
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


N_ON_MAP, N_ON_CURVE = 49, 301  # points of a numeric axis, with two inputs and with one; chosen


def map_of(
    reader: Reader, states: States, chosen: Sequence[AgentInput], inputs: Sequence[AgentInput]
) -> StateMap:
    """Return values and actions over one or two chosen inputs, the others as typical of the states.

    A numeric axis covers the states met, a symbolic one the symbols met. With masks, values and
    actions are those of actions that were allowed in the nearest state met.
    """
    n_points = N_ON_CURVE if len(chosen) == 1 else N_ON_MAP
    met = states.rows
    axes = tuple(_axis(agent_input, met, n_points) for agent_input in chosen)
    grids = np.meshgrid(*axes)
    shape = grids[0].shape
    rows = np.repeat(met[:1], grids[0].size, axis=0)
    typical = {}
    for agent_input in inputs:
        if agent_input not in chosen:
            number = agent_input.typical(met)
            agent_input.write(rows, np.full(len(rows), number))
            if agent_input.is_used:
                typical[agent_input.name] = number
    for agent_input, grid in zip(chosen, grids, strict=True):
        agent_input.write(rows, grid.ravel())
    reading = reader.read(States(rows, _allowed_on(axes, chosen, states)))
    return StateMap(
        tuple(chosen),
        axes,
        reading.values.reshape(shape),
        reading.actions.reshape(*shape, -1),
        typical,
    )


def _allowed_on(
    axes: Sequence[Floats], chosen: Sequence[AgentInput], states: States
) -> Flags | None:
    """Return which actions are allowed at the points of a map: those of the nearest state met."""
    if states.allowed is None:
        return None
    numbers = [agent_input.numbers(states.rows) for agent_input in chosen]
    shape = tuple(len(axis) for axis in reversed(axes))
    least, nearest = np.full(shape, np.inf), np.zeros(shape, np.int64)
    for state in range(len(states.rows)):
        distance = np.zeros(shape)
        for i, (axis, agent_input) in enumerate(zip(axes, chosen, strict=True)):
            # In units of the axis; the least divisor avoids 0 / 0 on an axis of one value.
            away = np.abs(axis - numbers[i][state]) / max(np.ptp(axis), 1e-300)
            if agent_input.has_symbols:
                # Symbols have no order: any other one is farther than a range is wide.
                away = (away > 0.0) * 2.0
            distance += np.square(away).reshape(-1, *[1] * i)
        is_nearer = distance < least
        least[is_nearer], nearest[is_nearer] = distance[is_nearer], state
    return states.allowed[nearest.ravel()]


def _axis(agent_input: AgentInput, states: Floats, n_points: int) -> Floats:
    """Return the numbers of an input on a map: its symbols, or n points of its range."""
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
    totals = []  # the sum of rewards at the reset, 0, and after each step
    for now in greedy_episode(watched, env, seed, 0, options):
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
