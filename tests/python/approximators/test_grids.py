"""Fuzzy rules and the RBF network against their transcription; their settings."""

import numpy as np
import pytest

from grid_transcription import FuzzyQLearning, RBFNetwork, joint_bases
from refusals import refuses
from sdnn import _core
from sdnn.approximators import FuzzyRulesConfig, RBFNetworkConfig


def walk(rng, state):
    """Mostly near, sometimes far, sometimes at the very ends and centres."""
    kind = rng.integers(10)
    if kind == 0:
        return rng.random(state.size)
    if kind == 1:
        return rng.integers(0, 9, state.size) / 8.0
    return np.clip(state + 0.05 * rng.standard_normal(state.size), 0.0, 1.0)


@pytest.mark.parametrize(("d", "n_sets"), [(1, 9), (2, 2), (3, 7), (4, 9), (6, 5)])
def test_rules_fire_as_triangles_say(d, n_sets):
    rules = _core.FuzzyRules(_core.FuzzyRulesConfig(n_inputs=d, n_sets=n_sets))
    slow = FuzzyQLearning(d, n_sets=n_sets, n_actions=2, coefficient=1.0, discount=1.0)
    rng = np.random.default_rng(d)
    state = rng.random(d)
    for _ in range(300):
        fired, truth = rules.fire(state)
        expected = slow.fired(state)
        numbers = [int(np.ravel_multi_index(sets, [n_sets] * d)) for sets, _ in expected]
        assert fired.tolist() == numbers
        assert truth.tolist() == [value for _, value in expected]
        assert abs(truth.sum() - 1.0) < 1e-15 * d
        state = walk(rng, state)


@pytest.mark.parametrize(("d", "n_steps"), [(2, 3000), (3, 2000), (4, 2000), (6, 150)])
def test_the_rbf_network_agrees_with_its_definition_bit_for_bit(d, n_steps):
    net = _core.RBFNetwork(_core.RBFNetworkConfig(n_inputs=d))
    config = net.config
    slow = RBFNetwork(
        d,
        n_bases=config.n_bases,
        n_actions=config.n_actions,
        width=config.width,
        rate=config.gradient_rate,
        exp=_core.exp,
    )
    rng = np.random.default_rng(d)
    state = rng.random(d)
    for step in range(n_steps):
        action = int(rng.integers(net.n_actions))
        target = float(rng.uniform(-20, 20))
        if step % 5 == 0:
            assert np.array_equal(net.values(state), slow.values(state)), step
        net.update(state, action, target)
        slow.update(state, action, target)
        state = walk(rng, state)
    assert np.array_equal(net.weights(), slow.w.ravel())
    assert net.n_joint_bases == slow.w.size


@pytest.mark.parametrize(
    ("d", "change"),
    [(2, {}), (4, {}), (3, {"n_bases": 5, "width": 0.3}), (2, {"n_bases": 3, "n_actions": 7})],
)
def test_values_are_the_mean_of_the_weights_over_all_joint_bases(d, change):
    net = _core.RBFNetwork(_core.RBFNetworkConfig(n_inputs=d, **change))
    config = net.config
    rng = np.random.default_rng(5)
    net.set_weights(rng.uniform(-20.0, 20.0, net.n_joint_bases))
    for _ in range(10):
        state = rng.random(d)
        values = net.values(state)
        for action in rng.choice(config.n_actions, 5):
            at = np.append(state, action / (config.n_actions - 1))
            bases = joint_bases(at, n_bases=config.n_bases, width=config.width)
            expected = (bases * net.weights()).sum() / bases.sum()
            assert abs(values[action] - expected) < 20.0 * 1e-12


def test_the_rbf_network_corrects_at_a_rate():
    config = _core.RBFNetworkConfig(n_inputs=2)
    at_a_rate, whole = _core.RBFNetwork(config), _core.RBFNetwork(config)
    rng = np.random.default_rng(3)
    for _ in range(200):
        state, action = rng.random(2), int(rng.integers(config.n_actions))
        target, rate = rng.uniform(-20, 20), rng.uniform(0.1, 1.0)
        value = whole.values(state)[action]
        whole.update(state, action, (1.0 - rate) * value + rate * target)
        at_a_rate.update(state, action, target, rate=rate)
        assert np.array_equal(whole.weights(), at_a_rate.weights())
    refuses("rate", whole.update, [0.5, 0.5], 0, 1.0, rate=0.0)


def test_the_exponential_of_the_core_is_the_one_of_numpy_up_to_rounding():
    x = np.linspace(-30.0, 0.0, 1000)
    np.testing.assert_allclose(_core.exp(x), np.exp(x), rtol=4e-16, atol=0)


def test_tables_that_are_too_large_are_refused():
    refuses("32543321076", _core.FuzzyRules, FuzzyRulesConfig(n_inputs=9))
    refuses("2147483648", _core.RBFNetwork, RBFNetworkConfig(n_inputs=13))
