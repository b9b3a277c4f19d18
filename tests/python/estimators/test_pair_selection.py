"""Which features and pairs matter, and leaving out the others."""

import itertools

import numpy as np
import pandas as pd
import pytest
from sklearn.exceptions import NotFittedError
from sklearn.feature_selection import RFE

from refusals import refuses
from sdnn import SDNNClassifier, SDNNRegressor, _core
from sdnn.coding import CorrelationMatrix, Symbolic, WithMissing
from sdnn.estimators import plot_importances

X = np.random.RandomState(0).uniform(size=(600, 8))
XOR = ((X[:, 2] > 0.5) ^ (X[:, 5] > 0.5)).astype(int)
OPTIONS = {"n_pattern_units": 60, "random_state": 0, "max_iter": 10}


def test_importances_are_squared_changes_of_weights():
    model = SDNNRegressor(**OPTIONS, n_output_units=20).fit(X, XOR)
    network = model.network_
    seeds = np.random.RandomState(0).randint(2**31 - 1, size=2)
    begun = _core.ParallelPerceptron(network.input_code.core, 20, seed=int(seeds[1])).weights
    change = (model.weights_ - begun).astype(float)
    expected = [(change[:, 60 * p : 60 * (p + 1)] ** 2).sum() for p in range(len(model.pairs_))]
    np.testing.assert_allclose(model.pair_importances_, expected / np.sum(expected))
    best = np.argsort(model.pair_importances_)[-2:]
    assert {frozenset(model.pairs_[place]) for place in best} == {frozenset((2, 5))}


def test_the_pair_that_matters_is_selected():
    options = {**OPTIONS, "n_units_per_class": 10}
    every = SDNNClassifier(**options).fit(X[:300], XOR[:300])
    auto = SDNNClassifier(**options, pairs="auto").fit(X[:300], XOR[:300])
    assert set(auto.pairs_) == {(2, 5), (5, 2)}
    assert auto.score(X[300:], XOR[300:]) > max(0.95, every.score(X[300:], XOR[300:]))
    given = SDNNClassifier(**options, pairs=[(2, 5), (5, 2)]).fit(X[:300], XOR[:300])
    np.testing.assert_array_equal(auto.weights_, given.weights_)


def test_useless_features_are_left_out():
    random = np.random.RandomState(1)
    wide = random.uniform(size=(500, 40))
    y = 10 * np.sin(np.pi * wide[:, 3] * wide[:, 17]) + 5 * wide[:, 30]
    model = SDNNRegressor(random_state=0, pairs="auto").fit(wide[:300], y[:300])
    kept = {feature for pair in model.pairs_ for feature in pair}
    assert {3, 17, 30} <= kept
    assert len(kept) <= 5
    budget = SDNNRegressor(random_state=0).fit(wide[:300], y[:300])
    assert model.score(wide[300:], y[300:]) > budget.score(wide[300:], y[300:]) + 0.1
    assert np.flatnonzero(model.feature_importances_).tolist() == sorted(kept)


def test_all_pairs_stay_where_all_matter():
    points = X[:300, :4]
    y = sum(np.sin(4 * points[:, i]) * points[:, j] for i, j in itertools.permutations(range(4), 2))
    options = {**OPTIONS, "n_output_units": 100}
    model = SDNNRegressor(**options, pairs="auto").fit(points, y)
    assert len(model.pairs_) == 12
    np.testing.assert_array_equal(model.weights_, SDNNRegressor(**options).fit(points, y).weights_)


@pytest.mark.parametrize("kind", [SDNNRegressor, SDNNClassifier])
def test_few_samples_and_single_features_select_nothing(kind):
    assert len(kind(**OPTIONS, pairs="auto").fit(X[:8], XOR[:8]).pairs_) == 56
    assert kind(**OPTIONS, pairs="auto").fit(X[:, :1], XOR).pairs_ == ((0, 0),)


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
def test_a_category_may_occur_once(name):
    frame = pd.DataFrame({"a": X[:, 0], "letter": LETTERS, "b": X[:, 5], "c": X[:, 6]})[:100]
    codings = [(CATEGORIES[name], ["letter"]), ("anchor", ["c"])]
    model = SDNNRegressor(codings, pairs="auto", **OPTIONS).fit(frame, X[:100, 2] + X[:100, 5])
    given = SDNNRegressor(codings, pairs=model.pairs_, **OPTIONS)
    given.fit(frame, X[:100, 2] + X[:100, 5])
    assert model.coding == codings
    assert model.codings_ == given.codings_
    np.testing.assert_array_equal(model.weights_, given.weights_)


@pytest.mark.parametrize("n_rare", [1, 3])
def test_a_class_may_occur_once(n_rare):
    labels = np.repeat([0, 1], [40 - n_rare, n_rare])
    model = SDNNClassifier(**OPTIONS, n_units_per_class=4, pairs="auto").fit(X[:40, :3], labels)
    assert set(model.pairs_) <= {(0, 1), (1, 0), (0, 2), (2, 0), (1, 2), (2, 1)}
    rest = XOR[:40].copy()
    rest[0] = 2
    model = SDNNClassifier(**OPTIONS, pairs="auto", correction_share=1.0).fit(X[:40, :3], rest)
    assert model.score(X[:1, :3], [2]) == 1


def test_features_that_do_not_matter_are_eliminated():
    wrapped = RFE(SDNNClassifier(**OPTIONS, n_units_per_class=10), n_features_to_select=2)
    wrapped.fit(X, XOR)
    assert np.flatnonzero(wrapped.support_).tolist() == [2, 5]


def test_importances_of_features_are_means_over_their_pairs():
    model = SDNNClassifier(**OPTIONS, pairs=[(0, 1), (1, 0), (2, None)]).fit(X[:, :4], XOR)
    one, other, plain = model.pair_importances_
    means = np.array([(one + other) / 2, (one + other) / 2, plain, 0.0])
    np.testing.assert_allclose(model.feature_importances_, means / means.sum())
    with pytest.raises(NotFittedError):
        _ = SDNNClassifier().feature_importances_


def test_pairs_have_the_names_that_they_are_given_by():
    frame = pd.DataFrame(X[:, :3], columns=["a", "b", "c"])
    pairs = [("a", "b"), ("c", None)]
    model = SDNNClassifier(**OPTIONS, pairs=pairs).fit(frame, XOR)
    assert model.pair_names_ == pairs
    assert SDNNClassifier(**OPTIONS, pairs=[(0, 1), (2, None)]).fit(X, XOR).pair_names_ == [
        (0, 1), (2, None),
    ]  # fmt: skip


def test_the_most_important_features_and_pairs_are_drawn():
    frame = pd.DataFrame(X, columns=list("abcdefgh"))
    features, pairs = plot_importances(SDNNClassifier(**OPTIONS).fit(frame, XOR), 5).axes
    for axes, n_bars, first in ((features, 5, {"c", "f"}), (pairs, 5, {"c x f"})):
        assert len(axes.patches) == n_bars
        labels = [label.get_text() for label in axes.get_yticklabels()]
        assert set(labels[: len(first)]) == first
    refuses("n_most", plot_importances, SDNNClassifier(**OPTIONS).fit(frame, XOR), 0)
    with pytest.raises(TypeError, match="model"):
        plot_importances(RFE(SDNNClassifier()))
    with pytest.raises(NotFittedError):
        plot_importances(SDNNClassifier())


def test_importances_survive_files(tmp_path):
    model = SDNNClassifier(**OPTIONS, n_units_per_class=4).fit(X, XOR)
    path = tmp_path / "model.safetensors"
    model.save(path)
    same = SDNNClassifier.load(path)
    np.testing.assert_array_equal(same.pair_importances_, model.pair_importances_)


def test_a_single_class_is_a_clear_error():
    X = np.random.RandomState(0).uniform(size=(60, 3))
    refuses("classes", SDNNClassifier(pairs="auto", max_iter=2).fit, X, np.zeros(60))
