"""Q-learning with SDNN-C: its NumPy transcription, presets, actions and scaled observations."""

import dataclasses

import gymnasium as gym
import numpy as np
import pytest
import sdnn_q_learning as transcription

from refusals import refuses
from sdnn import _core
from sdnn.agents import QLearningConfig, SDNNQLearning, Transition
from sdnn.approximators import SDNNCConfig
from sdnn.coding import Circular

SMALL = SDNNCConfig(n_pattern_units=40, n_hidden_units=120, n_active_units=30)
OBSERVATIONS = gym.spaces.Box(-2.0, 2.0, (3,), np.float64)
TORQUES = gym.spaces.Box(-1.0, 3.0, (1,), np.float32)
FOUR_ACTIONS = gym.spaces.Discrete(4, start=2)


def small_agent(actions=TORQUES, **options):
    return SDNNQLearning(OBSERVATIONS, actions, approximator=SMALL, **options)


OTHER_RATES = {"learning_rate": 0.3, "discount": 0.99, "epsilon": 0.5, "n_greedy_steps": 3}


@pytest.mark.parametrize(
    ("n_inputs", "noise", "learning"),
    [(4, 0.0, {}), (4, 0.02, {}), (4, 0.02, OTHER_RATES), (5, 0.02, {}), (6, 0.02, {})],
)
def test_the_numpy_transcription_and_the_core_learn_the_same_trial(n_inputs, noise, learning):
    n_episodes = 15 if n_inputs == 4 else 8
    settings = transcription.Settings(
        episodes=n_episodes, seed=7, n_inputs=n_inputs, noise=noise, **learning
    )
    lines = []
    expected = transcription.train(settings, lines.append).network
    trial = _core.AcrobotTrial(
        approximator=_core.SDNNCConfig(n_inputs=n_inputs),
        learning=_core.QLearningConfig(**learning),
        acrobot=_core.AcrobotConfig(),
        goal=_core.GoalScheduleConfig(),
        sensors=_core.SensorConfig(n_sensors=n_inputs, noise=noise),
        protocol=_core.ProtocolConfig(episodes=n_episodes, evaluate_every_episodes=n_episodes + 1),
        seed=7,
    )
    steps = []
    for _ in range(n_episodes):
        before = trial.n_decisions
        trial.advance(1)
        steps.append(trial.n_decisions - before)
    # Printed lines are "episode 1: 50 steps, ...".
    assert [int(line.split()[2]) for line in lines] == steps
    network = trial.agent.networks[0]
    assert np.array_equal(network.weights(), expected.weights)
    assert np.array_equal(network.thresholds(), expected.thresholds)
    assert np.abs(network.weights()).max() > 5, "something was learned"


def test_the_number_of_actions_is_that_of_windows_of_units_or_of_a_discrete_space():
    agent = small_agent()
    n_windows = SMALL.n_hidden_units - SMALL.n_active_units + 1
    assert agent.approximator == dataclasses.replace(SMALL, n_inputs=3, n_actions=n_windows)
    assert agent.networks[0].n_actions == n_windows
    agent = small_agent(FOUR_ACTIONS)
    assert agent.approximator == dataclasses.replace(SMALL, n_inputs=3, n_actions=4)


def test_presets_are_used_unless_settings_are_passed():
    general = SDNNQLearning(OBSERVATIONS, TORQUES)
    assert (general.n_actions, general.learning.discount) == (5, 0.99)
    robust = SDNNQLearning(OBSERVATIONS, TORQUES, preset="robust")
    assert (robust.n_actions, robust.learning.n_steps) == (61, 5)
    paper_agent = SDNNQLearning(OBSERVATIONS, TORQUES, preset="paper")
    assert paper_agent.n_actions == 900 - 300 + 1  # windows of 300 of the paper's 900 units
    assert paper_agent.learning == QLearningConfig()
    with_settings = SDNNQLearning(
        OBSERVATIONS, TORQUES, learning=QLearningConfig(discount=0.5), preset="robust"
    )
    assert (with_settings.n_actions, with_settings.learning) == (61, QLearningConfig(discount=0.5))
    for name, settings in SDNNQLearning.presets.items():
        agent = SDNNQLearning(OBSERVATIONS, TORQUES, preset=name)
        assert agent.learning == settings.learning
    refuses("preset", SDNNQLearning, OBSERVATIONS, TORQUES, preset="best")


def test_an_agent_of_a_discrete_space_learns_and_takes_its_best_action():
    agent = small_agent(FOUR_ACTIONS, seed=2, learning=QLearningConfig(tie_rule="lowest"))
    assert agent.n_actions == 4
    assert agent.actions.tolist() == [2, 3, 4, 5]
    observation = [0.5, -0.5, 0.0]
    for _ in range(100):
        agent.learn(Transition(observation, 4, 10.0, observation, True))
    assert agent.q_values(observation).argmax() == 2
    action = agent.act(observation, explore=False)
    assert action == 4
    assert action in FOUR_ACTIONS


def test_observations_are_scaled_by_the_bounds_and_clipped():
    agent = small_agent()
    agent.learn(Transition([2.0, -2.0, 0.0], [3.0], 10.0, [0.0, 0.0, 0.0], True))
    inside = agent.q_values([2.0, -2.0, 0.0])
    assert np.array_equal(agent.q_values([7.0, -1e300, 0.0]), inside)
    assert np.array_equal(agent.q_values(np.array([2, -2, 0], dtype=np.int8)), inside)
    assert np.array_equal(agent.q_values(np.float32([2.0, -2.0, 0.0])), inside)
    # The bounds -2 and 2 of the space become 0 and 1 in the network.
    (network,) = agent.networks
    assert np.array_equal(network.values([1.0, 0.0, 0.5]), inside)


@pytest.mark.parametrize("action", [1, 6, 2.7, np.nan, "left", None, [2, 3]])
def test_actions_outside_a_discrete_space_are_refused_and_not_learned(action):
    agent = small_agent(FOUR_ACTIONS)
    observation = [0.0, 0.0, 0.0]
    before = agent.networks[0].weights()
    refuses("action", agent.learn, Transition(observation, action, 1.0, observation, False))
    assert np.array_equal(agent.networks[0].weights(), before)


def test_an_agent_with_circular_patterns_generalizes_across_the_ends_of_a_range():
    tables = [Circular().patterns(40, seed=number) for number in range(3)]
    agent = small_agent(tables=tables)
    np.testing.assert_array_equal(agent.networks[0].table(2), tables[2])
    observation = np.array([0.3, -1.0, 1.9])
    for _ in range(20):
        agent.learn(Transition(observation, [0.5], 3.0, observation, True))
    assert agent.q_values(observation).max() > 1.0
    other_end = agent.q_values(np.array([0.3, -1.0, -2.0]))  # on a circle the neighbour of 1.9
    assert other_end.max() > 0.5
    refuses("tables", small_agent, tables=tables[:2])


def test_tables_of_patterns_need_a_row_for_each_symbol():
    rooms = gym.spaces.MultiDiscrete([3, 4])

    def agent_with(*n_rows):
        tables = [Circular().patterns(40, seed=number)[:n] for number, n in enumerate(n_rows)]
        return SDNNQLearning(rooms, FOUR_ACTIONS, approximator=SMALL, tables=tables)

    assert agent_with(3, 4).networks[0].table(1).shape == (4, 40)
    refuses("tables[1]", agent_with, 3, 5)
    refuses("tables", agent_with, 3)
