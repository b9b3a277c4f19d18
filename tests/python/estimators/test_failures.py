"""Errors and interruptions leave an estimator unchanged."""

import functools
import gc
import os
import pickle
import signal
import sys
import threading
import time

import numpy as np
import pytest

from refusals import refuses
from sdnn import SDNNClassifier, SDNNRegressor
from sdnn.coding import RandomInverse

RANDOM = np.random.RandomState(0)
X = RANDOM.uniform(0, 1, (12, 2))
Y = np.sin(5 * X[:, 0]) * X[:, 1]
LABELS = np.digitize(Y, [Y.mean()])
UNIT = RandomInverse(low=0.0, high=1.0)
OPTIONS = {"n_pattern_units": 16, "max_iter": 2, "random_state": 0}


class InjectedError(BaseException):
    """An error that is as hard to swallow as KeyboardInterrupt."""


class FailAtCall:
    """Profiler that counts calls of functions, of Python or C, and raises an error at the n-th."""

    def __init__(self, n):
        self.n = n
        self.n_calls = 0

    def __call__(self, frame, event, _argument):
        if event in ("call", "c_call") and frame.f_code is not FailAtCall.stops.__code__:
            self.n_calls += 1
            if self.n_calls == self.n:
                raise InjectedError

    def stops(self, work):
        """Return whether the call ``work()`` raised the error."""
        gc.disable()  # it would call other functions
        sys.setprofile(self)
        try:
            work()
        except InjectedError:
            return True
        except TypeError:  # by which NumPy 2.0 replaces any error while it compares rows
            if self.n_calls < self.n:
                raise
            return True
        finally:
            sys.setprofile(None)
            gc.enable()
        return False


ESTIMATORS = {
    "regressor": (SDNNRegressor, {"output_range": (-2, 2), "n_output_units": 8}, Y),
    "classifier": (SDNNClassifier, {}, LABELS),
}
METHODS = {
    "fit": lambda model, y: model.fit(X, y),
    "partial_fit": lambda model, y: model.partial_fit(X, y),
    "learn_one": lambda model, y: model.learn_one(X[3], y[3]),
}


def new_model(name, **options):
    """Return an unfitted estimator and targets for it."""
    estimator, settings, y = ESTIMATORS[name]
    return estimator(UNIT, **{**OPTIONS, **settings, **options}), y


state_of = pickle.dumps  # all that an estimator knows, with the bits of its weights


@pytest.mark.filterwarnings("ignore::pytest.PytestUnraisableExceptionWarning")  # in generators
@pytest.mark.parametrize("training", ["auto", "block"])
@pytest.mark.parametrize("name", ESTIMATORS)
@pytest.mark.parametrize("method", METHODS)
def test_an_error_at_any_call_leaves_the_model_unchanged(name, method, training):
    learn = METHODS[method]
    model, y = new_model(name, training=training)
    model.fit(X[::-1], y[::-1]).learn_one(X[0], y[0])
    before = state_of(model)
    counting = FailAtCall(-1)  # raises no error
    copy = learn(pickle.loads(before), y)
    counting.stops(lambda: learn(copy, y))
    last = counting.n_calls
    calls = np.random.RandomState(1).randint(1, last, size=90)
    calls = [*calls, *range(max(1, last - 10), last + 1)]
    n_failed = 0
    for n in calls:
        if FailAtCall(n).stops(functools.partial(learn, model, y)):
            n_failed += 1
            assert state_of(model) == before, n
        else:  # some libraries catch errors of functions that they call
            model, _ = new_model(name, training=training)
            model.fit(X[::-1], y[::-1]).learn_one(X[0], y[0])
    assert n_failed > 0.75 * len(calls)


@pytest.mark.parametrize("name", ESTIMATORS)
def test_a_failed_first_fit_leaves_an_unfitted_model(name):
    model, y = new_model(name)
    before = state_of(model)
    for n in np.random.RandomState(2).randint(1, 300, size=50):  # it makes more than 300 calls
        assert FailAtCall(n).stops(lambda: model.fit(X, y))
        assert state_of(model) == before
    model.set_params(training="dual", memory_limit=100)
    before = state_of(model)
    refuses("memory_limit", model.fit, X, y)
    assert state_of(model) == before


@pytest.mark.parametrize("name", ESTIMATORS)
def test_refused_samples_do_not_change_the_model(name):
    model, y = new_model(name)
    model.fit(X, y)
    before = state_of(model)
    bad = X.copy()
    bad[5, 1] = np.inf
    for refused in (
        lambda: model.fit(bad, y),
        lambda: model.partial_fit(bad, y),
        lambda: model.partial_fit(X[:, :1], y),
        lambda: model.learn_one(bad[5], y[5]),
        lambda: model.learn_one(X[5, :1], y[5]),
        lambda: model.learn_one("ab", y[5]),
        lambda: model.learn_one({"a": 0.1, "b": 0.2}, y[5]),
        lambda: model.learn_one(X[5], "unheard"),
    ):
        with pytest.raises(ValueError, match=r"."):
            refused()
        assert state_of(model) == before


def seconds_until_interrupted(work):
    """Return the processor time from SIGINT, sent after 0.4 s, to the end of the call ``work()``.

    The time on the clock would depend on other processes.
    """
    sent = []

    def interrupt():
        sent.append(time.process_time())
        os.kill(os.getpid(), signal.SIGINT)

    timer = threading.Timer(0.4, interrupt)
    timer.start()
    try:
        with pytest.raises(KeyboardInterrupt):
            work()
        return time.process_time() - sent[0]
    finally:
        timer.cancel()
        timer.join()


MANY = RANDOM.uniform(0, 1, (6000, 4))


@pytest.mark.skipif(os.name == "nt", reason="no SIGINT to oneself")
@pytest.mark.parametrize("training", ["dual", "block", "plain"])
def test_ctrl_c_ends_training_within_a_second_and_keeps_the_model(training):
    options = {"coding": UNIT, "output_range": (-1, 2), "random_state": 0, "training": training}
    model = SDNNRegressor(**options, max_iter=1, n_pattern_units=400).fit(MANY[:50], MANY[:50, 0])
    before = state_of(model.set_params(max_iter=100_000))
    targets = RANDOM.uniform(0, 1, len(MANY))
    assert seconds_until_interrupted(lambda: model.fit(MANY, targets)) < 1
    assert state_of(model) == before
    n_times = 1 if training == "dual" else 20  # so that an epoch takes longer than 0.4 s
    samples, values = np.tile(MANY, (n_times, 1)), np.tile(targets, n_times)
    assert seconds_until_interrupted(lambda: model.partial_fit(samples, values)) < 1
    assert state_of(model) == before


@pytest.mark.skipif(os.name == "nt", reason="no SIGINT to oneself")
def test_ctrl_c_ends_prediction_within_a_second():
    model = SDNNRegressor(UNIT, max_iter=1).fit(MANY[:50], MANY[:50, 0])
    samples = RANDOM.uniform(0, 1, (200_000, 4))
    assert seconds_until_interrupted(lambda: model.predict(samples)) < 1
