"""Choice of the kernel estimators' inputs, and of directions that mix them."""

import warnings

import numpy as np
import pandas as pd
import pytest

from sdnn import SDNNKernelClassifier, SDNNKernelRidge
from sdnn.coding import Circular, RandomInverse
from sdnn.coding.kernel import N_UNITS, AnalyticKernel
from sdnn.estimators.input_choice import N_DIRECTIONS, InputChoice, all_inputs
from sdnn.estimators.ridge import Samples


def uniform(n_samples, n_features, seed=0):
    return np.random.RandomState(seed).uniform(-1, 1, (n_samples, n_features))


def product_of_two(X):
    return X[:, 3] * X[:, 7]


def wave(X):
    """A wave along a direction that mixes four features, which is no sum over pairs."""
    return np.sin(3 * X @ [1, -1, 1, 0.5])


def test_the_two_features_of_a_product_are_selected_among_twelve():
    X, fresh = uniform(300, 12), uniform(500, 12, seed=1)
    model = SDNNKernelRidge().fit(X, product_of_two(X))
    assert model.selected_features_.tolist() == [3, 7]
    assert model.directions_.shape == (0, 12), "no mixtures of features"
    assert model.score(fresh, product_of_two(fresh)) > 0.95
    with_all = SDNNKernelRidge(inputs="all").fit(X, product_of_two(X))
    assert with_all.selected_features_.tolist() == list(range(12))
    assert with_all.score(fresh, product_of_two(fresh)) < 0.8


def test_a_classifier_selects_the_features_of_an_exclusive_or():
    X, fresh = uniform(300, 12), uniform(500, 12, seed=1)
    model = SDNNKernelClassifier().fit(X, product_of_two(X) > 0)
    assert model.selected_features_.tolist() == [3, 7]
    assert model.score(fresh, product_of_two(fresh) > 0) > 0.95


def test_the_direction_of_a_wave_is_found():
    X, fresh = uniform(400, 4), uniform(500, 4, seed=1)
    model = SDNNKernelRidge().fit(X, wave(X))
    true = np.array([1, -1, 1, 0.5])
    first = model.directions_[0]
    cosine = abs(first @ true) / np.linalg.norm(first) / np.linalg.norm(true)
    assert cosine > 0.98
    assert model.score(fresh, wave(fresh)) > 0.9
    assert SDNNKernelRidge(inputs="all").fit(X, wave(X)).score(fresh, wave(fresh)) < 0.5


def test_directions_are_in_units_of_the_features():
    X = uniform(400, 4) * [1, 100, 1e-3, 1] + [0, 5e4, 0, -7]
    model = SDNNKernelRidge().fit(X, wave(uniform(400, 4)))
    mixed = X @ model.directions_.T
    # The model's columns after those of the features are the mixed features, but for a constant.
    columns = model.X_fit_[:, len(model.selected_features_) :]
    differences = columns - mixed
    np.testing.assert_allclose(differences, differences[:1].repeat(len(X), axis=0), rtol=1e-6)


@pytest.mark.parametrize("n_features", [1, 2, 6])
def test_noise_leaves_all_features_and_no_directions(n_features):
    X = uniform(200, n_features)
    noise = np.random.RandomState(1).normal(size=200)
    chosen, every = (SDNNKernelRidge(inputs=i).fit(X, noise) for i in ("auto", "all"))
    assert chosen.selected_features_.tolist() == list(range(n_features))
    assert chosen.directions_.shape == (0, n_features)
    assert np.array_equal(chosen.predict(X), every.predict(X))


def test_categories_and_missing_numbers_are_selected_but_not_mixed():
    random = np.random.RandomState(0)
    frame = pd.DataFrame(uniform(400, 6), columns=list("abcdef"))
    frame["kind"] = pd.Categorical(random.choice(["low", "high"], 400))
    y = np.where(frame["kind"] == "low", 1, -1) * np.sin(3 * (frame["a"] + frame["b"]))
    frame.loc[::9, "c"] = np.nan
    model = SDNNKernelRidge().fit(frame, y)
    names = set(frame.columns[model.selected_features_])
    assert {"a", "b", "kind"} <= names
    assert not model.directions_[:, [frame.columns.get_loc(name) for name in ("c", "kind")]].any()
    assert model.score(frame, y) > 0.9
    assert "kind" in model.describe_inputs().splitlines()


def test_a_circular_feature_is_not_mixed():
    hour = np.random.RandomState(0).uniform(0, 24, 300)
    X = np.column_stack([hour, uniform(300, 3)])
    y = np.cos(hour * np.pi / 12) + np.sin(3 * (X[:, 1] + X[:, 2] + X[:, 3]))
    model = SDNNKernelRidge([(Circular(period=24.0), [0])]).fit(X, y)
    assert not model.directions_[:, 0].any()


@pytest.mark.parametrize(
    ("target_of", "n_features", "n_directions"), [(product_of_two, 8, 0), (wave, 4, 2)]
)
def test_the_order_of_samples_does_not_change_the_choice(target_of, n_features, n_directions):
    # With more than 400 samples, 400 decide. They are drawn from the sorted samples, so that the
    # same ones are drawn in any order; what is left are rounding errors.
    X = uniform(700, n_features)
    y = target_of(X)
    order = np.random.RandomState(1).permutation(700)
    models = SDNNKernelRidge().fit(X, y), SDNNKernelRidge().fit(X[order], y[order])
    assert np.array_equal(*(model.selected_features_ for model in models))
    assert len(models[0].directions_) == n_directions
    np.testing.assert_allclose(*(model.directions_ for model in models), rtol=1e-6)


def test_weights_choose_like_repeated_samples():
    X = uniform(250, 8)
    y = product_of_two(X) + np.random.RandomState(2).normal(0, 0.1, 250)
    counts = np.random.RandomState(1).randint(1, 4, 250)
    weighted = SDNNKernelRidge().fit(X, y, counts)
    repeated = SDNNKernelRidge().fit(X.repeat(counts, 0), y.repeat(counts))
    assert np.array_equal(weighted.selected_features_, repeated.selected_features_)
    np.testing.assert_allclose(weighted.predict(X), repeated.predict(X), rtol=0, atol=1e-10)


def choice_of(X, y, degree):
    """Return the choice among the inputs X, its candidate with all of them, and their codings."""
    codings = [RandomInverse().fit(column, N_UNITS) for column in X.T]
    ones = np.ones(len(X))
    choice = InputChoice(codings, X, Samples(y[:, None], ones, ones), [degree])
    return choice, choice._solve(all_inputs(X.shape[1])), codings


def test_importance_is_the_change_where_a_feature_is_averaged_away():
    X = uniform(30, 3)
    choice, candidate, codings = choice_of(X, X[:, 0] + X[:, 1] * X[:, 2], degree=1)
    table, kernel = choice._table, AnalyticKernel(codings)

    def outputs(samples):
        return kernel(samples, table) @ candidate.solution.dual

    for feature, importance in enumerate(choice._importances(candidate)):
        # In each copy of the table, all samples have the feature's value of one sample.
        copies = [table.copy() for _ in table]
        for copy, value in zip(copies, table[:, feature], strict=True):
            copy[:, feature] = value
        changes = outputs(table) - np.mean([outputs(copy) for copy in copies], axis=0)
        expected = np.square(changes).mean() / choice._variances[0]  # a share of the variance
        np.testing.assert_allclose(importance, expected)


@pytest.mark.parametrize("degree", [1, 2, 3])
def test_gradients_of_a_plane_have_its_slopes(degree):
    X = uniform(300, 2)
    choice, candidate, _ = choice_of(X, 3 * X[:, 0] - X[:, 1], degree)
    n_gradients = len(choice._gradient(candidate, 0))  # of the first samples of the table
    is_inner = np.abs(choice._table[:n_gradients]).max(axis=1) < 0.7
    deviations = X.std(axis=0)  # gradients are differences per standard deviation
    for feature, slope in enumerate((3.0, -1.0)):
        gradient = np.median(choice._gradient(candidate, feature)[is_inner])
        assert gradient == pytest.approx(slope * deviations[feature], rel=0.15)


@pytest.mark.filterwarnings("ignore::sdnn.estimators.OutlierWarning")
@pytest.mark.parametrize("factor", [1e-310, 1e-300, 1e300, 1e306])
def test_features_of_any_size_are_chosen_and_mixed(factor):
    X = uniform(200, 4)
    y = wave(X)
    with warnings.catch_warnings():
        warnings.simplefilter("error", RuntimeWarning)
        model = SDNNKernelRidge().fit(X * factor, y)
        assert np.isfinite(model.predict(X * factor)).all()
    is_subnormal = factor < 1e-305
    if not is_subnormal:
        assert len(model.directions_) == N_DIRECTIONS


def test_constant_features_and_outliers_are_mixed_with_nothing_infinite():
    X = uniform(200, 4)
    X[:, 2] = 5.0
    X[0, 1] = 1e9
    y = np.sin(3 * (X[:, 0] + X[:, 3]))
    with pytest.warns(match="left out"):
        model = SDNNKernelRidge().fit(X, y)
    assert np.isfinite(model.directions_).all()
    assert not model.directions_[:, 2].any()


def test_listed_pairs_keep_all_features():
    X = uniform(200, 6)
    model = SDNNKernelRidge(pairs=[(0, 1), (2, None)]).fit(X, X[:, 0] * X[:, 1])
    assert model.selected_features_.tolist() == list(range(6))


def test_the_description_names_features_and_weights():
    X = pd.DataFrame(uniform(400, 4), columns=["left", "right", "up", "down"])
    lines = SDNNKernelRidge().fit(X, wave(X.to_numpy())).describe_inputs().splitlines()
    assert lines[:5] == ["4 of 4 features", "left", "right", "up", "down"]
    assert lines[5].startswith("direction 0: +1.00 ")
    assert all(name in lines[5] for name in X)
