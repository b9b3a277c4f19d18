"""Objects of the core: pickling, use by several threads at once, changed arrays, Ctrl-C.

An object that works in one thread refuses other threads: the message has the word `IN_USE`. Sizes
are chosen so that the work lasts longer than a test needs to try other uses.
"""

import pickle
import re
import signal
import subprocess
import sys
import threading
import time
from concurrent.futures import ThreadPoolExecutor, wait
from pathlib import Path

import numpy as np
import pytest

import core_cells
import sdnn._core as core
from refusals import refuses

BINDINGS = Path(__file__).parents[3] / "cpp" / "bindings"
IN_USE = "thread"


def test_objects_of_the_core_cannot_be_pickled():
    for protocol in range(pickle.HIGHEST_PROTOCOL + 1):
        refuses(
            "pickle", pickle.dumps, core.Acrobot(core.AcrobotConfig()), protocol, error=TypeError
        )


def test_only_one_binding_header_releases_the_gil():
    for path in BINDINGS.glob("*.[ch]pp"):
        matches = re.findall(r"gil_scoped_release|PyEval_SaveThread", path.read_text())
        assert path.name == "objects.hpp" or not matches, path


@pytest.fixture
def begin_in_thread():
    """Begins to call a function in another thread; returns the future of its result."""
    with ThreadPoolExecutor() as pool:

        def _begin(function):
            future = pool.submit(function)
            time.sleep(0.02)  # until the thread is at work in the core
            return future

        yield _begin


def assert_refused(use, future):
    """Check that a use is refused while a thread works on ``future``, or that it has just ended."""
    try:
        use()
    except RuntimeError as error:
        if IN_USE not in str(error):
            raise
    else:
        future.result(0.2)  # raises TimeoutError if the other thread still works


def long_trial():
    """Return a trial of 100,000 episodes, of which tests run a few."""
    settings = core_cells.GOOD["AcrobotTrial"]()
    settings["protocol"] = core.ProtocolConfig(episodes=100_000)
    return core.AcrobotTrial(**settings)


def test_a_trial_refuses_other_threads_while_it_advances(begin_in_thread):
    trial = long_trial()
    agent, network = trial.agent, trial.agent.networks[0]
    n_decisions = trial.n_decisions
    advance = begin_in_thread(lambda: trial.advance(800))
    uses = [
        lambda: trial.advance(1),
        trial.test_rows,
        lambda: trial.finished,
        lambda: agent.act([0.1] * 4),
        lambda: network.values([0.1] * 4),
        lambda: core.NetworkParts(network, 1),
    ]
    refuses(IN_USE, uses[0], error=RuntimeError)  # the thread has only begun
    for use in uses[1:]:
        assert_refused(use, advance)
    assert advance.result() is None
    assert trial.episode == 800
    assert trial.n_decisions > n_decisions
    undisturbed = long_trial()
    undisturbed.advance(800)
    for name, column in undisturbed.test_rows().items():
        np.testing.assert_array_equal(trial.test_rows()[name], column)


def new_trainer(layer, form="auto", n_samples=20_000):
    generator = np.random.default_rng(1)
    bins = generator.integers(0, 12, (n_samples, 2)).astype(np.int32)
    targets = generator.uniform(0, layer.n_units, (n_samples, 1))
    return core.PDeltaTrainer(layer, bins, targets, form=form, memory_limit=2**34)


@pytest.mark.parametrize("form", ["plain", "block"])
def test_a_layer_refuses_other_threads_while_it_is_trained(form, begin_in_thread):
    layer = core.ParallelPerceptron(core_cells.code(), 200, seed=1)
    trainer, other = new_trainer(layer, form), new_trainer(layer, form)
    order = np.tile(np.arange(20_000, dtype=np.int32), 20)
    training = begin_in_thread(lambda: trainer.present(order))
    uses = [
        lambda: trainer.present(order[:1]),
        lambda: other.present(order[:1]),
        trainer.synchronize,
        other.synchronize,
        lambda: layer.weights,
        lambda: layer.potentials(core_cells.BINS),
        lambda: core.PDeltaTrainer(layer, core_cells.BINS, [[1.0]] * 3),
    ]
    refuses(IN_USE, uses[0], error=RuntimeError)  # the thread has only begun
    order[:] = -(2**31)  # changes nothing: the trainer works on a copy
    for use in uses[1:]:
        assert_refused(use, training)
    n_corrections, *_ = training.result()
    assert n_corrections > 0


def test_a_layer_refuses_training_while_threads_read_it(begin_in_thread):
    layer = core.ParallelPerceptron(core_cells.code(), 4000, seed=1)
    trainer = new_trainer(layer, "plain", n_samples=5)
    bins = np.tile(np.array(core_cells.BINS, np.int32), (500_000, 1))
    expected = layer.counts(core_cells.BINS)
    futures = [begin_in_thread(lambda: layer.counts(bins)) for _ in range(2)]
    refuses(IN_USE, trainer.present, [0], error=RuntimeError)
    bins[:] = 2**31 - 1  # changes nothing: the threads read a copy
    np.testing.assert_array_equal(layer.counts(core_cells.BINS), expected)
    assert layer.weights.shape == (4000, 40)
    for future in futures:
        np.testing.assert_array_equal(future.result()[-len(expected) :], expected)
    trainer.present([0])  # is accepted now


N_UNITS = 1000
BINS_OF_60_SAMPLES = np.tile(np.array(core_cells.BINS, np.int32), (20, 1))


def new_online_layer():
    """Return a layer with so many columns that it reads 60 samples for hundredths of a second."""
    wide = [np.tile(core_cells.patterns(), 100)] * 2
    code = core.SelectiveDesensitization(wide, wide, [[0, 1], [1, 0]])
    return core.OnlineLayer(core.ParallelPerceptron(code, N_UNITS, seed=1))


def learn_a_sample(layer):
    """Learn the first of core_cells.BINS as a sample of class 0; each unit stands for a class."""
    return layer.learn_labels(core_cells.BINS[:1], [0], N_UNITS, "one_vs_rest")


def test_an_online_layer_learns_while_two_threads_read_without_pause():
    layer = new_online_layer()
    is_over = threading.Event()

    def read():
        """Read until the learner is done; return how often it succeeded."""
        n_reads = 0
        while not is_over.is_set():
            try:
                layer.potentials(BINS_OF_60_SAMPLES)
                n_reads += 1
            except RuntimeError as error:  # called while the layer was being changed
                if IN_USE not in str(error):
                    raise
        return n_reads

    def learn():
        for _ in range(30):
            learn_a_sample(layer)
        return not is_over.is_set()

    with ThreadPoolExecutor() as pool:
        readers = [pool.submit(read) for _ in range(2)]
        learner = pool.submit(learn)
        wait([learner], timeout=60)
        is_over.set()
    assert learner.result(), "the learner was done only after the readers"
    assert all(reader.result() > 0 for reader in readers)


def test_a_signal_ends_a_wait_for_readers_and_its_handler_may_read(begin_in_thread):
    layer = new_online_layer()
    expected = layer.potentials(core_cells.BINS)
    potentials = []

    def read_and_raise(signal_number, frame):
        potentials.append(layer.potentials(core_cells.BINS))
        raise InterruptedError

    def learn_until_the_signal():
        timer.start()
        learn_a_sample(layer)

    previous = signal.signal(signal.SIGUSR1, read_and_raise)
    timer = threading.Timer(0.1, signal.raise_signal, [signal.SIGUSR1])
    try:
        # It reads for seconds; signals do not interrupt it, as it is not in the main thread.
        reading = begin_in_thread(lambda: layer.potentials(np.tile(BINS_OF_60_SAMPLES, (200, 1))))
        with pytest.raises(InterruptedError):
            learn_until_the_signal()
        assert not reading.done()
    finally:
        timer.join()
        signal.signal(signal.SIGUSR1, previous)
    np.testing.assert_array_equal(potentials, [expected])
    np.testing.assert_array_equal(layer.potentials(core_cells.BINS), expected)
    reading.result()
    learn_a_sample(layer)


def test_a_batch_of_acrobots_refuses_other_threads_while_it_steps(begin_in_thread):
    n = 2**16
    batch = core.AcrobotBatch(core.AcrobotConfig(), n)
    every_acrobot = np.ones(n, np.bool_)
    step = begin_in_thread(lambda: batch.step(np.ones(n), np.ones(n), every_acrobot))
    refuses(IN_USE, batch.reset, every_acrobot, error=RuntimeError)
    assert_refused(batch.states, step)
    assert len(step.result()) == 3, "rewards, terminated and truncated"


LONG_WORK = {
    "a network": "c.SDNNC(c.SDNNCConfig(n_inputs=16, n_hidden_units=10**4), 1)",
    "patterns": "c.anchor_patterns(2**22, 9, 25, False, 1)",
    "correlations": "c.correlation_matrix_patterns(2**20, np.eye(64), 1)",
    "a step of many": "b = c.AcrobotBatch(c.AcrobotConfig(), 2**22); n = 2**22;"
    " b.step(np.zeros(n), np.ones(n), np.ones(n, bool))",
    "a trial of small steps": "trial_of_small_steps().advance(2)",
    "products": "b = np.zeros((30_000, 2), np.int32); core_cells.code().gram(b)",
}
"""Statements that run longer than 3.5 s; ``c`` is the core, ``np`` NumPy."""


@pytest.mark.parametrize("work", LONG_WORK)
def test_ctrl_c_ends_long_work_of_the_core_within_3_seconds(work):
    program = f"""
import sys, time
sys.path.insert(0, {str(Path(core_cells.__file__).parent)!r})
import numpy as np, sdnn._core as c, core_cells
def trial_of_small_steps():
    settings = core_cells.GOOD["AcrobotTrial"]()
    settings["acrobot"] = c.AcrobotConfig(integration_step=1e-6)
    return c.AcrobotTrial(**settings)
print("ready", flush=True)
try:
    {LONG_WORK[work]}
except KeyboardInterrupt:
    print("stopped", flush=True)
else:
    print("ended", flush=True)
"""
    command = [sys.executable, "-c", program]
    with subprocess.Popen(command, stdout=subprocess.PIPE, text=True) as process:
        assert process.stdout.readline() == "ready\n"
        time.sleep(0.5)  # until the core is at work
        begin = time.monotonic()
        process.send_signal(signal.SIGINT)
        assert process.stdout.readline() == "stopped\n"
        seconds = time.monotonic() - begin
    assert process.returncode == 0
    assert seconds < 3.0  # it takes far less where the machine is not busy


def test_a_trial_continues_after_ctrl_c_between_episodes():
    trial = long_trial()
    timer = threading.Timer(0.3, signal.raise_signal, [signal.SIGINT])
    timer.start()
    with pytest.raises(KeyboardInterrupt):
        trial.advance(100_000)
    timer.join()
    n_episodes = trial.episode
    trial.advance(50)
    uninterrupted = long_trial()
    uninterrupted.advance(n_episodes + 50)
    np.testing.assert_array_equal(trial.test_rows()["steps"], uninterrupted.test_rows()["steps"])


def test_a_process_exits_cleanly_while_a_thread_works_in_the_core():
    program = """
import threading, time, os, sdnn._core as c, numpy as np
def work():
    b = c.AcrobotBatch(c.AcrobotConfig(), 2**10)
    n = 2**10
    while True:
        b.reset(np.ones(n, bool))
        b.step(np.zeros(n), np.ones(n), np.ones(n, bool))
threading.Thread(target=work, daemon=True).start()
time.sleep(0.2)
"""
    for _ in range(3):
        process = subprocess.run([sys.executable, "-c", program], capture_output=True, timeout=60)
        assert (process.returncode, process.stderr) == (0, b"")
