"""Estimators exported as C headers, with docstrings of what they cover, and checks of the code."""

import copy
import functools
import warnings

import numpy as np

from c_policies import STRICT, run
from sdnn import SDNNClassifier, SDNNRegressor
from sdnn.coding import Anchor, Circular, CorrelationMatrix, RandomInverse, Symbolic, WithMissing
from sdnn.estimators.network import Network
from sdnn.export import export_estimator_header
from small_estimators import SMALL_ESTIMATORS

SMALL = {"n_pattern_units": 24, "max_iter": 8, "random_state": 0}
COLORS = ("blue", "gr\u00fcn", "red")
SIZES = (1.0, 2.5, -4.0, 0.0)


def numbers(n_samples, seed, n_features=3):
    """Return uniform numbers in [-0.2, 1.2]."""
    return np.random.default_rng(seed).uniform(-0.2, 1.2, (n_samples, n_features))


def lacking(n_samples, seed):
    """Return numbers of which some are missing, a constant column, and numbers as categories."""
    random = np.random.default_rng(seed)
    X = numbers(n_samples, seed, 4)
    X[:, 1] = 2.5
    X[:, 3] = random.choice(SIZES, n_samples)
    X[random.random(n_samples) < 0.1, 0] = np.nan
    X[random.random(n_samples) < 0.1, 3] = np.nan
    return X


def words(n_samples, seed):
    """Return words that may be missing or unknown, numbers, days of the week and angles."""
    random = np.random.default_rng(seed)
    X = np.empty((n_samples, 4), object)
    X[:, 0] = random.choice([*COLORS, "pink", None], n_samples)
    X[:, 1] = random.normal(size=n_samples) * 1e3
    X[:, 2] = random.integers(0, 7, n_samples).tolist()
    X[:, 3] = random.uniform(-1e3, 1e3, n_samples).tolist()
    return X


def targets(X, n_outputs):
    """Return functions of the samples, as a vector or as columns of several outputs."""
    table = np.array([[hash_of(value) for value in row] for row in X])
    waves = [np.sin((1 + k) * table).sum(axis=1) * 10.0**k for k in range(n_outputs)]
    return waves[0] if n_outputs == 1 else np.stack(waves, axis=1)


def labels(X, n_classes):
    """Return numbers of equally frequent classes, by the ranks of a target."""
    ranks = targets(X, 1).argsort().argsort()
    return ranks * n_classes // len(X)


def hash_of(value):
    """Return a number for a value of any type."""
    if value is None or value != value:
        return 9.0
    return float(len(value)) if isinstance(value, str) else float(value)


def several_outputs():
    """Four networks, three outputs, missing values, a constant column, numbers as categories."""
    coding = [(WithMissing(base=Symbolic(categories=SIZES)), [3])]
    model = SDNNRegressor(coding, n_output_units=37, **SMALL)
    return model.fit(X := lacking(300, 1), targets(X, 3)), lacking


def categories():
    """Words, a matrix of correlations, a circle and quantiles; separate tables."""
    away = np.abs(np.subtract.outer(np.arange(7), np.arange(7)))
    coding = [
        (WithMissing(base=Symbolic(categories=COLORS)), [0]),
        (RandomInverse(spacing="quantile"), [1]),
        (CorrelationMatrix(matrix=0.8**away), [2]),
        (Circular(period=360.0, origin=-17.3), [3]),
    ]
    model = SDNNRegressor(coding, n_output_units=30, tables="separate", **SMALL)
    return model.fit(X := words(300, 2), targets(X, 1)), words


def plain_pairs():
    """Anchors, a plain pattern, an input that no pair uses, a single network."""
    settings = SMALL | {"n_pattern_units": 300, "n_averaged_epochs": 1}
    pairs = [(0, None), (2, 0)]
    model = SDNNRegressor(Anchor(n_interpolated=7), n_output_units=21, pairs=pairs, **settings)
    return model.fit(X := numbers(300, 3), targets(X, 1)), numbers


def wide_weights():
    """Units with many or few weights of more than a byte, a tiny range of outputs far from 0."""
    X = numbers(200, 4, 2)
    y = 1e6 + 1e-3 * np.random.default_rng(0).normal(size=200)
    model = SDNNRegressor(n_output_units=9, **SMALL).fit(X, y)
    network, code = model.network_, model.network_.input_code
    factors = np.array([70, 70, 1, -70, 1, 1, 1, 1, 1])
    weights = network.layer.weights * factors[:, None]
    weights[6, ::9] += [300, -700, 129, -200, 128, 5]
    thresholds = network.layer.thresholds * factors
    model.network_ = Network(code, 9, weights=weights.astype(np.int32), thresholds=thresholds)
    return model, lambda n_samples, seed: numbers(n_samples, seed, 2)


def two_classes():
    """Two classes of several units."""
    model = SDNNClassifier(**SMALL, n_units_per_class=13)
    return model.fit(X := lacking(300, 5), labels(X, 2)), lacking


def many_classes():
    """Labels that are words, and more classes than a byte has numbers."""
    model = SDNNClassifier(**SMALL, n_units_per_class=2)
    X = numbers(900, 6)
    return model.fit(X, [f"class {c}" for c in labels(X, 300)]), numbers


def single_units():
    """A unit for each class, whose potential is its score."""
    model = SDNNClassifier(**SMALL, n_units_per_class=1, n_averaged_epochs=3)
    return model.fit(X := numbers(300, 7), labels(X, 5)), numbers


def one_vs_one():
    """Units for pairs of classes; the mean of three networks is rounded."""
    settings = SMALL | {"scheme": "one_vs_one", "n_averaged_epochs": 3}
    return SDNNClassifier(**settings).fit(X := numbers(300, 8), labels(X, 6)), numbers


def one_pair():
    """A unit for the only pair of classes."""
    model = SDNNClassifier(**SMALL, scheme="one_vs_one")
    return model.fit(X := numbers(300, 9), labels(X, 2)), numbers


def widening():
    """A range of outputs that learning widens."""
    model = SDNNRegressor(n_output_units=37, out_of_range="widen", **SMALL)
    return model.fit(X := numbers(300, 10), 0.1 * targets(X, 2)), numbers


def averaging():
    """A share of corrected units below 1."""
    model = SDNNRegressor(n_output_units=37, correction_share=0.3, **SMALL)
    return model.fit(X := numbers(300, 11), targets(X, 1)), numbers


def strict():
    """Inputs and outputs that are refused because they are outside their ranges."""
    model = SDNNRegressor(n_output_units=20, out_of_range="error", **SMALL)
    X = numbers(300, 12)
    return model.fit(X, 0.5 * targets(X, 1)), lambda n, seed: 1.2 * numbers(n, seed)


ESTIMATORS = {
    "several-outputs": several_outputs, "categories": categories, "plain-pairs": plain_pairs,
    "wide-weights": wide_weights, "two-classes": two_classes, "many-classes": many_classes,
    "single-units": single_units, "one-vs-one": one_vs_one, "one-pair": one_pair,
    "widening": widening, "averaging": averaging, "strict": strict,
}  # fmt: skip


@functools.cache
def fitted(name):
    """Return the estimator with this name, and a function that draws samples."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return (ESTIMATORS | SMALL_ESTIMATORS)[name]()


SIZES_OF_RESULTS = """
#if MODEL_IS_CLASSIFIER
#define N_RESULTS (1 + MODEL_N_CLASSES)
#define N_TARGETS 1
#else
#define N_RESULTS MODEL_N_OUTPUTS
#define N_TARGETS MODEL_N_OUTPUTS
#endif
"""
PREDICT = """
#include <stdio.h>
#include "model.h"
int main(void) {
  static double x[MODEL_N_FEATURES], y[N_RESULTS];
  while (fread(x, sizeof *x, MODEL_N_FEATURES, stdin) == MODEL_N_FEATURES) {
#if MODEL_IS_CLASSIFIER
    y[0] = model_number(model_predict(x), 0);
    if (!model_scores(x, y + 1)) return 1;
#else
    if (!model_predict(x, y)) return 1;
#endif
    fwrite(y, sizeof *y, N_RESULTS, stdout);
  }
  return 0;
}
"""


LEARN = """
#include <stdio.h>
#include "model.h"
static model_model model;
int main(void) {
  static double x[MODEL_N_FEATURES], y[N_TARGETS], z[1 + N_RESULTS];
  model_begin(&model);
  while (fread(x, sizeof *x, MODEL_N_FEATURES, stdin) == MODEL_N_FEATURES) {
    if (fread(y, sizeof *y, N_TARGETS, stdin) != N_TARGETS) return 1;
#if MODEL_IS_CLASSIFIER
    z[0] = model_number(model_predict(&model, x), 0);
    if (!model_scores(&model, x, z + 1)) z[1] = model_missing();
    z[N_RESULTS] = model_number(model_learn(&model, x, (uint32_t)model_fixed(y[0], 0)), 0);
#else
    if (!model_predict(&model, x, z)) z[0] = model_missing();
    z[N_RESULTS] = model_number(model_learn(&model, x, y), 0);
#endif
    fwrite(z, sizeof *z, 1 + N_RESULTS, stdout);
  }
  fwrite(model.weights, sizeof *model.weights, MODEL_N_COLUMNS * MODEL_N_UNITS, stdout);
  fwrite(model.thresholds, sizeof *model.thresholds, MODEL_N_UNITS, stdout);
#if !MODEL_IS_CLASSIFIER
  fwrite(model.ranges, sizeof *model.ranges, 2 * MODEL_N_OUTPUTS, stdout);
#endif
  return 0;
}
"""


def rows_in_c(model, X):
    """Return samples as C reads them: numbers for words, one more if unknown, NaN if missing."""
    X = np.array(X, object)
    for index, coding in enumerate(model.codings_):
        base = coding.base if isinstance(coding, WithMissing) else coding
        categories = list(getattr(base, "categories", None) or ())
        if any(isinstance(category, str) for category in categories):
            numbers = {word: number for number, word in enumerate(categories)} | {None: np.nan}
            X[:, index] = [numbers.get(word, len(categories)) for word in X[:, index]]
    return X.astype(np.float64)


def compiled(folder, source, target, *options):
    """Compile a program with a header in its folder; return its command."""
    include = '#include "model.h"\n'
    (folder / "program.c").write_text(source.replace(include, include + SIZES_OF_RESULTS))
    return target.compile(folder / "program.c", *STRICT, "-O2", *options)


def predictions(model, X):
    """Return outputs as the program writes them, or the class and the scores of all classes."""
    if isinstance(model, SDNNRegressor):
        return model.predict(X).reshape(len(X), -1)
    winners = np.searchsorted(model.classes_, model.predict(X))
    scores = model.decision_function(X)
    if model._n_units_each > 1:
        scores = model._scores(model._bins(X), 1)
    elif scores.ndim == 1:
        scores = np.stack([-scores, scores], axis=1)
    return np.column_stack([winners, scores])


def check_predictions(name, target, folder, n_samples, *options):
    """Check that the compiled predictions have the bits of the estimator's."""
    model, draw = fitted(name)
    export_estimator_header(model, folder / "model.h")
    X = draw(n_samples, 11)
    written = run(*compiled(folder, PREDICT, target, *options), input=rows_in_c(model, X).tobytes())
    expected = predictions(model, X)
    assert len(np.unique(expected[:, 0])) > 1
    bits = np.frombuffer(written, np.int64).reshape(expected.shape)
    np.testing.assert_array_equal(bits, expected.view(np.int64))


def targets_to_learn(model, X):
    """Return targets, some outside the range of `fit`, or the numbers of classes."""
    if isinstance(model, SDNNClassifier):
        return labels(X, len(model.classes_)).astype(np.float64)[:, None]
    y = targets(X, model.n_outputs_).reshape(len(X), -1)
    low, high = model.output_range_.T
    middle = y.mean(axis=0)
    return (low + high) / 2 + 0.6 * (high - low) * (y - middle) / np.abs(y - middle).max(axis=0)


def learned_in_python(model, X, y):
    """Learn samples; return what the program writes for each: its predictions, and 1 if learned.

    Predictions are NaN where the sample is refused.
    """
    n_results = predictions(model, X[:1]).shape[1]
    rows = np.full((len(X), n_results + 1), np.nan)
    rows[:, -1] = 0
    for row, (sample, target) in enumerate(zip(X, y, strict=True)):
        try:
            rows[row, :-1] = predictions(model, sample[None])[0]
        except ValueError:
            continue
        try:
            if isinstance(model, SDNNClassifier):
                model.learn_one(sample, model.classes_[int(target[0])])
            else:
                model.learn_one(sample, float(target[0]) if model._flat else target)
        except ValueError:
            continue
        rows[row, -1] = 1
    return rows


def check_learning(name, target, folder, n_samples, *options):
    """Check that a compiled learner has the bits of predictions, weights, thresholds and ranges."""
    fitted_model, draw = fitted(name)
    model = copy.deepcopy(fitted_model)
    X = draw(n_samples, 12)
    y = targets_to_learn(model, X)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if model._earlier:
            learned_in_python(model, X[:40], y[:40])  # predictions are then those of one network
        assert model._earlier == ()
        export_estimator_header(model, folder / "model.h", learning=True)
        before = model.weights_
        expected = learned_in_python(model, X, y)
    assert np.any(before != model.weights_)
    assert expected[:, -1].mean() > 0.2
    command = compiled(folder, LEARN, target, *options)
    written = run(*command, input=np.hstack([rows_in_c(model, X), y]).tobytes())
    results = np.frombuffer(written, np.float64, expected.size).reshape(expected.shape)
    is_predicted = ~np.isnan(expected).any(axis=1)
    np.testing.assert_array_equal(results[:, -1], expected[:, -1])
    results, expected = results[is_predicted], expected[is_predicted]
    np.testing.assert_array_equal(results.view(np.int64), expected.view(np.int64))
    state = written[8 * is_predicted.size * expected.shape[1] :]  # after 8 bytes for each result
    weights = np.frombuffer(state, np.int16, model.weights_.size)
    np.testing.assert_array_equal(weights, model.weights_.T.reshape(-1))
    thresholds = np.frombuffer(state[weights.nbytes :], np.int32, len(model.thresholds_))
    np.testing.assert_array_equal(thresholds, model.thresholds_)
    ranges = state[weights.nbytes + thresholds.nbytes :]
    assert ranges == getattr(model, "output_range_", np.empty(0)).tobytes()
