"""The regressor: selective desensitization and the p-delta rule."""

from __future__ import annotations

import dataclasses
from typing import Self, cast

import numpy as np
from numpy.typing import ArrayLike

from sdnn.estimators.base import BaseSDNN, OutOfRangeWarning
from sdnn.estimators.calibration import learn_without_fifth
from sdnn.estimators.columns import Array, Floats, Ints, Sample
from sdnn.estimators.fitted import mean_of
from sdnn.estimators.inputs import CodedRegressor
from sdnn.estimators.intervals import coverage_of, error_bounds
from sdnn.estimators.network import Rule
from sdnn.estimators.outliers import warn_caller
from sdnn.estimators.parameters import documents, parameter, wholes, words
from sdnn.estimators.training import Rows, weighted_mean
from sdnn.support.arguments import array_of, explains_names, require, shown

MARGIN = 0.2  # share of the range of targets that is added on either side: a chosen constant
FURTHEST = 1e300  # largest limit of an output range, so that its width is finite


@explains_names()
@documents(BaseSDNN)
@dataclasses.dataclass(kw_only=True, eq=False, repr=False)
class SDNNRegressor(CodedRegressor, BaseSDNN):
    """Regression by a selective desensitization neural network, exact and online.

    Each input becomes a binary pattern, selective desensitization combines the patterns of each two
    inputs, and the number of integer units that fire over this code is the output. The p-delta rule
    corrects only the units nearest to their threshold. Sources: Nonaka, Tanaka and Morita 2011 (the
    network); Auer, Burgsteiner and Maass 2008 (the rule).

    Parameters
    ----------
    n_output_units : int, default=280
        Units per output, which divide the output range into as many steps.
    output_range : (float, float) or array_like of shape (n_outputs, 2), optional
        Smallest and largest output; None widens the range of the first targets by a fifth on
        either side.
    out_of_range : {"clip", "widen", "error"}, default="clip"
        Treatment of targets outside the output range; "widen" stretches the learned function,
        for each sample of a stream by its width and margins at most. Inputs outside their range are
        clipped, or in learning refused with "error". The first causes an `OutOfRangeWarning`.
    refit : bool, default=False
        Whether early stopping trains again on the whole sample, for the best number of epochs.
    calibrate : bool, default=False
        Whether `fit` also trains a network without a fifth of the samples, whose errors on it are
        the base of `predict_interval`, in about twice the time. Needs ten samples.

    Attributes
    ----------
    output_range_ : ndarray, shape (n_outputs, 2)
    n_outputs_, n_outputs_out_of_range_ : int
        Number of outputs, and of targets outside the range since the last `fit`.
    held_out_residuals_, held_out_counts_ : ndarray
        With ``calibrate``: the errors on the held-out samples, shape (n_samples, n_outputs), and
        the weights of these samples.
    validation_scores_ : ndarray, shape (n_epochs,) or (0,)
        With early stopping, minus the mean squared error in units of the firing count.

    Examples
    --------
    >>> import numpy as np
    >>> from sdnn import SDNNRegressor
    >>> X = np.random.RandomState(0).uniform(size=(400, 2))
    >>> y = np.sin(6 * X[:, 0]) * X[:, 1]
    >>> model = SDNNRegressor(n_pattern_units=400, max_iter=100, random_state=0).fit(X, y)
    >>> bool(model.score(X, y) > 0.99)
    True
    >>> model.predict(X[:3]).shape
    (3,)
    """

    n_output_units: int = parameter(280, wholes(1, 2**20))
    output_range: ArrayLike | None = parameter(None, "array-like", None)
    out_of_range: str = parameter("clip", words("clip", "widen", "error"))
    refit: bool = parameter(False, "boolean")
    calibrate: bool = parameter(False, "boolean")

    _network_settings = (*BaseSDNN._network_settings, "n_output_units", "output_range")
    _largest_full_sample = 50_000

    def partial_fit(
        self, X: ArrayLike, y: ArrayLike, sample_weight: ArrayLike | None = None
    ) -> Self:
        """Present the samples once, in order; any portions give the same weights.

        ``sample_weight`` is the mean number of presentations: samples of weight 2 are presented
        twice, and every other sample of weight 1/2.

        The weights equal those of `fit` with ``max_iter=1, shuffle=False`` if ranges and categories
        are given; otherwise the first call learns them. With ``out_of_range="widen"`` targets widen
        the range one after the other, not all at once as in `fit`. Errors: see `fit`.
        """
        return self._partial_fit(X, y, None, sample_weight)

    def learn_one(self, x: Sample, y: ArrayLike) -> Self:
        """Learn one sample: `partial_fit` of one row, to the same bits, without its overhead.

        ``x`` is a row or a mapping from feature names to values, which may lack features coded with
        `WithMissing`. An error changes nothing.

        >>> from sdnn.coding import RandomInverse
        >>> unit = RandomInverse(low=0.0, high=1.0)
        >>> model = SDNNRegressor(unit, output_range=(0, 1), n_pattern_units=64, random_state=0)
        >>> for _ in range(20):
        ...     model = model.learn_one({"a": 0.2, "b": 0.9}, 0.75)
        >>> model.predict_one({"a": 0.2, "b": 0.9})
        0.75
        """
        try:
            targets = np.array(y, dtype=np.float64)
        except (TypeError, ValueError):
            raise ValueError(f"y must be a number or one per output, got {shown(y)}") from None
        is_finite = targets.ndim <= 1 and np.isfinite(targets).all()
        require(is_finite, "y", "be a finite number or one per output", y)
        return self._learn_one(x, targets[None], None)

    def predict_one(self, x: Sample) -> float | Floats:
        """Predict a sample given as to `learn_one`: a float, or shape (n_outputs,)."""
        counts = self._counts(self._bins_of_one(x), self.n_outputs_, n_threads=1)
        values = self._outputs_of_counts(mean_of(counts))[0]
        return float(values[0]) if self._flat else values

    def predict(self, X: ArrayLike, return_std: bool = False) -> Floats | tuple[Floats, Floats]:
        """Predict the outputs of samples, shape (n_samples,) or (n_samples, n_outputs).

        ``return_std`` adds the standard deviation over the averaged epochs, which shows how settled
        a prediction is (not the noise of the targets).
        """
        counts = self._counts(self._bins(X), self.n_outputs_, self._n_threads())
        values = self._outputs_of_counts(mean_of(counts))
        if not return_std:
            return values[:, 0] if self._flat else values
        spread = self._step() * np.std(counts, axis=0)
        return (values[:, 0], spread[:, 0]) if self._flat else (values, spread)

    def predict_interval(self, X: ArrayLike, coverage: float = 0.9) -> Floats:
        """Predict lower and upper bounds of targets, shape (n_samples, 2).

        A target lies between them with a probability of at least about ``coverage``, if samples are
        drawn like those of `fit`: bounds are those of the errors of the samples that a second
        network had not learned. All have the same width. Several outputs have a shape of
        (n_samples, n_outputs, 2), and each the coverage apart. Weights count as numbers of samples.

        Raises
        ------
        AttributeError
            If the model was not fitted with ``calibrate=True``, or has learned more since.
        ValueError
            If ``coverage`` is not within (0, 1), or needs more samples than were held out.
        """
        share = coverage_of(coverage)
        outputs = self.predict(X)  # first, since it raises if the model is not fitted
        if not hasattr(self, "held_out_residuals_"):
            raise AttributeError(
                "predict_interval needs a fit with calibrate=True, and nothing learned after it"
            )
        widths = error_bounds(np.abs(self.held_out_residuals_), self.held_out_counts_, share)
        width: Array = widths[0] if self._flat else widths
        return np.stack([outputs - width, outputs + width], axis=-1)

    def _fit(self, X: ArrayLike, y: ArrayLike, sample_weight: ArrayLike | None) -> None:
        """Train, and with `calibrate` note the errors of samples that another network held out."""
        super()._fit(X, y, sample_weight)
        self._forget_held_out()
        if self.calibrate:
            held = learn_without_fifth(self, X, y, sample_weight, is_stratified=False)
            errors = held.y.astype(np.float64) - cast(SDNNRegressor, held.model).predict(held.X)
            self.held_out_residuals_ = errors.reshape(len(errors), -1)
            self.held_out_counts_ = held.weights

    def _forget_held_out(self) -> None:
        """Delete the errors of held-out samples, which are those of an earlier network."""
        self.__dict__.pop("held_out_residuals_", None)
        self.__dict__.pop("held_out_counts_", None)

    def _learn(self, bins: Ints, targets: Array) -> None:
        self._forget_held_out()
        super()._learn(bins, targets)

    def _set_outputs(self, y: ArrayLike) -> int:
        """Note the outputs and their range; return the number of units."""
        targets = np.asarray(y)
        self._flat = targets.ndim == 1
        targets = targets.reshape(len(targets), -1)
        self.n_outputs_ = targets.shape[1]
        self.output_range_ = self._fitted_output_range(targets)
        self.n_outputs_out_of_range_ = 0
        self._counts_of_range = self.n_output_units
        return self.n_outputs_ * self.n_output_units

    def _check_outputs(self, y: Floats, classes: ArrayLike | None) -> None:
        """Refuse targets with another number of outputs than at the first ``fit``."""
        n_outputs = y.shape[1] if y.ndim > 1 else 1
        if n_outputs != self.n_outputs_:
            raise ValueError(
                f"y must have as many outputs as before, {self.n_outputs_}, got {n_outputs}"
            )

    def _targets_to_learn(self, bins: Ints, targets: Floats, weights: Floats | None) -> Floats:
        """Return for each sample the mean target of all samples with its code.

        Otherwise the network would follow the noise of the last presented sample.
        """
        codes, code_of_sample = np.unique(bins, axis=0, return_inverse=True)
        if len(codes) == len(bins):
            return targets
        code_of_sample = code_of_sample.reshape(-1)  # NumPy 2.0 returns a column
        counts = np.bincount(code_of_sample, weights)
        weighted = targets if weights is None else targets * weights[:, None]
        means = [np.bincount(code_of_sample, column) / counts for column in weighted.T]
        return np.ascontiguousarray(np.stack(means, axis=1)[code_of_sample])

    def _rule_arguments(self, targets: Floats) -> Rule:
        return targets, self.correction_share

    def _validation_score(self, bins: Ints, targets: Floats, weights: Floats | None) -> float:
        counts = self.network_.counts(bins, self.n_outputs_, self._n_threads())
        return -weighted_mean((targets - counts) ** 2, weights)

    def _fitted_output_range(self, targets: Floats) -> Floats:
        """Return the range of each output: `output_range`, or that of the targets and a margin."""
        if self.output_range is not None:
            try:
                ranges = array_of("output_range", self.output_range, "iuf").astype(np.float64)
            except ValueError:  # rows of different lengths, or numbers beyond all floats
                ranges = np.empty(0)
            ranges = np.tile(ranges, (self.n_outputs_, 1)) if ranges.ndim == 1 else ranges
            is_range = (
                ranges.shape == (self.n_outputs_, 2)
                and np.all(ranges[:, 0] < ranges[:, 1])
                and np.all(np.abs(ranges) <= FURTHEST)
            )
            expected = f"be (low, high) or one row (low, high) per output, within {FURTHEST}"
            require(is_range, "output_range", f"{expected}, low < high", self.output_range)
            return ranges
        self._require_two_samples(targets, "the output_range that is not given")
        low, high = self._ranges_of(targets)
        if np.any(np.maximum(-low, high) > FURTHEST):
            raise ValueError(f"y must be within {FURTHEST}, got [{low.min()}, {high.max()}]")
        # A constant target has no width: its margin is its size, at least 1.
        margin = np.where(high > low, MARGIN * (high - low), np.maximum(1.0, np.abs(low)))
        return np.stack([low - margin, high + margin], axis=1)

    def _step(self) -> Floats:
        """Return the change of an output per unit, shape (n_outputs,)."""
        width: Floats = self.output_range_[:, 1] - self.output_range_[:, 0]
        return width / self._counts_of_range

    def _counts_of_targets(self, targets: Floats) -> Floats:
        """Convert targets to firing counts, which are not rounded."""
        with np.errstate(over="ignore"):  # a target far beyond a narrow range
            counts = (targets - self.output_range_[:, 0]) / self._step()
        return np.clip(counts, -FURTHEST, FURTHEST)

    def _outputs_of_counts(self, counts: Array) -> Floats:
        """Convert firing counts to outputs, shape (n_samples, n_outputs)."""
        return self._step() * counts + self.output_range_[:, 0]

    def _targets(self, y: Floats, at_once: bool = False) -> Floats:
        """Convert targets to firing counts; ``out_of_range`` decides about those out of range."""
        targets = y.reshape(len(y), -1)
        counts = self._counts_of_targets(targets)
        if counts.min() >= 0 and counts.max() <= self._counts_of_range:
            return counts
        low, high = self.output_range_.T
        outside = (targets < low) | (targets > high)
        if not outside.any():  # only the rounded counts are outside
            return counts
        row, output = np.argwhere(outside)[0].tolist()
        problem = (
            f"y has {targets[row, output]}, beyond output_range_ [{low[output]}, {high[output]}]"
        )
        if self.out_of_range == "error":
            raise ValueError(f"{problem}, but out_of_range is 'error'")
        if self._warns and self.n_outputs_out_of_range_ == 0 and not self._has_outliers:
            effect = "are clipped" if self.out_of_range == "clip" else "widen it"
            warn_caller(f"{problem}: values outside the range {effect}", OutOfRangeWarning)
        if self.out_of_range == "clip" or at_once:
            self.n_outputs_out_of_range_ += int(np.count_nonzero(outside))
        if self.out_of_range == "clip":
            return counts
        if not at_once:
            return self._counts_while_widening(targets, np.flatnonzero(outside.any(axis=1)))
        self._widen(targets.min(axis=0))
        self._widen(targets.max(axis=0))
        return self._counts_of_targets(targets)

    def _counts_while_widening(self, targets: Floats, rows: Rows) -> Floats:
        """Widen the range by targets, one after the other, and return the counts of all targets.

        ``rows`` are those with a target outside the range. Each target has the count of the range
        that it and the targets before it leave, as if it had come alone.
        """
        counts = np.empty_like(targets)
        begin = 0
        for row in rows.tolist():
            counts[begin:row] = self._counts_of_targets(targets[begin:row])
            begin = row
            low, high = self.output_range_.T
            # An outlier widens the range by at most its width on either side.
            nearest = targets[row].clip(2 * low - high, 2 * high - low)
            self.n_outputs_out_of_range_ += self._widen(nearest)
        counts[begin:] = self._counts_of_targets(targets[begin:])
        return counts

    def _widen(self, targets: Floats) -> int:
        """Widen the output ranges to one sample's targets; return the number of ranges widened."""
        low, high = self.output_range_.T
        new_low = np.where(targets < low, targets - MARGIN * (high - targets), low)
        new_high = np.where(targets > high, targets + MARGIN * (targets - low), high)
        if not np.all(np.isfinite(new_high - new_low)):
            raise ValueError(f"y has {targets}: no range can be so wide")
        n_widened = int(np.count_nonzero((new_low < low) | (new_high > high)))
        self.output_range_ = np.stack([new_low, new_high], axis=1)
        return n_widened
