"""Scaling of a run's variables."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from sdnn.environments.types import Data
from sdnn.support.arguments import real, require, whole

_MOST_IN_LINE = 8  # ranges in the description of a scaling; a chosen number


def neighbours(n_variables: int, n_redundant: int) -> Iterator[tuple[int, int]]:
    """Yield the pairs of neighbouring variables whose means are the redundant variables.

    >>> list(neighbours(3, 4))
    [(0, 1), (1, 2), (2, 0), (0, 1)]
    """
    for i in range(n_redundant):
        yield i % n_variables, (i + 1) % n_variables


@dataclass(frozen=True, kw_only=True)
class Scaling:
    """Scaling of the observations in a run with noise or redundant variables.

    ``ranges`` of the variables become [0, 1]; then follow ``n_redundant`` means of neighbours: of
    variables 0 and 1, of 1 and 2, ..., of the last and 0, and so on in a circle. ValueError for
    ranges that are not finite, low < high, and numbers out of range.

    Examples
    --------
    >>> scaling = Scaling(ranges=((-4.0, 4.0), (0.0, 1.0)), n_redundant=1)
    >>> scaling.words()
    '0 from -4 to 4, 1 from 0 to 1, and means of neighbours (1)'
    """

    ranges: tuple[tuple[float, float], ...]
    n_redundant: int = 0

    def __post_init__(self) -> None:
        whole("n_redundant", self.n_redundant, 0, 1000)
        try:
            pairs = tuple((real("ranges", a), real("ranges", b)) for a, b in self.ranges)
        except (OverflowError, TypeError, ValueError):
            pairs = ()
        are_ranges = pairs and all(-np.inf < low < high < np.inf for low, high in pairs)
        require(are_ranges, "ranges", "be pairs, finite, low < high", self.ranges)
        object.__setattr__(self, "ranges", pairs)

    @property
    def ends(self) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Lowest and highest values, shapes (n,): what `sdnn.environments.UnitSensors` takes."""
        low, high = np.array(self.ranges, np.float64).T
        return low, high

    def words(self) -> str:
        """Describe the scaling in a line."""
        ranges = [f"{i} from {low:.6g} to {high:.6g}" for i, (low, high) in enumerate(self.ranges)]
        if len(ranges) > _MOST_IN_LINE:
            ranges[_MOST_IN_LINE:] = ["..."]
        if self.n_redundant:
            ranges.append(f"and means of neighbours ({self.n_redundant})")
        return ", ".join(ranges)

    def lines(self) -> Iterator[str]:
        """Describe each observed variable in a line."""
        n_variables = len(self.ranges)
        for i, (low, high) in enumerate(self.ranges):
            yield f"observation[{i}]: variable {i}, from {low!r} to {high!r}"
        for i, (first, second) in enumerate(neighbours(n_variables, self.n_redundant)):
            means = f"observation[{first}] and observation[{second}]"
            yield f"observation[{n_variables + i}]: the mean of {means}"

    def values(self) -> Data:
        """Return the scaling as data that JSON can hold."""
        return {"ranges": [list(pair) for pair in self.ranges], "redundant": self.n_redundant}

    @classmethod
    def of_values(cls, values: Data, n_variables: int) -> Scaling:
        """Make a scaling from `values`; ValueError if the number of variables does not fit."""
        scaling = cls(ranges=values["ranges"], n_redundant=values["redundant"])
        n = len(scaling.ranges) + scaling.n_redundant
        if n != n_variables:
            raise ValueError(f"scaling must be of {n_variables} observed numbers, got {n}")
        return scaling
