"""The code and the layer together: what a fitted estimator predicts with, and pickles."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.estimators.input_code import InputCode

__all__ = ["Network"]


class Network:
    """N units over the code of the inputs; weights and thresholds are exact integers.

    Parameters
    ----------
    input_code : InputCode
        Gives the columns that the units read.
    n_units : int
        N, at least 1.
    seed : int
        First weights follow from it where none are given.
    weights, thresholds : ndarray, shapes (n_units, n_columns) and (n_units,), optional
        Both or neither.
    """

    def __init__(
        self,
        input_code: InputCode,
        n_units: int,
        seed: int = 0,
        weights: NDArray[np.int32] | None = None,
        thresholds: NDArray[np.int32] | None = None,
    ) -> None:
        self.input_code = input_code
        self.n_units = n_units
        try:
            self.layer = _core.ParallelPerceptron(
                input_code.core, n_units, seed=seed, weights=weights, thresholds=thresholds
            )
        except MemoryError:
            n_bytes = 4 * n_units * input_code.core.n_columns
            raise MemoryError(
                f"{n_units} units of {input_code.core.n_columns} columns need {n_bytes} bytes for "
                "their weights"
            ) from None

    def __getstate__(self) -> dict[str, Any]:
        """Keep the weights instead of the core's object."""
        return {
            "input_code": self.input_code,
            "n_units": self.n_units,
            "weights": self.weights,
            "thresholds": self.thresholds,
        }

    def __setstate__(self, state: dict[str, Any]) -> None:
        """Build the core's object again."""
        self.__init__(**state)  # type: ignore[misc]

    @property
    def weights(self) -> NDArray[np.int32]:
        """Copy the weights, shape (n_units, n_columns)."""
        return self.layer.weights

    @property
    def thresholds(self) -> NDArray[np.int32]:
        """Copy the thresholds, shape (n_units,)."""
        return self.layer.thresholds

    def restore(self, weights: NDArray[np.int32], thresholds: NDArray[np.int32]) -> None:
        """Go back to earlier weights and thresholds."""
        self.layer = _core.ParallelPerceptron(
            self.input_code.core, self.n_units, weights=weights, thresholds=thresholds
        )

    def potentials(self, table: NDArray[Any], n_threads: int) -> NDArray[np.int32]:
        """Potentials, (n_samples, n_inputs) to (n_samples, n_units)."""
        return self.layer.potentials(self.input_code.bins(table), n_threads=n_threads)

    def counts(self, table: NDArray[Any], n_groups: int, n_threads: int) -> NDArray[np.int32]:
        """How many units fire, (n_samples, n_inputs) to (n_samples, n_groups)."""
        bins = self.input_code.bins(table)
        return self.layer.counts(bins, n_groups=n_groups, n_threads=n_threads)
