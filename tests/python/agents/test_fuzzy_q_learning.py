import gymnasium as gym
import numpy as np
import pytest

import grid_transcription as paper
from refusals import refuses
from sdnn import _core
from sdnn.agents import FuzzyQLearning, FuzzyQLearningConfig, Transition
from sdnn.agents.q_learning import RBFQLearning
from sdnn.approximators import FuzzyRulesConfig, RBFNetworkConfig

OBSERVATIONS = gym.spaces.Box(-2.0, 2.0, (3,), np.float64)
LISTS = gym.spaces.Sequence(gym.spaces.Discrete(2))
TORQUES = gym.spaces.Box(-1.0, 3.0, (1,), np.float32)
BUTTONS = gym.spaces.Discrete(4, start=2)


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


def test_actions_are_elements_of_the_space():
    agent = FuzzyQLearning(OBSERVATIONS, TORQUES, seed=1)
    assert agent.n_rules == 729
    rng = np.random.default_rng(1)
    actions = [agent.act(rng.uniform(-2, 2, 3)) for _ in range(100)]
    assert all(action in TORQUES for action in actions)
    assert len({float(action[0]) for action in actions}) > 90


def test_one_transition_by_hand():
    learning = FuzzyQLearningConfig(tie_rule="lowest", learning_coefficient=1.0)
    agent = FuzzyQLearning(OBSERVATIONS, TORQUES, learning=learning)
    centre, beside = [0.0, 0.0, 0.0], [0.25, 0.0, 0.0]
    action = agent.act(centre)
    assert action.tolist() == [-1.0]
    agent.learn(Transition(centre, action, 8.0, beside, True))
    assert agent.value(centre) == 8.0
    assert agent.value(beside) == 4.0
    assert agent.rule_values(4 * 81 + 4 * 9 + 4).tolist() == [8.0] + [0.0] * 20
    agent.act(beside)
    agent.learn(Transition(beside, [-1.0], 0.0, centre, False))  # 0.5 (0.9 8 - 4) more
    assert agent.value(centre) == pytest.approx(9.6)


def test_only_the_transition_of_the_last_exploring_act_is_learned():
    agent = FuzzyQLearning(OBSERVATIONS, TORQUES, seed=2)
    here, there = [0.1, 0.2, 0.3], [0.4, 0.5, 0.6]
    refuses("action", agent.learn, Transition(here, [0.0], 1.0, there, False))
    action = agent.act(here)
    agent.act(there, explore=False)
    for transition, message in [
        (Transition(there, action, 1.0, here, False), "observation"),
        (Transition(here, action / 2, 1.0, there, False), "action"),
        (Transition(here, [7.0], 1.0, there, False), "action[0]"),
        (Transition(here, action, np.nan, there, False), "reward"),
        (Transition(here, action, 1.0, [0.0], False), "next_observation"),
    ]:
        refuses(message, agent.learn, transition)
    large = Transition(here, action, 1e300, there, False)
    refuses("reward", agent.learn, large, error=OverflowError)
    assert agent.value(here) == 0.0
    agent.learn(Transition(here, action, 1.0, there, False))
    assert agent.value(here) > 0.0


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


# Episodes are the caller's: a terminated transition does not start the greedy first steps anew.
def test_only_begin_episode_begins_an_episode():
    learning = FuzzyQLearningConfig(epsilon=1.0, n_greedy_steps=1, tie_rule="lowest")
    agent = FuzzyQLearning(OBSERVATIONS, TORQUES, learning=learning)
    here = [0.0, 0.0, 0.0]
    agent.begin_episode()
    actions = []
    for _ in range(50):
        actions.append(float(agent.act(here)[0]))
        agent.learn(Transition(here, actions[-1], -10.0, here, True))
    assert actions[0] == -1.0
    assert len(set(actions)) > 5


def test_an_rbf_network_learns_discrete_actions_too():
    network = RBFNetworkConfig(n_bases=4, width=0.5)
    agent = RBFQLearning(OBSERVATIONS, BUTTONS, approximator=network, seed=2)
    assert agent.n_actions == 4
    assert agent.actions.tolist() == [2, 3, 4, 5]
    observation = [0.5, -0.5, 0.0]
    for _ in range(300):
        agent.learn(Transition(observation, 4, 10.0, observation, True))
    values = agent.q_values(observation)
    assert values[2] == pytest.approx(10.0)
    assert values.argmax() == 2
    assert agent.act(observation, explore=False) == 4
    refuses("action[0]", agent.learn, Transition(observation, 1, 10.0, observation, True))


def test_an_rbf_network_cuts_a_box_evenly():
    agent = RBFQLearning(OBSERVATIONS, TORQUES)
    assert np.allclose(agent.actions, np.linspace(-1, 3, 601), rtol=0, atol=1e-6)
    assert agent.q_values([0.0, 0.0, 0.0]).tolist() == [0.0] * 601


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
