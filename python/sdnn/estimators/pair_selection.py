"""Selection of pairs of inputs by repeated halving and cross-validation."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import clone, is_classifier
from sklearn.model_selection import KFold, StratifiedKFold
from sklearn.utils import _safe_indexing

from sdnn.coding import Coding, CorrelationMatrix, Symbolic, WithMissing
from sdnn.estimators.inputs import Array, Floats, Pairs

N_FOLDS = 5
STANDARD_ERRORS = 2.0


def halved(pairs: Pairs, importances: Floats) -> Pairs:
    """Return the more important half of the pairs; both orders of two inputs stay together.

    >>> halved([(0, 1), (1, 0), (0, 2), (2, 0)], np.array([0.1, 0.1, 0.2, 0.6]))
    [(0, 2), (2, 0)]
    """
    total: dict[frozenset[int], float] = {}
    for pair, importance in zip(pairs, importances.tolist(), strict=True):
        total[frozenset(pair)] = total.get(frozenset(pair), 0.0) + importance
    ranked = sorted(total, key=lambda inputs: (-total[inputs], sorted(inputs)))
    kept = set(ranked[: (len(ranked) + 1) // 2])
    return [pair for pair in pairs if frozenset(pair) in kept]


def with_categories(coding: Coding, column: Array) -> Coding:
    """Return a coding with all categories of the column, where it could refuse unknown ones."""
    base = coding.base if isinstance(coding, WithMissing) else coding
    is_strict = not isinstance(coding, WithMissing) or coding.unknown == "error"
    if isinstance(base, CorrelationMatrix) or (isinstance(base, Symbolic) and is_strict):
        return coding.fit(column, n_units=2)
    return coding


def halving(
    model: Any, X: Any, y: Any, weights: Any, pairs: Pairs, n_levels: int | None = None
) -> list[Any]:
    """Return the models fitted with all pairs, half of them, and so on, down to two inputs."""
    fitted = []
    while True:
        fitted.append(clone(model).set_params(pairs=pairs).fit(X, y, weights))
        fewer = halved(pairs, fitted[-1].pair_importances_)
        if len(fewer) == len(pairs) or len(fitted) == n_levels:
            return fitted
        pairs = fewer


def select_pairs(
    model: Any, X: ArrayLike, y: ArrayLike, weights: Any, pairs: Pairs, seed: int
) -> Pairs:
    """Return the pairs with the best cross-validation score, all unless fewer are clearly better.

    Each of five folds halves the pairs repeatedly by importance. Fewer pairs must be better than
    all by two standard errors of the folds' differences, as the best of many scores is better by
    chance. Folds whose training part has one class only are left out.
    """
    labels = np.asarray(y)
    stratified = is_classifier(model) and np.unique(labels, return_counts=True)[1].min() >= N_FOLDS
    if len(labels) < 2 * N_FOLDS:
        return pairs
    splitter = (StratifiedKFold if stratified else KFold)(N_FOLDS, shuffle=True, random_state=seed)

    def part(rows: Any) -> tuple[Any, Any, Any]:
        weighted = weights is not None and weights[rows].any()  # a fold may have none above 0
        return _safe_indexing(X, rows), labels[rows], weights[rows] if weighted else None

    scores = [
        [one.score(*part(test)) for one in halving(model, *part(train), pairs)]
        for train, test in splitter.split(labels, labels)
        if not is_classifier(model) or len(np.unique(labels[train])) > 1
    ]
    if len(scores) < 2:
        return pairs
    gains = np.array(scores) - np.array(scores)[:, :1]
    level = int(np.argmax(gains.mean(axis=0)))
    error = gains[:, level].std(ddof=1) / np.sqrt(len(scores))
    if level == 0 or gains[:, level].mean() <= STANDARD_ERRORS * error:
        return pairs
    return list(halving(model, X, labels, weights, pairs, level + 1)[-1].pairs_)
