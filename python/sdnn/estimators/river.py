"""The estimators for the river library; needs river and scikit-learn."""

from __future__ import annotations

import abc
import collections
import dataclasses
import math
from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from typing import Any, cast

import numpy as np
import pandas as pd
from river import base
from sklearn.base import clone

from sdnn.coding import Coding, Symbolic, WithMissing
from sdnn.coding.symbols import is_missing, present
from sdnn.estimators.classifier import SDNNClassifier
from sdnn.estimators.columns import Codings, Entry, Floats, coding_entries, codings_of_columns
from sdnn.estimators.growth import grow
from sdnn.estimators.network import COLUMN_BUDGET
from sdnn.estimators.outliers import numbers_to_range
from sdnn.estimators.regressor import SDNNRegressor
from sdnn.support.arguments import flag, require, shown, whole

Features = Mapping[Hashable, Any]  # a sample of river
Sample = dict[str, Any]
Target = Any  # a number or a label
WINDOW = 500  # number of last samples whose range inputs are scaled from
REMEMBERED = 1000  # number of last samples kept to learn new features and categories from
FEWEST = 5  # number of kept samples that must have a new feature or category
MOST_FEATURES = 1000  # later features are ignored
MOST_CATEGORIES = 1000  # later categories of a feature count as missing values


def cleaned_sample(x: Features) -> Sample:
    """Return a sample with strings as names and None for missing values."""
    sample = {str(name): value for name, value in x.items()}
    if len(sample) < len(x):
        raise ValueError(f"x must have names that differ as text, got {shown(list(x))}")
    for name, value in sample.items():
        if type(value) is str or (type(value) is float and math.isfinite(value)):
            continue
        if is_missing(value):
            sample[name] = None
            continue
        try:
            is_finite = isinstance(value, str) or math.isfinite(value)
        except (OverflowError, TypeError, ValueError):
            is_finite = False
        if not is_finite:
            expected = "finite numbers, words, or None where they are missing"
            raise ValueError(f"x must have {expected}, got {shown(value)} for {name!r}")
    return sample


def number_of(value: object) -> object:
    """Return a number unchanged, or the number that a word spells; None for other words."""
    if not isinstance(value, str):
        return value
    try:
        read = float(value)
    except ValueError:
        return None
    return read if math.isfinite(read) else None


def unchanged(value: object) -> object:
    """Return a category unchanged."""
    return value


def known_columns(coding: Codings, names: Collection[str]) -> Codings:
    """Return a coding, or a list of (coding, columns) without names that no sample has."""
    if not isinstance(coding, list | tuple):
        return coding
    known: list[Entry] = []
    for entry, columns in coding_entries(coding):
        listed: Any = [columns] if isinstance(columns, str) else columns
        if isinstance(listed, list | tuple):
            listed = [column for column in listed if type(column) is not str or column in names]
        known.append((entry, listed))
    return known


class FollowedRanges:
    """Moves numbers from their range among the last samples to the range that a model learned.

    Parameters
    ----------
    ranges : dict of str to (float, float)
        The learned range of each feature to follow.
    first : DataFrame
        The samples from which the ranges were learned.
    """

    def __init__(self, ranges: Mapping[str, tuple[float, float]], first: pd.DataFrame) -> None:
        self.names = list(ranges)
        self.low, self.high = np.array(list(ranges.values()), dtype=np.float64).reshape(-1, 2).T
        values = first[self.names].to_numpy(dtype=np.float64, na_value=np.nan)
        self.recent = np.full((WINDOW, len(self.names)), np.nan)
        last = np.clip(values[-WINDOW:], self.low, self.high)
        self.recent[: len(last)] = last
        self.n_noted = len(last)
        self.now = self.low, self.high

    def extend(self, ranges: Mapping[str, tuple[float, float]], last: pd.DataFrame) -> None:
        """Follow more features, whose ranges were learned from the last samples."""
        more = FollowedRanges(ranges, last)
        self.names += more.names
        self.low, self.high = np.append(self.low, more.low), np.append(self.high, more.high)
        self.recent = np.hstack([self.recent, more.recent])
        self.now = np.append(self.now[0], more.low), np.append(self.now[1], more.high)

    def note(self, values: Floats) -> None:
        """Add a sample's numbers, NaN where it has none, to the window."""
        self.recent[self.n_noted % WINDOW] = values
        self.n_noted += 1
        low, high = self.now
        if self.n_noted % WINDOW == 0 or np.any((values < low) | (values > high)):
            low = np.fmin.reduce(self.recent)
            high = np.fmax.reduce(self.recent)
            is_range = high > low  # False where the window has only NaN
            self.now = np.where(is_range, low, self.now[0]), np.where(is_range, high, self.now[1])

    def moved(self, x: dict[str, object], learns: bool) -> dict[str, object]:
        """Map a sample's finite numbers from the range of the window to the learned range."""
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


class StreamEstimator:
    """Collects the first samples, from which ranges, categories and classes are learned.

    Later features and categories are learned from the last samples, once several have them.
    """

    default_model: SDNNRegressor | SDNNClassifier
    least_targets = 1  # the number of different targets among the first samples

    def __init__(
        self,
        model: SDNNRegressor | SDNNClassifier | None = None,
        grace_period: int = 100,
        follows_ranges: bool = True,
    ) -> None:
        model_class = type(self.default_model)
        self.model = clone(self.default_model) if model is None else model
        is_model = isinstance(self.model, model_class)
        require(is_model, "model", f"be an {model_class.__name__}", model, TypeError)
        self.grace_period = whole("grace_period", grace_period, 2, 2**53)
        self.follows_ranges = flag("follows_ranges", follows_ranges)
        self.fitted: Any = None
        self.ranges: FollowedRanges | None = None
        most = max(self.grace_period, REMEMBERED)
        self.samples: collections.deque[Sample] = collections.deque(maxlen=most)
        self.targets: collections.deque[Target] = collections.deque(maxlen=most)
        self.n_learned = 0
        self.n_before_additions: int | None = None  # `n_learned` at the first addition
        self.reads: dict[str, Callable[[object], object]] = {}  # converter of each feature's values
        self.categories: dict[str, set[object]] = {}  # learned categories by feature
        self.most_columns = 0  # limit of a growing code

    def learn_one(self, x: Features, y: Target) -> None:
        """Learn one sample; an error changes nothing."""
        sample = cleaned_sample(x)
        self._check_target(y)
        if self.fitted is not None:
            self._learn(self._sample(sample, learns=True), y)
        self.samples.append(sample)
        self.targets.append(y)
        self.n_learned += 1
        if self.fitted is not None:
            self._learn_additions(sample)
        elif len(self.samples) >= self.grace_period and (
            len(set(self.targets)) >= self.least_targets
        ):
            try:
                self._begin()
            except ValueError:  # caused by a setting of the model: the samples were checked
                self.samples.pop()
                self.targets.pop()
                raise

    @abc.abstractmethod
    def _check_target(self, y: object) -> None:
        """Raise ValueError for an impossible target."""

    def _learn(self, sample: Sample, y: Target) -> None:
        self.fitted.learn_one(sample, y)

    def _sample(self, sample: Mapping[str, object], learns: bool = False) -> dict[str, object]:
        """Return the values of the known features, None for missing values."""
        read = self._read(sample)
        return read if self.ranges is None else self.ranges.moved(read, learns)

    def _read(self, sample: Mapping[str, object]) -> dict[str, object]:
        get = sample.get
        return {
            name: None if (value := get(name)) is None else as_read(value)
            for name, as_read in self.reads.items()
        }

    def _codings(self, names: list[str], new: list[str]) -> list[Coding]:
        """Return the codings of new features among all names, and set how their values are read."""
        frame = pd.DataFrame({name: [x.get(name) for x in self.samples] for name in names})
        coding = known_columns(self.model.coding, names)
        chosen = dict(zip(names, codings_of_columns(coding, names, len(names), frame), strict=True))
        codings: list[Coding] = []
        for name in new:
            coding = chosen[name]
            values = [value for x in self.samples if (value := x.get(name)) is not None]
            n_texts = sum(isinstance(value, str) for value in values)
            if not present(coding).is_numeric:
                is_mixed = coding.learns and 0 < n_texts < len(values)
                self.reads[name] = str if is_mixed else unchanged
            elif n_texts and any(number_of(value) is None for value in values):
                coding, self.reads[name] = Symbolic(), str
            else:
                self.reads[name] = number_of
            codings.append(coding if isinstance(coding, WithMissing) else WithMissing(base=coding))
        return codings

    def _frame(self) -> pd.DataFrame:
        """Return the last samples as a table, with values as the model reads them."""
        rows = list(map(self._read, self.samples))
        return pd.DataFrame({name: [row[name] for row in rows] for name in self.reads})

    def _begin(self) -> None:
        """Learn ranges, categories, classes and weights from the last samples."""
        counts = collections.Counter(
            name for x in self.samples for name in sorted(x) if x[name] is not None
        )
        fewest = min(FEWEST, max(1, len(self.samples) // 20))
        often = [name for name, count in counts.items() if count >= fewest]
        names = sorted(often[:MOST_FEATURES])  # independent of the order in dictionaries
        if not names:
            return
        self.reads, self.categories = {}, {}
        codings = self._codings(names, names)
        frame, targets = self._frame(), np.array(self.targets)
        entries = [(coding, [name]) for name, coding in zip(names, codings, strict=True)]
        options = {}
        if isinstance(self.model, SDNNClassifier):
            before = [] if self.fitted is None else self.fitted.classes_.tolist()
            options["classes"] = np.unique([*before, *self.targets])
        model = clone(self.model).set_params(coding=entries)
        self.fitted = model.partial_fit(frame, targets, **options)
        self.ranges = None
        self._follow(codings, self.fitted.codings_, frame)
        n_columns = self.fitted.network_.input_code.core.n_columns
        self.most_columns = 2 * max(COLUMN_BUDGET, n_columns)

    def _follow(
        self, codings: Sequence[Coding], fitted: Sequence[Coding], frame: pd.DataFrame
    ) -> None:
        """Follow the learned ranges of a frame's columns, and store their learned categories."""
        ranges: dict[str, tuple[float, float]] = {}
        for name, coding, learned in zip(frame, codings, fitted, strict=True):
            limits = learned.ends()
            if limits and numbers_to_range(coding, frame[name].to_numpy()) is not None:
                ranges[name] = limits
            if isinstance(base := present(learned), Symbolic) and coding.learns:
                self.categories[name] = set(base.categories or ())
        if ranges and self.follows_ranges:
            if self.ranges is None:
                self.ranges = FollowedRanges(ranges, frame)
            else:
                self.ranges.extend(ranges, frame)

    def _is_new(self, name: str, value: object) -> bool:
        """Return whether a feature, or a category of it, is not known."""
        if value is None or name not in self.reads:
            return value is not None and len(self.reads) < MOST_FEATURES
        known = self.categories.get(name)
        if known is None or len(known) >= MOST_CATEGORIES:
            return False
        return self.reads[name](value) not in known

    def _learn_additions(self, sample: Mapping[str, object]) -> None:
        """Add new features and categories, a grace period after the first of them was observed."""
        if self.n_before_additions is None:
            may_be_new = self.categories or not sample.keys() <= self.reads.keys()
            if not (may_be_new and any(self._is_new(*item) for item in sample.items())):
                return
            self.n_before_additions = self.n_learned - 1
        n_last = self.n_learned - self.n_before_additions
        if n_last < max(self.grace_period, min(self.n_learned // 10, REMEMBERED)):
            return
        self.n_before_additions = None
        new, changed = self._frequent_additions()
        if not (new or changed):
            return
        before = self.reads.copy(), self.categories.copy()
        try:
            has_grown = self._grow(new, changed)
        except BaseException:
            self.reads, self.categories = before
            raise
        if has_grown:
            for x, y in list(zip(self.samples, self.targets, strict=True))[-n_last:]:
                self._learn(self._sample(x), y)

    def _frequent_additions(self) -> tuple[list[str], dict[int, Coding]]:
        """Return new features, and the extended coding of each feature with new categories.

        Features and categories that fewer than `FEWEST` kept samples have are left out.
        """
        counts = collections.Counter(
            (name, self.reads[name](value) if name in self.reads else None)
            for x in self.samples
            for name, value in x.items()
            if self._is_new(name, value)
        )
        often = [news for news, count in counts.items() if count >= FEWEST]
        new: list[str] = []
        if isinstance(self.model.pairs, str):  # a list of pairs cannot name new features
            new = sorted(name for name, _ in often if name not in self.reads)
        changed: dict[int, Coding] = {}
        for index, name in enumerate(self.reads):
            categories = [category for other, category in often if other == name]
            if categories:
                categories.sort(key=lambda category: (isinstance(category, str), category))
                coding = self.fitted.codings_[index]
                known = (*coding.base.categories, *categories)[:MOST_CATEGORIES]
                base = dataclasses.replace(coding.base, categories=known)
                changed[index] = dataclasses.replace(coding, base=base)
        return new[: MOST_FEATURES - len(self.reads)], changed

    def _grow(self, new: list[str], changed: Mapping[int, Coding]) -> bool:
        """Add features and categories; return False if the model is trained anew instead."""
        names = list(self.reads)
        unfitted = self._codings([*names, *new], new)
        frame = self._frame()[new]
        n_units = self.fitted.network_.input_code.core.n_units
        codings = self.fitted._fit_codings(unfitted, frame.to_numpy(dtype=object), n_units)
        added = dict(zip(new, codings, strict=True))
        if not grow(self.fitted, added, changed, self.most_columns):
            self._begin()
            return False
        self._follow(unfitted, codings, frame)
        for index, coding in changed.items():
            self.categories[names[index]] = set(cast(Symbolic, present(coding)).categories or ())
        return True


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
    """

    default_model = SDNNRegressor(out_of_range="widen")

    def _check_target(self, y: Target) -> None:
        try:
            is_finite = math.isfinite(y)
        except (OverflowError, TypeError, ValueError):
            is_finite = False
        require(is_finite, "y", "be a finite number", y)

    def predict_one(self, x: Features) -> float:
        """Predict one target."""
        if self.fitted is None:
            return float(np.mean(self.targets)) if self.targets else 0.0
        return float(self.fitted.predict_one(self._sample(cleaned_sample(x))))


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
    """

    least_targets = 2

    default_model = SDNNClassifier(correction_share=0.5)

    @property
    def _multiclass(self) -> bool:  # an attribute of every classifier of river
        return True

    def _check_target(self, y: object) -> None:
        first = self.targets[0] if self.targets else y
        is_label = not is_missing(y) and isinstance(y, str) == isinstance(first, str)
        require(is_label, "y", f"be a label, like {shown(first)}", y)

    def _learn(self, sample: Sample, y: Target) -> None:
        if y not in self.fitted.classes_:
            self.fitted._bins_of_one(sample)  # raises for a bad sample before a class is added
            self.fitted._add_class(y)
        super()._learn(sample, y)

    def predict_one(self, x: Features, **_options: object) -> Target:
        """Predict one label; None before the first sample."""
        if self.fitted is not None:
            return self.fitted.predict_one(self._sample(cleaned_sample(x)))
        # Ties go to the label that was observed first.
        return max(dict.fromkeys(self.targets), key=self.targets.count, default=None)

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
        each = self.fitted.predict_proba_one(self._sample(cleaned_sample(x))).tolist()
        return dict(zip(self.fitted.classes_.tolist(), each, strict=True))
