"""The common part of the estimators for river: features that come and go, and experts."""

from __future__ import annotations

import abc
import collections
import dataclasses
import math
from collections.abc import Callable, Collection, Hashable, Mapping, Sequence
from typing import Any, cast

import numpy as np
import pandas as pd
from sklearn.base import clone

from sdnn.coding import Coding, Symbolic, WithMissing
from sdnn.coding.symbols import is_missing, present
from sdnn.estimators.classifier import SDNNClassifier
from sdnn.estimators.columns import Codings, Entry, Floats, coding_entries, codings_of_columns
from sdnn.estimators.experts import EXPERTS, Estimates, Experts
from sdnn.estimators.followed_ranges import FollowedRanges
from sdnn.estimators.growth import grow
from sdnn.estimators.inputs import with_names
from sdnn.estimators.network import COLUMN_BUDGET
from sdnn.estimators.network_settings import (
    Settings,
    change_error,
    changed_settings,
    copied,
    plain_setting,
)
from sdnn.estimators.outliers import numbers_to_range
from sdnn.estimators.regressor import SDNNRegressor
from sdnn.support.arguments import flag, require, shown, whole

Features = Mapping[Hashable, Any]  # a sample of river
Sample = dict[str, Any]
Target = Any  # a number or a label
REMEMBERED = 1000  # number of last samples kept to learn new features and categories from
FEWEST = 5  # number of kept samples that must have a new feature or category
MOST_STRAY_WORDS = 1 / 20  # largest share of words such as "n/a" among the numbers of a feature
MOST_FEATURES = 1000  # later features are ignored
MOST_CATEGORIES = 1000  # later categories of a feature count as missing values


def cleaned_sample(x: Features) -> Sample:
    """Return a sample with strings as names and None for missing values."""
    x = with_names(x)
    require(isinstance(x, Mapping), "x", "be a dict of features", x, TypeError)
    sample = {str(name): value for name, value in x.items()}
    if len(sample) < len(x):
        raise ValueError(f"x must have names that differ as text, got {shown(list(x))}")
    for name, value in sample.items():
        if type(value) is str or (type(value) is float and math.isfinite(value)):
            continue
        if is_missing(value):
            sample[name] = None
        elif not (isinstance(value, str) or is_finite_number(value)):
            expected = "finite numbers, words, or None where they are missing"
            raise ValueError(f"x must have {expected}, got {shown(value)} for {name!r}")
    return sample


def is_finite_number(value: Any) -> bool:
    """Return whether a value of any type is a finite number."""
    try:
        return math.isfinite(value)
    except (OverflowError, TypeError, ValueError):
        return False


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


class StreamEstimator:
    """Collects the first samples, from which ranges, categories and classes are learned.

    Later features and categories are learned from the last samples, once several have them.
    """

    default_model: SDNNRegressor | SDNNClassifier
    experts_class: type[Experts]
    least_targets = 1  # the number of different targets among the first samples

    def __init__(
        self,
        model: SDNNRegressor | SDNNClassifier | None = None,
        grace_period: int = 100,
        follows_ranges: bool = True,
        experts: str = "window",
    ) -> None:
        model_class = type(self.default_model)
        self.model = clone(self.default_model) if model is None else model
        is_model = isinstance(self.model, model_class)
        require(is_model, "model", f"be an {model_class.__name__}", model, TypeError)
        self.model._validate_to_begin()
        self.grace_period = whole("grace_period", grace_period, 2, 2**53)
        self.follows_ranges = flag("follows_ranges", follows_ranges)
        is_choice = isinstance(experts, str) and experts in EXPERTS
        require(is_choice, "experts", f"be one of {EXPERTS}", experts)
        self.experts = experts
        self.fitted: Any = None
        self.ranges: FollowedRanges | None = None
        most = max(self.grace_period, REMEMBERED)
        self.samples: collections.deque[Sample] = collections.deque(maxlen=most)
        self.targets: collections.deque[Target] = collections.deque(maxlen=most)
        self.n_learned = 0
        self.n_to_begin = self.grace_period  # `n_learned` at the next attempt to learn ranges
        self.n_before_additions: int | None = None  # `n_learned` at the first addition
        self.reads: dict[str, Callable[[object], object]] = {}  # converter of each feature's values
        self.categories: dict[str, set[object]] = {}  # learned categories by feature
        self.most_columns = 0  # limit of a growing code
        self.mixed: Experts | None = None  # once fitted, unless the network is alone
        self._begun_with: Settings = {}  # values of `_settings` when the stream began to learn
        self._latest: tuple[int, list[tuple[str, type, object]], Estimates] | None = None

    @property
    def weights_(self) -> dict[str, float]:
        """Present weights of the mean (or of the frequencies of labels), regression and network."""
        if self.fitted is None:
            return {self.experts_class.first: 1.0}
        return {"network": 1.0} if self.mixed is None else self.mixed.weights

    def learn_one(self, x: Features, y: Target) -> None:
        """Learn one sample; an error changes nothing."""
        self._require_same_settings()
        sample = cleaned_sample(x)
        self._check_target(y)
        self._learn_checked(sample, y)

    def _learn_checked(self, sample: Sample, y: Target) -> None:
        """Learn a cleaned sample and its checked target; an error changes nothing."""
        if self.fitted is not None:
            estimates = None if self.mixed is None else self._estimates(sample)
            self._learn(self._sample(sample, learns=True), y)
            if self.mixed is not None and estimates is not None:
                self.mixed.learn(estimates, self._targets([y])[0])
        self.samples.append(sample)
        self.targets.append(y)
        self.n_learned += 1
        if self.fitted is not None:
            self._learn_additions(sample)
        elif self.n_learned >= self.n_to_begin and len(set(self.targets)) >= self.least_targets:
            try:
                self._begin()
                if self.fitted is None:  # no feature varies yet
                    self.n_to_begin = self.n_learned + self.grace_period
            except BaseException:  # a setting of the model, or an interrupt
                self.samples.pop()
                self.targets.pop()
                self.n_learned -= 1
                self.fitted = self.mixed = None
                raise

    def _settings(self) -> Settings:
        """Return the settings that a stream that has begun cannot follow."""
        names = (*self.default_model._network_settings, "correction_share", "out_of_range")
        of_model = {f"model.{name}": getattr(self.model, name, None) for name in names}
        return {"experts": self.experts, "follows_ranges": self.follows_ranges, **of_model}

    def _require_same_settings(self) -> None:
        """Raise ValueError if a setting was changed since the stream began."""
        if not self._begun_with:
            return
        settings = self._settings()
        for name in changed_settings(self._begun_with, settings, plain_setting):
            remedy = "learn anew with a clone() of the estimator"
            raise change_error(name, self._begun_with[name], settings[name], "stream", remedy)

    @abc.abstractmethod
    def _check_target(self, y: object) -> None:
        """Raise ValueError for an impossible target."""

    @abc.abstractmethod
    def _of_network(self, sample: Sample) -> Floats:
        """Return the network's prediction, or its scores of classes, shape (n_outputs,)."""

    @abc.abstractmethod
    def _targets(self, targets: Sequence[Target]) -> Floats:
        """Return the targets of the experts, shape (n_samples, n_outputs)."""

    def _estimates(self, sample: Sample) -> Estimates:
        """Return the predictions of all experts for a sample that is not learned yet.

        They are kept, since the predicted sample is most often the next one to be learned. The key
        includes types: True equals 1, but is another value where words are read.
        """
        key = [(name, type(value), value) for name, value in sample.items()]
        latest = self._latest
        if latest is not None and latest[:2] == (self.n_learned, key):
            return latest[2]
        read = self._read(sample)
        of_network = self._of_network(self._moved(read))
        if self.mixed is None:
            estimates = Estimates(np.empty(0), of_network[None])
        else:
            estimates = self.mixed.estimates(read, of_network)
        self._latest = self.n_learned, key, estimates
        return estimates

    def _mix(self, estimates: Estimates) -> Floats:
        """Return the mean of all predictions by their weights, or the network's, (n_outputs,)."""
        return estimates.each[0] if self.mixed is None else self.mixed.mix(estimates.each)

    def _learn(self, sample: Sample, y: Target) -> None:
        self.fitted.learn_one(sample, y)

    def _sample(self, sample: Mapping[str, object], learns: bool = False) -> dict[str, object]:
        """Return the network's values of known features, None where missing.

        With `learns` the ranges that are followed also learn from the sample.
        """
        return self._moved(self._read(sample), learns)

    def _moved(self, read: Sample, learns: bool = False) -> Sample:
        """Return values as the network has them: with followed ranges, moved to learned ones."""
        return read if self.ranges is None else self.ranges.moved(read, learns)

    def _read(self, sample: Mapping[str, object]) -> dict[str, object]:
        """Return the values of known features, converted by `reads`; None where missing."""
        get = sample.get
        return {
            name: None if (value := get(name)) is None else as_read(value)
            for name, as_read in self.reads.items()
        }

    def _codings(self, names: list[str], new_names: list[str]) -> list[Coding]:
        """Return the codings of new features among all names; set their readers in `reads`.

        Every coding accepts missing values, since later samples may lack any feature.
        """
        frame = pd.DataFrame({name: [x.get(name) for x in self.samples] for name in names})
        coding = known_columns(self.model.coding, names)
        chosen = dict(zip(names, codings_of_columns(coding, names, len(names), frame), strict=True))
        codings: list[Coding] = []
        for name in new_names:
            coding = chosen[name]
            values = [value for x in self.samples if (value := x.get(name)) is not None]
            n_texts = sum(isinstance(value, str) for value in values)
            if not present(coding).is_numeric:
                is_mixed = coding.learns and 0 < n_texts < len(values)
                self.reads[name] = str if is_mixed else unchanged
            elif sum(number_of(value) is None for value in values) > MOST_STRAY_WORDS * len(values):
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
        # With fewer than 100 samples, a twentieth of them is enough.
        fewest = min(FEWEST, max(1, len(self.samples) // 20))
        frequent = [name for name, count in counts.items() if count >= fewest]
        if self._can_grow():
            frequent = [name for name in frequent if self._varies(name)]
        names = sorted(frequent[:MOST_FEATURES])  # independent of the order in dictionaries
        if not names:
            return
        self.reads, self.categories = {}, {}
        codings = self._codings(names, names)
        frame, targets = self._frame(), np.array(self.targets)
        entries = [(coding, [name]) for name, coding in zip(names, codings, strict=True)]
        options = {}
        if isinstance(self.model, SDNNClassifier):
            known_classes = [] if self.fitted is None else self.fitted.classes_.tolist()
            options["classes"] = np.unique([*known_classes, *self.targets])
        model = clone(self.model).set_params(coding=entries)
        self.fitted = model.partial_fit(frame, targets, **options)
        self.ranges = None
        self._follow(codings, self.fitted.codings_, frame)
        self._begin_experts(names)
        n_columns = self.fitted.network_.input_code.core.n_columns
        self.most_columns = 2 * max(COLUMN_BUDGET, n_columns)  # beyond it `_grow` begins anew
        self._begun_with = {name: copied(value) for name, value in self._settings().items()}

    def _begin_experts(self, names: Sequence[str]) -> None:
        """Let the experts beside the network learn the last samples; their weights stay."""
        if self.experts == "network":
            return
        codings = dict(zip(names, self.fitted.codings_, strict=True))
        rows, targets = list(map(self._read, self.samples)), self._targets(self.targets)
        if self.mixed is None:
            self.mixed = self.experts_class(codings, rows, targets, self.experts == "window")
        else:
            self.mixed.begin(codings, rows, targets)

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

    def _can_grow(self) -> bool:
        """Return whether features may be learned later: the model has none by its number."""
        if not isinstance(self.model.pairs, str):  # a list of pairs cannot name new features
            return False
        if not isinstance(self.model.coding, list | tuple):
            return True
        return all(
            isinstance(columns, str)
            or (isinstance(columns, list | tuple) and all(type(c) is str for c in columns))
            for _, columns in coding_entries(self.model.coding)
        )

    def _varies(self, name: str) -> bool:
        """Return whether a feature has a range to learn; one of words learns new words later."""
        first, *others = (sample.get(name) for sample in self.samples)
        return isinstance(first, str) or any(value != first for value in others)

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
            # Most samples have no other names: without categories none of them can be new.
            may_be_new = self.categories or not sample.keys() <= self.reads.keys()
            if not (may_be_new and any(self._is_new(*item) for item in sample.items())):
                return
            self.n_before_additions = self.n_learned - 1
        n_last = self.n_learned - self.n_before_additions  # samples since the first addition
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
        if (
            has_grown
        ):  # the new weights are 0; a model that is trained anew has learned these samples
            for x, y in list(zip(self.samples, self.targets, strict=True))[-n_last:]:
                self._learn(self._sample(x), y)

    def _frequent_additions(self) -> tuple[list[str], dict[int, Coding]]:
        """Return new features, and the extended codings of features with new categories.

        The latter are by the number of the feature. Features and categories that fewer than
        `FEWEST` kept samples have are left out.
        """
        # An addition is (name, category), or (name, None) for a new feature.
        counts = collections.Counter(
            (name, self.reads[name](value) if name in self.reads else None)
            for x in self.samples
            for name, value in x.items()
            if self._is_new(name, value)
        )
        frequent = [addition for addition, count in counts.items() if count >= FEWEST]
        new: list[str] = []
        if isinstance(self.model.pairs, str):
            later = (name for name, _ in frequent if name not in self.reads)
            new = sorted(name for name in later if self._varies(name))
        changed: dict[int, Coding] = {}
        for index, name in enumerate(self.reads):
            categories = [category for other, category in frequent if other == name]
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
        codings = self.fitted._fit_codings(unfitted, frame.to_numpy(dtype=object), n_units, new)
        added = dict(zip(new, codings, strict=True))
        if not grow(self.fitted, added, changed, self.most_columns):
            self._begin()
            return False
        self._follow(unfitted, codings, frame)
        for index, coding in changed.items():
            self.categories[names[index]] = set(cast(Symbolic, present(coding)).categories or ())
        if self.mixed is not None:
            more = added | {names[index]: coding for index, coding in changed.items()}
            self.mixed.add(more, list(map(self._read, self.samples)))
        return True
