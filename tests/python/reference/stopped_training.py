"""Checks that a training that was stopped at any step resumes exactly."""

import numpy as np

from sdnn.agents import Callback, Training


class Stop(Callback):
    """Stop the training after the step ``at``; save it to ``path`` before, if there is one."""

    def __init__(self, at, path=None):
        self.at, self.path = at, path

    def on_step(self, training):
        if training.n_steps == self.at:
            if self.path is not None:
                training.save(self.path)
            training.stop()


def states_equal(agent, other_agent):
    """Return whether the states of two agents have the same bits."""
    state, other_state = agent.state(), other_agent.state()
    assert state.keys() == other_state.keys()
    return all(
        state[name].dtype == other_state[name].dtype
        and np.array_equal(state[name], other_state[name])
        for name in state
    )


def check_exact_resume(new_training, env, path, cuts, **options):
    """Check that trainings of ``new_training(*callbacks)`` resume exactly after the steps ``cuts``.

    ``env()`` makes the environment to load a training with. Returns an uninterrupted training.
    """
    whole = new_training()
    rows = whole.run().rows
    for cut in cuts:
        before = new_training(Stop(cut, path)).run()
        assert not before.is_finished
        again = Training.load(path, env(), **options)
        assert (*before.rows, *again.run().rows) == rows
        assert states_equal(whole.agent, again.agent)
    return whole
