"""Large samples: time and R2 of networks and kernels beside boosting, on one thread.

    OMP_NUM_THREADS=1 python bench/estimators/large.py [--seeds 3] [--only WORD] [--redraw]

Measures what the store lacks, and writes the tables of problems.md in docs/evidence. The models
of a sample take turns, so that their ratios hold on a busy machine. Needs catboost and lightgbm.
"""

from __future__ import annotations

import os
import sys
import time
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from catboost import CatBoostRegressor
from lightgbm import LGBMRegressor
from measured import measure_missing, measured, options
from page import markdown, show
from problems import QUIET_CATBOOST
from sklearn.datasets import make_friedman1
from sklearn.ensemble import HistGradientBoostingRegressor
from sklearn.linear_model import LinearRegression

from sdnn import SDNNKernelRidge, SDNNRegressor

KIND = "large samples"
SIZES = (1_000, 3_000, 10_000, 30_000, 100_000)
N_TEST = 10_000
N_QUERIES = 5_000
MOST_TURNS = 3
LONG_FIT_S = 2.0  # fits from this time on are not repeated
DECAY = 0.75

MODELS = {
    "SDNN": lambda seed: SDNNRegressor(random_state=seed),
    "SDNN kernel ridge": lambda seed: SDNNKernelRidge(random_state=seed),
    "gradient boosting": lambda seed: HistGradientBoostingRegressor(random_state=seed),
    "LightGBM": lambda seed: LGBMRegressor(random_state=seed, n_jobs=1, verbose=-1),
    "CatBoost": lambda seed: CatBoostRegressor(random_state=seed, **QUIET_CATBOOST),
    "linear": lambda seed: LinearRegression(),
}
SLOW = ("SDNN kernel ridge", "CatBoost")
"""Models of the first seed only."""


def friedman(random, n):
    """Draw Friedman's first problem: five of ten inputs are irrelevant."""
    return make_friedman1(n, n_features=10, noise=1.0, random_state=random)


def ten_inputs(random, n):
    """Draw waves of ten inputs and products of neighbours, each 3/4 as high as the last."""
    X = random.uniform(size=(n, 10))
    y = 0.15 * random.normal(size=n)
    for k in range(10):
        wave = np.sin((2 + k % 3) * X[:, k]) + 0.5 * X[:, k] * X[:, (k + 1) % 10]
        y += DECAY**k * wave
    return X, y


PROBLEMS = {"Friedman 1": friedman, "ten inputs": ten_inputs}


def seconds(call, n=1):
    """Return the processor time of a call, a mean of n."""
    begun = time.process_time()
    for _ in range(n):
        call()
    return (time.process_time() - begun) / n


def measure(problem, n_rows, seed):
    """Return for each model its R2, seconds to fit, and microseconds of one row and of many."""
    X, y = PROBLEMS[problem](np.random.RandomState(seed), n_rows + N_TEST)
    X, X_test, y, y_test = X[:n_rows], X[n_rows:], y[:n_rows], y[n_rows:]
    models = {name: make for name, make in MODELS.items() if seed == 0 or name not in SLOW}
    fits, fitted = {name: [] for name in models}, {}
    for _ in range(MOST_TURNS):
        for name, make in models.items():
            if not fits[name] or min(fits[name]) < LONG_FIT_S:
                fitted[name] = make(seed)
                fits[name].append(seconds(lambda name=name: fitted[name].fit(X, y)))
    single, many = ({name: [] for name in models} for _ in range(2))
    queries = X_test[:N_QUERIES]
    for turn in range(MOST_TURNS):
        for name, model in fitted.items():
            row = queries[turn : turn + 1]
            single[name].append(seconds(lambda m=model, row=row: m.predict(row), n=50))
            many[name].append(seconds(lambda m=model: m.predict(queries)) / len(queries))
    return {
        name: {
            "r2": round(float(model.score(X_test, y_test)), 5),
            "fit_s": float(f"{np.median(fits[name]):.4g}"),
            "one_us": float(f"{1e6 * np.median(single[name]):.4g}"),
            "many_us": float(f"{1e6 * np.median(many[name]):.4g}"),
        }
        for name, model in fitted.items()
    }


def keys(n_seeds):
    return [
        (problem, n_rows, seed)
        for seed in range(n_seeds)
        for n_rows in SIZES
        for problem in PROBLEMS
    ]


def middles(results, problem, model, what, to=None):
    """Return medians over seeds of a measure for each size, or of its ratio to another model's."""
    rows = [[r for (p, n, _), r in results.items() if (p, n) == (problem, size)] for size in SIZES]
    return np.array(
        [
            np.median([r[model][what] / (r[to][what] if to else 1) for r in of_size if model in r])
            for of_size in rows
        ]
    )


def fit_table(results, problem):
    """Return R2, fitting times over gradient boosting's, and their exponent from 10,000 rows on."""
    sizes = [f"{size:,}" for size in SIZES]
    header = ("model", *(f"R2, {n}" for n in sizes), *(f"fit, {n}" for n in sizes), "exponent")
    rows = []
    for model in MODELS:
        fit_s = middles(results, problem, model, "fit_s")
        exponent = np.log(fit_s[-1] / fit_s[2]) / np.log(SIZES[-1] / SIZES[2])
        r2 = [f"{x:.3f}" for x in middles(results, problem, model, "r2")]
        ratios = middles(results, problem, model, "fit_s", "gradient boosting")
        texts = [f"{x:.2g}" if x < 10 else f"{x:.0f}" for x in ratios]
        rows.append((model, *r2, *texts, f"{exponent:.1f}"))
    return markdown(header, rows)


def prediction_table(results):
    """Return ratios of prediction times: one row to linear regression's, many to LightGBM's."""
    header = ["model"]
    for problem in PROBLEMS:
        for what in ("one row", "many"):
            header += [f"{problem}, {what}, {SIZES[k]:,}" for k in (0, -1)]
    rows = []
    for model in MODELS:
        row = [model]
        for problem in PROBLEMS:
            for what, to in (("one_us", "linear"), ("many_us", "LightGBM")):
                ratios = middles(results, problem, model, what, to)
                row += [f"{ratios[k]:.2g}" for k in (0, -1)]
        rows.append(tuple(row))
    return markdown(header, rows)


def main():
    if os.environ.get("OMP_NUM_THREADS") != "1":
        raise SystemExit("OMP_NUM_THREADS must be 1, as models are compared on one thread")
    arguments = options(__doc__, seeds=3).parse_args()
    measure_missing(KIND, measure, keys(arguments.seeds), arguments, apart=True)
    if arguments.only:
        return
    results = measured(KIND, arguments.folder)
    tables = {f"large samples, {name}": fit_table(results, name) for name in PROBLEMS}
    tables["prediction of large samples"] = prediction_table(results)
    show(tables, arguments.folder / "problems.md")


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    main()
