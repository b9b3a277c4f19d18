"""Observations of any space as vectors of inputs with ranges."""

import gymnasium as gym
import numpy as np
import pytest

from refusals import refuses
from sdnn.agents import RBFQLearning, SDNNQLearning, Transition, load_agent
from sdnn.approximators import SDNNCConfig
from sdnn.environments.space_kinds import flat_bounds
from sdnn.environments.spaces import Observations

BOX = gym.spaces.Box(np.array([-1.0, 0.0]), np.array([3.0, 10.0]), dtype=np.float64)
UNBOUNDED = gym.spaces.Box(-np.inf, np.inf, (3,), dtype=np.float64)
SMALL = SDNNCConfig(n_pattern_units=20, n_hidden_units=60, n_active_units=20)
ACTIONS = gym.spaces.Discrete(2)


def config(space, ranges=None, angles=(), angle_pairs="none"):
    return Observations(space).config(ranges, angles, angle_pairs, "all")


def sdnn_agent(space, **options):
    return SDNNQLearning(space, ACTIONS, approximator=SMALL, **options)


def inputs(space, **options):
    return sdnn_agent(space, **options).inputs


def test_ranges_are_the_bounds_of_the_space_unless_other_ranges_are_passed():
    agent = sdnn_agent(BOX)
    assert not agent.is_warming_up
    lowest, highest = BOX.low.tolist(), BOX.high.tolist()
    assert [bound.tolist() for bound in agent.observation_range] == [lowest, highest]
    agent = sdnn_agent(BOX, observation_range=(0.0, [2.0, 4.0]))
    assert [bound.tolist() for bound in agent.observation_range] == [[0.0, 0.0], [2.0, 4.0]]


def test_a_warm_up_fits_ranges_and_finds_angle_pairs():
    agent = RBFQLearning(UNBOUNDED, ACTIONS, angle_pairs="find", warm_up_steps=40)
    with pytest.raises(RuntimeError, match="warm"):
        _ = agent.observation_range
    for turn in np.linspace(0, 5, 40):
        observation = [np.cos(turn), np.sin(turn), 4.0 * turn / 5]
        agent.learn(Transition(observation, 1, 0.0, observation, False))
    low, high = agent.observation_range
    # The third variable was in 0 to 4, which is widened by a quarter at either end.
    assert (low.tolist(), high.tolist()) == ([-1.0, -1.0, -1.0], [1.0, 1.0, 5.0])
    assert agent.inputs == [("angle", [0, 1]), ("variable", [2])]


def test_a_bound_at_the_largest_float_is_unbounded():
    limit = np.finfo(np.float32).max
    assert config(gym.spaces.Box(-limit, limit, (2,))).low == (None, None)


@pytest.mark.parametrize("dtype", [np.int32, np.int64])
def test_infinite_bounds_of_integer_boxes_are_unbounded(dtype):
    box = gym.spaces.Box
    parts = {"up": box(0, np.inf, (1,), dtype), "all": box(-np.inf, np.inf, (2,), dtype)}
    space = gym.spaces.Dict(parts | {"byte": box(0, 255, (1,), np.uint8)})  # is ordered by names
    low, high = flat_bounds(space)
    assert low.tolist() == [-np.inf, -np.inf, 0.0, 0.0]
    assert high.tolist() == [np.inf, np.inf, 255.0, np.inf]
    assert config(space).high == (None, None, 255.0, None)


def test_the_largest_integer_is_a_bound_with_16_bits_but_none_with_32():
    box = gym.spaces.Box
    assert flat_bounds(box(np.int16(-32768), np.int16(32767), (1,), np.int16))[1] == [32767.0]
    low, high = flat_bounds(box(0, np.iinfo(np.uint32).max, (1,), np.uint32))
    assert (low, high) == ([0.0], [np.inf])


def test_a_lower_bound_may_be_unknown_where_the_upper_one_is_known_and_the_other_way_round():
    half_bounded = gym.spaces.Box(np.array([-np.inf, 0.0]), np.array([1.0, 1.0]), dtype=np.float64)
    settings = config(half_bounded)
    assert (settings.low, settings.high) == ((None, 0.0), (None, 1.0))
    settings = config(UNBOUNDED, ([0.0, np.nan, -1.0], 2.0))  # NaN: an unknown bound
    assert (settings.low, settings.high) == ((0.0, None, -1.0), (2.0, None, 2.0))


def test_the_learning_report_shows_the_share_of_each_range_that_was_observed():
    space = gym.spaces.Dict({"at": gym.spaces.Box(0, 1, (1,)), "room": gym.spaces.Discrete(3)})
    agent = sdnn_agent(space)
    for t in range(400):
        observation = {"at": [t % 9 / 9], "room": t % 3}
        agent.learn(Transition(observation, 0, 0.0, observation, False))
    # "at" has the values 0, 1/9 ... 8/9 of the range from 0 to 1; a discrete "room" has no range.
    report = agent.learning_report()
    assert report["share_of_range"][0] > 0.7
    assert report["share_beyond_range"][0] == 0.0
    assert report["share_of_range"][1:] == [None] * 3


NESTED = gym.spaces.Dict(
    {
        "speed": gym.spaces.Box(-2, 2, (2,), np.float64),
        "gear": gym.spaces.Discrete(3, start=-1),
        "switches": gym.spaces.Tuple([gym.spaces.MultiDiscrete([2, 5]), gym.spaces.MultiBinary(1)]),
    }
)


def test_each_discrete_part_is_one_symbol_input_where_symbols_are_coded():
    agent = SDNNQLearning(NESTED, ACTIONS, approximator=SMALL)
    # A variable has its index in the flattened observation, a symbol the first index and the number
    # of its values. Gymnasium sorts the names of a Dict.
    assert agent.inputs == [
        ("symbol", [0, 3]),
        ("variable", [3]),
        ("variable", [4]),
        ("symbol", [5, 2]),
        ("symbol", [7, 5]),
        ("variable", [12]),
    ]
    assert agent.approximator.n_symbols == (3, 0, 0, 2, 5, 0)
    # RBF networks have no symbols: gears are three variables beside two of speed.
    space = gym.spaces.Dict({"speed": NESTED["speed"], "gear": NESTED["gear"]})
    assert RBFQLearning(space, ACTIONS).inputs == [("variable", [i]) for i in range(5)]


def test_a_single_input_is_repeated_where_two_are_needed():
    assert inputs(gym.spaces.Discrete(4)) == [("symbol", [0, 4])] * 2
    assert inputs(gym.spaces.Box(0, 1, (1,))) == [("variable", [0])] * 2


def test_angle_pairs_and_angles_are_circular_inputs():
    space = gym.spaces.Box(-1.0, 1.0, (3,), dtype=np.float64)
    agent = sdnn_agent(space, angle_pairs=[(0, 1)])
    assert agent.inputs == [("angle", [0, 1]), ("variable", [2])]
    assert agent.approximator.circular == (True, False)
    assert inputs(space, angles=[1])[1] == ("circular", [1])


def test_variables_of_discrete_spaces_cannot_be_angles():
    # Variables 0 to 2 are a one-hot gear, 3 and 4 speeds, and others switches.
    refuses("angles", sdnn_agent, NESTED, angles=[1])
    refuses("angle_pairs", sdnn_agent, NESTED, angle_pairs=[(4, 5)])


@pytest.mark.parametrize(
    "space",
    [
        gym.spaces.Dict({"speed": gym.spaces.Box(0, 1, (2,)), "gear": gym.spaces.Discrete(3)}),
        gym.spaces.Tuple([gym.spaces.Box(0, 1, (2,)), gym.spaces.MultiBinary(2)]),
        gym.spaces.Discrete(4),
        gym.spaces.MultiDiscrete([2, 3]),
        gym.spaces.Box(0, 1, (2, 2)),
    ],
)
def test_observations_are_flattened_like_gymnasiums_flatten(space):
    observations = Observations(space)
    space.seed(1)
    for _ in range(20):
        element = space.sample()
        vector = observations.vector("observation", element)
        assert np.array_equal(vector.reshape(-1), gym.spaces.flatten(space, element))


def test_a_variable_with_equal_bounds_is_refused():
    constant = gym.spaces.Box(np.array([0.0, 1.0]), np.array([1.0, 1.0]), dtype=np.float64)
    refuses("observation_space", config, constant)


@pytest.mark.parametrize(
    ("space", "observation"),
    [
        (gym.spaces.Dict({"a": gym.spaces.Box(0, 1, (1,))}), {"b": [0.5]}),
        (gym.spaces.Dict({"a": gym.spaces.Box(0, 1, (1,))}), 3.0),
        (gym.spaces.Dict({"a": gym.spaces.Box(0, 1, (3,))}), {"a": 0.5}),
        (gym.spaces.Tuple([gym.spaces.Box(0, 1, (2,))]), ([0.5, 0.5], 1.0)),
        (gym.spaces.Discrete(3), 7),
        (gym.spaces.Discrete(3), -1),
        (gym.spaces.Discrete(3, start=5), 4),
        (gym.spaces.MultiDiscrete([3, 2]), [0, 2]),
        (gym.spaces.MultiDiscrete([3, 2]), [-1, 0]),
        (gym.spaces.MultiBinary(2), [1]),
        (gym.spaces.Discrete(3), "one"),
    ],
)
def test_observations_of_another_space_are_refused_by_name(space, observation):
    refuses("next_observation", Observations(space).vector, "next_observation", observation)


class CartPoleWithNoise(gym.ObservationWrapper):
    """CartPole with further variables of autocorrelated noise."""

    def __init__(self, env, n_noise):
        super().__init__(env)
        self.observation_space = gym.spaces.Box(-np.inf, np.inf, (4 + n_noise,))
        self._noise = np.zeros(n_noise)

    def observation(self, observation):
        self._noise = 0.9 * self._noise + 0.4 * self.np_random.normal(size=self._noise.size)
        return np.concatenate([observation, self._noise])


def test_irrelevant_inputs_are_left_out_also_after_loading(tmp_path):
    env = CartPoleWithNoise(gym.make("CartPole-v1"), 6)
    agent = SDNNQLearning(env, preset="small", seed=1, inputs="relevant")
    agent.train(env, steps=1001, seed=1)  # inputs are chosen after a warm-up of 1,000
    chosen = [variables[0] for _, variables in agent.inputs]
    assert chosen[:4] == [0, 1, 2, 3]
    assert len(chosen) <= 5, "at most one of the six of noise, by chance"
    agent.save(tmp_path / "agent.safetensors")
    loaded = load_agent(tmp_path / "agent.safetensors")
    assert loaded.inputs == agent.inputs
    assert agent.learning_report()["left_out"] == [i for i in range(10) if i not in chosen]
    observation = np.linspace(-0.1, 0.1, 10)
    np.testing.assert_array_equal(loaded.q_values(observation), agent.q_values(observation))


def test_listed_inputs_are_kept_although_irrelevant():
    env = CartPoleWithNoise(gym.make("CartPole-v1"), 6)
    agent = sdnn_agent(env.observation_space, inputs=[9, 6])
    agent.train(env, steps=1001, seed=1)  # inputs are chosen after a warm-up of 1,000
    chosen = [variables[0] for _, variables in agent.inputs]
    assert {0, 1, 2, 3, 6, 9} <= set(chosen), "the variables of CartPole, and the listed ones"
    assert len(chosen) <= 7, "at most one irrelevant variable more"


def test_listing_a_variable_keeps_its_whole_symbol_or_angle():
    space = gym.spaces.Tuple([gym.spaces.Discrete(3)] + [gym.spaces.Box(-1, 1, (1,))] * 3)
    agent = sdnn_agent(space, angle_pairs=[(3, 4)], inputs=[1, 4], warm_up_steps=100)
    rng = np.random.default_rng(1)

    def noise():
        x, y, z = rng.uniform(-1, 1, (3, 1))
        return int(rng.integers(3)), x, y, z

    for _ in range(100):
        agent.learn(Transition(noise(), 0, 0.0, noise(), False))
    assert agent.inputs == [("symbol", [0, 3]), ("angle", [3, 4])]
