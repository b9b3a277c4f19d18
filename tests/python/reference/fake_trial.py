"""A trial without network and acrobot; run as a script, it fills a store until it is killed."""

import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np

from sdnn.reproduction import EXPERIMENTS, plan_trials
from sdnn.runs import AGENTS, ResultStore, ThreadExecutor, run_trials
from sdnn.runs.engine import Advanced, Begun, Failed, Finished, Noted

CASES = EXPERIMENTS[0].cases


class FakeTrial:
    """Rows by the seed: after a few evaluations, their steps fall from 50 (failed) to about 5."""

    def __init__(self, *, protocol, seed, **_others):
        self._protocol = protocol
        n_tests = protocol.episodes // protocol.evaluate_every_episodes
        generator = np.random.default_rng(seed)
        n_failed = generator.integers(2, 8)
        self._steps = generator.integers(3, 8, n_tests).astype(np.int32)
        self._steps[:n_failed] = 50
        self._returns = generator.normal(size=n_tests)
        self.episode = 0

    @property
    def finished(self):
        return self.episode == self._protocol.episodes

    @property
    def n_decisions(self):
        return 7 * self.episode

    def advance(self, n):
        self.episode = min(self.episode + n, self._protocol.episodes)

    def test_rows(self):
        evaluate_every = self._protocol.evaluate_every_episodes
        n_tests = self.episode // evaluate_every
        steps = self._steps[:n_tests]
        return {
            "episode": np.arange(1, n_tests + 1, dtype=np.int32) * evaluate_every,
            "steps": steps,
            "episode_return": self._returns[:n_tests],
            "solved": steps < 50,
        }


class SlowTrial(FakeTrial):
    """Trial that takes a millisecond for an episode, and advances by one at a time."""

    def advance(self, n):
        time.sleep(0.001)
        super().advance(1)


class Recorder:
    """Observer that records messages, and calls a function after the second finished trial."""

    def __init__(self, on_finished=None):
        self.events, self.notes, self.on_finished = [], [], on_finished

    def __call__(self, message):
        match message:
            case Begun():
                self.events.append(("begun", *message))
            case Advanced(planned, episode):
                self.events.append(("advanced", planned.key, episode))
            case Finished(planned, _):
                self.events.append(("finished", planned.key))
                if self.on_finished and [name for name, *_ in self.events].count("finished") == 2:
                    self.on_finished()
            case Failed(planned, _):
                self.events.append(("failed", planned.key))
            case Noted(text):
                self.events.append(("noted", text))
                self.notes.append(text)


def _say_stored(message):
    if isinstance(message, Finished):
        print("stored", flush=True)


def make_plan(n_trials=3, n_episodes=300, root_seed=0):
    return plan_trials(CASES, n_trials, root_seed, n_episodes)


def agents_with(core_trial):
    """Return the entries of all agents, with another class of trials."""
    return {name: replace(entry, core_trial=core_trial) for name, entry in AGENTS.items()}


if __name__ == "__main__":
    AGENTS.update(agents_with(SlowTrial))
    with ResultStore(Path(sys.argv[1])) as store:
        run_trials(make_plan(6, 100), store, executor=ThreadExecutor(2), observer=_say_stored)
