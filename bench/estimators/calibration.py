"""Whether intervals contain the targets that they should, and what calibration does for classes.

    OMP_NUM_THREADS=1 python bench/estimators/calibration.py [--seeds 5] [--only WORD] [--redraw]

Measures what the store lacks, and writes tables of problems.md and streams.md in docs/evidence, and
a figure; --full prints every problem. Needs what problems.py, real.py and streams.py need.
"""

from __future__ import annotations

import sys
import time
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
import problems
import real
import real_data
import stream_data
from baselines import WithClasses
from catboost import CatBoostClassifier
from figures import interval_figure
from measured import grouped, measure_missing, options
from page import markdown, show
from real import calibration_error, make_model
from sklearn.datasets import make_classification
from sklearn.ensemble import HistGradientBoostingClassifier, HistGradientBoostingRegressor
from sklearn.metrics import log_loss
from sklearn.model_selection import KFold, StratifiedKFold
from streams import N_FIRST, ours

from sdnn import SDNNClassifier, SDNNKernelClassifier, SDNNKernelRidge, SDNNRegressor
from sdnn.reports.plots import png_bytes
from sdnn.support.files import write_whole

COVERAGE = 0.9
N_PARTS = 8
N_STREAM_SEEDS = 3
N_LARGE, N_LARGE_TEST = 100_000, 20_000


class QuantileBoosting:
    """Two gradient boostings of quantiles."""

    categorical_features = None  # which `make_model` looks for

    def __init__(self, seed):
        tail = (1 - COVERAGE) / 2
        self.models = [
            HistGradientBoostingRegressor(loss="quantile", quantile=q, random_state=seed)
            for q in (tail, 1 - tail)
        ]

    def set_params(self, **options):
        for model in self.models:
            model.set_params(**options)
        return self

    def fit(self, X, y):
        for model in self.models:
            model.fit(X, y)
        return self

    def predict_interval(self, X, coverage):
        return np.sort(np.stack([model.predict(X) for model in self.models], axis=1))


INTERVALS = {
    "SDNN kernel ridge": (lambda seed, n_inputs: SDNNKernelRidge(), {}),
    "SDNN kernel ridge, scaled": (lambda seed, n_inputs: SDNNKernelRidge(), {"scaled": True}),
    "SDNN, calibrate=True": (
        lambda seed, n_inputs: SDNNRegressor(calibrate=True, random_state=seed),
        {},
    ),
    "boosting of quantiles": (lambda seed, n_inputs: QuantileBoosting(seed), {}),
}
"""Models, and options of their `predict_interval`."""
REGRESSION = [*problems.REGRESSION, *real_data.REGRESSION]
STREAMS = {
    name: N_STREAM_SEEDS if name in stream_data.SYNTHETIC else 1 for name in stream_data.REGRESSION
}
"""Seeds of each stream."""
OURS = {
    "SDNN, calibrate=False": lambda seed: SDNNClassifier(calibrate=False, random_state=seed),
    "SDNN, calibrate=True": lambda seed: SDNNClassifier(calibrate=True, random_state=seed),
}
"""The default calibrates up to 10,000 samples."""
PROBABILITIES = {
    **OURS,
    "SDNN kernel ridge": lambda seed: SDNNKernelClassifier(random_state=seed),
    "gradient boosting": lambda seed: HistGradientBoostingClassifier(random_state=seed),
    "CatBoost": lambda seed: WithClasses(
        CatBoostClassifier(random_state=seed, **problems.QUIET_CATBOOST)
    ),
}
LARGE = "100,000 rows of 3 classes"
MEASURED = [p for p in real_data.CLASSIFICATION if (p, "CatBoost") not in real.LEFT_OUT]
"""Measured problems, where other models have rows from real.py."""


def fold_of(problem, splitter, fold):
    """Return measured inputs and targets to learn and to test, as real.py has them."""
    X, y = real_data.samples(problem)
    folds = splitter(real.N_FOLDS, shuffle=True, random_state=0).split(X, y)
    train, test = list(folds)[fold]
    return X.iloc[train], X.iloc[test], y[train], y[test]


def measure_intervals(problem, name, seed):
    """Return the share of targets inside; width and score in standard deviations of targets."""
    is_made = problem in problems.REGRESSION
    X, X_test, y, y_test = (
        problems.samples(problem, seed) if is_made else fold_of(problem, KFold, seed)
    )
    make, how = INTERVALS[name]
    model = make(seed, X.shape[1]) if is_made else make_model(make, X, seed)
    lower, upper = model.fit(X, y).predict_interval(X_test, COVERAGE, **how).T
    outside = np.maximum(lower - y_test, 0) + np.maximum(y_test - upper, 0)
    scale = np.std(y_test)
    results = {
        "coverage": np.mean((lower <= y_test) & (y_test <= upper)),
        "width": np.mean(upper - lower) / scale,
        "score": np.mean(upper - lower + 2 / (1 - COVERAGE) * outside) / scale,
    }
    return {what: round(float(value), 4) for what, value in results.items()}


def measure_stream(stream, seed):
    """Return the share of a stream's targets inside the intervals, of all and of each eighth."""
    model, inside = ours(seed), []
    for x, y in zip(*stream_data.samples(stream, seed), strict=True):
        bounds = model.predict_one(x, with_interval=True)
        inside.append(bounds.lower <= y <= bounds.upper)
        model.learn_one(x, y)
    inside = inside[N_FIRST:]
    parts = [round(float(np.mean(part)), 4) for part in np.array_split(inside, N_PARTS)]
    return {"coverage": round(float(np.mean(inside)), 4), "parts": parts}


def class_samples(problem, seed):
    if problem in problems.CLASSIFICATION:
        return problems.samples(problem, seed)
    if problem in MEASURED:
        return fold_of(problem, StratifiedKFold, seed)
    X, y = make_classification(
        N_LARGE + N_LARGE_TEST, n_features=10, n_informative=5, n_classes=3,
        n_clusters_per_class=2, random_state=seed,
    )  # fmt: skip
    return X[:N_LARGE], X[N_LARGE:], y[:N_LARGE], y[N_LARGE:]


def measure_probabilities(problem, name, seed):
    """Return accuracy, log loss, calibration error and processor seconds to fit."""
    X, X_test, y, y_test = class_samples(problem, seed)
    make = PROBABILITIES[name]
    if problem in MEASURED:
        model = make_model(lambda seed, n_inputs: make(seed), X, seed)
    else:
        model = make(seed)
    begun = time.process_time()
    model.fit(X, y)
    spent = time.process_time() - begun
    p = model.predict_proba(X_test)
    is_right = model.classes_[p.argmax(axis=1)] == y_test
    results = {
        "accuracy": np.mean(is_right),
        "log_loss": log_loss(y_test, p, labels=model.classes_),
        "calibration": calibration_error(p.max(axis=1), is_right),
    }
    return {what: round(float(value), 5) for what, value in results.items()} | {
        "fit_s": round(spent, 3)
    }


def mean(rows, what):
    if not rows:
        raise SystemExit("rows are missing: run this without --redraw, and problems.py and real.py")
    return float(np.mean([row[what] for row in rows]))


def interval_table(results):
    """Return mean, range and number near 0.9 of coverage; mean width and score."""
    rows = []
    for name in INTERVALS:
        covered = np.array([mean(results[problem, name], "coverage") for problem in REGRESSION])
        near = int(np.sum(np.abs(covered - COVERAGE) <= 0.02 + 1e-9))
        middles = [
            f"{np.mean([mean(results[p, name], what) for p in REGRESSION]):.2f}"
            for what in ("width", "score")
        ]
        rows.append((name, f"{covered.mean():.3f}", f"{covered.min():.3f}", f"{covered.max():.3f}",
                     f"{near}", *middles))  # fmt: skip
    header = ("intervals of 0.9", "coverage", "least", "largest")
    return markdown((*header, f"within .02, of {len(REGRESSION)}", "width", "score"), rows)


def all_intervals(results):
    """Return the coverage of each problem."""
    rows = [
        (p, *(f"{mean(results[p, name], 'coverage'):.3f}" for name in INTERVALS))
        for p in REGRESSION
    ]
    return markdown(("problem", *INTERVALS), rows)


def stream_table(results):
    """Return the coverage of each stream, and of its worst eighth."""
    rows, covered = [], []
    for stream in STREAMS:
        of_seeds = results[stream,]
        covered.append(mean(of_seeds, "coverage"))
        worst = min(min(row["parts"]) for row in of_seeds)
        rows.append((stream, str(len(of_seeds)), f"{covered[-1]:.3f}", f"{worst:.2f}"))
    worst = min(float(row[-1]) for row in rows)
    rows.append(("all", "", f"{np.mean(covered):.3f}", f"{worst:.2f}"))
    return markdown(("intervals of 0.9", "seeds", "coverage", "worst eighth"), rows)


def probability_table(results, of_real):
    """Return means of log loss and calibration error over problems, and those of the large one."""
    rows = []
    for name in PROBABILITIES:
        made = [results[problem, name] for problem in problems.CLASSIFICATION]
        source = results if name in OURS else of_real
        folds = [source[problem, name] for problem in MEASURED]
        texts = [
            f"{np.mean([mean(rows, what) for rows in group]):.3f}"
            for group in (folds, made)
            for what in ("log_loss", "calibration")
        ]
        large = results[LARGE, name]
        texts += [f"{mean(large, what):.3f}" for what in ("accuracy", "log_loss", "calibration")]
        rows.append((name, *texts, f"{mean(large, 'fit_s'):.2g}"))
    groups = (f"{len(MEASURED)} measured", f"{len(problems.CLASSIFICATION)} made", "100,000 rows")
    columns = [f"{what}, {group}" for group in groups for what in ("log loss", "ECE")]
    columns.insert(4, "accuracy, 100,000 rows")
    return markdown(("model", *columns, "fit, s, 100,000 rows"), rows)


def main():
    arguments = options(__doc__, seeds=5).parse_args()
    seeds = range(min(arguments.seeds, real.N_FOLDS))  # of measured problems the folds
    pairs = [(problem, name) for problem in REGRESSION for name in INTERVALS]
    measure_missing(
        "intervals", measure_intervals, [(*pair, s) for s in seeds for pair in pairs], arguments
    )
    streams = [(stream, s) for stream, n in STREAMS.items() for s in range(n)]
    measure_missing("stream intervals", measure_stream, streams, arguments)
    probability_keys = [
        *((problem, name, s) for s in seeds for problem in problems.CLASSIFICATION
          for name in PROBABILITIES),
        *((problem, name, fold) for fold in range(real.N_FOLDS) for problem in MEASURED
          for name in OURS),
        *((LARGE, name, 0) for name in PROBABILITIES),
    ]  # fmt: skip
    measure_missing("probabilities", measure_probabilities, probability_keys, arguments)
    if arguments.only:
        return
    folder = arguments.folder
    intervals, classes = grouped("intervals", folder), grouped("probabilities", folder)
    if arguments.full:
        print(all_intervals(intervals))
    tables = {
        "intervals": interval_table(intervals),
        "probabilities": probability_table(classes, grouped(real.KIND, folder)),
    }
    show(tables, folder / "problems.md")
    show({"intervals": stream_table(grouped("stream intervals", folder))}, folder / "streams.md")
    write_whole(folder / "intervals.png", png_bytes(interval_figure(), dpi=140))


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    main()
