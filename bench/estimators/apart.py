"""Every estimator with default settings on measured data that nothing was developed on.

    OMP_NUM_THREADS=1 python bench/estimators/apart.py [--only WORD] [--redraw] [--full]

Measures what the store lacks in five folds and writes a table of docs/evidence/problems.md; --full
prints all scores. `real_data.py` has the rule by which the data were chosen, before any was
measured. Needs what real.py needs.
"""

from __future__ import annotations

import sys
import warnings
from collections import defaultdict
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[1]))

import numpy as np
import problems
import real
from measured import grouped, measure_missing, options
from page import show
from real_data import CLASSIFICATION_APART, REGRESSION_APART, samples
from scipy.stats import rankdata

KIND = "data kept apart"
LEFT_OUT = ("SVM", "neighbours")
"""Models far behind on other data."""
REGRESSORS, CLASSIFIERS = (
    {name: make for name, make in models.items() if name not in LEFT_OUT}
    for models in (real.REGRESSORS, real.CLASSIFIERS)
)
SLOW = "Gaussian process"
MOST_ROWS_OF_SLOW = 1000
SCORES = {
    "R2": ("score", 1, REGRESSION_APART, REGRESSORS),
    "accuracy": ("score", 1, CLASSIFICATION_APART, CLASSIFIERS),
    "AUC": ("auc", 1, CLASSIFICATION_APART, CLASSIFIERS),
    "log loss": ("log_loss", -1, CLASSIFICATION_APART, CLASSIFIERS),
}
"""Name, sign, data and models of each score."""
N_RESAMPLES = 10_000


def keys():
    """Return all keys, those of the slow model last."""
    unsorted = [
        (problem, model, fold)
        for fold in range(real.N_FOLDS)
        for data, models in ((REGRESSION_APART, REGRESSORS), (CLASSIFICATION_APART, CLASSIFIERS))
        for problem in data
        for model in models
        if model != SLOW or len(samples(problem)[0]) <= MOST_ROWS_OF_SLOW
    ]
    return sorted(unsorted, key=lambda key: key[1] == SLOW)


def rank_column(middles, models):
    """Return mean ranks by model, with 95 % intervals from resampled problems."""
    ranks = rankdata(-middles, axis=1)
    random = np.random.RandomState(0)
    drawn = random.randint(len(ranks), size=(N_RESAMPLES, len(ranks)))
    lower, upper = np.quantile(ranks[drawn].mean(axis=1), (0.025, 0.975), axis=0)
    bounds = zip(ranks.mean(axis=0), lower, upper, strict=True)
    texts = [f"{middle:.1f} [{low:.1f}, {high:.1f}]" for middle, low, high in bounds]
    return dict(zip(models, texts, strict=True))


def columns_of(title, middles, models):
    """Return ranks on all problems of models that have them, and of all models on the others."""
    names, there = np.array(models), np.isfinite(middles)
    everywhere = there.all(axis=0)
    columns = {f"{title}, rank": rank_column(middles[:, everywhere], names[everywhere])}
    if not everywhere.all():
        of_all = there.all(axis=1)
        columns[f"{title}, on {of_all.sum()}"] = rank_column(middles[of_all], names)
    return columns


def mean_column(results, what):
    """Return the mean over classifications of a measure of probabilities, by model."""
    middles = problems.middles_of(results, CLASSIFICATION_APART, CLASSIFIERS, what, np.mean)
    return {m: f"{x:.3f}" for m, x in zip(CLASSIFIERS, middles.mean(axis=0), strict=True)}


def main():
    arguments = options(__doc__, seeds=real.N_FOLDS).parse_args()
    measure_missing(KIND, real.measure, keys(), arguments)
    if arguments.only:
        return
    results = grouped(KIND, arguments.folder)
    complete = {key: rows for key, rows in results.items() if len(rows) == real.N_FOLDS}
    results = defaultdict(list, complete)
    columns = {}
    for title, (what, sign, data, makers) in SCORES.items():
        models = [name for name in makers if any((problem, name) in results for problem in data)]
        middles = sign * problems.middles_of(results, data, models, what, np.mean)
        columns |= columns_of(title, middles, models)
        if arguments.full:
            print(problems.table(data, models, middles))
    columns["log loss"] = mean_column(results, "log_loss")
    columns["calibration error"] = mean_column(results, "calibration")
    show({"data kept apart": problems.by_model(columns)}, arguments.folder / "problems.md")


if __name__ == "__main__":
    warnings.simplefilter("ignore")
    main()
