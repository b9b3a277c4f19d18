import math

import numpy as np
import pytest

from sdnn.experiments import MeasureConfig
from sdnn.experiments.statistics import (
    Estimate,
    episodes_to_learn,
    estimate,
    final_share_solved,
    final_steps,
    interquartile_mean,
    learning_curve,
)


def learned(steps):
    return episodes_to_learn(10 * np.arange(1, len(steps) + 1), steps)


def test_learned_at_the_first_test():
    assert learned([10] * 10) == 10.0


def test_never_learned_is_infinite():
    assert learned([50] * 100) == math.inf
    assert learned([11] * 100) == math.inf


def test_failed_tests_before_the_first_good_one_do_not_count():
    # From the third test on: 6 good of the 10 that begin there is enough for the median, but
    # the windows that begin at failed tests do not count although their medians are good.
    assert learned([50] * 4 + [7] * 20) == 50.0


def test_median_of_an_even_window_is_the_mean_of_the_middle_two():
    # 5 good and 5 failed: median (7 + 50) / 2 = 28.5; 6 good and 4 failed: 7.
    assert learned([7] * 5 + [50] * 5) == math.inf
    assert learned([7] * 6 + [50] * 4) == 10.0
    assert learned([7] + [50] * 4 + [7] * 5) == 10.0


def test_lucky_test_does_not_count_and_relapse_does_not_undo():
    assert learned([50, 3] + [50] * 8 + [6] * 10 + [50] * 80) == 110.0


def test_window_cut_off_by_the_end_does_not_count():
    assert learned([50] * 5 + [5] * 9) == math.inf
    assert learned([5] * 9) == math.inf


def test_final_measures_use_the_last_fifty_tests():
    steps = [3] * 100 + [50] * 24 + [4] * 26
    assert final_steps(steps) == 4.0
    assert final_share_solved([s < 50 for s in steps]) == 0.52
    assert final_steps([8, 9]) == 8.5


def test_interquartile_mean_drops_a_quarter_at_each_end():
    assert interquartile_mean([100, 1, 2, 3, 4, 5, 6, -100]) == 3.5
    assert interquartile_mean(range(10)) == np.mean([2, 3, 4, 5, 6, 7])
    assert interquartile_mean([1.0, 5.0]) == 3.0
    np.testing.assert_array_equal(interquartile_mean([[0, 1, 2, 9], [4, 4, 4, 4]]), [1.5, 4.0])


def test_learning_curve_by_hand():
    curve = learning_curve(np.array([10, 20], np.int32), [[1, 50], [2, 50], [3, 10], [4, 50]])
    np.testing.assert_array_equal(curve.median, [2.5, 50])
    np.testing.assert_array_equal(curve.lower, [1.75, 40])
    np.testing.assert_array_equal(curve.upper, [3.25, 50])


def test_bootstrap_of_two_values_is_exact():
    # Resamples of {0, 1}: medians 0, 1/2, 1 with probabilities 1/4, 1/2, 1/4.
    assert estimate([0.0, 1.0]) == Estimate(0.5, 0.0, 1.0)
    narrow = MeasureConfig(confidence=0.4)
    assert estimate([0.0, 1.0], config=narrow) == Estimate(0.5, 0.5, 0.5)


def test_bootstrap_of_the_mean_agrees_with_the_normal_interval():
    # The IQM of two values is their mean; of constants it has no spread.
    assert estimate([7.0] * 10, "iqm") == Estimate(7.0, 7.0, 7.0)
    values = np.random.default_rng(0).normal(size=1000)
    found = estimate(values, "iqm", MeasureConfig(n_resamples=2000))
    # Asymptotic standard deviation of the 25 % trimmed normal mean is 1.0926 / sqrt(n).
    half = 1.96 * 1.0926 / math.sqrt(1000)
    assert found.upper - found.lower == pytest.approx(2 * half, rel=0.15)
    assert found.lower < found.value < found.upper


def test_bootstrap_is_its_own_and_repeatable():
    state = np.random.get_state()[1].copy()  # noqa: NPY002
    values = [120.0, 90.0, 150.0, math.inf]
    assert estimate(values) == estimate(values)
    np.testing.assert_array_equal(np.random.get_state()[1], state)  # noqa: NPY002


def test_censored_trials_stay_censored():
    assert estimate([math.inf] * 10) == Estimate(math.inf, math.inf, math.inf)
    mostly = estimate([100.0] * 7 + [math.inf] * 3)
    assert mostly.value == 100.0
    assert mostly.lower == 100.0
    assert mostly.upper == math.inf


def test_one_trial_has_no_interval_and_none_is_an_error():
    one = estimate([4.0])
    assert one.value == 4.0
    assert math.isnan(one.lower)
    with pytest.raises(ValueError, match=r"shape \(0,\)"):
        estimate([])
    with pytest.raises(ValueError, match="'mean'"):
        estimate([1.0], "mean")
