"""Several threads read one agent at once, and get the bits that one alone gets."""

import threading
from functools import partial

import gymnasium as gym
import numpy as np
import pytest

from sdnn.agents import FuzzyQLearning, QLearningConfig, RBFQLearning, SDNNQLearning, Transition
from sdnn.approximators import SDNNCConfig

N_INPUTS = 3
OBSERVATIONS = gym.spaces.Box(0.0, 1.0, (N_INPUTS,), np.float64)
ONE = gym.spaces.Box(-1.0, 1.0, (1,), np.float64)
TWO = gym.spaces.Box(-1.0, 1.0, (2,), np.float64)
SIZES = SDNNCConfig(n_pattern_units=50, n_hidden_units=200, n_active_units=60, n_actions=9)
AVERAGING = SIZES.replace(averaging_interval=10)
AGENTS = {
    "sdnn": partial(SDNNQLearning, OBSERVATIONS, ONE, approximator=SIZES, seed=1),
    "averaging": partial(SDNNQLearning, OBSERVATIONS, ONE, approximator=AVERAGING, seed=1),
    "decoupled": partial(SDNNQLearning, OBSERVATIONS, TWO, approximator=SIZES, seed=1),
    "rbf": partial(
        RBFQLearning, OBSERVATIONS, ONE, learning=QLearningConfig(n_greedy_steps=0), seed=1
    ),
    "fuzzy": partial(FuzzyQLearning, OBSERVATIONS, ONE, seed=1),
    "fuzzy vectors": partial(FuzzyQLearning, OBSERVATIONS, TWO, seed=1),
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


def read(agent, seed=0):
    observations = np.random.default_rng(seed).random((60, N_INPUTS))
    read_all = agent.value if isinstance(agent, FuzzyQLearning) else agent.q_values
    return np.array([read_all(observation) for observation in observations])


def greedy(agent, seed=0):
    observations = np.random.default_rng(seed).random((60, N_INPUTS))
    return np.array([agent.act(observation, explore=False) for observation in observations])


def in_threads(*works):
    results = [None] * len(works)

    def run(index):
        try:
            results[index] = works[index]()
        except BaseException as error:
            results[index] = error

    threads = [threading.Thread(target=run, args=(index,)) for index in range(len(works))]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    return results


@pytest.mark.parametrize("name", AGENTS)
def test_concurrent_readers_get_the_bits_of_a_single_reader(name):
    # Without draws, whose order would be that of the threads.
    agent = AGENTS[name](learning=AGENTS[name]().learning.replace(tie_rule="middle"))
    for round_number in range(3):
        train(agent, 40, round_number)
        for read_all in (read, greedy):
            expected = read_all(agent)
            for values in in_threads(*[lambda read_all=read_all: read_all(agent)] * 4):
                np.testing.assert_array_equal(values, expected)


@pytest.mark.parametrize("name", AGENTS)
def test_concurrent_readers_do_not_change_learning(name):
    alone, watched = AGENTS[name](), AGENTS[name]()
    train(alone, 300, 7)
    done = threading.Event()

    def learn():
        train(watched, 300, 7)
        done.set()

    def watch():
        while not done.is_set():
            read(watched)

    assert in_threads(learn, watch, watch) == [None] * 3
    for name, array in alone.state().items():
        np.testing.assert_array_equal(watched.state()[name], array)
    np.testing.assert_array_equal(read(watched), read(alone))
