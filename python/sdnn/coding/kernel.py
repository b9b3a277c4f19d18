"""The kernel that the network's code approaches, and similarity plots of codings.

The inner product of two samples' codes decides how training on one changes the answer to the
other. For long codes it approaches the mean of ``(1 + rho_modifier) / 2 * rho_modified`` over the
pairs, where rho is the correlation of the patterns of two values. A plain pattern has no modifier
and counts twice.

>>> import numpy as np
>>> from sdnn.coding import kernel
>>> from sdnn.coding import RandomInverse
>>> unit = RandomInverse(length_scale=0.2, low=0.0, high=1.0)
>>> kernel_of_two = kernel.AnalyticKernel(unit, n_inputs=2)
>>> kernel_of_two(np.array([[0.5, 0.5]]), np.array([[0.5, 0.5], [0.7, 0.5], [0.7, 0.9]])).round(2)
array([[1.  , 0.52, 0.15]])
"""

from __future__ import annotations

from collections.abc import Hashable, Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn.coding import Coding, coding_named
from sdnn.coding.base import CODINGS
from sdnn.support.arguments import array_of, require, seed_of, shown, whole

if TYPE_CHECKING:
    from matplotlib.figure import Figure

__all__ = ["AnalyticKernel", "correlations", "plot_similarity", "similarity"]

N_UNITS = 2000  # default number of units per pattern
MOST_INPUTS = 4096
_CELLS = "fiubUSO"  # letters of NumPy's types that tables may have: numbers, words and objects
OF_VALUES = ("low", "high", "knots", "period", "origin", "categories")
"""Fields of codings that map values to bins, and do not change the patterns of bins."""
ENTRIES_AT_ONCE = 2**18  # entries of a kernel matrix computed at a time


def fitted(coding: str | Coding, n_units: int) -> Coding:
    """Return a coding that is fitted; without a range, to [0, 1]."""
    whole("n_units", n_units, 2, 2**16)
    coding = coding_named(coding)
    limits = None if coding.learns else coding.ends()
    # The range of a constant column is a single value: fit to that value.
    is_constant = limits is not None and limits[0] == limits[1]
    return coding.fit(np.array(limits if is_constant else [0.0, 1.0]), n_units)


def pattern_key(coding: Coding) -> Hashable:
    """Return the fields on which correlations depend: all except the range and categories.

    >>> from sdnn.coding import Symbolic
    >>> letters, numbers = Symbolic(categories=("a", "b")), Symbolic(categories=(1, 2))
    >>> pattern_key(letters) == pattern_key(numbers)
    True
    """
    if type(coding) not in CODINGS.values():
        return id(coding)
    fields = {name: value for name, value in vars(coding).items() if name not in OF_VALUES}
    parts = (
        pattern_key(value) if isinstance(value, Coding) else value for value in fields.values()
    )
    return type(coding), coding.size, *parts


def correlations(coding: str | Coding, n_units: int = N_UNITS) -> NDArray[np.float64]:
    """Return the expected correlations of a coding's patterns, shape (n_bins, n_bins).

    >>> correlations("anchor").shape
    (360, 360)
    """
    return fitted(coding, n_units).correlations(n_units)


def similarity(coding: str | Coding, n_units: int = N_UNITS, seed: int = 0) -> NDArray[np.float64]:
    """Return the correlations of patterns drawn with a seed, shape (n_bins, n_bins)."""
    patterns = fitted(coding, n_units).patterns(n_units, seed_of(seed)).astype(np.float64)
    return patterns @ patterns.T / n_units


class AnalyticKernel:
    """The kernel of selective desensitization with infinitely many units per pattern.

    Its matrix suits any kernel method (``KernelRidge(kernel="precomputed")``).

    Parameters
    ----------
    coding : str, Coding or sequence of Coding
        The coding of all inputs, or of each; on [0, 1] without a given or learned range.
    n_inputs : int, optional
        Needed with one coding for all inputs.
    pairs : list of (int, int), optional
        Pairs (modified, modifier), equal numbers for a plain pattern; by default every pair of
        different inputs.
    n_units : int
        Units per pattern, which decide how much one flipped unit changes.

    Attributes
    ----------
    codings, pairs, has_all_pairs
        The fitted codings, the pairs, and whether these were not given.
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
            coding = [coding_named(coding)] * whole("n_inputs", n_inputs, 1, MOST_INPUTS)
        if not isinstance(coding, Sequence) or not coding:
            raise ValueError(f"coding must be a coding, or one for each input, got {shown(coding)}")
        inputs = range(len(coding))
        all_pairs = [(mu, nu) for mu in inputs for nu in inputs if mu != nu] or [(0, 0)]
        self.codings = tuple(fitted(of_input, n_units) for of_input in coding)
        self.pairs = tuple(all_pairs) if pairs is None else _read_pairs(pairs, len(inputs))
        self.has_all_pairs = pairs is None
        keys = list(map(pattern_key, self.codings))  # equal codings share a matrix
        by_key = dict(zip(keys, self.codings, strict=True))
        matrices = {key: coding.correlations(n_units) for key, coding in by_key.items()}
        self._correlations = [matrices[key] for key in keys]

    def __call__(self, X: ArrayLike, Y: ArrayLike | None = None) -> NDArray[np.float64]:
        """Compute the kernel of X, shape (n_samples, n_inputs), and Y (X where None).

        Returns shape (n_samples, n_others). Raises ValueError for another number of inputs, NaN, or
        an unknown category.
        """
        first = array_of("X", X, _CELLS, "a table of numbers or words")
        second = first if Y is None else array_of("Y", Y, _CELLS, "a table of numbers or words")
        for name, table in (("X", first), ("Y", second)):
            is_table = table.ndim == 2 and table.shape[1] == len(self.codings)
            require(is_table, name, f"have shape (n, {len(self.codings)})", table.shape)
        bins = [
            (coding.bins(first[:, index]), coding.bins(second[:, index]))
            for index, coding in enumerate(self.codings)
        ]
        kernel = np.empty((len(first), len(second)))
        n_rows = max(1, ENTRIES_AT_ONCE // max(1, len(second)))
        for begin in range(0, len(first), n_rows):
            rows = slice(begin, begin + n_rows)
            of_inputs = (
                matrix[np.ix_(of_first[rows], of_second)]
                for matrix, (of_first, of_second) in zip(self._correlations, bins, strict=True)
            )
            kernel[rows] = self._kernel_of_correlations(of_inputs, np.zeros_like(kernel[rows]))
        return kernel

    def _kernel_of_correlations(
        self, of_inputs: Iterator[NDArray[np.float64]], total: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Combine the correlations of each input to the kernel; ``total`` is a zeroed buffer."""
        if self.has_all_pairs and len(self.codings) > 2:
            # The sum over nu != mu is that over all pairs without the diagonal.
            squares = np.zeros_like(total)
            for of_input in of_inputs:
                total += of_input
                squares += of_input**2
            return kernel_of_sums(total, squares, len(self.codings))
        rho = list(of_inputs)
        for mu, nu in self.pairs:
            total += 2 * rho[mu] if mu == nu else (1 + rho[nu]) / 2 * rho[mu]
        return total / sum(2 if mu == nu else 1 for mu, nu in self.pairs)


def kernel_of_sums(
    total: NDArray[np.float64], squares: NDArray[np.float64], n_inputs: int
) -> NDArray[np.float64]:
    """Return the kernel of all pairs from the sums of correlations and of their squares.

    A single input has a plain pattern.
    """
    if n_inputs == 1:
        return total.copy()
    return ((n_inputs - 1) * total + total**2 - squares) / (2 * n_inputs * (n_inputs - 1))


def _read_pairs(pairs: Sequence[tuple[int, int]], n_inputs: int) -> tuple[tuple[int, int], ...]:
    """Return pairs of inputs as tuples; ValueError if there is none, or one has no such input."""
    last = n_inputs - 1
    try:
        read = tuple((whole("pairs", a, 0, last), whole("pairs", b, 0, last)) for a, b in pairs)
    except (TypeError, ValueError):
        read = ()
    require(read, "pairs", f"be pairs of inputs from 0 to {last}", pairs)
    return read


def plot_similarity(
    coding: str | Coding, n_units: int = N_UNITS, seed: int = 0, title: str | None = None
) -> Figure:
    """Plot the `similarity` of a coding's patterns, and that of one bin as a curve.

    Needs matplotlib.
    """
    from matplotlib.figure import Figure

    coding = fitted(coding, n_units)
    drawn, expected = similarity(coding, n_units, seed), coding.correlations(n_units)
    middle = coding.size // 2
    figure = Figure(figsize=(8.0, 3.4), layout="constrained")
    left, right = figure.subplots(1, 2)
    image = left.imshow(drawn, vmin=-1, vmax=1, cmap="RdBu_r", origin="lower")
    figure.colorbar(image, ax=left, label="correlation of patterns")
    left.set(xlabel="bin", ylabel="bin")
    marker, line = ("", "-") if coding.is_numeric else ("o", "none")
    label = f"drawn, {n_units} units"
    right.plot(drawn[middle], color="tab:blue", label=label, marker=marker, linestyle=line)
    right.plot(expected[middle], color="black", linewidth=1, label="expected", linestyle="--")
    right.set(xlabel="bin", ylabel=f"correlation with bin {middle}", ylim=(-1.05, 1.05))
    right.legend(frameon=False, loc="lower left")
    right.spines[["top", "right"]].set_visible(False)
    figure.suptitle(title or f"{coding.name}, {coding.size} bins")
    return figure
