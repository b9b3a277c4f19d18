"""Large samples, whose blocks are shuffled."""

import numpy as np
import pytest

from sdnn import SDNNClassifier, SDNNRegressor, _core
from sdnn.coding import RandomInverse
from sdnn.estimators import base, training
from sdnn.estimators.outliers import OutlierWarning

X = np.random.RandomState(0).uniform(size=(1300, 3))
Y = np.sin(5 * X[:, 0]) * X[:, 1] + X[:, 2]
OPTIONS = {"n_pattern_units": 64, "random_state": 0, "max_iter": 6}


@pytest.fixture
def few_are_many(monkeypatch):
    """Treat samples of 1,000 and more as large; there are 1,300."""
    for module in (base, training):
        monkeypatch.setattr(module, "LARGE_SAMPLE", 1000)


@pytest.mark.usefixtures("few_are_many")
@pytest.mark.parametrize("make", [SDNNRegressor, SDNNClassifier])
def test_training_forms_and_threads_give_the_same_bits(make):
    y = Y if make is SDNNRegressor else np.median(Y) < Y
    models = [
        make(training=form, n_jobs=n_jobs, **OPTIONS).fit(X, y)
        for form, n_jobs in [("auto", 1), ("block", 2), ("dual", 1), ("plain", 1)]
    ]
    assert models[0].training_form_ == "block"
    for model in models[1:]:
        np.testing.assert_array_equal(model.weights_, models[0].weights_)
        np.testing.assert_array_equal(model.predict(X), models[0].predict(X))


@pytest.mark.usefixtures("few_are_many")
def test_predictions_average_the_networks_of_the_last_epochs():
    model = SDNNRegressor(**OPTIONS).fit(X, Y)
    # The network after the sixth epoch is averaged with those after the three before it.
    for n_epochs, earlier in zip((3, 4, 5), model._earlier, strict=True):
        stopped = SDNNRegressor(**{**OPTIONS, "max_iter": n_epochs}).fit(X, Y)
        np.testing.assert_array_equal(earlier.layer.weights, stopped.weights_)
    assert model.score(X, Y) > 0.95


@pytest.mark.usefixtures("few_are_many")
def test_samples_sorted_by_target_are_learned():
    order = np.argsort(Y)
    model = SDNNRegressor(**{**OPTIONS, "max_iter": 2}).fit(X[order], Y[order])
    assert model.score(X, Y) > 0.9


@pytest.mark.usefixtures("few_are_many")
def test_early_stopping_and_sample_weights_work_with_blocks():
    stopped = SDNNRegressor(early_stopping=True, refit=True, **OPTIONS).fit(X, Y)
    assert stopped.score(X, Y) > 0.95
    twice = SDNNRegressor(**OPTIONS).fit(X, Y, np.full(len(X), 2.0))  # samples are shuffled
    assert twice.score(X, Y) > 0.95


@pytest.mark.usefixtures("few_are_many")
@pytest.mark.parametrize("make", [SDNNRegressor, SDNNClassifier])
def test_a_part_of_many_samples_selects_the_features(make):
    useless = np.random.RandomState(1).uniform(size=(len(X), 9))
    samples = np.column_stack([useless, X])
    y = Y if make is SDNNRegressor else np.median(Y) < Y
    options = {**OPTIONS, "n_pattern_units": None}  # chosen by the size of the sample
    model = make(**options).fit(samples, y)
    # The useful features are the last; halving 12 features leaves 6 of them, with 30 pairs.
    assert {9, 10} <= {feature for pair in model.pairs_ for feature in pair}
    assert len(model.pairs_) <= 6 * 5
    with_all = make(**options, pairs="all").fit(samples, y)
    assert len(with_all.pairs_) == 12 * 11
    assert model.score(samples, y) > with_all.score(samples, y) - 0.02
    few = make(**options).fit(samples[:1000], y[:1000])
    assert len(few.pairs_) == 12 * 11, "few samples select no features"


@pytest.mark.usefixtures("few_are_many")
def test_an_outlier_is_warned_of_once():
    samples = X.copy()
    samples[5, 0] = 1e6
    with pytest.warns(OutlierWarning) as warned:
        SDNNRegressor(**{**OPTIONS, "n_pattern_units": None}).fit(samples, Y)
    assert len(warned) == 1


@pytest.mark.parametrize("options", [{"early_stopping": True, "refit": True}, {"calibrate": True}])
def test_networks_that_learn_with_fewer_samples_are_corrected_by_half_too(options, monkeypatch):
    # Early stopping and calibration hold out samples: the others are fewer than the limit.
    half = SDNNRegressor(**OPTIONS, **options, correction_share=0.5).fit(X, Y)
    monkeypatch.setattr(SDNNRegressor, "_largest_full_sample", len(X) - 1)
    beyond = SDNNRegressor(**OPTIONS, **options).fit(X, Y)
    np.testing.assert_array_equal(beyond.weights_, half.weights_)
    if "calibrate" in options:
        expected = half.predict_interval(X[:5])
        np.testing.assert_array_equal(beyond.predict_interval(X[:5]), expected)


def test_samples_beyond_the_largest_full_sample_have_half_the_share_of_corrections(monkeypatch):
    half = SDNNRegressor(**OPTIONS, correction_share=0.5).fit(X, Y)
    monkeypatch.setattr(SDNNRegressor, "_largest_full_sample", len(X))
    at_limit = SDNNRegressor(**OPTIONS).fit(X, Y)
    monkeypatch.setattr(SDNNRegressor, "_largest_full_sample", len(X) - 1)
    beyond = SDNNRegressor(**OPTIONS).fit(X, Y)
    np.testing.assert_array_equal(beyond.weights_, half.weights_)
    assert (at_limit.weights_ != half.weights_).any()


def test_blocks_in_any_order_have_the_bits_of_single_samples():
    model = SDNNRegressor(RandomInverse(low=0, high=1), **{**OPTIONS, "max_iter": 1})
    network = model.fit(X, Y).network_
    bins = network.input_code.bins(X)
    targets = model._counts_of_targets(Y[:, None])
    blocks = np.split(np.arange(len(X), dtype=np.int32), [512, 1024])  # of 512, but for the last
    # Whole blocks in another order, and repeated or incomplete ones.
    orders = [
        np.concatenate([blocks[1], blocks[2], blocks[0]]),
        np.concatenate([blocks[2], blocks[2], blocks[0][:-1], blocks[1], blocks[0][1:]]),
        np.concatenate([blocks[0][5:], blocks[1], blocks[0]]),
        np.concatenate(blocks),
    ]
    trained = []
    for form in ("plain", "block"):
        layer = network.copy().layer
        trainer = _core.PDeltaTrainer(layer, bins, targets, 1.0, form=form, memory_limit=2**30)
        counts = [trainer.present(order) for order in orders]
        trainer.synchronize()
        trained.append((counts, layer.weights.tolist(), layer.thresholds.tolist()))
    assert trained[0] == trained[1]
