"""Ridge regression with the kernel that the network approaches."""

from __future__ import annotations

import dataclasses
from numbers import Real
from typing import Any, ClassVar, TypeVar

import numpy as np
from numpy.typing import ArrayLike
from sklearn.kernel_ridge import KernelRidge
from sklearn.utils._param_validation import Interval, StrOptions
from sklearn.utils.validation import check_is_fitted

from sdnn.estimators.inputs import CodedRegressor, Floats, input_pairs
from sdnn.kernel import N_UNITS, AnalyticKernel

SAMPLES_AT_ONCE = 4096  # in prediction

Self = TypeVar("Self", bound="SDNNKernelRidge")


@dataclasses.dataclass(eq=False, repr=False)
class SDNNKernelRidge(CodedRegressor):
    """Kernel ridge regression with the network's kernel, as for infinitely many units.

    For noisy samples of up to some thousand; it does not learn online.

    Parameters
    ----------
    coding : str, Coding, or list of (str or Coding, columns), default="random-inverse"
        As for `SDNNRegressor`.
    alpha : float, default=0.1
        Strength of the penalty, above 0; more for noisy targets.
    pairs : "all" or list of (modified, modifier), default="all"
        Pairs of features, by number or name; a modifier of None leaves a pattern plain. All pairs
        are as fast as one per feature.

    Attributes
    ----------
    kernel_ : AnalyticKernel
    ridge_ : KernelRidge
        Fitted to the kernel of the training sample.
    X_fit_ : ndarray, shape (n_samples, n_features)
    y_mean_ : ndarray, shape (n_outputs,) or ()
        Mean targets, which are not penalized.
    n_features_in_, feature_names_in_ : int, ndarray of str
        As in scikit-learn.

    Notes
    -----
    `fit` takes ``32 n_samples^2`` bytes, `predict` ``32768 n_samples``, and both ``8 n_bins^2`` per
    different coding. Time grows with the cube of the sample.

    Examples
    --------
    >>> import numpy as np
    >>> from sdnn import SDNNKernelRidge
    >>> X = np.random.RandomState(0).uniform(size=(200, 2))
    >>> y = np.sin(6 * X[:, 0]) * X[:, 1]
    >>> bool(SDNNKernelRidge(alpha=1e-3).fit(X[::2], y[::2]).score(X[1::2], y[1::2]) > 0.95)
    True
    """

    alpha: float = dataclasses.field(default=0.1, kw_only=True)
    pairs: Any = dataclasses.field(default="all", kw_only=True)

    _parameter_constraints: ClassVar[dict[str, list[Any]]] = {
        **CodedRegressor._parameter_constraints,
        "alpha": [Interval(Real, 0, np.inf, closed="neither")],
        "pairs": [StrOptions({"all"}), "array-like"],
    }

    def fit(self: Self, X: ArrayLike, y: ArrayLike) -> Self:
        """Learn ranges, and weights of the training samples; y may have several outputs."""
        work = self._scratch()
        work._fit(X, y)
        self.__dict__ = work.__dict__
        return self

    def _fit(self, X: ArrayLike, y: ArrayLike) -> None:
        self._validate_params()
        table, targets = self._validated_numbers(X, y, reset=True)
        codings = [
            coding.fit(table[:, index], N_UNITS)
            for index, coding in enumerate(self._codings(X, table))
        ]
        pairs = None
        if not isinstance(self.pairs, str):
            pairs = input_pairs(self.pairs, self._feature_names(), table.shape[1])
        self.kernel_ = AnalyticKernel(codings, pairs=pairs)
        self.X_fit_ = table
        self.y_mean_ = targets.mean(axis=0)
        self.ridge_ = KernelRidge(kernel="precomputed", alpha=self.alpha)
        self.ridge_.fit(self.kernel_(table), targets - self.y_mean_)

    def predict(self, X: ArrayLike) -> Floats:
        """Predict the outputs of samples, shape (n_samples,) or (n_samples, n_outputs)."""
        check_is_fitted(self, "ridge_")
        table = self._finite(self._validated(X, reset=False), self.kernel_.codings)
        parts = [
            self.ridge_.predict(self.kernel_(table[begin : begin + SAMPLES_AT_ONCE], self.X_fit_))
            for begin in range(0, len(table), SAMPLES_AT_ONCE)
        ]
        values: Floats = self.y_mean_ + np.concatenate(parts)
        return values
