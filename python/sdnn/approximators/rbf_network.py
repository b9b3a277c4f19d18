"""A network of radial basis functions over state and action."""

from __future__ import annotations

import dataclasses

from sdnn import _core
from sdnn.config import to_core

__all__ = ["RBFNetworkConfig"]


@dataclasses.dataclass(frozen=True, kw_only=True)
class RBFNetworkConfig:
    """The sizes of an RBF network: normalized Gaussians on an even grid, linear in the weights.

    The paper gives 4 bases per dimension and 601 actions; the rest are readings.

    Attributes
    ----------
    n_inputs : int
        d, number of inputs, at least 1.
    n_bases : int
        Bases per dimension, of the inputs and of the action, at least 2. There are
        ``n_bases ** (n_inputs + 1)`` joint bases.
    n_actions : int
        Actions over which the maximum is taken, evenly spaced over the action's range.
    width : float
        Standard deviation of a Gaussian in units of the spacing of the centres, 0.1 to 100.
    gradient_rate : float
        Rate of a gradient step, > 0 and at most 1e6. With Q-learning's ``learning_rate`` 0.5 the
        default is stable whatever the sizes and the width.
    max_table_bytes : int
        More weights are refused before memory is asked for; 1 GiB by default. For all action
        dimensions together, where an agent has several.
    """

    n_inputs: int = 4
    n_bases: int = 4
    n_actions: int = 601
    width: float = 0.5
    gradient_rate: float = 3.0
    max_table_bytes: int = 2**30

    def to_core(self) -> _core.RBFNetworkConfig:
        """Make the core's struct of the same values; see `sdnn.config.to_core`."""
        return to_core(self, _core.RBFNetworkConfig)
