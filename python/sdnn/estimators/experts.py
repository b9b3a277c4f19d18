"""Experts beside the network of a stream: the mean, and linear regression by least squares.

Each expert predicts a sample before it is learned. Their mean is weighted by their recent errors,
so that the expert that suits the stream, or the present part of it, decides.
"""

from __future__ import annotations

import abc
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from sdnn import _core
from sdnn.coding import Coding
from sdnn.coding.symbols import Categorical, present
from sdnn.estimators.columns import Floats
from sdnn.estimators.outliers import usual_range

EXPERTS = ("network", "linear", "window")
"""Values of the setting ``experts``: each has the experts of the value before it, and others."""

# Chosen constants, except where a reason is given.
FORGETTING_OF_MEAN = 0.999  # factor of a sample's weight with each later sample
FORGETTING = (0.999, 0.98)  # this factor in two linear regressions, which are reported as one
PRIORS = (4.0, 2.0, 1.0)  # first weights of mean and regressions: simple experts are likely
ERROR_LIMIT = 20.0  # largest error that the regressions of numbers learn, in mean errors
WINDOW = 400  # samples of kernel regression, whose time grows with their square
LENGTH_SCALE = 1.0  # length scale of the kernel, in ranges of inputs times the root of their number
RIDGE = 0.1  # penalty of kernel regression
MOST_COLUMNS = 200  # columns of linear regression, whose time grows with their square


def finite_sum(first: Floats, second: Floats) -> Floats:
    """Return a sum that is the largest number instead of infinity."""
    with np.errstate(over="ignore"):
        return np.nan_to_num(first + second)


class Estimates(NamedTuple):
    """Predictions of a sample that is not learned yet."""

    row: Floats  # columns of linear regression
    each: Floats  # shape (n_experts, n_outputs); the last is the network


class LinearColumns:
    """Turns samples into rows of numbers for linear regression.

    A numeric feature is a column, NaN where it is missing. A feature with categories has a column
    of 0 or 1 for each of them, and 0 in all for another category or a missing value. There are at
    most `MOST_COLUMNS` columns, of the first features and categories.
    """

    def __init__(self) -> None:
        self.numbers: dict[str, int] = {}  # columns of features
        self.categories: dict[str, dict[object, int]] = {}  # columns of categories by feature
        self.empty: list[float] = []  # the row of a sample without features

    def add(
        self, codings: Mapping[str, Coding], rows: Sequence[Mapping[str, object]]
    ) -> tuple[list[float], list[float]]:
        """Add columns for features and categories that have none; return their limits.

        These are the lowest and the highest usual value of each new column. ``codings`` are fitted;
        ``rows`` have the last values of all features.
        """
        low: list[float] = []
        high: list[float] = []
        for name, coding in codings.items():
            base = present(coding)
            if isinstance(base, Categorical):
                columns = self.categories.setdefault(name, {})
                added = [value for value in base.categories or () if value not in columns]
                added = added[: MOST_COLUMNS - len(self.empty)]
                columns |= {value: len(self.empty) + index for index, value in enumerate(added)}
                self.empty += [0.0] * len(added)
                low += [0.0] * len(added)
                high += [1.0] * len(added)
            elif len(self.empty) < MOST_COLUMNS and name not in self.numbers:
                values = [value for row in rows if (value := row.get(name)) is not None]
                limits = usual_range(np.array(values or [0.0], dtype=np.float64))
                self.numbers[name] = len(self.empty)
                self.empty.append(np.nan)
                low.append(limits[0])
                high.append(limits[1])
        return low, high

    def row(self, sample: Mapping[str, Any]) -> Floats:
        """Return the row of a sample, shape (n_columns,)."""
        row = self.empty.copy()
        for name, column in self.numbers.items():
            if (value := sample.get(name)) is not None:
                row[column] = value
        for name, columns in self.categories.items():
            if (column_of_category := columns.get(sample.get(name))) is not None:
                row[column_of_category] = 1.0
        return np.array(row, dtype=np.float64)


class Experts(abc.ABC):
    """The mean and two linear regressions of different memories, beside a network.

    With a window there is kernel regression too, of what the first linear regression leaves.

    ``codings`` are fitted, by feature; ``rows`` are the last samples, as `StreamEstimator` reads
    them, with their targets, shape (n_samples, n_outputs).
    """

    first: str  # name of the first expert
    error_limit: float  # see `_core.RecursiveLeastSquares`

    def __init__(
        self,
        codings: Mapping[str, Coding],
        rows: Sequence[Mapping[str, object]],
        targets: Floats,
        has_window: bool,
    ) -> None:
        self.has_window = has_window
        self.mixture = self._mixture()
        self.begin(codings, rows, targets)

    @abc.abstractmethod
    def _mixture(self) -> Any:
        """Return the weights of experts without any errors."""

    def begin(
        self, codings: Mapping[str, Coding], rows: Sequence[Mapping[str, object]], targets: Floats
    ) -> None:
        """Learn all features, the mean and the regressions anew; the weights stay."""
        self.columns = LinearColumns()
        low, high = self.columns.add(codings, rows)
        self._make(low, high, targets.shape[1])
        for sample, target in zip(rows, targets, strict=True):
            self._learn(self.columns.row(sample), target)

    def _make(self, low: ArrayLike, high: ArrayLike, n_outputs: int) -> None:
        """Make the experts for features of these lowest and highest values."""
        make, limit = _core.RecursiveLeastSquares, self.error_limit
        self.mean = make([], [], n_outputs, FORGETTING_OF_MEAN, limit)
        self.linear = [make(low, high, n_outputs, share, limit) for share in FORGETTING]
        self.window = (
            _core.KernelWindow(low, high, n_outputs, WINDOW, LENGTH_SCALE, RIDGE, limit)
            if self.has_window
            else None
        )

    def _models(self) -> list[Any]:
        """Return the experts but the network: the mean, which has no inputs, is the first."""
        return [self.mean, *self.linear, *([] if self.window is None else [self.window])]

    def _learn(self, row: Floats, target: Floats) -> None:
        """Learn a sample in every expert but the network."""
        if self.window is not None:  # before the regression learns the same sample
            self.window.learn(row, finite_sum(target, -self.linear[0].predict(row)))
        self.mean.learn([], target)
        for model in self.linear:
            model.learn(row, target)

    def add(self, codings: Mapping[str, Coding], rows: Sequence[Mapping[str, object]]) -> None:
        """Add features and categories, whose weights are 0; see `LinearColumns.add`."""
        low, high = self.columns.add(codings, rows)
        for model in self._models()[1:]:
            model.add_inputs(low, high)

    def estimates(self, sample: Mapping[str, Any], of_network: Floats) -> Estimates:
        """Return the predictions of all experts; that of the network has shape (n_outputs,)."""
        row = self.columns.row(sample)
        each = [self.mean.predict([]), *(model.predict(row) for model in self.linear)]
        if self.window is not None:
            each.append(finite_sum(each[1], self.window.predict(row)))
        return Estimates(row, np.array([*each, of_network]))

    @abc.abstractmethod
    def mix(self, each: Floats) -> Floats:
        """Return the weighted mean of predictions or probabilities, shape (n_outputs,)."""

    @abc.abstractmethod
    def _compare(self, each: Floats, target: Floats) -> None:
        """Update the weights."""

    def learn(self, estimates: Estimates, target: Floats) -> None:
        """Learn the target of predictions, which may have a new class as its last."""
        n_new = len(target) - self.mean.n_outputs
        if n_new:
            for model in self._models():
                model.add_outputs(n_new)
        else:
            self._compare(estimates.each, target)
        self._learn(estimates.row, target)

    @property
    def weights(self) -> dict[str, float]:
        """The weights of the experts, which sum to 1."""
        first, *others, network = self.mixture.weights.tolist()
        weights = {self.first: first, "linear": sum(others[: len(FORGETTING)])}
        if self.has_window:
            weights["window"] = others[-1]
        return {**weights, "network": network}

    def __getstate__(self) -> dict[str, object]:
        """Return the attributes for pickle, the compiled models as plain states."""
        states = [model.state() for model in [*self._models(), self.mixture]]
        left_out = ("mean", "linear", "window", "mixture")
        return {
            "states": states,
            **{name: value for name, value in self.__dict__.items() if name not in left_out},
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Restore the attributes, and make the compiled models from their states."""
        states = state.pop("states")  # of the mean, the linear regressions, the window, the mixture
        self.__dict__ = state
        self.mixture = self._mixture()
        self._make(states[1]["low"], states[1]["high"], len(states[0]["origins"]))
        for model, of_model in zip([*self._models(), self.mixture], states, strict=True):
            model.restore(of_model)


class RegressionExperts(Experts):
    """Experts for numbers, weighted by their squared errors."""

    first = "mean"
    error_limit = ERROR_LIMIT

    def _mixture(self) -> _core.PredictionMixture:
        of_window = [1.0] if self.has_window else []
        return _core.PredictionMixture([*PRIORS, *of_window, 1.0])

    def mix(self, each: Floats) -> Floats:
        """Return the weighted mean of predictions, shape (1,)."""
        return np.array([self.mixture.mix(each[:, 0])])

    def _compare(self, each: Floats, target: Floats) -> None:
        self.mixture.learn(each[:, 0], target[0])


class ClassificationExperts(Experts):
    """Experts for labels, weighted by likelihoods; shares of labels are the regressions' targets.

    Regressions and network give scores.
    """

    first = "prior"
    error_limit = np.inf  # a rare class has large errors

    def _mixture(self) -> _core.ProbabilityMixture:
        return _core.ProbabilityMixture(1 + len(FORGETTING) + self.has_window)

    def mix(self, each: Floats) -> Floats:
        """Return the probabilities of classes, shape (n_classes,)."""
        probabilities: Floats = self.mixture.mix(each[0], each[1:])
        return probabilities

    def _compare(self, each: Floats, target: Floats) -> None:
        self.mixture.learn(each[0], each[1:], int(np.argmax(target)))
