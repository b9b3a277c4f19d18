"""The RBF network against its transcription."""

import numpy as np
import pytest

from grid_transcription import RBFNetwork
from sdnn import _core


def walk(rng, state):
    """Mostly near, sometimes far, sometimes at the very ends and centres."""
    kind = rng.integers(10)
    if kind == 0:
        return rng.random(state.size)
    if kind == 1:
        return rng.integers(0, 9, state.size) / 8.0
    return np.clip(state + 0.05 * rng.standard_normal(state.size), 0.0, 1.0)


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
