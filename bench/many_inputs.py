"""The time of a step, and the memory, of the default agent with many inputs.

    python bench/many_inputs.py [--inputs 4 32 100 ...]

CartPole with inputs that carry no information, or with noisy copies of its inputs, each number of
inputs in a separate process. Trainings and the environment alone take turns, as in
training_steps.py. "MB" is the growth of the resident memory from before the agent was made until it
has learned.
"""

from __future__ import annotations

import argparse
import gc
import itertools
import multiprocessing
import os
import sys
from pathlib import Path
from typing import Any

import gymnasium as gym
import numpy as np
from page import markdown
from training_steps import PERCENT, slices, stepping, training

from sdnn.agents import SDNNQLambda

sys.path.insert(0, str(Path(__file__).parent / "other_tasks"))
from sensors import RANGES, Sensors

HEADER = (
    "inputs",
    "the others",
    "training, us",
    "environment, us",
    "beside, us",
    "of the first",
    "MB",
)
TASK = "CartPole-v1"
TASK_INPUTS = 4
LEARNED = 5_000


def resident_mb() -> float:
    """Return the resident memory of this process, in MB (Linux)."""
    gc.collect()
    pages = int(Path("/proc/self/statm").read_text().split()[1])
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def make(n_inputs: int, others: str) -> Any:
    """Make the task with a number of inputs, with copies a multiple of `TASK_INPUTS`."""
    env, n_others = gym.make(TASK), n_inputs - TASK_INPUTS
    if others == "irrelevant":
        return Sensors(env, irrelevant=n_others, ends=RANGES[TASK])
    return Sensors(env, copies=n_others // TASK_INPUTS, noise=0.05, ends=RANGES[TASK])


def measure(n_inputs: int, others: str, repeats: int) -> tuple[float, float, float]:
    """Return the microseconds of a step of training and of the environment, and the agent's MB."""
    alone = slices(stepping(make(n_inputs, others), 1))
    for _ in range(20):
        alone()
    before = resident_mb()
    env = make(n_inputs, others)
    agent = SDNNQLambda(env.observation_space, env.action_space, seed=1)
    agent.train(env, steps=LEARNED)
    megabytes = resident_mb() - before
    trained = slices(training(agent, make(n_inputs, others)))
    times = [(trained(), alone()) for _ in range(repeats)]
    us, us_alone = np.percentile(times, PERCENT, axis=0)
    return float(us), float(us_alone), megabytes


def main() -> None:
    """Print a table."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--inputs", nargs="+", type=int, default=[4, 16, 32, 100])
    parser.add_argument("--repeats", type=int, default=200)
    options = parser.parse_args()
    with multiprocessing.get_context("spawn").Pool(1, maxtasksperchild=1) as pool:
        sizes = list(itertools.product(("irrelevant", "copies"), options.inputs))
        calls = [(n_inputs, others, options.repeats) for others, n_inputs in sizes]
        results = pool.starmap(measure, calls, chunksize=1)
    first = results[0][0] - results[0][1]
    rows = [
        (
            str(n_inputs),
            others,
            *(f"{us:.1f}" for us in (trained, alone, trained - alone)),
            f"{(trained - alone) / first:.1f}",
            f"{megabytes:.1f}",
        )
        for (others, n_inputs), (trained, alone, megabytes) in zip(sizes, results, strict=True)
    ]
    print(markdown(HEADER, rows))


if __name__ == "__main__":
    main()
