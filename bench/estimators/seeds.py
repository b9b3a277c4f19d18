"""The demonstration problem over many seeds, each with a training sample and a code of its own.

``python bench/estimators/seeds.py OUT.csv [N_SEEDS]``: LIBSDNN's setting and one with longer
codes, on one core; processor seconds, and RMSE on all lattice points, outside the blanks and inside
them.
"""

from __future__ import annotations

import csv
import sys
import time
from pathlib import Path

import numpy as np
from demonstration import N_TRAINING, errors, lattice, target, training_points

import sdnn
from sdnn import _core

LOW, STEP, N_UNITS, N_EPOCHS = -0.2, 0.005, 280, 300
FIELDS = (
    *("n_pattern_units", "seed", "training", "train_s", "predict_s", "all", "data", "blank"),
    "version",
)


def bins(points):
    """Points are multiples of 0.001."""
    return np.rint(1000 * points).astype(np.int32)


def run(n_pattern_units, seed):
    """Train and predict once; returns the row."""
    points = training_points(N_TRAINING, seed)
    n_flipped = round(5 * n_pattern_units / 2000)  # r / n as in LIBSDNN's setting
    tables = [
        _core.random_inverse_patterns(n_pattern_units, 1001, n_flipped, 4 * seed + k)
        for k in range(4)
    ]
    code = _core.SelectiveDesensitization(tables[:2], tables[2:], np.array([[0, 1], [1, 0]]))
    layer = _core.ParallelPerceptron(code, N_UNITS, seed=seed)
    counts = (target(points)[:, None] - LOW) / STEP
    start = time.process_time()
    trainer = _core.PDeltaTrainer(layer, bins(points), counts)
    for _ in range(N_EPOCHS):
        trainer.present(np.arange(N_TRAINING))
    trainer.synchronize()
    trained = time.process_time()
    predicted = STEP * layer.counts(bins(lattice()))[:, 0] + LOW
    done = time.process_time()
    wrong = [round(error, 5) for error in errors(lattice(), predicted)]
    times = round(trained - start, 3), round(done - trained, 3)
    return n_pattern_units, seed, trainer.form, *times, *wrong, sdnn.__version__


if __name__ == "__main__":
    n_seeds = int(sys.argv[2]) if len(sys.argv) > 2 else 20
    with Path(sys.argv[1]).open("w", newline="") as file:
        writer = csv.writer(file, lineterminator="\n")
        writer.writerow(FIELDS)
        for n_pattern_units in (2000, 8000):
            rows = [run(n_pattern_units, seed) for seed in range(1, n_seeds + 1)]
            writer.writerows(rows)
            mean = np.mean([row[5:8] for row in rows], axis=0)
            deviation = np.std([row[5:8] for row in rows], axis=0, ddof=1)
            for name, one, other in zip(("all", "data", "blank"), mean, deviation, strict=True):
                print(f"n = {n_pattern_units}: RMSE {name} {one:.4f} +- {other:.4f}")
            seconds = np.median([row[3:5] for row in rows], axis=0)
            print(f"n = {n_pattern_units}: {seconds[0]:.2f} s training, {seconds[1]:.2f} s lattice")
