"""The estimators for the river library; needs river and scikit-learn."""

from __future__ import annotations

import collections
from collections.abc import Hashable, Mapping
from typing import Any

import numpy as np
import pandas as pd
from river import base
from sklearn.base import clone

from sdnn.arguments import shown
from sdnn.estimators.classifier import SDNNClassifier


def named(x: Mapping[Any, Any]) -> dict[str, Any]:
    """Return a sample with strings as names, as scikit-learn requires."""
    return {str(name): value for name, value in x.items()}


class Waiting:
    """Collects the first samples, from which ranges, categories and classes are learned."""

    least_targets = 1  # different ones among the first samples

    def __init__(self, model: Any, grace_period: int = 100) -> None:
        if grace_period < 2:
            raise ValueError(f"grace_period must be at least 2, got {shown(grace_period)}")
        self.model = model
        self.grace_period = grace_period
        self.fitted: Any = None
        self.samples: list[dict[str, Any]] = []
        self.targets: list[Any] = []

    def learn_one(self, x: dict[Hashable, Any], y: Any) -> None:
        """Learn one sample; if the model refuses one of the first, all of them are dropped."""
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
        Cloned. ``out_of_range="widen"`` suits drifting streams; features that samples may lack
        need the coding "with-missing", but must be in the first samples.
    grace_period : int, default=100
        Samples from which ranges and categories are learned; until then the mean is predicted.
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
        Cloned; missing features as for `RiverRegressor`.
    grace_period : int, default=100
        Samples, of at least two classes, from which ranges, categories and classes are learned.
        Until then label frequencies are predicted. Classes that come later are errors.
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

        NotImplementedError for models with one unit per class or pair of classes.
        """
        if not hasattr(self.model, "predict_proba_one"):
            raise NotImplementedError(
                "probabilities need scheme='one_vs_rest' and more than one of n_units_per_class, "
                f"got {shown(self.model)}"
            )
        if self.fitted is None:
            n_samples = len(self.targets)
            return {y: n / n_samples for y, n in collections.Counter(self.targets).items()}
        each = self.fitted.predict_proba_one(named(x)).tolist()
        return dict(zip(self.fitted.classes_.tolist(), each, strict=True))
