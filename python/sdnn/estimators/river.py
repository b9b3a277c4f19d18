"""The estimators by the interface of the river library: samples are dictionaries, one at a time.

Needs river, of the extra ``sdnn[river]``; nothing else of this package does.
"""

from __future__ import annotations

import collections
from collections.abc import Hashable, Mapping
from typing import Any

import numpy as np
import pandas as pd
from river import base
from sklearn.base import clone

from sdnn.estimators.classifier import SDNNClassifier

__all__ = ["RiverClassifier", "RiverRegressor"]


def named(x: Mapping[Any, Any]) -> dict[str, Any]:
    """Return a sample with words as names, as scikit-learn wants them; river has numbers too."""
    return {str(name): value for name, value in x.items()}


class Waiting:
    """Collects the first samples, from which ranges, categories and classes are learned.

    If the model refuses one of them, all are dropped, and the collecting begins anew.
    """

    least_targets = 1
    """Different ones that have to be among the samples."""

    def __init__(self, model: Any, grace_period: int = 100) -> None:
        if grace_period < 2:
            raise ValueError(f"grace_period must be at least 2, got {grace_period!r}")
        self.model = model
        self.grace_period = grace_period
        self.fitted: Any = None
        self.samples: list[dict[str, Any]] = []
        self.targets: list[Any] = []

    def learn_one(self, x: dict[Hashable, Any], y: Any) -> None:
        """Learn one sample; ValueError if the model refuses it, or one of the first ones."""
        sample = named(x)
        if self.fitted is not None:
            self.fitted.learn_one(sample, y)
            return
        self.samples.append(sample)
        self.targets.append(y)
        if len(self.samples) < self.grace_period or len(set(self.targets)) < self.least_targets:
            return
        # The model cannot say which sample it refuses, and would refuse it for ever.
        samples, self.samples = self.samples, []
        targets, self.targets = self.targets, []
        is_classifier = isinstance(self.model, SDNNClassifier)
        options = {"classes": np.unique(targets)} if is_classifier else {}
        try:
            self.fitted = clone(self.model).partial_fit(
                pd.DataFrame(samples), np.array(targets), **options
            )
        except ValueError as error:
            raise ValueError(f"the first {len(samples)} samples are dropped: {error}") from error


class RiverRegressor(Waiting, base.Regressor):
    """An `SDNNRegressor` for river's streams.

    Parameters
    ----------
    model : SDNNRegressor
        How to learn; it is cloned. ``out_of_range="widen"`` suits streams that drift. Features
        that samples may lack want the coding "with-missing", or another `WithMissing`; the first
        samples have to show all features.
    grace_period : int, default=100
        Samples from which ranges and categories are learned first. Until then the mean target is
        predicted.
    """

    def predict_one(self, x: dict[Hashable, Any]) -> float:
        """Predict one target."""
        if self.fitted is None:
            return float(np.mean(self.targets)) if self.targets else 0.0
        return float(self.fitted.predict_one(named(x)))


class RiverClassifier(Waiting, base.Classifier):
    """An `SDNNClassifier` for river's streams.

    Parameters
    ----------
    model : SDNNClassifier
        How to learn; it is cloned. Features that samples may lack as of `RiverRegressor`.
    grace_period : int, default=100
        Samples from which ranges, categories and the classes are learned first, and more until
        there are two classes. Until then the most frequent label is predicted, and the share of
        each label so far is its probability. Samples of classes that come later are errors.
    """

    least_targets = 2

    def predict_one(self, x: dict[Hashable, Any], **_options: Any) -> Any:
        """Predict one label; None before the first sample."""
        if self.fitted is not None:
            return self.fitted.predict_one(named(x))
        # The first to come where several are equally frequent.
        return max(dict.fromkeys(self.targets), key=self.targets.count, default=None)

    def predict_proba_one(self, x: dict[Hashable, Any], **_options: Any) -> dict[Any, float]:
        """Estimate the probability of each label; none before the first sample.

        Of the first samples it is each label's share so far. NotImplementedError if the model has
        one unit per class or pair of classes, which tell no probabilities.
        """
        if not hasattr(self.model, "predict_proba_one"):
            raise NotImplementedError(
                "probabilities need scheme='one_vs_rest' and more than one of n_units_per_class, "
                f"got {self.model!r}"
            )
        if self.fitted is None:
            n_samples = len(self.targets)
            return {y: n / n_samples for y, n in collections.Counter(self.targets).items()}
        each = self.fitted.predict_proba_one(named(x)).tolist()
        return dict(zip(self.fitted.classes_.tolist(), each, strict=True))
