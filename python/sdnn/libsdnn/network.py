"""The networks of LIBSDNN: parameters, code, first weights, training and predictions."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn import _core

Library = Literal["msvc", "libstdc++"]
MOST_DRAWN = 2**27  # flips and 64-unit words of code tables: some seconds


@dataclass(frozen=True, kw_only=True)
class LibsdnnInput:
    """Coding of one input: numbers in [0, 1], or symbols (whole numbers from 0)."""

    symbolic: bool
    n_bins: int
    n_flipped: int


@dataclass(frozen=True, kw_only=True)
class LibsdnnParameters:
    """The content of a parameter file; seeds are None for hardware entropy.

    ``output_range`` and ``step_size`` are for regression, ``n_classes`` and ``scheme`` for
    classification.
    """

    task: Literal["regression", "classification"]
    n_units: int
    inputs: tuple[LibsdnnInput, ...]
    pairs: tuple[tuple[int, int], ...]
    pattern_seed: tuple[int, ...] | None
    weight_seed: tuple[int, ...] | None
    initial_range: tuple[int, int] = (-5, 5)
    output_range: tuple[float, float] = (0.0, 1.0)
    step_size: float = 0.01
    n_classes: int = 2
    scheme: Literal["one_vs_one", "one_vs_rest"] = "one_vs_one"

    @property
    def n_output_units(self) -> int:
        """Perceptrons: one per output step, per class or per pair of classes."""
        if self.task == "regression":
            low, high = self.output_range
            return int((high - low) / self.step_size)
        return _core.n_units_for(self.scheme, self.n_classes)

    def bins(self, inputs: ArrayLike) -> NDArray[np.int32]:
        """Return the bins of samples, shape (n_samples, n_inputs), values outside clipped."""
        values = np.asarray(inputs, dtype=np.float64)
        if values.ndim != 2 or values.shape[1] != len(self.inputs):
            raise ValueError(
                f"inputs must have shape (n_samples, {len(self.inputs)}), got {values.shape}"
            )
        if not np.isfinite(values).all():
            raise ValueError("inputs must be finite, got NaN or infinity")
        factors = np.array([1 if coded.symbolic else coded.n_bins for coded in self.inputs])
        highest = np.array([coded.n_bins - 1 for coded in self.inputs])
        bins = np.clip(np.trunc(values * factors), 0, highest)
        return np.asarray(bins, dtype=np.int32)

    def make_code(self, library: Library = "msvc") -> _core.SelectiveDesensitization:
        """Return the code with LIBSDNN's own tables; needs a seed in the file."""
        if self.pattern_seed is None:
            raise ValueError("random_seed of PC must be a list of numbers, got hardware_entropy")
        n_tables = 2 * len(self.pairs)
        for coded in {self.inputs[index] for pair in self.pairs for index in pair}:
            if n_tables * coded.n_bins * max(coded.n_flipped, self.n_units // 64) > MOST_DRAWN:
                raise ValueError(
                    f"q of RANDOM_INVERSE is too large: {coded.n_bins} patterns of {self.n_units} "
                    f"units, {coded.n_flipped} flipped, in {n_tables} tables"
                )
        sizes = [(coded.n_bins, coded.n_flipped) for coded in self.inputs]
        pairs = np.array(self.pairs, dtype=np.int32)
        modified, modifiers = _core.libsdnn_tables(
            self.n_units, sizes, pairs, self.pattern_seed, library
        )
        return _core.SelectiveDesensitization(modified, modifiers, pairs)

    def make_layer(self, library: Library = "msvc") -> _core.ParallelPerceptron:
        """Return the untrained network, bit for bit; needs seeds in the file."""
        if self.weight_seed is None:
            raise ValueError("random_seed of NN must be a list of numbers, got hardware_entropy")
        code = self.make_code(library)
        # LIBSDNN's classifiers always start from [-5, 5].
        low, high = self.initial_range if self.task == "regression" else (-5, 5)
        weights, thresholds = _core.libsdnn_weights(
            self.n_output_units, code.n_columns, low, high, self.weight_seed, library
        )
        return _core.ParallelPerceptron(
            code, self.n_output_units, weights=weights, thresholds=thresholds
        )

    def make_trainer(
        self, layer: _core.ParallelPerceptron, inputs: ArrayLike, targets: ArrayLike
    ) -> _core.PDeltaTrainer | _core.PerceptronTrainer:
        """Return a trainer whose ``present(np.arange(n_samples))`` is one iteration of LIBSDNN."""
        bins = self.bins(inputs)
        if self.task == "regression":
            low = self.output_range[0]
            counts = (np.asarray(targets, dtype=np.float64).reshape(-1, 1) - low) / self.step_size
            return _core.PDeltaTrainer(layer, bins, counts)
        labels = np.asarray(targets, dtype=np.int32)
        return _core.PerceptronTrainer(layer, bins, labels, self.n_classes, self.scheme)


@dataclass(frozen=True, kw_only=True)
class LibsdnnModel:
    """A trained network from a model file."""

    parameters: LibsdnnParameters
    layer: _core.ParallelPerceptron

    def predict(
        self, inputs: ArrayLike, n_threads: int = 1
    ) -> NDArray[np.float64] | NDArray[np.int64]:
        """Return LIBSDNN's outputs, numbers or classes from 0, shape (n_samples,)."""
        parameters = self.parameters
        bins = parameters.bins(inputs)
        if parameters.task == "regression":
            counts = self.layer.counts(bins, n_threads=n_threads)[:, 0]
            return np.asarray(parameters.step_size * counts + parameters.output_range[0])
        potentials = self.layer.potentials(bins, n_threads=n_threads)
        if parameters.scheme == "one_vs_rest":  # class 0 if no unit fires
            return np.asarray(np.maximum(potentials, 0).argmax(axis=1))
        n_classes = parameters.n_classes
        votes = np.zeros((len(bins), n_classes), dtype=np.int64)
        for unit, (i, j) in enumerate(zip(*np.triu_indices(n_classes, 1), strict=True)):
            votes[:, i] += potentials[:, unit] > 0
            votes[:, j] += potentials[:, unit] <= 0
        return np.asarray(votes.argmax(axis=1))
