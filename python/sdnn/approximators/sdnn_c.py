"""SDNN-C: a network that gives Q(s, a) for every action at once."""

from __future__ import annotations

import dataclasses
from collections.abc import Sequence
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from sdnn import _core
from sdnn.arguments import seed_of
from sdnn.config import to_core

__all__ = ["SDNNC", "SDNNCConfig"]


@dataclasses.dataclass(frozen=True, kw_only=True)
class SDNNCConfig:
    """Everything that defines an SDNN-C; the defaults are the paper's values.

    Values are checked when a network is built from them.

    Attributes
    ----------
    n_inputs : int
        l, number of inputs, at least 2 (section 3.1).
    max_pairs : int
        Most pairs of inputs that are formed: all l (l - 1) if there are no more or with 0; else an
        even share of them at random, each input modified by as many others as it modifies, and by
        one at least. Cost grows with pairs, so with many inputs it then grows as their number, not
        as its square. Not in the paper, which has all.
    n_pattern_units : int
        m, units per pattern, 2 to 65536 (section 4.2: 200).
    n_anchor_patterns : int
        Random anchor patterns p_1, p_2, ... of a code book (section 3.1: 9). The last one is not
        assigned to a bin.
    n_interpolated : int
        Patterns between neighbouring anchors (section 3.1: 44). There are
        ``(n_anchor_patterns - 1) * (n_interpolated + 1)`` bins, 360 in the paper.
    balanced_anchors : bool
        Whether anchors have as many +1 as -1. A reading: the paper says "random".
    circular : tuple of bool
        Per input, whether the last anchor equals the first, as angles want it; empty: none. A
        reading: the paper does not say.
    n_symbols : tuple of int
        Per input, how many symbols it may be, each with a random pattern of its own: symbol k of n
        is a value of ``(k + 0.5) / n``. 0 for a number; empty: numbers only. Not in the paper.
    n_hidden_units, n_active_units : int
        n and n', hidden units and units in an action's window (section 4.2: 900 and 300).
    n_actions : int
        Number of actions; 0 stands for all ``n_hidden_units - n_active_units + 1`` (601).
    q_low, q_high : float
        The output range (section 4.2: -20 and 20).
    u_low, u_high : int, optional
        Counts of active units at which the output saturates; by default ``n_active_units // 15``
        and ``n_active_units - u_low`` (section 4.2: 20 and 280).
    learning_coefficient : float
        c (section 4.2: 0.1). It scales weights and thresholds alike and changes no decision.
    lattice : int
        Weights are integer multiples of ``learning_coefficient / lattice``.
    initial_threshold : float
        The "large" initial threshold, in units of c. A reading.
    initial_weights : {"ternary", "uniform"}
        The "small random" initial weights: one lattice step down, none, or up with probabilities
        1/4, 1/2, 1/4; or uniform within ``initial_weight_limit``, rounded to the lattice. A
        reading.
    initial_weight_limit : float
        Of ``"uniform"``, in units of c.
    rounding : {"half_up", "random", "away"}
        Of the number of units that are to fire: to the nearest; up or down at random in proportion,
        so that no small change is lost on average; or in the direction of the change by at least
        one unit. A reading.
    averaging_interval : int
        With more than 0 the network keeps an average of its weights, by which greedy actions are
        chosen; learning goes on with the weights themselves. Snapshots for it are taken after so
        many corrections, 100 say, or after every 64th part of all, whichever is more; what was
        learned last counts most. The weights take four times the memory. Not in the paper, which
        has 0.
    max_table_bytes : int
        A larger network (weights, patterns, remembered potentials) is refused before memory is
        asked for; 1 GiB by default. For all action dimensions together, where an agent has several.
    """

    n_inputs: int = 4
    max_pairs: int = 0
    n_pattern_units: int = 200
    n_anchor_patterns: int = 9
    n_interpolated: int = 44
    balanced_anchors: bool = True
    circular: tuple[bool, ...] = ()
    n_symbols: tuple[int, ...] = ()
    n_hidden_units: int = 900
    n_active_units: int = 300
    n_actions: int = 0
    q_low: float = -20.0
    q_high: float = 20.0
    u_low: int | None = None
    u_high: int | None = None
    learning_coefficient: float = 0.1
    lattice: int = 1
    initial_threshold: float = 200.0
    initial_weights: Literal["ternary", "uniform"] = "ternary"
    initial_weight_limit: float = 0.1
    rounding: Literal["half_up", "random", "away"] = "half_up"
    averaging_interval: int = 0
    max_table_bytes: int = 2**30

    @property
    def n_pairs(self) -> int:
        """How many pairs of inputs are formed; the code has ``n_pattern_units`` for each."""
        others = self.n_inputs - 1
        if self.max_pairs > 0:
            others = max(1, min(others, self.max_pairs // self.n_inputs))
        return self.n_inputs * others

    @property
    def n_code_bytes(self) -> int:
        """How many bytes the patterns take, by anchors and of symbols, plain and permuted."""
        symbols = [n for n in self.n_symbols if n > 0]
        n_per_number = (self.n_anchor_patterns - 1) * (self.n_interpolated + 1)
        n_bins = sum(symbols) + n_per_number * (self.n_inputs - len(symbols))
        n_partners = self.n_pairs // self.n_inputs
        return (n_partners + 1) * n_bins * 8 * -(-self.n_pattern_units // 64)

    def to_core(self) -> _core.SDNNCConfig:
        """Make the core's struct of the same values; see `sdnn.config.to_core`."""
        return to_core(self, _core.SDNNCConfig)


def pattern_tables(tables: Sequence[ArrayLike]) -> list[NDArray[np.int8]]:
    """Read the patterns of each input; ValueError for other entries than -1 and +1."""
    read = []
    try:
        listed = [np.asarray(table) for table in tables]
    except (TypeError, ValueError) as error:
        raise ValueError(f"tables must be matrices of -1 and +1, got {tables!r}") from error
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
        Sizes and readings; by default the paper's, with 4 inputs.
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
        given = {} if tables is None else {"tables": pattern_tables(tables)}
        self._core = _core.SDNNC(self.config.to_core(), seed_of(seed), **given)

    @property
    def _lattice_step(self) -> np.float64:
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
        """Q(state, a) for every action.

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
        """Q(state, action)."""
        return self._core.value(state, action)

    def update(self, state: ArrayLike, action: int, target: float, rate: float = 1.0) -> None:
        """One step of error correction (Fig. 2): Q towards (1 - rate) Q + rate * target.

        Raises
        ------
        ValueError
            For a bad state, action or rate, or a NaN target; nothing has changed then.
        OverflowError
            If a weight would leave its range; no weight has changed then.
        """
        self._core.update(state, action, target, rate)

    def weights(self) -> NDArray[np.float64]:
        """Copy the weights in the paper's units, shape (n, D)."""
        return self._core.weights() * self._lattice_step

    def thresholds(self) -> NDArray[np.float64]:
        """Copy the thresholds in the paper's units, shape (n,)."""
        return self._core.thresholds() * self._lattice_step
