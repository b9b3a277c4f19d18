"""Agents whose states include earlier observations, exported as C headers, and their checks."""

import functools
from dataclasses import replace

import gymnasium as gym
import numpy as np

from c_policies import STRICT, box, lies_between, macros, run, store_action
from sdnn.agents import ActorCriticConfig, QLambdaConfig, SDNNActorCritic, SDNNQLambda, Transition
from sdnn.approximators import LinearSDNNConfig
from sdnn.export import export_c_header

SMALL = LinearSDNNConfig(n_pattern_units=24, averaging_interval=7)
WARM_UP_STEPS = 150


def warmed_up(agent, n_steps=WARM_UP_STEPS):
    """Return the agent after steps in which positions drift with velocities and actions push."""
    random = np.random.default_rng(1)
    space = agent.observation_space
    agent.begin_episode()
    positions, velocity = np.zeros(gym.spaces.flatdim(space)), 0.0
    for _ in range(n_steps):
        observation = element_of(space, positions)
        action = agent.act(observation)
        push = np.sum(np.asarray(action, float)) - 1.0
        velocity = 0.9 * velocity + 0.1 * push + random.normal(0, 0.02)
        positions = 0.9 * positions + 0.1 * velocity + random.normal(0, 0.1, positions.size)
        terminated, reward = bool(random.random() < 0.05), float(positions[0])
        next_observation = element_of(space, positions)
        agent.learn(Transition(observation, action, reward, next_observation, terminated))
        if terminated:
            agent.begin_episode()
            positions, velocity = random.normal(0, 0.3, positions.size), 0.0
    agent.begin_episode()
    return agent


def element_of(space, variables):
    """Return an observation from flat variables; a symbol is the index of its largest variable."""
    if not isinstance(space, gym.spaces.Tuple):
        return variables
    parts, first = [], 0
    for part in space.spaces:
        values = variables[first : first + gym.spaces.flatdim(part)]
        is_symbol = isinstance(part, gym.spaces.Discrete)
        parts.append(int(values.argmax() + part.start) if is_symbol else values.astype(part.dtype))
        first += values.size
    return tuple(parts)


def _agent(agent_class, history, spaces, **settings):
    settings = {"inputs": "all", "angle_pairs": [], "approximator": SMALL} | settings
    return warmed_up(agent_class(*spaces, history=history, warm_up_steps=WARM_UP_STEPS, **settings))


def _ranges(*sizes):
    return {"observation_range": (-np.array(sizes), np.array(sizes))}


def differences():
    """Two numbers and an angle, discrete actions, traces of true-online Q(lambda)."""
    spaces = box(1.0, 2.0, np.pi), gym.spaces.Discrete(3, start=-1)
    return _agent(SDNNQLambda, "differences", spaces, angles=[2], seed=1)


def averages():
    """Sarsa with replacing traces, a cosine and a sine, two dimensions of actions."""
    learning = QLambdaConfig(
        bootstrap="sarsa", traces="replacing", tie_rule="middle", epsilon=0.2, max_action_repeat=1
    )
    spaces = box(1.0, 1.0, 8.0), gym.spaces.MultiDiscrete([3, 2])
    settings = {"angle_pairs": [(0, 1)], "learning": learning, **_ranges(1.0, 1.0, 8.0)}
    return _agent(SDNNQLambda, "averages", spaces, seed=2, **settings)


def observer():
    """A cosine and a sine, and torques that the observer uses as numbers."""
    config = replace(SMALL, n_actions=11, action_window=2, averaging_interval=0)
    settings = {"angle_pairs": [(0, 1)], "approximator": config, **_ranges(1.0, 1.0, 8.0)}
    learning = QLambdaConfig(tie_rule="lowest", epsilon=0.2, schedule_steps=0)
    spaces = box(1.0, 1.0, 8.0), box(2.0)
    return _agent(SDNNQLambda, "observer", spaces, seed=3, learning=learning, **settings)


def actor_differences():
    """An actor-critic without thermometers, with an angle, and torques in double precision."""
    learning = ActorCriticConfig(thermometers=False)
    spaces = box(np.pi, 2.0), gym.spaces.Box(-1.0, 2.0, (1,), np.float64)
    settings = {"angles": [0], "learning": learning, **_ranges(np.pi, 2.0)}
    return _agent(SDNNActorCritic, "differences", spaces, seed=4, **settings)


def actor_averages():
    """An actor-critic with thermometers of averages, and discrete actions."""
    spaces = box(1.0, 2.0), gym.spaces.Discrete(3)
    return _agent(SDNNActorCritic, "averages", spaces, seed=5, **_ranges(1.0, 2.0))


def actor_observer():
    """An actor-critic with an observer that uses two torques, and an angle."""
    config = replace(SMALL, n_actions=9)
    spaces = box(np.pi, 2.0), box(2.0, 0.7)
    settings = {"angles": [0], "approximator": config, **_ranges(np.pi, 2.0)}
    return _agent(SDNNActorCritic, "observer", spaces, seed=6, **settings)


def actor_observer_of_levels():
    """An actor-critic with an observer that uses which of the discrete actions was chosen."""
    spaces = box(1.0, 2.0, 1.0), gym.spaces.MultiDiscrete([3, 4])
    return _agent(SDNNActorCritic, "observer", spaces, seed=7, **_ranges(1.0, 2.0, 1.0))


def symbols(history):
    """Return an agent that observes a number between two symbols."""
    space = gym.spaces.Tuple([gym.spaces.Discrete(3), box(2.0), gym.spaces.Discrete(2, start=1)])
    learning = QLambdaConfig(tie_rule="lowest")
    return _agent(SDNNQLambda, history, (space, box(1.0)), seed=8, learning=learning)


def running():
    """An actor-critic with running ranges, and torques in half precision."""
    spaces = box(1.0, 2.0), gym.spaces.Box(-1.0, 1.0, (1,), np.float16)
    config = replace(SMALL, n_actions=9)
    return _agent(SDNNActorCritic, "observer", spaces, seed=9, approximator=config)


def whole():
    """An actor-critic with torques that are whole numbers."""
    spaces = box(1.0, 2.0), gym.spaces.Box(-20, 30, (1,), np.int32)
    config = replace(SMALL, n_actions=9)
    return _agent(SDNNActorCritic, "observer", spaces, seed=10, approximator=config)


LEARNERS = {
    "differences": differences, "averages": averages, "observer": observer,
    "actor-differences": actor_differences, "actor-averages": actor_averages,
    "actor-observer": actor_observer, "actor-levels": actor_observer_of_levels,
}  # fmt: skip
POLICIES = {
    **LEARNERS,
    **{f"symbols-{history}": functools.partial(symbols, history)
       for history in ("differences", "averages", "observer")},
    "running": running, "whole": whole,
}  # fmt: skip

# A line of input: 1 where an episode begins, else 0, and an observation.
DRIVER = """
#include "policy.h"
#include <stdio.h>
static policy_episode episode;
int main(void) {
  NUMBER begins, x[POLICY_N_OBSERVED]; uint32_t action[POLICY_N_DIMENSIONS];
  while (fread(&begins, sizeof begins, 1, stdin) == 1) {
    if (fread(x, sizeof *x, POLICY_N_OBSERVED, stdin) != POLICY_N_OBSERVED) return 1;
    if (begins > 0) policy_begin_episode(&episode);
    ACT;
    fwrite(action, sizeof *action, POLICY_N_DIMENSIONS, stdout);
  }
  return 0;
}
"""

GREEDY = {
    "int32_t": "policy_greedy", "float": "policy_greedy_float", "double": "policy_greedy_double",
}  # fmt: skip


@functools.cache
def policy(name):
    """Return the trained agent with this name."""
    return warmed_up(POLICIES[name](), 400)


def steps_of(agent, n, seed):
    """Return rows: 1 where an episode begins, else 0, and observations, some outside the ranges."""
    random = np.random.default_rng(seed)
    size = gym.spaces.flatdim(agent.observation_space)
    rows, begins = [], True
    for _ in range(n):
        if begins:
            positions = random.normal(0, 1.0, size)
        else:
            positions = 0.9 * positions + random.normal(0, 0.3, size)
        rows.append([begins, *positions])
        begins = random.random() < 0.05
    return np.array(rows, float)


def actions_at(agent, indices):
    """Return the actions at indices, or at fractional ones times 2^16 between those of a box."""
    if not lies_between(agent):
        return [agent.actions_of(d)[index] for d, index in enumerate(indices)]
    space, n = agent.action_space, len(agent.actions_of(0))
    low, high = space.low.astype(float), space.high.astype(float)
    action = low + (high - low) * (np.array(indices) / 2**16 / (n - 1))
    return (np.floor(action + 0.5) if space.dtype.kind == "i" else action).astype(space.dtype)


@functools.cache
def expected_of(name, number_type, fraction_bits, n_steps):
    """Return lines of input for `DRIVER`, and the agent's actions for them."""
    agent, steps = policy(name), steps_of(policy(name), n_steps, 2)
    scale = 2.0**fraction_bits if number_type == "int32_t" else 1.0
    dtype = {"int32_t": "<i4", "float": "<f4", "double": "<f8"}[number_type]
    steps[:, 1:] *= scale
    lines = np.round(steps).astype(dtype) if number_type == "int32_t" else steps.astype(dtype)
    expected = []
    for begins, *variables in lines.astype(float):
        if begins:
            agent.begin_greedy_episode()
        observation = element_of(agent.observation_space, np.array(variables) / scale)
        expected.append(agent.act(observation, explore=False))
    return lines, expected


def check_policy(name, number_type, target, folder, n_steps=3000):
    """Check that a program chooses the agent's actions in episodes, from numbers of a type of C."""
    agent = policy(name)
    header = export_c_header(agent, folder / "policy.h")
    function = GREEDY[number_type]
    if lies_between(agent):
        function, number_type = "policy_place", "int32_t"
    definitions = {"NUMBER": number_type, "ACT": store_action(agent, function, "&episode, x")}
    if number_type != "int32_t":
        definitions["POLICY_USE_FLOAT"] = ""
    (folder / "main.c").write_text(macros(**definitions) + DRIVER)
    command = target.compile(folder / "main.c", *STRICT, "-O2")
    lines, expected = expected_of(name, number_type, header.fraction_bits, n_steps)
    written = np.frombuffer(run(*command, input=lines.tobytes()), "<u4")
    actions = [actions_at(agent, indices) for indices in written.reshape(-1, agent.n_dimensions)]
    np.testing.assert_array_equal(actions, np.reshape(expected, (n_steps, -1)))
    assert len(np.unique(written)) > 1
