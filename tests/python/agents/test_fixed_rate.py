"""Loops at a fixed rate, by a clock that moves when it is told to."""

import itertools
import math
import time

import numpy as np
import pytest

from sdnn.agents import FixedRate


class HandClock:
    """Moves when it is told to, and by sleeping some time too long."""

    def __init__(self, now=100.0, oversleep=0.0):
        self.now, self.oversleep = now, oversleep

    def __call__(self):
        return self.now

    def sleep(self, seconds):
        self.now += seconds + self.oversleep

    def rate(self, hz):
        return FixedRate(hz, clock=self, sleep=self.sleep)


def test_ticks_do_not_drift():
    clock = HandClock()
    rate = clock.rate(4.0)  # every number is exact
    for expected, tick in zip(range(1000), rate, strict=False):
        assert tick == expected
        assert clock.now == 100.0 + 0.25 * tick
        clock.now += 0.25 if tick % 2 else 0.125  # just in time is no miss
    assert (rate.n_misses, rate.n_skipped, rate.worst_lateness) == (0, 0, 0.0)


def test_after_a_miss_it_goes_on_with_the_next_tick_to_come():
    clock = HandClock()
    rate = clock.rate(4.0)
    assert next(rate) == 0
    clock.now += 0.875  # ticks 1, 2 and 3 were at 0.25, 0.5 and 0.75
    assert (next(rate), clock.now) == (4, 101.0)
    assert (rate.n_misses, rate.n_skipped, rate.worst_lateness) == (1, 3, 0.625)
    clock.now += 0.5  # tick 5 is missed, tick 6 is now
    assert (next(rate), clock.now) == (6, 101.5)
    assert (rate.n_misses, rate.n_skipped, rate.worst_lateness) == (2, 4, 0.625)
    assert next(rate) == 7
    assert rate.n_misses == 2


def test_sleeping_through_a_tick_is_a_miss():
    clock = HandClock()
    rate = clock.rate(4.0)
    next(rate)
    clock.oversleep = 0.125  # within the period
    assert next(rate) == 1
    assert rate.n_misses == 0
    late = itertools.chain([0.375], itertools.repeat(0.0))

    def sleep(seconds):
        clock.now += seconds + next(late)

    start = clock.now
    rate = FixedRate(4.0, clock=clock, sleep=sleep)
    assert next(rate) == 0
    assert next(rate) == 3, "it woke up at 0.625: tick 2 at 0.5 was over"
    assert clock.now == start + 0.75
    assert (rate.n_misses, rate.n_skipped, rate.worst_lateness) == (1, 2, 0.125)


@pytest.mark.parametrize("seed", range(20))
def test_every_tick_is_on_its_grid(seed):
    rng = np.random.default_rng(seed)
    for _ in range(10):
        clock = HandClock(now=1e6 * rng.random())
        start, hz = clock.now, math.exp(rng.uniform(-2.0, 12.0))
        clock.oversleep = 0.3 * rng.random() / hz
        rate = clock.rate(hz)
        ticks, n_late, deadline = [], 0, math.inf
        for _ in range(100):
            n_late += clock.now > deadline
            tick = next(rate)
            assert start + tick / hz <= clock.now <= start + (tick + 1) / hz
            deadline = start + (tick + 1) / hz
            ticks.append(tick)
            clock.now += 2.0 * rng.random() * rng.random() / hz
        assert np.all(np.diff(ticks) > 0)
        assert rate.n_misses == n_late
        assert ticks[-1] + 1 == len(ticks) + rate.n_skipped
        assert (rate.worst_lateness > 0) == (n_late > 0)


def test_it_keeps_time_by_the_real_clock():
    began = time.monotonic()
    for tick in FixedRate(200.0):
        if tick >= 10:
            break
    assert time.monotonic() - began >= 10 / 200.0


@pytest.mark.parametrize("bad", [0.0, -1.0, 1e-4, 2e6, math.nan, math.inf, "fast", None, True])
def test_impossible_rates_are_named(bad):
    with pytest.raises(ValueError, match=r"^hz must be"):
        FixedRate(bad)
