"""SDNN-C: a network that gives Q(s, a) for every action at once."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn import _core
from sdnn.config import SDNNCConfig
from sdnn.support.arguments import array_of, seed_of, shown


def pattern_tables(tables: Sequence[ArrayLike]) -> list[NDArray[np.int8]]:
    """Read the patterns of each input; ValueError for other entries than -1 and +1."""
    read = []
    try:
        listed = [array_of("tables", table) for table in tables]
    except (TypeError, ValueError):
        raise ValueError(f"tables must be matrices of -1 and +1, got {shown(tables)}") from None
    for number, signs in enumerate(listed):
        if signs.ndim != 2 or not np.isin(signs, (-1, 1)).all():
            raise ValueError(
                f"tables[{number}] must be a matrix of -1 and +1, got one of shape {signs.shape}"
                f" with the entries {np.unique(signs)[:5].tolist()}"
            )
        read.append(signs.astype(np.int8))
    return read


class SDNNC:
    """The network of section 3: layers 1 to 6, and its error correction.

    Parameters
    ----------
    config : SDNNCConfig, optional
        Sizes and assumptions; by default the paper's, with 4 inputs.
    seed : int
        Code books, permutations and initial weights follow from it (0 to 2**64 - 1).
    tables : sequence of array_like, shape (n_bins, n_pattern_units), optional
        Patterns of -1 and +1 for each input, instead of the anchors of ``config``: those of any
        coding, such as ``sdnn.coding.Circular().patterns(200, seed=1)``. The range [0, 1] of an
        input is cut into as many equal bins as its table has rows.

    Raises
    ------
    ValueError
        If a size is impossible, or a table does not fit; the message names it.

    Examples
    --------
    >>> from sdnn.approximators import SDNNC, SDNNCConfig
    >>> network = SDNNC(SDNNCConfig(n_inputs=2), seed=1)
    >>> network.values([0.2, 0.7]).shape
    (601,)
    >>> network.value([0.2, 0.7], 300)
    0.0
    >>> for _ in range(50):
    ...     network.update([0.2, 0.7], 300, 5.0)
    >>> round(network.value([0.2, 0.7], 300), 1)
    5.1
    """

    def __init__(
        self,
        config: SDNNCConfig | None = None,
        *,
        seed: int = 0,
        tables: Sequence[ArrayLike] | None = None,
    ) -> None:
        self.config = config if config is not None else SDNNCConfig()
        options = {} if tables is None else {"tables": pattern_tables(tables)}
        self._core = _core.SDNNC(self.config, seed_of(seed), **options)

    @property
    def _lattice_step(self) -> np.float64:
        """The size, in the paper's units, of 1 in the core's integer weights and thresholds."""
        return np.float64(self.config.learning_coefficient / self.config.lattice)

    @property
    def n_inputs(self) -> int:
        """Number of inputs, l."""
        return self._core.n_inputs

    @property
    def n_actions(self) -> int:
        """Number of actions."""
        return self._core.n_actions

    @property
    def pairs(self) -> tuple[tuple[int, int], ...]:
        """The pairs (modified, modifier) of inputs, in the order of the code: m units each."""
        return tuple(self._core.pairs)

    def values(self, state: ArrayLike) -> NDArray[np.float64]:
        """Return Q(state, a) for every action.

        Parameters
        ----------
        state : array_like, shape (l,)
            One value in [0, 1] per input.

        Returns
        -------
        ndarray, shape (n_actions,)
        """
        return self._core.values(state)

    def value(self, state: ArrayLike, action: int) -> float:
        """Return Q(state, action)."""
        return self._core.value(state, action)

    def update(self, state: ArrayLike, action: int, target: float, rate: float = 1.0) -> None:
        """Correct the error once (Fig. 2): move Q towards (1 - rate) Q + rate * target.

        Raises
        ------
        ValueError
            For a bad state, action or rate, or a NaN target; nothing has changed then.
        OverflowError
            If a weight would leave its range; no weight has changed then.
        """
        self._core.update(state, action, target, rate)

    def weights(self) -> NDArray[np.float64]:
        """Copy the weights in the paper's units, shape (n hidden units, D code columns)."""
        return self._core.weights() * self._lattice_step

    def thresholds(self) -> NDArray[np.float64]:
        """Copy the thresholds in the paper's units, shape (n,)."""
        return self._core.thresholds() * self._lattice_step
