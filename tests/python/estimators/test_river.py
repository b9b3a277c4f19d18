"""Estimators of the river library: streams whose features, categories and classes change."""

import pickle

import numpy as np
import pandas as pd
import pytest

from refusals import refuses
from sdnn import SDNNClassifier, SDNNRegressor
from sdnn.coding import RandomInverse, Symbolic, WithMissing

RANDOM = np.random.RandomState(0)
X = RANDOM.uniform(0, 1, (200, 4))
Y = np.sin(5 * X[:, 0]) * X[:, 1]
LABELS = np.digitize(Y, [-0.3, 0.3])
ROWS = [dict(zip("abcd", row, strict=True)) for row in X.tolist()]
UNIT = RandomInverse(low=0.0, high=1.0)
OPTIONS = {"n_pattern_units": 40, "random_state": 1}


def assert_equal_weights(model, expected):
    np.testing.assert_array_equal(model.weights_, expected.weights_)
    np.testing.assert_array_equal(model.thresholds_, expected.thresholds_)
    assert model.n_iter_ == expected.n_iter_


def test_estimators_learn_numbers_and_labels(river):
    model = river.RiverRegressor(SDNNRegressor(**OPTIONS, out_of_range="widen"), grace_period=50)
    assert model.predict_one(ROWS[0]) == 0.0
    errors = []
    for _ in range(5):
        for row, y in zip(ROWS, Y, strict=True):
            errors.append(abs(model.predict_one(row) - y))
            model.learn_one(row, y)
    assert np.mean(errors[-200:]) < 0.5 * np.mean(np.abs(Y - Y.mean()))
    labelled = river.RiverClassifier(SDNNClassifier(**OPTIONS), grace_period=50)
    assert labelled.predict_one(ROWS[0]) is None
    for _ in range(5):
        is_right = []
        for row, label in zip(ROWS, LABELS.tolist(), strict=True):
            is_right.append(labelled.predict_one(row) == label)
            labelled.learn_one(row, label)
    # The most frequent of the three labels is 52 % of all.
    assert np.mean(is_right) > 0.8, "in the last of five passes"
    assert labelled.clone().fitted is None


def test_estimators_have_default_models_and_refuse_others(river):
    assert river.RiverRegressor().clone().model.out_of_range == "widen"
    assert river.RiverClassifier().clone().model.correction_share == 0.5
    for make, wrong in ((river.RiverRegressor, SDNNClassifier()), (river.RiverClassifier, 3)):
        with pytest.raises(TypeError, match="model must be an SDNN"):
            make(wrong)


@pytest.mark.filterwarnings("ignore::sdnn.estimators.OutOfRangeWarning")
def test_features_may_be_named_by_numbers(river):
    model = river.RiverRegressor(SDNNRegressor(**OPTIONS), grace_period=20)
    for x, y in zip(X[:40], Y[:40], strict=True):
        model.learn_one(dict(enumerate(x)), y)
    assert np.isfinite(model.predict_one(dict(enumerate(X[0]))))


BAD_SAMPLES = [{"a": float("inf")}, {"a": [1.0]}, {"a": 10**400}, {1: 0.5, "1": 0.5}]


def river_models(river, **options):
    regressor = SDNNRegressor(**OPTIONS, out_of_range="widen")
    return [
        river.RiverRegressor(regressor, **options),
        river.RiverClassifier(SDNNClassifier(**OPTIONS), **options),
    ]


@pytest.mark.filterwarnings("ignore::sdnn.estimators.OutOfRangeWarning")
@pytest.mark.parametrize("n_before", [0, 19, 40])  # the grace period ends with 20 samples
@pytest.mark.parametrize("number", [0, 1], ids=["regressor", "classifier"])
def test_estimators_refuse_a_bad_sample_and_keep_learning(river, number, n_before):
    model, without_refusals = (river_models(river, grace_period=20)[number] for _ in range(2))
    targets = [Y.tolist(), LABELS.tolist()][number]
    for row, target in zip(ROWS[:n_before], targets, strict=False):
        model.learn_one(row, target)
        without_refusals.learn_one(row, target)
    for bad in BAD_SAMPLES:
        refuses("x", model.learn_one, bad, targets[0])
    for bad in (None, float("nan"), *([] if number else ["word"])):
        refuses("y", model.learn_one, ROWS[0], bad)
    for row, target in zip(ROWS[n_before:60], targets[n_before:], strict=False):
        model.learn_one(row, target)
        without_refusals.learn_one(row, target)
    assert_equal_weights(model.fitted, without_refusals.fitted)


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize("number", [0, 1])
def test_rivers_estimator_checks_pass(river, number):
    model = river_models(river)[number]
    for check in pytest.importorskip("river.checks").yield_checks(model):
        check(model.clone())


def late_stream(n_samples):
    """Yield samples with numbers and a word; from the 400th on, a new feature and a new word."""
    random = np.random.RandomState(3)
    for number in range(n_samples):
        a, b, late = random.uniform(size=3).tolist()
        x = {"a": a, "b": None if b < 0.1 else b, "word": "uv"[b > 0.5], "flag": a > 0.5}
        if number >= 400:
            x |= {"late": late, "word": random.choice(["u", "v", "w"]).item()}
        yield x, a + x.get("late", 0.0) + 2 * (x["word"] == "w")


@pytest.mark.filterwarnings("ignore::sdnn.estimators.OutOfRangeWarning")
@pytest.mark.parametrize("n_pattern_units", [40, None, 2000])  # 2000: too large to be extended
def test_features_and_categories_may_appear_late(river, n_pattern_units):
    ordered, reordered = (river_models(river)[0] for _ in range(2))
    errors = []
    for model in (ordered, reordered):
        model.model.set_params(n_pattern_units=n_pattern_units)
        for x, y in late_stream(900):
            errors.append(abs(model.predict_one(x) - y))
            model.learn_one(x if model is ordered else dict(reversed(x.items())), y)
    assert errors[:900] == errors[900:]
    assert set(ordered.fitted.feature_names_in_) == {"a", "b", "flag", "late", "word"}
    # The new word w, in a third of the samples, raises the target by 2: without it and the new
    # feature, the mean error of the last 200 predictions would be at least 2 / 3.
    assert np.mean(errors[:900][-200:]) < 0.25
    for x in ({}, {"late": 0.5}, {**ROWS[0], "new": 1}, {"word": "x", "a": "y", "late": pd.NA}):
        predicted = ordered.predict_one(x)
        ordered.learn_one(x, 1.0)
        assert np.isfinite(predicted)
        assert pickle.loads(pickle.dumps(ordered)).predict_one(x) == ordered.predict_one(x)


def test_adding_inputs_keeps_predictions_and_can_be_saved(river, tmp_path):
    from sdnn.estimators.growth import grow

    model = river_models(river)[0]
    for x, y in late_stream(300):
        model.learn_one(x, y)
    rows = [{**x, "flag": float(x["flag"])} for x, _ in late_stream(50)]
    before = [model.fitted.predict_one(x) for x in rows]
    names = model.fitted.feature_names_in_.tolist()
    coding = model.fitted.codings_[names.index("word")]
    larger = WithMissing(base=Symbolic(categories=(*coding.base.categories, "w")))
    changes = {"new": WithMissing(base=UNIT).fit(X[:, 0], 40)}, {names.index("word"): larger}
    assert not grow(model.fitted, *changes, most_columns=100)
    assert grow(model.fitted, *changes, most_columns=2**20)
    assert [model.fitted.predict_one(x) for x in rows] == before
    model.fitted.learn_one({"new": 0.5, "word": "w"}, 0.5)
    model.fitted.save(tmp_path / "grown.safetensors")
    loaded = SDNNRegressor.load(tmp_path / "grown.safetensors")
    assert_equal_weights(loaded, model.fitted)


def test_before_fitting_the_first_of_equally_frequent_labels_is_predicted(river):
    model = river.RiverClassifier(SDNNClassifier(**OPTIONS), grace_period=50)
    for row, label in zip(ROWS, ["red", "green", "blue", "blue", "green", "red"], strict=False):
        model.learn_one(row, label)
    assert model.predict_one(ROWS[0]) == "red", "each of three labels came twice, red first"


@pytest.mark.filterwarnings("ignore::sdnn.estimators.OutOfRangeWarning")
def test_follows_ranges_halves_the_error_on_drifting_features(river):
    random = np.random.RandomState(0)
    errors = {}
    for follows in (True, False):
        learner = SDNNRegressor(n_pattern_units=32, random_state=0, out_of_range="widen")
        model = river.RiverRegressor(learner, follows_ranges=follows, experts="network")
        random.seed(1)
        for number in range(1500):
            a, b = random.uniform(size=2)
            x = {"a": a + number / 300, "b": (b - 0.5) * (1 + number / 300), "constant": 1.0}
            y = np.sin(3 * a) * b
            errors.setdefault(follows, []).append(abs(model.predict_one(x) - y))
            model.learn_one(x, y)
    assert np.mean(errors[True][-500:]) < 0.5 * np.mean(errors[False][-500:])


def test_classes_may_appear_late(river):
    model = river.RiverClassifier(SDNNClassifier(**OPTIONS), grace_period=20)
    names = np.array(["middle", "low", "high"])[LABELS]
    order = np.argsort(LABELS == 2, kind="stable")  # class "high" comes last
    for _ in range(5):
        for row in order.tolist():
            model.learn_one(ROWS[row], names[row])
        order = np.random.RandomState(0).permutation(len(order))
    assert model.fitted.classes_.tolist()[-1] == "high"
    is_right = [model.predict_one(row) == name for row, name in zip(ROWS, names, strict=True)]
    assert np.mean(is_right) > 0.8
    assert set(model.predict_proba_one(ROWS[0])) == {"low", "middle", "high"}
    for label in (3, 2.5, None):
        refuses("y", model.learn_one, ROWS[0], label)
    refuses("x", model.learn_one, {"other": [1.0]}, "highest")
    assert len(model.fitted.classes_) == 3, "an error adds no class"


def test_classifiers_refuse_nan_labels_and_new_classes_of_one_vs_one(river):
    names = np.array(["middle", "low", "high"])[LABELS]
    numbers = river.RiverClassifier(SDNNClassifier(**OPTIONS), grace_period=20)
    for row, label in zip(ROWS[:30], LABELS, strict=False):
        numbers.learn_one(row, float(label))
    refuses("y", numbers.learn_one, ROWS[0], float("nan"))
    pairs = river.RiverClassifier(SDNNClassifier(**OPTIONS, scheme="one_vs_one"), grace_period=20)
    for row in np.argsort(LABELS == 2, kind="stable")[:30].tolist():
        pairs.learn_one(ROWS[row], names[row])
    refuses("one_vs_rest", pairs.learn_one, ROWS[0], "high")


def test_before_fitting_river_probabilities_are_frequencies_of_labels(river):
    from river import ensemble

    model = river.RiverClassifier(SDNNClassifier(**OPTIONS), grace_period=50)
    assert model.predict_proba_one(ROWS[0]) == {}
    for row, label in zip(ROWS, ["red", "green", "red", "red"], strict=False):
        model.learn_one(row, label)
    assert model.predict_proba_one(ROWS[0]) == {"red": 0.75, "green": 0.25}
    assert ensemble.VotingClassifier([model, model])._multiclass, "more than two classes"
    single = river.RiverClassifier(SDNNClassifier(**OPTIONS, scheme="one_vs_one"))
    refuses("scheme", single.predict_proba_one, ROWS[0], error=NotImplementedError)


def test_metrics_and_multiclass_wrappers_accept_the_classifier(river):
    from river import evaluate, metrics, multiclass

    stream = list(zip(ROWS, (Y > 0.2).tolist(), strict=True)) * 3
    model = river.RiverClassifier(SDNNClassifier(**OPTIONS), grace_period=50)
    metric = evaluate.progressive_val_score(stream, model, metrics.ROCAUC() + metrics.LogLoss())
    assert metric[0].get() > 0.9
    assert metric[1].get() < 0.5
    shares = model.predict_proba_one(ROWS[0])
    assert list(map(type, shares)) == [bool, bool]
    assert model.predict_one(ROWS[0]) == max(shares, key=shares.get)
    wrapped = multiclass.OneVsRestClassifier(
        river.RiverClassifier(SDNNClassifier(**OPTIONS), grace_period=50)
    )
    stream = list(zip(ROWS, LABELS.tolist(), strict=True)) * 3
    assert evaluate.progressive_val_score(stream, wrapped, metrics.Accuracy()).get() > 0.7
