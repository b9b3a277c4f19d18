"""A loop at a fixed rate, for robots."""

from __future__ import annotations

import time
from collections.abc import Callable

from sdnn import _core
from sdnn.support.arguments import real, require


class FixedRate(_core.FixedRate):
    """A loop at ``hz`` ticks a second, for robots.

    Tick k is at start + k / hz, so the loop does not drift. Where the body of the loop takes longer
    than a period, or a sleep ends too late, that is a miss: the ticks that have passed are left
    out, and the loop never catches up in a burst.

    The operating system wakes a program often some 0.1 ms late, and Python's garbage collector may
    take a few ms: for a loop that must never be late, take the C++ class of the same name under a
    real-time scheduler.

    Parameters
    ----------
    hz : float
        Ticks a second, in [1e-3, 1e6].
    clock : callable
        Returns seconds since any fixed moment, and never goes back.
    sleep : callable
        Waits for the given seconds, or less.

    Attributes
    ----------
    hz : float
    n_misses, n_skipped : int
        How often the body was not done by the next tick, and ticks left out because of it.
    worst_lateness : float
        Seconds of the worst miss.

    Examples
    --------
    >>> from sdnn.agents import FixedRate
    >>> rate = FixedRate(100.0)
    >>> for tick in rate:  # 0, 1, 2, ...: the periods since the first
    ...     if tick >= 3:
    ...         break
    >>> rate.hz
    100.0
    """

    def __init__(
        self,
        hz: float,
        *,
        clock: Callable[[], float] = time.monotonic,
        sleep: Callable[[float], None] = time.sleep,
    ) -> None:
        for name, function in (("clock", clock), ("sleep", sleep)):
            require(callable(function), name, "be a function", function, TypeError)
        super().__init__(real("hz", hz), clock, sleep)

    def __iter__(self) -> FixedRate:
        return self

    def __next__(self) -> int:
        """Wait for the next tick and return its number, the periods since the first tick."""
        return self.wait()
