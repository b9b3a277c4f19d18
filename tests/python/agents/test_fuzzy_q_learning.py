import gymnasium as gym
import numpy as np
import pytest

import grid_transcription as paper
from refusals import refuses
from sdnn import _core
from sdnn.agents import FuzzyQLearning, FuzzyQLearningConfig, Transition
from sdnn.approximators import FuzzyRulesConfig

OBSERVATIONS = gym.spaces.Box(-2.0, 2.0, (3,), np.float64)
TORQUES = gym.spaces.Box(-1.0, 3.0, (1,), np.float32)


# Against the transcription.


def positions(rng, d):
    """A walk in [0, 1]^d that also meets ends and centres."""
    state = np.full(d, 0.5)
    while True:
        yield state
        kind = rng.integers(10)
        if kind == 0:
            state = rng.integers(0, 9, d) / 8.0
        else:
            state = np.clip(state + 0.1 * rng.standard_normal(d), 0.0, 1.0)


@pytest.mark.parametrize(("d", "n_steps"), [(2, 5000), (3, 3000), (4, 3000), (6, 1000)])
@pytest.mark.parametrize("tie_rule", ["uniform", "middle"])
def test_learning_agrees_with_its_definition_bit_for_bit(d, n_steps, tie_rule):
    learning = FuzzyQLearningConfig(tie_rule=tie_rule)
    rules = FuzzyRulesConfig(n_inputs=d)
    spaces = gym.spaces.Box(0.0, 1.0, (d,), np.float64), gym.spaces.Box(-1.0, 1.0, (1,), np.float64)
    agent = FuzzyQLearning(*spaces, learning=learning, seed=6)
    slow = paper.FuzzyQLearning(
        d,
        n_sets=rules.n_sets,
        n_actions=rules.n_actions,
        coefficient=learning.learning_coefficient,
        discount=learning.discount,
    )
    config = _core.EpsilonGreedyConfig(tie_rule=tie_rule)
    policy = _core.EpsilonGreedy(config, seed=6)
    rng = np.random.default_rng(d)
    walk = positions(rng, d)
    state = next(walk)
    for step in range(n_steps):
        in_episode = step % 50
        if in_episode == 0:
            agent.begin_episode()
        next_observation = next(walk)
        action, picked = slow.act(
            state, lambda values, at=in_episode: policy.select(values, at, True)
        )
        assert agent.act(state) == [action], step
        reward, terminated = float(rng.integers(-5, 11)), bool(rng.integers(20) == 0)
        agent.learn(Transition(state, [action], reward, next_observation, terminated))
        slow.learn(state, picked, reward, next_observation, terminated)
        state = next_observation
        if step % 100 == 0:
            assert agent.value(state) == slow.value(state)
    table = slow.v.reshape(-1, rules.n_actions)
    touched = np.flatnonzero(table.any(axis=1))
    assert touched.size > 50
    for rule in touched:
        assert np.array_equal(agent.rule_values(rule), table[rule])


# The Python faces.


def test_a_changed_array_is_not_the_action_taken():
    agent = FuzzyQLearning(OBSERVATIONS, TORQUES, seed=2)
    here = [0.1, 0.2, 0.3]
    action = agent.act(here)
    copy = action.copy()
    action[0] = 0.5 * (action[0] + 3.0)
    refuses("action", agent.learn, Transition(here, action, 1.0, here, False))
    agent.learn(Transition(here, copy, 1.0, here, False))
    assert agent.value(here) > 0.0


def test_the_configurations_are_those_used():
    agent = FuzzyQLearning(OBSERVATIONS, TORQUES, approximator=FuzzyRulesConfig(n_sets=5))
    assert agent.approximator == FuzzyRulesConfig(n_inputs=3, n_sets=5)
    assert agent.learning == FuzzyQLearningConfig()
    assert agent.n_rules == 125


# A figure of the paper's: it is learned within about 100 episodes without noise.
def test_fuzzy_q_learning_swings_up_without_noise():
    trial = _core.AcrobotTrial(
        approximator=_core.FuzzyRulesConfig(),
        learning=_core.FuzzyQLearningConfig(),
        acrobot=_core.AcrobotConfig(),
        goal=_core.GoalScheduleConfig(),
        sensors=_core.SensorConfig(),
        protocol=_core.ProtocolConfig(episodes=300),
        seed=1,
    )
    trial.advance(300)
    assert trial.test_rows()["solved"][10:].mean() > 0.8
