"""Selection of the features that matter by repeated halving and one hold-out.

Useless features cost a network of many samples time and accuracy, so that some of the samples first
decide which features it has.
"""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import BaseEstimator, clone, is_classifier

from sdnn.coding import Coding, CorrelationMatrix, Symbolic, WithMissing
from sdnn.coding.symbols import present
from sdnn.estimators.columns import Array, Floats, Pairs, input_pairs
from sdnn.estimators.outliers import OutlierWarning
from sdnn.estimators.training import FEWEST_SAMPLES, held_out_fifth, samples_in

PART = 5000  # samples that decide, of larger samples
EPOCHS_OF_PART = 4
COLUMNS_OF_PART = 6000  # columns divided among the pairs
FEWEST_UNITS, MOST_UNITS = 32, 64


def with_categories(coding: Coding, column: Array) -> Coding:
    """Return a categorical coding with all categories of the column, so that no part lacks any."""
    base = present(coding)
    is_strict = not isinstance(coding, WithMissing) or coding.unknown == "error"
    if isinstance(base, CorrelationMatrix) or (isinstance(base, Symbolic) and is_strict):
        return coding.fit(column, n_units=2)
    return coding


def pairs_among(features: NDArray[np.int64], seed: int) -> Pairs:
    """Return the pairs of some features that ``pairs="budget"`` has.

    >>> pairs_among(np.array([3, 7]), 0)
    [(3, 7), (7, 3)]
    """
    listed = features.tolist()
    return [(listed[mu], listed[nu]) for mu, nu in input_pairs("budget", None, len(listed), seed)]


def select_pairs(
    model: BaseEstimator, X: ArrayLike, y: Array, weights: Floats | None, n_features: int, seed: int
) -> Pairs:
    """Return the pairs of the features with which a held-out fifth is predicted best.

    The features are halved repeatedly, down to two: those whose pairs' weights training changes
    most are kept. The pairs with the best score are returned, the fewest where scores are equal.
    The held-out part is stratified by class.
    """
    labels = np.asarray(y)
    features = np.arange(n_features)
    best = -np.inf, pairs_among(features, seed)
    is_held = held_out_fifth(labels, is_classifier(model), seed)
    too_few = is_classifier(model) and len(np.unique(labels[~is_held])) < 2
    if len(labels) < FEWEST_SAMPLES or too_few:
        return best[1]

    def samples(is_chosen: NDArray[np.bool_]) -> tuple[ArrayLike, Array, Floats | None]:
        """Return X, y and weights of the chosen samples."""
        chosen_weights = None if weights is None else weights[is_chosen]
        if chosen_weights is not None and not chosen_weights.any():
            chosen_weights = None  # fit refuses weights that are all 0
        return samples_in(X, np.flatnonzero(is_chosen)), labels[is_chosen], chosen_weights

    held_out = samples(is_held)
    while True:
        pairs = pairs_among(features, seed)
        fitted = clone(model).set_params(pairs=pairs).fit(*samples(~is_held))
        score = fitted.score(*held_out)
        if score >= best[0]:
            best = score, pairs
        if len(features) <= 2:
            return best[1]
        ranked = np.argsort(-fitted._weight_changes()[features], kind="stable")
        features = np.sort(features[ranked[: (len(features) + 1) // 2]])


def select_pairs_with_part(
    model: BaseEstimator, X: ArrayLike, y: Array, weights: Floats | None, n_features: int, seed: int
) -> Pairs:
    """Return the pairs that `select_pairs` returns for `PART` samples and a small network."""
    rows = np.sort(np.random.RandomState(seed).permutation(len(y))[:PART])
    n_pairs = len(pairs_among(np.arange(n_features), seed))
    n_units = min(MOST_UNITS, max(FEWEST_UNITS, 2 * round(COLUMNS_OF_PART / n_pairs / 2)))
    model.set_params(n_pattern_units=n_units, max_iter=EPOCHS_OF_PART)
    weights_of_part = None if weights is None else weights[rows]
    targets = np.asarray(y)[rows]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", OutlierWarning)  # the whole sample warns of its outliers
        return select_pairs(model, samples_in(X, rows), targets, weights_of_part, n_features, seed)
