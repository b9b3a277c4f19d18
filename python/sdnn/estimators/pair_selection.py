"""Selection of the features that matter by repeated halving and one hold-out.

Useless features cost a network of many samples time and accuracy, so that some of the samples first
decide which features it has.
"""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from numbers import Integral
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray
from sklearn.base import clone, is_classifier
from sklearn.utils import check_random_state

from sdnn.coding import CoarseCodeWarning, Coding, CorrelationMatrix, Symbolic, WithMissing
from sdnn.coding.symbols import is_missing, present
from sdnn.estimators.columns import Array, Floats, Pairs, input_pairs
from sdnn.estimators.network import units_for_pairs
from sdnn.estimators.training import FEWEST_SAMPLES, held_out_fifth, samples_in, without_classes

Estimator = Any
"""An `SDNNRegressor` or `SDNNClassifier`, whose base class imports this module."""
PART = 5000  # samples that decide, of larger samples
EPOCHS_OF_PART = 4
COLUMNS_OF_PART = 6000  # columns divided among the pairs
FEWEST_UNITS, MOST_UNITS = 32, 64
ALL_MISSING = WithMissing(base=Symbolic(categories=("",)))
"""Codes numbers and words as missing: for a column whose few values only other samples have."""


def with_categories(coding: Coding, column: Array) -> Coding:
    """Return a categorical coding with all categories of the column, so that no part lacks any."""
    base = present(coding)
    is_strict = not isinstance(coding, WithMissing) or coding.unknown == "error"
    if isinstance(base, CorrelationMatrix) or (isinstance(base, Symbolic) and is_strict):
        return coding.fit(column, n_units=2)
    return coding


def learnable_coding(coding: Coding, column: Array) -> Coding:
    """Return a coding, or `ALL_MISSING` for one that has to learn from a column without a value."""
    is_optional = isinstance(coding, WithMissing) and coding.learns
    return ALL_MISSING if is_optional and all(map(is_missing, column.tolist())) else coding


def pairs_among(features: NDArray[np.int64], seed: int) -> Pairs:
    """Return the pairs of some features that ``pairs="budget"`` has.

    >>> pairs_among(np.array([3, 7]), 0)
    [(3, 7), (7, 3)]
    """
    listed = features.tolist()
    return [(listed[mu], listed[nu]) for mu, nu in input_pairs("budget", None, len(listed), seed)]


def selected_pairs(
    model: Estimator,
    X: ArrayLike,
    table: Array,
    y: Array,
    weights: Floats | None,
    is_large: bool,
) -> Pairs | None:
    """Return the pairs selected with a hold-out; None if all are taken, or a random share.

    ``is_large`` says that a part of many samples selects the features of ``pairs="budget"``.
    """
    is_auto = isinstance(model.pairs, str) and model.pairs == "auto"
    if not (is_auto or is_large) or table.shape[1] < (2 if is_auto else 3):
        return None
    seed = int(check_random_state(model.random_state).randint(2**31 - 1))
    codings = model._codings(X, table)
    codings = [with_categories(coding, table[:, i]) for i, coding in enumerate(codings)]
    select = select_pairs_with_part if is_large else select_pairs
    return select(trial_model(model, seed), codings, X, table, y, weights, seed)


def trial_model(model: Estimator, seed: int) -> Estimator:
    """Return an unfitted copy of an estimator that learns parts of its samples to select pairs."""
    trial = clone(model).set_params(
        random_state=seed, early_stopping=False, calibrate=False, verbose=0
    )
    if model.out_of_range == "error":  # a part may have outliers that the whole sample has not
        trial.set_params(out_of_range="clip")
    return trial


def select_pairs(
    model: Estimator,
    codings: Sequence[Coding],
    X: ArrayLike,
    table: Array,
    y: Array,
    weights: Floats | None,
    seed: int,
) -> Pairs:
    """Return the pairs of the features with which a held-out fifth is predicted best.

    The features are halved repeatedly, down to two: those whose pairs' weights training changes
    most are kept. The pairs with the best score are returned, the fewest where scores are equal.
    The held-out part is stratified by class.

    ``model`` is a `trial_model`, and each feature has one of the ``codings``. ``table`` has the
    values of ``X`` as an array, shape (n_samples, n_features). ``weights`` are above 0.
    """
    labels = np.asarray(y)
    features = np.arange(table.shape[1])
    best = -np.inf, pairs_among(features, seed)
    is_held = held_out_fifth(labels, is_classifier(model), seed)
    too_few = is_classifier(model) and len(np.unique(labels[~is_held])) < 2
    if len(labels) < FEWEST_SAMPLES or too_few:
        return best[1]

    def samples(is_chosen: NDArray[np.bool_]) -> tuple[ArrayLike, Array, Floats | None]:
        """Return X, y and weights of the chosen samples."""
        chosen_weights = None if weights is None else weights[is_chosen]
        return samples_in(X, np.flatnonzero(is_chosen)), labels[is_chosen], chosen_weights

    learnable = map(learnable_coding, codings, table[~is_held].T)
    model = clone(model).set_params(coding=[(coding, [i]) for i, coding in enumerate(learnable)])
    if is_classifier(model):
        absent = np.setdiff1d(labels, labels[~is_held]).tolist()
        model.set_params(class_weight=without_classes(model.class_weight, absent))
    held_out = samples(is_held)
    while True:
        pairs = pairs_among(features, seed)
        fitted = clone(model).set_params(pairs=pairs)
        fitted._warns = False  # the fit to the whole sample warns of its values
        score = fitted.fit(*samples(~is_held)).score(*held_out)
        if score >= best[0]:
            best = score, pairs
        if len(features) <= 2:
            return best[1]
        ranked = np.argsort(-fitted._weight_changes()[features], kind="stable")
        features = np.sort(features[ranked[: (len(features) + 1) // 2]])


def select_pairs_with_part(
    model: Estimator,
    codings: Sequence[Coding],
    X: ArrayLike,
    table: Array,
    y: Array,
    weights: Floats | None,
    seed: int,
) -> Pairs:
    """Return the pairs that `select_pairs` returns for `PART` samples and a small network."""
    rows = np.sort(np.random.RandomState(seed).permutation(len(y))[:PART])
    n_pairs = len(pairs_among(np.arange(table.shape[1]), seed))
    n_units = min(MOST_UNITS, max(FEWEST_UNITS, 2 * round(COLUMNS_OF_PART / n_pairs / 2)))
    n_flipped = [getattr(present(coding), "n_flipped", None) for coding in codings]
    least = 2 * max((int(n) for n in n_flipped if isinstance(n, Integral)), default=0)
    # Codings that flip more units than the small network has need those of the whole network.
    n_units = max(n_units, min(least, model.n_pattern_units or units_for_pairs(1)))
    model.set_params(n_pattern_units=n_units, max_iter=EPOCHS_OF_PART)
    weights_of_part = None if weights is None else weights[rows]
    targets = np.asarray(y)[rows]
    with warnings.catch_warnings():
        warnings.simplefilter("ignore", CoarseCodeWarning)  # the network has more units
        samples = samples_in(X, rows)
        return select_pairs(model, codings, samples, table[rows], targets, weights_of_part, seed)
