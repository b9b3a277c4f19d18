"""Calibration on held-out samples: probabilities of the classifier, intervals of the regressor."""

import math
import warnings
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pandas as pd
import pytest
from sklearn.base import clone
from sklearn.datasets import load_iris

from refusals import refuses
from sdnn import SDNNClassifier, SDNNRegressor
from sdnn.coding import RandomInverse, Symbolic
from sdnn.estimators import OutOfRangeWarning, classifier
from sdnn.estimators.calibration import held_out_fifth, learn_without_fifth
from sdnn.estimators.classifier import STEEPNESS
from sdnn.estimators.fitted import STEEPNESSES

OPTIONS = {"n_pattern_units": 40, "random_state": 0}
EARLY = {"early_stopping": True, "validation_fraction": 0.94}


def overlapping(n_samples=600, seed=0):
    """Return samples of two classes that overlap."""
    random = np.random.RandomState(seed)
    X = random.uniform(-1, 1, (n_samples, 3))
    return X, (X[:, 0] + X[:, 1] + 0.7 * random.normal(size=n_samples) > 0).astype(int)


def noisy(n_samples, seed=0):
    random = np.random.RandomState(seed)
    X = random.uniform(-1, 1, (n_samples, 2))
    return X, np.sin(3 * X[:, 0]) + X[:, 1] + 0.3 * random.normal(size=n_samples)


def log_loss(model, X, y):
    return -np.log(model.predict_proba(X)[np.arange(len(y)), y]).mean()


def test_a_fifth_of_each_class_is_held_out():
    labels = np.repeat([0, 1, 2], [50, 20, 5])
    seed = 3
    is_held = held_out_fifth(labels, True, seed)
    assert [int(is_held[labels == label].sum()) for label in range(3)] == [10, 4, 1]
    assert held_out_fifth(np.zeros(100), False, seed).sum() == 20, "of targets that are no labels"


def test_the_steepness_has_the_smallest_log_loss_on_the_held_out_fifth():
    points, labels = load_iris(return_X_y=True)
    plain = SDNNClassifier(**OPTIONS, calibrate=False).fit(points, labels)
    model = SDNNClassifier(**OPTIONS, calibrate=True).fit(points, labels)
    np.testing.assert_array_equal(model.weights_, plain.weights_)
    is_held = held_out_fifth(labels, True, model._weight_seed)
    # A network with the codings and pairs of the whole fit learns the other four fifths.
    without_fifth = clone(plain).set_params(
        random_state=model._weight_seed,
        coding=[(coding, [index]) for index, coding in enumerate(plain.codings_)],
        pairs=plain.pairs_,
    )
    without_fifth.fit(points[~is_held], labels[~is_held])
    # The decisions but for a constant of each sample, which does not change a softmax.
    scores = np.log(without_fifth.predict_proba(points[is_held])) / STEEPNESS

    def loss(steepness):
        raised = np.exp(steepness * (scores - scores.max(axis=1, keepdims=True)))
        probabilities = raised / raised.sum(axis=1, keepdims=True)
        logs = np.log(probabilities)
        of_labels = logs[np.arange(len(logs)), labels[is_held]]
        random = 0.5 / (0.5 + len(logs))  # the weight of half a sample of a random class
        return -((1 - random) * of_labels + random * logs.mean(axis=1)).mean()

    best = min(map(loss, np.geomspace(*STEEPNESSES, 1000)))
    np.testing.assert_allclose(loss(model.steepness_), best, rtol=1e-4)


def test_probabilities_of_a_calibrated_model_have_its_steepness_also_when_loaded(tmp_path):
    points, labels = load_iris(return_X_y=True)
    plain = SDNNClassifier(**OPTIONS, calibrate=False).fit(points, labels)
    model = SDNNClassifier(**OPTIONS, calibrate=True).fit(points, labels)
    raised = plain.predict_proba(points) ** (model.steepness_ / STEEPNESS)
    expected = raised / raised.sum(axis=1, keepdims=True)
    np.testing.assert_allclose(model.predict_proba(points), expected)
    np.testing.assert_array_equal(
        model.predict_proba_one(points[3]), model.predict_proba(points)[3]
    )
    model.save(tmp_path / "model")
    loaded = SDNNClassifier.load(tmp_path / "model")
    assert loaded.steepness_ == model.steepness_
    np.testing.assert_array_equal(loaded.predict_proba(points), model.predict_proba(points))


def test_calibration_lowers_the_loss_where_classes_overlap():
    X, y = overlapping()
    model = SDNNClassifier(**OPTIONS, calibrate=True).fit(X[:400], y[:400])
    plain = SDNNClassifier(**OPTIONS, calibrate=False).fit(X[:400], y[:400])
    assert log_loss(model, X[400:], y[400:]) < log_loss(plain, X[400:], y[400:]) - 0.02
    model.set_params(calibrate=False).fit(X[:400], y[:400])
    assert not hasattr(model, "steepness_")


def test_a_classifier_is_calibrated_by_default_where_a_fifth_can_be_held_out(monkeypatch):
    X, y = overlapping(60)
    default, calibrated = (
        SDNNClassifier(**OPTIONS, calibrate=calibrate).fit(X, y) for calibrate in (None, True)
    )
    assert default.steepness_ == calibrated.steepness_
    not_calibrated = [
        SDNNClassifier(**OPTIONS).fit(X[:9], y[:9]),
        SDNNClassifier(**OPTIONS, **EARLY).fit(X[:10], y[:10]),  # 94 % of 8 leave too few
        SDNNClassifier(**OPTIONS).fit(X, np.arange(60) % 29),  # 48 of 60 learn: below 2 * 29
        SDNNClassifier(**OPTIONS).fit(X[:12], np.arange(12)),  # classes of a single sample
        SDNNClassifier(**OPTIONS, n_units_per_class=1).fit(X, y),
        SDNNClassifier(**OPTIONS, warm_start=True).fit(X, y),
        SDNNClassifier(**OPTIONS).partial_fit(X, y, classes=[0, 1]),
    ]
    monkeypatch.setattr(classifier, "MOST_CALIBRATED", len(X) - 1)  # samples
    not_calibrated.append(SDNNClassifier(**OPTIONS).fit(X, y))
    assert not any(hasattr(model, "steepness_") for model in not_calibrated)


def test_only_the_network_of_the_selected_features_is_calibrated(monkeypatch):
    calibrated = []

    def record_and_learn(fitted, *samples, **options):
        calibrated.append(fitted)
        return learn_without_fifth(fitted, *samples, **options)

    monkeypatch.setattr(classifier, "learn_without_fifth", record_and_learn)
    model = SDNNClassifier(pairs="auto", **OPTIONS).fit(*overlapping(60))
    assert len(calibrated) == 1
    assert calibrated[0].pairs_ == model.pairs_


def test_the_second_network_repeats_no_warning_and_leaves_the_filters_of_warnings_alone():
    X, y = overlapping(60)
    before = list(warnings.filters)
    with ThreadPoolExecutor(4) as threads:
        list(threads.map(lambda _: SDNNClassifier(**OPTIONS).fit(X, y), range(8)))
    assert warnings.filters == before
    with pytest.warns(OutOfRangeWarning) as caught:
        SDNNClassifier(RandomInverse(low=-0.5, high=0.5), **OPTIONS).fit(X, y)
    assert len(caught) == 1


def test_calibration_uses_sample_weights_and_ignores_samples_of_weight_0():
    X, y = overlapping(200)
    # Fifty samples with the wrong class have weight 0.
    flipped = np.concatenate([y, 1 - y[:50]])
    weights = np.concatenate([np.ones(200), np.zeros(50)])
    model = SDNNClassifier(**OPTIONS, calibrate=True)
    model.fit(np.concatenate([X, X[:50]]), flipped, weights)
    assert model.steepness_ == clone(model).fit(X, y).steepness_
    random = np.random.RandomState(0).choice([1.0, 2.0], 200)
    assert model.fit(X, y, random).steepness_ != clone(model).fit(X, y).steepness_


def test_calibration_accepts_balanced_class_weights():
    X, y = overlapping(200)
    is_kept = (y == 1) | (np.arange(200) % 2 == 1)  # half of class 0 is left out
    model = SDNNClassifier(**OPTIONS, calibrate=True, class_weight="balanced")
    low, high = STEEPNESSES
    assert low <= model.fit(X[is_kept], y[is_kept]).steepness_ <= high


def test_categories_and_classes_that_occur_once_do_not_prevent_calibration():
    X, y = overlapping(60)
    table = pd.DataFrame(X, columns=["a", "b", "c"])
    table["word"] = ["rare", *["u", "v"] * 29, "other"]
    labels = np.array(["no", "yes", "once"])[np.where(np.arange(60) == 30, 2, y)]
    model = SDNNClassifier([(Symbolic(), ["word"])], **OPTIONS, calibrate=True)
    assert model.fit(table, labels).predict_proba(table).shape == (60, 3)
    numbers = SDNNRegressor([(Symbolic(), ["word"])], **OPTIONS, calibrate=True).fit(table, y * 1.0)
    assert numbers.predict_interval(table, 0.5).shape == (60, 2)


def test_calibration_with_selected_pairs_holds_out_a_fifth():
    X, y = overlapping(60)
    selected = SDNNRegressor(pairs="auto", **OPTIONS, calibrate=True).fit(X, y * 1.0)
    assert len(selected.held_out_counts_) == len(X) // 5


def test_intervals_of_the_regressor_contain_their_share_of_new_targets(tmp_path):
    X, y = noisy(1200)
    model = SDNNRegressor(**OPTIONS, calibrate=True).fit(X[:600], y[:600])
    plain = SDNNRegressor(**OPTIONS).fit(X[:600], y[:600])
    np.testing.assert_array_equal(model.predict(X), plain.predict(X))
    for coverage in (0.5, 0.9):
        bounds = model.predict_interval(X[600:], coverage)
        share = np.mean((bounds[:, 0] <= y[600:]) & (y[600:] <= bounds[:, 1]))
        assert abs(share - coverage) < 0.07
    sizes = np.sort(np.abs(model.held_out_residuals_[:, 0]))
    rank = math.ceil(0.9 * (len(sizes) + 1))
    half_widths = np.diff(model.predict_interval(X, 0.9), axis=1) / 2
    np.testing.assert_allclose(half_widths, sizes[rank - 1], rtol=1e-9)  # the held-out error
    model.save(tmp_path / "model")
    loaded = SDNNRegressor.load(tmp_path / "model")
    np.testing.assert_array_equal(loaded.predict_interval(X), model.predict_interval(X))


def test_several_outputs_have_separate_intervals_and_samples_of_weight_0_are_not_held_out():
    X, y = noisy(100)
    model = SDNNRegressor(**OPTIONS, calibrate=True).fit(X, np.stack([y, 10 * y], axis=1))
    bounds = model.predict_interval(X, 0.6)
    assert bounds.shape == (100, 2, 2)  # samples, lower and upper bound, outputs
    weights = np.tile([1.0, 2.0, 0.0, 1.0], 25)
    weighted = SDNNRegressor(**OPTIONS, calibrate=True).fit(X, y, weights)
    assert set(weighted.held_out_counts_) <= {1.0, 2.0}
    assert len(weighted.held_out_counts_) == np.count_nonzero(weights) // 5
    assert weighted.predict_interval(X[:2]).shape == (2, 2)


def test_calibration_refuses_single_units_few_samples_and_a_warm_start():
    X, y = noisy(40)
    for options in ({"n_units_per_class": 1}, {"scheme": "one_vs_one"}):
        refuses("calibrate", SDNNClassifier(**options, calibrate=True).fit, X, y > 0)
    refuses("calibrate", SDNNRegressor(calibrate=True).fit, X[:9], y[:9])
    refuses("calibrate", SDNNRegressor(calibrate=True, warm_start=True).fit, X, y)


def test_intervals_need_a_calibration_and_enough_held_out_samples():
    X, y = noisy(40)
    plain = SDNNRegressor(**OPTIONS).fit(X, y)
    refuses("calibrate", plain.predict_interval, X, error=AttributeError)
    model = SDNNRegressor(**OPTIONS, calibrate=True).fit(X, y)
    refuses("coverage", model.predict_interval, X, 0.95)  # the 8 held-out errors allow 8 / 9
    refuses("coverage", model.predict_interval, X, 1.0)


@pytest.mark.parametrize(
    ("name", "wrong"),
    [
        ("held_out_residuals_", np.zeros((3, 1))),  # a fifth of 40 samples is 8
        ("held_out_residuals_", np.full((8, 1), np.nan)),
        ("held_out_counts_", np.zeros(8)),
        ("held_out_counts_", np.ones(8, np.float32)),
    ],
)
def test_files_with_impossible_held_out_errors_are_refused(name, wrong, tmp_path):
    damaged = SDNNRegressor(**OPTIONS, calibrate=True).fit(*noisy(40))
    setattr(damaged, name, wrong)
    damaged.save(tmp_path / "damaged")
    refuses("held-out", SDNNRegressor.load, tmp_path / "damaged")


@pytest.mark.parametrize("steepness", [0.0, STEEPNESSES[1] + 1, float("nan")])
def test_files_with_a_steepness_out_of_range_are_refused(steepness, tmp_path):
    X, y = noisy(40)
    damaged = SDNNClassifier(**OPTIONS, calibrate=True).fit(X, y > 0)
    damaged.steepness_ = steepness
    damaged.save(tmp_path / "damaged")
    refuses("steepness_", SDNNClassifier.load, tmp_path / "damaged")


def test_classes_of_single_samples_or_of_weight_0_cannot_be_calibrated():
    X, _ = noisy(60)
    refuses("calibrate", SDNNClassifier(calibrate=True).fit, X[:12], np.arange(12))
    labels = np.r_[0, np.ones(59, int)]  # the only sample of class 0 is never held out
    model = SDNNClassifier(**OPTIONS, calibrate=True, class_weight={0: 1, 1: 0})
    refuses("calibrate", model.fit, X, labels)


def test_online_learning_cannot_begin_with_calibration():
    X, y = noisy(20)
    for method, sample in (("partial_fit", (X, y)), ("learn_one", (X[0], y[0]))):
        model = SDNNRegressor(**OPTIONS, calibrate=True)
        refuses("calibrate", getattr(model, method), *sample)
        model.fit(X, y)
        getattr(model, method)(*sample)
        refuses("calibrate", model.predict_interval, X, error=AttributeError)  # of an older network


class OnlyArray:
    """Becomes an array, and has no indices."""

    def __init__(self, values):
        self.values, self.shape = values, values.shape

    def __array__(self, dtype=None, copy=None):
        return self.values

    def __len__(self):
        return len(self.values)


def test_samples_may_be_anything_that_becomes_an_array():
    X, y = noisy(30)
    model = SDNNRegressor(**OPTIONS, calibrate=True)
    weights = np.r_[0.0, np.ones(29)]
    for arguments in ((y,), (y, weights)):
        expected = clone(model).fit(X, *arguments).held_out_residuals_
        residuals = clone(model).fit(OnlyArray(X), *arguments).held_out_residuals_
        assert np.array_equal(residuals, expected)
