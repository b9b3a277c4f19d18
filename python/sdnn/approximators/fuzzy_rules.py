"""Fuzzy rules over a grid of triangular sets."""

from __future__ import annotations

import dataclasses

from sdnn import _core
from sdnn.config import to_core

__all__ = ["FuzzyRulesConfig"]


@dataclasses.dataclass(frozen=True, kw_only=True)
class FuzzyRulesConfig:
    """The sizes of a table of fuzzy rules; the defaults are the paper's.

    The table has ``n_sets ** n_inputs`` rules of ``4 * n_actions`` bytes: 45 MB with 6 inputs.

    Attributes
    ----------
    n_inputs : int
        d, number of inputs, at least 1.
    n_sets : int
        Triangular sets per input, evenly spaced over its range, at least 2.
    n_actions : int
        Discrete actions that every rule has values of, evenly spaced over the action's range.
    max_table_bytes : int
        A larger table is refused before memory is asked for; 1 GiB by default. For all action
        dimensions together, where an agent has several.
    """

    n_inputs: int = 4
    n_sets: int = 9
    n_actions: int = 21
    max_table_bytes: int = 2**30

    def to_core(self) -> _core.FuzzyRulesConfig:
        """Make the core's struct of the same values; see `sdnn.config.to_core`."""
        return to_core(self, _core.FuzzyRulesConfig)
