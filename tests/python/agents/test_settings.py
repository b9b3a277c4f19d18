"""Every setting of an agent has an effect on what it does, or is listed here."""

import dataclasses
import typing

import gymnasium as gym
import numpy as np
import pytest

from refusals import refuses
from sdnn.agents import QLambdaConfig, SDNNQLambda, Transition
from sdnn.agents.registry import AGENTS
from sdnn.config import fields_of

N_STEPS = 300
CODE = {"n_pattern_units": 24, "n_anchor_patterns": 4, "n_interpolated": 5, "n_actions": 5}
NETWORK = {"n_hidden_units": 60, "n_active_units": 20, "q_low": -2.0, "q_high": 4.0}
POLICY = {"epsilon": 0.4, "n_greedy_steps": 3}
RATES = POLICY | {"final_learning_rate": 0.4, "final_epsilon": 0.02}
FIRST = {
    "sdnn-c": (CODE | NETWORK | {"initial_weights": "uniform"}, RATES),
    "fuzzy": ({"n_sets": 3, "n_actions": 5}, POLICY),
    "rbf": ({"n_bases": 3, "n_actions": 5}, RATES),
    "q-lambda": (CODE, RATES | {"schedule_steps": 0}),
    "actor-critic": (CODE, {"schedule_steps": 100}),
}
"""Settings of approximator and learning rule, of which one at a time is changed."""

WITHOUT_EFFECT = {
    "every agent": {
        "n_inputs": "the observation space has it",
        "max_table_bytes": "it only refuses",
    },
    "sdnn-c": {"learning_coefficient": "it scales weights and thresholds alike"},
    "rbf": {"value_range": "such a network has no range"},
    "actor-critic": {
        "action_window": "each action has preferences of its own",
        "averaging_interval": "it acts by its present weights",
    },
}
"""Settings that change nothing, and why."""


def other_values(field, value):
    """Return other values of a setting, some of them out of its range."""
    types = typing.get_args(field.type) or (field.type,)  # of a string, its possible values
    if isinstance(value, bool):
        return [not value]
    if isinstance(value, str):
        return [word for word in types if word != value]
    if isinstance(value, tuple):  # a value for each of three inputs
        return [(True, False, False) if bool in types else (3, 0, 0)]
    number_type = int if int in types else float
    numbers = [number_type(number) for number in ((value or 0) * 2, 0.3, 0.9, 1, 2, 5, 20)]
    return [number for number in dict.fromkeys(numbers) if number != value]


def actions_and_values(entry, n_dimensions, approximator, learning):
    """Return the actions of some steps, and values and greedy actions after them."""
    agent = entry.agent(
        gym.spaces.Box(0.0, 1.0, (3,), np.float64),
        gym.spaces.Box(-1.0, 1.0, (n_dimensions,), np.float64),
        approximator=approximator,
        learning=learning,
        seed=1,
        angle_pairs="none",
        inputs="all",
    )
    random = np.random.default_rng(1)
    observation, actions = random.random(3), []
    for step in range(N_STEPS):
        agent.progress = step / N_STEPS
        action = agent.act(observation)
        position = np.clip(observation[0] + 0.2 * action.mean() + random.normal(0, 0.02), 0, 1)
        next_observation = np.array([position, *random.random(2)])
        reward = float(position > 0.7) + 0.5 * observation[1] - 0.1 * abs(action[0])
        end = random.random()  # episodes are terminated or truncated with a probability of 5% each
        agent.learn(Transition(observation, action, reward, next_observation, end < 0.05))
        observation = next_observation
        if end < 0.1:
            agent.begin_episode()
            observation = random.random(3)
        actions.append(action)
    names = ("action_probabilities", "q_values", "value")
    values = next(getattr(agent, name) for name in names if hasattr(agent, name))
    observations = random.random((20, 3))
    actions += [agent.act(x, explore=False) for x in observations]
    return np.stack(actions), np.stack([values(x) for x in observations])


@pytest.mark.parametrize("n_dimensions", [1, 2])
@pytest.mark.parametrize("name", AGENTS)
def test_every_setting_changes_what_an_agent_does_unless_listed(name, n_dimensions):
    entry = AGENTS[name]
    approximator, learning = FIRST.get(name, ({}, {}))
    configs = {
        "approximator": entry.approximator(**approximator),
        "learning": entry.learning(**learning),
    }
    expected = actions_and_values(entry, n_dimensions, **configs)

    def has_effect(option, field):
        for value in other_values(field, getattr(configs[option], field.name)):
            try:
                changed = dataclasses.replace(configs[option], **{field.name: value})
                outcome = actions_and_values(entry, n_dimensions, **configs | {option: changed})
            except ValueError:  # out of range
                continue
            if not all(map(np.array_equal, outcome, expected)):
                return True
        return False

    fields = [(option, field) for option in configs for field in fields_of(type(configs[option]))]
    listed = WITHOUT_EFFECT["every agent"] | WITHOUT_EFFECT.get(name, {})
    without_effect = {field.name for option, field in fields if not has_effect(option, field)}
    assert without_effect == listed.keys() & {field.name for _, field in fields}


def test_schedules_by_steps_are_linear_and_those_without_steps_follow_the_progress():
    def agent(**learning):
        space = gym.spaces.Box(-1.0, 1.0, (3,), np.float64)
        return SDNNQLambda(space, gym.spaces.Discrete(2), learning=QLambdaConfig(**learning))

    refuses("schedule", agent, schedule="exponential", final_epsilon=0.1)
    refuses("exploration_fraction", agent, exploration_fraction=0.5)
    # Half way from 1 to 0.1 by the progress; or 1 by the steps, of which none has been learned.
    for schedule_steps, expected in ((0, 0.55), (100, 1.0)):
        warming_up = agent(schedule_steps=schedule_steps, final_learning_rate=0.1)
        warming_up.progress = 0.5
        assert warming_up.is_warming_up
        assert warming_up.learning_rate == pytest.approx(expected)
