"""Experts beside the network of a stream: the mean, and linear regression by least squares.

Each expert predicts a sample before it is learned. Their mean is weighted by their recent errors,
so that the expert that suits the stream, or the present part of it, decides.
"""

from __future__ import annotations

import abc
from collections.abc import Mapping, Sequence
from typing import Any, NamedTuple

import numpy as np

from sdnn import _core
from sdnn.coding import Coding
from sdnn.coding.symbols import Categorical, present
from sdnn.estimators.columns import Floats
from sdnn.estimators.outliers import usual_range

EXPERTS = ("network", "linear")
"""Values of the setting: the network alone, or beside mean and linear regression."""

FORGETTING_OF_MEAN = 0.999
FORGETTING = (0.999, 0.98)  # of two linear regressions, which are reported as one
ERROR_LIMIT = 20.0  # largest error that the regressions of numbers learn, in mean errors
MOST_COLUMNS = 200  # of linear regression, whose time grows with their square


class Estimates(NamedTuple):
    """Predictions of a sample that is not learned yet."""

    row: Floats  # columns of linear regression
    each: Floats  # shape (n_experts, n_outputs); the last is the network


class LinearColumns:
    """Turns samples into rows of numbers, NaN where a number is missing.

    A number is a column; a feature with categories has a column of 0 or 1 for each of them, and 0
    in all for another category or a missing value. Features beyond `MOST_COLUMNS` columns are left
    out.
    """

    def __init__(self) -> None:
        self.numbers: dict[str, int] = {}  # columns of features
        self.categories: dict[str, dict[object, int]] = {}  # columns of categories by feature
        self.empty: list[float] = []  # the row of a sample without features

    def add(
        self, codings: Mapping[str, Coding], rows: Sequence[Mapping[str, object]]
    ) -> tuple[list[float], list[float]]:
        """Add the columns of features and of new categories; return their lowest, highest values.

        ``codings`` are fitted; ``rows`` have the last values of all features.
        """
        low: list[float] = []
        high: list[float] = []
        for name, coding in codings.items():
            base = present(coding)
            if isinstance(base, Categorical):
                columns = self.categories.setdefault(name, {})
                new = [value for value in base.categories or () if value not in columns]
                new = new[: MOST_COLUMNS - len(self.empty)]
                columns |= {value: len(self.empty) + index for index, value in enumerate(new)}
                self.empty += [0.0] * len(new)
                low += [0.0] * len(new)
                high += [1.0] * len(new)
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
            if (place := columns.get(sample.get(name))) is not None:
                row[place] = 1.0
        return np.array(row, dtype=np.float64)


class Experts(abc.ABC):
    """The mean and two linear regressions of different memories, beside a network.

    Parameters
    ----------
    codings : dict of str to Coding
        Fitted codings of all features.
    rows : list of dict
        Last samples, as `StreamEstimator` reads them.
    targets : ndarray, shape (n_samples, n_outputs)
    """

    first: str  # name of the first expert
    error_limit: float  # see `_core.RecursiveLeastSquares`

    def __init__(
        self, codings: Mapping[str, Coding], rows: Sequence[Mapping[str, object]], targets: Floats
    ) -> None:
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
        self.models = self._models(low, high, targets.shape[1])
        for sample, target in zip(rows, targets, strict=True):
            self._learn_linear(self.columns.row(sample), target)

    def _models(
        self, low: Sequence[float], high: Sequence[float], n_outputs: int
    ) -> list[_core.RecursiveLeastSquares]:
        make, limit = _core.RecursiveLeastSquares, self.error_limit
        mean = make([], [], n_outputs, FORGETTING_OF_MEAN, limit)
        return [mean, *(make(low, high, n_outputs, share, limit) for share in FORGETTING)]

    def _learn_linear(self, row: Floats, target: Floats) -> None:
        self.models[0].learn([], target)
        for model in self.models[1:]:
            model.learn(row, target)

    def estimates(self, sample: Mapping[str, Any], of_network: Floats) -> Estimates:
        """Return the predictions of all experts; that of the network has shape (n_outputs,)."""
        row = self.columns.row(sample)
        linear = [model.predict(row) for model in self.models[1:]]
        return Estimates(row, np.array([self.models[0].predict([]), *linear, of_network]))

    @abc.abstractmethod
    def mix(self, each: Floats) -> Floats:
        """Return the weighted mean of predictions or probabilities, shape (n_outputs,)."""

    @abc.abstractmethod
    def _compare(self, each: Floats, target: Floats) -> None:
        """Update the weights."""

    def learn(self, estimates: Estimates, target: Floats) -> None:
        """Learn the target of predictions, which may have a new class as its last."""
        n_new = len(target) - self.models[0].n_outputs
        if n_new:
            for model in self.models:
                model.add_outputs(n_new)
        else:
            self._compare(estimates.each, target)
        self._learn_linear(estimates.row, target)

    def add(self, codings: Mapping[str, Coding], rows: Sequence[Mapping[str, object]]) -> None:
        """Add features and categories, whose weights are 0; see `LinearColumns.add`."""
        low, high = self.columns.add(codings, rows)
        for model in self.models[1:]:
            model.add_inputs(low, high)

    @property
    def weights(self) -> dict[str, float]:
        """The weights of the experts, which sum to 1."""
        first, *linear, network = self.mixture.weights.tolist()
        return {self.first: first, "linear": sum(linear), "network": network}

    def __getstate__(self) -> dict[str, object]:
        models = [model.state() for model in self.models]
        return {**self.__dict__, "models": models, "mixture": self.mixture.state()}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.__dict__ = state
        states, mixture = state["models"], state["mixture"]
        low, high = (states[-1][name] for name in ("low", "high"))
        self.models = self._models(low, high, len(states[0]["origins"]))
        for model, of_model in zip(self.models, states, strict=True):
            model.restore(of_model)
        self.mixture = self._mixture()
        self.mixture.restore(mixture)


class RegressionExperts(Experts):
    """Experts for numbers, weighted by their squared errors."""

    first = "mean"
    error_limit = ERROR_LIMIT

    def _mixture(self) -> _core.PredictionMixture:
        return _core.PredictionMixture(2 + len(FORGETTING))

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
        return _core.ProbabilityMixture(1 + len(FORGETTING))

    def mix(self, each: Floats) -> Floats:
        """Return the probabilities of classes, shape (n_classes,)."""
        probabilities: Floats = self.mixture.mix(each[0], each[1:])
        return probabilities

    def _compare(self, each: Floats, target: Floats) -> None:
        self.mixture.learn(each[0], each[1:], int(np.argmax(target)))
