"""Values that NumPy would silently turn into two numbers are refused where two are expected."""

import gymnasium as gym
import numpy as np
import pytest

from sdnn.agents import RBFQLearning, Transition
from sdnn.coding import RandomInverse
from sdnn.coding.kernel import AnalyticKernel
from sdnn.environments import AcrobotSwingUpVectorEnv, NoisySensors, RedundantSensors, UnitSensors
from sdnn.runs import RunSpec, trial_seed
from sdnn.runs.settings import convert_value

NOT_TWO_NUMBERS = {
    "masked": lambda: np.ma.masked_array([0.1, 0.2], [False, True]),
    "dates": lambda: np.array(["1970-01-02", "1970-01-03"], "M8[D]"),
    "times": lambda: np.array([1, 2], "m8[s]"),
    "texts": lambda: ["0.1", "0.2"],
    "texts of NumPy": lambda: np.array(["0.1", "0.2"]),
    "bytes": lambda: np.array([b"0.1", b"0.2"]),
    "complex": lambda: np.array([0.1 + 0j, 0.2 + 0j]),
    "objects": lambda: np.array([0.1, "0.2"], object),
    "a column": lambda: np.array([[0.1], [0.2]]),
    "a row": lambda: np.array([[0.1, 0.2]]),
    "three": lambda: [0.1, 0.2, 0.3],
    "none": lambda: [],
}
PAIR = np.array([0.1, 0.2])


class Plane(gym.Env):
    observation_space = gym.spaces.Box(0.0, 1.0, (2,), np.float64)
    action_space = gym.spaces.Box(0.0, 1.0, (2,), np.float64)


def agent():
    return RBFQLearning(Plane.observation_space, Plane.action_space, seed=1)


def agent_of_dict():
    space = gym.spaces.Dict(at=Plane.observation_space)
    return RBFQLearning(space, gym.spaces.Discrete(2), seed=1)


def acrobots():
    envs = AcrobotSwingUpVectorEnv(num_envs=2)
    envs.reset(seed=1)
    return envs


CALLS = {
    "act": lambda pair: agent().act(pair),
    "act, of a Dict": lambda pair: agent_of_dict().act({"at": pair}),
    "learn, observation": lambda pair: agent().learn(Transition(pair, PAIR, 1.0, PAIR, False)),
    "learn, next": lambda pair: agent().learn(Transition(PAIR, PAIR, 1.0, pair, False)),
    "values": lambda pair: agent().q_values(pair),
    "UnitSensors": lambda pair: UnitSensors(Plane()).observation(pair),
    "RedundantSensors": lambda pair: RedundantSensors(Plane(), [np.sum]).observation(pair),
    "NoisySensors": lambda pair: NoisySensors(Plane()).observation(pair),
    "observation_low": lambda pair: UnitSensors(Plane(), pair, [1.0, 1.0]),
    "knots": lambda pair: RandomInverse(knots=pair, spacing="quantile").fit(PAIR, 400),
}
CALLS_WITH_ANY_SHAPE = {
    "learn, action": lambda pair: agent().learn(Transition(PAIR, pair, 1.0, PAIR, False)),
    "actions of acrobots": lambda pair: acrobots().step(pair),
}
CALLS_WITH_SAMPLES = {
    "kernel": lambda pair: AnalyticKernel("anchor", n_inputs=2, n_units=100)([pair]),
    "coding": lambda pair: RandomInverse().fit(pair, 400),
}
"""Calls with any number of samples; other tests check their error for words."""


@pytest.mark.parametrize("name", [*CALLS, *CALLS_WITH_ANY_SHAPE, *CALLS_WITH_SAMPLES])
def test_values_that_numpy_would_convert_silently_are_refused(name):
    accepted = {"a column", "a row"} if name in CALLS_WITH_ANY_SHAPE else set()
    if name in CALLS_WITH_SAMPLES:
        accepted = {"a column", "a row", "three", "objects"}
    call = (CALLS | CALLS_WITH_ANY_SHAPE | CALLS_WITH_SAMPLES)[name]
    for word, make in NOT_TWO_NUMBERS.items():
        if word not in accepted:
            with pytest.raises((TypeError, ValueError)) as error:
                call(make())
            assert "incompatible" not in str(error.value), "a message of the bindings"
    if name != "knots":  # which need other numbers
        call(PAIR)


NOT_NUMBERS = {
    "a text": "1", "a text of NumPy": np.str_("1"), "a date": np.datetime64(1, "ns"),
    "a time": np.timedelta64(1, "ns"), "complex": 1 + 0j, "masked": np.ma.masked_array(1, True),
    "bytes": b"1",
}  # fmt: skip
BOOLS = {"True": True, "True of NumPy": np.True_, "an array": np.array(True)}


@pytest.mark.parametrize("kind", [int, float])
def test_texts_dates_and_bools_are_refused_as_numbers(kind):
    for value in (*NOT_NUMBERS.values(), *BOOLS.values(), np.nan):
        with pytest.raises(Exception, match="must be"):
            convert_value(kind, value, "key")


def test_settings_of_wrong_types_are_refused_with_their_table():
    for tables in (
        {"environment": 5}, {"agent": 5}, {"budget": 5}, {"budget": {"target_return": np.nan}},
        {"budget": {"target_return": "abc"}}, {"output": {"tensorboard": "yes"}},
        {"learning": 5}, {"approximator": []}, {"output": True}, {"protocol": "abc"},
    ):  # fmt: skip
        with pytest.raises(Exception, match=next(iter(tables))):
            RunSpec(**{"environment": "CartPole-v1"} | tables)


def test_seeds_of_trials_must_be_integers():
    for value in (*NOT_NUMBERS.values(), *BOOLS.values(), 0.5, 1.0, [1]):
        with pytest.raises(ValueError, match="root_seed"):
            trial_seed(value, "s4", 0)
        with pytest.raises(ValueError, match=r"\btrial\b"):
            trial_seed(0, "s4", value)
