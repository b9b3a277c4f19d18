"""Actions of spaces as numbers, and back."""

import gymnasium as gym
import numpy as np
import pytest

from sdnn.agents.actions import ContinuousActions, IndexedActions

FLOATS = gym.spaces.Box(np.array([-1.0, 0.0], np.float32), np.array([1.0, 0.1], np.float32))


def test_every_dimension_of_a_box_is_cut_evenly():
    actions = IndexedActions(FLOATS, 5)
    assert actions.n_actions == [5, 5]
    assert np.allclose(actions.values(1), np.linspace(0, 0.1, 5))
    assert np.array_equal(actions.element([4, 0]), FLOATS.dtype.type([1.0, 0.0]))
    assert all(actions.element([i, j]) in FLOATS for i in range(5) for j in range(5))


def test_whole_numbers_of_a_box_are_the_nearest():
    bytes_ = gym.spaces.Box(0, 255, (1,), np.uint8)
    actions = IndexedActions(bytes_, 5)
    assert actions.values(0).tolist() == [0, 64, 128, 191, 255]
    for index, value in enumerate([0, 64, 128, 191, 255]):
        made = actions.element([index])
        assert made in bytes_
        assert made.tolist() == [value]
        assert actions.numbers([value]) == [index]
    switch = IndexedActions(gym.spaces.Box(0, 1, (1,), np.int64), 5)
    assert [int(switch.element([i])[0]) for i in range(5)] == [0, 0, 1, 1, 1]
    assert ContinuousActions(bytes_).element([0.001]).tolist() == [128]


def test_the_nearest_action_is_found():
    actions = IndexedActions(FLOATS, 5)
    for i in range(5):
        for j in range(5):
            assert actions.numbers(actions.element([i, j])) == [i, j]
    assert actions.numbers([0.2, 0.06]) == [2, 2]


@pytest.mark.parametrize(
    ("space", "n_actions", "numbers", "element"),
    [
        (gym.spaces.Discrete(3, start=5), [3], [2], 7),
        (gym.spaces.MultiDiscrete([2, 4], start=[0, 10]), [2, 4], [1, 3], [1, 13]),
        (gym.spaces.MultiDiscrete([[2, 3], [4, 5]]), [2, 3, 4, 5], [1, 2, 3, 4], [[1, 2], [3, 4]]),
        (gym.spaces.MultiBinary(3), [2, 2, 2], [1, 0, 1], [1, 0, 1]),
    ],
)
def test_whole_numbers_keep_their_meaning(space, n_actions, numbers, element):
    actions = IndexedActions(space, 99)
    assert actions.n_actions == n_actions
    made = actions.element(numbers)
    assert made in space
    assert np.array_equal(made, element)
    assert actions.numbers(made) == numbers


def test_the_action_taken_is_remembered_by_its_numbers():
    actions = ContinuousActions(FLOATS)
    taken = actions.take([0.25, -0.5])
    assert np.allclose(taken, [0.25, 0.025])
    copy = taken.copy()
    taken[:] = 0.0
    assert actions.numbers(copy) == [0.25, -0.5]
    with pytest.raises(ValueError, match="that of the last exploring act"):
        actions.numbers(taken)


def test_the_action_taken_is_known_in_other_forms():
    actions = ContinuousActions(FLOATS)
    taken = actions.take([0.25, -0.5])
    for same in (taken.tolist(), taken.astype(np.float64), taken.reshape(2, 1), tuple(taken)):
        assert actions.numbers(same) == [0.25, -0.5]
    buttons = IndexedActions(gym.spaces.Discrete(3, start=2), 1)
    taken = buttons.take([1])
    for same in (taken, int(taken), np.array(taken), np.array([taken]), float(taken)):
        assert buttons.numbers(same) == [1]
    assert buttons.numbers(4) == [2]
    # The same bytes, but another type: the whole number 2 is the smallest double above 0.
    assert not buttons.space.contains(np.frombuffer(buttons.take([0]).tobytes())[0])
    with pytest.raises(ValueError, match="action must be in Discrete"):
        buttons.numbers(np.frombuffer(buttons.take([0]).tobytes())[0])


def test_what_is_done_to_an_action_does_not_change_the_next():
    actions = IndexedActions(FLOATS, 5)
    first = actions.element([4, 0])
    expected = first.copy()
    first[:] = 0.5
    assert np.array_equal(actions.element([4, 0]), expected)
    with pytest.raises(TypeError):
        actions.check([4.0, 0.0])


def test_more_actions_than_are_remembered_are_made():
    actions = IndexedActions(gym.spaces.Box(-1.0, 1.0, (1,)), 3000)
    for index in [*range(3000), *range(3000)]:
        element = actions.take([index])
        assert actions.numbers(element) == [index]
        assert element == pytest.approx(-1.0 + 2.0 * index / 2999)


def test_random_actions_are_of_the_space_and_reach_all_of_it():
    generator = np.random.default_rng(1)
    drawn = IndexedActions(FLOATS, 3)
    assert {tuple(drawn.random(generator)) for _ in range(200)} == {
        (i, j) for i in range(3) for j in range(3)
    }
    continuous = ContinuousActions(FLOATS)
    assert all(continuous.element(continuous.random(generator)) in FLOATS for _ in range(50))


@pytest.mark.parametrize(
    "action", [[0.0], [0.0, 5.0], [np.nan, 0.0], "left", None, [[0.0, 0.0, 0.0]], [1j, 0.0]]
)
def test_what_is_no_action_is_refused(action):
    with pytest.raises(ValueError, match="action must be in Box"):
        IndexedActions(FLOATS, 3).numbers(action)


@pytest.mark.parametrize("action", [[0.5, 0], [2, 0], [-1, 0], [True]])
def test_what_is_no_whole_action_is_refused(action):
    with pytest.raises(ValueError, match="action must be in MultiDiscrete"):
        IndexedActions(gym.spaces.MultiDiscrete([2, 4]), 3).numbers(action)


@pytest.mark.parametrize(
    ("space", "error", "message"),
    [
        (gym.spaces.Text(3), TypeError, "action_space must be a Box, Discrete, MultiDiscrete"),
        (gym.spaces.Box(0, np.inf, (1,)), ValueError, "action_space must have finite bounds"),
        (gym.spaces.Box(0, 1, (0,)), ValueError, "action_space must have 1 to 1024 dimensions"),
    ],
)
def test_impossible_spaces_are_named(space, error, message):
    with pytest.raises(error, match=message):
        IndexedActions(space, 3)


def test_continuous_actions_need_a_box():
    with pytest.raises(TypeError, match="action_space must be a Box, got Discrete"):
        ContinuousActions(gym.spaces.Discrete(3))
