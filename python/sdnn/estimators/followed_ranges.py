"""Ranges of a stream's inputs that follow its last samples."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
import pandas as pd

from sdnn.estimators.columns import Floats

WINDOW = 500  # number of last samples whose range inputs are scaled from: a chosen constant
FARTHEST = 1e300  # largest distance of a value from the range, in widths


class FollowedRanges:
    """Moves numbers from their range among the last samples to the range that a model learned.

    ``ranges`` are the learned ranges (low, high) of the features to follow, ``first`` the samples
    from which they were learned.
    """

    def __init__(self, ranges: Mapping[str, tuple[float, float]], first: pd.DataFrame) -> None:
        self.names = list(ranges)
        self.low, self.high = np.array(list(ranges.values()), dtype=np.float64).reshape(-1, 2).T
        values = first[self.names].to_numpy(dtype=np.float64, na_value=np.nan)
        self.recent = np.full((WINDOW, len(self.names)), np.nan)
        last = np.clip(values[-WINDOW:], self.low, self.high)
        self.recent[: len(last)] = last
        self.n_noted = len(last)  # the next sample replaces row `n_noted` modulo `WINDOW`
        self.now = self.low, self.high  # of the last samples, which is mapped to the learned range

    def extend(self, ranges: Mapping[str, tuple[float, float]], last: pd.DataFrame) -> None:
        """Follow more features, whose ranges were learned from the last samples."""
        more = FollowedRanges(ranges, last)
        self.names += more.names
        self.low, self.high = np.append(self.low, more.low), np.append(self.high, more.high)
        self.recent = np.hstack([self.recent, more.recent])
        self.now = np.append(self.now[0], more.low), np.append(self.now[1], more.high)

    def note(self, values: Floats) -> None:
        """Add a sample's numbers, NaN where it has none, to the window."""
        self.recent[self.n_noted % WINDOW] = values
        self.n_noted += 1
        low, high = self.now
        # Values may widen the range at once; old values leave it once per window, to save time.
        if self.n_noted % WINDOW == 0 or np.any((values < low) | (values > high)):
            low = np.fmin.reduce(self.recent)
            high = np.fmax.reduce(self.recent)
            is_range = high > low  # False where the window has only NaN
            self.now = np.where(is_range, low, self.now[0]), np.where(is_range, high, self.now[1])

    def moved(self, x: dict[str, object], learns: bool) -> dict[str, object]:
        """Map a sample's finite numbers from the range of the window to the learned range.

        With `learns` the sample is added to the window first.
        """
        try:
            values = np.array([x.get(name) for name in self.names], dtype=np.float64)
        except (TypeError, ValueError):
            return x
        is_finite = np.isfinite(values)
        if learns:
            self.note(np.where(is_finite, values, np.nan))
        low, high = self.now
        width = high / 2 - low / 2  # halves, since the width of a range may overflow
        moves = is_finite & (width > 0)
        half_low, half_high = self.low / 2, self.high / 2
        with np.errstate(over="ignore"):  # of values far beyond a narrow range
            share = (values / 2 - low / 2) / np.where(moves, width, 1.0)
            share = np.clip(share, -FARTHEST, FARTHEST)  # infinity times 0 would be no number
            there = half_low + share * (half_high - half_low)
        there = 2 * np.clip(there, half_low, half_high)
        moved = zip(self.names, there.tolist(), moves.tolist(), strict=True)
        return {**x, **{name: value for name, value, is_moved in moved if is_moved}}
