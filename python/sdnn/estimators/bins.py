"""Bins of the inputs of many samples or a few."""

from __future__ import annotations

import functools
from collections.abc import Sequence

import numpy as np

from sdnn.coding import Coding
from sdnn.coding.symbols import present
from sdnn.estimators.columns import Array, Floats, Ints

FEW_ROWS = 64  # largest number of rows whose bins are found together, for all columns


class InputBins:
    """Finds the bins of the columns ``used``, each with its fitted coding of ``codings``."""

    def __init__(self, codings: Sequence[Coding], used: Sequence[int] | None = None) -> None:
        self.codings = tuple(codings)
        self.used = list(range(len(self.codings)) if used is None else used)

    def bins(self, table: Array) -> Ints:
        """Return the bins of samples, (n_samples, n_inputs) to (n_samples, n used inputs)."""
        if len(table) <= FEW_ROWS and self._even is not None and table.dtype == np.float64:
            return self._even_bins(table)
        bins = np.empty((len(table), len(self.used)), dtype=np.int32)
        for number, index in enumerate(self.used):
            try:
                bins[:, number] = self.codings[index].bins(table[:, index])
            except ValueError as error:
                raise ValueError(f"{error} in column {index}") from None
        return bins

    @functools.cached_property
    def _even(self) -> tuple[slice | Ints, Floats, Floats, Floats, Ints] | None:
        """Inputs, low, high, half widths and n_bins for `_even_bins`; None for uneven bins."""
        codings = [present(self.codings[index]) for index in self.used]
        ranges = [coding.even_range() for coding in codings]
        if None in ranges:
            return None
        every = self.used == list(range(len(self.codings)))
        low, high = np.array(ranges, dtype=np.float64).T
        half_width = high / 2 - low / 2  # 0 for a column with a single value
        half_width[half_width == 0] = 1
        sizes = np.array([coding.size for coding in codings], dtype=np.int32)
        used = slice(None) if every else np.array(self.used, dtype=np.int32)
        return used, low, high, half_width, sizes

    def _even_bins(self, table: Array) -> Ints:
        """Return bins of equal width for a few rows of numbers, of all columns at once."""
        assert self._even is not None
        used, low, high, half_width, sizes = self._even
        values = table[:, used]
        inside = np.minimum(np.maximum(values, low), high)
        positions = (inside / 2 - low / 2) / half_width  # as in `sdnn.coding.numeric`
        is_missing = values != values  # NaN
        positions[is_missing] = 0
        bins: Ints = np.minimum((positions * sizes).astype(np.int32), sizes - 1)
        return np.where(is_missing, sizes, bins)
