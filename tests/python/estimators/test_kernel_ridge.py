"""Ridge regression with the analytic kernel."""

import pickle
import tracemalloc

import numpy as np
import pandas as pd
import pytest
from sklearn.base import clone
from sklearn.model_selection import GridSearchCV
from sklearn.utils.estimator_checks import check_estimator

from refusals import refuses
from sdnn import SDNNKernelRidge, SDNNRegressor
from sdnn.coding import Circular, RandomInverse
from sdnn.kernel import N_UNITS, AnalyticKernel

RANDOM = np.random.RandomState(0)
X = RANDOM.uniform(0, 1, (120, 4))
Y = np.sin(5 * X[:, 0]) * X[:, 1] + X[:, 2]


@pytest.mark.filterwarnings("ignore")
def test_check_estimator_finds_nothing():
    results = check_estimator(SDNNKernelRidge(), on_skip=None, on_fail=None)
    other = {r["check_name"]: r["status"] for r in results if r["status"] != "passed"}
    assert set(other) <= {"check_array_api_input"}, other
    assert set(other.values()) <= {"skipped"}


def test_it_solves_the_normal_equations():
    model = SDNNKernelRidge(alpha=0.3).fit(X, Y)
    coding = RandomInverse()
    kernel = AnalyticKernel([coding.fit(column, N_UNITS) for column in X.T])
    weights = np.linalg.solve(kernel(X) + 0.3 * np.eye(len(X)), Y - Y.mean())
    fresh = RANDOM.uniform(0, 1, (20, 4))
    np.testing.assert_allclose(model.predict(fresh), Y.mean() + kernel(fresh, X) @ weights)


def test_all_pairs_have_the_sum_over_each_pair():
    codings = [RandomInverse().fit(column, N_UNITS) for column in X.T]
    pairs = [(mu, nu) for mu in range(4) for nu in range(4) if mu != nu]
    np.testing.assert_allclose(
        AnalyticKernel(codings)(X), AnalyticKernel(codings, pairs=pairs)(X), rtol=1e-12
    )


def test_noise_is_penalized_where_the_network_learns_it():
    noisy = Y + np.random.RandomState(1).normal(0, 0.5, len(Y))
    fresh = np.random.RandomState(2).uniform(0, 1, (300, 4))
    true = np.sin(5 * fresh[:, 0]) * fresh[:, 1] + fresh[:, 2]
    ridge = SDNNKernelRidge(alpha=1.0).fit(X, noisy).score(fresh, true)
    network = SDNNRegressor(random_state=0).fit(X, noisy).score(fresh, true)
    assert ridge > network + 0.1


def test_tables_and_searches_are_taken():
    frame = pd.DataFrame({"hour": 24 * X[:, 0], "kind": np.where(X[:, 1] > 0.5, "u", "v")})
    model = SDNNKernelRidge([(Circular(period=24.0), ["hour"]), ("symbolic", ["kind"])])
    grid = {"alpha": [0.01, 0.1], "pairs": ["all", [("hour", "kind")]]}
    found = GridSearchCV(model, grid, cv=3).fit(frame, Y)
    assert found.best_estimator_.n_features_in_ == 2
    outputs = np.stack([Y, -Y], axis=1)
    both = SDNNKernelRidge().fit(X, outputs)
    np.testing.assert_allclose(both.predict(X)[:, 0], SDNNKernelRidge().fit(X, Y).predict(X))
    same = pickle.loads(pickle.dumps(both))
    np.testing.assert_array_equal(same.predict(X), both.predict(X))
    assert clone(both).get_params() == both.get_params()


@pytest.mark.parametrize("coding", ["random-inverse", "anchor", RandomInverse(spacing="quantile")])
def test_a_constant_column_is_taken_as_by_the_network(coding):
    constant = np.column_stack([X, np.full(len(X), 7.0)])
    for model in (SDNNKernelRidge(coding), SDNNRegressor(coding, random_state=0)):
        assert model.fit(constant, Y).score(constant, Y) > 0.9


def test_learned_codings_are_not_learned_again():
    codings = SDNNRegressor(RandomInverse(spacing="quantile"), random_state=0).fit(X, Y).codings_
    model = SDNNKernelRidge([(coding, [i]) for i, coding in enumerate(codings)])
    assert [c.knots for c in model.fit(X[:50], Y[:50]).kernel_.codings] == [
        c.knots for c in codings
    ]


@pytest.mark.parametrize("pairs", ["all", [(number, number - 1) for number in range(20)]])
def test_memory_does_not_grow_with_the_features(pairs):
    n_samples, n_bins = 1200, 1000
    samples = np.random.RandomState(0).uniform(0, 1, (n_samples, 20))
    tracemalloc.start()
    try:
        SDNNKernelRidge(pairs=pairs).fit(samples, samples[:, 0])
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < 32 * n_samples**2 + 3 * 8 * n_bins**2


def test_a_failed_fit_leaves_the_old_model(monkeypatch):
    model = SDNNKernelRidge().fit(X, Y)
    before = pickle.dumps(model)
    words = np.where(X > 0.5, "u", "v")
    for samples, targets in [(words, Y), (X[:, :2], Y[:9]), (np.full_like(X, np.inf), Y)]:
        with pytest.raises(ValueError, match=r"."):
            model.fit(samples, targets)
        assert pickle.dumps(model) == before
    monkeypatch.setattr(AnalyticKernel, "__call__", lambda *_: 1 / 0)
    with pytest.raises(ZeroDivisionError):
        model.fit(X[:, :2], Y)
    assert pickle.dumps(model) == before


@pytest.mark.parametrize(
    ("parameters", "error"),
    [
        ({"alpha": 0}, "'alpha'"),
        ({"alpha": np.inf}, "'alpha'"),
        ({"alpha": "much"}, "'alpha'"),
        ({"pairs": [(0, 9)]}, "9"),
        ({"pairs": "budget"}, "pairs"),
        ({"coding": "unheard"}, "coding"),
    ],
)
def test_impossible_parameters_are_named(parameters, error):
    refuses(error, SDNNKernelRidge(**parameters).fit, X, Y)
