"""The code and the layer together: what a fitted estimator predicts with, and pickles."""

from __future__ import annotations

import contextlib
import threading
from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.estimators.input_code import InputCode

__all__ = ["FEW_SAMPLES", "Network"]

FEW_SAMPLES = 32
"""Samples up to which weights in bytes are the quicker way to learn and answer them."""


class Network:
    """N units over the code of the inputs; weights and thresholds are exact integers.

    Any number of threads may read it at once, as long as none trains it.

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
        self._forget_online()
        try:
            self._layer = _core.ParallelPerceptron(
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

    def _forget_online(self) -> None:
        """Have no layer for single samples."""
        self._online: _core.OnlineLayer | None = None
        # Marks of what the online layer learned last, and of what the other one has of it.
        self._learned: object = None
        self._synchronized: object = None
        self._lock = threading.RLock()

    @property
    def layer(self) -> _core.ParallelPerceptron:
        """The core's layer as it is now; who trains it trains a `copy`, or a fresh network."""
        # Only then: the core refuses to synchronize what another thread reads.
        if self._synchronized is not self._learned:
            self._synchronize()
        return self._layer

    def _synchronize(self) -> None:
        """Bring the layer up to date; one thread does, the others wait."""
        with self._lock:
            learned = self._learned
            if self._online is not None and self._synchronized is not learned:
                self._online.synchronize()
                self._synchronized = learned

    def copy(self) -> Network:
        """Return a network with the same code and weights of its own."""
        other = object.__new__(Network)
        other.input_code = self.input_code
        other.n_units = self.n_units
        other._forget_online()
        other._layer = self.layer.copy()
        return other

    def online(self, memory_limit: int) -> _core.OnlineLayer | None:
        """Return the layer for samples one at a time; None if its weights do not fit into bytes.

        It is kept until the network is pickled or its weights are replaced. None too if its two
        bytes per weight are more than ``memory_limit``.
        """
        if self._online is None and 2 * self.n_units * self.input_code.core.n_columns <= (
            memory_limit
        ):
            with self._lock, contextlib.suppress(ValueError, MemoryError):
                self._online = self._online or _core.OnlineLayer(self._layer)
        return self._online

    def learn_online(
        self, present: Callable[[_core.OnlineLayer], object], memory_limit: int
    ) -> bool:
        """Let the layer of `online` learn what ``present`` presents to it; False if there is none.

        Samples are learned in place: nothing that may fail follows.
        """
        online = self.online(memory_limit)
        if online is None:
            return False
        begun, ended = object(), object()
        self._learned = begun  # an interrupt may come between learning and the other mark
        present(online)
        self._learned = ended
        return True

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
        self._forget_online()
        self._layer = _core.ParallelPerceptron(
            self.input_code.core, self.n_units, weights=weights, thresholds=thresholds
        )

    def potentials(self, table: NDArray[Any], n_threads: int) -> NDArray[np.int32]:
        """Potentials, (n_samples, n_inputs) to (n_samples, n_units)."""
        return self.potentials_of_bins(self.input_code.bins(table), n_threads)

    def potentials_of_bins(self, bins: NDArray[np.int32], n_threads: int) -> NDArray[np.int32]:
        """Potentials, (n_samples, n inputs in pairs) to (n_samples, n_units)."""
        if self._online is not None and len(bins) <= FEW_SAMPLES:
            return self._online_potentials(self._online, bins)
        return self.layer.potentials(bins, n_threads=n_threads)

    def counts(self, table: NDArray[Any], n_groups: int, n_threads: int) -> NDArray[np.int32]:
        """How many units fire, (n_samples, n_inputs) to (n_samples, n_groups)."""
        return self.counts_of_bins(self.input_code.bins(table), n_groups, n_threads)

    def counts_of_bins(
        self, bins: NDArray[np.int32], n_groups: int, n_threads: int
    ) -> NDArray[np.int32]:
        """How many units fire, (n_samples, n inputs in pairs) to (n_samples, n_groups)."""
        if self._online is not None and len(bins) <= FEW_SAMPLES:
            potentials = self._online_potentials(self._online, bins)
            firing = (potentials > 0).reshape(len(bins), n_groups, -1)
            counts: NDArray[np.int32] = firing.sum(axis=2, dtype=np.int32)
            return counts
        return self.layer.counts(bins, n_groups=n_groups, n_threads=n_threads)

    def _online_potentials(
        self, online: _core.OnlineLayer, bins: NDArray[np.int32]
    ) -> NDArray[np.int32]:
        with self._lock:  # the core refuses to read what another thread synchronizes
            return online.potentials(bins)
