"""Regressors for small processors: R2 beside default settings, and bits that differ in C.

    python bench/estimators/on_a_chip.py

Prints the figures of docs/how-to/estimators-on-a-chip.md; needs gcc and sdnn[river]. Bits are those
of 10,000 predictions and of the weights after 5,000 samples that were learned in C.
"""

from __future__ import annotations

import sys
import tempfile
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2] / "tests" / "python" / "reference"))

import numpy as np
from river.datasets import TrumpApproval
from sklearn.datasets import load_breast_cancer
from sklearn.model_selection import KFold, cross_val_score

from c_estimators import LEARN, PREDICT, compiled
from c_policies import TARGETS, run
from sdnn import SDNNRegressor
from sdnn.export import export_estimator_header, small_settings

N_INPUTS, N_SAMPLES, N_SEEDS = 4, 2000, 3
N_PREDICTED, N_LEARNED = 10_000, 5000


def friedman(random):
    """Draw Friedman's first problem without its fifth input, with its noise."""
    X = random.uniform(size=(N_SAMPLES, 4))
    y = 10 * np.sin(np.pi * X[:, 0] * X[:, 1]) + 20 * (X[:, 2] - 0.5) ** 2 + 10 * X[:, 3]
    return X, y + random.normal(size=N_SAMPLES)


def compactness(_):
    """Return the mean compactness of cells, from radius, texture, smoothness and concavity."""
    data = load_breast_cancer().data
    return data[:, [0, 1, 4, 6]], data[:, 5]


def approval(_):
    """Return the approval of a president by all polls, from those of four pollsters."""
    rows = list(TrumpApproval())
    names = sorted(rows[0][0])[1:5]
    return np.array([[x[name] for name in names] for x, _ in rows]), np.array([y for _, y in rows])


def gas_sensor(random):
    """Draw a gas's share, and a sensor's voltage with temperature, humidity and age as inputs."""
    low, high = (0, -10, 0, 0), (1000, 50, 100, 1)
    gas, temperature, humidity, age = random.uniform(low, high, (N_SAMPLES, 4)).T
    voltage = (0.5 + 2.5 * np.sqrt(gas / 1000)) * (1 + 0.006 * (temperature - 20))
    voltage = voltage * (1 - 0.25 * age) + 0.002 * humidity
    return np.stack([voltage, temperature, humidity, age], axis=1), gas


def pendulum(random):
    """Draw the acceleration of a pendulum, from cosine and sine of its angle, speed and torque."""
    angle, speed, torque = random.uniform((-np.pi, -8, -2), (np.pi, 8, 2), (N_SAMPLES, 3)).T
    acceleration = 15 * np.sin(angle) + 3 * torque - 0.1 * speed * abs(speed)
    return np.stack([np.cos(angle), np.sin(angle), speed, torque], axis=1), acceleration


DATA = {
    "Friedman 1, four inputs": friedman,
    "breast cancer, compactness": compactness,
    "approval of a president, four pollsters": approval,
    "gas sensor, simulated": gas_sensor,
    "pendulum, acceleration": pendulum,
}


def score(settings, X, y):
    """Return the mean R2 over four folds and all seeds."""
    return np.mean([
        cross_val_score(
            SDNNRegressor(**settings, random_state=seed),
            X,
            y,
            cv=KFold(4, shuffle=True, random_state=seed),
        )
        for seed in range(N_SEEDS)
    ])  # fmt: skip


def written_in_c(model, source, rows, learning):
    """Return the bytes that a program with the model's header writes."""
    with tempfile.TemporaryDirectory() as temporary:
        export_estimator_header(model, Path(temporary) / "model.h", learning=learning)
        return run(*compiled(Path(temporary), source, TARGETS["x86-64"]), input=rows.tobytes())


def differing(X, y):
    """Return the numbers of predictions and of weights that have other bits in C."""
    random = np.random.default_rng(1)
    model = SDNNRegressor(**small_settings(N_INPUTS), random_state=0).fit(X, y)
    samples = random.uniform(X.min(axis=0), X.max(axis=0), (N_PREDICTED, N_INPUTS))
    written = np.frombuffer(written_in_c(model, PREDICT, samples, learning=False), np.int64)
    n_predictions = (written != model.predict(samples).view(np.int64)).sum()
    order = random.integers(0, len(X), N_LEARNED)
    written = written_in_c(model, LEARN, np.column_stack([X, y])[order], learning=True)
    for sample, target in zip(X[order], y[order], strict=True):
        model.learn_one(sample, target)
    weights = np.frombuffer(written[16 * N_LEARNED :], np.int16, model.weights_.size)
    return n_predictions, (weights != model.weights_.T.reshape(-1)).sum()


def main():
    print("| data set | default | small |\n|---|---|---|")
    bits = []
    for name, make in DATA.items():
        X, y = make(np.random.default_rng(0))
        r2 = [score(settings, X, y) for settings in ({}, small_settings(N_INPUTS))]
        print(f"| {name} | {r2[0]:.3f} | {r2[1]:.3f} |", flush=True)
        bits.append(differing(X, y))
    for title, counts in zip(("predictions", "weights"), zip(*bits, strict=True), strict=True):
        print(f"{title} that differ in C: {', '.join(map(str, counts))}")


if __name__ == "__main__":
    main()
