"""Times of single samples, predicted and then learned, and how well: python online.py [N_SAMPLES].

Friedman's first function with ten inputs and noise; medians, and the quickest tenth.
"""

from __future__ import annotations

import sys
import time

import numpy as np
from sklearn.datasets import make_friedman1

from sdnn import SDNNRegressor
from sdnn.coding import RandomInverse


def main(n_samples):
    X, y = make_friedman1(n_samples, n_features=10, noise=1.0, random_state=1)
    for n_pattern_units in (None, 64, 32):
        model = SDNNRegressor(
            RandomInverse(low=0.0, high=1.0),
            output_range=(-2, 32),
            n_pattern_units=n_pattern_units,
            random_state=0,
        ).learn_one(X[0], y[0])
        times, errors = [], []
        for x, target in zip(X[1:], y[1:], strict=True):
            begin = time.perf_counter()
            guess = model.predict_one(x)
            between = time.perf_counter()
            model.learn_one(x, target)
            times.append((between - begin, time.perf_counter() - between))
            errors.append(guess - target)
        late = slice(n_samples // 2, None)
        score = 1 - np.mean(np.square(errors[late])) / np.var(y[late])
        predict, learn = 1e6 * np.quantile(times, (0.5, 0.1), axis=0).T
        print(
            f"{model.weights_.shape[1]} columns: predict_one {predict[0]:.0f} us "
            f"({predict[1]:.0f}), learn_one {learn[0]:.0f} us ({learn[1]:.0f}), "
            f"R2 of the second half {score:.3f}"
        )


if __name__ == "__main__":
    main(int(sys.argv[1]) if len(sys.argv) > 1 else 4000)
