"""The kernel of the samples that span a solution with others, and its sums."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from sdnn import _core
from sdnn.coding import Coding, RandomInverse, WithMissing
from sdnn.coding.kernel import N_UNITS, AnalyticKernel
from sdnn.coding.symbols import present
from sdnn.estimators.bins import InputBins
from sdnn.estimators.columns import Array, Floats, Ints
from sdnn.estimators.ridge import apply_degree, row_blocks

LEAST_POWER = 1e-150  # smallest correlation that is computed from powers
MOST_CORRELATIONS = 2000**2  # of all inputs, in tables


class KernelOfSamples(InputBins):
    """A kernel of a degree, between samples, shape (n_samples, n_inputs), and others.

    The core computes it for all pairs of inputs, to about 15 digits; NumPy does for listed pairs,
    and where tables of correlations would take more than 32 MB.
    """

    def __init__(self, kernel: AnalyticKernel, samples: Array, degree: int) -> None:
        super().__init__(kernel.codings)
        self._arguments = kernel, samples, degree
        self._core: _core.KernelSums | None = None
        self._with_pattern = [i for i, c in enumerate(self.codings) if isinstance(c, WithMissing)]
        tables = tables_of(self.codings) if kernel.has_all_pairs else None
        if tables is not None:
            # Whether a value is missing is one more input: only missing values are alike.
            tables += [np.diag([0.0, 1.0])] * len(self._with_pattern)
            bins, n_inputs = self._core_bins(samples), len(self.codings)
            self._core = _core.KernelSums(tables, bins, n_inputs, degree)

    def __reduce__(self) -> tuple[object, ...]:
        return KernelOfSamples, self._arguments

    def _core_bins(self, table: Array) -> Ints:
        """Return the bins of inputs, and whether values are missing."""
        bins = self.bins(table)
        if not self._with_pattern:
            return bins
        last = [self.codings[index].size - 1 for index in self._with_pattern]
        return np.concatenate([bins, bins[:, self._with_pattern] == last], axis=1, dtype=np.int32)

    def matrix(self, table: Array) -> Floats:
        """Return the kernel of others and the samples, shape (n_others, n_samples)."""
        if self._core is not None:
            return self._core.matrix(self._core_bins(table))
        kernel, samples, degree = self._arguments
        return apply_degree(kernel(table, samples), degree)

    def sums(self, table: Array, coefficients: Floats) -> Floats:
        """Return the kernel times coefficients, (n_samples, n_outputs), of the samples."""
        if self._core is not None:
            return self._core.sums(self._core_bins(table), coefficients)
        parts = [self.matrix(table[rows]) @ coefficients for rows in row_blocks(len(table))]
        return np.concatenate(parts)


def tables_of(codings: Sequence[Coding]) -> list[Floats] | None:
    """Return the correlations of each input's bins; None if there are too many to look up fast."""
    tables, n_correlations = [], 0
    for coding in codings:
        tables.append(correlations_of(coding))
        n_correlations += tables[-1].size
        if n_correlations > MOST_CORRELATIONS:
            return None
    return tables


def correlations_of(coding: Coding) -> Floats:
    """Return correlations as the core takes them, without those of missing values.

    They are those of the first bin, if they fall by a factor from bin to bin, or those of all bins.
    """
    base = present(coding)
    correlations = base.correlations(N_UNITS)
    if type(base) is RandomInverse and correlations[0].min() > LEAST_POWER:
        correlations = correlations[0]
    if base is coding:
        return correlations
    return np.pad(correlations, (0, 1))  # a missing value correlates with no other
