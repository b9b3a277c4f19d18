"""Times sdnn on what LIBSDNN is given: a parameter file and a training sample.

``python bench/estimators/against_libsdnn.py PARAMETERS.txt SAMPLE.csv ITERATIONS [RUNS]``. The
sample has a line per training point: the target, then the inputs. Times are processor seconds of
one thread for everything after the random choices; with two inputs, prediction is of the
1001 x 1001 lattice. LIBSDNN itself prints no times: call its ``Train`` and ``Estimate`` from a
program of your own.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from demonstration import lattice

from sdnn.libsdnn import read_parameter_file


def main(parameter_file, sample_file, n_iterations, n_runs):
    parameters = read_parameter_file(parameter_file)
    sample = np.loadtxt(sample_file, delimiter=",")
    order = np.arange(len(sample), dtype=np.int32)
    for _ in range(n_runs):
        layer = parameters.make_layer("libstdc++")
        start = time.process_time()
        trainer = parameters.make_trainer(layer, sample[:, 1:], sample[:, 0])
        for _ in range(n_iterations):
            trainer.present(order)
        trainer.synchronize()
        seconds = time.process_time() - start
        each = 1e6 * seconds / (n_iterations * len(sample))
        print(f"training ({trainer.form}): {seconds:.3f} s, {each:.2f} us a presentation", end="")
        if sample.shape[1] == 3:
            points = lattice()
            start = time.process_time()
            layer.counts(parameters.bins(points))
            seconds = time.process_time() - start
            each = 1e6 * seconds / len(points)
            print(f"; lattice: {seconds:.3f} s, {each:.2f} us a point", end="")
        print(flush=True)


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2], int(sys.argv[3]), int(sys.argv[4]) if len(sys.argv) > 4 else 3)
