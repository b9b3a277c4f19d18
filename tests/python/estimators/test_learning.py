"""Learning of the estimators: epochs, options, schemes of classes, and outputs."""

import itertools

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from sklearn.datasets import load_iris
from sklearn.multioutput import MultiOutputClassifier

from refusals import refuses
from sdnn import SDNNClassifier, SDNNRegressor
from sdnn.coding import Circular, RandomInverse
from sdnn.estimators import OutOfRangeWarning
from sdnn.estimators.classifier import MOST_UNITS, STEEPNESS, UNITS_EACH
from sdnn.estimators.network import code_bytes

RANDOM = np.random.RandomState(0)
X = RANDOM.uniform(0, 1, (150, 2))
Y = np.sin(5 * X[:, 0]) * X[:, 1]
LABELS = np.digitize(Y, [-0.3, 0.3])

UNIT = RandomInverse(low=0.0, high=1.0, length_scale=0.2)
SETTINGS = {"coding": UNIT, "n_pattern_units": 128, "random_state": 3}
REGRESSOR = {**SETTINGS, "output_range": (-1.5, 1.5), "n_output_units": 60}


def assert_equal_weights(model, expected):
    np.testing.assert_array_equal(model.weights_, expected.weights_)
    np.testing.assert_array_equal(model.thresholds_, expected.thresholds_)


def test_a_smooth_function_is_learned_with_r2_above_097():
    model = SDNNRegressor(UNIT, max_iter=300, random_state=0).fit(X, Y)
    assert model.score(X, Y) > 0.999
    fresh = np.random.RandomState(1).uniform(0.05, 0.95, (500, 2))
    assert model.score(fresh, np.sin(5 * fresh[:, 0]) * fresh[:, 1]) > 0.97


@pytest.mark.parametrize("scheme", ["one_vs_rest", "one_vs_one"])
def test_iris_is_learned_without_training_errors(scheme):
    points, labels = load_iris(return_X_y=True)
    model = SDNNClassifier(scheme=scheme, n_pattern_units=256, max_iter=100, random_state=0)
    model.fit(points[::2], labels[::2])
    assert model.score(points[::2], labels[::2]) == 1
    assert model.score(points[1::2], labels[1::2]) > 0.9
    assert model.n_corrected_[-1] == 0
    assert model.n_iter_ < 100


@settings(max_examples=20, deadline=None)
@given(st.lists(st.integers(1, 20), min_size=1, max_size=6), st.booleans())
def test_partial_fit_in_any_portions_equals_one_epoch_of_fit(portions, regression):
    n = sum(portions)
    bounds = np.cumsum([0, *portions])
    if regression:
        whole = SDNNRegressor(**REGRESSOR, max_iter=1, shuffle=False).fit(X[:n], Y[:n])
        parts = SDNNRegressor(**REGRESSOR)
        for a, b in itertools.pairwise(bounds):
            parts.partial_fit(X[a:b], Y[a:b])
    else:
        classes = np.arange(3)
        y = LABELS[:n].copy()
        y[:3] = classes[:n]  # `fit` needs a sample of each class
        whole = SDNNClassifier(**SETTINGS).partial_fit(X[:n], y, classes=classes)
        if n >= 3:
            assert_equal_weights(
                whole, SDNNClassifier(**SETTINGS, max_iter=1, shuffle=False).fit(X[:n], y)
            )
        parts = SDNNClassifier(**SETTINGS)
        for a, b in itertools.pairwise(bounds):
            parts.partial_fit(X[a:b], y[a:b], classes=classes)
    assert_equal_weights(whole, parts)
    assert parts.n_iter_ == len(portions)


def test_epochs_of_fit_equal_passes_of_partial_fit():
    fitted = SDNNRegressor(**REGRESSOR, max_iter=4, shuffle=False).fit(X, Y)
    online = SDNNRegressor(**REGRESSOR)
    for _ in range(4):
        for x, y in zip(X, Y, strict=True):
            online.partial_fit([x], [y])
    assert_equal_weights(fitted, online)
    online.partial_fit(X, Y)
    assert_equal_weights(SDNNRegressor(**REGRESSOR, max_iter=5, shuffle=False).fit(X, Y), online)


both_estimators = pytest.mark.parametrize(
    ("estimator", "options", "targets"),
    [(SDNNRegressor, REGRESSOR, Y), (SDNNClassifier, {**SETTINGS, "n_units_per_class": 8}, LABELS)],
)


@both_estimators
def test_a_warm_start_of_3_after_2_epochs_equals_5_epochs(estimator, options, targets):
    model = estimator(**options, shuffle=False, warm_start=True, max_iter=2).fit(X, targets)
    first, weights = model.network_, model.weights_
    assert model.set_params(max_iter=3).fit(X, targets).n_iter_ == 3
    assert_equal_weights(model, estimator(**options, shuffle=False, max_iter=5).fit(X, targets))
    np.testing.assert_array_equal(first.layer.weights, weights, "the first network was changed")


@both_estimators
def test_a_warm_start_that_is_refused_keeps_the_weights(estimator, options, targets):
    model = estimator(**options, warm_start=True, max_iter=2).fit(X, targets)
    before = model.weights_
    model.set_params(max_iter=1, training="dual", memory_limit=100)
    refuses("memory_limit", model.fit, X, targets)
    np.testing.assert_array_equal(model.weights_, before)


def test_a_warm_start_refuses_other_features_outputs_and_classes():
    model = SDNNRegressor(**REGRESSOR, warm_start=True).fit(X, Y)
    refuses("features", model.fit, X[:, :1], Y)
    refuses("outputs", model.fit, X, np.column_stack([Y, Y]))
    refuses("refit", model.set_params(refit=True).fit, X, Y)
    labels = SDNNClassifier(**SETTINGS, warm_start=True).fit(X[:, :1], LABELS > 0)
    refuses("classes", labels.fit, X[:, :1], np.full(len(X), 5))


def test_multi_output_classification_is_learned():
    labels = np.column_stack([LABELS, (X[:, 0] > 0.5).astype(int)])
    model = MultiOutputClassifier(SDNNClassifier(**SETTINGS, max_iter=50)).fit(X, labels)
    assert (model.predict(X) == labels).mean() > 0.95


def test_partial_fit_refuses_unknown_ranges_classes_and_outputs():
    refuses("minimum", SDNNRegressor(coding=UNIT).partial_fit, X[:1], Y[:1])
    model = SDNNClassifier(**SETTINGS)
    refuses("classes", model.partial_fit, X, LABELS)
    refuses("classes", model.partial_fit, X, LABELS, classes=[0, 1])
    assert not hasattr(model, "network_"), "a refused first call leaves nothing behind"
    model.partial_fit(X, LABELS, classes=[0, 1, 2])
    refuses("classes", model.partial_fit, X, LABELS, classes=[0, 1, 2, 3])
    refuses("[7]", model.partial_fit, X[:1], [7])
    regressor = SDNNRegressor(**REGRESSOR).partial_fit(X, Y)
    refuses("outputs", regressor.partial_fit, X, np.stack([Y, Y], axis=1))


def test_one_sample_can_be_learned_if_all_ranges_are_fixed():
    listed = [(UNIT, 0), (Circular(period=1.0), [1])]
    model = SDNNRegressor(coding=listed, output_range=(-3, 3), n_pattern_units=64)
    model.partial_fit(X[:1], Y[:1])
    assert model.n_iter_ == 1
    model.set_params(coding=listed[:1])
    refuses("ranges", model.fit, X[:1], Y[:1])
    model.set_params(coding=listed, output_range=None)
    refuses("output_range", model.fit, X[:1], Y[:1])


def test_several_outputs_are_learned_independently():
    targets = np.stack([Y, 3 - 2 * X[:, 0]], axis=1)
    model = SDNNRegressor(UNIT, n_pattern_units=256, max_iter=100, random_state=0)
    model.fit(X, targets)
    assert model.n_outputs_ == 2
    assert model.predict(X).shape == (150, 2)
    assert model.score(X, targets) > 0.99
    assert model.output_range_.shape == (2, 2)


def test_a_target_of_one_column_is_learned_like_a_vector_and_keeps_its_shape():
    column = SDNNRegressor(**REGRESSOR, max_iter=2).fit(X, Y[:, None])
    assert column.predict(X).shape == (150, 1)
    assert_equal_weights(column, SDNNRegressor(**REGRESSOR, max_iter=2).fit(X, Y))


def test_predictions_are_multiples_of_a_step_within_the_output_range():
    model = SDNNRegressor(**REGRESSOR, max_iter=20, n_averaged_epochs=1).fit(X, Y)
    counts = (model.predict(X) + 1.5) / (3 / 60)  # of 60 units, over the range from -1.5 to 1.5
    np.testing.assert_allclose(counts, np.round(counts), atol=1e-9)


def test_targets_above_the_output_range_are_counted_and_clipped():
    with pytest.warns(OutOfRangeWarning, match="range"):
        far = SDNNRegressor(**REGRESSOR, max_iter=20).fit(X, Y + 100)
    assert far.predict(X).max() == pytest.approx(1.5)
    assert far.n_outputs_out_of_range_ == len(X)


@pytest.mark.parametrize("estimator", [SDNNRegressor, SDNNClassifier])
def test_early_stopping_restores_the_weights_of_the_best_epoch(estimator):
    targets = Y + RANDOM.normal(0, 0.3, len(Y)) if estimator is SDNNRegressor else LABELS
    options = {"coding": UNIT, "n_pattern_units": 128, "random_state": 1, "shuffle": False}
    model = estimator(**options, early_stopping=True, n_iter_no_change=4, max_iter=60)
    model.fit(X, targets)
    best = int(np.argmax(model.validation_scores_))
    assert model.n_iter_ == len(model.validation_scores_) <= 60
    up_to_best = estimator(**options, early_stopping=True, n_iter_no_change=4, max_iter=best + 1)
    assert_equal_weights(model, up_to_best.fit(X, targets))
    refuses("early", estimator(early_stopping=True, validation_fraction=0.9).fit, X[:2], [0, 1])


@pytest.mark.parametrize(
    ("scheme", "n_units_each"), [("one_vs_rest", 1), ("one_vs_rest", 20), ("one_vs_one", 1)]
)
@pytest.mark.parametrize("n_classes", [2, 4])
def test_the_predicted_class_has_the_largest_decision(scheme, n_units_each, n_classes):
    labels = np.digitize(Y, np.quantile(Y, np.arange(1, n_classes) / n_classes))
    options = {**SETTINGS, "scheme": scheme, "n_units_per_class": n_units_each, "max_iter": 1}
    model = SDNNClassifier(**options).fit(X, labels)
    decision = model.decision_function(X)
    if n_classes == 2:
        assert decision.shape == (150,)
        np.testing.assert_array_equal(model.predict(X), (decision > 0).astype(int))
    else:
        assert decision.shape == (150, n_classes)
        np.testing.assert_array_equal(model.predict(X), decision.argmax(axis=1))
    n_units = n_classes if scheme == "one_vs_rest" else n_classes * (n_classes - 1) // 2
    assert len(model.thresholds_) == n_units * n_units_each


def test_one_versus_one_decisions_are_rounded_votes():
    labels = np.digitize(Y, [-0.3, 0.1, 0.3])
    model = SDNNClassifier(**SETTINGS, scheme="one_vs_one", max_iter=1).fit(X, labels)
    potentials = model.network_.potentials(model.network_.input_code.bins(X), 1)
    pairs = [(i, j) for i in range(4) for j in range(i + 1, 4)]
    votes = np.zeros((len(X), 4))
    for unit, (i, j) in enumerate(pairs):
        votes[:, i] += potentials[:, unit] > 0
        votes[:, j] += potentials[:, unit] <= 0
    np.testing.assert_array_equal(np.round(model.decision_function(X)), votes)


@pytest.mark.parametrize("random_state", [0, 1, 2])
def test_many_units_per_class_learn_a_parity_that_one_unit_cannot(random_state):
    points = np.random.RandomState(0).uniform(size=(2000, 3))
    parity = (points > 0.5).sum(axis=1) % 2
    options = {"random_state": random_state, "n_pattern_units": 1000}
    several = SDNNClassifier(**options).fit(points[:1000], parity[:1000])
    assert several.score(points[1000:], parity[1000:]) >= 0.95
    single = SDNNClassifier(**options, n_units_per_class=1, max_iter=20)
    assert single.fit(points[:1000], parity[:1000]).score(points[1000:], parity[1000:]) < 0.6


def test_decisions_are_shares_of_active_units_and_probabilities_their_softmax():
    options = {**SETTINGS, "n_units_per_class": 12, "n_averaged_epochs": 1}
    model = SDNNClassifier(**options, calibrate=False).fit(X, LABELS)
    firing = model.network_.potentials(model.network_.input_code.bins(X), 1) > 0
    shares = firing.reshape(len(X), 3, 12).mean(axis=2)  # of 12 units for each of 3 classes
    np.testing.assert_array_equal(model.decision_function(X), shares)
    raised = np.exp(STEEPNESS * shares)
    np.testing.assert_allclose(
        model.predict_proba(X), raised / raised.sum(axis=1, keepdims=True), rtol=1e-12
    )
    np.testing.assert_array_equal(model.predict(X), model.predict_proba(X).argmax(axis=1))


def test_the_default_number_of_units_per_class_falls_with_the_classes():
    # UNITS_EACH for each class, but MOST_UNITS divided by the number of classes if that is less.
    assert len(SDNNClassifier(**SETTINGS).fit(X, LABELS).thresholds_) == 3 * UNITS_EACH
    many = np.arange(len(X)) % 75
    n_units = 75 * (MOST_UNITS // 75)
    assert len(SDNNClassifier(**SETTINGS, max_iter=1).fit(X, many).thresholds_) == n_units


def test_single_units_and_one_versus_one_have_no_probabilities():
    of_pairs = SDNNClassifier(**SETTINGS, scheme="one_vs_one", max_iter=1).fit(X, LABELS)
    assert len(of_pairs.thresholds_) == 3  # a unit for each pair of three classes
    assert not hasattr(of_pairs, "predict_proba")
    assert not hasattr(SDNNClassifier(n_units_per_class=1), "predict_proba")
    refuses("one_vs_one", SDNNClassifier(scheme="one_vs_one", n_units_per_class=5).fit, X, LABELS)


NOISY = Y + np.random.RandomState(1).normal(0, 0.5, len(Y))
AVERAGED = {**REGRESSOR, "shuffle": False, "output_range": (-3, 3)}


def test_predictions_average_the_networks_of_three_epochs():
    model = SDNNRegressor(**AVERAGED, max_iter=11, n_averaged_epochs=3).fit(X, NOISY)
    predictions = [
        SDNNRegressor(**AVERAGED, max_iter=n, n_averaged_epochs=1).fit(X, NOISY).predict(X)
        for n in (6, 9, 11)  # the last epoch, and each third one before
    ]
    means, spread = model.predict(X, return_std=True)
    np.testing.assert_allclose(means, np.mean(predictions, axis=0), atol=1e-12)
    np.testing.assert_allclose(spread, np.std(predictions, axis=0), atol=1e-12)
    assert spread.max() > 0
    assert model.predict_one(X[3]) == means[3]


def test_a_saved_model_keeps_all_averaged_networks(tmp_path):
    model = SDNNRegressor(**AVERAGED, max_iter=11, n_averaged_epochs=3).fit(X, NOISY)
    model.save(tmp_path / "model.safetensors")
    loaded = SDNNRegressor.load(tmp_path / "model.safetensors")
    np.testing.assert_array_equal(loaded.predict(X), model.predict(X))


def test_online_learning_continues_with_the_last_of_averaged_networks():
    model = SDNNRegressor(**AVERAGED, max_iter=11, n_averaged_epochs=3).fit(X, NOISY)
    plain = SDNNRegressor(**AVERAGED, max_iter=11, n_averaged_epochs=1).fit(X, NOISY)
    assert_equal_weights(model.learn_one(X[0], Y[0]), plain.learn_one(X[0], Y[0]))
    assert model.predict(X, return_std=True)[1].max() == 0, "a single network has no spread"


def test_averaged_networks_count_towards_the_memory_limit():
    unaveraged = {**REGRESSOR, "output_range": (-3, 3)}
    model = SDNNRegressor(**unaveraged, max_iter=2).fit(X, Y)
    weight_bytes = 4 * model.weights_.size
    table_bytes = code_bytes(model.codings_, model.pairs_, model.network_.input_code.core.n_units)
    options = {**unaveraged, "n_averaged_epochs": 5}
    # Every third epoch is averaged: the last of 16 and four before it, of 9 only two. Early
    # stopping keeps four before the best epoch as well, unless it refits.
    for changes, n_networks in [
        ({"max_iter": 16}, 5),
        ({"max_iter": 9}, 3),
        ({"max_iter": 16, "early_stopping": True}, 9),
        ({"max_iter": 16, "early_stopping": True, "refit": True}, 5),
    ]:
        limit = n_networks * weight_bytes + table_bytes
        SDNNRegressor(**options, **changes, training="plain", memory_limit=limit).fit(X, Y)
        model = SDNNRegressor(**options, **changes, training="plain", memory_limit=limit - 1)
        with pytest.raises(ValueError, match=f"{n_networks} networks"):
            model.fit(X, Y)
        model.partial_fit(X, Y).learn_one(X[0], Y[0])  # online learning averages no networks
    model.set_params(warm_start=True, refit=False, early_stopping=False)
    with pytest.raises(ValueError, match="5 networks"):
        model.fit(X, Y)


def test_averaging_epochs_improves_the_score_on_noisy_targets():
    random = np.random.RandomState(3)
    points = random.uniform(size=(300, 2))
    noisy = np.sin(5 * points[:, 0]) * points[:, 1] + random.normal(0, 0.5, 300)
    fresh = random.uniform(size=(500, 2))
    true = np.sin(5 * fresh[:, 0]) * fresh[:, 1]
    options = {"coding": UNIT, "n_pattern_units": 256, "random_state": 0}
    last_epoch = SDNNRegressor(**options, n_averaged_epochs=1).fit(points, noisy).score(fresh, true)
    averaged = SDNNRegressor(**options).fit(points, noisy).score(fresh, true)
    assert averaged > last_epoch


def test_early_stopping_keeps_the_averages_of_its_best_epochs():
    noisy = Y + np.random.RandomState(1).normal(0, 0.3, len(Y))
    options = {"coding": UNIT, "n_pattern_units": 128, "random_state": 1, "shuffle": False}
    options |= {"early_stopping": True, "n_iter_no_change": 4, "n_averaged_epochs": 3}
    model = SDNNRegressor(**options, max_iter=60).fit(X, noisy)
    best = int(np.argmax(model.validation_scores_))
    up_to_best = SDNNRegressor(**options, max_iter=best + 1).fit(X, noisy)
    np.testing.assert_array_equal(model.predict(X), up_to_best.predict(X))


def test_refit_trains_on_all_samples_for_the_best_number_of_epochs():
    noisy = Y + np.random.RandomState(1).normal(0, 0.3, len(Y))
    options = {**SETTINGS, "output_range": (-2, 2), "shuffle": False}
    model = SDNNRegressor(**options, early_stopping=True, refit=True, max_iter=60).fit(X, noisy)
    best = int(np.argmax(model.validation_scores_))
    whole = SDNNRegressor(**options, max_iter=best + 1).fit(X, noisy)
    np.testing.assert_array_equal(model.weights_, whole.weights_)
    plain, refitted = (SDNNRegressor(**options, max_iter=7, refit=refit) for refit in (False, True))
    np.testing.assert_array_equal(plain.fit(X, noisy).predict(X), refitted.fit(X, noisy).predict(X))
