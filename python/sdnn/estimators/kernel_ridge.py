"""Ridge regression and classification with the kernel that the network approaches."""

from __future__ import annotations

import dataclasses
import math
from collections.abc import Sequence
from numbers import Real

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import minimize_scalar
from scipy.special import log_softmax, softmax
from sklearn.utils import check_random_state
from sklearn.utils._param_validation import Interval
from sklearn.utils.validation import check_is_fitted

import sdnn.estimators.ridge as ridge
from sdnn.coding import RandomInverse
from sdnn.coding.kernel import N_UNITS, AnalyticKernel
from sdnn.estimators.columns import Array, Floats, PairChoice, input_pairs
from sdnn.estimators.input_choice import Inputs, all_inputs, inputs_to_compare, squared_losses
from sdnn.estimators.inputs import CodedClassifier, CodedInputs, CodedRegressor
from sdnn.estimators.intervals import coverage_of, error_bounds, log_sizes
from sdnn.estimators.kernel_of_samples import KernelOfSamples
from sdnn.estimators.parameters import RandomState, documents, parameter, wholes, words
from sdnn.estimators.training import Rows, class_weights, sample_weights
from sdnn.support.arguments import explains_names, flag, real

AUTO = words("auto")
DEGREES = (1, 2, 3)
LARGEST_TARGET = 1e140  # so that sums of squares are finite
LOG_STEEPNESS = (0.0, 5.0)  # chosen bounds of the logarithm of the softmax's steepness
LOG_OF_TEN = np.log(10.0)


def log_losses(samples: ridge.Samples, left_out: Floats, steepness: float) -> Floats:
    """Return the log loss of each sample by the outputs of the model without it."""
    losses: Floats = -(samples.targets * log_softmax(steepness * left_out, axis=1)).sum(axis=1)
    return losses


def steepness_of(samples: ridge.Samples, left_out: Floats) -> float:
    """Return the steepness of the softmax with the smallest weighted log loss."""

    def loss(log_steepness: float) -> float:
        return float(samples.weights @ log_losses(samples, left_out, np.exp(log_steepness)))

    return float(np.exp(minimize_scalar(loss, bounds=LOG_STEEPNESS, method="bounded").x))


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
    inputs : {"auto", "all"}, default="auto"
        Whether the kernel has all features as inputs. "auto" keeps the more important half of them,
        half of these and so on, and adds up to two directions that mix numeric features, as far as
        that makes the leave-one-out error clearly smaller. With listed ``pairs`` all are inputs.
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
    codings_ : tuple of Coding
        The fitted coding of each feature.
    selected_features_ : ndarray of int
        The features that are inputs of the kernel.
    directions_ : ndarray, shape (n_directions, n_features)
        Weights by which features, clipped to their ranges, are mixed to further inputs.
    X_fit_ : ndarray, shape (n_components, n_inputs)
        Selected features, and directions in units of ranges.
    dual_coef_, intercept_ : ndarray, shapes (n_components, n_outputs) and (n_outputs,)
        Outputs are ``kernel @ dual_coef_ + intercept_``, with the kernel of the degree.
    n_features_in_, feature_names_in_ : int, ndarray of str
        As in scikit-learn.

    Notes
    -----
    For m components, or m samples if these are fewer, `fit` takes ``48 m^2`` bytes, ``98304 m``
    more with low rank, 16 MB to choose inputs, `predict` with listed pairs ``65536 m``, and both
    ``8 n_bins^2`` per different coding and at most 32 MB for all. Time grows with the cube of m,
    and beyond that with the number of samples.
    """

    alpha: float | str = parameter("auto", Interval(Real, 0, np.inf, closed="neither"), AUTO)
    degree: int | str = parameter("auto", wholes(1, 3), AUTO)
    inputs: str = parameter("auto", words("auto", "all"))
    pairs: PairChoice = parameter("all", words("all"), "array-like")
    max_components: int = parameter(2000, wholes(10, 2**15))
    random_state: RandomState = parameter(None, "random_state")

    @property
    def selected_features_(self) -> Rows:
        """Numbers of the features that are inputs of the kernel."""
        check_is_fitted(self, "dual_coef_")
        return self._inputs.features

    @property
    def directions_(self) -> Floats:
        """Weights by which features are mixed, shape (n_directions, n_features)."""
        check_is_fitted(self, "dual_coef_")
        return self._inputs.weights(self.codings_)

    def describe_inputs(self) -> str:
        """Return lines of text about the kernel's inputs: features, then mixtures of features.

        Features of mixtures are in units of their ranges; the largest weight is first, and 1.
        """
        selected, directions = self.selected_features_, self._inputs.directions
        names = self._feature_names() or [f"x{number}" for number in range(len(self.codings_))]
        lines = [f"{len(selected)} of {len(names)} features", *(names[i] for i in selected)]
        for number, weights in enumerate(directions):
            order = np.argsort(-np.abs(weights), kind="stable")
            shares = weights / weights[order[0]]
            parts = (f"{shares[i]:+.2f} {names[i]}" for i in order if weights[i])
            lines.append(f"direction {number}: {' '.join(parts)}")
        return "\n".join(lines)

    @staticmethod
    def _losses(samples: ridge.Samples, left_out: Floats) -> Floats:
        """Return each sample's loss from the output without it, by which inputs are chosen."""
        return squared_losses(samples, left_out)

    @staticmethod
    def _sample_counts(sample_weight: ArrayLike | None, n_samples: int) -> Floats:
        """Return the checked weights of samples, by default 1, shape (n_samples,)."""
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
    ) -> tuple[Floats, Rows, ridge.Solution | None]:
        """Learn ranges, kernel, settings and solution.

        Shapes: targets (n_samples, n_outputs), counts and factors (n_samples,). A sample of count 2
        stands for two; ``factors`` are the weights of classes. Returns the outputs of samples by
        models without them, shape (n_rows, n_outputs), the numbers of these samples, and with
        `models_errors` a model of the logarithms of the sizes of their errors.
        """
        if (largest := np.abs(targets).max()) > LARGEST_TARGET:
            raise ValueError(f"y must be within +-{LARGEST_TARGET:g}, got {largest:g}: scale it")
        weights = counts if factors is None else counts * factors
        samples = ridge.Samples(targets, weights, 1 / np.maximum(counts, 1))
        degrees = DEGREES if self.degree == "auto" else (int(self.degree),)
        codings = self._fit_codings(self._codings(X, table), table, N_UNITS)
        self.codings_, possible = tuple(codings), [all_inputs(len(codings))]
        if isinstance(self.pairs, str) and self.inputs == "auto":
            possible = inputs_to_compare(codings, table, samples, degrees, self._losses)
        alpha = None if self.alpha == "auto" else real("alpha", self.alpha)
        components = self._components(len(table))
        is_exact = len(components) == len(table)
        if (
            not is_exact
        ):  # half of the components choose inputs and degree, in an eighth of the time
            rows = components[::2]
            self._choose(possible, degrees, table, rows, samples[rows], alpha)
            possible, degrees = [self._inputs], (self.degree_,)
        solution, sizes = self._choose(
            possible, degrees, table, components, samples[components], alpha, models_errors
        )
        self._of_samples = KernelOfSamples(self.kernel_, self.X_fit_, self.degree_)
        if not is_exact:
            table, kernel_of = self._inputs.of(table, codings), self._of_samples.matrix
            problem = ridge.low_rank_diagonal(
                lambda rows: kernel_of(table[rows]), components, samples
            )
            solution = ridge.solve(problem, samples, alpha)
        self.alpha_, self.leave_one_out_error_ = solution.alpha, solution.error
        self.dual_coef_, self.intercept_ = solution.dual, solution.intercept
        return solution.left_out, solution.rows, sizes

    def _components(self, n_samples: int) -> Rows:
        """Return the numbers of the samples that span the solution: all, or a random choice."""
        every = np.arange(n_samples)
        if n_samples <= self.max_components:
            return every
        random = check_random_state(self.random_state)
        return np.sort(random.choice(every, self.max_components, replace=False))

    def _choose(
        self,
        possible: Sequence[Inputs],
        degrees: Sequence[int],
        table: Array,
        rows: Rows,
        samples: ridge.Samples,
        alpha: float | None,
        models_errors: bool = False,
    ) -> tuple[ridge.Solution, ridge.Solution | None]:
        """Set the inputs, kernel, degree and components with the least leave-one-out loss.

        The ``rows`` of the table are the components, ``samples`` their targets and weights. The
        degree has the least squared error, the inputs have the least loss of the estimator. Returns
        the solution, and with `models_errors` that of the logarithms of the errors' sizes.
        """
        least = math.inf
        for inputs in possible:
            kernel, values = self._kernel_of(inputs, table)
            base = kernel(values[rows])
            solutions, models = {}, {}
            for degree in degrees:
                problem = ridge.diagonal(ridge.apply_degree(base.copy(), degree), samples)
                solutions[degree] = ridge.solve(problem, samples, alpha)
                if models_errors:
                    errors = log_sizes(samples.targets - solutions[degree].left_out)
                    model = ridge.solve_for(problem, samples, errors)
                    models[degree] = dataclasses.replace(model, rows=rows)
                del problem  # free its memory before the next degree needs as much
            best = min(solutions, key=lambda degree: solutions[degree].error)
            loss = float(samples.weights @ self._losses(samples, solutions[best].left_out))
            if loss < least or inputs is possible[0]:  # the first ones even if the loss is NaN
                least, solution, sizes = loss, solutions[best], models.get(best)
                self._inputs, self.kernel_, self.degree_ = inputs, kernel, best
                self.X_fit_ = values[rows]
        return solution, sizes

    def _kernel_of(self, inputs: Inputs, table: Array) -> tuple[AnalyticKernel, Array]:
        """Return the kernel of inputs and the inputs of samples, from all their features."""
        pairs = None
        if not isinstance(self.pairs, str):
            pairs = input_pairs(self.pairs, self._feature_names(), table.shape[1])
        table = inputs.of(table, self.codings_)
        directions = table[:, len(inputs.features) :].astype(np.float64)
        codings = [self.codings_[feature] for feature in inputs.features]
        codings += [RandomInverse().fit(column, N_UNITS) for column in directions.T]
        return AnalyticKernel(codings, pairs=pairs), table

    def _inputs_of(self, X: ArrayLike) -> Array:
        """Return the kernel's inputs of samples, checked, shape (n_samples, n_inputs)."""
        if "dual_coef_" not in self.__dict__:  # scikit-learn's check takes longer
            check_is_fitted(self, "dual_coef_")
        return self._inputs.of(self._validated(X, codings=self.codings_), self.codings_)

    def _outputs(self, X: ArrayLike) -> Floats:
        """Return the outputs of samples, shape (n_samples, n_outputs)."""
        table = self._inputs_of(X)
        return self._of_samples.sums(table, self.dual_coef_) + self.intercept_


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
        """Solve for the coefficients, then model the size of errors for intervals."""
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
        # Log sizes by the model without each sample; it predicts those that it was not fitted to.
        is_component = np.isin(rows, sizes.rows)
        logarithms = np.empty_like(left_out)
        positions = np.searchsorted(sizes.rows, rows[is_component])
        logarithms[is_component] = sizes.left_out[positions]
        if not is_component.all():
            others = self._inputs.of(table[rows[~is_component]], self.codings_)
            logarithms[~is_component] = self._log_error_sizes(others)
        self._residual_scales = self._error_scales(logarithms)

    def _log_error_sizes(self, table: Array) -> Floats:
        """Predict the logarithms of the sizes of errors, shape (n_samples, n_outputs)."""
        sizes = self._sizes_of_errors
        return self._of_samples.sums(table, sizes.dual) + sizes.intercept

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
            scales = self._error_scales(self._log_error_sizes(self._inputs_of(X)))
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
        """Solve for one-hot targets; fit the steepness to leave-one-out predictions."""
        table, labels = self._check_samples(X, y)
        counts = self._sample_counts(sample_weight, len(table))
        self._set_classes(labels)
        one_hot = (labels[:, None] == self.classes_).astype(np.float64)
        of_classes = class_weights(self.class_weight, labels)
        left_out, rows, _ = self._solve(X, table, one_hot, counts, of_classes)
        weights = (counts if of_classes is None else counts * of_classes)[rows]
        self.steepness_ = steepness_of(ridge.Samples(one_hot[rows], weights, weights), left_out)

    @staticmethod
    def _losses(samples: ridge.Samples, left_out: Floats) -> Floats:
        return log_losses(samples, left_out, steepness_of(samples, left_out))

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
