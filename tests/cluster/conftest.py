"""A scheduler and workers on this machine, as processes that tests may hurt."""

import contextlib
import os
import signal
import subprocess
import sys
import textwrap

import psutil
import pytest

pytest.importorskip("distributed", reason="needs Dask")

SETTINGS = {
    "DASK_DISTRIBUTED__LOGGING__DISTRIBUTED": "error",
    "DASK_DISTRIBUTED__SCHEDULER__ALLOWED_FAILURES": "1",
    "DASK_DISTRIBUTED__SCHEDULER__WORKER_TTL": "3s",
}


class Cluster:
    """A context manager that leaves no process behind."""

    def __init__(self, folder):
        self.folder = folder
        self.file = folder / "scheduler.json"
        self.settings = dict(SETTINGS)
        self.workers = []
        self.scheduler = None
        self._log = (folder / "cluster.log").open("ab")

    def __enter__(self):
        self.start_scheduler()
        return self

    def __exit__(self, *_):
        for process in (*self.workers, self.scheduler):
            self.kill(process)
        self._log.close()

    def start_scheduler(self):
        """Start it at another port; the scheduler file has its address."""
        self.file.unlink(missing_ok=True)
        self.scheduler = self._start("scheduler", "--port", "0")

    def add_worker(self, code=""):
        """Start a worker with one thread, which runs `code` first, and its nanny."""
        options = ()
        if code:
            path = self.folder / f"preload_{len(self.workers)}.py"
            path.write_text(textwrap.dedent(code))
            options = ("--preload", str(path))
        folder = str(self.folder)
        self.workers.append(
            self._start("worker", "--nthreads", "1", "--local-directory", folder, *options)
        )

    def kill(self, process):
        """End a process and all that it started, at once."""
        with contextlib.suppress(ProcessLookupError):
            os.killpg(process.pid, signal.SIGKILL)
        process.wait()

    def computing(self):
        """Return the processes that run trials: each is a child of its nanny."""
        with contextlib.suppress(psutil.Error):
            children = [c for w in self.workers for c in psutil.Process(w.pid).children()]
            return [c for c in children if "spawn_main" in " ".join(c.cmdline())]
        return []

    def _start(self, *command):
        return subprocess.Popen(
            [sys.executable, "-m", "dask", *command, "--scheduler-file", str(self.file),
             "--host", "127.0.0.1", "--dashboard-address", "127.0.0.1:0"],
            stdout=self._log, stderr=self._log, start_new_session=True,
            env=os.environ | self.settings,
        )  # fmt: skip


@pytest.fixture(scope="session")
def pair(tmp_path_factory):
    """A scheduler with two workers, which no test hurts."""
    with Cluster(tmp_path_factory.mktemp("pair")) as cluster:
        cluster.add_worker()
        cluster.add_worker()
        yield cluster


@pytest.fixture
def cluster(tmp_path):
    """A scheduler without workers."""
    folder = tmp_path / "cluster"
    folder.mkdir()
    with Cluster(folder) as cluster:
        yield cluster
