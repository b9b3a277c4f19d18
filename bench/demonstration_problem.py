"""Times and errors of the demonstration problem: python bench/demonstration_problem.py.

Trains by LIBSDNN's rule and setting (or with longer codes) on one core and predicts all lattice
points. CPU seconds; a row per setting, written as CSV.
"""

from __future__ import annotations

import argparse
import csv
import sys
import time

import numpy as np

from sdnn import _core

BLANKS = ((400, 600, 400, 600), (200, 800, 100, 300), (100, 200, 300, 700), (800, 900, 300, 700))
LOW, STEP, N_UNITS = -0.2, 0.005, 280


def target(points):
    """The function to learn; points are multiples of 0.001 as whole numbers."""
    x, y = points[:, 0] / 1000, points[:, 1] / 1000
    wave = (1 + x) / 2 * np.sin(6 * np.pi * np.sqrt(x) * y**2) ** 2
    inside = (points[:, 0] - 500) ** 2 + (points[:, 1] - 500) ** 2 <= 200**2
    return np.where(inside, 1.0, wave)


def in_blank(points):
    """Whether each point lies in one of the four blank rectangles."""
    x, y = points.T
    return np.any([(a <= x) & (x <= b) & (c <= y) & (y <= d) for a, b, c, d in BLANKS], axis=0)


def sample(n_samples, random):
    """Lattice points drawn uniformly outside the blanks."""
    points = random.integers(0, 1001, (4 * n_samples, 2))
    return points[~in_blank(points)][:n_samples]


def run(n_pattern_units, n_samples, n_epochs, seed):
    """Train and predict once; returns a row of times and errors."""
    random = np.random.default_rng(seed)
    points = sample(n_samples, random)
    n_flipped = round(n_pattern_units / 400)  # r / n as in LIBSDNN's setting
    tables = [
        _core.random_inverse_patterns(n_pattern_units, 1001, n_flipped, 4 * seed + k)
        for k in range(4)
    ]
    code = _core.SelectiveDesensitization(tables[:2], tables[2:], np.array([[0, 1], [1, 0]]))
    start = time.process_time()
    layer = _core.PerceptronLayer(code, N_UNITS, seed=seed)
    counts = (target(points)[:, None] - LOW) / STEP
    trainer = _core.PDeltaTrainer(layer, points, counts, memory_limit=2**34)
    order = np.arange(n_samples)
    for _ in range(n_epochs):
        trainer.epoch(order)
    trainer.synchronize()
    trained = time.process_time()
    lattice = np.stack(np.meshgrid(np.arange(1001), np.arange(1001), indexing="ij"), axis=-1)
    lattice = lattice.reshape(-1, 2)
    predicted = STEP * layer.counts(lattice)[:, 0] + LOW
    done = time.process_time()
    squares = (predicted - target(lattice)) ** 2
    blank = in_blank(lattice)
    return {
        "n_pattern_units": n_pattern_units,
        "n_samples": n_samples,
        "n_epochs": n_epochs,
        "seed": seed,
        "form": trainer.form,
        "train_s": round(trained - start, 3),
        "predict_s": round(done - trained, 3),
        "rmse_all": round(float(np.sqrt(squares.mean())), 5),
        "rmse_data": round(float(np.sqrt(squares[~blank].mean())), 5),
        "rmse_blank": round(float(np.sqrt(squares[blank].mean())), 5),
    }


def main():
    """Write the rows of all seeds to the standard output."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--pattern-units", type=int, default=2000)
    parser.add_argument("--samples", type=int, default=2000)
    parser.add_argument("--epochs", type=int, default=300)
    parser.add_argument("--seeds", type=int, default=1)
    arguments = parser.parse_args()
    writer = None
    for seed in range(1, arguments.seeds + 1):
        row = run(arguments.pattern_units, arguments.samples, arguments.epochs, seed)
        if writer is None:
            writer = csv.DictWriter(sys.stdout, row, lineterminator="\n")
            writer.writeheader()
        writer.writerow(row)
        sys.stdout.flush()


if __name__ == "__main__":
    main()
