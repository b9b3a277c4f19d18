import numpy as np
import pytest
import sdnn_q_learning as page
from hypothesis import given, settings, strategies as st

from handed_over import transcribe
from refusals import refuses
from sdnn import _core
from sdnn.approximators import SDNNC, SDNNCConfig
from sdnn.coding import Circular, Symbolic

SMALL = {"n_inputs": 3, "n_pattern_units": 40, "n_hidden_units": 120, "n_active_units": 30}

ODD_SIZES = {
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
ODD_DEFAULTS = {"n_pattern_units": 60, "n_hidden_units": 150, "n_active_units": 33}


def next_state(rng, state):
    """A walk as an agent takes it: mostly near, sometimes far, sometimes at the very ends."""
    kind = rng.integers(20)
    if kind == 0:
        return rng.random(state.size)
    if kind == 1:
        return rng.integers(0, 2, state.size).astype(float)
    return np.clip(state + 0.05 * rng.standard_normal(state.size), 0.0, 1.0)


def assert_equal_parameters(core, slow):
    assert np.array_equal(core.weights(), slow.weights)
    assert np.array_equal(core.thresholds(), slow.thresholds)


def compare_while_learning(config, seed, n_steps, compare_weights_every):
    """Both learn the same; returns how many steps corrected something."""
    core = _core.SDNNC(config, seed)
    slow = transcribe(core)
    rng = np.random.default_rng(seed)
    state = rng.random(config.n_inputs)
    span = config.q_high - config.q_low
    n_active = 0
    for step in range(n_steps):
        action = int(rng.integers(core.n_actions))
        q_hat = config.q_low + span * float(rng.uniform(-0.2, 1.2))
        expected = slow.values(state)
        assert np.array_equal(core.values(state), expected), step
        assert core.value(state, action) == expected[action]
        core.update(state, action, q_hat)
        n_active += slow.update(state, action, q_hat) > 0
        next_observation = next_state(rng, state)
        if step % compare_weights_every == 0:
            assert np.array_equal(core.potentials(state), slow.potentials(state)), step
            assert_equal_parameters(core, slow)
        state = next_observation
    assert np.array_equal(core.potentials(state), slow.potentials(state))
    assert_equal_parameters(core, slow)
    return n_active


@pytest.mark.parametrize("n_steps", [1500, pytest.param(5000, marks=pytest.mark.slow)])
def test_the_core_agrees_with_the_page_while_it_learns(n_steps):
    assert compare_while_learning(_core.SDNNCConfig(), 1, n_steps, 500) > 0.9 * n_steps


@pytest.mark.parametrize("n_inputs", [5, 6])
def test_the_core_agrees_with_the_page_at_its_larger_sizes(n_inputs):
    assert compare_while_learning(_core.SDNNCConfig(n_inputs=n_inputs), 2, 150, 75) > 100


@pytest.mark.parametrize("name", ODD_SIZES)
def test_the_core_agrees_with_the_page_at_odd_sizes(name):
    config = _core.SDNNCConfig(**{**ODD_DEFAULTS, **ODD_SIZES[name]})
    assert compare_while_learning(config, 3, 500, 100) > 300


@settings(max_examples=10, deadline=None, derandomize=True)
@given(
    n_inputs=st.integers(2, 4),
    m=st.integers(2, 70),
    n=st.integers(1, 140),
    window=st.floats(0, 1),
    lattice=st.integers(1, 8),
    seed=st.integers(0, 2**64 - 1),
)
def test_the_core_agrees_with_the_page_at_any_size(n_inputs, m, n, window, lattice, seed):
    n_active = 1 + round(window * (n - 1))
    config = _core.SDNNCConfig(
        n_inputs=n_inputs,
        n_pattern_units=m,
        n_hidden_units=n,
        n_active_units=n_active,
        lattice=lattice,
        initial_threshold=20.0,
    )
    core = _core.SDNNC(config, seed)
    slow = transcribe(core)
    rng = np.random.default_rng(seed)
    for _ in range(30):
        state = rng.random(n_inputs)
        action = int(rng.integers(core.n_actions))
        q_hat = float(rng.uniform(-25, 25))
        assert np.array_equal(core.values(state), slow.values(state))
        core.update(state, action, q_hat)
        slow.update(state, action, q_hat)
    assert_equal_parameters(core, slow)


def test_the_paper_numbers_of_the_page():
    settings = page.Settings()
    counts = np.arange(301)
    np.testing.assert_array_equal(
        page.g(counts, settings), np.clip((2 * counts - 300) / 13, -20, 20)
    )
    values = {-30.0: 20, -20.0: 20, 0.0: 150, 2.0: 163, 1 / 13: 151, 20.0: 280, 99.0: 280}
    assert {q: page.g_inverse(q, settings) for q in values} == values


# Wiring: what the core draws at random must be what section 3.1 describes.


@pytest.fixture(scope="module")
def paper_network():
    return _core.SDNNC(_core.SDNNCConfig(), 5)


@pytest.mark.parametrize("circular", [False, True])
def test_code_books_follow_the_anchor_rule(circular):
    core = _core.SDNNC(_core.SDNNCConfig(circular=[circular] * 4), 5)
    for mu in range(4):
        book = core.table(mu)
        assert book.shape == (360, 200)
        assert set(np.unique(book)) == {-1, 1}
        for anchor in range(8):
            stretch = book[45 * anchor : 45 * (anchor + 1)]
            assert stretch[0].sum() == 0, "anchors are balanced"
            if anchor < 7 or circular:
                after = book[45 * (anchor + 1) % 360]
                differing = np.flatnonzero(stretch[0] != after)
                flipped = [np.flatnonzero(row != stretch[0]) for row in stretch]
                assert [f.size for f in flipped] == [j * differing.size // 45 for j in range(45)]
                for fewer, more in zip(flipped, [*flipped[1:], differing], strict=True):
                    assert set(fewer) <= set(more), "a unit flips once between two anchors"


def test_the_ends_of_a_range_are_alike_only_if_circular():
    for circular, most in ((True, 6), (False, None)):
        core = _core.SDNNC(_core.SDNNCConfig(circular=[circular] * 4), 5)
        for mu in range(4):
            book = core.table(mu)
            distance = int((book[0] != book[359]).sum())
            assert distance <= most if circular else distance > 60


def test_code_books_of_two_inputs_are_independent(paper_network):
    first, second = (paper_network.table(mu).astype(int) for mu in (0, 1))
    anchors = [45 * i for i in range(8)]
    # Balanced random patterns of 200 units: a product of standard deviation about 14.
    assert np.abs(first[anchors] @ second[anchors].T).max() < 5 * 14.2
    off_diagonal = first[anchors] @ first[anchors].T - 200 * np.eye(8, dtype=int)
    assert np.abs(off_diagonal).max() < 5 * 14.2


def test_permutations_are_permutations_and_differ(paper_network):
    seen = set()
    for mu in range(4):
        for nu in range(4):
            if mu == nu:
                refuses("inputs", paper_network.permutation, mu, nu)
                continue
            permutation = paper_network.permutation(mu, nu)
            assert np.array_equal(np.sort(permutation), np.arange(200))
            seen.add(tuple(permutation))
    assert len(seen) == 12


@pytest.mark.parametrize(
    ("max_pairs", "n_partners"), [(0, 5), (1, 1), (6, 1), (17, 2), (18, 3), (29, 4), (99, 5)]
)
def test_an_even_share_of_pairs(max_pairs, n_partners):
    network = SDNNC(SDNNCConfig(**SMALL | {"n_inputs": 6}, max_pairs=max_pairs), seed=1)
    modified, modifiers = np.array(network.pairs).T
    assert np.bincount(modified).tolist() == [n_partners] * 6
    assert np.bincount(modifiers).tolist() == [n_partners] * 6
    assert list(network.pairs) == sorted(set(network.pairs))
    assert (modified != modifiers).all()
    assert network.config.n_pairs == len(network.pairs)
    assert network.weights().shape == (120, 40 * len(network.pairs))


def test_which_pairs_there_are_follows_from_the_seed():
    def pairs(seed):
        return SDNNC(SDNNCConfig(**SMALL | {"n_inputs": 9}, max_pairs=18), seed=seed).pairs

    assert pairs(1) == pairs(1)
    assert len({pairs(seed) for seed in range(10)}) > 5


def test_about_half_of_layer_3_is_neutral(paper_network):
    x_sd = transcribe(paper_network).x_sd(np.array([0.1, 0.4, 0.6, 0.8]))
    assert x_sd.shape == (2400,)
    assert abs((x_sd == 0).mean() - 0.5) < 0.05
    anchors = transcribe(paper_network).x_sd(np.array([0.0, 0.125, 0.25, 0.5]))
    assert (anchors == 0).sum() == 1200, "exactly half with balanced modifiers"


def test_initial_parameters_are_those_of_the_reading(paper_network):
    assert paper_network.thresholds()[:4].tolist() == [-200, 200, -200, 200]
    values, counts = np.unique(paper_network.weights(), return_counts=True)
    assert values.tolist() == [-1, 0, 1]
    assert np.allclose(counts / (900 * 2400), [0.25, 0.5, 0.25], atol=2e-3)


# Properties.

states = st.lists(st.floats(0, 1), min_size=3, max_size=3)


@settings(max_examples=25, deadline=None, derandomize=True)
@given(
    state=states, action=st.integers(0, 90), target=st.floats(allow_nan=False), n=st.integers(1, 8)
)
def test_a_correction_never_moves_the_value_away_from_the_target(state, action, target, n):
    network = _core.SDNNC(_core.SDNNCConfig(**SMALL), 1)
    line = page.Settings(u_low=2, u_high=28)
    goal = page.g(page.g_inverse(target, line), line)
    before = network.value(state, action)
    assert before == 0.0
    for _ in range(n):
        network.update(state, action, target)
        after = network.value(state, action)
        assert min(before, goal) <= after <= max(before, goal)
        before = after


@settings(max_examples=25, deadline=None, derandomize=True)
@given(state=states, other=states, target=st.floats(-30, 30))
def test_asking_changes_nothing(state, other, target):
    asked = _core.SDNNC(_core.SDNNCConfig(**SMALL), 1)
    silent = _core.SDNNC(_core.SDNNCConfig(**SMALL), 1)
    for _ in range(4):
        asked.values(other)
        asked.value(state, 3)
        asked.update(state, 5, target)
        silent.update(state, 5, target)
    assert np.array_equal(asked.weights(), silent.weights())
    assert np.array_equal(asked.values(other), silent.values(other))


@settings(max_examples=10, deadline=None, derandomize=True)
@given(state=states, seed=st.integers(0, 2**64 - 1))
def test_parameters_go_out_and_in_again(state, seed):
    network = _core.SDNNC(_core.SDNNCConfig(**SMALL), seed)
    for action in range(0, 90, 10):
        network.update(state, action, 15.0)
    twin = _core.SDNNC(_core.SDNNCConfig(**SMALL), seed)
    twin.set_parameters(network.weights(), network.thresholds())
    assert np.array_equal(twin.weights(), network.weights())
    assert np.array_equal(twin.thresholds(), network.thresholds())
    assert np.array_equal(twin.values(state), network.values(state))


def test_c_scales_weights_and_changes_no_decision():
    small, large = (
        SDNNC(SDNNCConfig(**SMALL, learning_coefficient=c), seed=1) for c in (0.125, 8.0)
    )
    state = [0.1, 0.5, 0.9]
    for _ in range(30):
        small.update(state, 7, 12.0)
        large.update(state, 7, 12.0)
    assert np.array_equal(small.values(state), large.values(state))
    assert np.array_equal(64 * small.weights(), large.weights())
    assert np.array_equal(64 * small.thresholds(), large.thresholds())


# The Python face.


@pytest.mark.parametrize(
    ("state", "message"),
    [
        ([0.1, np.nan, 0.2], "state[1]"),
        ([0.1, 0.2, 1.5], "state[2]"),
        ([0.1, 0.2, -np.inf], "state[2]"),
        ([0.1, 0.2], "state"),
        ([[0.1, 0.2, 0.3]], "state"),
        ([], "state"),
        (0.5, "state"),
    ],
)
def test_bad_states_are_named_and_change_nothing(state, message):
    network = SDNNC(SDNNCConfig(**SMALL), seed=1)
    before = network.weights()
    for use in (
        lambda: network.values(state),
        lambda: network.value(state, 0),
        lambda: network.update(state, 0, 1.0),
    ):
        refuses(message, use)
    assert np.array_equal(network.weights(), before)


@pytest.mark.parametrize(
    "make",
    [
        list,
        tuple,
        np.asarray,
        lambda state: np.repeat(state, 2)[::2],
        lambda state: np.array(state[::-1])[::-1],
        lambda state: np.array(state, dtype=">f8"),
        lambda state: np.array(state, dtype=np.float32),
    ],
)
def test_states_of_any_layout(make):
    network = SDNNC(SDNNCConfig(**SMALL), seed=1)
    state = [0.125, 0.5, 0.875]
    network.update(state, 3, 20.0)
    assert np.array_equal(network.values(make(state)), network.values(np.array(state)))


def test_returned_arrays_are_copies():
    network = SDNNC(SDNNCConfig(**SMALL), seed=1)
    state = [0.1, 0.2, 0.3]
    for read in (lambda: network.values(state), network.weights, network.thresholds):
        array = read()
        array += 1.0
        assert not np.array_equal(array, read())


def test_patterns_of_any_coding_can_be_given():
    tables = [Circular().patterns(40, seed=1), Symbolic(categories=("a", "b")).patterns(40, seed=2)]
    config = SDNNCConfig(n_inputs=2, n_pattern_units=40, n_hidden_units=90, n_active_units=30)
    network = SDNNC(config, seed=3, tables=tables)
    for _ in range(20):
        network.update([0.2, 0.1], 10, 8.0)
    np.testing.assert_array_equal(network.values([0.2, 0.1]), network.values([0.2, 0.4]))  # "a"
    assert (network.values([0.2, 0.1]) != network.values([0.2, 0.6])).any()
    same = SDNNC(config, seed=3, tables=[table.tolist() for table in tables])
    for _ in range(20):
        same.update([0.2, 0.1], 10, 8.0)
    np.testing.assert_array_equal(same.weights(), network.weights())


@pytest.mark.parametrize(
    ("tables", "message"),
    [
        ([np.ones((3, 40))], "tables"),
        ([np.ones((3, 40)), np.ones((3, 41))], "tables"),
        ([np.ones((3, 40)), np.zeros((3, 40))], "tables[1]"),
        ([np.ones(40), np.ones((3, 40))], "tables[0]"),
    ],
)
def test_patterns_that_do_not_fit_are_refused(tables, message):
    refuses(message, SDNNC, SDNNCConfig(n_inputs=2, n_pattern_units=40), tables=tables)


def test_the_average_agrees_with_its_formula():
    config = SDNNCConfig(
        n_inputs=3, n_pattern_units=12, n_hidden_units=90, n_active_units=30, averaging_interval=5
    )
    network, other = _core.SDNNC(config, 3), _core.SDNNC(config, 3)
    rng = np.random.default_rng(1)
    weights, thresholds, due, n_snapshots = 0.0, 0.0, 5, 0
    for n in range(1, 1501):
        target = float(rng.uniform(-20, 20))
        network.update(rng.random(3), int(rng.integers(network.n_actions)), target)
        if n < due:
            continue
        passed = max(5, n // 64)
        share = 1.0 if n_snapshots == 0 else 2.0 ** -max(int(np.log2(n // passed)) - 3, 0)
        weights = weights + share * (network.weights() - weights)
        thresholds = thresholds + share * (network.thresholds() - thresholds)
        due, n_snapshots = n + passed, n_snapshots + 1
        if n_snapshots % 25:
            continue
        # Each is rounded once; in between are some thousandths of a step.
        np.testing.assert_allclose(network.averaged_weights(), weights, atol=0.51)
        np.testing.assert_allclose(network.averaged_thresholds(), thresholds, atol=0.51)
        other.set_parameters(network.averaged_weights(), network.averaged_thresholds())
        state = rng.random(3)
        np.testing.assert_array_equal(network.averaged_values(state), other.values(state))
    assert n_snapshots > 100


def test_a_unit_whose_weights_have_no_room_is_not_corrected():
    sizes = {"n_inputs": 2, "n_pattern_units": 12, "n_hidden_units": 40, "n_active_units": 20}
    free = _core.SDNNC(SDNNCConfig(**sizes), 3)
    limited = _core.SDNNC(SDNNCConfig(**sizes, weight_limit=3), 3)
    same = _core.SDNNC(SDNNCConfig(**sizes, weight_limit=16383), 3)
    rng = np.random.default_rng(1)
    for _ in range(400):
        before = limited.weights()
        state, action, target = rng.random(2), int(rng.integers(21)), float(rng.uniform(-20, 20))
        n_changed = limited.correction_counts[0]
        for network in (free, limited, same):
            network.update(state, action, target)
        changed = (limited.weights() != before).any(axis=1)
        assert changed.any() == (limited.correction_counts[0] > n_changed)
    np.testing.assert_array_equal(same.weights(), free.weights())
    assert np.abs(free.weights()).max() > 3  # with two inputs a column is one weight
    assert np.abs(limited.weights()).max() == 3
