"""Several threads read values and greedy actions of one agent at once."""

import threading
from concurrent.futures import ThreadPoolExecutor, wait
from functools import partial

import gymnasium as gym
import numpy as np
import pytest

from sdnn.agents import FuzzyQLearning, QLearningConfig, RBFQLearning, SDNNQLearning, Transition
from sdnn.approximators import SDNNCConfig
from stopped_training import states_equal

N_INPUTS = 3
OBSERVATIONS = gym.spaces.Box(0.0, 1.0, (N_INPUTS,), np.float64)
ONE_ACTION = gym.spaces.Box(-1.0, 1.0, (1,), np.float64)
TWO_ACTIONS = gym.spaces.Box(-1.0, 1.0, (2,), np.float64)
SIZES = SDNNCConfig(n_pattern_units=50, n_hidden_units=200, n_active_units=60, n_actions=9)
AVERAGING = SIZES.replace(averaging_interval=10)
AGENTS = {
    "sdnn": partial(SDNNQLearning, OBSERVATIONS, ONE_ACTION, approximator=SIZES, seed=1),
    "averaging": partial(SDNNQLearning, OBSERVATIONS, ONE_ACTION, approximator=AVERAGING, seed=1),
    "two dimensions": partial(SDNNQLearning, OBSERVATIONS, TWO_ACTIONS, approximator=SIZES, seed=1),
    "rbf": partial(
        RBFQLearning, OBSERVATIONS, ONE_ACTION, learning=QLearningConfig(n_greedy_steps=0), seed=1
    ),
    "fuzzy": partial(FuzzyQLearning, OBSERVATIONS, ONE_ACTION, seed=1),
    "fuzzy vectors": partial(FuzzyQLearning, OBSERVATIONS, TWO_ACTIONS, seed=1),
}


def train(agent, n_steps, seed):
    rng = np.random.default_rng(seed)
    agent.begin_episode()
    observation = rng.random(N_INPUTS)
    for _ in range(n_steps):
        next_observation = rng.random(N_INPUTS)
        action = agent.act(observation)
        agent.learn(Transition(observation, action, rng.normal(), next_observation, False))
        observation = next_observation


OBSERVATIONS_TO_READ = np.random.default_rng(0).random((60, N_INPUTS))


def read_values(agent):
    values_of = agent.value if isinstance(agent, FuzzyQLearning) else agent.q_values
    return np.array([values_of(observation) for observation in OBSERVATIONS_TO_READ])


def read_greedy_actions(agent):
    return np.array([agent.act(row, explore=False) for row in OBSERVATIONS_TO_READ])


def run_in_threads(*functions):
    """Call each function in a thread of its own; return their results, or raise their errors."""
    with ThreadPoolExecutor(len(functions)) as pool:
        return [future.result() for future in [pool.submit(call) for call in functions]]


@pytest.mark.parametrize("name", AGENTS)
def test_concurrent_readers_get_the_bits_of_a_single_reader(name):
    # Random choices among equal values would depend on the order of the threads.
    agent = AGENTS[name](learning=AGENTS[name]().learning.replace(tie_rule="middle"))
    for seed in range(3):
        train(agent, n_steps=40, seed=seed)
        for read in (read_values, read_greedy_actions):
            expected = read(agent)
            for values in run_in_threads(*[partial(read, agent)] * 4):
                np.testing.assert_array_equal(values, expected)


@pytest.mark.parametrize("name", AGENTS)
def test_concurrent_readers_do_not_change_learning(name):
    unread, agent = AGENTS[name](), AGENTS[name]()
    train(unread, n_steps=300, seed=7)
    has_learned = threading.Event()

    def learn():
        try:
            train(agent, n_steps=300, seed=7)
        finally:
            has_learned.set()

    def read_while_it_learns():
        while not has_learned.is_set():
            read_values(agent)

    run_in_threads(learn, read_while_it_learns, read_while_it_learns)
    assert states_equal(agent, unread)
    np.testing.assert_array_equal(read_values(agent), read_values(unread))


def test_a_learner_gets_its_turns_while_two_threads_read_without_pause():
    # A pass takes milliseconds, so that at nearly any time one of the two threads is reading.
    sizes = SIZES.replace(n_pattern_units=100, n_hidden_units=50_000, n_active_units=15_000)
    agent = SDNNQLearning(OBSERVATIONS, ONE_ACTION, approximator=sizes, seed=1)
    train(agent, n_steps=1, seed=0)
    is_over = threading.Event()

    def read(values_of):
        while not is_over.is_set():
            for observation in OBSERVATIONS_TO_READ:
                values_of(observation)

    def learn():
        train(agent, n_steps=30, seed=7)
        return not is_over.is_set()

    with ThreadPoolExecutor() as pool:
        readers = [
            pool.submit(read, agent.q_values),
            pool.submit(read, partial(agent.act, explore=False)),
        ]
        learner = pool.submit(learn)
        wait([learner], timeout=60)
        is_over.set()
    assert learner.result(), "the learner was done only after the readers"
    assert [reader.result() for reader in readers] == [None, None]
