"""Kills a run again and again by SIGKILL at random instants, then lets it end.

Usage: kill_run.py FOLDER CONFIG KILLS SEED. Prints the number of processes that were killed, and
the steps of the checkpoints that they left. Processes are forked: a start of Python would take
longer than the training.
"""

import os
import random
import signal
import sys
import time
from pathlib import Path

import drifting_env  # noqa: F401
from sdnn.agents import Training
from sdnn.runs import Run
from sdnn.runs.config_file import read_spec


def steps_of_checkpoint(run):
    """Return the steps that the checkpoint of a run has, 0 if there is none."""
    try:
        env, evaluation_env = (run.spec.environment.make() for _ in range(2))
        path = run.folder / "checkpoint.safetensors"
        return Training.load(path, env, evaluation_env=evaluation_env).n_steps
    except FileNotFoundError:
        return 0


def main(folder, config, n_kills, seed):
    """Kill processes that train the run, at least until they have left three checkpoints."""
    run = Run.create(folder, read_spec(config))
    generator = random.Random(seed)
    began = time.perf_counter()
    most_seconds = 0.02  # of a process; grows while processes are killed before a checkpoint
    n_killed, saved_steps = 0, [0]
    while n_killed < n_kills or len(set(saved_steps)) < 1 + 3:  # 0 is no checkpoint
        child = os.fork()
        if child == 0:
            code = 1
            try:
                run.train()
                code = 0
            finally:
                os._exit(code)  # without what the parent does at its exit
        time.sleep(generator.uniform(0.0, most_seconds))
        os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
        if os.WIFEXITED(status):
            assert os.WEXITSTATUS(status) == 0, "a resumed run failed"
            break  # the run ended before it was killed
        n_killed += 1
        saved_steps.append(steps_of_checkpoint(run))
        if saved_steps[-1] == saved_steps[-2]:
            most_seconds *= 1.3
        assert time.perf_counter() - began < 120.0
    run.train()
    print(n_killed, *saved_steps)


if __name__ == "__main__":
    folder, config, n_kills, seed = sys.argv[1:]
    main(Path(folder), Path(config), int(n_kills), int(seed))
