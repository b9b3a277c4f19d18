"""Saved estimators are loaded with every bit; invalid files and settings are refused."""

import numpy as np
import pandas as pd
import pytest
from sklearn.base import clone

from refusals import refuses
from sdnn import SDNNClassifier, SDNNRegressor
from sdnn.coding import (
    Anchor,
    Circular,
    Coding,
    CorrelationMatrix,
    RandomInverse,
    Symbolic,
    WithMissing,
)
from sdnn.support.files import read_file, write_file

RANDOM = np.random.RandomState(0)
X = RANDOM.uniform(0, 1, (60, 3))
Y = X[:, 0] * X[:, 1] - X[:, 2]
SMALL = {"n_pattern_units": 62, "max_iter": 3, "random_state": 0}

MODELS = {
    "regressor": (SDNNRegressor(**SMALL), X, Y),
    "outputs": (SDNNRegressor(output_range=[(-2, 2), (-1.5, 1)], **SMALL), X, np.stack([Y, Y], 1)),
    "quantile": (SDNNRegressor(RandomInverse(spacing="quantile"), **SMALL), X, Y),
    "separate": (SDNNRegressor(tables="separate", **SMALL), X, Y),
    "plain": (SDNNRegressor(pairs=[(0, None), (1, 2)], **SMALL), X, Y),
    "frame": (
        SDNNRegressor([(Circular(period=1.0), ["a"]), ("anchor", slice(1, 2))], **SMALL),
        pd.DataFrame(X, columns=["a", "b", "c"]),
        Y,
    ),
    "classifier": (SDNNClassifier(**SMALL), X, np.digitize(Y, [-0.5, 0])),
    "words": (
        SDNNClassifier(
            [(CorrelationMatrix(matrix=np.eye(2), categories=("u", "v")), 0)],
            scheme="one_vs_one",
            **SMALL,
        ),
        np.column_stack([np.where(X[:, 0] > 0.5, "u", "v").astype(object), X[:, 1:]]),
        np.where(Y > 0, "yes", "no"),
    ),
}


def with_lists(parameters):
    """Return the parameters as text in which tuples are lists, since JSON has no tuples."""
    return str(parameters).translate(str.maketrans("()", "[]"))


FRAME = pd.DataFrame({"a": X[:, 0], "b": np.digitize(X[:, 1], [0.3, 0.6]), "c": X[:, 2]})
LABELS = np.digitize(Y, [0])
INT, FLOAT, TRUE = np.int64(40), np.float32(0.3), np.bool_(True)


@pytest.mark.parametrize(
    "model",
    [
        SDNNClassifier(class_weight={0: 1.0, 1: 2.5}, **SMALL),
        SDNNClassifier(class_weight={label: np.float32(2) for label in np.unique(LABELS)}, **SMALL),
        SDNNRegressor(RandomInverse(n_bins=INT, length_scale=FLOAT), **SMALL),
        SDNNRegressor(WithMissing(base=RandomInverse(low=np.float32(-1), high=INT)), **SMALL),
        SDNNRegressor([(Symbolic(categories=np.arange(3)), ["b"])], **SMALL),
        SDNNRegressor([(Anchor(n_interpolated=np.int32(9)), FRAME.columns[:2])], **SMALL),
        SDNNRegressor([("anchor", range(2))], **SMALL),
        SDNNRegressor([("anchor", {"a", "b"})], **SMALL),
        SDNNRegressor([("anchor", pd.Series([True, False, True]))], **SMALL),
        SDNNRegressor([("anchor", slice(np.int64(0), np.int64(2)))], **SMALL),
        SDNNRegressor(pairs=np.array([[0, 1], [1, 2]]), n_jobs=np.int64(1), verbose=np.int64(0)),
        SDNNRegressor(output_range=pd.DataFrame([[-3, 3]]), early_stopping=TRUE, **SMALL),
    ],
)
def test_settings_of_numpy_and_pandas_types_are_saved(model, tmp_path):
    model.set_params(max_iter=2, n_pattern_units=np.int64(62)).fit(FRAME, LABELS)
    path = tmp_path / "model.safetensors"
    model.save(path)
    loaded = type(model).load(path)
    np.testing.assert_array_equal(loaded.predict(FRAME), model.predict(FRAME))
    assert loaded.codings_ == model.codings_
    if isinstance(model, SDNNClassifier):
        assert loaded.class_weight == model.class_weight
    elif not isinstance(model.coding, list):
        assert loaded.coding == model.coding
    # Unfitted copies of both learn the same.
    clones = [clone(estimator).set_params(random_state=0) for estimator in (loaded, model)]
    first, second = (unfitted.fit(FRAME, LABELS).weights_ for unfitted in clones)
    np.testing.assert_array_equal(first, second)


def test_columns_chosen_by_functions_or_iterators_cannot_be_saved(tmp_path):
    for columns in (lambda _: [0], iter([0]), b"a"):
        model = SDNNRegressor(**SMALL).fit(X, Y).set_params(coding=[("anchor", columns)])
        refuses("parameter", model.save, tmp_path / "model.safetensors", error=TypeError)


@pytest.mark.parametrize("name", MODELS)
def test_a_loaded_estimator_equals_the_saved_estimator(name, tmp_path):
    model, samples, targets = MODELS[name]
    model.fit(samples, targets)
    path = tmp_path / "model.safetensors"
    model.save(path)
    loaded = type(model).load(path)
    np.testing.assert_array_equal(loaded.predict(samples), model.predict(samples))
    np.testing.assert_array_equal(loaded.weights_, model.weights_)
    assert loaded.weights_.dtype == np.int32
    assert loaded.codings_ == model.codings_
    assert with_lists(loaded.get_params()) == with_lists(model.get_params())
    assert set(vars(loaded)) == set(vars(model))
    loaded.partial_fit(samples, targets)
    model.partial_fit(samples, targets)
    np.testing.assert_array_equal(loaded.weights_, model.weights_)


def test_load_refuses_the_file_of_another_class(tmp_path):
    path = tmp_path / "model.safetensors"
    SDNNClassifier(**SMALL).fit(X, Y > 0).save(path)
    refuses("SDNNClassifier", SDNNRegressor.load, path)


def nested(depth):
    """Return the description of a coding within a coding, and so on to this depth."""
    coding = {"coding": "random-inverse"}
    for _ in range(depth):
        coding = {"coding": "with-missing", "base": coding}
    return coding


@pytest.mark.parametrize(
    "change",
    [
        lambda description, arrays: arrays.update(output_range_=np.zeros((2, 2))),
        lambda description, arrays: description["attributes"].update(_counts_of_range=7),
        lambda description, arrays: description["attributes"].update(_flat=3),
        lambda description, arrays: description["attributes"].update(n_features_in_=2),
        lambda description, arrays: description["codings"][0].update(n_bins=3),
        lambda description, arrays: description["codings"].insert(0, nested(800)),
        lambda description, arrays: description.update(begun_with={"max_iter": 3}),
    ],
    ids=[
        "two outputs",
        "other range",
        "no bool",
        "two features",
        "few bins",
        "nested codings",
        "no setting of a network",
    ],
)
def test_inconsistent_parts_of_a_file_are_refused_as_damage(change, tmp_path):
    path = tmp_path / "model.safetensors"
    SDNNRegressor(**SMALL).fit(X, Y).save(path)  # three features and one output
    description, arrays = read_file(path, "estimator")
    change(description, arrays)
    write_file(path, "estimator", arrays, description)
    refuses("damaged", SDNNRegressor.load, path)


def test_custom_codings_cannot_be_saved(tmp_path):
    class Own(RandomInverse):
        """A coding of one's own."""

    model = SDNNRegressor(Own(), **SMALL).fit(X, Y)
    assert isinstance(model.codings_[0], Coding)
    refuses("sdnn.coding", model.save, tmp_path / "model.safetensors", error=TypeError)
