"""Runs the cells of a matrix in a separate process: a crash or a hang is a failed cell."""

import multiprocessing
import os
import resource
import sys
import tempfile
import time
import warnings
from multiprocessing import forkserver

CELL_SECONDS = 30.0 * (6 if "ASAN_OPTIONS" in os.environ else 1)
"""Limit of the processor time of a cell.

The slowest take 10 s, up to three times as long on a busy machine. Sanitizers lengthen cells up to
fifteen times.
"""

HANG_SECONDS = 120.0
"""Time without a report after which a cell counts as a hang."""

START_SECONDS = 120.0
"""Time within which a process must have imported its modules and made the list of cells."""

HEADROOM = 2**32
"""Bytes of address space that cells may allocate, beyond those of the process at the start."""


def failures(make_cells, *arguments):
    """Run the cells of ``make_cells(*arguments)``; return their number and a list of failures.

    A cell is a pair of a name and a function without arguments that returns a fault, or "". It runs
    in an empty folder, with `CELL_SECONDS` and `HEADROOM` bytes. If it ends its process, or reports
    nothing for `HANG_SECONDS`, another process runs the cells that follow.
    """
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload([make_cells.__module__])  # the server imports it once
    environment = dict(os.environ)
    _start_server_with_search_path()
    failed, first, n_cells = [], 0, None
    while n_cells is None or first < n_cells:
        here, there = context.Pipe(duplex=False)
        work = there, environment, first, make_cells, arguments
        worker = context.Process(target=_work, args=work)
        worker.start()
        there.close()
        name = "the start"
        try:
            n_cells = _received(here, START_SECONDS)
            for number in range(first, n_cells):
                first, name = number + 1, _received(here, HANG_SECONDS)
                if fault := _received(here, HANG_SECONDS):
                    failed.append(f"{name}: {fault}")
        except TimeoutError:
            failed.append(f"{name}: hangs for more than {HANG_SECONDS} s")
        except EOFError:
            worker.join()
            failed.append(f"{name}: ended the process with exit code {worker.exitcode}")
        worker.kill()
        worker.join()
        if n_cells is None:
            break
    return n_cells, failed


def _start_server_with_search_path():
    """Start the server of processes, which finds the modules that this process finds.

    It has the environment of its start, so that the search path is in the environment until then.
    """
    former_path = os.environ.get("PYTHONPATH")
    os.environ["PYTHONPATH"] = os.pathsep.join(dict.fromkeys(filter(None, sys.path)))
    forkserver.ensure_running()
    if former_path is None:
        del os.environ["PYTHONPATH"]
    else:
        os.environ["PYTHONPATH"] = former_path


def _received(pipe, seconds):
    """Return the next object of a pipe; TimeoutError if none comes, EOFError if none can come."""
    if not pipe.poll(seconds):
        raise TimeoutError
    return pipe.recv()


def _work(pipe, environment, first, make_cells, arguments):
    """Run cells from number ``first`` on; send the number of all, then each name and fault.

    ``environment`` replaces that of the server, which may have started long before.
    """
    os.environ.clear()
    os.environ.update(environment)
    home = os.getcwd()
    cells = list(make_cells(*arguments))
    with open("/proc/self/statm") as file:
        used = int(file.read().split()[0]) * resource.getpagesize()
    resource.setrlimit(resource.RLIMIT_AS, (used + HEADROOM,) * 2)
    pipe.send(len(cells))
    for name, run in cells[first:]:
        pipe.send(name)
        began = time.process_time()
        with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
            os.chdir(folder)
            warnings.simplefilter("error")
            warnings.filterwarnings("ignore", category=UserWarning)  # of Gymnasium, about spaces
            try:
                fault = run()
            except Exception as error:  # what the cell did not expect
                fault = f"{type(error).__name__}: {error}"
            os.chdir(home)
        seconds = time.process_time() - began
        pipe.send(fault or (f"took {seconds:.1f} s" if seconds > CELL_SECONDS else ""))


def faulty_cells():
    """Yield a cell that works and others that fail in different ways; the last must still run."""
    yield "right", lambda: ""
    yield "wrong", lambda: "was wrong"
    yield "raising", lambda: 1 / 0
    yield "hanging", lambda: [None for _ in iter(int, 1)]
    yield "crashing", os.abort
    yield "eating", lambda: str(len(bytearray(2**33)))
    yield "last", lambda: "was last"
