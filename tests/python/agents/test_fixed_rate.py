"""Loops at a fixed rate; the rules of the ticks are tested in C++."""

import time

import pytest

from sdnn.agents import FixedRate


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
