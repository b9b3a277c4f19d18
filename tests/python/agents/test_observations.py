"""From observations of any space to inputs in [0, 1]."""

import gymnasium as gym
import numpy as np
import pytest

from sdnn.agents.observations import UnitObservations
from sdnn.bounds import flat_bounds

BOX = gym.spaces.Box(np.array([-1.0, 0.0]), np.array([3.0, 10.0]), dtype=np.float64)
UNBOUNDED = gym.spaces.Box(-np.inf, np.inf, (3,), dtype=np.float64)


def settled(space, seen, **options):
    observations = UnitObservations(space, **options)
    observations.settle(np.asarray(seen, np.float64))
    return observations


def test_bounds_are_the_ranges_and_values_outside_saturate():
    observations = UnitObservations(BOX)
    assert observations.is_settled
    assert observations("observation", [1.0, 2.5]).tolist() == [0.5, 0.25]
    assert observations("observation", [-7.0, np.inf]).tolist() == [0.0, 1.0]


def test_given_ranges_go_before_bounds():
    observations = UnitObservations(BOX, ranges=(0.0, [2.0, 4.0]))
    assert observations("observation", [1.0, 1.0]).tolist() == [0.5, 0.25]


def test_unknown_ranges_are_those_seen_and_a_quarter_more_at_each_end():
    observations = settled(UNBOUNDED, [[0.0, -5.0, 7.0], [4.0, 5.0, 7.0]], ranges=None)
    assert observations.low.tolist() == [-1.0, -7.5, 5.25]  # a constant one: a quarter of itself
    assert observations.high.tolist() == [5.0, 7.5, 8.75]
    assert observations("observation", [2.0, 7.5, 7.0]).tolist() == [0.5, 1.0, 0.5]


def test_the_largest_float_means_infinity():
    limit = np.finfo(np.float32).max
    assert not UnitObservations(gym.spaces.Box(-limit, limit, (2,))).is_settled


@pytest.mark.parametrize("dtype", [np.int32, np.int64])
def test_infinity_in_whole_numbers_is_infinity(dtype):
    box = gym.spaces.Box
    parts = {"up": box(0, np.inf, (1,), dtype), "all": box(-np.inf, np.inf, (2,), dtype)}
    space = gym.spaces.Dict({**parts, "byte": box(0, 255, (1,), np.uint8)})
    low, high = flat_bounds(space)  # in the order of their names
    assert low.tolist() == [-np.inf, -np.inf, 0.0, 0.0]
    assert high.tolist() == [np.inf, np.inf, 255.0, np.inf]
    assert not UnitObservations(space).is_settled
    assert flat_bounds(box(np.int16(-32768), np.int16(32767), (1,), np.int16))[1] == [32767.0]
    most = np.iinfo(np.uint32).max
    low, high = flat_bounds(box(0, most, (1,), np.uint32))
    assert (low, high) == ([0.0], [np.inf])


def test_only_unknown_ranges_are_learned():
    space = gym.spaces.Box(np.array([-np.inf, 0.0]), np.array([np.inf, 1.0]), dtype=np.float64)
    observations = settled(space, [[0.0, 0.4], [4.0, 0.6]])
    assert (observations.low[1], observations.high[1]) == (0.0, 1.0)


def test_how_ranges_are_used_is_told():
    low, high = np.array([0.0, -1.0, -np.pi, 0.0]), np.array([100.0, 1.0, np.pi, 1.0])
    space = gym.spaces.Box(low, high, dtype=np.float64)
    observations = UnitObservations(space, angles=[2])
    seen = np.array([0.0, 0.0, 0.0, 0.5])
    for t in range(4000):  # one in eight is noted in the mean, of these the last 256
        seen[0] = 20.0 + t / 100
        seen[1] = 3.0 if t % 4 == 0 else 0.0
        seen[2] = t
        observations("observation", seen)
        if t == 80:
            assert observations.range_use() == [None] * 4
    moves, jumps, angle, rests = observations.range_use()
    # Nine tenths of the last 2,048, which moved by 20.48.
    assert moves.share_used == pytest.approx(0.9 * 20.48 / 100, rel=0.1)
    assert jumps.share_used == 0.5
    assert angle is None
    assert rests.share_used == 0.0
    assert moves.share_beyond == rests.share_beyond == 0.0
    assert jumps.share_beyond == pytest.approx(0.25, abs=0.08)


@pytest.mark.parametrize("period", [3, 4, 5, 8, 16, 24])
def test_how_ranges_are_used_is_told_of_all_steps_of_regular_episodes(period):
    observations = UnitObservations(gym.spaces.Box(0.0, 1.0, (1,), dtype=np.float64))
    for t in range(4000):
        observations("observation", np.array([t % period / (period - 1)]))
    assert observations.range_use()[0].share_used > 0.8


def test_how_symbols_use_their_range_is_not_told():
    space = gym.spaces.Dict({"at": gym.spaces.Box(0, 1, (1,)), "room": gym.spaces.Discrete(3)})
    observations = UnitObservations(space, symbols=True)
    for t in range(400):
        observations("observation", {"at": [t % 9 / 9], "room": t % 3})
    use = observations.range_use()
    assert use[0].share_used > 0.7
    assert use[1:] == [None] * 3


def test_ranges_that_are_seen_leave_out_what_is_rare_and_stay_within_bounds():
    space = gym.spaces.Box(
        np.array([-100.0, 0.0, 0.0, -np.inf, -np.pi, -1.0]),
        np.array([100.0, 4.0, 1.0, np.inf, np.pi, 1.0]),
        dtype=np.float64,
    )
    seen = np.empty((40, 6))
    seen[:, 0] = [-90.0, -80.0, *np.linspace(2.0, 6.0, 36), 70.0, 80.0]  # 2 of 40 at each end: rare
    seen[:, 1] = np.linspace(0.0, 39.0, 40) / 10  # from 0.2 to 3.7: a quarter more is over the ends
    seen[:, 2] = [1.0, *np.zeros(39)]  # hardly moves
    seen[:, 3] = [-1e9, -1e9, *np.linspace(0.0, 8.0, 36), 1e9, np.inf]
    seen[:, 4] = 0.1  # an angle
    seen[:, 5] = [*np.zeros(20), *np.full(20, 3.0)]  # beyond its bounds
    observations = UnitObservations(space, ranges="seen", angles=[4])
    assert not observations.is_settled
    observations.settle(seen)
    assert observations.low.tolist() == [1.0, 0.0, 0.0, -2.0, -np.pi, -0.75]
    assert observations.high.tolist() == [7.0, 4.0, 1.0, 10.0, np.pi, 3.0]


def test_who_hardly_moves_and_has_no_bounds_has_all_that_was_seen():
    observations = settled(UNBOUNDED, [[0.0, 5.0, 0.0]] * 39 + [[4.0, 5.0, np.inf]], ranges="seen")
    assert observations.low[:2].tolist() == [-1.0, 3.75]
    assert observations.high[:2].tolist() == [5.0, 6.25]
    assert np.isfinite(observations.high[2])


def test_symbols_have_no_range_to_be_seen():
    space = gym.spaces.Dict({"room": gym.spaces.Discrete(3), "speed": gym.spaces.Box(-9, 9, (1,))})
    observations = settled(space, np.eye(4), ranges="seen", symbols=True)
    assert observations.n_symbols == (3, 0)
    assert not settled(gym.spaces.Discrete(3), np.eye(3), ranges="seen", symbols=True).circular[0]


def test_a_cosine_and_a_sine_become_an_angle():
    space = gym.spaces.Box(-1.0, 1.0, (3,), dtype=np.float64)
    observations = UnitObservations(space, angle_pairs=[(0, 1)])
    assert observations.inputs == [{"angle": [0, 1]}, {"variable": 2}]
    assert observations.circular == (True, False)
    for turn in np.linspace(-0.49, 0.49, 25):
        angle = 2 * np.pi * turn
        state = observations("observation", [np.cos(angle), np.sin(angle), 0.0])
        assert state == pytest.approx([turn + 0.5, 0.5], abs=1e-12)


def test_pairs_on_the_circle_are_found():
    angles = np.linspace(0, 5, 40)
    seen = np.stack([angles, np.cos(angles), np.sin(angles), np.cos(angles)], axis=1)
    space = gym.spaces.Box(-10.0, 10.0, (4,), dtype=np.float64)
    assert settled(space, seen, angle_pairs="find").inputs == [
        {"variable": 0},
        {"angle": [1, 2]},
        {"variable": 3},
    ]
    standing = np.tile([1.0, 0.0, 1.0, 0.0], (40, 1))
    assert len(settled(space, standing, angle_pairs="find").inputs) == 4


def test_a_declared_angle_wraps():
    space = gym.spaces.Box(-np.pi, np.pi, (2,), dtype=np.float64)
    observations = UnitObservations(space, angles=[0])
    assert observations.circular == (True, False)
    state = observations("observation", [-np.pi - 0.5 * np.pi, 0.0])
    assert state == pytest.approx([0.75, 0.5])
    assert observations("observation", [space.high[0], 0.0])[0] == 0.0
    with pytest.raises(ValueError, match="must be finite where it has angles"):
        observations("observation", [0.0, np.inf])


def test_one_variable_is_repeated_where_two_are_needed():
    observations = UnitObservations(gym.spaces.Box(0.0, 4.0, (1,)), least_inputs=2)
    assert observations("observation", [1.0]).tolist() == [0.25, 0.25]


GEAR = gym.spaces.Dict(
    {
        "speed": gym.spaces.Box(-2, 2, (2,), np.float64),
        "gear": gym.spaces.Discrete(3, start=-1),
        "switches": gym.spaces.Tuple([gym.spaces.MultiDiscrete([2, 5]), gym.spaces.MultiBinary(1)]),
    }
)


def test_each_discrete_is_one_input_where_symbols_are_asked_for():
    observations = UnitObservations(GEAR, symbols=True)
    assert observations.n_variables == 3 + 2 + 2 + 5 + 1
    assert observations.inputs == [  # Gymnasium sorts the names of a Dict
        {"symbol": [0, 3]},
        {"variable": 3},
        {"variable": 4},
        {"symbol": [5, 2]},
        {"symbol": [7, 5]},
        {"variable": 12},
    ]
    assert observations.n_symbols == (3, 0, 0, 2, 5, 0)
    assert not any(observations.circular)
    for gear in range(3):
        for switch in range(5):
            element = {
                "speed": [1.0, np.inf],
                "gear": np.int64(gear - 1),
                "switches": (np.array([1, switch]), np.array([1])),
            }
            expected = [(gear + 0.5) / 3, 0.75, 1.0, 0.75, (switch + 0.5) / 5, 1.0]
            assert observations("observation", element).tolist() == expected


def test_a_lone_symbol_is_repeated_where_two_inputs_are_needed():
    observations = UnitObservations(gym.spaces.Discrete(4), symbols=True, least_inputs=2)
    assert observations("observation", 2).tolist() == [0.625, 0.625]
    assert observations.n_symbols == (4, 4)


def test_what_tells_a_symbol_is_no_angle():
    with pytest.raises(ValueError, match="must name numbers, got variable 1, which is of a Disc"):
        UnitObservations(GEAR, symbols=True, angles=[1])
    with pytest.raises(ValueError, match="must name numbers, got variable 5"):
        UnitObservations(GEAR, symbols=True, angle_pairs=[(4, 5)])
    pair = gym.spaces.Tuple([gym.spaces.Discrete(2), gym.spaces.Box(-1, 1, (2,), np.float64)])
    turns = np.linspace(0, 5, 40)
    seen = np.stack([turns > 2, turns <= 2, np.cos(turns), np.sin(turns)], axis=1)
    assert settled(pair, seen, symbols=True, angle_pairs="find").inputs == [
        {"symbol": [0, 2]},
        {"angle": [2, 3]},
    ]


def test_symbols_can_be_written_and_read_and_so_can_what_was_none():
    first = UnitObservations(GEAR, symbols=True)
    again = UnitObservations(GEAR)
    again.settled_as(first.description())
    assert again.inputs == first.inputs
    plain = UnitObservations(GEAR)
    again.settled_as(plain.description())
    assert again.inputs == plain.inputs == [{"variable": i} for i in range(13)]
    for bad in ({"symbol": [0, 2]}, {"symbol": [1, 3]}, {"symbol": [99, 3]}):
        inputs = [bad, *first.inputs[1:]]
        with pytest.raises(ValueError, match="observation inputs must be"):
            again.settled_as({**first.description(), "inputs": inputs})


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
def test_other_spaces_are_flattened_as_gymnasium_does(space):
    observations = UnitObservations(space)
    space.seed(1)
    for _ in range(20):
        element = space.sample()
        flat = gym.spaces.flatten(space, element)
        assert np.allclose(observations("observation", element), flat)


def test_what_was_settled_can_be_written_and_read():
    angles = np.linspace(0, 5, 40)
    seen = np.stack([np.cos(angles), np.sin(angles), angles], axis=1)
    first = settled(UNBOUNDED, seen, angle_pairs="find")
    second = UnitObservations(UNBOUNDED, angle_pairs="find")
    second.settled_as(first.description())
    point = [0.6, 0.8, 2.0]
    assert first("observation", point).tolist() == second("observation", point).tolist()
    assert second.description() == first.description()


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"low": [0.0]}, "observation ranges must be 3 of low < high"),
        ({"low": [0.0, 0.0, 9e9]}, "observation ranges must be 3 of low < high"),
        ({"high": [np.inf, 1e9, 1e9]}, "must be finite"),
        ({"inputs": [{"variable": 5}]}, "observation inputs must be"),
        ({"inputs": [{"circular": 9}]}, "circular must be variables from 0 to 2"),
    ],
)
def test_descriptions_that_do_not_fit_are_refused(change, message):
    description = settled(UNBOUNDED, np.eye(3)).description()
    with pytest.raises(ValueError, match=message):
        UnitObservations(UNBOUNDED).settled_as({**description, **change})


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            {"ranges": (1.0, 0.0)},
            "observation_range must have low < high, got 1.0 to 0.0 of variable 0",
        ),
        ({"ranges": ([1.0], [2.0, 3.0, 4.0])}, "observation_range must be two numbers or two"),
        ({"ranges": 3.0}, r"observation_range must be \(low, high\) or 'seen', got 3.0"),
        ({"ranges": "all"}, r"observation_range must be \(low, high\) or 'seen', got 'all'"),
        ({"ranges": ("a", "b")}, "observation_range must be two numbers"),
        ({"angles": [2]}, "angles must be variables from 0 to 1, got 2"),
        ({"angles": ["x"]}, "angles must be variables"),
        ({"angle_pairs": "all"}, "angle_pairs must be 'none', 'find' or pairs"),
        ({"angle_pairs": [(0, 1, 2)]}, "angle_pairs must be pairs"),
        ({"angle_pairs": [(0, 7)]}, "angle_pairs must be variables from 0 to 1"),
        ({"angle_pairs": [(0, 1)], "angles": [0]}, "must name each variable once"),
    ],
)
def test_impossible_arguments_are_named(options, message):
    with pytest.raises(ValueError, match=message):
        UnitObservations(BOX, **options)


def test_an_angle_needs_a_range():
    with pytest.raises(ValueError, match="observation_range must be given for variable 1"):
        UnitObservations(UNBOUNDED, angles=[1])


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
def test_elements_of_other_spaces_are_refused_by_name(space, observation):
    with pytest.raises(ValueError, match="following must be of"):
        UnitObservations(space)("following", observation)


def test_an_observation_is_known_by_its_type_bytes_and_shape():
    space = gym.spaces.Box(-1e9, 1e9, (2,), np.float64)
    observations = UnitObservations(space)
    seen = np.array([1.0, -2.0])
    first = observations("observation", seen)
    assert observations("observation", seen) is first
    assert observations("observation", seen.tolist()) is first
    whole = seen.view(np.int64)  # the same bytes, other numbers
    assert not np.array_equal(observations("observation", np.abs(whole) % 1000), first)
    for bad in (whole.view(np.float64).reshape(2, 1), seen[:1]):
        with pytest.raises(ValueError, match="observation must have shape"):
            observations("observation", bad)
    with pytest.raises(ValueError, match="observation must be numbers"):
        observations("observation", np.array([None, None]))
    kept = first.copy()
    seen[:] = 5.0
    assert not np.array_equal(observations("observation", seen), kept)
    seen[:] = np.nan
    with pytest.raises(ValueError, match="observation must not hold NaN"):
        observations("observation", seen)


@pytest.mark.parametrize("dtype", [np.float32, np.float64, np.int8, np.uint8])
def test_memory_does_not_change_what_is_converted(dtype):
    space = gym.spaces.Box(0, 100, (3,), dtype)
    observations, rng = UnitObservations(space), np.random.default_rng(3)
    for _ in range(300):
        one = rng.integers(0, 3, 3).astype(dtype)
        expected = UnitObservations(space)("observation", one.tolist())
        np.testing.assert_array_equal(observations("observation", one), expected)
