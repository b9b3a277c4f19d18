"""The demonstration problem of the SDNN papers: target, training sample, test lattice."""

from __future__ import annotations

import numpy as np

N_TRAINING = 2000
BLANKS = ((0.4, 0.6, 0.4, 0.6), (0.2, 0.8, 0.1, 0.3), (0.1, 0.2, 0.3, 0.7), (0.8, 0.9, 0.3, 0.7))
"""Rectangles without training samples: x from, x to, y from, y to, ends included."""


def target(points):
    """Return 1 inside a disc, else (1 + x) / 2 * sin^2(6 pi sqrt(x) y^2)."""
    x, y = points.T
    waves = (1 + x) / 2 * np.sin(6 * np.pi * np.sqrt(x) * y**2) ** 2
    return np.where((x - 0.5) ** 2 + (y - 0.5) ** 2 <= 0.04 + 1e-12, 1.0, waves)


def in_blank(points):
    x, y = points.T
    near = 1e-9
    inside = [
        (x >= a - near) & (x <= b + near) & (y >= c - near) & (y <= d + near)
        for a, b, c, d in BLANKS
    ]
    return np.any(inside, axis=0)


def training_points(n_samples, seed):
    """Draw multiples of 0.001, uniform outside the blanks."""
    random = np.random.RandomState(seed)
    points = random.randint(0, 1001, (4 * n_samples, 2)) / 1000
    return points[~in_blank(points)][:n_samples]


def lattice():
    """Return all 1001 x 1001 test points; x changes slowest."""
    ticks = np.arange(1001) / 1000
    return np.stack(np.meshgrid(ticks, ticks, indexing="ij"), axis=-1).reshape(-1, 2)


def errors(points, predicted):
    """Return the RMSE over all points, outside the blanks, and inside them."""
    squares, blank = (predicted - target(points)) ** 2, in_blank(points)
    return tuple(float(np.sqrt(part.mean())) for part in (squares, squares[~blank], squares[blank]))
