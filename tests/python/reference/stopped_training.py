"""Training that stops anywhere and resumes: shared by tests of exact resuming."""

import numpy as np

from sdnn.agents import Callback


class Stop(Callback):
    """Saves and stops at a step."""

    def __init__(self, at, path):
        self.at, self.path = at, path

    def on_step(self, training):
        if training.n_steps == self.at:
            training.save(self.path)
            training.stop()


def states_equal(one, other):
    """Whether two agents have the same bits."""
    one, other = one.state(), other.state()
    assert one.keys() == other.keys()
    return all(np.array_equal(one[name], other[name]) for name in one)
