"""The network SDNN-C: its NumPy transcription, its pattern tables, and its Python class."""

import numpy as np
import pytest
import sdnn_q_learning as transcription
from hypothesis import given, settings, strategies as st

from handed_over import transcribe
from refusals import refuses
from sdnn import _core
from sdnn.approximators import SDNNC, SDNNCConfig
from sdnn.coding import Circular, Symbolic

SMALL = {"n_inputs": 3, "n_pattern_units": 40, "n_hidden_units": 120, "n_active_units": 30}

UNUSUAL_SETTINGS = {
    "two inputs": {"n_inputs": 2, "n_pattern_units": 37, "n_hidden_units": 101},
    "three inputs": {"n_inputs": 3, "n_pattern_units": 65, "n_hidden_units": 129},
    "five inputs": {"n_inputs": 5, "n_pattern_units": 50, "n_hidden_units": 90},
    "circular": {
        "n_inputs": 3,
        "n_pattern_units": 51,
        "circular": [True, False, True],
        "n_anchor_patterns": 5,
        "n_interpolated": 7,
    },
    "symbols": {"n_inputs": 3, "n_symbols": [5, 0, 2]},
    "some pairs": {"n_inputs": 6, "max_pairs": 18, "n_pattern_units": 30},
    "a pair for each input": {"n_inputs": 5, "max_pairs": 1},
    "unbalanced": {"n_inputs": 2, "balanced_anchors": False, "n_pattern_units": 99},
    "uniform weights on a lattice": {
        "n_inputs": 3,
        "initial_weights": "uniform",
        "initial_weight_limit": 0.9,
        "initial_threshold": 10.0,
        "lattice": 8,
    },
    "rounded away": {"n_inputs": 2, "rounding": "away"},
    "few actions": {"n_inputs": 2, "n_actions": 3, "n_hidden_units": 97},
    "one action": {"n_inputs": 2, "n_actions": 1},
    "another output line": {"n_inputs": 2, "q_low": -1.5, "q_high": 4.0, "u_low": 0, "u_high": 33},
    "windows of all units": {"n_inputs": 2, "n_hidden_units": 33},
    "more than one word ladder": {"n_inputs": 2, "n_pattern_units": 300},
}
UNUSUAL_SIZES = {"n_pattern_units": 60, "n_hidden_units": 150, "n_active_units": 33}


def state_after(rng, state):
    """Return a state near the last one, or rarely anywhere, or at corners of the cube."""
    chance = rng.integers(20)
    if chance == 0:
        return rng.random(state.size)
    if chance == 1:
        return rng.integers(0, 2, state.size).astype(float)
    return np.clip(state + 0.05 * rng.standard_normal(state.size), 0.0, 1.0)


def assert_equal_parameters(core, slow):
    assert np.array_equal(core.weights(), slow.weights)
    assert np.array_equal(core.thresholds(), slow.thresholds)


def compare_while_learning(config, seed, n_steps):
    """Train core and transcription alike; return the share of steps that change weights."""
    core = _core.SDNNC(config, seed)
    slow = transcribe(core)
    rng = np.random.default_rng(seed)
    state = rng.random(config.n_inputs)
    n_corrected = 0
    for step in range(n_steps):
        action = int(rng.integers(core.n_actions))
        # Targets are up to a fifth of the range of values beyond it.
        target = config.q_low + (config.q_high - config.q_low) * float(rng.uniform(-0.2, 1.2))
        expected = slow.values(state)
        assert np.array_equal(core.values(state), expected), step
        assert core.value(state, action) == expected[action]
        core.update(state, action, target)
        n_corrected += slow.update(state, action, target) > 0
        if step % 100 == 0 or step == n_steps - 1:
            assert np.array_equal(core.potentials(state), slow.potentials(state)), step
            assert_equal_parameters(core, slow)
        state = state_after(rng, state)
    return n_corrected / n_steps


@pytest.mark.parametrize("n_steps", [1500, pytest.param(5000, marks=pytest.mark.slow)])
def test_sdnn_c_equals_its_numpy_transcription_while_learning(n_steps):
    share_corrected = compare_while_learning(_core.SDNNCConfig(), seed=1, n_steps=n_steps)
    assert share_corrected > 0.9


@pytest.mark.parametrize("n_inputs", [5, 6])
def test_sdnn_c_of_five_and_six_inputs_equals_its_transcription(n_inputs):
    config = _core.SDNNCConfig(n_inputs=n_inputs)
    share_corrected = compare_while_learning(config, seed=2, n_steps=150)
    assert share_corrected > 2 / 3


@pytest.mark.parametrize("name", UNUSUAL_SETTINGS)
def test_sdnn_c_of_unusual_settings_equals_its_transcription(name):
    config = _core.SDNNCConfig(**{**UNUSUAL_SIZES, **UNUSUAL_SETTINGS[name]})
    share_corrected = compare_while_learning(config, seed=3, n_steps=500)
    assert share_corrected > 0.6


@settings(max_examples=10, deadline=None, derandomize=True)
@given(
    n_inputs=st.integers(2, 4),
    n_pattern_units=st.integers(2, 70),
    n_hidden_units=st.integers(1, 140),
    active_share=st.floats(0, 1),
    lattice=st.integers(1, 8),
    seed=st.integers(0, 2**64 - 1),
)
def test_sdnn_c_of_any_size_equals_its_transcription(
    n_inputs, n_pattern_units, n_hidden_units, active_share, lattice, seed
):
    config = _core.SDNNCConfig(
        n_inputs=n_inputs,
        n_pattern_units=n_pattern_units,
        n_hidden_units=n_hidden_units,
        n_active_units=1 + round(active_share * (n_hidden_units - 1)),
        lattice=lattice,
        initial_threshold=20.0,
    )
    compare_while_learning(config, seed, n_steps=30)


def test_the_transcription_maps_counts_to_values_as_in_the_paper():
    # A window has 300 units: 20 are active for the lowest value, -20, and 280 for the highest, 20.
    settings, counts = transcription.Settings(), np.arange(301)
    expected = np.clip((2 * counts - 300) / 13, -20, 20)
    np.testing.assert_array_equal(transcription.g(counts, settings), expected)
    counts_of = {-30.0: 20, -20.0: 20, 0.0: 150, 1 / 13: 151, 2.0: 163, 20.0: 280, 99.0: 280}
    assert {q: transcription.g_inverse(q, settings) for q in counts_of} == counts_of


def test_pattern_tables_of_two_inputs_are_uncorrelated():
    network = _core.SDNNC(_core.SDNNCConfig(), 5)
    anchors = [45 * i for i in range(8)]  # rows of random patterns; others are interpolated
    first, second = (network.table(i).astype(int)[anchors] for i in (0, 1))
    limit = 5 * np.sqrt(200)  # products of random patterns of 200 units deviate by sqrt(200)
    assert np.abs(first @ second.T).max() < limit
    assert np.abs(first @ first.T - 200 * np.eye(8, dtype=int)).max() < limit


def test_the_learning_coefficient_scales_weights_but_not_values():
    small, large = (
        SDNNC(SDNNCConfig(**SMALL, learning_coefficient=coefficient), seed=1)
        for coefficient in (0.125, 64 * 0.125)
    )
    state = [0.1, 0.5, 0.9]
    for _ in range(30):
        small.update(state, 7, 12.0)
        large.update(state, 7, 12.0)
    assert np.array_equal(small.values(state), large.values(state))
    assert np.array_equal(64 * small.weights(), large.weights())
    assert np.array_equal(64 * small.thresholds(), large.thresholds())


@pytest.mark.parametrize(
    "converted",
    [
        list,
        tuple,
        np.asarray,
        lambda state: np.repeat(state, 2)[::2],
        lambda state: np.array(state[::-1])[::-1],
        lambda state: np.array(state, dtype=">f8"),
        lambda state: np.array(state, dtype=np.float32),
    ],
    ids=["list", "tuple", "array", "stride 2", "stride -1", "big-endian", "float32"],
)
def test_states_of_any_sequence_dtype_and_stride_give_the_same_values(converted):
    network = SDNNC(SDNNCConfig(**SMALL), seed=1)
    state = [0.125, 0.5, 0.875]
    network.update(state, 3, 20.0)
    assert np.array_equal(network.values(converted(state)), network.values(np.array(state)))


def test_returned_arrays_are_copies():
    network = SDNNC(SDNNCConfig(**SMALL), seed=1)
    state = [0.1, 0.2, 0.3]
    for read in (lambda: network.values(state), network.weights, network.thresholds):
        array = read()
        array += 1.0
        assert not np.array_equal(array, read())


def test_patterns_of_codings_replace_random_ones_as_arrays_or_lists():
    tables = [Circular().patterns(40, seed=1), Symbolic(categories=("a", "b")).patterns(40, seed=2)]
    config = SDNNCConfig(n_inputs=2, n_pattern_units=40, n_hidden_units=90, n_active_units=30)
    network = SDNNC(config, seed=3, tables=tables)
    of_lists = SDNNC(config, seed=3, tables=[table.tolist() for table in tables])
    for _ in range(20):
        network.update([0.2, 0.1], 10, 8.0)
        of_lists.update([0.2, 0.1], 10, 8.0)
    np.testing.assert_array_equal(of_lists.weights(), network.weights())
    # The second input is "a" below 0.5, else "b".
    np.testing.assert_array_equal(network.values([0.2, 0.1]), network.values([0.2, 0.4]))
    assert (network.values([0.2, 0.1]) != network.values([0.2, 0.6])).any()


@pytest.mark.parametrize(
    ("tables", "argument"),
    [
        ([np.ones((3, 40))], "tables"),
        ([np.ones((3, 40)), np.ones((3, 41))], "tables"),
        ([np.ones((3, 40)), np.zeros((3, 40))], "tables[1]"),
        ([np.ones(40), np.ones((3, 40))], "tables[0]"),
    ],
)
def test_tables_of_wrong_shape_or_values_are_refused(tables, argument):
    refuses(argument, SDNNC, SDNNCConfig(n_inputs=2, n_pattern_units=40), tables=tables)


def test_averaged_weights_are_a_moving_average_of_snapshots():
    config = SDNNCConfig(
        n_inputs=3, n_pattern_units=12, n_hidden_units=90, n_active_units=30, averaging_interval=5
    )
    network, other = _core.SDNNC(config, 3), _core.SDNNC(config, 3)
    rng = np.random.default_rng(1)
    weights, thresholds, next_snapshot, n_snapshots = 0.0, 0.0, 5, 0
    for n_steps in range(1, 1501):
        target = float(rng.uniform(-20, 20))
        network.update(rng.random(3), int(rng.integers(network.n_actions)), target)
        if n_steps < next_snapshot:
            continue
        # Intervals grow with the steps. A snapshot's share is a power of 2, after the first one.
        interval = max(5, n_steps // 64)
        share = 1.0 if n_snapshots == 0 else 2.0 ** -max(int(np.log2(n_steps // interval)) - 3, 0)
        weights = weights + share * (network.weights() - weights)
        thresholds = thresholds + share * (network.thresholds() - thresholds)
        next_snapshot, n_snapshots = n_steps + interval, n_snapshots + 1
        if n_snapshots % 25:
            continue
        # The averages of the core are exact to some thousandths, and then rounded to integers.
        np.testing.assert_allclose(network.averaged_weights(), weights, atol=0.51)
        np.testing.assert_allclose(network.averaged_thresholds(), thresholds, atol=0.51)
        other.set_parameters(network.averaged_weights(), network.averaged_thresholds())
        state = rng.random(3)
        np.testing.assert_array_equal(network.averaged_values(state), other.values(state))
    assert n_snapshots > 100


def test_units_at_the_weight_limit_are_not_corrected():
    sizes = {"n_inputs": 2, "n_pattern_units": 12, "n_hidden_units": 40, "n_active_units": 20}
    unlimited = _core.SDNNC(SDNNCConfig(**sizes), 3)
    limited = _core.SDNNC(SDNNCConfig(**sizes, weight_limit=3), 3)
    with_high_limit = _core.SDNNC(SDNNCConfig(**sizes, weight_limit=16383), 3)
    rng = np.random.default_rng(1)
    for _ in range(400):
        before = limited.weights()
        state, action, target = rng.random(2), int(rng.integers(21)), float(rng.uniform(-20, 20))
        n_corrections = limited.correction_counts[0]
        for network in (unlimited, limited, with_high_limit):
            network.update(state, action, target)
        is_corrected = limited.correction_counts[0] > n_corrections
        assert (limited.weights() != before).any() == is_corrected
    np.testing.assert_array_equal(with_high_limit.weights(), unlimited.weights())
    assert np.abs(unlimited.weights()).max() > 3
    assert np.abs(limited.weights()).max() == 3
