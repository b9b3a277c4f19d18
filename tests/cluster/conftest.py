"""A scheduler and workers of Dask on this machine, as processes that tests may kill or freeze."""

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
    """A scheduler and its workers, which end with the context.

    Attributes
    ----------
    file : Path
        The file that has the scheduler's address.
    settings : dict of str to str
        Variables of the environment of processes that are started later.
    workers : list of Popen
        The nannies: each starts its worker, and starts another one if that ends.
    """

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
        """Start a scheduler at a free port, and write its file."""
        self.file.unlink(missing_ok=True)
        self.scheduler = self._start("scheduler", "--port", "0")

    def add_worker(self, code=""):
        """Start a nanny, and by it a worker with one thread, which runs `code` first."""
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
            children = [
                child for nanny in self.workers for child in psutil.Process(nanny.pid).children()
            ]
            return [child for child in children if "spawn_main" in " ".join(child.cmdline())]
        return []  # a process ended meanwhile

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
