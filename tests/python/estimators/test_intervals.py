"""Prediction intervals: bounds worked by hand, coverage, and arguments."""

import pickle

import numpy as np
import pytest

from refusals import refuses
from sdnn import SDNNKernelRidge, SDNNRegressor
from sdnn.estimators.intervals import FollowedErrors, error_bounds, log_sizes

RNG = np.random.default_rng(3)
X = RNG.uniform(-1.0, 1.0, (700, 2))


def noisy(X, noise):
    return np.sin(3.0 * X[:, 0]) + X[:, 1] + noise * np.random.default_rng(5).normal(size=len(X))


def share_covered(bounds, y):
    return np.mean((bounds[..., 0] <= y) & (y <= bounds[..., 1]))


def test_the_bound_is_the_error_of_the_rank_that_coverage_needs():
    # Among nine errors, a new one is at most the k-th smallest with probability k / 10: coverage
    # 0.75 needs k = 8. The errors are 1 to 9, so that the k-th smallest is k.
    sizes = np.array([[5.0], [1.0], [9.0], [3.0], [7.0], [2.0], [8.0], [4.0], [6.0]])
    for coverage, bound in ((0.1, 1.0), (0.5, 5.0), (0.75, 8.0), (0.9, 9.0)):
        assert error_bounds(sizes, np.ones(9), coverage).tolist() == [bound]
    # A sample of weight 2 counts twice: 1, 1, 2, 3 have 5 ranks.
    assert error_bounds(np.array([[2.0], [1.0], [3.0]]), np.array([1.0, 2.0, 1.0]), 0.4) == 1.0


@pytest.mark.parametrize("unit", [1e-200, 1.0, 1e200])
def test_sizes_of_errors_have_a_floor_of_a_hundredth_in_any_unit(unit):
    # Root mean square 2, so sizes below 0.02 count as 0.02.
    sizes = log_sizes(unit * np.array([[-2.0], [2.0], [np.sqrt(8.0)], [0.0]]))[:, 0]
    np.testing.assert_allclose(sizes - np.log(unit), np.log([2.0, 2.0, np.sqrt(8.0), 0.02]))


def test_residuals_are_those_of_models_without_the_sample():
    y = noisy(X[:40], 0.1)
    settings = {"alpha": 1.0, "degree": 1, "coding": "anchor", "inputs": "all"}
    model = SDNNKernelRidge(**settings).fit(X[:40], y)
    for left_out in (0, 17):
        others = np.arange(40) != left_out
        # The kernel is that of the whole model, as the ranges of the code must not change.
        kernel = model.kernel_(X[:40], X[:40])
        K, t = kernel[np.ix_(others, others)], y[others]
        H = np.eye(39) - 1 / 39  # subtracts the mean
        dual = np.linalg.solve(H @ K @ H + np.eye(39), t - t.mean())
        intercept = t.mean() - K.mean(axis=0) @ dual
        expected = y[left_out] - (kernel[left_out, others] @ dual + intercept)
        assert model.leave_one_out_residuals_[left_out, 0] == pytest.approx(expected, abs=1e-9)


@pytest.mark.parametrize("scaled", [False, True])
@pytest.mark.parametrize("max_components", [2000, 150])
def test_intervals_contain_their_share_of_new_targets(scaled, max_components):
    y = noisy(X, 0.3)
    model = SDNNKernelRidge(max_components=max_components, random_state=1).fit(X[:300], y[:300])
    for coverage in (0.5, 0.9):
        bounds = model.predict_interval(X[300:], coverage, scaled=scaled)
        assert share_covered(bounds, y[300:]) == pytest.approx(coverage, abs=0.07)
        np.testing.assert_allclose(bounds.mean(axis=1), model.predict(X[300:]))


def test_scaled_widths_follow_noise_that_depends_on_an_input():
    noise = np.where(X[:, 1] > 0, 0.6, 0.05)
    y = noisy(X, noise)
    model = SDNNKernelRidge().fit(X[:400], y[:400])
    plain, scaled = (model.predict_interval(X[400:], scaled=s) for s in (False, True))
    is_noisy = X[400:, 1] > 0.1
    is_quiet = X[400:, 1] < -0.1
    widths = np.diff(scaled)[:, 0]
    assert np.ptp(np.diff(plain)) < 1e-9
    assert np.median(widths[is_noisy]) > 4.0 * np.median(widths[is_quiet])
    for rows in (is_noisy, is_quiet):
        assert share_covered(scaled[rows], y[400:][rows]) == pytest.approx(0.9, abs=0.08)


def test_scaled_widths_do_not_depend_on_the_rank_of_the_solution():
    noise = np.where(X[:, 1] > 0, 0.06, 0.005)  # much smaller than the error of 150 samples
    y = noisy(X, noise)
    exact, low_rank = (
        SDNNKernelRidge(max_components=n, random_state=1).fit(X[:500], y[:500]) for n in (500, 150)
    )
    is_noisy = X[500:, 1] > 0
    for model in (exact, low_rank):
        bounds = model.predict_interval(X[500:], scaled=True)
        widths = np.diff(bounds)[:, 0]
        assert np.median(widths[is_noisy]) > 1.2 * np.median(widths[~is_noisy])
        assert share_covered(bounds, y[500:]) > 0.82, "nearly the default of 0.9"


def test_several_outputs_have_the_intervals_of_single_ones_also_after_pickling():
    y = np.stack([noisy(X, 0.1), 100.0 * X[:, 0]], axis=1)
    settings = {"alpha": 0.5, "degree": 2}
    model = pickle.loads(pickle.dumps(SDNNKernelRidge(**settings).fit(X[:90], y[:90])))
    bounds = model.predict_interval(X[90:], 0.8)
    assert bounds.shape == (610, 2, 2)  # samples, lower and upper bound, outputs
    single = SDNNKernelRidge(**settings).fit(X[:90], y[:90, 1])
    np.testing.assert_allclose(bounds[:, 1], single.predict_interval(X[90:], 0.8), atol=1e-8)


def test_integer_weights_are_repetitions_and_weight_zero_is_absence():
    y = noisy(X[:60], 0.2)
    weights = np.arange(60) % 3
    settings = {"alpha": 1.0, "degree": 1, "coding": "anchor"}
    weighted = SDNNKernelRidge(**settings).fit(X[:60], y, sample_weight=weights)
    repeated = SDNNKernelRidge(**settings).fit(X[:60].repeat(weights, 0), y.repeat(weights))
    np.testing.assert_allclose(
        weighted.predict_interval(X[60:], 0.8), repeated.predict_interval(X[60:], 0.8), atol=1e-9
    )


def test_coverage_within_0_and_1_with_enough_samples_is_required():
    model = SDNNKernelRidge().fit(X[:20], X[:20, 0])
    for coverage in (0.0, 1.0, np.nan):
        refuses("coverage", model.predict_interval, X, coverage)
    nine = model.fit(X[:9], X[:9, 0])  # 9 is the least for 0.9, and 10 for 0.91
    assert nine.predict_interval(X[:2], 0.9).shape == (2, 2)
    refuses("coverage", nine.predict_interval, X, 0.91)
    # Coverage c needs c / (1 - c) samples.
    assert "99 samples" in str(refuses("coverage", model.predict_interval, X, 0.99))
    refuses("scaled", model.predict_interval, X, scaled="yes", error=TypeError)
    constant = SDNNKernelRidge().fit(X[:20], np.ones(20))  # without errors: intervals of width 0
    np.testing.assert_allclose(constant.predict_interval(X[:3], scaled=True), 1.0, atol=1e-6)


def test_half_widths_are_quantiles_of_the_last_errors_whose_level_follows_the_coverage():
    # The level begins at the coverage 0.5. After each error but the first it rises by 0.02 * 0.5 if
    # the error is beyond the half width, and falls by 0.02 * 0.5 if not. Half widths are the error
    # of rank level * (n + 1), rounded up, among n.
    errors = FollowedErrors(0.5)
    assert errors.half_width() == 0.0
    for error in (1.0, 3.0):
        errors.learn(error)  # 3 is beyond the half width 1
    assert errors.level == pytest.approx(0.51)
    assert errors.half_width() == 3.0  # the second of two: 0.51 * 3 is rounded up
    errors.learn(2.0)  # within 3
    assert errors.level == pytest.approx(0.5)
    assert errors.half_width() == 2.0  # the second of three: 0.5 * 4
    for size in (5.0, 7.0):
        for _ in range(300):
            errors.learn(size)
    assert errors.ordered == [7.0] * 300, "the last 300 errors"


@pytest.mark.filterwarnings("ignore::sdnn.estimators.OutOfRangeWarning")
def test_river_intervals_contain_their_share_of_targets_as_the_noise_changes(river):
    random = np.random.RandomState(0)
    model = river.RiverRegressor(SDNNRegressor(n_pattern_units=40, random_state=0), coverage=0.8)
    is_covered = []
    for number in range(1700):
        a, b = random.uniform(-1, 1, 2)
        y = np.sin(3 * a) + b + (0.1 + 0.4 * (number > 900)) * random.normal()
        interval = model.predict_one({"a": a, "b": b}, with_interval=True)
        assert interval.center == pytest.approx(model.predict_one({"a": a, "b": b}))
        is_covered.append(y in interval)
        model.learn_one({"a": a, "b": b}, y)
    # The noise grows at sample 900; each of 8 periods has nearly the coverage of all samples.
    assert abs(np.mean(is_covered[100:]) - 0.8) < 0.02
    assert min(period.mean() for period in np.array_split(is_covered[100:], 8)) > 0.7
    assert model.clone().coverage == 0.8
    assert pickle.loads(pickle.dumps(model)).predict_one({"a": 0.1}, True) == model.predict_one(
        {"a": 0.1}, with_interval=True
    )


def test_river_intervals_of_extreme_targets_are_finite(river):
    model = river.RiverRegressor(grace_period=5)
    assert model.predict_one({"a": 1.0}, with_interval=True).width == 0.0
    for number in range(4):
        model.learn_one({"a": number}, 1.7e308 * (-1) ** (number // 2))
    interval = model.predict_one({"a": 1.0}, with_interval=True)
    assert np.isfinite([interval.lower, interval.upper]).all()
    for bad in (0.0, 1.0, "0.9", None):
        refuses("coverage", river.RiverRegressor, coverage=bad, error=(TypeError, ValueError))
    refuses("with_interval", model.predict_one, {"a": 1.0}, 1, error=TypeError)
