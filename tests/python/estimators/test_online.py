"""Online learning: single samples, portions, weights, and ranges that are too narrow."""

import copy
import pickle
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pandas as pd
import pytest

from refusals import refuses
from sdnn import SDNNClassifier, SDNNRegressor
from sdnn.coding import Circular, RandomInverse, Symbolic, WithMissing
from sdnn.estimators import OutOfRangeWarning
from sdnn.estimators.network import FEW_SAMPLES, FEW_TO_PREDICT, Network
from sdnn.estimators.regressor import MARGIN
from sdnn.estimators.training import samples_of_epoch

RANDOM = np.random.RandomState(0)
X = RANDOM.uniform(0, 1, (200, 4))
Y = np.sin(5 * X[:, 0]) * X[:, 1]
LABELS = np.digitize(Y, [-0.3, 0.3])
NAMES = ["a", "b", "c", "d"]
ROWS = [dict(zip(NAMES, row, strict=True)) for row in X.tolist()]
UNIT = RandomInverse(low=0.0, high=1.0)
MIXED = [
    (UNIT, [0]),
    (RandomInverse(spacing="quantile"), [1]),
    (Circular(period=1.0), [2]),
    ("anchor", 3),
]
OPTIONS = {"n_pattern_units": 40, "random_state": 1}


def regressor(**options):
    return SDNNRegressor(**{"coding": UNIT, "output_range": (-1.5, 1.5), **OPTIONS, **options})


def classifier(**options):
    return SDNNClassifier(**{"coding": UNIT, **OPTIONS, **options})


def assert_equal_weights(model, expected):
    np.testing.assert_array_equal(model.weights_, expected.weights_)
    np.testing.assert_array_equal(model.thresholds_, expected.thresholds_)
    assert model.n_iter_ == expected.n_iter_


@pytest.mark.parametrize("named", [False, True])
def test_learn_one_and_predict_one_have_the_bits_of_partial_fit_and_predict(named):
    model, plain = regressor(), regressor(training="plain")
    for row, x, y in zip(ROWS, X, Y, strict=True):
        model.learn_one(row if named else x, y)
        plain.partial_fit(x[None], [y])
    assert_equal_weights(model, plain)
    frame = pd.DataFrame(X, columns=NAMES) if named else X
    singly = [model.predict_one(row if named else x) for row, x in zip(ROWS, X, strict=True)]
    np.testing.assert_array_equal(singly, model.predict(frame))
    assert isinstance(singly[0], float)


MODELS = [regressor, classifier, lambda: classifier(scheme="one_vs_one")]


@pytest.mark.parametrize("make", MODELS, ids=["regressor", "classifier", "one_vs_one"])
def test_predictions_do_not_depend_on_the_number_of_rows(make):
    model = make().fit(X, LABELS // 2)
    expected = model.predict(X)
    # Repeated single rows change to weights in bytes; more rows than a limit, or than a block of
    # 64, are predicted in other ways.
    for n_rows in (1, 1, 1, 2, 9, 1, FEW_TO_PREDICT, FEW_TO_PREDICT + 1, 64, 65):
        np.testing.assert_array_equal(model.predict(X[:n_rows]), expected[:n_rows])
    assert len(model._networks_for(1)) > 1
    assert all(network.predicts_in_bytes(1) for network in model._networks_for(1))


@pytest.mark.parametrize("scheme", ["one_vs_rest", "one_vs_one"])
def test_learn_one_of_labels_has_the_bits_of_partial_fit(scheme):
    model, block = classifier(scheme=scheme), classifier(scheme=scheme, training="block")
    for x, label in zip(X, LABELS, strict=True):
        model.learn_one(x, label, classes=[0, 1, 2])
        block.partial_fit(x[None], [label], classes=[0, 1, 2])
    assert_equal_weights(model, block)
    assert [model.predict_one(x) for x in X] == model.predict(X).tolist()


def test_fit_widens_the_output_range_before_training_and_partial_fit_during_it():
    options = {"max_iter": 1, "shuffle": False, "out_of_range": "widen"}
    within, beyond = Y.copy(), np.where(np.arange(len(Y)) == 99, 4.0, Y)
    assert_equal_weights(
        regressor(**options).fit(X, within), regressor(**options).partial_fit(X, within)
    )
    fitted, partly_fitted = (regressor(**options) for _ in range(2))
    for learn in (fitted.fit, partly_fitted.partial_fit):
        with pytest.warns(OutOfRangeWarning):
            learn(X, beyond)
    np.testing.assert_array_equal(fitted.output_range_, partly_fitted.output_range_)
    assert not np.array_equal(fitted.weights_, partly_fitted.weights_)


def test_portions_of_any_size_have_the_bits_of_plain_training():
    # More than FEW_SAMPLES are learned in another way than fewer.
    model, plain = regressor(), regressor(training="plain")
    portions = [1, FEW_SAMPLES + 5, 3, 1, FEW_SAMPLES, 40]
    begin = 0
    for size in portions:
        portion = slice(begin, begin + size)
        model.partial_fit(X[portion], Y[portion])
        plain.partial_fit(X[portion], Y[portion])
        np.testing.assert_array_equal(model.predict(X[:2]), plain.predict(X[:2]))
        model = pickle.loads(pickle.dumps(model)) if size == 3 else copy.deepcopy(model)
        begin += size
    assert_equal_weights(model, plain)


@pytest.mark.parametrize("learns", [False, True])
@pytest.mark.parametrize("make", [regressor, classifier])
def test_concurrent_predictions_equal_sequential_ones(make, learns):
    model = make(n_pattern_units=200).fit(X, LABELS // 2)
    if learns:
        model.learn_one(X[0], 1)
    else:
        model.predict_one(X[0])
    expected = copy.deepcopy(model).predict(X).tolist()
    comparisons = [
        lambda: model.predict(X).tolist() == expected,
        lambda: model.predict(X[:9]).tolist() == expected[:9],
        lambda: model.predict_one(X[5]) == expected[5],
    ]
    with ThreadPoolExecutor(4) as pool:
        outcomes = [pool.submit(comparisons[number % 3]) for number in range(300)]
        assert all(outcome.result() for outcome in outcomes)


def test_features_that_may_be_missing_may_be_left_out():
    codings = [("with-missing", ["b"]), (WithMissing(base=Symbolic()), ["word"])]
    rows = [{**row, "word": "uv"[row["d"] > 0.5]} for row in ROWS]
    rows[3] = {**rows[3], "b": None, "word": None}
    model = SDNNRegressor(codings, **OPTIONS).fit(pd.DataFrame(rows), Y)
    lacking = {name: value for name, value in rows[3].items() if name not in ("b", "word")}
    assert model.predict_one(lacking) == model.predict_one(rows[3])
    copied = copy.deepcopy(model)
    assert_equal_weights(model.learn_one(lacking, 0.5), copied.learn_one(rows[3], 0.5))
    # Refused, with the names that are expected: an unknown feature, and missing numbers.
    for bad in ({**lacking, "e": 1.0}, {"b": 0.5, "word": "u"}, {**lacking, "word": "u", "e": 1.0}):
        refuses("word", model.predict_one, bad)


def test_learning_does_not_change_a_copy():
    model = regressor().learn_one(X[0], Y[0])
    copied = copy.deepcopy(model)
    before = copied.weights_
    for x, y in zip(X, Y, strict=True):
        model.learn_one(x, y)
    np.testing.assert_array_equal(copied.weights_, before)


def test_learn_one_and_predict_one_code_inputs_like_fit_and_predict():
    model = regressor(coding=MIXED).fit(X, Y)
    assert [model.predict_one(x) for x in X] == model.predict(X).tolist()
    words = [(UNIT, [0, 1]), ("symbolic", [2])]
    table = np.column_stack([X[:, :2].astype(object), np.where(X[:, 2] > 0.5, "u", "v")])
    model = regressor(coding=words).fit(table, Y)
    assert [model.predict_one(x) for x in table] == model.predict(table).tolist()
    plain = pickle.loads(pickle.dumps(model)).set_params(training="plain")
    assert_equal_weights(model.learn_one(list(table[0]), Y[0]), plain.partial_fit(table[:1], Y[:1]))
    refuses("categories", model.predict_one, [0.1, 0.2, "w"])


def test_learn_one_and_predict_one_accept_several_outputs():
    targets = np.stack([Y, -Y], axis=1)
    model = regressor().fit(X, targets)
    model.learn_one(X[0], targets[0])
    np.testing.assert_array_equal(model.predict_one(X[3]), model.predict(X[3:4])[0])
    refuses("outputs", model.learn_one, X[0], 0.5)


def test_weights_that_do_not_fit_into_bytes_are_learned_online():
    model = regressor().fit(X, Y)
    network = model.network_ = Network(
        model.network_.input_code,
        model.network_.n_units,
        weights=np.full_like(model.weights_, 20_000),
        thresholds=model.thresholds_,
    )
    plain = pickle.loads(pickle.dumps(model)).set_params(training="plain")
    assert_equal_weights(model.learn_one(X[0], Y[0]), plain.partial_fit(X[:1], Y[:1]))
    assert network.online(2**30) is None, "a copy in bytes, for which there would be memory"


@pytest.mark.parametrize(
    "bad",
    [
        {"a": 1.0},
        dict.fromkeys(["a", "b", "c", "e"], 0.5),
        [0.5, np.inf, 0.5, 0.5],
        [0.5, "word", 0.5, 0.5],
        [0.5],
        X[:1],
    ],
)
def test_bad_rows_are_refused_by_name(bad):
    model = regressor().learn_one(ROWS[0], Y[0])
    refuses("x", model.learn_one, bad, 0.1)
    refuses("x", model.predict_one, bad)


def test_values_outside_a_range_are_counted_and_warned_about_once():
    model = regressor().fit(X, Y)
    with pytest.warns(OutOfRangeWarning, match="column 2"):
        model.learn_one(X[0] + np.array([0, 0, 9, 0]), 0.0)
    with pytest.warns(OutOfRangeWarning, match="output_range_"):
        model.partial_fit(X[:3] + 7, [9.0, 9.0, 0.0])
    model.learn_one(X[0] + 5, 9.0)  # an error if it warned again
    assert model.n_inputs_out_of_range_ == 1 + 3 * 4 + 4  # one value, three rows, and a row of four
    assert model.n_outputs_out_of_range_ == 2 + 1
    model.predict(X + 5)
    assert model.n_inputs_out_of_range_ == 1 + 3 * 4 + 4, "predictions are not counted"
    model.fit(X, Y)
    assert model.n_inputs_out_of_range_ == model.n_outputs_out_of_range_ == 0


@pytest.mark.parametrize("make", [regressor, classifier])
def test_with_out_of_range_error_values_outside_are_refused(make):
    model = make(out_of_range="error").fit(X, LABELS // 2)
    refuses("column", model.learn_one, [0.5, 3.5, 0.5, 0.5], 1)
    if make is regressor:
        refuses("output_range_", model.learn_one, X[0], 3.5)


def test_with_out_of_range_widen_predictions_follow_a_drift():
    options = {"coding": UNIT, "random_state": 0, "n_pattern_units": 100}
    clipping = SDNNRegressor(**options).fit(X, Y)
    widening = SDNNRegressor(out_of_range="widen", **options).fit(X, Y)
    for model in (clipping, widening):
        with pytest.warns(OutOfRangeWarning):
            model.partial_fit(X, Y + 10)
        for _ in range(9):
            model.partial_fit(X, Y + 10)
    assert abs(clipping.predict(X) - (Y + 10)).min() > 5
    assert widening.score(X, Y + 10) > 0.9


def test_fit_counts_and_warns_about_values_that_widen_a_range():
    targets = np.stack([9 * Y, Y], axis=1)
    beyond = int(np.count_nonzero(abs(targets) > 1.5))
    model = regressor(out_of_range="widen")
    with pytest.warns(OutOfRangeWarning, match="output_range_") as caught:
        model.fit(X, targets)
    assert len(caught) == 1
    assert caught[0].filename == __file__
    assert model.n_outputs_out_of_range_ == beyond > 0
    # From -1.5 to 1.5, the range is widened by a share of its new width, first at its low end.
    low = 9 * Y.min() - MARGIN * (1.5 - 9 * Y.min())
    high = 9 * Y.max() + MARGIN * (9 * Y.max() - low)
    np.testing.assert_allclose(model.output_range_[0], [low, high])
    assert model.output_range_[1].tolist() == [-1.5, 1.5]
    model.set_params(warm_start=True).fit(X, targets)
    assert model.n_outputs_out_of_range_ == beyond


@pytest.mark.filterwarnings("ignore::sdnn.estimators.OutOfRangeWarning")
def test_an_output_range_widens_equally_in_any_portions():
    drifting = Y + np.linspace(0, 9, len(Y))
    whole, parts, single = (regressor(out_of_range="widen") for _ in range(3))
    whole.partial_fit(X, drifting)
    for begin in range(0, len(X), 40):
        parts.partial_fit(X[begin : begin + 40], drifting[begin : begin + 40])
    for x, y in zip(X, drifting, strict=True):
        single.learn_one(x, y)
    for other in (parts, single):
        np.testing.assert_array_equal(other.weights_, whole.weights_)
        np.testing.assert_array_equal(other.output_range_, whole.output_range_)
        assert other.n_outputs_out_of_range_ == whole.n_outputs_out_of_range_ > 0
    assert whole.output_range_[0, 1] > drifting.max()


@pytest.mark.parametrize("n_classes", [2, 3])
def test_predict_proba_one_has_the_bits_of_predict_proba_and_needs_several_units(n_classes):
    model = classifier().fit(X, np.minimum(LABELS, n_classes - 1))
    each = [model.predict_proba_one(row) for row in X[:50]]
    np.testing.assert_array_equal(each, model.predict_proba(X[:50]))
    assert not hasattr(classifier(scheme="one_vs_one"), "predict_proba_one")
    assert not hasattr(classifier(n_units_per_class=1), "predict_proba_one")


@pytest.mark.parametrize("size", [1, 7, 200])
def test_fractional_sample_weights_are_presentations_in_any_portions(size):
    weights = np.tile([2.0, 0.5, 1.0, 0.25], 50)
    model, presented = regressor(), samples_of_epoch(200, weights, epoch=0)  # indices of samples
    for begin in range(0, 200, size):
        portion = slice(begin, begin + size)
        model.partial_fit(X[portion], Y[portion], sample_weight=weights[portion])
    repeated = regressor().partial_fit(X[presented], Y[presented])
    np.testing.assert_array_equal(model.weights_, repeated.weights_)
    assert len(presented) == pytest.approx(weights.sum(), abs=2)
    halves = classifier().partial_fit(X, LABELS, [0, 1, 2], np.full(200, 0.5))
    whole = classifier().partial_fit(X, LABELS, [0, 1, 2])
    assert 0 < np.abs(halves.weights_).sum() < np.abs(whole.weights_).sum()
