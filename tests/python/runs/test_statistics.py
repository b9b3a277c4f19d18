"""Bootstrap intervals of medians, means and contrasts, and running medians."""

import math

import numpy as np
import pytest

from refusals import refuses
from sdnn.reports.statistics import (
    Estimate,
    estimate_contrast,
    estimate_mean,
    estimate_median,
    running_median,
)


@pytest.mark.parametrize("estimate", [estimate_median, estimate_mean])
def test_the_bootstrap_of_two_values_is_exact(estimate):
    # Resamples of {0, 1}: medians and means 0, 1/2, 1 with probabilities 1/4, 1/2, 1/4.
    assert estimate([0.0, 1.0]) == Estimate(0.5, 0.0, 1.0)


def test_the_interval_of_the_median_is_near_the_asymptotic_one():
    values = np.random.default_rng(0).normal(size=1000)
    estimate = estimate_median(values)
    # The standard deviation of the median of normal values is sqrt(pi / 2 / n).
    half = 1.96 * math.sqrt(math.pi / 2 / 1000)
    assert estimate.upper - estimate.lower == pytest.approx(2 * half, rel=0.25)
    assert estimate.lower < estimate.value < estimate.upper


def test_the_bootstrap_is_repeatable_and_keeps_the_global_state():
    state = np.random.get_state()[1].copy()  # noqa: NPY002
    values = [120.0, 90.0, 150.0, math.inf]
    assert estimate_median(values) == estimate_median(values)
    np.testing.assert_array_equal(np.random.get_state()[1], state)  # noqa: NPY002


def test_medians_of_mostly_censored_trials_are_infinite():
    assert estimate_median([math.inf] * 10) == Estimate(math.inf, math.inf, math.inf)
    # A resample of seven 100s and three infinities has at least five infinities, and so an infinite
    # median, with a probability of 15 %, more than the 2.5 % above a 95 % interval.
    mostly = estimate_median([100.0] * 7 + [math.inf] * 3)
    assert mostly == Estimate(100.0, 100.0, math.inf)


def test_the_median_of_one_trial_has_no_interval_and_of_none_is_refused():
    estimate = estimate_median([4.0])
    assert estimate.value == 4.0
    assert math.isnan(estimate.lower)
    refuses("shape", estimate_median, [])


def test_the_running_median_shrinks_its_window_at_the_ends():
    curve = np.random.default_rng(3).normal(size=40)
    medians = running_median(curve, 5)
    for i in range(40):
        assert medians[i] == np.median(curve[max(0, i - 2) : i + 3])
    np.testing.assert_array_equal(running_median(curve, 1), curve)


def test_the_contrast_of_two_values_each_is_exact():
    # Differences of the medians 0, 1/2, 1 and 10, 11, 12: the ends have probability 1/16 each.
    estimate = estimate_contrast([0.0, 1.0], [10.0, 12.0])
    assert estimate == Estimate(-10.5, -12.0, -9.0)
    assert estimate_contrast([8.0, 8.0], [2.0, 2.0], np.divide) == Estimate(4.0, 4.0, 4.0)


def test_the_interval_of_a_contrast_is_near_the_normal_one():
    rng = np.random.default_rng(1)
    estimate = estimate_contrast(rng.normal(1.0, 1.0, 800), rng.normal(0.0, 2.0, 800))
    # Variances of the two medians add: those of values with deviations of 1 and 2.
    half = 1.96 * math.sqrt(math.pi / 2 / 800 * (1**2 + 2**2))
    assert estimate.value == pytest.approx(1.0, abs=2 * half)
    assert estimate.upper - estimate.lower == pytest.approx(2 * half, rel=0.25)


def test_contrasts_of_single_or_nan_values_are_nan_and_of_infinite_ones_refused():
    assert math.isnan(estimate_contrast([1.0], [2.0, 3.0]).lower)
    assert math.isnan(estimate_contrast([math.nan, 1.0], [2.0, 3.0]).value)
    refuses("infinite", estimate_contrast, [1.0, math.inf], [2.0, 3.0])
    refuses("shape", estimate_contrast, [1.0], [])


def test_the_interval_of_the_mean_is_near_the_normal_one():
    values = np.random.default_rng(1).normal(3.0, 2.0, 400)
    estimate = estimate_mean(values)
    half = 1.96 * values.std() / np.sqrt(values.size)
    np.testing.assert_allclose(
        (estimate.lower, estimate.upper), (values.mean() - half, values.mean() + half), atol=0.02
    )


def test_a_single_mean_has_no_interval_and_means_of_infinite_values_are_refused():
    estimate = estimate_mean([2.0])
    assert estimate.value == 2.0
    assert np.isnan([estimate.lower, estimate.upper]).all()
    refuses("infinite", estimate_mean, [1.0, math.inf])
    refuses("trial", estimate_mean, [])
    assert math.isnan(estimate_mean([1.0, math.nan]).value)
