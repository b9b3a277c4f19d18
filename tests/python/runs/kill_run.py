"""Kills a run again and again by SIGKILL at random instants, then lets it end.

Usage: kill_run.py FOLDER CONFIG KILLS SEED. Prints how many processes were killed, and at which
steps they left a checkpoint. Processes are forked, so that instants are spread over the training.
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


def steps_done(run):
    try:
        env, evaluation_env = (run.spec.environment.make() for _ in range(2))
        path = run.folder / "checkpoint.safetensors"
        return Training.load(path, env, evaluation_env=evaluation_env).n_steps
    except FileNotFoundError:
        return 0


def main(folder, config, n_kills, seed):
    run = Run.create(folder, read_spec(config))
    chance = random.Random(seed)
    began = time.perf_counter()
    longest = 0.02  # seconds that a process has, at most; more where that is too little
    killed, left = 0, [0]
    while killed < n_kills or len(set(left)) < 4:
        child = os.fork()
        if child == 0:
            code = 1
            try:
                run.train()
                code = 0
            finally:
                os._exit(code)
        time.sleep(chance.uniform(0.0, longest))
        os.kill(child, signal.SIGKILL)
        _, status = os.waitpid(child, 0)
        if os.WIFEXITED(status):
            assert os.WEXITSTATUS(status) == 0, "a resumed run failed"
            break
        killed += 1
        left.append(steps_done(run))
        if left[-1] == left[-2]:
            longest *= 1.3
        assert time.perf_counter() - began < 120.0
    run.train()
    print(killed, *left)


if __name__ == "__main__":
    folder, config, n_kills, seed = sys.argv[1:]
    main(Path(folder), Path(config), int(n_kills), int(seed))
