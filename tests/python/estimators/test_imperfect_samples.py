"""Samples of everyday life: stray words, constant features, odd labels, dates, rows of frames."""

import datetime
import json

import numpy as np
import pandas as pd
import pytest

from refusals import refuses
from sdnn import SDNNClassifier, SDNNKernelRidge, SDNNRegressor
from sdnn.coding import RandomInverse

RANDOM = np.random.RandomState(0)
X = RANDOM.uniform(size=(600, 2))
SMALL = {"n_pattern_units": 40, "random_state": 0}
UNIT = RandomInverse(low=0.0, high=1.0)
DAY = datetime.date(2026, 11, 29)


def mean_error(model, samples, targets):
    """Return the mean error of the last 200 predictions, each made before its sample is learned."""
    errors = []
    for sample, target in zip(samples, targets, strict=True):
        errors.append(abs(model.predict_one(sample) - target))
        model.learn_one(sample, target)
    return np.mean(errors[-200:])


@pytest.mark.filterwarnings("ignore::sdnn.estimators.OutOfRangeWarning")  # of targets
@pytest.mark.parametrize("experts", ["window", "network"])
def test_a_feature_that_is_constant_at_first_is_learned_once_it_varies(river, experts):
    flag = (X[:, 0] > 0.5) * (np.arange(600) >= 150)  # 0 in the first 150 samples
    samples = [{"flag": int(f), "size": size} for f, size in zip(flag, X[:, 1], strict=True)]
    # Without the flag, which is 0 or 1 for half of the later samples, errors would be about 0.5.
    model = river.RiverRegressor(SDNNRegressor(**SMALL, out_of_range="widen"), experts=experts)
    assert mean_error(model, samples, flag + 0.1 * X[:, 1]) < 0.1


def test_a_stream_of_constant_features_predicts_the_mean_until_one_varies(river):
    model = river.RiverRegressor()
    for y in range(150):
        model.learn_one({"a": 1.0, "b": None}, y)
    assert model.predict_one({"a": 1.0}) == np.mean(range(150))
    for y in range(100):  # the next attempt to learn ranges is at 200 samples
        model.learn_one({"a": y / 100, "b": None}, y)
    assert list(model.reads) == ["a"]


@pytest.mark.parametrize("options", [{"pairs": [(0, 1)]}, {"coding": [("anchor", [1])]}])
def test_features_that_a_model_names_by_their_numbers_are_learned_while_constant(river, options):
    # A stream leaves out features while they are constant, which would shift the numbers of others.
    model = river.RiverRegressor(SDNNRegressor(**SMALL, **options), grace_period=20)
    for a, y in X[:40].tolist():
        model.learn_one({"a": 1.0, "b": a, "c": -a}, y)
    assert list(model.reads) == ["a", "b", "c"]


def test_more_features_may_come_at_once_than_there_were(river):
    model = river.RiverRegressor(SDNNRegressor(**SMALL), grace_period=20)
    for i, (a, y) in enumerate(X[:300].tolist()):
        late = {"b": y, "c": -y, "d": a * y} if i >= 30 else {}
        model.learn_one({"a": a, **late}, y)
    assert list(model.reads) == ["a", "b", "c", "d"]


@pytest.mark.parametrize("word", ["?", "n/a"])
def test_a_stray_word_among_numbers_of_a_stream_is_a_missing_value(river, word):
    samples = [{"a": a, "b": b} for a, b in X.tolist()]
    samples[40]["a"] = word  # were "a" left out, the mean error of uniform targets would be 0.25
    assert mean_error(river.RiverRegressor(), samples, X[:, 0]) < 0.05


@pytest.mark.parametrize("label", [2.5, (1, 2), DAY, [1], None, float("nan")])
def test_streams_refuse_labels_that_are_no_classes_and_keep_learning(river, label):
    model = river.RiverClassifier(SDNNClassifier(**SMALL), grace_period=20)
    for i, (a, b) in enumerate(X[:60].tolist()):
        if i in (5, 40):
            refuses("y", model.learn_one, {"a": a, "b": b}, label)
        model.learn_one({"a": a, "b": b}, int(a > b))
    assert model.n_learned == 60
    assert model.fitted.classes_.tolist() == [0, 1]


def test_streams_refuse_models_that_cannot_learn_online(river):
    for options in ({"class_weight": "balanced"}, {"calibrate": True}, {"max_iter": -1}):
        refuses(*options, river.RiverClassifier, SDNNClassifier(**options))
    refuses("x", river.RiverRegressor().predict_one, [1, 2], error=TypeError)


@pytest.mark.parametrize("labels", [(0, 1), (False, True), ("no", "yes")])
def test_predicted_labels_of_a_stream_have_the_types_of_python(river, labels):
    for experts in ("window", "network"):
        model = river.RiverClassifier(SDNNClassifier(**SMALL), grace_period=20, experts=experts)
        for a, b in X[:30].tolist():
            model.learn_one({"a": a, "b": b}, labels[a > b])
        predicted = model.predict_one({"a": 0.9, "b": 0.1})
        assert type(predicted) is type(labels[1])
        assert json.loads(json.dumps(predicted)) == predicted


def test_rows_of_frames_are_read_by_their_names():
    frame = pd.DataFrame(X, columns=["a", "b"])
    model = SDNNRegressor(**SMALL).fit(frame, X[:, 0])
    row = frame.iloc[0]
    assert model.predict_one(row[["b", "a"]]) == model.predict(frame[:1])[0]
    refuses("other", model.predict_one, row.rename({"a": "other"}))
    assert model.predict_one(row.reset_index(drop=True)) == model.predict_one(row)
    first = SDNNRegressor(**SMALL, coding=UNIT, output_range=(0.0, 1.0)).learn_one(row, 0.5)
    assert first.feature_names_in_.tolist() == ["a", "b"]
    refuses("DataFrame", SDNNRegressor().fit, row, [0.5])


def test_tables_with_arrays_in_cells_are_refused():
    cells = [[np.zeros(2), 1.0], [np.zeros(3), 2.0]]
    for samples in (cells, pd.DataFrame({"a": [np.zeros(2), np.zeros(3)], "b": [1.0, 2.0]})):
        with pytest.raises(ValueError, match="sequence"):
            SDNNRegressor().fit(samples, [0.0, 1.0])


MISSING_TARGETS = {
    "None": pd.Series([1.0, None, 2.0], dtype=object),
    "pandas.NA": pd.Series([1, pd.NA, 2], dtype="Int64"),
    "text": np.array(["1", "nan", "2"]),
    "list": [1.0, None, 2.0],
}


@pytest.mark.parametrize("targets", MISSING_TARGETS.values(), ids=MISSING_TARGETS)
@pytest.mark.parametrize("estimator", [SDNNRegressor, SDNNKernelRidge])
def test_missing_targets_are_refused_whatever_their_type(estimator, targets):
    refuses("NaN", estimator().fit, X[:3], targets)


DATES = {
    "first cell empty": pd.DataFrame({"day": [None, DAY, DAY], "size": [1.0, 2.0, 3.0]}),
    "pandas": pd.DataFrame({"day": pd.to_datetime([DAY] * 3), "size": [1.0, 2.0, 3.0]}),
    "list": [[DAY, 1.0], [DAY, 2.0], [DAY, 3.0]],
    "list of NumPy's": [[np.datetime64("2026-11-29"), 1.0]] * 3,
}


@pytest.mark.parametrize("samples", DATES.values(), ids=DATES)
def test_dates_are_refused_wherever_they_are(samples):
    refuses("dates", SDNNRegressor().fit, samples, [1.0, 2.0, 3.0])


def test_dates_as_targets_are_refused():
    refuses("dates", SDNNRegressor().fit, X[:3], np.array([DAY] * 3, dtype="datetime64[D]"))
