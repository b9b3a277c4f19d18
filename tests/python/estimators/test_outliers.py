"""Outliers are warned of, or left out of ranges, or cost little; clean data cause no warning."""

import warnings

import numpy as np
import pytest

from sdnn import SDNNClassifier, SDNNKernelClassifier, SDNNKernelRidge, SDNNRegressor
from sdnn.coding import Circular, RandomInverse, Symbolic, WithMissing
from sdnn.estimators import OutlierWarning
from sdnn.estimators.outliers import usual_range

N = 200
CLEAN = (
    lambda r: r.normal(size=N),
    lambda r: r.uniform(-1, 1, N),
    lambda r: r.exponential(size=N),
    lambda r: r.lognormal(0, 0.5, N),
    lambda r: r.laplace(size=N),
    lambda r: r.beta(0.5, 0.5, N),
    lambda r: r.poisson(0.3, N).astype(float),
    lambda r: (r.uniform(size=N) < 0.03).astype(float),
    lambda r: np.where(r.uniform(size=N) < 0.97, 0, r.uniform(size=N)),
    lambda r: np.where(r.uniform(size=N) < 0.5, 0, 9) + r.normal(size=N),
    lambda r: np.full(N, 3.0),
)


def network(**options):
    return SDNNRegressor(n_pattern_units=100, max_iter=15, random_state=0, **options)


def samples(random, n=N):
    X = random.uniform(-1, 1, (n, 3)) if random.randint(2) else random.normal(size=(n, 3))
    return X, np.sin(2 * X[:, 0]) + X[:, 1]


def with_outlier(random, X, y):
    """Return the samples with a target, a value or a row that is far from all others."""
    X, y = X.copy(), y.copy()
    row, far = random.randint(len(y)), 10 ** random.uniform(0.7, 6) * random.choice([-1, 1])
    outlier = ["target", "value", "row"][random.randint(3)]
    if outlier == "target":
        y[row] = far * np.ptp(y)
    else:
        X[row, : 1 if outlier == "value" else 3] = far * np.ptp(X)
    return X, y


def fit_and_watch(model, X, y):
    """Return the fitted model, and whether it warned of outliers."""
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        model.fit(X, y)
    return model, any(issubclass(warning.category, OutlierWarning) for warning in caught)


@pytest.mark.parametrize("seed", range(100))
def test_an_outlier_causes_a_warning_or_a_loss_below_002(seed):
    random = np.random.RandomState(seed)
    # Equal seeds make equal distributions. Half of the test samples are those of training,
    # which matters little: the losses of two models are compared.
    (X, y), (X_test, y_test) = samples(random), samples(np.random.RandomState(seed), 400)
    make = network if seed % 2 else SDNNKernelRidge
    clean, warned = fit_and_watch(make(), X, y)
    assert not warned
    spoiled, warned = fit_and_watch(make(), *with_outlier(random, X, y))
    lost = clean.score(X_test, y_test) - spoiled.score(X_test, y_test)
    assert warned or lost < 0.02
    # Robust ranges leave another outlier out without a warning.
    robust, warned = fit_and_watch(make(ranges="robust"), *with_outlier(random, X, y))
    assert not warned
    assert clean.score(X_test, y_test) - robust.score(X_test, y_test) < 0.1


@pytest.mark.parametrize("seed", range(100))
def test_samples_of_usual_distributions_cause_no_warning_until_one_is_distant(seed):
    random = np.random.RandomState(seed)
    columns = np.stack([draw(random) for draw in CLEAN], axis=1)  # of each distribution
    X = columns[:, random.permutation(len(CLEAN))[:4]]
    y = CLEAN[seed % len(CLEAN)](random)
    options = {"n_pattern_units": 16, "max_iter": 1, "random_state": 0}
    for model in (SDNNRegressor(**options), SDNNKernelRidge(degree=1)):
        _, warned = fit_and_watch(model, X, y)
        assert not warned
    labels = X[:, 0] > np.quantile(X[:, 0], 0.4)
    labels[:2] = True, False
    for model in (SDNNClassifier(**options), SDNNKernelClassifier(degree=1)):
        _, warned = fit_and_watch(model, X, labels)
        assert not warned
        _, warned = fit_and_watch(model, np.vstack([X[1:], X[:1] + 1e4]), labels)
        assert warned


def test_robust_ranges_of_clean_samples_equal_full_ranges():
    random = np.random.RandomState(0)
    X, y = samples(random)
    for make in (network, SDNNKernelRidge):
        plain, robust = make().fit(X, y), make(ranges="robust").fit(X, y)
        np.testing.assert_array_equal(plain.predict(X), robust.predict(X))


def test_usual_range_excludes_few_distant_values():
    # Outliers are at most a fortieth of the values at either end, beyond a gap of twice the width
    # of the middle 95 %. Where most values are equal, this width is that of the others and them.
    usual = np.arange(100.0)
    assert usual_range(np.append(usual, [1e6, 2e6, -1e9])) == (0, 99)
    assert usual_range(np.append(np.zeros(100), [1.0, 1.0, 1e6])) == (0, 1)
    many = np.full(20, 1e6)
    assert usual_range(np.append(usual, many)) == (0, 1e6), "a sixth of all values is usual"
    assert usual_range(np.array([0.0, 0.1, 1e6])) == (0, 1e6), "few values have no outliers"
    assert usual_range(np.full(50, 7.0)) == (7, 7)
    assert usual_range(np.append(usual, [1e308, -1e308])) == (0, 99)


@pytest.mark.parametrize(
    ("coding", "warns"),
    [
        (RandomInverse(), True),
        ("anchor", True),
        (WithMissing(), True),
        (RandomInverse(spacing="quantile"), False),
        (RandomInverse(low=0.0, high=1.0), False),
        (Circular(), False),
        (Symbolic(), False),
    ],
)
def test_only_codings_that_fit_evenly_spaced_bins_warn_of_outliers(coding, warns):
    X = np.arange(100.0)[:, None] / 100
    X[7] = 1e6
    _, warned = fit_and_watch(network(coding=coding), X, np.arange(100.0))
    assert warned == warns


def test_partial_fit_warns_of_outliers_in_its_first_samples():
    X, y = samples(np.random.RandomState(0))
    y[3] = 1e6
    with pytest.warns(OutlierWarning, match="ranges='all'") as caught:
        network().partial_fit(X, y)
    assert caught[0].filename == __file__


@pytest.mark.filterwarnings("ignore::sdnn.estimators.OutOfRangeWarning")
def test_a_widened_output_range_ignores_one_outlier_but_follows_many():
    X, y = samples(np.random.RandomState(0), 1000)
    model = network(out_of_range="widen").partial_fit(X[:100], y[:100])
    width = np.ptp(model.output_range_)
    model.learn_one(X[100], 1e6)
    assert np.ptp(model.output_range_) < 3 * width
    assert model.partial_fit(X[101:], y[101:]).score(X, y) > 0.9
    for _ in range(30):
        model.learn_one(X[0], 1e6)
    assert model.output_range_[0, 1] > 1e6
