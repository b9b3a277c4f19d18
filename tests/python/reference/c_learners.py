"""Agents that learn in C, with docstrings of what they cover, and checks of their bits."""

import functools
from dataclasses import replace

import gymnasium as gym
import numpy as np
import pytest

from c_histories import LEARNERS as HISTORIES
from c_lines import (
    BEGIN_EPISODE,
    GREEDY_IN_NEW_EPISODE,
    LEARN,
    MISSING,
    REFUSED,
    has_episodes,
    lines_of,
    with_durations,
)
from c_policies import STRICT, box, lies_between, macros, place_of, run, store_action
from sdnn.agents import (
    ActorCriticConfig,
    QLambdaConfig,
    SDNNActorCritic,
    SDNNQLambda,
    SDNNQLearning,
    Transition,
)
from sdnn.approximators import LinearSDNNConfig, SDNNCConfig
from sdnn.export import c_header, export_c_header, load_image, save_image

SMALL = LinearSDNNConfig(n_pattern_units=24, averaging_interval=7)
NETWORK = SDNNCConfig(
    n_pattern_units=24, n_hidden_units=60, n_active_units=20, n_actions=5, weight_limit=127
)


def discrete():
    """Three inputs: groups in twos alone; defaults of learning."""
    return SDNNQLambda(box(1.0, 2.0, 3.0), gym.spaces.Discrete(3, start=-1), seed=1, **_with(SMALL))


def sarsa():
    """Sarsa with replacing traces, no average, four inputs: groups in twos and left over."""
    learning = QLambdaConfig(
        bootstrap="sarsa", traces="replacing", epsilon=0.4, tie_rule="middle", tie_tolerance=3.7,
        n_greedy_steps=3, max_action_repeat=1,
    )  # fmt: skip
    config = replace(SMALL, averaging_interval=0)
    spaces = box(1.0, 2.0, 3.0, 0.25), gym.spaces.Discrete(4)
    return SDNNQLambda(*spaces, seed=2, learning=learning, **_with(config))


def dutch():
    """True-online Sarsa, windows of a box, an angle, random actions at the beginning."""
    learning = QLambdaConfig(
        bootstrap="sarsa", trace_decay=1.0, discount=0.8, start_steps=50, max_action_repeat=9,
        schedule_steps=100, tie_rule="lowest", epsilon=0.9, final_epsilon=0.3,
    )  # fmt: skip
    config = replace(SMALL, n_actions=9, action_window=4)
    settings = _with(config) | {"angle_pairs": [(0, 1)]}
    return SDNNQLambda(box(1.0, 1.0, 8.0), box(2.0), seed=3, learning=learning, **settings)


def several():
    """Two dimensions, two inputs: groups left over alone; rates without a schedule."""
    learning = QLambdaConfig(schedule_steps=0, learning_rate=0.3, epsilon=0.3, tie_tolerance=0.4)
    spaces = box(1.0, 2.0), gym.spaces.MultiDiscrete([3, 5])
    return SDNNQLambda(*spaces, seed=4, learning=learning, **_with(SMALL))


def circular():
    """An angle, a wide pattern and few pairs of many inputs."""
    config = replace(SMALL, n_pattern_units=70, max_pairs=10)
    spaces = box(np.pi, 2.0, 1.0, 1.0, 1.0), gym.spaces.Discrete(2)
    return SDNNQLambda(*spaces, angles=[0], seed=5, **_with(config))


def states():
    """A table of listed states."""
    return SDNNQLambda(gym.spaces.Discrete(9), gym.spaces.Discrete(4), seed=6)


def network():
    """SDNN-C of the preset "small": five-step targets, a range that follows the returns."""
    learning = replace(SDNNQLearning.presets["small"].learning, epsilon=0.1, start_steps=20)
    config = replace(NETWORK, n_hidden_units=90)
    return SDNNQLearning(
        box(1.0, 2.0, 3.0, 0.25), gym.spaces.Discrete(2, start=-1), seed=7,
        approximator=config, learning=learning,
    )  # fmt: skip


def paper_rule():
    """SDNN-C as in the paper, one step and a fixed range, with three inputs and torques."""
    learning = replace(SDNNQLearning.presets["paper"].learning, tie_rule="middle", epsilon=0.2)
    config = replace(NETWORK, rounding="random", lattice=2)
    return SDNNQLearning(
        box(1.0, 1.0, 8.0), box(2.0), seed=8, approximator=config, learning=learning
    )


def small_steps():
    """Rounding away, an angle, two inputs, a range from 0 to 1, and weights that reach a limit."""
    paper = SDNNQLearning.presets["paper"].learning
    learning = replace(paper, learning_rate=0.3, tie_rule="lowest", n_steps=3)
    config = replace(
        NETWORK,
        rounding="away",
        n_actions=7,
        u_low=0,
        u_high=20,
        q_low=0.0,
        q_high=1,
        weight_limit=5,
    )
    return SDNNQLearning(
        box(np.pi, 2.0), box(1.0), seed=9, angles=[0], approximator=config, learning=learning
    )


def few_pairs():
    """Five inputs in few pairs, uniform initial weights, and wide patterns."""
    config = replace(
        NETWORK, max_pairs=10, initial_weights="uniform", initial_weight_limit=3.0,
        n_pattern_units=70,
    )  # fmt: skip
    learning = replace(SDNNQLearning.presets["small"].learning, discount=0.9, max_action_repeat=1)
    return SDNNQLearning(
        box(1.0, 2.0, 1.0, 1.0, 1.0), gym.spaces.Discrete(4), seed=10,
        approximator=config, learning=learning,
    )  # fmt: skip


def actor():
    """An actor-critic with three inputs and torques; defaults of learning."""
    settings = _with(replace(SMALL, n_actions=5)) | _ranges(1.0, 2.0, 3.0)
    return SDNNActorCritic(box(1.0, 2.0, 3.0), box(2.0), seed=11, **settings)


def actor_vector():
    """Two dimensions of torques, an angle, and a strong entropy; wide patterns."""
    learning = ActorCriticConfig(
        entropy=0.5, trace_decay=1.0, discount=0.8, schedule_steps=100, learning_rate=0.9,
        actor_learning_rate=0.7, final_learning_rate=None,
    )  # fmt: skip
    config = replace(SMALL, n_actions=3, n_pattern_units=70)
    settings = _with(config) | {"angle_pairs": [(0, 1)]} | _ranges(1.0, 1.0, 8.0)
    spaces = box(1.0, 1.0, 8.0), box(2.0, 0.5)
    return SDNNActorCritic(*spaces, seed=12, learning=learning, **settings)


def actor_discrete():
    """Two dimensions of discrete actions, a circular angle, no thermometers."""
    learning = ActorCriticConfig(thermometers=False, entropy=0.0, final_actor_learning_rate=None)
    settings = {"approximator": SMALL, "inputs": "all", "angles": [0]} | _ranges(np.pi, 2.0)
    spaces = box(np.pi, 2.0), gym.spaces.MultiDiscrete([3, 5])
    return SDNNActorCritic(*spaces, seed=13, learning=learning, **settings)


def actor_running():
    """An actor-critic with running ranges, an angle of two readings, and torques."""
    settings = _with(replace(SMALL, n_actions=5)) | {"angle_pairs": [(1, 2)]}
    return SDNNActorCritic(box(3.0, 1.0, 1.0, 0.1), box(2.0), seed=15, **settings)


def actor_running_discrete():
    """An actor-critic with a running range beside a circular angle, and discrete actions."""
    learning = ActorCriticConfig(thermometers=False)
    settings = {"approximator": SMALL, "inputs": "all", "angles": [0], "learning": learning}
    spaces = box(np.pi, 2.0), gym.spaces.MultiDiscrete([3, 2])
    return SDNNActorCritic(*spaces, seed=16, **settings)


def actor_states():
    """An actor-critic with a table of listed states."""
    return SDNNActorCritic(gym.spaces.Discrete(9), gym.spaces.Discrete(4, start=2), seed=14)


NETWORKS = {
    "network": network, "paper-rule": paper_rule, "small-steps": small_steps,
    "few-pairs": few_pairs,
}  # fmt: skip
ACTORS = {
    "actor": actor, "actor-vector": actor_vector, "actor-discrete": actor_discrete,
    "actor-states": actor_states, "actor-running": actor_running,
    "actor-running-discrete": actor_running_discrete,
}  # fmt: skip
TIMED = {
    "timed-discrete": discrete, "timed-sarsa": sarsa, "timed-dutch": dutch,
    "timed-actor": actor_vector,
}  # fmt: skip
"""Agents whose transitions have durations."""
LEARNERS = {
    **NETWORKS,
    **TIMED,
    **ACTORS,
    **HISTORIES,
    "states": states,
    "discrete": discrete, "sarsa": sarsa, "dutch": dutch, "several": several, "circular": circular,
}  # fmt: skip


def _with(config):
    return {"approximator": config, "inputs": "all", "angle_pairs": []}


def _ranges(*sizes):
    return {"observation_range": (-np.array(sizes), np.array(sizes))}


# Reads an image, from which the agent continues, and lines of c_lines.py. Writes the actions of all
# lines, and the image at the end.
DRIVER = """
#include <stdio.h>
#include "agent.h"
static agent_agent agent;
static uint8_t image[AGENT_IMAGE_BYTES];
EPISODE
int main(void) {
  int32_t line[2 * AGENT_N_OBSERVED + 3];
  uint32_t action[AGENT_N_DIMENSIONS];
  const int32_t *const x = line + 1, *const next = line + 2 + AGENT_N_OBSERVED;
  agent_begin(&agent);
  if (fread(image, 1, sizeof image, stdin) != sizeof image) return 1;
  if (!agent_load(&agent, image)) agent_begin(&agent);
  while (fread(line, sizeof *line, 2 * AGENT_N_OBSERVED + 3, stdin) == 2 * AGENT_N_OBSERVED + 3) {
    const int32_t reward = line[1 + AGENT_N_OBSERVED], end = line[2 * AGENT_N_OBSERVED + 2];
    if (line[0] == 0) agent_begin_episode(&agent);
    if (line[0] == 3) BEGIN_GREEDY;
    if (line[0] == 1) ACT; else ACT_GREEDY;
    fwrite(action, sizeof *action, AGENT_N_DIMENSIONS, stdout);
    if (line[0] == 1) LEARN;
  }
  agent_begin_episode(&agent);
  agent_save(&agent, image);
  fwrite(image, 1, sizeof image, stdout);
  return (int)(sizeof agent >> 30);
}
"""


def index_without_draw(agent, observation, d, index):
    """Return the index (or `place_of`) of a greedy action in C: the middle of ties, not a draw."""
    is_actor = isinstance(agent, SDNNActorCritic)
    if not is_actor and agent.learning.tie_rule != "uniform":
        return index
    values = (agent.action_probabilities if is_actor else agent.q_values)(observation, d)
    tolerance = 0.0 if is_actor else agent.learning.tie_tolerance
    is_tied = values >= values.max() - tolerance
    if is_tied.sum() == 1:
        return index
    # Split the indices where ties begin or end, and choose the middle of the longest run of ties.
    runs = np.split(np.arange(len(values)), np.flatnonzero(np.diff(is_tied)) + 1)
    longest = max((indices for indices in runs if is_tied[indices[0]]), key=len)
    middle = int(longest[(len(longest) - 1) // 2])
    if not lies_between(agent):
        return middle
    # The action lies between those of a box: towards the more probable neighbour, as in C.
    weights = np.pad(np.round(values / values.max() * 2**30), 1).astype(int).tolist()
    below, _, above = neighbours = weights[middle : middle + 3]
    shift = (abs(above - below) << 16) // sum(neighbours)
    return (middle << 16) + (shift if above >= below else -shift)


def generator_of_greedy_ties(agent):
    """Return the name and the state of the random generator of greedy actions in Python."""
    state = agent._state_of("agent")
    name = next(n for n in ("policy.evaluation_ties.words", "ties.words") if n in state)
    return name, state[name].copy()


def observation_of(agent, numbers, scale):
    """Return the observation of numbers of a line: NaN where missing, an index in a table."""
    observation = np.where(numbers == MISSING, np.nan, numbers / scale)
    is_listed = isinstance(agent.observation_space, gym.spaces.Discrete)
    return observation.argmax() if is_listed else observation


def act_in_python(agent, observation, explore):
    """Return an action of the agent, and what a program in C returns for it.

    That is the index of each dimension's part, or the place of a greedy part between two actions.
    """
    action = agent.act(observation, explore=explore)
    parts = list(enumerate(np.ravel(action)))
    if not explore and lies_between(agent):
        indices = [place_of(agent.actions_of(d), part) for d, part in parts]
    else:
        indices = [np.abs(agent.actions_of(d) - part).argmin() for d, part in parts]
    if not explore:
        indices = [index_without_draw(agent, observation, d, i) for d, i in enumerate(indices)]
    return action, indices


def run_agent(agent, lines, fraction_bits):
    """Return the indices of the actions that the library's agent chooses for the lines.

    Greedy actions draw no random numbers in C: the agent's generator for them is set back.
    """
    n_observed, scale = (lines.shape[1] - 3) // 2, 2.0**fraction_bits
    all_indices = []
    agent._has_warned = True  # of rewards that are too large
    name, generator = generator_of_greedy_ties(agent)
    for task, *numbers in lines.tolist():
        numbers = np.array(numbers, float)
        observation = observation_of(agent, numbers[:n_observed], scale)
        next_observation = observation_of(agent, numbers[n_observed + 1 : -1], scale)
        reward, end = float(numbers[n_observed] / scale), int(numbers[-1])
        if task == BEGIN_EPISODE:
            agent.begin_episode()
        if task == GREEDY_IN_NEW_EPISODE:
            agent.begin_greedy_episode()
        learns = task == LEARN
        if agent.missing == "error" and np.isnan(observation).any():
            with pytest.raises(ValueError, match="observation"):
                agent.act(observation, explore=learns)
            all_indices.append([REFUSED] * agent.n_dimensions)
            continue
        action, indices = act_in_python(agent, observation, explore=learns)
        all_indices.append(indices)
        if not learns or (agent.missing == "error" and np.isnan(next_observation).any()):
            continue
        dt = end // 2 / 2**16 or 1.0
        transition = Transition(
            observation, action, reward, next_observation, terminated=end % 2 == 1, dt=dt
        )
        if dt >= 0.001:
            agent.learn(transition)
        else:
            with pytest.raises(ValueError, match="dt"):
                agent.learn(transition)
    agent.begin_episode()
    state = agent._state_of("agent") | {name: generator}
    agent._restore(agent=state, reward_scale=agent._state_of("reward_scale"))
    return all_indices


def build(folder, agent, target, *options, durations=False):
    """Export an agent and compile `DRIVER` with it; return the header and the command."""
    header = export_c_header(agent, folder / "agent.h", learning=True, durations=durations)
    has_memory = has_episodes(agent)
    greedy = "agent_place" if lies_between(agent) else "agent_greedy"
    action = "action[0]" if agent.n_dimensions == 1 else "action"
    if durations:
        learn = f"agent_learn_over(&agent, x, {action}, reward, next, end & 1, (uint32_t)end >> 1)"
    else:
        learn = f"agent_learn(&agent, x, {action}, reward, next, end)"
    definitions = macros(
        EPISODE="static agent_greedy_episode episode;" if has_memory else "",
        BEGIN_GREEDY="agent_begin_greedy_episode(&agent, &episode)" if has_memory else "(void)0",
        ACT=store_action(agent, "agent_act", "&agent, x"),
        ACT_GREEDY=store_action(agent, greedy, f"&agent, {'&episode, ' * has_memory}x"),
        LEARN=learn,
    )
    (folder / "steps.c").write_text(definitions + DRIVER)
    return header, target.compile(folder / "steps.c", *STRICT, "-O2", *options)


def run_program(command, image, lines, n_dimensions):
    """Run a program; return its actions, and the image with which it ends."""
    written = run(*command, input=image + np.ascontiguousarray(lines).tobytes())
    n_bytes = 4 * n_dimensions * len(lines)
    actions = np.frombuffer(written[:n_bytes], "<u4").reshape(-1, n_dimensions)
    return actions.tolist(), written[n_bytes:]


def exported(name, prefix="agent"):
    """Return the header of a learner."""
    return c_header(LEARNERS[name](), prefix, learning=True, durations=name in TIMED)


def timed_lines_of(name, agent, n_steps, seed, fraction_bits):
    """Return the lines of a learner, with durations where it learns them."""
    lines = lines_of(agent, n_steps, seed, fraction_bits)
    return with_durations(lines, np.random.default_rng(seed)) if name in TIMED else lines


@functools.cache
def recorded_steps(name, n_steps, fraction_bits):
    """Return lines, the first image of the library's agent, its actions and its last image."""
    agent = LEARNERS[name]()
    lines = timed_lines_of(name, agent, n_steps, 1, fraction_bits)
    initial_image = save_image(agent)
    return lines, initial_image, run_agent(agent, lines, fraction_bits), save_image(agent)


def check_learning(name, target, folder, n_steps=3000, options=()):
    """Check that a program acts and learns like the agent, from the header and from an image."""
    agent = LEARNERS[name]()
    header, command = build(folder, agent, target, *options, durations=name in TIMED)
    lines, initial_image, expected, last_image = recorded_steps(name, n_steps, header.fraction_bits)
    actions, image = run_program(command, initial_image, lines, agent.n_dimensions)
    assert actions == expected
    assert image == last_image
    # Python loads the experience, and both continue from it.
    load_image(agent, image)
    assert save_image(agent) == image
    n_later = min(n_steps, 3000) // 10
    later_lines = timed_lines_of(name, agent, n_later, 2, header.fraction_bits)
    actions, image = run_program(command, image, later_lines, agent.n_dimensions)
    assert actions == run_agent(agent, later_lines, header.fraction_bits)
    assert image == save_image(agent)
