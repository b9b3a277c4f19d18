"""The estimators for the river library; needs river and scikit-learn."""

from __future__ import annotations

import collections
import math
import sys
from collections.abc import Sequence
from numbers import Integral, Real
from typing import Literal, overload

import numpy as np
from river import base
from river.conf import Interval

from sdnn.estimators.classifier import SDNNClassifier
from sdnn.estimators.columns import Floats
from sdnn.estimators.experts import ClassificationExperts, RegressionExperts
from sdnn.estimators.intervals import FollowedErrors, coverage_of
from sdnn.estimators.network_settings import Settings
from sdnn.estimators.regressor import SDNNRegressor
from sdnn.estimators.stream_estimator import (
    Features,
    Sample,
    StreamEstimator,
    Target,
    cleaned_sample,
    is_finite_number,
)
from sdnn.support.arguments import flag, require, shown


class RiverRegressor(StreamEstimator, base.Regressor):
    """An `SDNNRegressor` for river's streams.

    Parameters
    ----------
    model : SDNNRegressor, default=SDNNRegressor(out_of_range="widen")
        Cloned. Features that a sample lacks, None and NaN are missing values; a feature with words
        is symbolic, unless the model has another coding for it.
    grace_period : int, default=100
        Samples from which ranges and categories are learned; until then the mean is predicted.
        Later features and categories are learned this number of samples (or a tenth of all, up to
        1,000) after the first of them, if 5 of the last 1,000 samples have them. At most 1,000
        features, and categories of each, are learned.
    follows_ranges : bool, default=True
        Whether learned ranges of inputs become those of the last 500 samples as the stream drifts.
    experts : {"window", "linear", "network"}, default="window"
        What predicts: the network alone; with "linear" also the mean of the targets and linear
        regression on the inputs; with "window" also kernel regression on the last 400 samples. They
        are weighted by their recent errors; `weights_` shows the weights.
    coverage : float, default=0.9
        The share of targets that intervals of predictions are to contain.

    Notes
    -----
    Regressions have up to 200 columns: one for each number, where a missing value counts as the
    middle of the range, and one for each category. Linear ones are recursive least squares, which
    remember about 1,000 and 50 samples. The kernel regression learns what the first leaves.
    """

    default_model = SDNNRegressor(out_of_range="widen")
    experts_class = RegressionExperts

    def __init__(
        self,
        model: SDNNRegressor | None = None,
        grace_period: int = 100,
        follows_ranges: bool = True,
        experts: str = "window",
        coverage: float = 0.9,
    ) -> None:
        super().__init__(model, grace_period, follows_ranges, experts)
        self.coverage = coverage_of(coverage)
        self.errors = FollowedErrors(self.coverage)
        self._begun_with = {"coverage": self.coverage}  # from the first sample on

    def _settings(self) -> Settings:
        return {**super()._settings(), "coverage": self.coverage}

    def _check_target(self, y: Target) -> None:
        require(is_finite_number(y), "y", "be a finite number", y)

    def _of_network(self, sample: Sample) -> Floats:
        return np.array([self.fitted.predict_one(sample)])

    def _targets(self, targets: Sequence[Target]) -> Floats:
        return np.array(targets, dtype=np.float64)[:, None]

    def _predict(self, sample: Sample) -> float:
        """Predict by the mixture, or by the mean of the targets before the network is fitted."""
        if self.fitted is not None:
            return float(self._mix(self._estimates(sample))[0])
        if not self.targets:
            return 0.0
        with np.errstate(over="ignore", invalid="ignore"):
            mean = float(np.mean(self.targets))
        if math.isfinite(mean):
            return mean
        return float(sum(y / len(self.targets) for y in self.targets))  # their sum may overflow

    def _learn_checked(self, sample: Sample, y: Target) -> None:
        """Learn a sample, and the error of the prediction before it."""
        difference = float(y) - self._predict(sample)  # may overflow
        super()._learn_checked(sample, y)
        self.errors.learn(min(abs(difference), sys.float_info.max))

    @overload
    def predict_one(self, x: Features, with_interval: Literal[False] = False) -> float: ...

    @overload
    def predict_one(self, x: Features, with_interval: Literal[True]) -> Interval: ...

    def predict_one(self, x: Features, with_interval: bool = False) -> float | Interval:
        """Predict one target, or with ``with_interval`` bounds of it, as `river.conf` does.

        The interval, whose ``center`` is the prediction, has a half width that the last 300 errors
        exceed as seldom as ``coverage`` has it (adaptive conformal inference). It is the same for
        all samples; before the first error it is 0.
        """
        prediction = self._predict(cleaned_sample(x))
        if not flag("with_interval", with_interval):
            return prediction
        half_width, largest = self.errors.half_width(), sys.float_info.max
        lower, upper = prediction - half_width, prediction + half_width
        return Interval(lower=max(lower, -largest), upper=min(upper, largest))


class RiverClassifier(StreamEstimator, base.Classifier):
    """An `SDNNClassifier` for river's streams.

    Parameters
    ----------
    model : SDNNClassifier, default=SDNNClassifier(correction_share=0.5)
        Cloned; missing values and words as for `RiverRegressor`. A stream shows each sample once,
        which needs larger corrections.
    grace_period : int, default=100
        Samples, of at least two classes, from which ranges, categories and classes are learned.
        Until then label frequencies are predicted. Later features as in `RiverRegressor`. A class
        that comes later gets additional units, but is an error with ``scheme="one_vs_one"``.
    follows_ranges : bool, default=True
        As in `RiverRegressor`.
    experts : {"window", "linear", "network"}, default="window"
        As in `RiverRegressor`, with the frequencies of labels instead of the mean, and weights by
        the likelihood of recent labels.
    """

    least_targets = 2
    default_model = SDNNClassifier(correction_share=0.5)
    experts_class = ClassificationExperts

    @property
    def _multiclass(self) -> bool:  # an attribute of every classifier of river
        return True

    def _check_target(self, y: object) -> None:
        is_whole = isinstance(y, Integral | np.bool_) or (
            isinstance(y, Real) and float(y).is_integer()
        )
        require(isinstance(y, str) or is_whole, "y", "be a word, a whole number or a bool", y)
        first = self.targets[0] if self.targets else y
        is_alike = isinstance(y, str) == isinstance(first, str)
        require(is_alike, "y", f"be a label, like {shown(first)}", y)

    def _learn(self, sample: Sample, y: Target) -> None:
        """Learn a sample in the network; a new label becomes a class."""
        if y not in self.fitted.classes_:
            self.fitted._bins_of_one(sample)  # raises for a bad sample before a class is added
            self.fitted._add_class(y)
        super()._learn(sample, y)

    def _of_network(self, sample: Sample) -> Floats:
        """Return the shares of units that fire; for single units 1 for the predicted label."""
        if hasattr(self.fitted, "predict_proba_one"):
            scores: Floats = self.fitted._scores(self.fitted._bins_of_one(sample), 1)[0]
            return scores
        is_predicted = self.fitted.classes_ == self.fitted.predict_one(sample)
        return np.asarray(is_predicted, dtype=np.float64)

    def _targets(self, targets: Sequence[Target]) -> Floats:
        """Return labels as rows with 1 for the class and 0 for others, (n_samples, n_classes)."""
        shares = np.zeros((len(targets), len(self.fitted.classes_)))
        shares[np.arange(len(targets)), self.fitted._targets(np.array(targets))] = 1.0
        return shares

    def predict_one(self, x: Features, **_options: object) -> Target:
        """Predict one label; None before the first sample."""
        if self.fitted is None:
            # Ties go to the label that was observed first.
            return max(dict.fromkeys(self.targets), key=self.targets.count, default=None)
        sample = cleaned_sample(x)
        if self.mixed is None:
            return np.asarray(self.fitted.predict_one(self._sample(sample))).item()
        return self.fitted.classes_.tolist()[np.argmax(self._mix(self._estimates(sample)))]

    def predict_proba_one(self, x: Features, **_options: object) -> dict[Target, float]:
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
        sample = cleaned_sample(x)
        if self.mixed is None:
            each = self.fitted.predict_proba_one(self._sample(sample))
        else:
            each = self._mix(self._estimates(sample))
        return dict(zip(self.fitted.classes_.tolist(), each.tolist(), strict=True))
