"""Estimators for small processors, fitted to five data sets of at most four inputs."""

import numpy as np
from sklearn.datasets import load_breast_cancer, load_iris, make_friedman1

from sdnn import SDNNClassifier, SDNNRegressor
from sdnn.export import small_settings


def _regressor(draw, target):
    """Return a regressor of a function of drawn samples, and the function that draws them."""
    X = draw(1000, 0)
    model = SDNNRegressor(**small_settings(X.shape[1]), random_state=0)
    return model.fit(X, target(X)), draw


def _classifier(data):
    """Return a classifier of the first four columns, and a function that draws noisy rows."""
    X, y = data.data[:, :4], data.target

    def draw(n_samples, seed):
        random = np.random.default_rng(seed)
        rows = X[random.integers(len(X), size=n_samples)]
        return rows + 0.1 * X.std(axis=0) * random.normal(size=rows.shape)

    settings = small_settings(4, n_classes=len(data.target_names))
    return SDNNClassifier(**settings, random_state=0).fit(X, y), draw


def friedman():
    """Return a regressor of Friedman's first problem without its fifth term, and a sampler."""

    def draw(n_samples, seed):
        return np.random.default_rng(seed).uniform(-0.1, 1.1, (n_samples, 4))

    X, y = make_friedman1(1000, 5, noise=1.0, random_state=3)
    model = SDNNRegressor(**small_settings(4), random_state=0)
    return model.fit(X[:, :4], y - 5 * X[:, 4]), draw


def gas():
    """Return a regressor of a gas's concentration by voltage, temperature and humidity."""

    def draw(n_samples, seed):
        return np.random.default_rng(seed).uniform([0.3, -10, 0], [4, 50, 100], (n_samples, 3))

    def target(X):
        voltage = (X[:, 0] - 0.002 * X[:, 2]) / (1 + 0.006 * (X[:, 1] - 20))
        return 160 * np.maximum(voltage - 0.5, 0) ** 2

    return _regressor(draw, target)


def pendulum():
    """Return a regressor of the acceleration of a pendulum with friction and a motor."""
    high = np.array([np.pi, 8, 2, 0.5])

    def draw(n_samples, seed):
        return np.random.default_rng(seed).uniform(-high, high, (n_samples, 4))

    def target(X):
        return 15 * np.sin(X[:, 0]) + 3 * X[:, 2] - (0.6 + X[:, 3]) * X[:, 1]

    return _regressor(draw, target)


SMALL_ESTIMATORS = {
    "friedman": friedman, "gas": gas, "pendulum": pendulum,
    "cancer": lambda: _classifier(load_breast_cancer()),
    "iris": lambda: _classifier(load_iris()),
}  # fmt: skip
