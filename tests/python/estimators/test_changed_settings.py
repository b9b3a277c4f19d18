"""Settings that change between two calls: those of the network are refused, others take effect."""

import copy
import pickle

import numpy as np
import pandas as pd
import pytest

from refusals import refuses
from sdnn import SDNNClassifier, SDNNRegressor
from sdnn.coding import Circular, CorrelationMatrix, RandomInverse, Symbolic, WithMissing

X = np.random.RandomState(0).uniform(size=(60, 3))
Y = X[:, 0] * X[:, 1]
LABELS = (Y > 0.2).astype(int)
FRAME = pd.DataFrame(X, columns=["a", "b", "c"])
OPTIONS = {"n_pattern_units": 16, "random_state": 0, "max_iter": 1}

OF_BOTH = {
    "coding": "anchor",
    "ranges": "robust",
    "n_pattern_units": 32,
    "pairs": [(0, 1)],
    "tables": "separate",
}
CHANGES = [
    *((SDNNRegressor, *change) for change in OF_BOTH.items()),
    (SDNNRegressor, "n_output_units", 70),
    (SDNNRegressor, "output_range", (0, 1)),
    *((SDNNClassifier, *change) for change in OF_BOTH.items()),
    (SDNNClassifier, "scheme", "one_vs_one"),
    (SDNNClassifier, "n_units_per_class", 4),
]


def saved_and_loaded(model, tmp_path):
    model.save(tmp_path / "model.safetensors")
    return type(model).load(tmp_path / "model.safetensors")


@pytest.mark.parametrize("is_loaded", [False, True])
@pytest.mark.parametrize(("estimator", "name", "value"), CHANGES)
def test_no_network_resumes_with_other_settings_of_it(estimator, name, value, is_loaded, tmp_path):
    model = estimator(**OPTIONS).fit(X, LABELS)
    weights, former = model.weights_, getattr(model, name)
    setattr(model, name, value)
    if is_loaded:
        model = saved_and_loaded(model, tmp_path)
    error = refuses(name, model.partial_fit, X, LABELS)
    for part in (str(former), str(getattr(model, name)), "warm_start=False", "clone"):
        assert part in str(error)
    refuses(name, model.learn_one, X[0], 1)
    refuses(name, model.set_params(warm_start=True).fit, X, LABELS)
    np.testing.assert_array_equal(model.weights_, weights)
    model.set_params(**{name: former}).partial_fit(X, LABELS)
    model.set_params(**{name: value}, warm_start=False).fit(X, LABELS)


PERIODIC = [(Circular(period=1.0), ["a"]), ("anchor", ["b", "c"])]
WEEK = [(CorrelationMatrix(matrix=np.eye(2), categories=(0, 1)), [0])]
UNKNOWN = [(WithMissing(base=Symbolic(categories=(1, float("nan")))), [0])]
SAME = {
    "number": ({"n_pattern_units": 16}, {"n_pattern_units": np.float64(16.0)}),
    "name": ({"coding": "anchor"}, {"coding": [("anchor", slice(None))]}),
    "default": ({"coding": "random-inverse"}, {"coding": RandomInverse(length_scale=0.50)}),
    "columns": (
        {"coding": PERIODIC},
        {"coding": ((Circular(period=1), 0), ("anchor", np.array([False, True, True])))},
    ),
    "matrix": (
        {"coding": WEEK},
        {"coding": [(CorrelationMatrix(matrix=[[1, 0], [0, 1]], categories=[0.0, 1.0]), 0)]},
    ),
    "NaN": (
        {"coding": UNKNOWN},
        {"coding": [(WithMissing(base=Symbolic(categories=[1.0, np.float64("nan")])), 0)]},
    ),
    "names": ({"pairs": [("a", "b"), ("c", None)]}, {"pairs": np.array([(2, None), (0, 1)])}),
    "all": ({"pairs": "all"}, {"pairs": [(i, j) for i in range(3) for j in range(3) if i != j]}),
    "range": ({"output_range": (0, 1)}, {"output_range": np.array([[0.0, 1.0]])}),
}


@pytest.mark.parametrize(("settings", "same"), SAME.values(), ids=SAME)
def test_equal_settings_of_other_types_are_no_change(settings, same, tmp_path):
    frame = FRAME.assign(a=LABELS) if settings.get("coding") in (WEEK, UNKNOWN) else FRAME
    model = SDNNRegressor(**{**OPTIONS, **settings}).fit(frame, Y)
    for resumed in (model, saved_and_loaded(model, tmp_path), copy.deepcopy(model)):
        resumed.set_params(**same).partial_fit(frame, Y)
        resumed.set_params(warm_start=True, **settings).partial_fit(frame, Y)


@pytest.mark.parametrize("estimator", [SDNNRegressor, SDNNClassifier])
def test_settings_may_become_those_that_the_network_has(estimator):
    model = estimator(random_state=0, max_iter=1).fit(FRAME, LABELS)
    codings = [(coding, [index]) for index, coding in enumerate(model.codings_)]
    model.set_params(coding=codings, pairs=model.pair_names_)
    model.set_params(n_pattern_units=model.network_.input_code.core.n_units)
    if estimator is SDNNRegressor:
        model.set_params(n_output_units=280, output_range=model.output_range_)  # the default
    else:
        model.set_params(n_units_per_class=60)  # the default of few classes
    model.partial_fit(FRAME, LABELS)


def test_a_list_that_is_changed_in_place_is_a_change():
    pairs, limits = [(0, 1), (1, 0)], np.array([0.0, 1.0])
    model = SDNNRegressor(pairs=pairs, output_range=limits, **OPTIONS).fit(X, Y)
    pairs.append((2, None))
    refuses("pairs", model.partial_fit, X, Y)
    pairs.pop()
    limits[1] = 2.0
    refuses("output_range", model.learn_one, X[0], 0.5)


def test_a_model_whose_function_of_columns_was_replaced_can_be_saved(tmp_path):
    coding = [("anchor", lambda table: [0, 1, 2])]
    model = SDNNRegressor(**{**OPTIONS, "coding": coding}).fit(X, Y)
    loaded = saved_and_loaded(model.set_params(coding="anchor"), tmp_path)
    np.testing.assert_array_equal(loaded.partial_fit(X, Y).n_iter_, 2)


def test_settings_of_learning_stay_changeable():
    changes = {
        "max_iter": 2,
        "n_averaged_epochs": 1,
        "correction_share": 0.5,
        "shuffle": False,
        "early_stopping": True,
        "training": "plain",
        "memory_limit": 2**28,
        "random_state": 7,
        "n_jobs": 2,
        "out_of_range": "widen",
    }
    model = SDNNRegressor(**OPTIONS, warm_start=True).fit(X, Y)
    model.set_params(**changes).fit(X, Y).partial_fit(X, Y).learn_one(X[0], 0.5)
    assert model.n_iter_ == 2 + 2, "two epochs of fit, partial_fit and learn_one"


def stream(river, n_samples, **options):
    model = river.RiverRegressor(SDNNRegressor(**OPTIONS), grace_period=20, **options)
    for x, y in zip(FRAME.to_dict("records")[:n_samples], Y.tolist(), strict=False):
        model.learn_one(x, y)
    return model


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("model.coding", "anchor"),
        ("model.n_pattern_units", 32),
        ("model.output_range", (0, 1)),
        ("model.correction_share", 0.5),
        ("model", SDNNClassifier()),
        ("experts", "network"),
        ("follows_ranges", False),
        ("coverage", 0.5),
    ],
)
def test_no_stream_resumes_with_other_settings(river, name, value):
    model = pickle.loads(pickle.dumps(stream(river, 30)))
    owner = model.model if name.startswith("model.") else model
    attribute = name.removeprefix("model.")
    former = getattr(owner, attribute)
    setattr(owner, attribute, value)
    refuses(name, model.learn_one, {"a": 0.5, "b": 0.5, "c": 0.5}, 0.25)
    assert model.n_learned == 30
    setattr(owner, attribute, former)
    model.learn_one({"a": 0.5, "b": 0.5, "c": 0.5}, 0.25)


def test_settings_of_a_stream_may_change_before_it_begins_or_if_they_do_not_matter(river):
    model = stream(river, 10)
    model.model.set_params(n_pattern_units=32)
    model.experts = "linear"
    for x, y in zip(FRAME.to_dict("records"), Y.tolist(), strict=True):
        model.learn_one(x, y)
    assert model.fitted.network_.input_code.core.n_units == 32
    model.model.set_params(verbose=1, n_jobs=2, coding=RandomInverse())
    model.learn_one(FRAME.to_dict("records")[0], 0.5)
