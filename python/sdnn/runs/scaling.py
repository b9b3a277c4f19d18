"""Words for what an agent observes where its run scales the variables of its environment."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from sdnn.runs.environment import Ends, RunEnvironment, neighbours
from sdnn.runs.errors import RunError

__all__ = ["Scaling", "scaling_of"]


@dataclass(frozen=True, kw_only=True)
class Scaling:
    """What a run with noise or redundant variables makes of what its environment gives.

    Parameters
    ----------
    ranges
        Lowest and highest values of the variables, which become 0 and 1, shapes (n,); None: they
        are not known, since the environment cannot be made here.
    n_redundant
        How many means of neighbours follow them.
    """

    ranges: Ends | None
    n_redundant: int

    def lines(self) -> Iterator[str]:
        """Say of each observed number what it is."""
        if self.ranges is None:
            yield "not known here, where the environment cannot be made: the ranges of its space,"
            yield "or those of config.json"
            return
        n_variables = self.ranges[0].size
        for i, (low, high) in enumerate(zip(*self.ranges, strict=True)):
            yield f"observation[{i}]: variable {i}, from {float(low)!r} to {float(high)!r}"
        for i, (first, second) in enumerate(neighbours(n_variables, self.n_redundant)):
            means = f"observation[{first}] and observation[{second}]"
            yield f"observation[{n_variables + i}]: the mean of {means}"

    def values(self) -> dict[str, Any]:
        """Give it as JSON has it."""
        ranges = None if self.ranges is None else np.stack(self.ranges, axis=1).tolist()
        return {"ranges": ranges, "redundant": self.n_redundant}

    def c_comment(self) -> str:
        """Say it at the top of a C header."""
        lines = (
            "What this policy observes is scaled, since its run had noise or redundant variables:",
            "each variable from its range to [0, 1], (value - low) / (high - low), and what lies",
            "beyond the range to 0 or 1. Wherever an observation has units below, it is these.",
            "",
            *(f"  {line}" for line in self.lines()),
        )
        return "\n".join(["/* " + lines[0], *(f" * {one}".rstrip() for one in lines[1:]), " */\n"])


def scaling_of(environment: RunEnvironment) -> Scaling | None:
    """Find out how a run scales what its agent observes; None: not at all."""
    if not environment.changes_observations:
        return None
    try:
        ranges = environment.scaled_ranges()
    except RunError:
        ranges = None
    return Scaling(ranges=ranges, n_redundant=environment.redundant)
