"""What a fitted estimator holds: its network read as attributes, and its file."""

from __future__ import annotations

from pathlib import Path
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from sklearn.utils.validation import check_is_fitted

from sdnn import _core
from sdnn.coding import Coding
from sdnn.estimators import files
from sdnn.estimators.network import Network

__all__ = ["Fitted"]

Self = TypeVar("Self", bound="Fitted")


class Fitted:
    """Attributes of an estimator that holds a network."""

    network_: Network
    n_iter_: int
    n_features_in_: int
    n_inputs_out_of_range_: int
    n_corrected_: NDArray[np.int64]
    validation_scores_: NDArray[np.float64]
    training_form_: str
    training_memory_: int
    _weight_seed: int
    _earlier: tuple[Network, ...] = ()

    @property
    def _fitted_network(self) -> Network:
        if "network_" not in self.__dict__:  # scikit-learn's check takes as long as small networks
            check_is_fitted(self, "network_")
        return self.network_

    @property
    def codings_(self) -> tuple[Coding, ...]:
        """The fitted coding of each input."""
        return self._fitted_network.input_code.codings

    @property
    def pairs_(self) -> tuple[tuple[int, int], ...]:
        """The pairs (modified, modifier) of inputs; equal numbers stand for the plain pattern."""
        return self._fitted_network.input_code.pairs

    @property
    def weights_(self) -> NDArray[np.int32]:
        """The integer weights, shape (n_units, n_pairs * n_pattern_units)."""
        return self._fitted_network.weights

    @property
    def thresholds_(self) -> NDArray[np.int32]:
        """The integer thresholds, shape (n_units,)."""
        return self._fitted_network.thresholds

    @property
    def pair_importances_(self) -> NDArray[np.float64]:
        """How much training has changed the weights of each of ``pairs_``: squares, of a sum of 1.

        Shape (n_pairs,). Zeros if nothing was learned.
        """
        network = self._fitted_network
        code = network.input_code
        begun = _core.ParallelPerceptron(code.core, network.n_units, seed=self._weight_seed)
        change = network.weights - begun.weights
        of_pairs = change.reshape(network.n_units, len(code.pairs), code.n_units)
        squares: NDArray[np.float64] = np.square(of_pairs, dtype=np.float64).sum(axis=(0, 2))
        shares: NDArray[np.float64] = squares / max(squares.sum(), 1.0)
        return shares

    def save(self, path: str | Path) -> None:
        """Write the fitted estimator to a safetensors file with JSON metadata, without pickle.

        Raises
        ------
        NotFittedError
            If there is nothing to write yet.
        TypeError
            If a parameter cannot be written as JSON, such as a coding of one's own.
        OSError
            If the file cannot be written; one that was there before stays as it was.
        """
        check_is_fitted(self, "network_")
        files.save(self, path)  # type: ignore[arg-type]

    @classmethod
    def load(cls: type[Self], path: str | Path) -> Self:
        """Read an estimator that `save` has written.

        Raises
        ------
        ValueError
            If the file holds something else.
        OSError
            If the file cannot be read.
        """
        return files.load(path, cls)  # type: ignore[type-var]
