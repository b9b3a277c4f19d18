"""Kill workers and schedulers under ``sdnn reproduce --executor dask`` and compare the rows.

    python tests/python/runs/kill_cluster.py --kills 30 --frozen 3 --schedulers 5

A real scheduler and real workers run on this machine, each restarted when it ends, as a supervisor
does. The command is given one folder after another until there were enough kills at random
instants; each folder must hold the rows and files, and nothing else, that a run without a cluster
leaves.
"""

from __future__ import annotations

import argparse
import contextlib
import importlib.util
import os
import random
import signal
import subprocess
import sys
import tempfile
import time
from pathlib import Path

import psutil

QUIET = {
    "DASK_DISTRIBUTED__LOGGING__DISTRIBUTED": "error",
    "DASK_DISTRIBUTED__WORKER__MEMORY__TERMINATE": "False",
}


class Cluster:
    """A scheduler and workers on this machine; a context manager that leaves nothing behind."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.file = folder / "scheduler.json"
        self.workers: dict[int, subprocess.Popen[bytes]] = {}
        self.scheduler: subprocess.Popen[bytes] | None = None
        self._arguments: dict[int, tuple[tuple[str, ...], dict[str, str]]] = {}
        self._log = (folder / "cluster.log").open("ab")

    def __enter__(self) -> Cluster:
        return self

    def __exit__(self, *_: object) -> None:
        for process in (*self.workers.values(), self.scheduler):
            if process is not None:
                self.kill(process)
        self._log.close()

    def start_scheduler(self) -> None:
        """Start it at another port; the scheduler file tells which."""
        self.file.unlink(missing_ok=True)
        self.scheduler = self._start(
            "scheduler", "--host", "127.0.0.1", "--port", "0",
            "--dashboard-address", "127.0.0.1:0", "--scheduler-file", str(self.file),
        )  # fmt: skip

    def add_worker(self, *options: str, **environment: str) -> int:
        """Start a worker with one thread; returns its number."""
        number = len(self._arguments)
        self._arguments[number] = (options, environment)
        self.start_worker(number)
        return number

    def start_worker(self, number: int) -> None:
        options, environment = self._arguments[number]
        self.workers[number] = self._start(
            "worker", "--scheduler-file", str(self.file), "--host", "127.0.0.1", "--nthreads", "1",
            "--dashboard-address", "127.0.0.1:0", "--death-timeout", "15",
            "--local-directory", str(self.folder),
            *options, **environment,
        )  # fmt: skip

    def restart_ended(self) -> None:
        """Do what a supervisor does."""
        if self.scheduler is not None and self.scheduler.poll() is not None:
            self.start_scheduler()
        for number, process in self.workers.items():
            if process.poll() is not None:
                self.start_worker(number)

    def kill(self, process: subprocess.Popen[bytes]) -> None:
        """End a process and all that it started, at once."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()

    def computing(self, number: int) -> psutil.Process | None:
        """The process that runs a worker's trials: itself, or what its nanny started."""
        try:
            own = psutil.Process(self.workers[number].pid)
            if "--no-nanny" in self._arguments[number][0]:
                return own
            children = [p for p in own.children() if "spawn_main" in " ".join(p.cmdline())]
            return children[0] if children else None
        except psutil.Error:
            return None

    def _start(self, *command: str, **environment: str) -> subprocess.Popen[bytes]:
        return subprocess.Popen(
            [sys.executable, "-m", "dask", *command], cwd=self.folder,
            stdout=self._log, stderr=self._log, start_new_session=True,
            env=os.environ | QUIET | environment,
        )  # fmt: skip


class Campaign:
    """Runs the command under kills."""

    def __init__(self, parent: Path, arguments: list[str], seed: int) -> None:
        self.parent = parent
        self.arguments = arguments
        self.random = random.Random(seed)
        self.done = dict.fromkeys(("worker", "frozen", "scheduler"), 0)
        self.rounds = 0
        path = Path(__file__).parents[2] / "robustness" / "kill_and_resume.py"
        spec = importlib.util.spec_from_file_location("kill_and_resume", path)
        self.single = importlib.util.module_from_spec(spec)
        spec.loader.exec_module(self.single)
        self.single.run(parent / "whole", ["reproduce", *arguments])
        self.expected = self.single.content(parent / "whole")

    def run(self, wanted: dict[str, int]) -> None:
        """Run rounds until there were so many kills of each kind.

        Raises
        ------
        AssertionError
            If a run fails, or its rows differ from those without a cluster.
        """
        with Cluster(self.parent) as cluster:
            cluster.start_scheduler()
            for _ in range(3):
                cluster.add_worker()
            while any(self.done[kind] < n for kind, n in wanted.items()):
                self._round(cluster, wanted)

    def _round(self, cluster: Cluster, wanted: dict[str, int]) -> None:
        folder = self.parent / f"round-{self.rounds}"
        command = [
            sys.executable, "-m", "sdnn", "reproduce", *self.arguments, "--out", str(folder),
            "--executor", "dask", "--scheduler", str(cluster.file), "--scheduler-timeout", "60",
            "--worker-timeout", "3", "--attempts", "50",
        ]  # fmt: skip
        log = self.parent / f"round-{self.rounds}.log"
        with log.open("wb") as output:
            driver = subprocess.Popen(command, stdout=output, stderr=output)
        frozen: list[tuple[float, psutil.Process]] = []
        try:
            next_kill = time.monotonic() + self.random.uniform(0.5, 3.0)
            while driver.poll() is None:
                time.sleep(0.05)
                now = time.monotonic()
                cluster.restart_ended()
                for at, process in [*frozen]:
                    if now > at:
                        frozen.remove((at, process))
                        if process.is_running():
                            process.resume()
                if now > next_kill:
                    left = [kind for kind, n in wanted.items() if self.done[kind] < n]
                    if left:
                        self._hurt(cluster, self.random.choice(left), frozen)
                    next_kill = now + self.random.uniform(0.5, 3.0)
        finally:
            if driver.poll() is None:
                driver.kill()
                driver.wait()
            for _, process in frozen:
                if process.is_running():
                    process.kill()
        assert driver.returncode == 0, log.read_text()
        found = self.single.content(folder)
        for name, value in self.expected.items():
            assert found[name] == value, f"{name} of {folder.name} differ after kills"
        self.rounds += 1

    def _hurt(
        self, cluster: Cluster, kind: str, frozen: list[tuple[float, psutil.Process]]
    ) -> None:
        if kind == "scheduler":
            cluster.kill(cluster.scheduler)
        else:
            number = self.random.randrange(len(cluster.workers))
            process = cluster.computing(number)
            if process is None:
                return  # it is just being started
            try:
                if kind == "frozen":
                    process.suspend()
                    # Longer than the driver waits for a sign of life; then it goes on again.
                    frozen.append((time.monotonic() + 6.0, process))
                elif self.random.random() < 0.3:
                    cluster.kill(cluster.workers[number])  # with its nanny
                else:
                    process.kill()
            except psutil.NoSuchProcess:
                return
        self.done[kind] += 1
        print(f"\r{self.done}, round {self.rounds}", end="", file=sys.stderr, flush=True)


def kill_cluster(
    arguments: list[str], *, n_kills: int, n_frozen: int, n_schedulers: int, seed: int
) -> str:
    """Hurt a cluster so many times; returns a line about it."""
    with tempfile.TemporaryDirectory() as parent:
        begin = time.monotonic()
        campaign = Campaign(Path(parent), arguments, seed)
        campaign.run({"worker": n_kills, "frozen": n_frozen, "scheduler": n_schedulers})
        seconds = time.monotonic() - begin
    print(file=sys.stderr)
    done = campaign.done
    return (
        f"{done['worker']} workers killed, {done['frozen']} frozen, {done['scheduler']} schedulers"
        f" killed in {campaign.rounds} rounds, {seconds:.0f} s: the same rows"
        f" ({campaign.expected['digest'][:16]}) and files as without a cluster"
    )


def main() -> None:
    """Read the options."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--kills", type=int, default=30, help="of workers")
    parser.add_argument("--frozen", type=int, default=3, help="workers stopped for 6 s")
    parser.add_argument("--schedulers", type=int, default=5, help="kills of the scheduler")
    parser.add_argument("--seed", type=int, default=0, help="of the instants")
    parser.add_argument(
        "arguments", nargs="*", default=["a", "--trials", "20", "--episodes", "1000"]
    )
    options = parser.parse_args()
    print(
        kill_cluster(
            options.arguments, n_kills=options.kills, n_frozen=options.frozen,
            n_schedulers=options.schedulers, seed=options.seed,
        )
    )  # fmt: skip


if __name__ == "__main__":
    main()
