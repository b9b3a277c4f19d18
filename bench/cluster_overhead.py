"""Measure the driver's overhead for each trial on a cluster.

    python bench/cluster_overhead.py [--workers 1000] [--seconds 1]

A real scheduler and workers on this machine run trials that only wait some seconds, and return as
many rows as a trial of the paper has. Printed are the recorded trials a second, the processor time
of driver, scheduler and workers for each trial, and the memory of the scheduler as trials end. The
same without a cluster shows the share of the store.
"""

from __future__ import annotations

import argparse
import asyncio
import os
import subprocess
import sys
import tempfile
import time
from dataclasses import replace
from pathlib import Path

import dask
import numpy as np
import psutil
from distributed import Client, get_worker

from sdnn.reproduction import EXPERIMENTS, plan_trials
from sdnn.runs import AGENTS, DaskExecutor, ResultStore, ThreadExecutor, run_trials
from sdnn.runs.engine import Finished

SECONDS = "SDNN_BENCH_TRIAL_SECONDS"
ROWS = "SDNN_BENCH_TRIAL_ROWS"
WORKERS_OF_A_PROCESS = 125
QUIET = {
    "distributed.worker.profile.enabled": False,
    "distributed.worker.memory.monitor-interval": "60s",
    "distributed.admin.tick.interval": "60s",
    "distributed.admin.system-monitor.interval": "60s",
    "distributed.admin.system-monitor.gil.enabled": False,
}
"""Settings without which a thousand workers watching themselves keep two cores busy."""


class WaitingTrial:
    """Waits instead of learning, and has the rows of a whole trial."""

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
        if is_task():  # else the driver or a worker compares builds
            time.sleep(float(os.environ.get(SECONDS, "0")))
        self.episode = self._n_episodes

    def test_rows(self):
        n_tests = int(os.environ.get(ROWS, self._n_episodes // self._interval))
        generator = np.random.default_rng(self._seed)
        steps = generator.integers(3, 50, n_tests)
        return {
            "episode": self._interval * np.arange(1, n_tests + 1),
            "steps": steps,
            "episode_return": generator.normal(size=n_tests),
            "solved": steps < 40,
        }


def is_task():
    """Return whether this thread runs a task of a worker."""
    try:
        return bool(get_worker().get_current_task())
    except (LookupError, ValueError):
        return False


AGENTS["sdnn-c"] = replace(AGENTS["sdnn-c"], core_trial=WaitingTrial)


def start(folder, *command):
    environment = os.environ | {"DASK_DISTRIBUTED__LOGGING__DISTRIBUTED": "error"}
    return psutil.Popen(
        [sys.executable, *command], cwd=folder, env=environment,
        stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL,
    )  # fmt: skip


async def serve(n_workers):
    """Run workers with a thread each in this process."""
    dask.config.set(QUIET)
    from distributed import Worker

    options = {"scheduler_file": "scheduler.json", "nthreads": 1, "dashboard": False}
    workers = [Worker(**options, host="127.0.0.1") for _ in range(n_workers)]
    await asyncio.gather(*workers)
    await asyncio.gather(*(worker.finished() for worker in workers))


def processor_seconds(processes):
    return sum(sum(process.cpu_times()[:2]) for process in processes)


def measure(folder, plan, executor, groups, observer=None):
    """Return trials a second, and each group of processes' processor milliseconds for a trial."""
    with ResultStore(folder) as store:
        before = [processor_seconds(group) for group in groups]
        begin = time.monotonic()
        outcome = run_trials(plan, store, executor=executor, observer=observer)
        seconds = time.monotonic() - begin
        after = [processor_seconds(group) for group in groups]
    assert outcome.n_run == len(plan), outcome
    per_trial = [1e3 * (b - a) / len(plan) for a, b in zip(before, after, strict=True)]
    return len(plan) / seconds, per_trial


class Memory:
    """Notes megabytes of the scheduler whenever a tenth of the trials has ended."""

    def __init__(self, scheduler, n_trials):
        self._scheduler, self._interval = scheduler, max(1, n_trials // 10)
        self._n_ended = 0
        self.megabytes = []

    def __call__(self, message):
        if isinstance(message, Finished):
            self._n_ended += 1
            if self._n_ended % self._interval == 0:
                self.megabytes.append(round(self._scheduler.memory_info().rss / 1e6))


def main():
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--trials", type=int, default=1000)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--seconds", type=float, default=0.0, help="that a trial waits")
    parser.add_argument("--rows", type=int, help="of a trial, instead of the paper's 1,500")
    parser.add_argument("--serve", type=int, help=argparse.SUPPRESS)
    options = parser.parse_args()
    if options.serve:
        asyncio.run(serve(options.serve))
        return
    os.environ[SECONDS] = str(options.seconds)
    if options.rows is not None:
        os.environ[ROWS] = str(options.rows)
    plan = plan_trials(EXPERIMENTS[0].cases, options.trials // 2, 0)
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        scheduler = start(
            folder, "-m", "dask", "scheduler", "--scheduler-file", "scheduler.json",
            "--dashboard-address", "127.0.0.1:0", "--host", "127.0.0.1", "--port", "0",
        )  # fmt: skip
        file = str(folder / "scheduler.json")
        size = min(WORKERS_OF_A_PROCESS, max(1, options.workers // 2))
        n_processes = -(-options.workers // size)
        workers = [
            start(folder, str(Path(__file__).resolve()), "--serve", str(size))
            for _ in range(n_processes)
        ]
        try:
            begin = time.monotonic()
            with Client(scheduler_file=file) as client:
                client.wait_for_workers(n_processes * size, timeout=600)
            started = time.monotonic() - begin
            executor = DaskExecutor(file)
            memory = Memory(scheduler, len(plan))
            groups = [[psutil.Process()], [scheduler], workers]
            rate, (driver, of_scheduler, of_workers) = measure(
                folder / "cluster", plan, executor, groups, memory
            )
        finally:
            for process in (*workers, scheduler):
                process.kill()
                process.wait()
        os.environ[SECONDS] = "0"
        few = plan[:500]
        _, (alone,) = measure(folder / "alone", few, ThreadExecutor(1), groups[:1])
    n_rows = 1500 if options.rows is None else options.rows
    print(
        f"{len(plan)} trials of {options.seconds:g} s and {n_rows} rows,"
        f" {n_processes * size} workers started in {started:.0f} s:"
        f" {rate:.0f} recorded a second; processor ms a trial: driver {driver:.2f}"
        f" (one thread, no cluster {alone:.2f}), scheduler {of_scheduler:.2f},"
        f" workers {of_workers:.2f}; MB of the scheduler over time: {memory.megabytes}"
    )


if __name__ == "__main__":
    main()
