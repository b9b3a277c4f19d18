"""The finite sets of actions of spaces, and their conversion to elements."""

import gymnasium as gym
import numpy as np
import pytest

from sdnn.agents import FuzzyQLearning, QLearningConfig, SDNNQLearning, Transition
from sdnn.approximators import SDNNCConfig
from sdnn.environments.spaces import Actions

TWO_RANGES = gym.spaces.Box(np.array([-1.0, 0.0], np.float32), np.array([1.0, 0.1], np.float32))
PLANE = gym.spaces.Box(-1.0, 1.0, (2,), np.float64)
OBSERVATION = [0.25, -0.5]


def agent_of(space, n_actions=5, **options):
    config = SDNNCConfig(
        n_pattern_units=20, n_hidden_units=60, n_active_units=20, n_actions=n_actions
    )
    return SDNNQLearning(PLANE, space, approximator=config, **options)


def weights_after_learning(space, action):
    """Return the arrays of weights, by name, after learning a transition with an action."""
    agent = agent_of(space)
    agent.learn(Transition(OBSERVATION, action, -5.0, OBSERVATION, True))
    return {name: array for name, array in agent.state().items() if name.endswith("weights")}


def learns_the_same_weights(space, action, other_action):
    weights = weights_after_learning(space, action)
    others = weights_after_learning(space, other_action)
    return all(np.array_equal(weights[name], others[name]) for name in weights)


def test_each_dimension_of_a_box_has_evenly_spaced_actions():
    agent = agent_of(TWO_RANGES)
    assert agent.n_actions == [5, 5]
    assert np.allclose(agent.actions_of(1), np.linspace(0, 0.1, 5))  # of the second dimension
    assert all(
        agent.act(OBSERVATION, explore=explore) in TWO_RANGES for explore in [True, False] * 20
    )


def test_actions_of_an_integer_box_are_rounded_to_the_nearest_integer():
    agent = agent_of(gym.spaces.Box(0, 255, (1,), np.uint8))
    assert agent.actions.tolist() == [0, 64, 128, 191, 255]  # multiples of 63.75
    switch = agent_of(gym.spaces.Box(0, 1, (1,), np.int64))
    assert switch.actions.tolist() == [0, 0, 1, 1, 1]  # 0, 0.25, 0.5, 0.75 and 1


@pytest.mark.parametrize("dtype", [np.float16, np.float32, np.float64, np.uint8, np.int64])
def test_actions_have_the_dtype_and_shape_of_the_space(dtype):
    space = gym.spaces.Box(0, 7, (2, 3), dtype)
    for agent in (agent_of(space), FuzzyQLearning(PLANE, space)):
        for _ in range(10):
            action = agent.act(OBSERVATION)
            assert action.dtype == dtype
            assert action in space
            agent.learn(Transition(OBSERVATION, action.tolist(), 0.0, OBSERVATION, False))


@pytest.mark.parametrize(
    ("space", "n_actions", "numbers", "element"),
    [
        (gym.spaces.Discrete(3, start=5), 3, [7.0], 7),
        (gym.spaces.MultiDiscrete([2, 4], start=[0, 10]), [2, 4], [1.0, 13.0], [1, 13]),
        (gym.spaces.MultiDiscrete([[2, 3], [4, 5]]), [2, 3, 4, 5], [1, 2, 3, 4], [[1, 2], [3, 4]]),
        (gym.spaces.MultiBinary(3), [2, 2, 2], [1.0, 0.0, 1.0], [1, 0, 1]),
    ],
)
def test_elements_of_discrete_spaces_are_converted_to_numbers_and_back(
    space, n_actions, numbers, element
):
    actions = Actions(space)
    converted = actions.elements(np.array([numbers], np.float64))[0]
    assert converted in space
    assert np.array_equal(converted, element)
    assert np.array_equal(np.ravel(actions.numbers(converted)), numbers)
    agent = agent_of(space, n_actions=0)  # the space determines it
    assert agent.n_actions == n_actions
    assert agent.act(OBSERVATION) in space


def test_an_action_between_two_is_learned_as_the_nearest():
    # Five actions are 0.5 and 0.025 apart, so that [0.4, 0.06] is nearest to [0.5, 0.05].
    assert learns_the_same_weights(TWO_RANGES, [0.5, 0.05], [0.4, 0.06])
    assert not learns_the_same_weights(TWO_RANGES, [0.5, 0.05], [0.2, 0.05])


@pytest.mark.parametrize(
    ("space", "action", "others"),
    [
        (TWO_RANGES, np.float32([0.5, 0.1]), [[0.5, np.float32(0.1)], np.float32([[0.5], [0.1]])]),
        (
            gym.spaces.Discrete(3, start=2),
            np.int64(3),
            [3, 3.0, np.array(3), np.array([3]), np.uint8(3)],
        ),
    ],
)
def test_an_action_is_learned_from_lists_arrays_and_scalars_alike(space, action, others):
    for same in others:
        assert learns_the_same_weights(space, action, same)


def test_modifying_a_returned_action_does_not_change_the_next():
    agent = agent_of(TWO_RANGES, learning=QLearningConfig(tie_rule="lowest"))
    first = agent.act(OBSERVATION, explore=False)
    expected = first.copy()
    first[:] = 0.5
    assert np.array_equal(agent.act(OBSERVATION, explore=False), expected)
