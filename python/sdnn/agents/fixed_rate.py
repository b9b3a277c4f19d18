"""A loop at a fixed rate, for robots."""

from __future__ import annotations

import time
from collections.abc import Callable

from sdnn import _core
from sdnn.arguments import real

__all__ = ["FixedRate"]


class FixedRate(_core.FixedRate):
    """Ticks ``hz`` times a second: what a loop that controls a robot iterates over.

    Tick k is at start + k / hz, whatever was before: nothing adds up, so the loop does not drift.
    The body of the loop has until the next tick. If it takes longer, that is a miss: the ticks that
    have passed are left out, and the loop goes on with the next one to come. It never catches up in
    a burst. A sleep that ends too late by a whole period is a miss, too.

    The operating system decides when a sleeping program runs again, often some 0.1 ms late, and
    Python's garbage collector may take a few ms: for a loop that must never be late, take the C++
    class of the same name under a real-time scheduler.

    Parameters
    ----------
    hz : float
        Ticks a second, in [1e-3, 1e6].
    clock : callable
        Gives seconds since any fixed moment, and never goes back.
    sleep : callable
        Waits for so many seconds, or less.

    Raises
    ------
    ValueError
        If ``hz`` is out of range.

    Attributes
    ----------
    hz : float
    n_misses : int
        How often the body was not done by the next tick.
    n_skipped : int
        Ticks that were left out because of it.
    worst_lateness : float
        By how many seconds the worst miss was too late.

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
        super().__init__(real("hz", hz), clock, sleep)

    def __iter__(self) -> FixedRate:
        return self

    def __next__(self) -> int:
        """Wait for the next tick and return its number: 0 at once, then the periods since."""
        return self.wait()
