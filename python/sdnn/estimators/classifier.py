"""The classifier: selective desensitization and perceptrons."""

from __future__ import annotations

import dataclasses
from contextlib import suppress
from typing import Any, Self, cast

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar
from scipy.special import log_softmax
from sklearn.utils.metaestimators import available_if
from sklearn.utils.multiclass import _ovr_decision_function, unique_labels

from sdnn import _core
from sdnn.estimators.base import BaseSDNN
from sdnn.estimators.calibration import HeldOut, learn_without_fifth
from sdnn.estimators.columns import Array, Floats, Ints, Sample
from sdnn.estimators.fitted import STEEPNESSES, mean_of
from sdnn.estimators.inputs import CodedClassifier
from sdnn.estimators.network import Network, Rule
from sdnn.estimators.parameters import SHARE, documents, parameter, wholes, words
from sdnn.estimators.training import (
    TooFewSamplesError,
    class_weights,
    sample_weights,
    weighted_mean,
    without_classes,
)
from sdnn.support.arguments import explains_names, require, shown

# Chosen constants, except where a reason is given.
UNITS_EACH = 60  # units per class by default
MOST_UNITS = 1200  # units of all classes by default
FIRING_SHARE = 5 / 6  # share of a class's units for its samples; the rest fires for other classes
STEEPNESS = 6.0  # factor of scores in the softmax
MOST_CALIBRATED = 10_000  # samples: with 100,000, calibration lowers the log loss by 0.002 only


@explains_names()
@documents(BaseSDNN)
@dataclasses.dataclass(kw_only=True, eq=False, repr=False)
class SDNNClassifier(CodedClassifier, BaseSDNN):
    """Classification by a selective desensitization neural network, exact and online.

    Each input becomes a binary pattern; selective desensitization combines the patterns of each two
    inputs; integer units are trained over this code, several per class, whose firing count is its
    score, or one per class or pair of classes. Sources: Nonaka, Tanaka and Morita 2011 (the code);
    Auer, Burgsteiner and Maass 2008 (the p-delta rule); the manual of LIBSDNN (single units).

    Parameters
    ----------
    out_of_range : {"clip", "error"}, default="clip"
        Whether inputs to learn outside their range are clipped, with an `OutOfRangeWarning`.
    scheme : {"one_vs_rest", "one_vs_one"}, default="one_vs_rest"
        Units per class, of which the largest score wins; or one per pair of classes, which vote.
    n_units_per_class : int, optional
        Units per class. Five sixths of the units of a sample's class are trained to fire and one
        sixth of those of other classes, so that units may specialize. With 1, the potential is the
        score. None: 60, or fewer from 20 classes on (1,200 in all); 1 with "one_vs_one".
    class_weight : "balanced" or dict, optional
        Mean number of presentations per epoch of `fit` of each class's samples.
    calibrate : bool, optional
        Whether `fit` also trains a network without a fifth of each class, and gives `predict_proba`
        the steepness with the smallest log loss on it, in about twice the time. Needs several units
        per class and ten samples. None: for up to 10,000 samples that allow it, without a warm
        start.

    Attributes
    ----------
    steepness_ : float
        Only after a calibration: the factor of scores in the softmax of `predict_proba`, which is
        6 otherwise.
    classes_ : ndarray, shape (n_classes,)
        The labels, sorted; a `RiverClassifier` appends later labels in the order of the stream.
    validation_scores_ : ndarray, shape (n_epochs,) or (0,)
        With early stopping, the accuracy on the held-out samples.

    Examples
    --------
    >>> from sklearn.datasets import load_iris
    >>> from sdnn import SDNNClassifier
    >>> X, y = load_iris(return_X_y=True)
    >>> model = SDNNClassifier(random_state=0).fit(X[::2], y[::2])
    >>> bool(model.score(X[1::2], y[1::2]) > 0.9)
    True
    """

    scheme: str = parameter("one_vs_rest", words(*_core.CLASS_SCHEMES))
    n_units_per_class: int | None = parameter(None, wholes(1, 1024), None)
    correction_share: float = parameter(0.25, SHARE)
    calibrate: bool | None = parameter(None, "boolean", None)

    _network_settings = (*BaseSDNN._network_settings, "scheme", "n_units_per_class")

    def _fit(self, X: ArrayLike, y: ArrayLike, sample_weight: ArrayLike | None) -> None:
        """Train, and with `calibrate` fit the steepness of probabilities to held-out samples."""
        may_be = not self.calibrate or self._has_several_units()
        expected = "be False with a single unit per class, which has no probabilities"
        require(may_be, "calibrate", expected, self.calibrate)
        super()._fit(X, y, sample_weight)
        self.__dict__.pop("steepness_", None)  # of an earlier fit
        labels = np.ravel(np.asarray(y))  # a column is also accepted
        may_calibrate = self._has_several_units() and not self.warm_start
        if self.calibrate:
            self._calibrate(X, labels, sample_weight)
        elif self.calibrate is None and may_calibrate and len(labels) <= MOST_CALIBRATED:
            with suppress(TooFewSamplesError):
                self._calibrate(X, labels, sample_weight)

    def _calibrate(self, X: ArrayLike, labels: Array, sample_weight: ArrayLike | None) -> None:
        """Fit the steepness to samples that a second network has not learned."""
        held = learn_without_fifth(self, X, labels, sample_weight, is_stratified=True)
        self.steepness_ = self._calibrated_steepness(held, class_weights(self.class_weight, labels))

    def _calibrated_steepness(self, held: HeldOut, by_class: Floats | None) -> float:
        """Return the steepness with the smallest log loss on samples that are held out.

        ``by_class`` are the weights of all samples by their classes. Half a sample more has a
        random class: few samples may all be predicted rightly, and then no steepness is too large.
        """
        model = cast(SDNNClassifier, held.model)
        scores = model._scores(model._bins(held.X), self._n_threads())
        targets = model._targets(held.y)
        weights = held.weights if by_class is None else held.weights * by_class[held.rows]
        if not weights.any():
            raise TooFewSamplesError(
                "calibrate must be False where all samples that are held out have no weight"
            )
        share = 0.5 / (0.5 + float(weights.sum()))

        def loss(log_steepness: float) -> float:
            """Return the cross entropy of the smoothed targets, for a search over the steepness."""
            logarithms = log_softmax(np.exp(log_steepness) * scores, axis=1)
            of_targets = logarithms[np.arange(len(targets)), targets]
            losses = -(1 - share) * of_targets - share * logarithms.mean(axis=1)
            return weighted_mean(losses, weights)

        best = minimize_scalar(loss, bounds=np.log(STEEPNESSES), method="bounded").x
        return float(np.clip(np.exp(best), *STEEPNESSES))

    def partial_fit(
        self,
        X: ArrayLike,
        y: ArrayLike,
        classes: ArrayLike | None = None,
        sample_weight: ArrayLike | None = None,
    ) -> Self:
        """Present the samples once, in order, as `SDNNRegressor.partial_fit` does.

        ``classes``, all labels that can occur, must be given in the first call. Errors: see `fit`.
        """
        self._require_classes(classes)
        return self._partial_fit(X, y, classes, sample_weight)

    def learn_one(self, x: Sample, y: object, classes: ArrayLike | None = None) -> Self:
        """Learn one sample, as `SDNNRegressor.learn_one` does; ``classes`` as in `partial_fit`."""
        self._require_classes(classes)
        return self._learn_one(x, np.array([y]), classes)

    def predict_one(self, x: Sample) -> Any:
        """Predict the label of one sample, given as to `learn_one`."""
        decision = self._decision(self._bins_of_one(x), n_threads=1)
        return self.classes_[self._winners(decision)[0]]

    def decision_function(self, X: ArrayLike) -> Floats:
        """Return the score of each class, shape (n_samples, n_classes).

        A score is the share of the class's units that fire, the potential of a single unit, or with
        "one_vs_one" the votes, where potentials break ties. Two classes: shape (n_samples,),
        positive for the second.
        """
        return self._decision(self._bins(X), self._n_threads())

    def _has_several_units(self) -> bool:
        return self.scheme == "one_vs_rest" and self.n_units_per_class != 1

    @available_if(_has_several_units)  # type: ignore[untyped-decorator]
    def predict_proba(self, X: ArrayLike) -> Floats:
        """Return a softmax of the scores, shape (n_samples, n_classes).

        Its steepness is fitted to held-out samples (see ``calibrate``), or else a constant; see
        also scikit-learn's `CalibratedClassifierCV`. Needs several units per class.
        """
        return self._probabilities(self._bins(X), self._n_threads())

    @available_if(_has_several_units)  # type: ignore[untyped-decorator]
    def predict_proba_one(self, x: Sample) -> Floats:
        """Return `predict_proba` of one sample, given as to `learn_one`, shape (n_classes,)."""
        probabilities: Floats = self._probabilities(self._bins_of_one(x), n_threads=1)[0]
        return probabilities

    def _validate_to_begin(self) -> None:
        super()._validate_to_begin()
        self._refuse_class_weight()

    def _refuse_class_weight(self) -> None:
        if self.class_weight is not None:
            raise ValueError(f"class_weight works in fit only, got {shown(self.class_weight)}")

    def _require_classes(self, classes: ArrayLike | None) -> None:
        """Raise ValueError for a class weight, or if the first call lacks the classes."""
        self._refuse_class_weight()
        if classes is None and not hasattr(self, "network_"):
            raise ValueError("classes must be given in the first call of partial_fit or learn_one")

    def _set_outputs(self, y: ArrayLike) -> int:
        """Note the classes and the number of units of each; return the number of units."""
        self._set_classes(y)
        n_classes = len(self.classes_)
        may_be_several, n_units_each = self.scheme == "one_vs_rest", self.n_units_per_class
        fits = may_be_several or n_units_each is None or n_units_each == 1
        require(fits, "n_units_per_class", "be 1 or None with scheme='one_vs_one'", n_units_each)
        if n_units_each is None:
            n_units_each = min(UNITS_EACH, max(2, MOST_UNITS // n_classes)) if may_be_several else 1
        self._scheme = self.scheme
        self._n_units_each = n_units_each
        return _core.n_units_for(self.scheme, n_classes) * n_units_each

    def _add_class(self, label: object) -> None:
        """Add a class as the last one, with untrained units."""
        classes = np.append(self.classes_, [label])
        is_alike = classes.dtype.kind == self.classes_.dtype.kind and label == label  # no NaN
        is_alike = is_alike and isinstance(label, str) == isinstance(self.classes_[0], str)
        if self._scheme != "one_vs_rest" or not is_alike or label in self.classes_:
            raise ValueError(
                f"y must be one of {self.classes_.tolist()}, or a new label of their type with "
                f"scheme='one_vs_rest', got {shown(label)}"
            )
        network = self.network_
        n_units = _core.n_units_for(self._scheme, len(classes)) * self._n_units_each
        untrained = Network(network.input_code, n_units, seed=self._weight_seed).layer
        weights, thresholds = untrained.weights, untrained.thresholds
        weights[: network.n_units] = network.layer.weights
        thresholds[: network.n_units] = network.layer.thresholds
        self.network_ = Network(network.input_code, n_units, weights=weights, thresholds=thresholds)
        self._earlier = ()
        self.classes_ = classes

    def _check_outputs(self, y: Array, classes: ArrayLike | None) -> None:
        """Raise ValueError for classes other than those of the first call."""
        known = np.sort(self.classes_)
        if classes is not None and not np.array_equal(unique_labels(classes), known):
            raise ValueError(
                f"classes={classes!r} are not those of the first call, {self.classes_!r}"
            )

    def _targets(self, y: Array, at_once: bool = False) -> Ints:
        """Return the indices of labels among the classes."""
        unseen = np.setdiff1d(y, self.classes_)
        if len(unseen):
            raise ValueError(
                f"y has labels {unseen.tolist()} that are not in classes, {self.classes_.tolist()}"
            )
        order = np.argsort(self.classes_)
        return order[np.searchsorted(self.classes_, y, sorter=order)].astype(np.int32)

    def _rule_arguments(self, targets: Ints) -> Rule:
        """Return what the learning rule needs: labels, or how many units should fire."""
        n_classes = len(self.classes_)
        if self._n_units_each == 1:
            return targets, n_classes, self._scheme
        is_target = targets[:, None] == np.arange(n_classes)
        counts = self._n_units_each * np.where(is_target, FIRING_SHARE, 1 - FIRING_SHARE)
        return counts, self.correction_share

    def _presentations(self, targets: Ints, weights: Floats | None) -> Floats | None:
        """Return the weight of each sample, times that of its class; None if all are equal."""
        labels = self.classes_[targets]
        absent = np.setdiff1d(self.classes_, labels).tolist()  # all of them may be held out
        by_class = class_weights(without_classes(self.class_weight, absent), labels)
        if by_class is None or weights is None:
            return weights if by_class is None else by_class
        product = by_class * weights
        return sample_weights(product, len(targets), name="class_weight times sample_weight")

    def _validation_score(self, bins: Ints, targets: Ints, weights: Floats | None) -> float:
        winners = self._winners(self._decision(bins, self._n_threads()))
        return weighted_mean(winners == targets, weights)

    def _scores(self, bins: Ints, n_threads: int) -> Floats:
        """Return the share of each class's units that fire, shape (n_samples, n_classes)."""
        return mean_of(self._counts(bins, len(self.classes_), n_threads)) / self._n_units_each

    def _probabilities(self, bins: Ints, n_threads: int) -> Floats:
        """Return the softmax of the scores, with a fixed or calibrated steepness."""
        scores = self._scores(bins, n_threads)
        steepness = getattr(self, "steepness_", STEEPNESS)  # absent without a calibration
        raised = np.exp(steepness * (scores - scores.max(axis=1, keepdims=True)))
        probabilities: Floats = raised / raised.sum(axis=1, keepdims=True)
        return probabilities

    def _decision(self, bins: Ints, n_threads: int) -> Floats:
        """Return the values of ``decision_function``: one column for two classes."""
        n_classes = len(self.classes_)
        if self._n_units_each > 1:
            scores = self._scores(bins, n_threads)
        else:
            networks = self._networks_for(len(bins))
            each = [network.potentials(bins, n_threads) for network in networks]
            scores = mean_of(each).astype(np.float64)
        if self._scheme == "one_vs_rest":
            return scores[:, 1] - scores[:, 0] if n_classes == 2 else scores
        # A firing unit (potential above 0) votes for the first class of its pair.
        margins = scores - 0.5
        if n_classes == 2:
            return -margins[:, 0]
        decision: Floats = _ovr_decision_function(margins <= 0, -margins, n_classes)
        return decision
