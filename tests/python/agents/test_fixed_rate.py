"""Loops at a fixed rate in Python; the rules of ticks are tested in C++."""

import time

import pytest

from sdnn.agents import FixedRate


def test_ctrl_c_during_a_sleep_ends_the_loop():
    def sleep(seconds):
        raise KeyboardInterrupt

    rate = FixedRate(4.0, sleep=sleep)
    assert next(rate) == 0
    with pytest.raises(KeyboardInterrupt):
        next(rate)


def test_ten_periods_of_200_hz_take_at_least_50_ms():
    began = time.monotonic()
    for tick in FixedRate(200.0):
        if tick >= 10:
            break
    assert time.monotonic() - began >= 10 / 200.0
