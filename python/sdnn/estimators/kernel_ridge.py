"""Ridge regression and classification with the kernel that the network approaches."""

from __future__ import annotations

import dataclasses
from numbers import Real

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar
from scipy.special import log_softmax, softmax
from sklearn.utils import check_random_state
from sklearn.utils._param_validation import Interval
from sklearn.utils.validation import check_is_fitted

from sdnn.coding.kernel import N_UNITS, AnalyticKernel
from sdnn.estimators.columns import Array, Floats, PairChoice, input_pairs
from sdnn.estimators.inputs import CodedClassifier, CodedInputs, CodedRegressor
from sdnn.estimators.intervals import coverage_of, error_bounds, log_sizes
from sdnn.estimators.parameters import RandomState, documents, parameter, wholes, words
from sdnn.estimators.ridge import (
    Samples,
    Solution,
    diagonal,
    low_rank_diagonal,
    row_blocks,
    solve,
    solve_for,
)
from sdnn.estimators.training import Rows, class_weights, sample_weights
from sdnn.support.arguments import explains_names, flag, real

AUTO = words("auto")
DEGREES = (1, 2, 3)
LARGEST_TARGET = 1e140  # so that sums of squares are finite
LOG_STEEPNESS = (0.0, 5.0)  # bounds, for the softmax of scores
LOG_OF_TEN = np.log(10.0)


def apply_degree(kernel: Floats, degree: int) -> Floats:
    """Turn a kernel, in place, into the kernel of functions of up to ``2 * degree`` inputs."""
    if degree == 2:
        kernel *= 0.5 + 0.5 * kernel
    elif degree == 3:
        kernel *= kernel * kernel
    return kernel


@dataclasses.dataclass(kw_only=True, eq=False, repr=False)
class BaseKernelRidge(CodedInputs):
    """Base class of `SDNNKernelRidge` and `SDNNKernelClassifier`, with the parameters of both.

    Parameters
    ----------
    coding : str, Coding, or list of (str or Coding, columns), default="random-inverse"
        As for `SDNNRegressor`.
    ranges : {"auto", "all", "robust"}, default="auto"
        Whether learned ranges leave out outliers, and clip targets; "auto" those farthest away,
        with an `OutlierWarning`.
    alpha : float or "auto", default="auto"
        Strength of the penalty, above 0. "auto" takes the value with the smallest error when
        each sample is left out, by a closed formula.
    degree : {1, 2, 3} or "auto", default="auto"
        The kernel k itself, (k + k^2) / 2 or k^3: functions of up to 2, 4 or 6 inputs. "auto" takes
        the degree with the smallest leave-one-out error.
    pairs : "all" or list of (modified, modifier), default="all"
        Pairs of features, by number or name; a modifier of None leaves a pattern plain. All pairs
        are as fast as one per feature.
    max_components : int, default=2000
        Most samples that span the solution. Up to this number it is exact, beyond that of low
        rank (Nystroem's method).
    random_state : int, RandomState or None, default=None
        Draws the components from more samples.

    Attributes
    ----------
    kernel_ : AnalyticKernel
        The kernel k.
    alpha_, degree_ : float, int
        The penalty and the degree in use.
    leave_one_out_error_ : float
        Mean squared error when each sample is left out, in variances of the targets.
    X_fit_ : ndarray, shape (n_components, n_features)
    dual_coef_, intercept_ : ndarray, shapes (n_components, n_outputs) and (n_outputs,)
        Outputs are ``kernel @ dual_coef_ + intercept_``, with the kernel of the degree.
    n_features_in_, feature_names_in_ : int, ndarray of str
        As in scikit-learn.

    Notes
    -----
    For m components, or m samples if these are fewer, `fit` takes ``48 m^2`` bytes, ``98304 m``
    more with low rank, `predict` ``65536 m``, and both ``8 n_bins^2`` per different coding. Time
    grows with the cube of m, and beyond that with the number of samples.
    """

    alpha: float | str = parameter("auto", Interval(Real, 0, np.inf, closed="neither"), AUTO)
    degree: int | str = parameter("auto", wholes(1, 3), AUTO)
    pairs: PairChoice = parameter("all", words("all"), "array-like")
    max_components: int = parameter(2000, wholes(10, 2**15))
    random_state: RandomState = parameter(None, "random_state")

    @staticmethod
    def _sample_counts(sample_weight: ArrayLike | None, n_samples: int) -> Floats:
        counts = sample_weights(sample_weight, n_samples)
        return np.ones(n_samples) if counts is None else counts

    def _solve(
        self,
        X: object,
        table: Array,
        targets: Floats,
        counts: Floats,
        factors: Floats | None = None,
        *,
        models_errors: bool = False,
    ) -> tuple[Floats, Rows, Solution | None]:
        """Learn ranges, kernel, settings and solution; samples weigh counts times factors.

        Returns the outputs of samples by models without them, the numbers of these samples, and
        with `models_errors` a model of the logarithms of the sizes of their errors.
        """
        if (largest := np.abs(targets).max()) > LARGEST_TARGET:
            raise ValueError(f"y must be within +-{LARGEST_TARGET:g}, got {largest:g}: scale it")
        weights = counts if factors is None else counts * factors
        samples = Samples(targets, weights, 1 / np.maximum(counts, 1))
        codings = self._codings(X, table)
        pairs = None
        if not isinstance(self.pairs, str):
            pairs = input_pairs(self.pairs, self._feature_names(), table.shape[1])
        self.kernel_ = AnalyticKernel(self._fit_codings(codings, table, N_UNITS), pairs=pairs)
        components = np.arange(len(table))
        if len(table) > self.max_components:
            random = check_random_state(self.random_state)
            components = np.sort(random.choice(components, self.max_components, replace=False))
        self.X_fit_ = table[components]
        alpha = None if self.alpha == "auto" else real("alpha", self.alpha)
        base, part = self.kernel_(self.X_fit_), samples[components]
        solutions, sizes = {}, {}
        for degree in DEGREES if self.degree == "auto" else (int(self.degree),):
            problem = diagonal(apply_degree(base.copy(), degree), part)
            solutions[degree] = solve(problem, part, alpha)
            if models_errors:
                errors = log_sizes(part.targets - solutions[degree].left_out)
                model = solve_for(problem, part, errors)
                sizes[degree] = dataclasses.replace(model, rows=components)
            del problem  # free its memory before the next degree needs as much
        self.degree_ = min(solutions, key=lambda degree: solutions[degree].error)
        solution = solutions[self.degree_]
        if len(table) > len(components):
            del base
            problem = low_rank_diagonal(lambda rows: self._kernel(table[rows]), components, samples)
            solution = solve(problem, samples, alpha)
        self.alpha_, self.leave_one_out_error_ = solution.alpha, solution.error
        self.dual_coef_, self.intercept_ = solution.dual, solution.intercept
        return solution.left_out, solution.rows, sizes.get(self.degree_)

    def _kernel(self, table: Array) -> Floats:
        """Return the kernel of samples and components."""
        return apply_degree(self.kernel_(table, self.X_fit_), self.degree_)

    def _outputs(self, X: ArrayLike) -> Floats:
        """Return the outputs of samples, shape (n_samples, n_outputs)."""
        check_is_fitted(self, "dual_coef_")
        table = self._validated(X, codings=self.kernel_.codings)
        return self._sums(table, self.dual_coef_) + self.intercept_

    def _sums(self, table: Array, dual: Floats) -> Floats:
        """Return the kernel of samples times coefficients, a block of samples at a time."""
        parts = [self._kernel(table[rows]) @ dual for rows in row_blocks(len(table))]
        return np.concatenate(parts)


@explains_names()
@documents(BaseKernelRidge)
@dataclasses.dataclass(kw_only=True, eq=False, repr=False)
class SDNNKernelRidge(CodedRegressor, BaseKernelRidge):
    """Kernel ridge regression with the network's kernel, as for infinitely many units.

    Its settings need no search. It does not learn online.

    Attributes
    ----------
    leave_one_out_residuals_ : ndarray, shape (n_samples, n_outputs)
        Targets minus the outputs of models without the sample: of samples of weight 0 none, of more
        than ``max_components`` samples a part.

    Examples
    --------
    >>> import numpy as np
    >>> from sdnn import SDNNKernelRidge
    >>> X = np.random.RandomState(0).uniform(size=(200, 2))
    >>> y = np.sin(6 * X[:, 0]) * X[:, 1]
    >>> model = SDNNKernelRidge().fit(X[::2], y[::2])
    >>> bool(model.score(X[1::2], y[1::2]) > 0.95)
    True
    >>> model.predict_interval(X[1::2], coverage=0.8).shape
    (100, 2)
    """

    def _fit(self, X: ArrayLike, y: ArrayLike, sample_weight: ArrayLike | None) -> None:
        table, targets = self._check_samples(X, y)
        counts = self._sample_counts(sample_weight, len(table))
        self._flat = targets.ndim == 1
        targets = targets.reshape(len(table), -1)
        clipped = targets.clip(*self._ranges_of(targets))
        left_out, rows, sizes = self._solve(X, table, clipped, counts, models_errors=True)
        assert sizes is not None  # as errors are modelled
        self._sizes_of_errors = sizes
        self.leave_one_out_residuals_ = targets[rows] - left_out
        self._residual_counts = counts[rows]
        is_component = np.isin(rows, sizes.rows)
        logarithms = np.empty_like(left_out)
        places = np.searchsorted(sizes.rows, rows[is_component])
        logarithms[is_component] = sizes.left_out[places]
        if not is_component.all():
            logarithms[~is_component] = self._log_error_sizes(table[rows[~is_component]])
        self._residual_scales = self._error_scales(logarithms)

    def _log_error_sizes(self, table: Array) -> Floats:
        """Predict the logarithms of the sizes of errors, shape (n_samples, n_outputs)."""
        sizes = self._sizes_of_errors
        return self._sums(table, sizes.dual) + sizes.intercept

    def _error_scales(self, log_sizes: Floats) -> Floats:
        """Return sizes of errors in units of the usual one, within a tenth and ten times of it."""
        excess = log_sizes - self._sizes_of_errors.left_out.mean(axis=0)
        scales: Floats = np.exp(excess.clip(-LOG_OF_TEN, LOG_OF_TEN))
        return scales

    def predict(self, X: ArrayLike) -> Floats:
        """Predict the outputs of samples, shape (n_samples,) or (n_samples, n_outputs)."""
        outputs = self._outputs(X)
        return outputs[:, 0] if self._flat else outputs

    def predict_interval(
        self, X: ArrayLike, coverage: float = 0.9, *, scaled: bool = False
    ) -> Floats:
        """Predict lower and upper bounds of targets, shape (n_samples, 2).

        A target lies between them with a probability of about ``coverage``, if samples are drawn
        like those of `fit`: bounds are those of the errors of each sample's prediction without it.
        They have equal widths, or with ``scaled`` widths in proportion to a model of the sizes of
        errors, for noise that depends on the inputs. Several outputs have a shape of (n_samples,
        n_outputs, 2), and each the coverage apart. Weights of samples count as numbers of samples.

        Raises
        ------
        ValueError
            If ``coverage`` is not within (0, 1), or needs more samples than were fitted.
        """
        share, is_scaled = coverage_of(coverage), flag("scaled", scaled)
        outputs = self._outputs(X)
        sizes = np.abs(self.leave_one_out_residuals_)
        scales: Floats = np.ones(1)
        if is_scaled:
            sizes = sizes / self._residual_scales
            table = self._validated(X, codings=self.kernel_.codings)
            scales = self._error_scales(self._log_error_sizes(table))
        widths = error_bounds(sizes, self._residual_counts, share) * scales
        bounds: Floats = np.stack([outputs - widths, outputs + widths], axis=-1)
        return bounds[:, 0] if self._flat else bounds


@explains_names()
@documents(BaseKernelRidge)
@dataclasses.dataclass(kw_only=True, eq=False, repr=False)
class SDNNKernelClassifier(CodedClassifier, BaseKernelRidge):
    """Classification by kernel ridge with the network's kernel, on one-hot targets.

    Its settings need no search. It does not learn online.

    Parameters
    ----------
    class_weight : "balanced" or dict, optional
        Weight of the samples of each class.

    Attributes
    ----------
    classes_ : ndarray, shape (n_classes,)
        The labels, sorted.
    steepness_ : float
        Steepness of the softmax of scores, with the smallest log loss when each sample is left out.

    Examples
    --------
    >>> from sklearn.datasets import load_iris
    >>> from sdnn import SDNNKernelClassifier
    >>> X, y = load_iris(return_X_y=True)
    >>> bool(SDNNKernelClassifier().fit(X[::2], y[::2]).score(X[1::2], y[1::2]) > 0.9)
    True
    """

    def _fit(self, X: ArrayLike, y: ArrayLike, sample_weight: ArrayLike | None) -> None:
        table, labels = self._check_samples(X, y)
        counts = self._sample_counts(sample_weight, len(table))
        self._set_classes(labels)
        one_hot = (labels[:, None] == self.classes_).astype(np.float64)
        of_classes = class_weights(self.class_weight, labels)
        left_out, rows, _ = self._solve(X, table, one_hot, counts, of_classes)
        weights = (counts if of_classes is None else counts * of_classes)[rows]

        def loss(log_steepness: float) -> float:
            """Return the weighted log loss of the outputs of models without the sample."""
            log_probabilities = log_softmax(np.exp(log_steepness) * left_out, axis=1)
            return -float(weights @ (one_hot[rows] * log_probabilities).sum(axis=1))

        best = minimize_scalar(loss, bounds=LOG_STEEPNESS, method="bounded").x
        self.steepness_ = float(np.exp(best))

    def decision_function(self, X: ArrayLike) -> Floats:
        """Return the score of each class, about 1 for its own samples and 0 for others.

        Shape (n_samples, n_classes). Two classes: shape (n_samples,), positive for the second.
        """
        scores = self._outputs(X)
        return scores[:, 1] - scores[:, 0] if len(self.classes_) == 2 else scores

    def predict_proba(self, X: ArrayLike) -> Floats:
        """Return a softmax of the scores, shape (n_samples, n_classes)."""
        scores = self._outputs(X)  # before `steepness_`: raises NotFittedError
        probabilities: Floats = softmax(self.steepness_ * scores, axis=1)
        return probabilities
