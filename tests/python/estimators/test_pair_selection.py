"""Which features and pairs matter, and leaving out the others."""

import itertools

import numpy as np
import pandas as pd
import pytest

from sdnn import SDNNClassifier, SDNNRegressor
from sdnn.coding import CorrelationMatrix, RandomInverse, Symbolic, WithMissing

X = np.random.RandomState(0).uniform(size=(600, 8))
XOR = ((X[:, 2] > 0.5) ^ (X[:, 5] > 0.5)).astype(int)
OPTIONS = {"n_pattern_units": 60, "random_state": 0, "max_iter": 10}


def test_the_only_relevant_pair_is_selected():
    options = {**OPTIONS, "n_units_per_class": 10}
    with_all = SDNNClassifier(**options).fit(X[:300], XOR[:300])
    auto = SDNNClassifier(**options, pairs="auto").fit(X[:300], XOR[:300])
    assert set(auto.pairs_) == {(2, 5), (5, 2)}
    assert auto.score(X[300:], XOR[300:]) > max(0.95, with_all.score(X[300:], XOR[300:]))
    expected_model = SDNNClassifier(**options, pairs=[(2, 5), (5, 2)]).fit(X[:300], XOR[:300])
    np.testing.assert_array_equal(auto.weights_, expected_model.weights_)


def test_irrelevant_features_are_left_out():
    random = np.random.RandomState(1)
    wide = random.uniform(size=(500, 40))
    y = 10 * np.sin(np.pi * wide[:, 3] * wide[:, 17]) + 5 * wide[:, 30]
    model = SDNNRegressor(random_state=0, pairs="auto").fit(wide[:300], y[:300])
    used_features = {feature for pair in model.pairs_ for feature in pair}
    assert {3, 17, 30} <= used_features
    assert len(used_features) <= 5, "40 features are halved to 20, 10, 5 and 3"
    by_default = SDNNRegressor(random_state=0).fit(wide[:300], y[:300])  # uses all features
    assert model.score(wide[300:], y[300:]) > by_default.score(wide[300:], y[300:]) + 0.1


def test_all_pairs_are_kept_if_all_are_relevant():
    points = X[:300, :4]
    y = sum(np.sin(4 * points[:, i]) * points[:, j] for i, j in itertools.permutations(range(4), 2))
    options = {**OPTIONS, "n_output_units": 100}
    model = SDNNRegressor(**options, pairs="auto").fit(points, y)
    assert len(model.pairs_) == 4 * 3
    np.testing.assert_array_equal(model.weights_, SDNNRegressor(**options).fit(points, y).weights_)


@pytest.mark.parametrize("estimator", [SDNNRegressor, SDNNClassifier])
def test_few_samples_and_single_features_keep_all_pairs(estimator):
    assert len(estimator(**OPTIONS, pairs="auto").fit(X[:8], XOR[:8]).pairs_) == 8 * 7
    assert estimator(**OPTIONS, pairs="auto").fit(X[:, :1], XOR).pairs_ == ((0, 0),)


LETTERS = np.where(X[:, 2] > 0.5, "u", "v").astype(object)
LETTERS[17] = "once"
CATEGORIES = {
    "symbolic": "symbolic",
    "matrix": CorrelationMatrix(matrix=np.eye(3)),
    "missing": WithMissing(base=Symbolic()),
    "error": WithMissing(base=Symbolic(), unknown="error"),
    "missing matrix": WithMissing(base=CorrelationMatrix(matrix=np.eye(3))),
}


@pytest.mark.parametrize("name", CATEGORIES)
def test_pairs_can_be_selected_with_a_category_that_occurs_once(name):
    frame = pd.DataFrame({"a": X[:, 0], "letter": LETTERS, "b": X[:, 5], "c": X[:, 6]})[:100]
    codings = [(CATEGORIES[name], ["letter"]), ("anchor", ["c"])]
    model = SDNNRegressor(codings, pairs="auto", **OPTIONS).fit(frame, X[:100, 2] + X[:100, 5])
    expected_model = SDNNRegressor(codings, pairs=model.pairs_, **OPTIONS)
    expected_model.fit(frame, X[:100, 2] + X[:100, 5])
    assert model.coding == codings
    assert model.codings_ == expected_model.codings_
    np.testing.assert_array_equal(model.weights_, expected_model.weights_)


@pytest.mark.parametrize("n_rare", [1, 3])
def test_pairs_can_be_selected_with_a_rare_class(n_rare):
    labels = np.repeat([0, 1], [40 - n_rare, n_rare])
    model = SDNNClassifier(**OPTIONS, n_units_per_class=4, pairs="auto").fit(X[:40, :3], labels)
    assert model.pairs_, "with so few samples, any pairs may be selected"


def test_a_class_that_occurs_once_is_learned_with_selected_pairs():
    labels = XOR[:40].copy()
    labels[0] = 2
    model = SDNNClassifier(**OPTIONS, pairs="auto", correction_share=1.0).fit(X[:40, :3], labels)
    assert model.score(X[:1, :3], [2]) == 1


def test_pair_names_are_those_of_the_parameter():
    frame = pd.DataFrame(X[:, :3], columns=["a", "b", "c"])
    pairs = [("a", "b"), ("c", None)]
    model = SDNNClassifier(**OPTIONS, pairs=pairs).fit(frame, XOR)
    assert model.pair_names_ == pairs
    assert SDNNClassifier(**OPTIONS, pairs=[(0, 1), (2, None)]).fit(X, XOR).pair_names_ == [
        (0, 1), (2, None),
    ]  # fmt: skip


@pytest.mark.parametrize("seed", range(8))
def test_features_are_selected_where_only_the_held_out_part_lacks_a_value(seed):
    incomplete = X[:60].copy()
    incomplete[seed * 7, 2] = np.nan
    model = SDNNClassifier(**{**OPTIONS, "random_state": seed}, pairs="auto")
    assert model.fit(incomplete, XOR[:60]).predict(incomplete).shape == (60,)


@pytest.mark.parametrize("coding", ["random-inverse", RandomInverse(spacing="quantile"), "words"])
@pytest.mark.parametrize("n_present", [1, 2])
@pytest.mark.parametrize("seed", range(5))  # each has another fifth held out
def test_pairs_can_be_selected_with_a_column_of_hardly_any_values(coding, n_present, seed):
    frame = pd.DataFrame(X[:60, :4], columns=["a", "b", "c", "rare"])
    frame.loc[n_present:, "rare"] = np.nan
    if coding == "words":
        frame["rare"] = [None if np.isnan(value) else "word" for value in frame["rare"]]
        coding = [(WithMissing(base=Symbolic()), ["rare"])]
    options = {"n_pattern_units": 16, "max_iter": 2, "random_state": seed}
    model = SDNNRegressor(coding, pairs="auto", **options).fit(frame, X[:60, 0])
    expected_model = SDNNRegressor(coding, pairs=model.pairs_, **options).fit(frame, X[:60, 0])
    assert model.codings_ == expected_model.codings_, "fitted to the whole column"
    np.testing.assert_array_equal(model.weights_, expected_model.weights_)


def test_features_of_many_samples_can_be_selected_with_a_column_of_a_single_value():
    # More than 5,000 samples select features by default, with a part of them that may lack the only
    # value of the last column.
    samples = np.random.RandomState(0).uniform(size=(5001, 3))
    targets = samples[:, 0].copy()
    samples[1:, 2] = np.nan
    options = {"n_pattern_units": 16, "max_iter": 1, "n_output_units": 10, "random_state": 0}
    assert SDNNRegressor(**options).fit(samples, targets).n_features_in_ == 3


def test_features_of_many_samples_can_be_selected_with_many_flipped_units():
    # More than 5,000 samples select features by default.
    samples = np.random.RandomState(0).uniform(size=(5001, 3))
    options = {"n_pattern_units": 100, "max_iter": 1, "n_output_units": 10, "random_state": 0}
    # The small networks that select have 64 units per pattern, too few to flip 50 of each sign.
    model = SDNNRegressor(RandomInverse(n_flipped=50), **options).fit(samples, samples[:, 0])
    assert model.codings_[0].n_flipped == 50


@pytest.mark.parametrize("seed", range(5))
def test_a_part_with_outliers_that_the_whole_has_not_can_select_pairs(seed):
    # A gap above 2 widths parts outliers from [0, 1]: below 3, if the 1.9 is held out.
    samples = X[:60, :3].copy()
    samples[:2, 2] = 1.9, 3.0
    model = SDNNRegressor(ranges="robust", out_of_range="error", pairs="auto", max_iter=1)
    assert model.set_params(random_state=seed).fit(samples, X[:60, 0]).n_inputs_out_of_range_ == 0


@pytest.mark.parametrize("options", [{"pairs": "auto"}, {"early_stopping": True}])
def test_the_weight_of_a_class_does_not_matter_where_the_class_is_held_out(options):
    labels = XOR[:38].copy()
    labels[0] = 2
    # The only sample of class 2 is last in the order of labels. "auto" holds out the samples in
    # places 2, 7, ..., 37, for each seed; early stopping a random tenth, now and then with it.
    for seed in range(12):
        model = SDNNClassifier(n_pattern_units=16, max_iter=1, class_weight={2: 3.0}, **options)
        assert model.set_params(random_state=seed).fit(X[:38, :3], labels).classes_.tolist() == [
            0,
            1,
            2,
        ]
