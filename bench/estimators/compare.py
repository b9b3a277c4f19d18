"""Measures the rows behind docs/regression.md.

``python bench/estimators/compare.py demonstration|useless|real OUT.csv [N_SEEDS]``; rows are
appended as they are measured, and a row that is there is not measured again.
"""

from __future__ import annotations

import csv
import sys
import time
import warnings
from pathlib import Path

import numpy as np
from demonstration import errors, lattice, target, training_points
from rivals import classifiers, regressors, tuned
from sklearn.datasets import load_breast_cancer, load_diabetes
from sklearn.exceptions import ConvergenceWarning
from sklearn.model_selection import RepeatedKFold, RepeatedStratifiedKFold

import sdnn
from sdnn import SDNNRegressor
from sdnn.coding import RandomInverse

ONCE = {"kernel ridge, analytic SDNN kernel", "SVR (RBF)", "Gaussian process (Matern 3/2)"}
"""Systems without randomness: the demonstration's sample is one and the same."""


class Rows:
    """A CSV file that remembers what has been measured."""

    def __init__(self, path, keys, values):
        self.path, self.keys = Path(path), keys
        self.fields = [*keys, *values, "version"]
        self.known = set()
        if self.path.exists():
            with self.path.open(newline="") as file:
                for row in csv.DictReader(file):
                    self.known.add(tuple(row[key] for key in keys))
        else:
            with self.path.open("w", newline="") as file:
                csv.writer(file).writerow(self.fields)

    def has(self, *key):
        return tuple(map(str, key)) in self.known

    def add(self, *row):
        with self.path.open("a", newline="") as file:
            csv.writer(file).writerow([*row, sdnn.__version__])
        print(*row, flush=True)


def ours(n_units, max_iter, seed):
    """LIBSDNN's setting, and longer codes with the same share of flips."""
    coding = RandomInverse(n_bins=1001, n_flipped=round(5 * n_units / 2000), low=0.0, high=1.0)
    return SDNNRegressor(
        coding,
        n_pattern_units=n_units,
        tables="separate",
        output_range=(-0.2, 1.2),
        max_iter=max_iter,
        shuffle=False,
        random_state=seed,
    )


def chosen(model):
    return str(getattr(model, "best_params_", "")).replace("\n", " ")


def demonstration(path, n_seeds):
    """One training sample, the full lattice."""
    rows = Rows(path, ("system", "seed"), ("all", "data", "blank", "chosen"))
    points = lattice()
    X = training_points(2000, seed=0)
    y = target(X)
    for seed in range(n_seeds):
        fixed = {
            "SDNN, n = 2000, 300 epochs (LIBSDNN's setting)": ours(2000, 300, seed),
            "SDNN, n = 8000, 300 epochs": ours(8000, 300, seed),
        }
        candidates = {
            **fixed,
            **{
                name: tuned(*candidate)
                for name, candidate in regressors(2, noisy=False, seed=seed).items()
                if name not in ("SDNN (ours)", "linear ridge")
            },
        }
        for name, model in candidates.items():
            if rows.has(name, seed) or (seed > 0 and name in ONCE) or (seed > 0 and "MLP" in name):
                continue
            model.fit(X, y)
            predicted = np.concatenate(
                [
                    model.predict(part)
                    for part in np.array_split(points, 1 if "SDNN," in name else 50)
                ]
            )
            wrong = (round(value, 5) for value in errors(points, predicted))
            rows.add(name, seed, *wrong, chosen(model))


def useless(path, n_seeds):
    """The demonstration problem with inputs that say nothing; a new sample per seed."""
    rows = Rows(path, ("system", "n_useless", "seed"), ("train", "rmse", "chosen"))
    names = (
        "SDNN (ours)",
        "SVR (RBF)",
        "Gaussian process (Matern 3/2)",
        "gradient boosting",
        "MLP 256-256",
    )
    for seed in range(n_seeds):
        random = np.random.RandomState(1000 + seed)
        train, test = training_points(1000, seed), training_points(4000, 500 + seed)
        noise, test_noise = random.uniform(size=(1000, 8)), random.uniform(size=(4000, 8))
        for n_useless in (0, 2, 4, 8):
            X = np.hstack([train, noise[:, :n_useless]])
            Z = np.hstack([test, test_noise[:, :n_useless]])
            candidates = regressors(2 + n_useless, noisy=False, seed=seed)
            for name in names:
                if rows.has(name, n_useless, seed):
                    continue
                start = time.process_time()
                model = tuned(*candidates[name]).fit(X, target(train))
                spent = time.process_time() - start
                rmse = float(np.sqrt(np.mean((model.predict(Z) - target(test)) ** 2)))
                rows.add(name, n_useless, seed, round(spent, 2), round(rmse, 5), chosen(model))


def real(path, n_repeats):
    """Two data sets of scikit-learn, nested cross-validation: 5 folds outside, 3 inside."""
    rows = Rows(path, ("data", "system", "repeat", "fold"), ("train", "score", "chosen"))
    tasks = (
        ("diabetes (R2)", load_diabetes, RepeatedKFold),
        ("breast cancer (accuracy)", load_breast_cancer, RepeatedStratifiedKFold),
    )
    for data, loader, splitter in tasks:
        X, y = loader(return_X_y=True)
        outer = splitter(n_splits=5, n_repeats=n_repeats, random_state=0)
        for number, (train, test) in enumerate(outer.split(X, y)):
            repeat, fold = divmod(number, 5)
            candidates = (
                regressors(X.shape[1], noisy=True, seed=repeat)
                if "R2" in data
                else classifiers(seed=repeat)
            )
            for name, candidate in candidates.items():
                if rows.has(data, name, repeat, fold):
                    continue
                start = time.process_time()
                model = tuned(*candidate).fit(X[train], y[train])
                spent = time.process_time() - start
                score = round(float(model.score(X[test], y[test])), 5)
                rows.add(data, name, repeat, fold, round(spent, 2), score, chosen(model))


if __name__ == "__main__":
    warnings.simplefilter("ignore", ConvergenceWarning)
    what, out, *count = sys.argv[1:]
    measure = {"demonstration": demonstration, "useless": useless, "real": real}[what]
    measure(out, int(count[0]) if count else {"demonstration": 5, "useless": 3, "real": 2}[what])
