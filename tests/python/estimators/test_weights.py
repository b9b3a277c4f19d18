"""Weights of samples and classes: mean numbers of presentations in an epoch."""

import numpy as np
import pytest
from sklearn.ensemble import AdaBoostClassifier

from refusals import refuses
from sdnn import SDNNClassifier, SDNNRegressor
from sdnn.coding import RandomInverse
from sdnn.estimators.training import sample_weights

RANDOM = np.random.RandomState(0)
X = RANDOM.uniform(0, 1, (150, 2))
Y = np.sin(5 * X[:, 0]) * X[:, 1]
LABELS = np.digitize(Y, [-0.3, 0.3])
UNIT = RandomInverse(low=0.0, high=1.0, length_scale=0.2)
SETTINGS = {"coding": UNIT, "n_pattern_units": 128, "random_state": 3}


def assert_equal_weights(model, expected):
    np.testing.assert_array_equal(model.weights_, expected.weights_)
    np.testing.assert_array_equal(model.thresholds_, expected.thresholds_)


def test_class_weights_are_numbers_of_presentations():
    rare = (Y > 0.6).astype(int)
    assert 0 < rare.sum() < 20
    options = {**SETTINGS, "shuffle": False, "max_iter": 4}
    weighted = SDNNClassifier(**options, class_weight={0: 1, 1: 3}).fit(X, rare)
    repeated = SDNNClassifier(**options)
    n_times = np.where(rare == 1, 3, 1)
    for _ in range(weighted.n_iter_):
        repeated.partial_fit(np.repeat(X, n_times, axis=0), np.repeat(rare, n_times), [0, 1])
    assert_equal_weights(weighted, repeated)


def test_balanced_class_weights_predict_the_rare_class_more_often():
    random_labels = np.where(RANDOM.uniform(size=len(Y)) < 0.2, 1, 0)  # class 1 is rare
    options = {**SETTINGS, "max_iter": 8}
    plain = SDNNClassifier(**options).fit(X, random_labels)
    balanced = SDNNClassifier(**options, class_weight="balanced").fit(X, random_labels)
    assert balanced.predict(X).mean() > plain.predict(X).mean()


def test_invalid_class_weights_and_those_of_online_learning_are_refused():
    rare = (Y > 0.6).astype(int)
    for bad in ({0: -1, 1: 1}, {0: np.nan}, "even"):
        refuses("class_weight", SDNNClassifier(class_weight=bad).fit, X, rare)
    refuses(
        "class_weight", SDNNClassifier(class_weight="balanced").partial_fit, X, rare, classes=[0, 1]
    )
    balanced = SDNNClassifier(**SETTINGS, class_weight="balanced", max_iter=1).fit(X, rare)
    refuses("class_weight", balanced.learn_one, X[0], 1)


@pytest.mark.parametrize("make", [SDNNRegressor, SDNNClassifier])
def test_integer_sample_weights_equal_repeated_samples(make):
    times = np.arange(len(Y)) % 3
    targets = Y if make is SDNNRegressor else LABELS
    plain = make(**SETTINGS, max_iter=3).fit(X, targets)
    assert_equal_weights(plain, make(**SETTINGS, max_iter=3).fit(X, targets, np.ones(len(Y))))
    options = SETTINGS | ({"output_range": (-10, 10)} if make is SDNNRegressor else {})
    weighted = make(**options, max_iter=3).fit(X, targets, times)
    repeated = make(**options, max_iter=3).fit(X.repeat(times, 0), targets.repeat(times))
    assert_equal_weights(weighted, repeated)
    assert (weighted.weights_ != plain.weights_).any()


@pytest.mark.parametrize("make", [SDNNRegressor, SDNNClassifier])
def test_sample_weights_are_scaled_to_a_mean_of_one(make):
    targets = Y if make is SDNNRegressor else LABELS
    weights = RANDOM.uniform(0.5, 1.5, len(Y))
    model = make(**SETTINGS, max_iter=3).fit(X, targets, weights / weights.sum())
    assert_equal_weights(
        model, make(**SETTINGS, max_iter=3).fit(X, targets, weights / weights.mean())
    )


def test_adaboost_boosts_classifiers_by_sample_weights():
    boosted = AdaBoostClassifier(SDNNClassifier(**SETTINGS, max_iter=3), n_estimators=2)
    assert boosted.fit(X, Y > 0).score(X, Y > 0) > 0.9


def test_sample_and_class_weights_are_multiplied():
    options = {**SETTINGS, "max_iter": 4}
    labels = (Y > 0).astype(int)
    model = SDNNClassifier(**options, class_weight={0: 2, 1: 1})
    model.fit(X, labels, sample_weight=np.full(len(Y), 0.5))
    products = np.where(labels == 0, 2 * 0.5, 1 * 0.5)
    assert_equal_weights(model, SDNNClassifier(**options).fit(X, labels, products))


def test_sample_weights_apply_to_early_stopping_and_selection_of_pairs():
    is_heavy = X[:, 0] > 0.5
    weights = np.where(is_heavy, 1.0, 1e-3)
    wrong = np.where(is_heavy, Y, 5.0)  # targets of small weight are wrong
    options = {**SETTINGS, "early_stopping": True, "max_iter": 20, "n_iter_no_change": 20}
    refitted = SDNNRegressor(**options, refit=True).fit(X, wrong, weights)
    assert refitted.score(X[is_heavy], Y[is_heavy]) > 0.9 > refitted.score(X, wrong)
    selected = SDNNRegressor(**SETTINGS, pairs="auto", max_iter=3).fit(X, wrong, weights)
    assert set(selected.pairs_) == {(0, 1), (1, 0)}


@pytest.mark.parametrize("make", [SDNNRegressor, SDNNClassifier])
@pytest.mark.parametrize(
    "bad",
    [
        np.ones(3), np.ones((len(Y), 1)), np.full(len(Y), -1), np.full(len(Y), np.nan),
        np.full(len(Y), 1e7), np.zeros(len(Y)), "heavy",
    ],
)  # fmt: skip
def test_invalid_sample_weights_are_refused(make, bad):
    model = make(**SETTINGS)
    refuses("sample_weight", model.fit, X, Y if make is SDNNRegressor else LABELS, bad)
    assert not hasattr(model, "network_")


def test_sample_weights_with_too_many_presentations_are_refused():
    n_samples = 1000  # a billion presentations in an epoch
    refuses("sample_weight", sample_weights, np.full(n_samples, 1e6), n_samples)


def test_training_with_fractional_weights_ends_after_epochs_without_corrections():
    easy = (X[:, 0] > 0.5).astype(int)
    model = SDNNClassifier(**SETTINGS, n_units_per_class=1, class_weight={0: 0.25, 1: 1})
    model.fit(X, easy)
    assert model.n_iter_ < 100
    # A sample of weight 0.25 is presented in every fourth epoch: all are right after four.
    assert model.n_corrected_[-4:].tolist() == [0, 0, 0, 0]
    assert model.score(X, easy) == 1
