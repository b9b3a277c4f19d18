"""Loops at a fixed rate; the rules of the ticks are tested in C++."""

import time

import pytest

from sdnn.agents import FixedRate


class HandClock:
    """A clock that sleeping moves."""

    def __init__(self):
        self.now = 100.0

    def __call__(self):
        return self.now

    def sleep(self, seconds):
        self.now += seconds

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


def test_after_a_miss_it_resumes_with_the_next_tick_to_come():
    clock = HandClock()
    rate = clock.rate(4.0)
    assert next(rate) == 0
    clock.now += 0.875  # ticks 1, 2 and 3 were at 0.25, 0.5 and 0.75
    assert (next(rate), clock.now) == (4, 101.0)
    assert (rate.n_misses, rate.n_skipped, rate.worst_lateness) == (1, 3, 0.625)


def test_an_interrupted_sleep_ends_the_wait():
    def sleep(seconds):
        raise KeyboardInterrupt

    rate = FixedRate(4.0, sleep=sleep)
    assert next(rate) == 0
    with pytest.raises(KeyboardInterrupt):
        next(rate)


def test_it_keeps_time_by_the_real_clock():
    began = time.monotonic()
    for tick in FixedRate(200.0):
        if tick >= 10:
            break
    assert time.monotonic() - began >= 10 / 200.0
