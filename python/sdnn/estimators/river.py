"""The estimators for the river library; needs river and scikit-learn."""

from __future__ import annotations

import collections
from collections.abc import Hashable, Mapping
from typing import Any

import numpy as np
import pandas as pd
from river import base
from sklearn.base import clone

from sdnn.arguments import flag, require, shown, whole
from sdnn.estimators.classifier import SDNNClassifier
from sdnn.estimators.inputs import Floats, codings_of_columns
from sdnn.estimators.outliers import numbers_to_range
from sdnn.estimators.regressor import SDNNRegressor

WINDOW = 500  # samples whose range is followed


def named(x: Mapping[Any, Any]) -> dict[str, Any]:
    """Return a sample with strings as names, as scikit-learn requires."""
    sample = {str(name): value for name, value in x.items()}
    if len(sample) < len(x):
        raise ValueError(f"the names of features must differ as text, got {shown(list(x))}")
    return sample


class FollowedRanges:
    """Moves numbers from their range among the last samples to the range that a model learned.

    Parameters
    ----------
    ends : dict of str to (float, float)
        The learned range of each feature to follow.
    first : DataFrame
        The samples from which they were learned.
    """

    def __init__(self, ends: Mapping[str, tuple[float, float]], first: pd.DataFrame) -> None:
        self.names = list(ends)
        self.low, self.high = np.array(list(ends.values()), dtype=np.float64).reshape(-1, 2).T
        values = first[self.names].to_numpy(dtype=np.float64, na_value=np.nan)
        self.recent = np.full((WINDOW, len(self.names)), np.nan)
        last = np.clip(values[-WINDOW:], self.low, self.high)
        self.recent[: len(last)] = last
        self.n_seen = len(last)
        self.now = self.low, self.high

    def note(self, values: Floats) -> None:
        """Take a sample's numbers, NaN where there are none, into the window."""
        self.recent[self.n_seen % WINDOW] = values
        self.n_seen += 1
        low, high = self.now
        if self.n_seen % WINDOW == 0 or np.any((values < low) | (values > high)):
            low = np.fmin.reduce(self.recent)
            high = np.fmax.reduce(self.recent)
            is_range = high > low  # also where none is NaN
            self.now = np.where(is_range, low, self.now[0]), np.where(is_range, high, self.now[1])

    def moved(self, x: dict[str, Any], learns: bool) -> dict[str, Any]:
        """Return a sample with its numbers moved; what is no finite number stays."""
        try:
            values = np.array([x.get(name) for name in self.names], dtype=np.float64)
        except (TypeError, ValueError):
            return x
        is_finite = np.isfinite(values)
        if learns:
            self.note(np.where(is_finite, values, np.nan))
        low, high = self.now
        moves = is_finite & (high > low)
        share = (values / 2 - low / 2) / np.where(moves, high / 2 - low / 2, 1.0)
        there = np.clip(self.low + share * (self.high - self.low), self.low, self.high)
        moved = zip(self.names, there.tolist(), moves.tolist(), strict=True)
        return {**x, **{name: value for name, value, is_moved in moved if is_moved}}


class Waiting:
    """Collects the first samples, from which ranges, categories and classes are learned."""

    usual: Any  # the model where none is given
    least_targets = 1  # different ones among the first samples

    def __init__(
        self, model: Any = None, grace_period: int = 100, follows_ranges: bool = True
    ) -> None:
        kind = type(self.usual)
        chosen = clone(self.usual) if model is None else model
        require(isinstance(chosen, kind), "model", f"be an {kind.__name__}", chosen, TypeError)
        self.model = chosen
        self.grace_period = whole("grace_period", grace_period, 2, 2**53)
        self.follows_ranges = flag("follows_ranges", follows_ranges)
        self.fitted: Any = None
        self.ranges: FollowedRanges | None = None
        self.samples: list[dict[str, Any]] = []
        self.targets: list[Any] = []

    def learn_one(self, x: dict[Hashable, Any], y: Any) -> None:
        """Learn one sample; if the model refuses one of the first, all of them are dropped."""
        if self.fitted is not None:
            self._learn(self._sample(x, learns=True), y)
            return
        sample = named(x)
        self.samples.append(sample)
        self.targets.append(y)
        if len(self.samples) < self.grace_period or len(set(self.targets)) < self.least_targets:
            return
        # The model cannot say which sample it refuses, and would refuse it for ever.
        samples, self.samples = self.samples, []
        targets, self.targets = self.targets, []
        is_classifier = isinstance(self.model, SDNNClassifier)
        options = {"classes": np.unique(targets)} if is_classifier else {}
        frame = pd.DataFrame(samples)
        frame = frame[sorted(frame)]  # whatever the order of the dictionaries
        try:
            self.fitted = clone(self.model).partial_fit(frame, np.array(targets), **options)
        except ValueError as error:
            raise ValueError(f"the first {len(samples)} samples are dropped: {error}") from error
        if self.follows_ranges:
            self._follow(frame)

    def _learn(self, sample: dict[str, Any], y: Any) -> None:
        self.fitted.learn_one(sample, y)

    def _sample(self, x: Mapping[Any, Any], learns: bool = False) -> dict[str, Any]:
        sample = named(x)
        return sample if self.ranges is None else self.ranges.moved(sample, learns)

    def _follow(self, frame: pd.DataFrame) -> None:
        """Follow the ranges that were learned from the first samples."""
        unfitted = codings_of_columns(self.model.coding, list(frame), frame.shape[1], frame)
        ends = {
            name: fitted.ends()
            for name, coding, fitted in zip(frame, unfitted, self.fitted.codings_, strict=True)
            if numbers_to_range(coding, frame[name].to_numpy()) is not None
        }
        if ends:
            self.ranges = FollowedRanges(ends, frame)


class RiverRegressor(Waiting, base.Regressor):
    """An `SDNNRegressor` for river's streams.

    Parameters
    ----------
    model : SDNNRegressor, default=SDNNRegressor(out_of_range="widen")
        Cloned. Features that samples may lack need the coding "with-missing", but must be in the
        first samples.
    grace_period : int, default=100
        Samples from which ranges and categories are learned; until then the mean is predicted.
    follows_ranges : bool, default=True
        Whether learned ranges of inputs become those of the last 500 samples as the stream drifts.
    """

    usual = SDNNRegressor(out_of_range="widen")

    def predict_one(self, x: dict[Hashable, Any]) -> float:
        """Predict one target."""
        if self.fitted is None:
            return float(np.mean(self.targets)) if self.targets else 0.0
        return float(self.fitted.predict_one(self._sample(x)))


class RiverClassifier(Waiting, base.Classifier):
    """An `SDNNClassifier` for river's streams.

    Parameters
    ----------
    model : SDNNClassifier, default=SDNNClassifier(correction_share=0.5)
        Cloned; missing features as for `RiverRegressor`. A stream shows each sample once, which
        needs larger corrections.
    grace_period : int, default=100
        Samples, of at least two classes, from which ranges, categories and classes are learned.
        Until then label frequencies are predicted. A class that comes later gets units of its own,
        but is an error with ``scheme="one_vs_one"``.
    follows_ranges : bool, default=True
        As in `RiverRegressor`.
    """

    least_targets = 2

    usual = SDNNClassifier(correction_share=0.5)

    @property
    def _multiclass(self) -> bool:  # what River asks of classifiers
        return True

    def _learn(self, sample: dict[str, Any], y: Any) -> None:
        if y not in self.fitted.classes_:
            self.fitted._bins_of_one(sample)  # which raises before a class is added
            self.fitted._add_class(y)
        super()._learn(sample, y)

    def predict_one(self, x: dict[Hashable, Any], **_options: Any) -> Any:
        """Predict one label; None before the first sample."""
        if self.fitted is not None:
            return self.fitted.predict_one(self._sample(x))
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
        each = self.fitted.predict_proba_one(self._sample(x)).tolist()
        return dict(zip(self.fitted.classes_.tolist(), each, strict=True))
