"""Checks of arguments: types of numbers, and errors that carry the name of the argument."""

import gymnasium as gym
import numpy as np
import pytest

from sdnn.agents import RBFQLearning, SDNNQLearning
from sdnn.approximators import RBFNetworkConfig, SDNNCConfig
from sdnn.support import arguments

BOX = gym.spaces.Box(-1.0, 1.0, (4,))


@pytest.mark.parametrize("value", [2, np.int8(2), np.uint64(2)])
def test_whole_accepts_integers_of_python_and_numpy(value):
    number = arguments.whole("n", value, 1, 2)
    assert number == 2
    assert type(number) is int


@pytest.mark.parametrize("value", [0.5, 1, np.float32(0.5), np.int8(1), np.inf])
def test_real_accepts_numbers_of_python_and_numpy(value):
    number = arguments.real("x", value)
    assert number == value
    assert type(number) is float


@pytest.mark.parametrize(
    ("check", "values", "problem"),
    [
        (arguments.whole, (0, 1, 2), "must be a whole number in [1, 2], got 0"),
        (arguments.real, ("x",), "must be a number, got 'x'"),
        (arguments.flag, (5,), "must be True or False, got 5"),
        (arguments.path_of, (None,), "must be the name of a file, got None"),
        (arguments.array_of, (["a"],), "must be numbers, got ['a']"),
    ],
)
def test_errors_of_checks_carry_argument_and_problem(check, values, problem):
    with pytest.raises((TypeError, ValueError)) as caught:
        check("size", *values)  # the value, and for `whole` its bounds
    assert arguments.blamed(caught.value) == ("size", problem)


@pytest.mark.parametrize(
    ("construct", "argument"),
    [
        (lambda: SDNNCConfig(n_hidden_units=-1), "n_hidden_units"),
        (lambda: SDNNCConfig(circular=5), "circular"),
        (lambda: RBFQLearning(BOX, BOX, approximator=RBFNetworkConfig(n_bases=500)), "n_bases"),
        (lambda: SDNNQLearning(BOX, BOX, angles=[0, 0]), "angles"),
        (lambda: SDNNQLearning(BOX, gym.spaces.Discrete(5000)), "n_actions"),
    ],
)
def test_errors_of_the_core_carry_the_argument(construct, argument):
    with pytest.raises((TypeError, ValueError)) as caught:
        construct()
    assert caught.value.argument == argument
    assert argument in str(caught.value)
