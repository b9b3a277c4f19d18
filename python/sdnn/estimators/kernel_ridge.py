"""Ridge regression and classification with the kernel that the network approaches.

The penalty is chosen by closed-form leave-one-out. In features in which the penalized problem is
diagonal, with rows r and eigenvalues d, leaving a sample out divides its residual by 1 - h, where h
is the sum of r^2 / (d + alpha). So one eigendecomposition gives the error of every alpha.
"""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Iterator
from numbers import Real

import numpy as np
from numpy.typing import ArrayLike
from scipy.linalg import eigh
from scipy.optimize import minimize_scalar
from scipy.special import log_softmax, softmax
from sklearn.utils import check_random_state
from sklearn.utils._param_validation import Interval
from sklearn.utils.validation import check_is_fitted

from sdnn.coding.kernel import N_UNITS, AnalyticKernel
from sdnn.estimators.columns import Array, Floats, PairChoice, input_pairs
from sdnn.estimators.inputs import CodedClassifier, CodedInputs, CodedRegressor
from sdnn.estimators.parameters import RandomState, documents, parameter, wholes, words
from sdnn.estimators.training import Rows, class_weights, sample_weights
from sdnn.support.arguments import explains_names, real

AUTO = words("auto")
DEGREES = (1, 2, 3)
LARGEST_TARGET = 1e140  # so that sums of squares are finite
LOG_STEEPNESS = (0.0, 5.0)  # bounds, for the softmax of scores
ALPHAS = np.logspace(-6, 0, 19)  # penalties to try, relative to the sum of eigenvalues
NEGLIGIBLE = 1e-12  # eigenvalues, as shares of the largest
ROWS_AT_ONCE = 4096
MOST_LEFT_OUT = 8192  # samples used for leave-one-out with low rank


@dataclasses.dataclass
class Samples:
    """Targets and weights of samples, and their counts for leave-one-out.

    A sample of count 2 stands for two samples, so that leaving one out leaves half of its weight.
    """

    targets: Floats  # shape (n_samples, n_outputs)
    weights: Floats
    shares: Floats

    def __getitem__(self, rows: Rows) -> Samples:
        return Samples(self.targets[rows], self.weights[rows], self.shares[rows])

    @property
    def mean(self) -> Floats:
        """Weighted mean targets, shape (n_outputs,)."""
        mean: Floats = self.weights @ self.targets / self.weights.sum()
        return mean


@dataclasses.dataclass
class Diagonal:
    """The ridge problem in centered features whose normal equations are diagonal."""

    values: Floats  # eigenvalues, shape (n_features,)
    moments: Floats  # weighted sums of features times targets, shape (n_features, n_outputs)
    to_dual: Floats  # shape (n_components, n_features)
    kernel_mean: Floats  # weighted mean over the samples, shape (n_components,)
    features: Floats  # features of samples to leave out, times the roots of weights
    rows: Rows  # the numbers of these samples


@dataclasses.dataclass
class Solution:
    """A solution of the ridge problem: outputs are ``kernel @ dual + intercept``."""

    alpha: float
    error: float  # mean square by leave-one-out, in variances of the targets
    dual: Floats  # shape (n_components, n_outputs)
    intercept: Floats  # shape (n_outputs,)
    left_out: Floats  # outputs of samples by models without them
    rows: Rows  # the numbers of these samples


def row_blocks(n_samples: int) -> Iterator[Rows]:
    """Yield the numbers of samples, `ROWS_AT_ONCE` at a time."""
    for begin in range(0, n_samples, ROWS_AT_ONCE):
        yield np.arange(begin, min(begin + ROWS_AT_ONCE, n_samples))


def eigenvectors(matrix: Floats) -> tuple[Floats, Floats]:
    """Return the eigenvalues that are not negligible and their vectors; overwrite the matrix."""
    values, vectors = eigh(matrix, overwrite_a=True, check_finite=False, driver="evd")
    kept = values > NEGLIGIBLE * values[-1]
    return values[kept], vectors[:, kept]


def diagonal(kernel: Floats, samples: Samples) -> Diagonal:
    """Diagonalize the exact problem, in which every sample is a component; overwrites `kernel`."""
    weights, roots = samples.weights, np.sqrt(samples.weights)[:, None]
    mean = weights @ kernel / weights.sum()
    kernel -= mean
    kernel -= (mean - mean @ weights / weights.sum())[:, None]
    kernel *= roots
    kernel *= roots.T
    values, vectors = eigenvectors(kernel)
    scales = np.sqrt(values)
    moments = scales[:, None] * (vectors.T @ (roots * (samples.targets - samples.mean)))
    rows = np.arange(len(weights))
    return Diagonal(values, moments, roots * (vectors / scales), mean, vectors * scales, rows)


def low_rank_diagonal(
    kernel_of: Callable[[Rows], Floats], components: Rows, samples: Samples
) -> Diagonal:
    """Diagonalize the low-rank problem in Nystroem's features, a block of samples at a time.

    ``kernel_of`` returns the kernel of samples, given by number, and components.
    """
    values, vectors = eigenvectors(kernel_of(components))
    to_features = vectors / np.sqrt(values)
    n_samples, total = len(samples.weights), samples.weights.sum()
    gram, sums = np.zeros((len(values), len(values))), np.zeros(len(values))
    kernel_sums = np.zeros(len(components))
    moments = np.zeros((len(values), samples.targets.shape[1]))
    for rows in row_blocks(n_samples):
        kernel, weights = kernel_of(rows), samples.weights[rows]
        features = kernel @ to_features
        kernel_sums += weights @ kernel
        sums += weights @ features
        features *= np.sqrt(weights)[:, None]
        gram += features.T @ features
        centered = samples.targets[rows] - samples.mean
        moments += features.T @ (np.sqrt(weights)[:, None] * centered)
    gram -= np.outer(sums, sums) / total
    values, rotation = eigenvectors(gram)
    to_dual = to_features @ rotation
    rows = np.unique(np.linspace(0, n_samples - 1, MOST_LEFT_OUT).astype(np.int64))
    features = np.concatenate([kernel_of(rows[part]) @ to_dual for part in row_blocks(len(rows))])
    features -= sums @ rotation / total
    features *= np.sqrt(samples.weights[rows])[:, None]
    return Diagonal(values, rotation.T @ moments, to_dual, kernel_sums / total, features, rows)


def solve(problem: Diagonal, samples: Samples, alpha: float | None) -> Solution:
    """Solve the problem for an alpha, by default the one with the least leave-one-out error."""
    left = samples[problem.rows]
    total, roots = samples.weights.sum(), np.sqrt(left.weights)[:, None]
    targets = roots * (left.targets - samples.mean)
    variances = np.square(targets).sum(axis=0) / left.weights.sum()
    variances[variances == 0] = 1.0
    squares = np.square(problem.features)
    best = np.inf, 0.0, problem.moments, targets
    for penalty in problem.values.sum() * ALPHAS if alpha is None else [alpha]:
        shrinkage = 1 / (problem.values + penalty)
        coefficients = shrinkage[:, None] * problem.moments
        leverages = squares @ shrinkage + left.weights / total
        kept = np.maximum(1 - left.shares * leverages, NEGLIGIBLE)
        residuals = (targets - problem.features @ coefficients) / kept[:, None]
        error = float((np.square(residuals).sum(axis=0) / variances).mean() / left.weights.sum())
        if error < best[0]:
            best = error, float(penalty), coefficients, residuals
    error, penalty, coefficients, residuals = best
    dual = problem.to_dual @ coefficients
    intercept = samples.mean - problem.kernel_mean @ dual
    left_out = left.targets - residuals / np.where(roots > 0, roots, 1)
    return Solution(penalty, error, dual, intercept, left_out, problem.rows)


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
    ) -> tuple[Floats, Rows]:
        """Learn ranges, kernel, settings and solution; samples weigh counts times factors.

        Returns the outputs of samples by models without them, and the numbers of these samples.
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
        base = self.kernel_(self.X_fit_)
        solutions = {}
        for degree in DEGREES if self.degree == "auto" else (int(self.degree),):
            problem = diagonal(apply_degree(base.copy(), degree), samples[components])
            solutions[degree] = solve(problem, samples[components], alpha)
            del problem  # free its memory before the next degree needs as much
        self.degree_ = min(solutions, key=lambda degree: solutions[degree].error)
        solution = solutions[self.degree_]
        if len(table) > len(components):
            del base
            problem = low_rank_diagonal(lambda rows: self._kernel(table[rows]), components, samples)
            solution = solve(problem, samples, alpha)
        self.alpha_, self.leave_one_out_error_ = solution.alpha, solution.error
        self.dual_coef_, self.intercept_ = solution.dual, solution.intercept
        return solution.left_out, solution.rows

    def _kernel(self, table: Array) -> Floats:
        """Return the kernel of samples and components."""
        return apply_degree(self.kernel_(table, self.X_fit_), self.degree_)

    def _outputs(self, X: ArrayLike) -> Floats:
        """Return the outputs of samples, shape (n_samples, n_outputs)."""
        check_is_fitted(self, "dual_coef_")
        table = self._validated(X, codings=self.kernel_.codings)
        parts = [self._kernel(table[rows]) @ self.dual_coef_ for rows in row_blocks(len(table))]
        return np.concatenate(parts) + self.intercept_


@explains_names()
@documents(BaseKernelRidge)
@dataclasses.dataclass(kw_only=True, eq=False, repr=False)
class SDNNKernelRidge(CodedRegressor, BaseKernelRidge):
    """Kernel ridge regression with the network's kernel, as for infinitely many units.

    Its settings need no search. It does not learn online.

    Examples
    --------
    >>> import numpy as np
    >>> from sdnn import SDNNKernelRidge
    >>> X = np.random.RandomState(0).uniform(size=(200, 2))
    >>> y = np.sin(6 * X[:, 0]) * X[:, 1]
    >>> bool(SDNNKernelRidge().fit(X[::2], y[::2]).score(X[1::2], y[1::2]) > 0.95)
    True
    """

    def _fit(self, X: ArrayLike, y: ArrayLike, sample_weight: ArrayLike | None) -> None:
        table, targets = self._check_samples(X, y)
        counts = self._sample_counts(sample_weight, len(table))
        self._flat = targets.ndim == 1
        targets = targets.reshape(len(table), -1)
        self._solve(X, table, targets.clip(*self._ranges_of(targets)), counts)

    def predict(self, X: ArrayLike) -> Floats:
        """Predict the outputs of samples, shape (n_samples,) or (n_samples, n_outputs)."""
        outputs = self._outputs(X)
        return outputs[:, 0] if self._flat else outputs


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
        left_out, rows = self._solve(X, table, one_hot, counts, of_classes)
        weights = (counts if of_classes is None else counts * of_classes)[rows]

        def loss(log_steepness: float) -> float:
            logarithms = log_softmax(np.exp(log_steepness) * left_out, axis=1)
            return -float(weights @ (one_hot[rows] * logarithms).sum(axis=1))

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
