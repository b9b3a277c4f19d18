"""Every agent in a loop of acting and learning that is written in Python."""

import gymnasium as gym
import numpy as np
import pytest

from sdnn.agents import (
    FuzzyQLearning,
    RBFQLearning,
    SDNNQLearning,
    Transition,
)
from sdnn.approximators import SDNNCConfig

SMALL = SDNNCConfig(n_pattern_units=40, n_hidden_units=120, n_active_units=30)


def live(env, agent, n_steps):
    """Acts and learns in any environment; returns the actions taken."""
    observation, _ = env.reset(seed=1)
    agent.begin_episode()
    actions = []
    for _ in range(n_steps):
        action = agent.act(observation)
        following, reward, terminated, truncated, _ = env.step(action)
        agent.learn(Transition(observation, action, float(reward), following, terminated))
        observation = following
        actions.append(np.asarray(action).tolist())
        if terminated or truncated:
            observation, _ = env.reset()
            agent.begin_episode()
    return actions


@pytest.mark.parametrize(
    ("kind", "options"),
    [(SDNNQLearning, {"approximator": SMALL}), (FuzzyQLearning, {}), (RBFQLearning, {})],
)
def test_it_lives_in_pendulum(kind, options):
    env = gym.make("Pendulum-v1")

    def born(seed):
        return kind(env.observation_space, env.action_space, seed=seed, **options)

    first, second = (live(env, born(seed=3), 450) for _ in range(2))
    assert first == second, "the same seeds live the same life"
    assert len({tuple(action) for action in first}) > 20
    assert first != live(env, born(seed=4), 450)


def test_equal_lives_leave_equal_weights():
    env = gym.make("Pendulum-v1")
    agents = [
        SDNNQLearning(env.observation_space, env.action_space, approximator=SMALL, seed=3)
        for _ in range(3)
    ]
    for agent in agents[:2]:
        live(env, agent, 450)
    first, second, fresh = (agent.core.action_value.weights() for agent in agents)
    assert np.array_equal(first, second)
    assert not np.array_equal(first, fresh)


def test_it_lives_in_cart_pole_with_bounds_that_matter():
    env = gym.make("CartPole-v1")
    bounds = np.array([2.4, 3.0, 0.21, 3.0])
    agent = SDNNQLearning(
        gym.spaces.Box(-bounds, bounds, dtype=np.float64),
        env.action_space,
        approximator=SMALL,
        seed=3,
    )
    assert agent.n_actions == 2
    assert set(live(env, agent, 300)) == {0, 1}
