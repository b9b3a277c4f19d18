"""Which pairs matter, and leaving out the others."""

import itertools

import numpy as np
import pytest

from sdnn import SDNNClassifier, SDNNRegressor, _core

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


def test_importances_survive_files(tmp_path):
    model = SDNNClassifier(**OPTIONS, n_units_per_class=4).fit(X, XOR)
    path = tmp_path / "model.safetensors"
    model.save(path)
    same = SDNNClassifier.load(path)
    np.testing.assert_array_equal(same.pair_importances_, model.pair_importances_)
