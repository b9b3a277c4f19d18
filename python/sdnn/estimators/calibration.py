"""Errors and scores of samples that a network has not learned."""

from __future__ import annotations

from typing import TYPE_CHECKING, NamedTuple

import numpy as np
from numpy.typing import ArrayLike
from sklearn.base import clone

from sdnn.estimators.columns import Array, Floats
from sdnn.estimators.training import (
    FEWEST_SAMPLES,
    Rows,
    TooFewSamplesError,
    held_out_fifth,
    samples_in,
)

if TYPE_CHECKING:
    from sdnn.estimators.base import BaseSDNN


class HeldOut(NamedTuple):
    """Samples that were held out, and a model that learned the others."""

    model: BaseSDNN
    rows: Rows  # numbers of the samples
    X: ArrayLike
    y: Array
    weights: Floats  # 1 without weights


def learn_without_fifth(
    fitted: BaseSDNN,
    X: ArrayLike,
    y: ArrayLike,
    sample_weight: ArrayLike | None,
    is_stratified: bool,
) -> HeldOut:
    """Train a model like a fitted one without a fifth of the samples.

    It has the same codings and pairs. With ``is_stratified`` a fifth of each class is held out, but
    no class of a single sample. TooFewSamplesError for fewer than ten samples, too few for early
    stopping, or too few of each class.
    """
    targets = np.asarray(y)
    if len(targets) < FEWEST_SAMPLES:
        raise TooFewSamplesError(
            f"calibrate must be False with fewer than {FEWEST_SAMPLES} samples, got {len(targets)}"
        )
    seed = fitted._weight_seed
    is_held = held_out_fifth(targets, is_stratified, seed)
    if is_stratified:
        labels, counts = np.unique(targets, return_counts=True)
        is_held &= ~np.isin(targets, labels[counts == 1])
        n_learned = len(targets) - np.count_nonzero(is_held)
        if not is_held.any() or n_learned < 2 * len(labels):
            raise TooFewSamplesError(
                "calibrate must be False where classes hardly have two samples"
            )
    weights = np.ones(len(targets)) if sample_weight is None else np.asarray(sample_weight)
    model = clone(fitted).set_params(
        calibrate=False,
        random_state=seed,
        coding=[(coding, [index]) for index, coding in enumerate(fitted.codings_)],
        pairs=[(mu, None if mu == nu else nu) for mu, nu in fitted.pairs_],
        n_pattern_units=fitted.network_.input_code.core.n_units,
    )
    # The smaller network corrects as large a share of its errors.
    if len(targets) > fitted._largest_full_sample:
        model._largest_full_sample = 0
    model._warns = False  # the fit to all samples has warned already
    learned, held = np.flatnonzero(~is_held), np.flatnonzero(is_held)
    learned_weights = None if sample_weight is None else weights[learned]
    model.fit(samples_in(X, learned), targets[learned], learned_weights)
    weights_of_held = weights[held].astype(np.float64)
    return HeldOut(model, held, samples_in(X, held), targets[held], weights_of_held)
