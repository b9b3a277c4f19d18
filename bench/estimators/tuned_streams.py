"""River's models on streams with the best settings of a small grid, beside their defaults.

    OMP_NUM_THREADS=1 python bench/estimators/tuned_streams.py [--seeds 1] [--only WORD] [--redraw]

A grid is tried on the first quarter of each stream and seed, and the best of it predicts all of
the stream, which favours it. Adds what the store lacks to the rows of streams.py, and writes
tables of docs/evidence/streams.md.
"""

from __future__ import annotations

import sys
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
from measured import measure_missing, measured, options
from page import show
from river import ensemble, forest, neighbors, tree
from stream_data import CLASSIFICATION, REGRESSION, samples
from streams import (
    CLASSIFIERS,
    KIND,
    REGRESSORS,
    Perceptron,
    PerceptronOfClasses,
    by_model,
    by_stream,
    complete,
    follow,
    scaled,
)


def nearest(make):
    """Return a maker of nearest neighbours among the last samples."""

    def model(seed, n_neighbors, window):
        engine = neighbors.LazySearch(window_size=window)
        return scaled(make(n_neighbors=n_neighbors, engine=engine))

    return model


def patches(seed, leaf_prediction, subspace_size=0.6):
    """Make random patches of scaled inputs, as linear leaves diverge without scaling."""
    base = tree.HoeffdingTreeRegressor(grace_period=50, leaf_prediction=leaf_prediction)
    return scaled(ensemble.SRPRegressor(base, subspace_size=subspace_size, seed=seed))


SLOPES = [{"learning_rate_init": rate} for rate in (1e-3, 3e-3, 1e-2, 3e-2)]
FORESTS = [
    {"max_features": features, "grace_period": period}
    for features in ("sqrt", None)
    for period in (20, 50)
]
PATCHES = [
    {"training_method": "patches"},
    {"training_method": "resampling"},
    {"training_method": "patches", "subspace_size": 0.9},
]
WINDOWS = [
    {"n_neighbors": n, "window": window}
    for n, window in ((3, 1000), (10, 1000), (3, 200), (10, 200))
]
TUNED_REGRESSORS = {
    "adaptive random forest, tuned": (forest.ARFRegressor, FORESTS),
    "Mondrian forest (AMF), tuned": (
        forest.AMFRegressor,
        [{"step": 0.1}, {"step": 1.0}, {"step": 10.0}, {"n_estimators": 20}],
    ),
    "random patches (SRP), tuned": (
        patches,
        [
            {"leaf_prediction": "mean"},
            {"leaf_prediction": "adaptive"},
            {"leaf_prediction": "mean", "subspace_size": 0.9},
        ],
    ),
    "nearest neighbours, tuned": (nearest(neighbors.KNNRegressor), WINDOWS),
    "MLP 64-64, tuned": (Perceptron, SLOPES),
}
TUNED_CLASSIFIERS = {
    "adaptive random forest, tuned": (forest.ARFClassifier, FORESTS),
    "Mondrian forest (AMF), tuned": (
        forest.AMFClassifier,
        [{"dirichlet": 0.1}, {"dirichlet": 0.5}, {"step": 10.0}, {"n_estimators": 20}],
    ),
    "random patches (SRP), tuned": (ensemble.SRPClassifier, PATCHES),
    "nearest neighbours, tuned": (nearest(neighbors.KNNClassifier), WINDOWS),
    "MLP 64-64, tuned": (PerceptronOfClasses, SLOPES),
}
"""Makers of models and their grids."""
MORE_REGRESSORS = {"random patches (SRP)": lambda seed: ensemble.SRPRegressor(seed=seed)}
MORE_CLASSIFIERS = {
    "Mondrian forest (AMF)": lambda seed: forest.AMFClassifier(seed=seed),
    "random patches (SRP)": lambda seed: ensemble.SRPClassifier(seed=seed),
}
"""Defaults of models that streams.py does not have."""


def measure(stream, name, seed):
    """Follow a stream, with the settings chosen."""
    xs, ys = samples(stream, seed)
    more, tuned = (
        (MORE_REGRESSORS, TUNED_REGRESSORS)
        if stream in REGRESSION
        else (MORE_CLASSIFIERS, TUNED_CLASSIFIERS)
    )
    if name in more:
        return follow(more[name](seed), stream, xs, ys)
    make, grid = tuned[name]
    first = slice(len(xs) // 4)
    scores = [
        follow(seeded(make, seed, settings), stream, xs[first], ys[first]) for settings in grid
    ]
    values = [row.get("r2", row.get("accuracy")) for row in scores]
    best = grid[np.argmax(np.nan_to_num(values, nan=-np.inf))]
    return {**follow(seeded(make, seed, best), stream, xs, ys), "chosen": best}


def seeded(make, seed, settings):
    return make(seed=seed, **settings)


def keys(n_seeds):
    return [
        (stream, model, seed)
        for seed in range(n_seeds)
        for data, models in (
            (REGRESSION, {**MORE_REGRESSORS, **TUNED_REGRESSORS}),
            (CLASSIFICATION, {**MORE_CLASSIFIERS, **TUNED_CLASSIFIERS}),
        )
        for stream in data
        for model in models
    ]


def main():
    arguments = options(__doc__, seeds=1).parse_args()
    measure_missing(KIND, measure, keys(arguments.seeds), arguments)
    if arguments.only:
        return
    models = (
        {**REGRESSORS, **MORE_REGRESSORS, **TUNED_REGRESSORS},
        {**CLASSIFIERS, **MORE_CLASSIFIERS, **TUNED_CLASSIFIERS},
    )
    results = complete(measured(KIND, arguments.folder), *models)
    if arguments.full:
        print(by_stream(results, REGRESSION, models[0]))
        print(by_stream(results, CLASSIFICATION, models[1]))
    tables = {
        "regression, tuned": by_model(results, REGRESSION, models[0], 1, "Friedman, local drift"),
        "classification, tuned": by_model(results, CLASSIFICATION, models[1], 3, "Agrawal"),
    }
    show(tables, arguments.folder / "streams.md")


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    main()
