"""Problems that nobody tuned for: every estimator with default settings, on some twenty of them.

    python bench/estimators/problems.py [--seeds 10] [--only WORD] [--redraw] [--full]

Measures what the store lacks, draws problems.png and writes the table of problems.md, both in
docs/evidence; --full prints every problem.
Needs sdnn[river], whose measured data are in the package, catboost, lightgbm and xgboost.
"""

from __future__ import annotations

import sys
import time
import warnings
from functools import lru_cache
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from baselines import RecursiveFeatureMachine, WithClasses, gaussian_process, scaled
from catboost import CatBoostClassifier, CatBoostRegressor
from demonstration import target, training_points
from lightgbm import LGBMClassifier, LGBMRegressor
from matplotlib.figure import Figure
from measured import grouped, measure_missing, options
from page import markdown, show
from river import datasets
from sklearn.datasets import (
    load_breast_cancer,
    load_diabetes,
    load_digits,
    load_iris,
    load_wine,
    make_circles,
    make_classification,
    make_friedman1,
    make_friedman2,
    make_friedman3,
    make_moons,
)
from sklearn.ensemble import (
    HistGradientBoostingClassifier,
    HistGradientBoostingRegressor,
    RandomForestClassifier,
    RandomForestRegressor,
)
from sklearn.exceptions import ConvergenceWarning
from sklearn.linear_model import LogisticRegression, RidgeCV
from sklearn.model_selection import train_test_split
from sklearn.neighbors import KNeighborsClassifier, KNeighborsRegressor
from sklearn.neural_network import MLPClassifier, MLPRegressor
from sklearn.svm import SVC, SVR
from xgboost import XGBClassifier, XGBRegressor

from sdnn import SDNNClassifier, SDNNKernelClassifier, SDNNKernelRidge, SDNNRegressor
from sdnn.reports.plots import png_bytes
from sdnn.support.files import write_whole

KIND = "problems"
N_TRAINING = 500
N_TEST = 1000
MOST_MEASURED = 1500
"""Samples of measured data, drawn anew for each seed; three tenths of them are for the test."""


# Problems: inputs and targets of n samples, from a generator of random numbers.


def uniform(random, n, n_inputs):
    return random.uniform(-1, 1, (n, n_inputs))


def made(maker, **options):
    """Return a maker of scikit-learn, whose function may depend on the seed."""
    return lambda random, n: maker(n, random_state=random, **options)


def waves_and_disc(random, n):
    X = training_points(n, random.randint(2**31))
    return X, target(X)


def additive(random, n):
    X = uniform(random, n, 6)
    return X, np.sin(np.pi * X) @ [1, 1, 1, 0.5, 0.5, 0] + 0.3 * random.normal(size=n)


def product(random, n):
    X = uniform(random, n, 3)
    return X, X.prod(axis=1)


def ridge_wave(random, n):
    X = uniform(random, n, 4)
    return X, np.sin(3 * X @ [1, -1, 1, 0.5]) + 0.1 * random.normal(size=n)


def checkerboard(random, n):
    X = uniform(random, n, 5)
    return X, np.sign(X[:, 0] * X[:, 1]) + 0.1 * random.normal(size=n)


def sparse_plane(random, n):
    X = uniform(random, n, 20)
    return X, X[:, :5] @ [3, -2, 2, 1, 1] + random.normal(size=n)


def reach_of_arm(random, n):
    """Return how far the hand of a planar arm of three joints is from a point."""
    X = uniform(random, n, 5)
    angles = np.cumsum(np.pi * X[:, :3], axis=1)
    hand = np.stack([np.cos(angles).sum(axis=1), np.sin(angles).sum(axis=1)])
    return X, np.hypot(hand[0] - 1, hand[1])


def hour_and_place(random, n):
    """Return demand by hour and place as plain numbers; each of eight places has a peak hour."""
    hour, place = random.uniform(0, 24, n), random.randint(8, size=n)
    peak = np.array([8, 17, 12, 3, 21, 9, 15, 19])[place]
    y = np.cos(2 * np.pi * (hour - peak) / 24) + 0.2 * random.normal(size=n)
    return np.stack([hour, place, random.uniform(size=n)], axis=1), y


def parity(random, n):
    X = uniform(random, n, 3)
    return X, (X > 0).sum(axis=1) % 2


def exclusive_or(random, n):
    X = uniform(random, n, 20)
    return X, (X[:, 0] * X[:, 1] > 0).astype(int)


def rings(random, n):
    X = uniform(random, n, 4)
    return X, np.digitize(np.hypot(X[:, 0], X[:, 1]), [0.4, 0.7])


def of_data(loader):
    """Return measured data, at most `MOST_MEASURED` rows; the seed decides which are tested."""
    X, y = loader()

    def samples(random, n):
        kept = random.permutation(len(X))[:MOST_MEASURED]
        return X[kept], y[kept]

    samples.is_measured = True
    return samples


def of_scikit_learn(loader):
    return of_data(lambda: loader(return_X_y=True))


def of_river(dataset):
    def load():
        rows = [(list(x.values()), y) for x, y in dataset]
        return np.array([x for x, _ in rows], dtype=float), np.array([y for _, y in rows])

    return of_data(load)


REGRESSION = {
    "Friedman 1": made(make_friedman1, noise=1.0),
    "Friedman 2": made(make_friedman2, noise=125.0),
    "Friedman 3": made(make_friedman3, noise=0.1),
    "waves and disc": waves_and_disc,
    "sum of sines": additive,
    "product of three": product,
    "wave along a direction": ridge_wave,
    "checkerboard": checkerboard,
    "5 of 20 linear": sparse_plane,
    "reach of an arm": reach_of_arm,
    "hour and place": hour_and_place,
    "diabetes": of_scikit_learn(load_diabetes),
}
CLASSIFICATION = {
    "two moons": made(make_moons, noise=0.3),
    "two circles": made(make_circles, noise=0.15, factor=0.6),
    "rings of 2 in 4": rings,
    "parity of 3": parity,
    "XOR of 2 in 20": exclusive_or,
    "clusters of 3 classes": made(
        make_classification, n_features=10, n_informative=5, n_classes=3, n_clusters_per_class=2
    ),
    "iris": of_scikit_learn(load_iris),
    "wine": of_scikit_learn(load_wine),
    "breast cancer": of_scikit_learn(load_breast_cancer),
    "digits": of_scikit_learn(load_digits),
    "phishing": of_river(datasets.Phishing()),
    "image segments": of_river(datasets.ImageSegments()),
}
PROBLEMS = REGRESSION | CLASSIFICATION

# Models, each from a seed and the number of inputs, with the defaults of its library.


def short(n_inputs):
    """Return the units per pattern that make 4,000 columns, a quarter of the default's."""
    n_pairs = min(n_inputs * (n_inputs - 1), 500)
    return max(2, 4000 // n_pairs // 2 * 2)


QUIET_CATBOOST = {"thread_count": 1, "verbose": False, "allow_writing_files": False}

REGRESSORS = {
    "SDNN": lambda seed, n_inputs: SDNNRegressor(random_state=seed),
    "SDNN kernel ridge": lambda seed, n_inputs: SDNNKernelRidge(),
    "SDNN, last epoch": lambda seed, n_inputs: SDNNRegressor(
        n_averaged_epochs=1, random_state=seed
    ),
    "SDNN, 4,000 columns": lambda seed, n_inputs: SDNNRegressor(
        n_pattern_units=short(n_inputs), random_state=seed
    ),
    "SDNN, features selected": lambda seed, n_inputs: SDNNRegressor(
        pairs="auto", random_state=seed
    ),
    "gradient boosting": lambda seed, n_inputs: HistGradientBoostingRegressor(random_state=seed),
    "CatBoost": lambda seed, n_inputs: CatBoostRegressor(random_state=seed, **QUIET_CATBOOST),
    "LightGBM": lambda seed, n_inputs: LGBMRegressor(random_state=seed, n_jobs=1, verbose=-1),
    "XGBoost": lambda seed, n_inputs: XGBRegressor(random_state=seed, n_jobs=1),
    "random forest": lambda seed, n_inputs: RandomForestRegressor(random_state=seed),
    "xRFM": lambda seed, n_inputs: RecursiveFeatureMachine(seed=seed),
    "SVM": lambda seed, n_inputs: scaled(SVR()),
    "Gaussian process": lambda seed, n_inputs: gaussian_process(n_inputs, 0.1),
    "MLP": lambda seed, n_inputs: scaled(MLPRegressor(random_state=seed)),
    "neighbours": lambda seed, n_inputs: scaled(KNeighborsRegressor()),
    "linear": lambda seed, n_inputs: scaled(RidgeCV()),
}
CLASSIFIERS = {
    "SDNN": lambda seed, n_inputs: SDNNClassifier(random_state=seed),
    "SDNN kernel ridge": lambda seed, n_inputs: SDNNKernelClassifier(),
    "SDNN, 4,000 columns": lambda seed, n_inputs: SDNNClassifier(
        n_pattern_units=short(n_inputs), random_state=seed
    ),
    "SDNN, features selected": lambda seed, n_inputs: SDNNClassifier(
        pairs="auto", random_state=seed
    ),
    "gradient boosting": lambda seed, n_inputs: HistGradientBoostingClassifier(random_state=seed),
    "CatBoost": lambda seed, n_inputs: WithClasses(
        CatBoostClassifier(random_state=seed, **QUIET_CATBOOST)
    ),
    "LightGBM": lambda seed, n_inputs: LGBMClassifier(random_state=seed, n_jobs=1, verbose=-1),
    "XGBoost": lambda seed, n_inputs: WithClasses(XGBClassifier(random_state=seed, n_jobs=1)),
    "random forest": lambda seed, n_inputs: RandomForestClassifier(random_state=seed),
    "xRFM": lambda seed, n_inputs: RecursiveFeatureMachine(is_classifier=True, seed=seed),
    "SVM": lambda seed, n_inputs: scaled(SVC()),
    "MLP": lambda seed, n_inputs: scaled(MLPClassifier(random_state=seed)),
    "neighbours": lambda seed, n_inputs: scaled(KNeighborsClassifier()),
    "linear": lambda seed, n_inputs: scaled(LogisticRegression(max_iter=1000)),
}
VARIANTS = ("SDNN, last epoch", "SDNN, 4,000 columns", "SDNN, features selected")
"""Settings of a model that is there: they have no rank."""

TABLES = {"R2": (REGRESSION, REGRESSORS), "accuracy": (CLASSIFICATION, CLASSIFIERS)}


@lru_cache(1)
def samples(problem, seed):
    """Return training and test samples: X, X_test, y, y_test."""
    random = np.random.RandomState(seed)
    make = PROBLEMS[problem]
    X, y = make(random, N_TRAINING + N_TEST)
    n_training = 0.7 if hasattr(make, "is_measured") else N_TRAINING
    labels = y if problem in CLASSIFICATION else None
    return train_test_split(X, y, train_size=n_training, random_state=seed, stratify=labels)


def coverage(model, X, y):
    """Return the share of targets within 1.645 standard deviations of the mean over epochs."""
    mean, deviation = model.predict(X, return_std=True)
    return round(float(np.mean(np.abs(y - mean) <= 1.645 * deviation)), 4)


def keys(n_seeds):
    return [
        (problem, model, seed)
        for seed in range(n_seeds)
        for problems, models in TABLES.values()
        for problem in problems
        for model in models
    ]


def measure(problem, name, seed):
    """Score, seconds, and coverage where the last epochs are averaged."""
    X, X_test, y, y_test = samples(problem, seed)
    make = (REGRESSORS if problem in REGRESSION else CLASSIFIERS)[name]
    begun = time.process_time()
    model = make(seed, X.shape[1]).fit(X, y)
    spent = round(time.process_time() - begun, 3)
    averages = name == "SDNN" and problem in REGRESSION
    covered = coverage(model, X_test, y_test) if averages else None
    return {"score": round(model.score(X_test, y_test), 5), "fit_s": spent, "coverage": covered}


# Figures and tables of the measurements.


def scores(results, problem, model, what="score"):
    return np.array([row[what] for row in results[problem, model]])


def ranks(middles):
    """Return each model's mean rank from scores (n_problems, n_models); 1 is the best."""
    better = (middles[:, None, :] > middles[:, :, None]).sum(axis=2)
    equal = (middles[:, None, :] == middles[:, :, None]).sum(axis=2)
    return (better + (equal + 1) / 2).mean(axis=0)


def middles_of(results, problems, models, what="score", middle=np.median):
    """Return medians or means of a score, (n_problems, n_models); NaN where there is none."""
    return np.array(
        [
            [
                middle(scores(results, problem, model, what)) if results[problem, model] else np.nan
                for model in models
            ]
            for problem in problems
        ]
    )


def table(problems, models, middles, shown=None):
    """Return scores, a row for each problem and a column for each shown model; best in bold."""
    columns = [place for place, model in enumerate(models) if shown is None or model in shown]
    rows = []
    for problem, row in zip(problems, middles, strict=True):
        best = np.nanmax(row)
        rows.append((problem, *(_score_cell(row[place], best) for place in columns)))
    return markdown(("problem", *(list(models)[place] for place in columns)), rows)


def _score_cell(score, best):
    """Write a score, the best in bold; nothing if it was not measured."""
    if not np.isfinite(score):
        return ""
    return f"**{score:.3f}**" if score == best else f"{score:.3f}"


def rank_columns(title, models, middles):
    """Return mean ranks of models measured on all problems, and of all models on such problems."""
    is_ranked = np.array([model not in VARIANTS for model in models])
    is_measured = np.isfinite(middles)
    measured_on_all = is_measured.all(axis=0)
    columns = {f"{title}, rank": rank_column(models, middles, is_ranked & measured_on_all)}
    if not is_measured.all():
        by_all = is_measured.all(axis=1)
        columns[f"{title}, on {by_all.sum()}"] = rank_column(models, middles[by_all], is_ranked)
    return columns


def rank_column(models, middles, is_ranked):
    """Return mean ranks of some models among themselves."""
    names = [model for model, ranked in zip(models, is_ranked, strict=True) if ranked]
    results = ranks(middles[:, is_ranked])
    return {name: f"{rank:.1f}" for name, rank in zip(names, results, strict=True)}


def fit_column(results, problems, models):
    """Return the median seconds of fitting by model."""
    return {
        model: f"{np.median([row['fit_s'] for p in problems for row in results[p, model]]):.2g}"
        for model in models
    }


def by_model(columns):
    """Return a table with a row for each model, from columns by model."""
    models = dict.fromkeys(model for column in columns.values() for model in column)
    rows = [(model, *(column.get(model, "") for column in columns.values())) for model in models]
    return markdown(("model", *columns), rows)


def draw(results, path):
    """Draw a dot for each model and problem at the median, a bar over the middle 80 % of seeds."""
    figure = Figure(figsize=(10, 6.4), layout="constrained")
    colors = {
        "SDNN": "#1f5fa8", "SDNN kernel ridge": "#6fa8dc", "SDNN, last epoch": "#0b2f57",
        "SDNN, 4,000 columns": "#36b0b0", "SDNN, features selected": "#7b61c4",
        "gradient boosting": "#d9822b", "CatBoost": "#b3541e", "LightGBM": "#e8b04b",
        "XGBoost": "#f2d0a4", "xRFM": "#4a4a4a",
        "random forest": "#5b8c5a", "SVM": "#a05195", "Gaussian process": "#c2453a",
        "MLP": "#8a7f3d", "neighbours": "#888888", "linear": "#bbbbbb",
    }  # fmt: skip
    for axes, (unit, (problems, models)) in zip(figure.subplots(1, 2), TABLES.items(), strict=True):
        for row, problem in enumerate(problems):
            for place, model in enumerate(models):
                low, middle, high = np.quantile(
                    scores(results, problem, model), (0.1, 0.5, 0.9)
                ).clip(0, 1)
                y = -row - 0.35 + 0.7 * place / (len(models) - 1)
                ours = model.startswith("SDNN")
                axes.plot([low, high], [y, y], color=colors[model], linewidth=1 + ours)
                axes.plot(middle, y, "o", color=colors[model], markersize=3 + 1.5 * ours,
                          label=model if row == 0 else None)  # fmt: skip
        axes.set_yticks(-np.arange(len(problems)), problems, fontsize=8)
        axes.set_ylim(-len(problems) + 0.4, 0.6)
        for row in range(1, len(problems)):
            axes.axhline(0.5 - row, color="#dddddd", linewidth=0.6)
        axes.set_xlabel(f"{unit} on the test sample", fontsize=9)
        axes.tick_params(labelsize=8)
        axes.tick_params(axis="y", length=0)
        axes.spines[["top", "right", "left"]].set_visible(False)
    handles, names = figure.axes[0].get_legend_handles_labels()
    figure.legend(handles, names, loc="outside lower center", ncols=5, frameon=False, fontsize=8)
    write_whole(path, png_bytes(figure))


def main():
    arguments = options(__doc__, seeds=10).parse_args()
    measure_missing(KIND, measure, keys(arguments.seeds), arguments)
    if arguments.only:
        return
    results = grouped(KIND, arguments.folder)
    draw(results, arguments.folder / "problems.png")
    summary = {}
    for unit, (problems, models) in TABLES.items():
        middles = middles_of(results, problems, models)
        summary |= rank_columns(unit, models, middles)
        summary[f"{unit}, seconds to fit"] = fit_column(results, problems, models)
        if arguments.full:
            print(table(problems, models, middles))
    show({"made problems": by_model(summary)}, arguments.folder / "problems.md")


if __name__ == "__main__":
    warnings.simplefilter("ignore", ConvergenceWarning)
    main()
