"""Weighted experts of a stream: regression, kernel regression and the network."""

import copy
import math
import pickle

import numpy as np
import pytest

from refusals import refuses
from sdnn import SDNNClassifier, SDNNRegressor, _core
from sdnn.coding import Symbolic, WithMissing
from sdnn.coding.numeric import RandomInverse
from sdnn.estimators.experts import MOST_COLUMNS, LinearColumns

pytestmark = pytest.mark.filterwarnings("ignore::sdnn.estimators.OutOfRangeWarning")

OPTIONS = {"n_pattern_units": 40, "random_state": 0}


def regressor(river, experts="linear", **options):
    model = SDNNRegressor(out_of_range="widen", **OPTIONS)
    return river.RiverRegressor(model, experts=experts, **options)


def classifier(river, experts="linear", **options):
    model = SDNNClassifier(correction_share=0.5, **OPTIONS)
    return river.RiverClassifier(model, experts=experts, **options)


def points(n_samples, n_inputs=4, seed=0):
    X = np.random.RandomState(seed).uniform(-1, 1, (n_samples, n_inputs))
    return [{f"x{i}": value for i, value in enumerate(row)} for row in X.tolist()]


def errors_of(model, rows, targets):
    """Learn the samples in order; return the error of each prediction before it is learned."""
    errors = []
    for x, y in zip(rows, targets, strict=True):
        errors.append(model.predict_one(x) - y)
        model.learn_one(x, y)
    return np.array(errors)


class SlowLeastSquares:
    """Recursive least squares by its formulas, without limits of weights and covariances."""

    def __init__(self, low, high, forgetting):
        self.middle, self.half = (high + low) / 2, (high - low) / 2
        self.P, self.w = 10 * np.eye(len(low) + 1), np.zeros(len(low) + 1)
        self.forgetting, self.origin = forgetting, None

    def columns(self, x):
        return np.append(1.0, (x - self.middle) / self.half)

    def predict(self, x):
        return self.origin + self.columns(x) @ self.w

    def learn(self, x, y):
        self.origin = y if self.origin is None else self.origin
        z = self.columns(x)
        gain = self.P @ z / (self.forgetting + z @ self.P @ z)
        self.w += gain * (y - self.predict(x))
        self.P = (self.P - np.outer(gain, self.P @ z)) / self.forgetting


@pytest.mark.parametrize("forgetting", [1.0, 0.98])
def test_recursive_least_squares_agrees_with_its_transcription(forgetting):
    random = np.random.RandomState(0)
    X = random.uniform(-1, 1, (300, 3)) * [1, 10, 0.1] + 5
    y = X @ [1.0, 0.2, 3.0] + random.normal(size=300)
    low, high = X.min(axis=0), X.max(axis=0)
    model = _core.RecursiveLeastSquares(low, high, 1, forgetting)
    slow = SlowLeastSquares(low, high, forgetting)
    for row, target in zip(X, y, strict=True):
        model.learn(row, [target])
        slow.learn(row, target)
    expected = [slow.predict(row) for row in X]
    np.testing.assert_allclose([model.predict(row)[0] for row in X], expected, rtol=1e-9)


def test_columns_are_numbers_and_indicators_of_categories_and_grow_with_new_ones():
    rows = [{"a": 2.0, "w": "u"}, {"a": None, "w": "v"}, {"a": 4.0}]
    codings = {"a": RandomInverse(), "w": WithMissing(base=Symbolic(categories=("u", "v")))}
    columns = LinearColumns()
    # Lowest and highest values of the number a and of the indicators of u and v.
    assert columns.add(codings, rows) == ([2.0, 0.0, 0.0], [4.0, 1.0, 1.0])
    np.testing.assert_array_equal(columns.row(rows[0]), [2.0, 1.0, 0.0])
    np.testing.assert_array_equal(columns.row({"w": "other", "b": 1.0}), [np.nan, 0.0, 0.0])
    # New are the indicator of x and the number b, whose only value is 7.
    more = {"w": Symbolic(categories=("u", "v", "x")), "a": RandomInverse(), "b": RandomInverse()}
    assert columns.add(more, [{"b": 7.0}]) == ([0.0, 7.0], [1.0, 7.0])
    np.testing.assert_array_equal(columns.row({"w": "x", "b": 1.0}), [np.nan, 0, 0, 1, 1])


def test_columns_are_limited():
    columns = LinearColumns()
    categories = Symbolic(categories=tuple(range(MOST_COLUMNS - 1)))
    codings = {
        "w": categories,
        "a": RandomInverse(),
        "b": RandomInverse(),
        "c": Symbolic(categories=("u", "v")),
    }
    # After the categories a single column is free: "a" has it, and "b" and "c" are left out.
    low, _ = columns.add(codings, [{"a": 1.0, "b": 2.0}])
    assert len(low) == MOST_COLUMNS == len(columns.row({"b": 1.0, "c": 1}))
    assert columns.numbers == {"a": MOST_COLUMNS - 1}


def test_a_linear_target_is_left_to_linear_regression(river):
    rows = points(600, 8)
    targets = [x["x0"] + 2 * x["x1"] - x["x2"] + 0.5 * x["x7"] for x in rows]
    model, alone = regressor(river), regressor(river, "network")
    # The first 200 samples are left out, in which all experts still learn.
    squares = [np.square(errors_of(m, rows, targets)[200:]).mean() for m in (model, alone)]
    assert squares[0] < 0.01 * squares[1]
    assert model.weights_["linear"] > 0.99
    assert alone.weights_ == {"network": 1.0}
    assert sum(model.weights_.values()) == pytest.approx(1.0)


def test_noise_is_left_to_the_mean_and_regression(river):
    noise = np.random.RandomState(1).normal(5.0, 1.0, 1500)
    model, rows = regressor(river), points(1500)
    errors = errors_of(model, rows, noise.tolist())[200:]
    assert np.square(errors).mean() < 1.02 * np.square(noise - noise.mean())[200:].mean()
    assert model.weights_["network"] < 0.3


def test_weights_of_experts_follow_a_drift_from_a_wave_to_a_line(river):
    rows = points(1600)
    wave = [math.sin(4 * x["x0"]) * x["x1"] for x in rows]
    line = [x["x0"] + x["x1"] for x in rows]
    model = regressor(river)
    errors_of(model, rows[:800], wave[:800])
    assert model.weights_["network"] > 0.7
    errors_of(model, rows[800:1300], line[800:1300])
    assert model.weights_["linear"] > 0.9
    assert np.abs(errors_of(model, rows[1300:], line[1300:])).mean() < 0.03


def test_without_other_experts_predictions_are_those_of_the_network(river):
    rows = points(150)
    targets = [x["x0"] * x["x1"] for x in rows]
    labels = [target > 0 for target in targets]
    for make, targets_or_labels in ((regressor, targets), (classifier, labels)):
        model = make(river, experts="network", grace_period=50)
        for x, y in zip(rows, targets_or_labels, strict=True):
            model.learn_one(x, y)
        expected = [model.fitted.predict_one(model._sample(x)) for x in rows]
        assert [model.predict_one(x) for x in rows] == expected
        assert model.mixed is None


def test_unknown_experts_are_refused(river):
    for experts in (None, 3, "kernel", ["linear"]):
        refuses("experts", river.RiverRegressor, experts=experts, error=(TypeError, ValueError))


@pytest.mark.parametrize("experts", ["linear", "window"])
def test_learning_does_not_depend_on_predictions(river, experts):
    rows = points(400)
    targets = [x["x0"] + math.sin(5 * x["x1"]) for x in rows]
    labels = ["low" if target < 0 else "high" for target in targets]
    for make, targets_or_labels in ((regressor, targets), (classifier, labels)):
        predicting, learning = make(river, experts), make(river, experts)
        for x, y in zip(rows, targets_or_labels, strict=True):
            predicting.predict_one(x)
            predicting.predict_one({**x, "x0": True})  # equals 1.0, but is not the learned sample
            predicting.learn_one(x, y)
            learning.learn_one(x, y)
        assert predicting.weights_ == learning.weights_
        assert [predicting.predict_one(x) for x in rows] == [learning.predict_one(x) for x in rows]


@pytest.mark.parametrize("experts", ["network", "linear", "window"])
@pytest.mark.parametrize("make", [regressor, classifier])
def test_copies_and_pickles_continue_learning_with_the_same_bits(river, make, experts):
    rows = [{**x, "word": "uvw"[i % 3]} for i, x in enumerate(points(300))]
    targets = [float(x["x0"] > 0) + (x["word"] == "u") for x in rows]
    model = make(river, experts)
    for x, y in zip(rows[:200], targets, strict=False):
        model.learn_one(x, y)
    others = [pickle.loads(pickle.dumps(model)), copy.deepcopy(model)]
    for x, y in zip(rows[200:], targets[200:], strict=True):
        expected = model.predict_one(x)
        model.learn_one(x, y)
        for other in others:
            assert other.predict_one(x) == expected
            other.learn_one(x, y)
    for other in others:
        assert other.weights_ == model.weights_
    fresh = model.clone()
    assert fresh.mixed is None
    assert list(fresh.weights_.values()) == [1.0], "a clone has learned nothing"


@pytest.mark.parametrize("experts", ["linear", "window"])
def test_features_that_come_late_and_go_are_learned_by_regression(river, experts):
    model, rows = regressor(river, experts), points(1500, 3)
    errors = []
    for number, x in enumerate(rows):
        y = x["x0"]
        if number < 500:
            del x["x2"]
        else:  # the feature x2 and a word appear, and the target depends on them
            x["word"] = "up" if number % 2 else "down"
            y += 2 * x["x2"] + (x["word"] == "up")
        if number % 7 == 0:
            del x["x1"]
        errors.append(abs(model.predict_one(x) - y))
        model.learn_one(x, y)
    assert set(model.mixed.columns.numbers) == {"x0", "x1", "x2"}
    assert set(model.mixed.columns.categories["word"]) == {"up", "down"}
    assert np.mean(errors[-200:]) < 0.02
    nothing_known = {"x0": None, "other": 3.0}
    assert model.predict_one({}) == model.predict_one(nothing_known)


def test_classes_with_a_linear_boundary_have_better_probabilities_with_regression(river):
    random = np.random.RandomState(2)
    rows = points(800, 8)
    names = ["no", "yes"]
    labels = [names[sum(x.values()) + 0.5 * random.normal() > 0] for x in rows]
    model, alone = classifier(river), classifier(river, "network")
    losses = {model: [], alone: []}
    for x, y in zip(rows, labels, strict=True):
        for either, its_losses in losses.items():
            its_losses.append(-math.log(max(either.predict_proba_one(x).get(y, 0.0), 1e-6)))
            either.learn_one(x, y)
    assert np.mean(losses[model][200:]) < np.mean(losses[alone][200:]) - 0.05
    shares = model.predict_proba_one(rows[0])
    assert sum(shares.values()) == pytest.approx(1.0)
    assert model.predict_one(rows[0]) == max(shares, key=shares.get)
    assert set(model.weights_) == {"prior", "linear", "network"}
    assert model.weights_["linear"] > 0.5


def test_a_class_that_appears_late_is_predicted_also_with_single_units(river):
    rows = points(500)
    order = np.argsort([x["x0"] > 0.4 for x in rows], kind="stable")  # class "high" comes last
    name = {False: "low", True: "middle"}
    model = classifier(river, "window", grace_period=40)
    single = river.RiverClassifier(SDNNClassifier(n_units_per_class=1, **OPTIONS), grace_period=40)
    for _ in range(3):
        for x in (rows[index] for index in order):
            label = "high" if x["x0"] > 0.4 else name[x["x0"] > -0.2]
            model.learn_one(x, label)
            single.learn_one(x, label)
        order = np.random.RandomState(0).permutation(order)
    for classifier_ in (model, single):
        assert classifier_.predict_one({**rows[0], "x0": 0.9}) == "high"
        assert classifier_.predict_one({**rows[0], "x0": -0.9}) == "low"


EXTREMES = [0.0, 1e300, -1e300, 1e-310, 1.7e308, -1.7e308, 5e-324, 1.0, None, 1e154, -1e-200]


@pytest.mark.parametrize("scale", [1.0, 1e-310, 1e300])
def test_extreme_inputs_and_targets_give_finite_predictions(river, scale):
    random = np.random.RandomState(0)
    model = regressor(river, "window", grace_period=20)
    for number in range(300):
        x = {"a": random.normal() * scale, "constant": 3.0, "b": EXTREMES[number % 11]}
        y = EXTREMES[(number * number) % 11]
        is_extreme = number > 40 and number % 3 == 0  # the grace period ends before
        if not is_extreme or y is None or abs(y) > 1e300:
            y = random.normal() * min(scale, 1e299)
        assert math.isfinite(model.predict_one(x)), number
        model.learn_one(x, y)
        assert all(0 <= weight <= 1 for weight in model.weights_.values())


def test_an_outlier_among_the_targets_is_soon_forgotten(river):
    rows = points(700)
    targets = [x["x0"] + x["x1"] for x in rows]
    targets[300] = 1e12
    for experts in ("linear", "window"):
        errors = errors_of(regressor(river, experts), rows, targets)
        assert np.abs(errors[-200:]).max() < 0.1


def test_the_window_expert_has_smaller_errors_on_a_smooth_function(river):
    rows = points(600)
    targets = [math.sin(3 * x["x0"]) * x["x1"] + x["x2"] ** 2 + x["x3"] for x in rows]
    model, linear = regressor(river, "window"), regressor(river)
    squares = [np.square(errors_of(m, rows, targets)[150:]).mean() for m in (model, linear)]
    assert squares[0] < 0.7 * squares[1], "mean squared errors after the first 150 samples"
    assert set(model.weights_) == {"mean", "linear", "window", "network"}
    assert model.weights_["window"] > 0.5
