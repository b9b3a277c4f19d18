"""Every agent in a loop of acting and learning that is written in Python."""

import gymnasium as gym
import numpy as np
import pytest

from sdnn import _core
from sdnn.agents import (
    FuzzyQLearning,
    FuzzyQLearningConfig,
    QLearningConfig,
    RBFQLearning,
    SDNNQLearning,
    Transition,
)
from sdnn.approximators import FuzzyRulesConfig, RBFNetworkConfig, SDNNCConfig
from sdnn.environments import (
    AcrobotConfig,
    AcrobotSwingUpEnv,
    GoalScheduleConfig,
    NoisySensors,
    RedundantSensors,
    SensorConfig,
)
from sdnn.environments.goal_schedule import GoalSchedule

SMALL = SDNNCConfig(n_pattern_units=40, n_hidden_units=120, n_active_units=30)

KINDS = {
    "sdnn-c": (SDNNQLearning, _core.AcrobotTrial, SDNNCConfig, QLearningConfig),
    "fql": (FuzzyQLearning, _core.FuzzyAcrobotTrial, FuzzyRulesConfig, FuzzyQLearningConfig),
    "rbfn": (RBFQLearning, _core.RBFAcrobotTrial, RBFNetworkConfig, QLearningConfig),
}
"""Agent, compiled trial, and the configurations of approximator and learning."""


def python_trial(make_agent, *, n_sensors, noise, n_episodes, test_interval, seed):
    """The paper's protocol written with the Python rooms; rows as the trial gives them."""

    def make_env(stream):
        env = AcrobotSwingUpEnv(
            config=AcrobotConfig(), goal_schedule=GoalSchedule(), dtype="float64"
        )
        env = RedundantSensors(env, ("energy", "height")[: n_sensors - 4])
        return NoisySensors(env, sigma=noise, seed=seed, stream=stream)

    learning_env, test_env = make_env("sensor_noise"), make_env("evaluation_sensor_noise")
    agent = make_agent(learning_env.observation_space, learning_env.action_space, seed=seed)
    n_decisions = 0

    def run(env, episode, learning):
        nonlocal n_decisions
        observation, _ = env.reset(options={"episode": episode})
        agent.begin_episode()
        steps, total, over = 0, 0.0, False
        while not over:
            action = agent.act(observation, explore=learning)
            following, reward, terminated, truncated, _ = env.step(action)
            if learning:
                agent.learn(Transition(observation, action, reward, following, terminated))
            observation = following
            steps, total, over = steps + 1, total + reward, terminated or truncated
        n_decisions += steps
        return steps, total, terminated

    rows = []
    for episode in range(1, n_episodes + 1):
        run(learning_env, episode, True)
        if episode % test_interval == 0:
            rows.append((episode, *run(test_env, episode, False)))
    return rows, n_decisions


@pytest.mark.parametrize(
    ("kind", "n_sensors", "noise"),
    [
        ("sdnn-c", 4, 0.0),
        ("sdnn-c", 4, 0.02),
        ("sdnn-c", 5, 0.02),
        ("sdnn-c", 6, 0.02),
        ("fql", 4, 0.0),
        ("fql", 6, 0.02),
        ("rbfn", 4, 0.0),
        ("rbfn", 6, 0.02),
    ],
)
def test_a_python_loop_reproduces_the_compiled_trial(kind, n_sensors, noise):
    n_episodes, test_interval, seed = 60, 5, 11
    make_agent, make_trial, approximator, learning = KINDS[kind]
    trial = make_trial(
        approximator=approximator(n_inputs=n_sensors).to_core(),
        learning=learning().to_core(),
        acrobot=AcrobotConfig().to_core(),
        goal=GoalScheduleConfig().to_core(),
        sensors=SensorConfig(n_sensors=n_sensors, noise=noise).to_core(),
        protocol=_core.ProtocolConfig(n_learning_episodes=n_episodes, test_interval=test_interval),
        seed=seed,
    )
    trial.advance(n_episodes)
    assert trial.finished
    columns = trial.test_rows()
    names = ("episode", "steps", "episode_return", "solved")
    expected = list(zip(*(columns[name].tolist() for name in names), strict=True))
    rows, n_decisions = python_trial(
        make_agent,
        n_sensors=n_sensors,
        noise=noise,
        n_episodes=n_episodes,
        test_interval=test_interval,
        seed=seed,
    )
    assert rows == expected
    assert n_decisions == trial.n_decisions


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
    with pytest.raises(ValueError, match="finite bounds"):
        SDNNQLearning(env.observation_space, env.action_space)
    bounds = np.array([2.4, 3.0, 0.21, 3.0])
    agent = SDNNQLearning(
        gym.spaces.Box(-bounds, bounds, dtype=np.float64),
        env.action_space,
        approximator=SMALL,
        seed=3,
    )
    assert agent.n_actions == 2
    assert set(live(env, agent, 300)) == {0, 1}
