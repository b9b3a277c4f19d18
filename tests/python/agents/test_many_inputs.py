"""Tasks with many inputs: noise is left out, one-hot inputs are kept, pairs are limited."""

import gymnasium as gym
import numpy as np

from sdnn.agents import SDNNQLambda, evaluate, load_agent
from sdnn.approximators import LinearSDNNConfig


class WithNoise(gym.ObservationWrapper):
    """CartPole with `n` inputs of noise: "numbers", "bits", or "one-hot" (a single 1 at a time)."""

    def __init__(self, n, noise_type):
        super().__init__(gym.make("CartPole-v1"))
        bounds = self.env.observation_space
        low, high = np.append(bounds.low, np.zeros(n)), np.append(bounds.high, np.ones(n))
        self.observation_space = gym.spaces.Box(low.astype(np.float32), high.astype(np.float32))
        self._n, self._noise_type = n, noise_type

    def observation(self, observation):
        if self._noise_type == "numbers":
            noise = self.np_random.random(self._n)
        elif self._noise_type == "bits":
            noise = self.np_random.integers(2, size=self._n)
        else:
            noise = np.arange(self._n) == self.np_random.integers(self._n)
        return np.append(observation, noise).astype(np.float32)


class Square(gym.Env):
    """Cells from corner (0, 0) to the opposite one, at a cost of 1 for each step.

    Observations are a one-hot vector of all cells, or one for each of two coordinates.
    """

    action_space = gym.spaces.Discrete(4)

    def __init__(self, size, one_hot):
        self._size, self._one_hot = size, one_hot
        n = size * size if one_hot else 2 * size
        self.observation_space = gym.spaces.MultiBinary(n)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self._cell = np.zeros(2, int)
        return self._observation(), {}

    def step(self, action):
        move = [(1, 0), (-1, 0), (0, 1), (0, -1)][action]
        self._cell = np.clip(self._cell + move, 0, self._size - 1)
        return self._observation(), -1.0, bool((self._cell == self._size - 1).all()), False, {}

    def _observation(self):
        observation = np.zeros(self.observation_space.n, np.int8)
        x, y = self._cell
        observation[[self._size * y + x] if self._one_hot else [x, self._size + y]] = 1
        return observation


def test_noise_is_left_out_however_many_inputs_it_has():
    for noise_type in ("numbers", "bits", "one-hot"):
        env = WithNoise(100, noise_type)
        agent = SDNNQLambda(env, seed=1)
        agent.train(env, steps=1001, seed=1)  # inputs are chosen after 1,000
        chosen = [variable for _, variables in agent.inputs for variable in variables]
        assert chosen[:4] == [0, 1, 2, 3], "the variables of CartPole"
        # A single one of a hundred numbers may seem relevant by chance.
        assert len(chosen) <= (5 if noise_type == "numbers" else 4)


def test_one_hot_inputs_are_kept_as_a_whole_and_the_shortest_path_is_learned():
    for one_hot in (True, False):
        env = gym.wrappers.TimeLimit(Square(6, one_hot), 100)
        agent = SDNNQLambda(env, seed=1)
        agent.train(env, steps=6000, seed=1)
        assert len(agent.inputs) == env.observation_space.shape[0]
        # It takes 5 + 5 steps to cell (5, 5), at a cost of 1 each.
        assert evaluate(agent, env, episodes=1, seed=1).mean_return == -(5 + 5)


def max_pairs(env, **options):
    """Return the limit of pairs of inputs that a new agent has after its warm-up."""
    agent = SDNNQLambda(env, seed=1, **options)
    agent.train(env, steps=1001, seed=1)  # the warm-up takes 1,000
    return agent.readout.config.max_pairs


def test_more_than_32_inputs_form_1024_pairs_also_after_loading(tmp_path):
    # The limit holds only where inputs are selected and would form more pairs: 36 inputs have
    # 36 * 35 ordered pairs, 25 inputs only 25 * 24.
    all_pairs = 0  # stands for no limit
    env = gym.wrappers.TimeLimit(Square(6, one_hot=True), 100)  # of 36 inputs
    assert max_pairs(env) == 1024
    assert max_pairs(env, inputs="all") == all_pairs
    assert max_pairs(env, approximator=LinearSDNNConfig(max_pairs=72)) == 72
    assert max_pairs(gym.wrappers.TimeLimit(Square(5, one_hot=True), 100)) == all_pairs
    agent = SDNNQLambda(env, seed=1)
    agent.train(env, steps=1500, seed=1)
    agent.save(tmp_path / "agent.safetensors")
    loaded = load_agent(tmp_path / "agent.safetensors")
    for resumed in (agent, loaded):
        resumed.train(env, steps=200, seed=2)
    observation = env.reset(seed=1)[0]
    np.testing.assert_array_equal(loaded.q_values(observation), agent.q_values(observation))
