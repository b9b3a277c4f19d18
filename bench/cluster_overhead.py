"""Measure the driver's overhead for each trial on a cluster.

    python bench/cluster_overhead.py

A real scheduler and worker processes on this machine run trials that compute nothing but return as
many rows as a trial of the paper has. Printed is the processor time of driver, scheduler and
workers, for each trial. The same without a cluster tells what the store takes of it.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import psutil

from sdnn.reproduction import EXPERIMENTS, plan_trials
from sdnn.runs import AGENTS, DaskExecutor, ResultStore, ThreadExecutor, run_trials


class InstantTrial:
    """Done at once, with the rows of a whole trial."""

    def __init__(self, *, protocol, seed, **_others):
        self._n_episodes = protocol.episodes
        self._interval = protocol.evaluate_every_episodes
        self._seed = seed
        self.episode = 0
        self.n_decisions = 0

    @property
    def finished(self):
        return self.episode == self._n_episodes

    def advance(self, n):
        self.episode = self._n_episodes

    def test_rows(self):
        n_tests = self._n_episodes // self._interval
        generator = np.random.default_rng(self._seed)
        steps = generator.integers(3, 50, n_tests)
        return {
            "episode": self._interval * np.arange(1, n_tests + 1),
            "steps": steps,
            "episode_return": generator.normal(size=n_tests),
            "solved": steps < 40,
        }


AGENTS["sdnn-c"] = replace(AGENTS["sdnn-c"], core_trial=InstantTrial)


def start(folder, *command):
    environment = os.environ | {"DASK_DISTRIBUTED__LOGGING__DISTRIBUTED": "error"}
    return psutil.Popen(
        [sys.executable, "-m", "dask", *command, "--scheduler-file", "scheduler.json",
         "--dashboard-address", "127.0.0.1:0", "--host", "127.0.0.1"],
        cwd=folder, env=environment, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip


def processor_seconds(processes):
    return sum(sum(process.cpu_times()[:2]) for process in processes)


def measure(folder, plan, executor, others):
    """Processor milliseconds for each trial of this process, and of each group of others."""
    groups = [[psutil.Process()], *others]
    with ResultStore(folder) as store:
        before = [processor_seconds(group) for group in groups]
        begin = time.monotonic()
        outcome = run_trials(plan, store, executor=executor)
        seconds = time.monotonic() - begin
        after = [processor_seconds(group) for group in groups]
    assert outcome.n_run == len(plan), outcome
    per_trial = [1e3 * (b - a) / len(plan) for a, b in zip(before, after, strict=True)]
    return [*per_trial, 1e3 * seconds / len(plan)]


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--trials", type=int, default=1000)
    parser.add_argument("--workers", type=int, default=2)
    options = parser.parse_args()
    n_trials = options.trials // 2
    plan = plan_trials(EXPERIMENTS[0].cases, n_trials, 0)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scheduler = start(folder, "scheduler", "--port", "0")
        workers = [
            start(folder, "worker", "--nthreads", "1", "--no-nanny", "--preload", __file__)
            for _ in range(options.workers)
        ]
        try:
            executor = DaskExecutor(str(folder / "scheduler.json"))
            measure(folder / "warm-up", plan[:20], executor, [])
            driver, of_scheduler, of_workers, wall = measure(
                folder / "cluster", plan, executor, [[scheduler], workers]
            )
            alone, _ = measure(folder / "alone", plan, ThreadExecutor(1), [])
        finally:
            for process in (*workers, scheduler):
                process.kill()
                process.wait()
    print(
        f"{len(plan)} trials, {options.workers} workers; milliseconds a trial:"
        f" driver {driver:.2f} (with one thread and no cluster {alone:.2f}),"
        f" scheduler {of_scheduler:.2f}, workers {of_workers:.2f}; {wall:.2f} from begin to end"
    )


if __name__ == "__main__":
    main()
