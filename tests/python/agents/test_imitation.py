"""Imitation of a teacher from a log of transitions."""

import copy

import gymnasium as gym
import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from q_lambda_transcription import SMALL, Code, QLambda, random_transitions
from refusals import refuses
from sdnn.agents import (
    FuzzyQLearning,
    QLambdaConfig,
    RBFQLearning,
    SDNNActorCritic,
    SDNNQLambda,
    Transition,
    evaluate,
    imitate,
)
from sdnn.approximators import LinearSDNNConfig
from stopped_training import states_equal

SQUARE = gym.spaces.Box(0.0, 1.0, (2,), np.float64)
NO_WARM_UP = {"inputs": "all", "angle_pairs": "none", "observation_range": (0.0, 1.0)}


def cartpole_log(n_rows, seed=1, noise=0.05):
    """Return transitions of a hand-written controller; a share `noise` of its actions is random."""
    env, rng, rows = gym.make("CartPole-v1"), np.random.default_rng(seed), []
    observation, _ = env.reset(seed=seed)
    for _ in range(n_rows):
        towards_fall = int(observation @ [0.1, 0.3, 3.0, 1.0] > 0.0)
        action = int(rng.integers(2)) if rng.random() < noise else towards_fall
        after, reward, terminated, truncated, _ = env.step(action)
        rows.append((observation, action, reward, after, terminated, truncated))
        observation = env.reset()[0] if terminated or truncated else after
    return rows


@pytest.mark.parametrize("agent_class", [SDNNQLambda, SDNNActorCritic])
def test_imitation_balances_cartpole_and_learning_keeps_it_balanced(agent_class):
    env = gym.make("CartPole-v1")
    agent = agent_class(env, seed=1)
    assert imitate(agent, cartpole_log(3000), epochs=5) == 15_000
    assert evaluate(agent, env, episodes=10, seed=3).mean_return > 450  # of at most 500
    agent.train(env, steps=2000, seed=4)
    assert evaluate(agent, env, episodes=10, seed=3).mean_return > 400


ACTIONS = [
    gym.spaces.Discrete(4),
    gym.spaces.MultiDiscrete([3, 2]),
    gym.spaces.Box(-1.0, 1.0, (2,), np.float64),
]


@pytest.mark.parametrize("agent_class", [SDNNQLambda, SDNNActorCritic])
@pytest.mark.parametrize("space", ACTIONS, ids=lambda space: type(space).__name__)
@pytest.mark.parametrize("reward", [0.0, 1e-9, -1000.0])
def test_actions_of_any_space_are_imitated_at_any_size_of_rewards(agent_class, space, reward):
    # The teacher takes one of two actions by the first variable.
    space.seed(1)
    left, right = space.sample(), space.sample()
    if isinstance(space, gym.spaces.Box):
        left, right = np.array([-1.0, 1.0]), np.array([0.0, -1.0])
    points = np.random.default_rng(1).uniform(size=(300, 2))
    actions = [right if x > 0.5 else left for x, _ in points]
    log = [
        Transition(point, action, reward, point, False)
        for point, action in zip(points, actions, strict=True)
    ]
    agent = agent_class(SQUARE, space, seed=1, **NO_WARM_UP)
    imitate(agent, log)
    is_clear = abs(points[:, 0] - 0.5) > 0.1
    is_imitated = [
        # The tolerance is half a distance of the 5 actions of a box from -1 to 1.
        np.allclose(agent.act(point, explore=False), action, atol=0.25)
        for point, action in zip(points[is_clear], np.array(actions)[is_clear], strict=True)
    ]
    assert np.mean(is_imitated) > 0.95


def test_rewards_whose_squares_overflow_are_imitated_and_larger_returns_refused():
    agent, other = (SDNNQLambda(gym.spaces.Box(-1, 1, (2,)), gym.spaces.Discrete(3)) for _ in "ab")
    # Returns may be up to 1e300, and the discounted sum of three such rewards is more.
    refuses("dataset", imitate, agent, [([0, 0], 1, 1e300, [0, 0], False)] * 3)
    assert agent.is_warming_up
    imitate(agent, [([0, 0], 1, 1e160, [0, 0], True)])
    imitate(other, [([0, 0], 1, 1.0, [0, 0], True)])
    for imitator in (agent, other):
        assert imitator.act([0, 0], explore=False) == 1
    assert agent.q_values([0, 0])[1] == pytest.approx(1e160 * other.q_values([0, 0])[1], rel=0.01)


def value_of(agent, observation):
    if isinstance(agent, SDNNActorCritic):
        return agent.value(observation)
    return agent.q_values(observation).max()


@pytest.mark.parametrize("agent_class", [SDNNQLambda, SDNNActorCritic])
def test_values_after_imitation_are_the_returns_of_the_teacher(agent_class):
    a, b = [0.2, 0.2], [0.8, 0.8]
    learning, actions = agent_class.learning_type(discount=0.5), gym.spaces.Discrete(2)
    agent, other = (agent_class(SQUARE, actions, learning=learning, **NO_WARM_UP) for _ in range(2))
    # An episode of two steps with a reward of 8 at its end.
    terminated = [Transition(a, 0, 0.0, b, False), Transition(b, 1, 8.0, b, True)]
    imitate(agent, terminated, epochs=200)
    assert value_of(agent, a) == pytest.approx(0.5 * 8.0, abs=0.2)
    assert value_of(agent, b) == pytest.approx(8.0, abs=0.2)
    # A truncated episode bootstraps from its last observation: v = 3 + 0.5 v = 6.
    imitate(other, [(b, 1, 3.0, b, False, True)], epochs=400)
    assert value_of(other, b) == pytest.approx(6.0, abs=0.2)


@pytest.mark.parametrize("n_rows", [1, 2, 40, 300])
def test_unknown_ranges_are_fitted_to_logs_shorter_and_longer_than_a_warm_up(n_rows):
    space = gym.spaces.Box(-np.inf, np.inf, (2,), np.float64)
    agent = SDNNQLambda(space, gym.spaces.Discrete(2), warm_up_steps=200, seed=1)
    points = np.random.default_rng(1).uniform(2.0, 4.0, (n_rows, 2))
    points[0], points[-1] = 2.0, 4.0
    rows = [Transition(point, int(point[0] > 3.0), 0.0, point, True) for point in points]
    assert imitate(agent, rows, epochs=3) == 3 * n_rows
    low, high = agent.observation_range
    if n_rows == 40:  # a short log: the range of 2 to 4 is widened by twice its width on both sides
        np.testing.assert_allclose(low, -2.0)
        np.testing.assert_allclose(high, 8.0)
    assert agent.act([4.0, 4.0], explore=False) == 1


def test_imitation_ends_a_warm_up_that_has_begun():
    agent = SDNNQLambda(gym.make("CartPole-v1"), warm_up_steps=100, seed=1)
    rows = cartpole_log(300)
    for row in rows[:99]:
        agent.learn(Transition(*row[:5]))
    assert agent._n_warm_up_steps_left == 1
    imitate(agent, rows, epochs=1)
    assert not agent.is_warming_up


@pytest.mark.parametrize("agent_class", [SDNNQLambda, SDNNActorCritic])
def test_imitation_of_rows_columns_and_a_loaded_agent_have_the_same_bits(agent_class, tmp_path):
    rows = cartpole_log(400)
    names = (
        "observations", "actions", "rewards", "next_observations", "terminations", "truncations",
    )  # fmt: skip
    columns = dict(zip(names, map(np.array, zip(*rows, strict=True)), strict=True))
    agent, saved = (agent_class(gym.make("CartPole-v1"), seed=1) for _ in range(2))
    imitate(agent, rows, epochs=1)
    imitate(agent, rows, epochs=1)
    imitate(saved, columns, epochs=1)
    saved.save(tmp_path / "agent.safetensors")
    saved = agent_class.load(tmp_path / "agent.safetensors")
    imitate(saved, columns, epochs=1)
    assert states_equal(agent, saved)


def imitate_in_numpy(slow, x, action, value, margin):
    """Learn an action's value, and a margin to the best other one, as `QLambda::imitate`."""
    slow.fit_unit(value)
    slow.fit_unit(margin)
    slow.n_learned += 1
    s = slow.settings
    rate = max(1, slow.scheduled(s.learning_rate, s.final_learning_rate))
    while abs(slow.value(x, action)) >= 2**33:  # values stay below 2^33 units
        slow.double_unit()
    error = slow.units_of(value) - slow.value(x, action)
    move_in_numpy(slow, x, np.full(len(slow.weights), error), rate, action)
    errors = np.zeros(len(slow.weights), np.int64)
    for dimension, values in enumerate(slow.sums(x, slow.weights)):
        chosen = action[dimension]
        others = np.delete(np.arange(len(values)), chosen)
        if len(others) == 0:
            continue
        best = others[np.argmax(values[others])]
        error = int(values[best]) + slow.units_of(margin) - int(values[chosen])
        if error > 0:
            half = error * len(action) // 2
            rows = slow.first_rows[dimension] + np.arange(slow.window)
            np.add.at(errors, rows + chosen, half)
            np.add.at(errors, rows + best, -half)
    move_in_numpy(slow, x, errors, 2**16 // 10, action)  # a rate of 0.1 in units of 2^-16


def move_in_numpy(slow, x, errors, rate, action):
    """Move weights by errors of their rows, in fixed point as `LinearSDNN::move_rows`."""
    part = (rate << 12) // max(1, np.count_nonzero(x) * len(slow.rows(action)))
    steps = [((int(np.clip(e, 1 - 2**34, 2**34 - 1)) * part + 2**27) >> 28) for e in errors]
    largest = max(map(abs, steps))
    while largest >= 2**23:
        slow.double_unit()
        steps, largest = [(step + 1) >> 1 for step in steps], (largest + 1) >> 1
    slow.weights += np.outer(np.array(steps, np.int64), x)
    used = int(np.bitwise_or.reduce(slow.weights ^ slow.weights >> 63, None))
    while used >= 2**23:
        slow.double_unit()
        used = used >> 1 | int(np.any(slow.weights == 2**23)) << 23


@given(
    seed=st.integers(0, 10**6),
    n_actions=st.integers(2, 4),
    n_dimensions=st.integers(1, 2),
    window=st.integers(1, 3),
    scale=st.sampled_from([1.0, 100.0, 1e6, 1e-40]),
)
@settings(max_examples=30, deadline=None)
def test_weights_after_imitation_are_those_of_the_numpy_transcription(
    seed, n_actions, n_dimensions, window, scale
):
    learning = {"schedule_steps": 7, "bootstrap": "q_learning", "traces": "dutch"}
    agent = SDNNQLambda(
        SQUARE,
        gym.spaces.Box(0.0, 1.0, (n_dimensions,), np.float64),
        approximator=LinearSDNNConfig(**SMALL, action_window=window, n_actions=n_actions),
        learning=QLambdaConfig(schedule_steps=7),
        seed=seed,
        **NO_WARM_UP,
    )
    sizes = [n_actions] * n_dimensions
    slow, margin = QLambda(Code(agent.readout.code, 2), sizes, window, learning), 0.1 * scale
    for state, action, value, _, _ in random_transitions(seed, 25, sizes, scale):
        torques = np.array(action) / (n_actions - 1)  # from 0 to 1
        agent._imitate_step(Transition(state, torques, 0.0, state, True), value, margin)
        imitate_in_numpy(slow, slow.code(state), action, value, margin)
        assert agent.readout.exponent == slow.exponent
        np.testing.assert_array_equal(agent.readout.weights(), slow.weights)


def test_wrong_agents_actions_and_datasets_are_refused_and_change_nothing():
    actions = gym.spaces.Discrete(2)
    agent = SDNNQLambda(SQUARE, actions, seed=1, **NO_WARM_UP)
    row = Transition([0.1, 0.1], 1, 0.0, [0.2, 0.2], True)
    assert imitate(agent, []) == 0
    unchanged = copy.deepcopy(agent)
    error = refuses("action", imitate, agent, [row, row._replace(action=2)])
    assert "episode 1, transition 1" in str(error)
    refuses("agent", imitate, RBFQLearning(SQUARE, actions), [row], error=TypeError)
    torque = gym.spaces.Box(-1.0, 1.0, (1,))
    refuses("agent", imitate, FuzzyQLearning(SQUARE, torque), [row], error=TypeError)
    assert states_equal(agent, unchanged)
    with pytest.raises(RuntimeError, match="warming up"):
        SDNNQLambda(SQUARE, actions, warm_up_steps=9)._imitate_step(row, 0.0, 1.0)
