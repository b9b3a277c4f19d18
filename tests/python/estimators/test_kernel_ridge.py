"""Ridge regression and classification with the analytic kernel."""

import pickle
import time
import tracemalloc

import numpy as np
import pandas as pd
import pytest
from sklearn.base import clone
from sklearn.model_selection import GridSearchCV
from sklearn.utils.estimator_checks import check_estimator

from refusals import refuses
from sdnn import SDNNKernelClassifier, SDNNKernelRidge, SDNNRegressor
from sdnn.coding import Circular, RandomInverse
from sdnn.coding.kernel import N_UNITS, AnalyticKernel

RANDOM = np.random.RandomState(0)
X = RANDOM.uniform(0, 1, (120, 4))
Y = np.sin(5 * X[:, 0]) * X[:, 1] + X[:, 2]
LABELS = np.array(["low", "middle", "high"])[np.digitize(Y, [0.2, 0.8])]


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("model", [SDNNKernelRidge(), SDNNKernelClassifier()])
def test_scikit_learns_check_estimator_finds_no_fault(model):
    results = check_estimator(model, on_skip=None, on_fail=None)
    not_passed = {r["check_name"]: r["status"] for r in results if r["status"] != "passed"}
    assert set(not_passed) <= {"check_array_api_input"}, not_passed
    assert set(not_passed.values()) <= {"skipped"}


def kernel_matrix(degree, samples=X):
    """Return the kernel of samples and all training samples; codings are fitted to the latter."""
    coding = RandomInverse()
    kernel = AnalyticKernel([coding.fit(column, N_UNITS) for column in X.T])(samples, X)
    return {1: kernel, 2: (kernel + kernel**2) / 2, 3: kernel**3}[degree]


def ridge(kernel, y, weights, alpha, kernel_of_test):
    """Predict by weighted ridge regression whose constant is not penalized, from its equations."""
    n = len(y)
    system = np.zeros((n + 1, n + 1))
    system[:n, :n] = kernel + alpha * np.diag(1 / weights)
    system[:n, n] = system[n, :n] = 1
    solution = np.linalg.solve(system, np.append(y, 0))
    return kernel_of_test @ solution[:n] + solution[n]


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_predictions_solve_the_weighted_normal_equations(degree):
    weights = RANDOM.uniform(0.2, 3, len(X))
    model = SDNNKernelRidge(alpha=0.3, degree=degree).fit(X, Y, weights)
    fresh = RANDOM.uniform(0, 1, (20, 4)).clip(X.min(axis=0), X.max(axis=0))
    expected = ridge(kernel_matrix(degree), Y, weights, 0.3, kernel_matrix(degree, fresh))
    np.testing.assert_allclose(model.predict(fresh), expected)
    assert (model.alpha_, model.degree_) == (0.3, degree)


def test_alpha_and_degree_minimize_the_leave_one_out_error():
    noisy = Y + np.random.RandomState(1).normal(0, 0.3, len(Y))

    def error(degree, alpha):
        kernel, ones, errors = kernel_matrix(degree), np.ones(len(Y) - 1), []
        for i in range(len(Y)):
            others = np.arange(len(Y)) != i
            of_others = kernel[np.ix_(others, others)]
            errors.append(
                ridge(of_others, noisy[others], ones, alpha, kernel[i, others]) - noisy[i]
            )
        return np.mean(np.square(errors)) / noisy.var()

    chosen = SDNNKernelRidge().fit(X, noisy)
    assert chosen.leave_one_out_error_ == pytest.approx(error(chosen.degree_, chosen.alpha_))
    for degree in (1, 2, 3):
        for factor in (0.1, 1, 10):
            other_error = error(degree, factor * chosen.alpha_)
            assert chosen.leave_one_out_error_ < other_error + 1e-9


@pytest.mark.parametrize("estimator", [SDNNKernelRidge, SDNNKernelClassifier])
def test_integer_weights_equal_repeated_samples(estimator):
    y = Y if estimator is SDNNKernelRidge else LABELS
    weights = RANDOM.randint(0, 4, len(X))
    weighted = estimator().fit(X, y, weights)
    repeated = estimator().fit(np.repeat(X, weights, axis=0), np.repeat(y, weights))
    method = "predict" if estimator is SDNNKernelRidge else "predict_proba"
    outputs = (getattr(model, method)(X) for model in (weighted, repeated))
    np.testing.assert_allclose(*outputs, atol=1e-8)


@pytest.mark.parametrize("estimator", [SDNNKernelRidge, SDNNKernelClassifier])
def test_the_scale_of_sample_weights_has_no_effect(estimator):
    y = Y if estimator is SDNNKernelRidge else LABELS
    weights = RANDOM.uniform(0, 1, len(X))
    plain = estimator().fit(X, y, weights)
    scaled = estimator().fit(X, y, weights / weights.sum())
    np.testing.assert_allclose(plain.dual_coef_, scaled.dual_coef_, rtol=1e-6, atol=1e-8)


def test_low_rank_fits_are_close_to_exact_ones():
    samples = np.random.RandomState(0).uniform(0, 1, (3000, 2))
    y = np.sin(6 * samples[:, 0]) * samples[:, 1]
    exact = SDNNKernelRidge(max_components=3000, alpha=0.1, degree=2).fit(samples[:1000], y[:1000])
    low_rank = clone(exact).set_params(max_components=999, random_state=0)
    low_rank.fit(samples[:1000], y[:1000])  # with one component fewer than samples
    np.testing.assert_allclose(low_rank.predict(samples), exact.predict(samples), atol=0.01)


def test_low_rank_fits_keep_to_the_documented_memory():
    samples = np.random.RandomState(0).uniform(0, 1, (3000, 2))
    y = np.sin(6 * samples[:, 0]) * samples[:, 1]
    tracemalloc.start()
    try:
        low = SDNNKernelRidge(max_components=100, random_state=0).fit(samples, y)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert low.X_fit_.shape == (100, 2)
    assert low.score(samples, y) > 0.98  # it has learned
    # The class documents 98,304 bytes for each component, 16 MB to choose inputs, and a matrix of
    # 1000 x 1000 bins for each of the two codings.
    assert peak < 98304 * 100 + 16e6 + 2 * 8 * 1000**2


@pytest.mark.parametrize("max_components", [30, 2000])
def test_classes_are_learned_with_calibrated_probabilities(max_components):
    random = np.random.RandomState(3)
    samples = random.uniform(-1, 1, (900, 3))
    noisy = samples[:, 0] * samples[:, 1] + 0.1 * random.normal(size=900)
    labels = np.array(["no", "yes"])[(noisy > 0).astype(int)]
    model = SDNNKernelClassifier(max_components=max_components, random_state=0)
    model.fit(samples[:500], labels[:500])
    probabilities = model.predict_proba(samples[500:])
    np.testing.assert_allclose(probabilities.sum(axis=1), 1)
    predicted = model.predict(samples[500:])
    assert model.score(samples[500:], labels[500:]) > 0.8
    np.testing.assert_array_equal(predicted, model.classes_[probabilities.argmax(axis=1)])
    np.testing.assert_array_equal(predicted == "yes", model.decision_function(samples[500:]) > 0)
    right = predicted == labels[500:]
    assert abs(probabilities.max(axis=1).mean() - right.mean()) < 0.1


def test_decisions_of_three_classes_sum_to_one():
    three = SDNNKernelClassifier().fit(X, LABELS)
    assert three.decision_function(X).shape == (120, 3)
    np.testing.assert_allclose(three.decision_function(X).sum(axis=1), 1)


def test_class_weights_shift_predictions_towards_rare_classes():
    rare = np.where(np.quantile(Y, 0.9) < Y, "rare", "usual")
    noisy = X + np.random.RandomState(0).normal(0, 0.3, X.shape)
    plain, balanced, none = (
        SDNNKernelClassifier(class_weight=weight).fit(noisy, rare)
        for weight in (None, "balanced", {"rare": 0, "usual": 1})
    )
    shares = [(model.predict(noisy) == "rare").mean() for model in (plain, balanced, none)]
    assert shares[0] < shares[1]
    assert shares[2] == 0


def test_negative_class_weights_and_single_classes_are_refused():
    rare = np.where(np.quantile(Y, 0.9) < Y, "rare", "usual")
    refuses("class_weight", SDNNKernelClassifier(class_weight={"rare": -1}).fit, X, rare)
    refuses("class", SDNNKernelClassifier().fit, X, np.zeros(len(X)))


def test_the_kernel_of_all_pairs_equals_that_of_listed_pairs():
    codings = [RandomInverse().fit(column, N_UNITS) for column in X.T]
    pairs = [(mu, nu) for mu in range(4) for nu in range(4) if mu != nu]
    np.testing.assert_allclose(
        AnalyticKernel(codings)(X), AnalyticKernel(codings, pairs=pairs)(X), rtol=1e-12
    )


@pytest.mark.parametrize("pairs", ["all", [("x", "angle"), ("kind", "gaps")]])
def test_predictions_are_sums_of_the_analytic_kernel(pairs):
    frame = pd.DataFrame({"x": X[:, 0], "angle": 360 * X[:, 1], "kind": LABELS, "gaps": X[:, 3]})
    frame.loc[::7, "gaps"] = np.nan
    codings = [(Circular(period=360.0), ["angle"]), ("symbolic", ["kind"])]
    # `predict` sums the kernel of all pairs in the core, and that of listed pairs in NumPy; both
    # must agree with the matrix of `kernel_`. Correlations of RandomInverse fall by a factor from
    # bin to bin, whose powers the core uses. With this short scale they would underflow, and the
    # core looks them up in a table; without this coding x has the default scale and powers.
    codings.append((RandomInverse(length_scale=0.001), ["x"]))
    for coding in codings, codings[:2]:
        model = SDNNKernelRidge(coding, pairs=pairs, inputs="all", degree=2, alpha=0.01)
        model.fit(frame[:90], Y[:90])
        table = frame.to_numpy(dtype=object)
        kernel = model.kernel_(table, model.X_fit_)
        of_degree_2 = (kernel + kernel**2) / 2
        expected = of_degree_2 @ model.dual_coef_ + model.intercept_
        np.testing.assert_allclose(model.predict(frame), expected[:, 0], rtol=1e-10)


def test_ridge_regression_scores_better_than_the_network_on_noise():
    noisy = Y + np.random.RandomState(1).normal(0, 0.5, len(Y))
    fresh = np.random.RandomState(2).uniform(0, 1, (300, 4))
    true = np.sin(5 * fresh[:, 0]) * fresh[:, 1] + fresh[:, 2]
    ridge = SDNNKernelRidge().fit(X, noisy).score(fresh, true)
    network = SDNNRegressor(random_state=0).fit(X, noisy).score(fresh, true)
    assert ridge > network + 0.05


def test_a_grid_search_over_pairs_of_a_frame_is_accepted():
    frame = pd.DataFrame({"hour": 24 * X[:, 0], "kind": np.where(X[:, 1] > 0.5, "u", "v")})
    model = SDNNKernelRidge([(Circular(period=24.0), ["hour"]), ("symbolic", ["kind"])])
    grid = {"alpha": [0.01, 0.1], "pairs": ["all", [("hour", "kind")]]}
    search = GridSearchCV(model, grid, cv=3).fit(frame, Y)
    assert search.best_estimator_.n_features_in_ == 2


def test_several_outputs_are_predicted_like_single_ones_also_after_pickling():
    outputs = np.stack([Y, -Y], axis=1)
    both = SDNNKernelRidge().fit(X, outputs)
    np.testing.assert_allclose(both.predict(X)[:, 0], SDNNKernelRidge().fit(X, Y).predict(X))
    unpickled = pickle.loads(pickle.dumps(both))
    np.testing.assert_array_equal(unpickled.predict(X), both.predict(X))
    assert clone(both).get_params() == both.get_params()


@pytest.mark.parametrize("coding", ["random-inverse", "anchor", RandomInverse(spacing="quantile")])
def test_a_constant_column_does_not_prevent_learning(coding):
    constant = np.column_stack([X, np.full(len(X), 7.0)])
    for model in (SDNNKernelRidge(coding), SDNNRegressor(coding, random_state=0)):
        assert model.fit(constant, Y).score(constant, Y) > 0.9


def test_fitted_codings_are_used_unchanged():
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
    # The 48 bytes that are documented for each pair of samples, and three matrices of bins.
    assert peak < 48 * n_samples**2 + 3 * 8 * n_bins**2


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


def test_targets_whose_squares_overflow_are_refused():
    samples = np.random.default_rng(0).random((40, 3))
    refuses("y", SDNNKernelRidge().fit, samples, 8e307 * samples[:, 0])
    model = SDNNKernelRidge().fit(samples, 1e139 * samples[:, 0])
    assert np.isfinite(model.predict(samples)).all()
    assert model.score(samples, 1e139 * samples[:, 0]) > 0.9


@pytest.mark.parametrize("coding", ["random-inverse", "with-missing", "anchor", "circular"])
def test_500_columns_with_equal_codings_share_a_matrix_and_are_fitted_within_2_seconds(coding):
    wide = np.random.RandomState(0).uniform(size=(40, 500))
    begin = time.process_time()
    SDNNKernelRidge(coding).fit(wide, wide[:, 0]).predict(wide)
    assert time.process_time() - begin < 2
    few = SDNNKernelRidge(coding, inputs="all").fit(wide[:, :2], wide[:, 0])
    assert len({id(matrix) for matrix in few.kernel_._correlations}) == 1
