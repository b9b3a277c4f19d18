"""Ctrl-C during a training and in library code."""

import os
import signal
import threading
import time
from contextlib import suppress

import gymnasium as gym
import pytest

from refusals import refuses
from sdnn.agents import Callback, CheckpointCallback, JSONLines, SDNNQLearning, Training
from sdnn.support.interrupts import Interrupts, stay_interrupts, thread_pool


def press_ctrl_c():
    os.kill(os.getpid(), signal.SIGINT)


@pytest.fixture(autouse=True)
def python_handler():
    """Begin with Python's handler of Ctrl-C, which the tested code must leave or restore."""
    before = signal.signal(signal.SIGINT, signal.default_int_handler)
    yield
    assert signal.getsignal(signal.SIGINT) is signal.default_int_handler
    signal.signal(signal.SIGINT, before)


def test_the_first_signal_calls_back_and_the_second_interrupts():
    calls = []
    with Interrupts(lambda: calls.append(1)) as interrupts:
        assert interrupts.received is None
        press_ctrl_c()
        assert (calls, interrupts.received) == ([1], signal.SIGINT)
        with pytest.raises(KeyboardInterrupt):
            press_ctrl_c()
    assert calls == [1]


def test_a_custom_handler_is_not_replaced():
    calls = []
    before = signal.signal(signal.SIGTERM, lambda number, frame: calls.append(number))
    try:
        with Interrupts(lambda: calls.append("interrupt"), (signal.SIGTERM,)) as interrupts:
            os.kill(os.getpid(), signal.SIGTERM)
        assert (calls, interrupts.received) == ([signal.SIGTERM], None)
    finally:
        signal.signal(signal.SIGTERM, before)


@pytest.mark.parametrize("make_context", [lambda: Interrupts(lambda: None), stay_interrupts])
def test_in_other_threads_than_the_main_one_the_handler_is_not_replaced(make_context):
    handlers = []

    def enter():
        with make_context():
            handlers.append(signal.getsignal(signal.SIGINT))

    thread = threading.Thread(target=enter)
    thread.start()
    thread.join()
    assert handlers == [signal.default_int_handler]


class InterruptIn(gym.Wrapper):
    """Send SIGINT, as Ctrl-C does, ``times`` times within the step with the number ``step``."""

    def __init__(self, env, step, times):
        super().__init__(env)
        self._n_left, self._times = step, times

    def step(self, action):
        self._n_left -= 1
        if self._n_left == 0:
            for _ in range(self._times):
                press_ctrl_c()
        return self.env.step(action)


class CountEnds(Callback):
    n = 0

    def on_end(self, training):
        self.n += 1


@pytest.mark.parametrize(
    ("times", "saved_at"),
    [(1, 47), (2, 30)],
    ids=["once, saved in its step", "twice, saved by the last checkpoint"],
)
def test_a_training_interrupted_by_ctrl_c_resumes_exactly(tmp_path, times, saved_at):
    def make(env, name):
        agent = SDNNQLearning(env.observation_space, env.action_space, seed=1)
        return Training(agent, env, steps=120, seed=2, callbacks=callbacks(name))

    def callbacks(name):
        rows = JSONLines(tmp_path / f"{name}.jsonl")
        return [rows, CheckpointCallback(tmp_path / name, every=30), CountEnds()]

    make(gym.make("CartPole-v1"), "whole").run()
    training = make(InterruptIn(gym.make("CartPole-v1"), 47, times), "cut")
    with pytest.raises(KeyboardInterrupt):
        training.run()
    assert training.callbacks[2].n == 1
    assert training.is_within_step == (times == 2)  # the second signal does not wait for its end
    if times == 2:
        refuses("step", training.run, error=RuntimeError)
    loaded = Training.load(tmp_path / "cut", gym.make("CartPole-v1"), callbacks=callbacks("cut"))
    assert loaded.n_steps == saved_at
    loaded.run()
    assert (tmp_path / "cut").read_bytes() == (tmp_path / "whole").read_bytes()
    for name in ("cut", "whole"):
        assert (tmp_path / f"{name}.jsonl").read_text().count("\n") == loaded.n_rows
    assert (tmp_path / "cut.jsonl").read_text() == (tmp_path / "whole.jsonl").read_text()


def convert_ctrl_c():
    """Raise another error for Ctrl-C, as some libraries do."""
    try:
        press_ctrl_c()
    except KeyboardInterrupt:
        raise ValueError("Invalid affine transformation matrix") from None


def test_ctrl_c_that_other_code_converts_or_catches_is_raised_as_keyboard_interrupt():
    with pytest.raises(KeyboardInterrupt), stay_interrupts():
        convert_ctrl_c()
    with pytest.raises(KeyboardInterrupt), stay_interrupts(), suppress(KeyboardInterrupt):
        press_ctrl_c()
    with pytest.raises(KeyboardInterrupt), stay_interrupts():
        press_ctrl_c()


def test_unrelated_errors_and_handled_ctrl_c_are_not_changed():
    with pytest.raises(ValueError, match="unrelated"), stay_interrupts():
        raise ValueError("unrelated")
    calls = []
    with Interrupts(lambda: calls.append(1)), stay_interrupts():
        press_ctrl_c()
    assert calls == [1]
    with stay_interrupts():
        pass  # raises nothing


def test_ctrl_c_at_the_end_of_a_pool_waits_for_its_threads():
    has_ended = []

    def work():
        time.sleep(0.1)
        press_ctrl_c()
        time.sleep(0.2)
        has_ended.append(True)

    with pytest.raises(KeyboardInterrupt), thread_pool(1) as pool:
        pool.submit(work)
    assert has_ended
