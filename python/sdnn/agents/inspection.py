"""Read from an agent which inputs matter, and its values and actions over two of them.

States are rows of observed variables, (n, n_variables), as an agent's observation space flattens
them. Each counts as the first observation of an episode, for agents whose states have a history.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, TypeAlias

import gymnasium as gym
import numpy as np
from numpy.typing import NDArray

from sdnn.agents.base import BaseAgent
from sdnn.environments.types import Data, Element, Env, Mask, Space
from sdnn.support.arguments import require
from sdnn.support.habits import advice
from sdnn.training.evaluation import greedy_episode

Floats: TypeAlias = NDArray[np.float64]
Flags: TypeAlias = NDArray[np.bool_]
AnyAgent: TypeAlias = BaseAgent[Any, Any]
InputType: TypeAlias = Literal["variable", "circular", "angle", "symbol"]

# Chosen numbers, not measured ones.
MOST_STATES = 1_000  # largest number of states from which influences are estimated
MOST_READS, MOST_SLOW_READS = 40_000, 10_000
"""Number of reads for influences, and of agents with slower networks: inputs share them."""
MOST_STEPS = 2_000  # steps in which states are met
SHARE_RANDOM = 0.1  # share of random actions with which states are met beside the greedy path
N_SHUFFLES = 2  # how often each input is shuffled


@dataclass(frozen=True)
class AgentInput:
    """An input of an agent's states, or observed variables that are in no input.

    ``columns`` are the numbers of the observed variables: of an angle its cosine and sine, of a
    symbol one for each value.
    """

    name: str
    type: InputType
    columns: tuple[int, ...]
    is_used: bool = True

    @property
    def has_symbols(self) -> bool:
        """Whether its values are symbols without an order."""
        return self.type == "symbol"

    def numbers(self, states: Floats) -> Floats:
        """Return a number for each state: the variable, degrees of an angle, or the symbol."""
        values: Floats = states[:, list(self.columns)]
        if self.type == "angle":
            degrees: Floats = np.degrees(np.arctan2(values[:, 1], values[:, 0]))
            return degrees
        if self.has_symbols:
            symbols: NDArray[np.int64] = np.argmax(values, axis=1)
            return symbols.astype(np.float64)
        return values[:, 0]

    def write(self, states: Floats, numbers: Floats) -> None:
        """Write numbers, as `numbers` returns them, into the columns of states."""
        if self.type == "angle":
            radians = np.radians(numbers)
            states[:, list(self.columns)] = np.stack([np.cos(radians), np.sin(radians)], axis=1)
        elif self.has_symbols:
            states[:, list(self.columns)] = np.eye(len(self.columns))[numbers.astype(np.int64)]
        else:
            states[:, self.columns[0]] = numbers

    def typical(self, states: Floats) -> float:
        """Return the median over states; of angles the mean direction, of symbols the mode."""
        numbers = self.numbers(states)
        if self.type == "angle":
            sines, cosines = np.sin(np.radians(numbers)), np.cos(np.radians(numbers))
            return math.degrees(math.atan2(float(sines.mean()), float(cosines.mean())))
        if self.has_symbols:
            return float(np.bincount(numbers.astype(np.int64)).argmax())
        return float(np.median(numbers))

    def limits(self, states: Floats) -> tuple[float, float]:
        """Return the range of the states met, without the lowest and the highest hundredth."""
        if self.type == "angle":
            return -180.0, 180.0
        low, high = np.percentile(self.numbers(states), (1, 99)).tolist()
        return (low, high) if low < high else (low - 0.5, high + 0.5)  # figures need a width


def variable_names(space: Space, prefix: str = "") -> list[str]:
    """Return a name for each variable of a flattened space: keys of a Dict, and numbers.

    >>> space = gym.spaces.Dict(gear=gym.spaces.Discrete(2), speed=gym.spaces.Box(-1, 1, (2,)))
    >>> variable_names(space)
    ['gear = 0', 'gear = 1', 'speed[0]', 'speed[1]']
    """
    if isinstance(space, gym.spaces.Dict):
        parts = ((f"{prefix}.{key}" if prefix else str(key), part) for key, part in space.items())
        return [name for key, part in parts for name in variable_names(part, key)]
    if isinstance(space, gym.spaces.Tuple):
        parts = ((f"{prefix}[{i}]", part) for i, part in enumerate(space))
        return [name for key, part in parts for name in variable_names(part, key)]
    n_variables = gym.spaces.flatdim(space)
    if isinstance(space, gym.spaces.Discrete):
        start = int(space.start)
        return [f"{prefix or 'observation'} = {start + i}" for i in range(n_variables)]
    if not prefix:
        return [f"observation {i}" for i in range(n_variables)]
    return [prefix] if n_variables == 1 else [f"{prefix}[{i}]" for i in range(n_variables)]


def inputs_of(agent: AnyAgent) -> list[AgentInput]:
    """Return the inputs of an agent's states, then the observed variables that are in none.

    RuntimeError while the agent is warming up.
    """
    require_learned(agent)
    names = variable_names(agent.observation_space)
    n_values_of = {first: n for first, n in agent._observation.symbols}  # by the first variable
    inputs: list[AgentInput] = []
    for input_type, variables in agent._controller.inputs:
        if input_type == "symbol":
            first, n_values = variables
            inputs.append(_symbol(names, first, n_values))
        elif input_type == "angle":
            name = f"angle of {names[variables[0]]} and {names[variables[1]].split()[-1]}"
            inputs.append(AgentInput(name, "angle", tuple(variables)))
        else:
            numeric: InputType = "circular" if input_type == "circular" else "variable"
            inputs.append(AgentInput(names[variables[0]], numeric, tuple(variables)))
    inputs = list(dict.fromkeys(inputs))  # a code of a single input has it twice
    inside = {column for agent_input in inputs for column in agent_input.columns}
    column = 0
    while column < len(names):
        n_variables = n_values_of.get(column, 1)
        if column not in inside and column in n_values_of:
            inputs.append(_symbol(names, column, n_variables, is_used=False))
        elif column not in inside:
            inputs.append(AgentInput(names[column], "variable", (column,), is_used=False))
        column += n_variables
    return inputs


def _symbol(names: list[str], first: int, n: int, *, is_used: bool = True) -> AgentInput:
    """Return the input of a symbol: n variables from the first one on, one for each value."""
    name = names[first].partition(" = ")[0]
    return AgentInput(name, "symbol", tuple(range(first, first + n)), is_used)


def require_learned(agent: AnyAgent) -> None:
    """Raise a RuntimeError while the agent is warming up."""
    if agent.is_warming_up:
        raise RuntimeError(
            "the agent is still warming up: it acts at random, and has learned nothing to inspect"
        )


class States(NamedTuple):
    """States that were met: rows of variables (n, n_variables).

    ``allowed`` are the actions that a mask allowed in each, of all dimensions, (n, n_actions); None
    without masks.
    """

    rows: Floats
    allowed: Flags | None = None

    def chosen(self, which: Any) -> States:
        """Return the states of these numbers, or where flags are set."""
        return States(self.rows[which], None if self.allowed is None else self.allowed[which])

    def thinned(self, n_most: int) -> States:
        """Return at most a number of states, evenly spaced."""
        n = min(len(self.rows), n_most)
        return self.chosen(np.linspace(0, len(self.rows) - 1, n).astype(np.int64))


class Reading(NamedTuple):
    """The knowledge of an agent about states: a row for each state.

    ``action_values`` of all actions, or of the state where an agent has no values of actions,
    (n, n_values), and which of them are ``allowed``; ``values`` of the best action (n,);
    ``actions``, the numbers of a greedy action, (n, n_dimensions).
    """

    action_values: Floats
    allowed: Flags
    values: Floats
    actions: Floats


class Reader:
    """Reads values and greedy actions of states from an agent, and changes nothing that it learned.

    RuntimeError while the agent is warming up.
    """

    def __init__(self, agent: AnyAgent) -> None:
        require_learned(agent)
        self.agent = agent
        self._core = agent._controller
        self._has_state_values = agent.kind in ("actor-critic", "fuzzy")
        self._n_dimensions = len(agent._action.low)

    @property
    def value_name(self) -> str:
        """The name of the values of states."""
        return "V(s)" if self._has_state_values else "max Q(s, a)"

    def begin_episode(self) -> None:
        """Begin a greedy episode: the next state counts as its first observation."""
        self.agent.begin_greedy_episode()

    def value(self, state: Floats, mask: Flags | None = None) -> float:
        """Return the value of a state: that of its best action, of those that a mask allows."""
        return self._value_of(self._allowed_parts(self._parts(state), mask))

    def read(self, states: States) -> Reading:
        """Read states, each as the first observation of an episode.

        Of several best actions it is the first, so that equal values give equal actions.
        """
        self.begin_episode()
        # For each state and dimension of the action: the values of all actions.
        all_parts = [self._parts(state) for state in states.rows]
        masks = [None] * len(all_parts) if states.allowed is None else list(states.allowed)
        parts = [self._allowed_parts(*pair) for pair in zip(all_parts, masks, strict=True)]
        values = np.array([self._value_of(of_state) for of_state in parts])
        if self._has_state_values:
            pairs = zip(states.rows, masks, strict=True)
            actions = np.array([self._act(state, mask) for state, mask in pairs])
        else:
            action_of = self._core.action_of  # the number of an action from its index
            actions = np.array(
                [
                    [action_of(int(np.argmax(part)), d) for d, part in enumerate(of_state)]
                    for of_state in parts
                ]
            )
        action_values = np.array([np.concatenate(of_state) for of_state in all_parts])
        allowed = np.isfinite([np.concatenate(of_state) for of_state in parts])
        return Reading(action_values, allowed, values, actions)

    def _allowed_parts(self, parts: list[Floats], mask: Flags | None) -> list[Floats]:
        """Return values of actions, those that a mask forbids as minus infinity."""
        if mask is None or self._has_state_values:
            return parts
        masks = np.split(mask, np.cumsum(self._core.n_actions)[:-1])
        return [np.where(flags, part, -np.inf) for flags, part in zip(masks, parts, strict=True)]

    def _parts(self, state: Floats) -> list[Floats]:
        """Return the values of all actions of each dimension, or an actor-critic's state value."""
        if self.agent.kind == "actor-critic":
            return [np.array([self._core.state_value(state)])]
        return [self._core.values(state, d) for d in range(self._n_dimensions)]

    def _value_of(self, parts: list[Floats]) -> float:
        """Return the value of the best action: with Q(lambda) the sum over dimensions, or mean."""
        best = [float(part.max()) for part in parts]
        return sum(best) if self.agent.kind == "q-lambda" else sum(best) / len(best)

    def _act(self, state: Floats, mask: Flags | None) -> Floats:
        """Return the greedy action in a state as the first of an episode."""
        self.begin_episode()
        allowed = None if mask is None else mask.astype(np.uint8)
        return np.ravel(self._core.act(state, False, 0, allowed))


class WatchedAgent:
    """An agent in greedy episodes whose observations and actions are noted, and with them values.

    ``random_action`` may return an action to take instead of the greedy one; ``reader`` reads the
    value of each state.
    """

    def __init__(
        self,
        agent: AnyAgent,
        *,
        random_action: Callable[[Mask], Element | None] = lambda _: None,
        reader: Reader | None = None,
    ) -> None:
        self._agent, self._random_action, self._reader = agent, random_action, reader
        self.wrappers = agent.wrappers
        self.states: list[Floats] = []
        self.masks: list[Flags | None] = []
        self.values: list[float] = []
        self.actions: list[Floats] = []

    def begin_greedy_episode(self) -> None:
        """Begin an episode of the agent."""
        self._agent.begin_greedy_episode()

    def act(self, observation: Element, explore: bool = False, mask: Mask = None) -> Element:
        """Return the agent's action, or a random one in its place; record state and action."""
        state = self._agent.flat_observation(observation)
        self.states.append(state)
        allowed = self._agent._actions.mask("mask", mask)
        self.masks.append(None if allowed is None else allowed.astype(np.bool_))
        if self._reader is not None:
            self.values.append(self._reader.value(state, self.masks[-1]))
        action = self._agent.act(observation, explore, mask=mask)
        random = self._random_action(mask)
        action = action if random is None else random
        self.actions.append(np.ravel(np.asarray(action, np.float64)))
        return action


def meet_states(agent: AnyAgent, env: Env, seed: int = 0, options: Data | None = None) -> States:
    """Run greedy episodes with a tenth of random actions, and return states that were met.

    At most `MOST_STATES` of `MOST_STEPS` steps, evenly spaced. Nothing is learned.
    """
    generator = np.random.default_rng(seed)
    env.action_space.seed(seed)

    def random_action(mask: Any) -> Element | None:
        """Return a random action that `mask` allows in a share of the steps, else None."""
        if generator.random() >= SHARE_RANDOM:
            return None
        if isinstance(mask, tuple | list):
            return env.action_space.sample(tuple(np.asarray(part, np.int8) for part in mask))
        return env.action_space.sample(None if mask is None else np.asarray(mask, np.int8))

    watched = WatchedAgent(agent, random_action=random_action)
    number = 1  # the first episode is that of a replay
    while len(watched.states) < MOST_STEPS:
        for _ in greedy_episode(watched, env, seed, number, options):
            if len(watched.states) == MOST_STEPS:
                break
        number += 1
    allowed = None
    if any(mask is not None for mask in watched.masks):
        all_actions = np.ones(sum(agent._controller.n_actions), np.bool_)
        allowed = np.array([all_actions if mask is None else mask for mask in watched.masks])
    states = States(np.array(watched.states), allowed)
    states = states.chosen(np.isfinite(states.rows).all(axis=1))
    require(len(states.rows) > 1, "env", "give observations without missing readings", env)
    return states.thinned(MOST_STATES)


@dataclass(frozen=True)
class Influence:
    """The influence of an input, from shuffling it among the states that were met.

    ``on_values`` is how far values change, as a share of how far those of two states are apart;
    ``on_actions`` how far greedy actions change: the share of states with another action, or of a
    Box the mean change as a share of its range.
    """

    input: AgentInput
    on_values: float
    on_actions: float


def influences(
    reader: Reader, states: States, inputs: Sequence[AgentInput], seed: int = 0
) -> list[Influence]:
    """Return the influence of each input, the largest first.

    Each state keeps its mask. Inputs are sorted by the mean of both influences, each as a share of
    the largest one.
    """
    generator = np.random.default_rng(seed)
    n_used = max(1, sum(agent_input.is_used for agent_input in inputs))
    is_fast = reader.agent.kind in ("q-lambda", "actor-critic")
    most_reads = MOST_READS if is_fast else MOST_SLOW_READS
    # Fewer than 50 states would leave influences to chance, however slow they are to read.
    states = states.thinned(max(50, most_reads // (N_SHUFFLES * n_used)))
    before = reader.read(states)
    known = before.allowed.any(axis=0)  # actions that a mask allows in some state
    variances = before.action_values[:, known].var(axis=0, where=before.allowed[:, known])
    # The root mean square difference of the values of two states drawn at random.
    spread = math.sqrt(2.0) * float(np.sqrt(variances.mean()))
    measured = []
    for agent_input in inputs:
        on_values, on_actions = 0.0, 0.0
        for _ in range(N_SHUFFLES if agent_input.is_used else 0):
            shuffled = states.rows.copy()
            order = generator.permutation(len(shuffled))
            columns = list(agent_input.columns)
            shuffled[:, columns] = states.rows[order][:, columns]
            after = reader.read(states._replace(rows=shuffled))
            change = after.action_values - before.action_values
            if spread > 0.0:
                mean_square = np.square(change).mean(where=before.allowed)
                on_values += float(np.sqrt(mean_square)) / spread / N_SHUFFLES
            on_actions += _action_change(reader.agent, before.actions, after.actions)
        measured.append(Influence(agent_input, on_values, on_actions / N_SHUFFLES))
    largest = [
        max((getattr(influence, name) for influence in measured), default=0.0) or 1.0
        for name in ("on_values", "on_actions")
    ]
    return sorted(measured, key=lambda i: -i.on_values / largest[0] - i.on_actions / largest[1])


def _action_change(agent: AnyAgent, before: Floats, after: Floats) -> float:
    """Return how much actions change: a share of states, or of the range of continuous ones."""
    space = agent.action_space
    if not isinstance(space, gym.spaces.Box):
        return float((before != after).any(axis=1).mean())
    extent = np.ravel(space.high).astype(np.float64) - np.ravel(space.low)
    return float((np.abs(after - before) / extent).mean())


def named_inputs(names: Sequence[str | int], inputs: Sequence[AgentInput]) -> list[AgentInput]:
    """Return the inputs of these names, or numbers of observed variables; ValueError if unknown."""
    is_list = isinstance(names, Sequence) and not isinstance(names, str | bytes)
    is_short = is_list and 1 <= len(names) <= 2
    are_names = is_short and all(isinstance(name, str | int | np.integer) for name in names)
    require(are_names, "inputs", "be one or two names of inputs", names)
    chosen = []
    for name in names:
        matches = [
            agent_input
            for agent_input in inputs
            if agent_input.name == str(name)
            or (str(name).isdecimal() and int(name) in agent_input.columns)
        ]
        if not matches:
            known = [agent_input.name for agent_input in inputs]
            raise ValueError(f"inputs: no input {name!r}; {advice(str(name), known)}")
        chosen.append(matches[0])
    require(len(set(chosen)) == len(chosen), "inputs", "be two different inputs", names)
    return chosen
