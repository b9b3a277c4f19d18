"""What generalizes to what: the kernel of an infinitely long code, and pictures of it.

After training on one sample, the network's answer to another one changes with the inner product
of their codes. For long codes it approaches a kernel that follows from the codings alone: for each
pair, ``(1 + rho_modifier) / 2 * rho_modified``, where rho is the correlation of the patterns of
two values, averaged over the pairs. A plain pattern has no modifier and counts twice, because
all of its units are active. The kernel of a sample with itself is 1.

>>> import numpy as np
>>> from sdnn import kernel
>>> from sdnn.coding import RandomInverse
>>> one = kernel.AnalyticKernel(RandomInverse(length_scale=0.2, low=0.0, high=1.0), n_inputs=2)
>>> one(np.array([[0.5, 0.5]]), np.array([[0.5, 0.5], [0.7, 0.5], [0.7, 0.9]])).round(2)
array([[1.  , 0.52, 0.15]])
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Sequence
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn.coding import Coding, coding_named

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["AnalyticKernel", "correlations", "plot_similarity", "similarity"]

N_UNITS = 2000
"""Units per pattern where none are named."""

ENTRIES_AT_ONCE = 2**18
"""Entries of a kernel matrix, each the sum over all inputs, that are computed at a time."""


def fitted(coding: str | Coding, n_units: int) -> Coding:
    """Return a coding that knows its bins; on [0, 1] where it has not learned a range."""
    one = coding_named(coding)
    ends = None if one.learns else one.ends()
    # Where all values were equal the range is one point, which only such a column fits again.
    is_constant = ends is not None and ends[0] == ends[1]
    return one.fit(np.array(ends if is_constant else [0.0, 1.0]), n_units)


def shared(matrices: Iterable[NDArray[np.float64]]) -> list[NDArray[np.float64]]:
    """Return the matrices, equal ones as one in memory."""
    found: list[NDArray[np.float64]] = []
    for matrix in matrices:
        found.append(next((same for same in found if np.array_equal(same, matrix)), matrix))
    return found


def correlations(coding: str | Coding, n_units: int = N_UNITS) -> NDArray[np.float64]:
    """Return the expected correlation of the patterns of each two bins, shape (n_bins, n_bins).

    Parameters
    ----------
    coding : str or Coding
        On the range [0, 1] unless it names or has learned another one.
    n_units : int
        Units per pattern.

    Examples
    --------
    >>> correlations("anchor").shape
    (360, 360)
    """
    return fitted(coding, n_units).correlations(n_units)


def similarity(coding: str | Coding, n_units: int = N_UNITS, seed: int = 0) -> NDArray[np.float64]:
    """Return the correlation of the patterns drawn from a seed; scattered about `correlations`."""
    patterns = fitted(coding, n_units).patterns(n_units, seed).astype(np.float64)
    return patterns @ patterns.T / n_units


class AnalyticKernel:
    """The kernel of selective desensitization with infinitely many units per pattern.

    Give its matrix to any kernel method (``KernelRidge(kernel="precomputed")``).

    Parameters
    ----------
    coding : str, Coding or sequence of Coding
        Of all inputs, or of each. Give them with ranges, or learned (as ``model.codings_`` are):
        one without a range is taken to be on [0, 1].
    n_inputs : int, optional
        Number of inputs; needed where there is one coding for all.
    pairs : list of (int, int), optional
        Pairs (modified, modifier), equal numbers for a plain pattern (as ``model.pairs_`` are);
        every pair of different inputs where None.
    n_units : int
        Units per pattern, which decide how far a flip of one unit goes.
    """

    def __init__(
        self,
        coding: str | Coding | Sequence[Coding],
        n_inputs: int | None = None,
        pairs: Sequence[tuple[int, int]] | None = None,
        n_units: int = N_UNITS,
    ) -> None:
        if isinstance(coding, str | Coding):
            if n_inputs is None:
                raise ValueError("n_inputs must be given with one coding for all inputs")
            coding = [coding_named(coding)] * n_inputs
        inputs = range(len(coding))
        every = [(mu, nu) for mu in inputs for nu in inputs if mu != nu] or [(0, 0)]
        self.codings = tuple(fitted(one, n_units) for one in coding)
        self.pairs = tuple(every if pairs is None else pairs)
        self._every = pairs is None
        self._correlations = shared(one.correlations(n_units) for one in self.codings)

    def __call__(self, X: ArrayLike, Y: ArrayLike | None = None) -> NDArray[np.float64]:
        """Compute the kernel of each two samples.

        Parameters
        ----------
        X : array_like, shape (n_samples, n_inputs)
        Y : array_like, shape (n_others, n_inputs), optional
            X itself where None.

        Returns
        -------
        ndarray, shape (n_samples, n_others)

        Raises
        ------
        ValueError
            For another number of inputs, NaN, or a category that no coding knows.
        """
        one = np.asarray(X)
        other = one if Y is None else np.asarray(Y)
        for name, table in (("X", one), ("Y", other)):
            if table.ndim != 2 or table.shape[1] != len(self.codings):
                raise ValueError(
                    f"{name} must have shape (n, {len(self.codings)}), got {table.shape}"
                )
        bins = [
            (coding.bins(one[:, index]), coding.bins(other[:, index]))
            for index, coding in enumerate(self.codings)
        ]
        kernel = np.empty((len(one), len(other)))
        n_rows = max(1, ENTRIES_AT_ONCE // max(1, len(other)))
        for begin in range(0, len(one), n_rows):
            rows = slice(begin, begin + n_rows)
            of_inputs = (
                matrix[np.ix_(of_one[rows], of_other)]
                for matrix, (of_one, of_other) in zip(self._correlations, bins, strict=True)
            )
            kernel[rows] = self._of_correlations(of_inputs, np.zeros_like(kernel[rows]))
        return kernel

    def _of_correlations(
        self, of_inputs: Iterator[NDArray[np.float64]], total: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Return the kernel by the correlations of each input; ``total`` is zeros to work in."""
        if self._every and len(self.codings) > 2:  # the sum over nu != mu by the sums over all
            squares = np.zeros_like(total)
            for of_input in of_inputs:
                total += of_input
                squares += of_input**2
            n_inputs = len(self.codings)
            return ((n_inputs - 1) * total + total**2 - squares) / (2 * n_inputs * (n_inputs - 1))
        rho = list(of_inputs)
        for mu, nu in self.pairs:
            total += 2 * rho[mu] if mu == nu else (1 + rho[nu]) / 2 * rho[mu]
        return total / sum(2 if mu == nu else 1 for mu, nu in self.pairs)


def plot_similarity(
    coding: str | Coding, n_units: int = N_UNITS, seed: int = 0, title: str | None = None
) -> Figure:
    """Draw the `similarity` of a coding's patterns, and that of one bin as a curve.

    The title is the coding's name where None. Needs matplotlib (``pip install "sdnn[plot]"``).
    """
    from matplotlib.figure import Figure

    one = fitted(coding, n_units)
    drawn, expected = similarity(one, n_units, seed), one.correlations(n_units)
    middle = one.size // 2
    figure = Figure(figsize=(8.0, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    image = left.imshow(drawn, vmin=-1, vmax=1, cmap="RdBu_r", origin="lower")
    figure.colorbar(image, ax=left, label="correlation of patterns")
    left.set(xlabel="bin", ylabel="bin")
    style: dict[str, Any] = {} if one.is_numeric else {"marker": "o", "linestyle": "none"}
    right.plot(drawn[middle], color="tab:blue", label=f"drawn, {n_units} units", **style)
    right.plot(expected[middle], color="black", linewidth=1, label="expected", linestyle="--")
    right.set(xlabel="bin", ylabel=f"correlation with bin {middle}", ylim=(-1.05, 1.05))
    right.legend(frameon=False, loc="lower left")
    right.spines[["top", "right"]].set_visible(False)
    figure.suptitle(title or f"{one.name}, {one.size} bins")
    return figure
