"""Kernel estimators that predict as C headers."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from sdnn.coding import WithMissing
from sdnn.estimators.columns import Floats, Ints
from sdnn.export.coded_inputs import CodedInput, add_inputs, coded_input
from sdnn.export.estimator_text import EstimatorHeader, HeaderText
from sdnn.export.text import Tables, bits_of, rounded_up

if TYPE_CHECKING:
    from sdnn.estimators import SDNNKernelClassifier, SDNNKernelRidge

_CORRELATION_BYTES = 8  # of a struct of sdnn_kernel_estimator.h
_MOST_INPUTS = 2**16 - 1  # numbers of features and mixtures have 16 bits


class KernelWriter(HeaderText):
    """Makes the header of a kernel estimator."""

    title = "a regressor or classifier with the network's kernel"
    file = "sdnn_kernel_estimator.h"
    code_size = "2 to 3 kB"
    remedy = "train with a smaller max_components, or with fewer features"
    model: SDNNKernelRidge | SDNNKernelClassifier

    def __init__(self, model: SDNNKernelRidge | SDNNKernelClassifier, name: str) -> None:
        self.kernel = model.kernel_
        self.n_features = len(model.codings_)
        self.directions: Floats = model._inputs.directions
        columns = model.selected_features_.tolist()
        columns += range(self.n_features, self.n_features + len(self.directions))
        if self.n_features + len(self.directions) > _MOST_INPUTS:
            raise ValueError(
                f"model must have at most {_MOST_INPUTS} features and mixtures of features for a C"
                f" header, got {self.n_features} and {len(self.directions)}"
            )
        codings = zip(columns, self.kernel.codings, strict=True)
        super().__init__(model, name, [coded_input(column, coding) for column, coding in codings])
        bins = [
            coding.bins(model.X_fit_[:, index]) for index, coding in enumerate(self.kernel.codings)
        ]
        self.components: Ints = np.stack(bins, axis=1)
        self.n_sums = model.dual_coef_.shape[1]

    @property
    def _has_all_pairs(self) -> bool:
        """Whether sums over inputs replace the loop over pairs; for two they save nothing."""
        return self.kernel.has_all_pairs and len(self.inputs) > 2

    def about(self) -> str:
        """Describe the size of the estimator."""
        n_mixtures = len(self.directions)
        n_features = len(self.inputs) - n_mixtures
        return f"{len(self.components)} samples of {n_features} features and {n_mixtures} mixtures"

    def header(self) -> EstimatorHeader:
        """Make the header."""
        tables = Tables(self.name)
        n = len(self.inputs)
        # C sums the similarities of pairs and divides by the sum of their weights: 2 for equal
        # inputs, else 1. The sum over all pairs leaves out each pair's factor 1 / 2.
        divisor = 2 * n * (n - 1)
        if not self._has_all_pairs:
            divisor = sum(2 if mu == nu else 1 for mu, nu in self.kernel.pairs)
        macros = {
            "N_FEATURES": self.n_features,
            "N_SUMS": self.n_sums,
            "N_CLASSES" if self.is_classifier else "N_OUTPUTS": self.n_sums,
            "IS_CLASSIFIER": int(self.is_classifier),
            "DEGREE": self.model.degree_,
            "KERNEL_DIVISOR": divisor,
            "HAS_ALL_PAIRS": int(self._has_all_pairs),
            "N_PAIRS": len(self.kernel.pairs),
            "N_COMPONENTS": len(self.components),
            "BINS_ARE_BYTES": int(self.components.max() < 256),
            **add_inputs(tables, self.inputs),
            **self._add_correlations(tables),
            **self._add_directions(tables),
        }
        if not self._has_all_pairs:
            tables.add("uint16_t", "pairs", np.array(self.kernel.pairs), "Modified and modifier.")
        n_bytes = tables.n_bytes
        bin_type = "uint8_t" if self.components.max() < 256 else "uint16_t"
        about = "Bins of the samples that were learned."
        tables.add(bin_type, "components", self.components.reshape(-1), about)
        about = "Their coefficients: bits of doubles."
        tables.add("uint64_t", "duals", bits_of(self.model.dual_coef_), about)
        weight_bytes = tables.n_bytes - n_bytes
        tables.add("uint64_t", "intercepts", bits_of(self.model.intercept_))
        return EstimatorHeader(
            name=self.name,
            text=self.text(macros, tables),
            flash_bytes=tables.n_bytes,
            weight_bytes=weight_bytes,
            ram_bytes=self.ram_bytes(),
        )

    def _add_correlations(self, tables: Tables) -> dict[str, object]:
        """Add the correlations of the inputs' bins, by distance where that is all that matters."""
        parts, rows, n_before = [], [], 0
        row_of: dict[int, str] = {}  # by `id` of a matrix, which inputs may share
        for source, matrix in zip(self.inputs, self.kernel._correlations, strict=True):
            if id(matrix) not in row_of:
                of_present = matrix[:-1, :-1] if isinstance(source.coding, WithMissing) else matrix
                values = by_distance(of_present)
                row_of[id(matrix)] = f"{{{n_before}, {int(values is not None)}}},"
                parts.append(of_present.reshape(-1) if values is None else values)
                n_before += len(parts[-1])
            rows.append(row_of[id(matrix)])
        about = "Correlations of bins: bits of doubles."
        tables.add("uint64_t", "correlations", bits_of(np.concatenate(parts)), about)
        tables.n_bytes += _CORRELATION_BYTES * len(rows)
        return {"CORRELATION_OF": rows}

    def _add_directions(self, tables: Tables) -> dict[str, object]:
        """Add the features of mixtures, their ranges and weights."""
        if not len(self.directions):
            return {"N_DIRECTIONS": 0}
        mixed = np.flatnonzero(self.directions.any(axis=0)).tolist()
        sources: list[CodedInput] = [coded_input(i, self.model.codings_[i]) for i in mixed]
        tables.add("uint16_t", "mixed", np.array(mixed), "Features of mixtures.")
        ranges = np.concatenate([source.values for source in sources])
        tables.add("uint64_t", "mixed_values", bits_of(ranges), "Their ranges: bits of doubles.")
        weights = self.directions[:, mixed].T
        tables.add("uint64_t", "directions", bits_of(weights), "Their weights: bits of doubles.")
        return {"N_DIRECTIONS": len(self.directions), "N_MIXED": len(mixed)}

    def ram_bytes(self) -> int:
        """Return the bytes of the arrays on the stack."""
        n_bytes = 4 * len(self.inputs) + 8 * self.n_sums  # bins, and doubles
        if len(self.directions):  # values of features and directions, and sums of directions
            n_bytes += 8 * (self.n_features + 2 * len(self.directions))
        return rounded_up(n_bytes, 8)


def by_distance(matrix: Floats) -> Floats | None:
    """Return a matrix's entries by the distance from its diagonal; None if they differ there.

    >>> by_distance(np.array([[1.0, 0.5], [0.5, 1.0]]))
    array([1. , 0.5])
    """
    n = np.arange(len(matrix))
    first: Floats = matrix[0].copy()
    return first if np.array_equal(matrix, first[abs(n[:, None] - n)]) else None
