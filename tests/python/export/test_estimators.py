"""Regressors and classifiers in C, compiled for this processor and compared bit for bit.

``nox -s emulation`` has other compilers and processors.
"""

import copy
import re
from pathlib import Path

import numpy as np
import pytest
from sklearn.datasets import make_friedman1
from sklearn.dummy import DummyRegressor
from sklearn.exceptions import NotFittedError

from c_estimators import (
    ESTIMATORS,
    LEARN,
    SMALL,
    check_learning,
    check_predictions,
    compiled,
    fitted,
    numbers,
)
from c_policies import SANITIZED, STRICT, STRICT_CPP, program, run
from refusals import refuses
from sdnn import SDNNClassifier, SDNNRegressor
from sdnn.coding import Circular, RandomInverse, Symbolic
from sdnn.estimators.network import Network
from sdnn.export import estimator_header, export_estimator_header, small_settings
from sdnn.export.estimators import CODE_BYTES

PAGE = Path(__file__).parents[3] / "docs" / "how-to" / "estimators-on-a-chip.md"
BINS = """
#include <stdio.h>
#include "model.h"
int main(void) {
  double x[2]; uint32_t bins[2];
  while (fread(x, sizeof *x, 2, stdin) == 2) {
    if (!model_bins_of(x, bins)) return 1;
    fwrite(bins, sizeof *bins, 2, stdout);
  }
  return 0;
}
"""


@pytest.mark.parametrize("name", ESTIMATORS)
def test_predictions_in_c_have_the_bits_of_the_estimator(name, target, tmp_path):
    # A compiled program predicts 300 samples; its doubles must equal those of `model.predict`.
    check_predictions(name, target, tmp_path, 300, *SANITIZED)


@pytest.mark.parametrize("name", ESTIMATORS)
def test_learning_in_c_has_the_bits_of_the_estimator(name, target, tmp_path):
    # A program and `model.learn_one` learn 150 samples; weights and predictions must stay equal.
    check_learning(name, target, tmp_path, 150, *SANITIZED)


@pytest.mark.parametrize("name", ["several-outputs", "categories", "plain-pairs"])
def test_any_doubles_have_defined_results(name, target, tmp_path):
    # The sanitizers end a program that computes what C leaves open.
    model, _ = fitted(name)
    export_estimator_header(model, tmp_path / "model.h", learning=True)
    random = np.random.default_rng(0)
    n_values = model.n_features_in_ + model.n_outputs_
    bits = random.integers(0, 2**64, (20_000, n_values), np.uint64)
    extremes = [0.0, -0.0, 5e-324, -2e-308, 1.7976931348623157e308, -1e308, np.inf, -np.inf, np.nan]
    values = np.where(random.random(bits.shape) < 0.5, bits.view(np.float64), 1.0)
    values = np.where(random.random(bits.shape) < 0.3, random.choice(extremes, bits.shape), values)
    written = run(*compiled(tmp_path, LEARN, target, *SANITIZED), input=values.tobytes())
    is_learned = np.frombuffer(written, np.float64, 20_000 * (model.n_outputs_ + 1))
    assert 0.0 < is_learned.reshape(20_000, -1)[:, -1].mean() < 1.0


@pytest.mark.parametrize("spacing", ["even", "quantile"])
def test_extreme_numbers_have_the_bins_of_the_coding(spacing, target, tmp_path):
    random = np.random.default_rng(0)
    X = random.integers(0, 2**64, (400, 2), np.uint64).view(np.float64)
    X = np.where(np.isfinite(X), np.clip(X, -1e300, 1e300), 0.0)
    X[::2] = random.uniform(-1e300, 1e300, (200, 2))
    coding = RandomInverse(spacing=spacing, n_bins=60)
    settings = SMALL | {"ranges": "all", "n_output_units": 10}
    model = SDNNRegressor(coding, **settings).fit(X[:300], np.arange(300.0))
    export_estimator_header(model, tmp_path / "model.h")
    written = run(*compiled(tmp_path, BINS, target, *SANITIZED), input=X.tobytes())
    expected = model.network_.input_code.bins(X)
    np.testing.assert_array_equal(np.frombuffer(written, "<i4").reshape(-1, 2), expected)
    assert len(np.unique(expected)) > 20


def test_values_at_the_limits_of_bins_have_the_bins_of_the_coding(target, tmp_path):
    # Neighbours of each limit, those of a circle too, whose places are rounded to nine decimals.
    coding = [(Circular(period=0.7, origin=0.1), [1])]
    X = np.array([[-0.3, 0.0], [1.7, 1.0]])
    model = SDNNRegressor(coding, n_output_units=10, **SMALL).fit(X, [0.0, 1.0])
    export_estimator_header(model, tmp_path / "model.h")
    n_even, n_circle = (coding.size for coding in model.codings_)
    limits = [-0.3 + 2.0 * np.arange(n_even + 1) / n_even, 0.1 + 0.7 * np.arange(999) / n_circle]
    around = [
        np.concatenate([np.nextafter(x, -9), x, np.nextafter(x, 9), x - 1e-10, x - 1e-9])
        for x in (np.resize(column, 999) for column in limits)
    ]
    table = np.stack(around, axis=1)
    written = run(*compiled(tmp_path, BINS, target, *SANITIZED), input=table.tobytes())
    expected = model.network_.input_code.bins(table)
    np.testing.assert_array_equal(np.frombuffer(written, "<i4").reshape(-1, 2), expected)


def test_a_sample_that_the_estimator_refuses_is_refused_in_c(target, tmp_path):
    model = SDNNRegressor([(Symbolic(), [1])], n_output_units=10, **SMALL)
    model.fit([[0.0, 1.0], [1.0, 2.0]], [0.0, 1.0])
    export_estimator_header(model, tmp_path / "model.h")
    source = """
        #include "model.h"
        int main(void) {
          double good[2] = {0.5, 2.0}, unknown[2] = {0.5, 3.0}, lacks[2], infinite[2] = {0.0, 1.0};
          double y[1] = {7.0};
          lacks[0] = model_missing();
          lacks[1] = 1.0;
          infinite[0] = model_number(1, 0) / 0.0;
          if (model_predict(unknown, y) || model_predict(lacks, y) || model_predict(infinite, y))
            return 1;
          return !(y[0] == 7.0 && model_predict(good, y) && y[0] < 7.0);
        }
    """
    run(*compiled(tmp_path, source, target))


def test_a_weight_that_would_exceed_16_bits_is_not_learned(target, tmp_path):
    model = SDNNClassifier(**SMALL, n_units_per_class=1)
    model.fit(numbers(50, 1), np.arange(50) % 2)
    export_estimator_header(model, tmp_path / "model.h", learning=True)
    source = """
        #include "model.h"
        static model_model model;
        int main(void) {
          const double x[MODEL_N_FEATURES] = {0.5, 0.5, 0.5};
          const uint32_t n = MODEL_N_COLUMNS * MODEL_N_UNITS;
          uint32_t i;
          model_begin(&model);
          model.largest[0] = model.largest[1] = 32767;
          for (i = 0; i < n; ++i) model.weights[i] = 32767;
          /* Both units are on one side, so that either label needs a correction. */
          if (model_learn(&model, x, 0) || model_learn(&model, x, 1)) return 1;
          for (i = 0; i < n; ++i) {
            if (model.weights[i] != 32767) return 2;
          }
          for (i = 0; i < n; ++i) model.weights[i] = 5; /* far from the known bound */
          if (!model_learn(&model, x, 0) || !model_learn(&model, x, 1)) return 3;
          /* A bound at the limit is found anew, 5, and a correction raises it to 6. */
          return model.largest[0] + model.largest[1] > 6 + 32767;
        }
    """
    run(*compiled(tmp_path, source, target, *SANITIZED))


@pytest.mark.parametrize("compiler", ["g++", "clang++"])
@pytest.mark.parametrize("name", ["several-outputs", "one-vs-one"])
def test_the_headers_are_cpp(compiler, name, needs, tmp_path):
    needs(compiler)
    model, _ = fitted(name)
    for header, learning in (("greedy", False), ("learner", True)):
        export_estimator_header(model, tmp_path / f"{header}.h", learning=learning)
    source = """
        #include "greedy.h"
        #include "learner.h"
        static learner_model model;
        int main() {
          learner_begin(&model);
          return sizeof(model) == SIZE ? 0 : 1;
        }
    """
    size = estimator_header(model, "learner", learning=True).ram_bytes
    run(program(tmp_path, source.replace("SIZE", str(size)), compiler, *STRICT_CPP))


def test_names_of_columns_neither_begin_nor_end_a_comment(target, tmp_path):
    pandas = pytest.importorskip("pandas")
    names = ["*/ int x;", "/*/", "*\\\n/ int y;", "*??/\n/ int z;", "größe"]
    table = pandas.DataFrame(np.random.default_rng(0).random((60, len(names))), columns=names)
    model = SDNNRegressor(**{**small_settings(len(names)), "max_iter": 2}, random_state=0)
    model.fit(table, table.sum(axis=1))
    export_estimator_header(model, tmp_path / "model.h")
    text = (tmp_path / "model.h").read_text()
    assert [f"x[{i}], " in text for i in range(len(names))] == [True] * len(names)
    assert "gr\\xf6\\xdfe" in text  # letters beyond ASCII are escaped
    run(*compiled(tmp_path, '#include "model.h"\nint main(void) { return 0; }', target))


@pytest.mark.parametrize("n_inputs", [1, 2, 4, 7, 20])
@pytest.mark.parametrize("groups", [{}, {"n_outputs": 3}, {"n_classes": 2}, {"n_classes": 12}])
def test_small_settings_fit_a_small_processor(n_inputs, groups):
    X = numbers(150, 1, n_inputs)
    settings = small_settings(n_inputs, **groups) | {"max_iter": 7, "random_state": 0}
    if "n_classes" in groups:
        model = SDNNClassifier(**settings).fit(X, np.arange(150) % groups["n_classes"])
    else:
        y = np.cos(np.outer(X.sum(axis=1), np.arange(1, 1 + groups.get("n_outputs", 1))))
        model = SDNNRegressor(**settings).fit(X, y)
    assert {index for pair in model.pairs_ for index in pair} == set(range(n_inputs))
    greedy = estimator_header(model, "model", flash_bytes=2**17)
    # In 128 kB of flash and 64 kB of RAM, a prediction takes 4 kB of RAM, learning all of it, with
    # the arrays on the stack and the 640 bytes that the header states for all else there.
    assert greedy.ram_bytes < 2**12
    learner = estimator_header(model, "model", learning=True)
    (stack_bytes,) = re.findall(r" ([\d,]+) bytes of arrays", learner.text)
    assert learner.ram_bytes + int(stack_bytes.replace(",", "")) + 640 < 2**16
    # A byte of constants has at most 3.5 characters, and code and comments some 30,000.
    assert len(greedy.text) < 3.5 * greedy.flash_bytes + 30_000


def test_small_settings_score_like_the_default():
    X, y = make_friedman1(700, 5, noise=1.0, random_state=3)
    y -= 5 * X[:, 4]
    fit, held_out = np.split(np.arange(700), [500])
    scores = [
        SDNNRegressor(**settings, random_state=0)
        .fit(X[fit, :4], y[fit])
        .score(X[held_out, :4], y[held_out])
        for settings in ({}, small_settings(4))
    ]
    assert scores[1] > scores[0] - 0.03


def test_small_settings_refuse_outputs_with_classes():
    refuses("n_classes", small_settings, 3, n_outputs=1, n_classes=2)
    refuses("n_classes", small_settings, 3, n_classes=1)
    refuses("n_inputs", small_settings, 0)


def test_a_header_above_the_limit_of_flash_is_refused_with_size_and_remedy(tmp_path):
    model, _ = fitted("several-outputs")
    header = estimator_header(model, "model")
    needed = header.flash_bytes + CODE_BYTES
    estimator_header(model, "model", flash_bytes=needed)
    path = tmp_path / "model.h"
    message = f"at least {needed}, .*weights: {header.weight_bytes}.*small_settings"
    with pytest.raises(ValueError, match=message):
        export_estimator_header(model, path, flash_bytes=needed - 1)
    assert not path.exists()
    refuses("flash_bytes", estimator_header, model, "model", flash_bytes=0)


def test_the_example_corrects_a_sensor_that_drifts(target, tmp_path):
    code = re.search("```python\n(.*?)```", PAGE.read_text(), re.DOTALL)[1]
    names = {}
    exec(code.replace("sensor.safetensors", str(tmp_path / "sensor.safetensors")), names)
    header = export_estimator_header(names["model"], tmp_path / "sensor.h", learning=True)
    assert header.flash_bytes + CODE_BYTES < 2**17  # the 128 kB of a small processor
    example = PAGE.parents[1] / "examples" / "c" / "drift.c"
    run(target.compiler, *STRICT, "-I", tmp_path, example, "-o", tmp_path / "drift", "-lm")
    first, corrected = map(int, run(tmp_path / "drift").split())
    assert corrected < first / 4
    assert f"is {first} ppm without learning" in PAGE.read_text()
    assert f"it is {corrected} ppm" in PAGE.read_text()


def test_names_on_the_page_exist_in_the_headers():
    named = set(re.findall(r"`((?:sensor|SENSOR)_\w+)", PAGE.read_text()))
    assert len(named) > 8
    regressor, classifier = fitted("categories")[0], fitted("two-classes")[0]
    texts = [
        estimator_header(model, "sensor", learning=learning).text
        for model in (regressor, classifier)
        for learning in (False, True)
    ]
    named.remove("sensor_categories_2")
    assert "sensor_categories_0[]" in texts[0]
    assert {name for name in named if not re.search(rf"\b{name}\b", "".join(texts))} == set()


def test_few_weights_beyond_a_byte_take_little_flash():
    model, _ = fitted("wide-weights")
    is_wide = (model.weights_ > 127) | (model.weights_ < -128)
    assert is_wide[:4].mean() > 0.5
    assert 0 < is_wide[4:].sum() < 9
    header = estimator_header(model, "model")
    n_networks = 1 + len(model._earlier)
    # Words of four units: three rows of bytes a network, and a row of second bytes.
    n_words = model.weights_.shape[1] * (3 * n_networks + 1)
    # A network has a struct of 20 bytes, 12 thresholds of four bytes, and the numbers of bytes of
    # three groups of units; a wide weight has a struct of 8 bytes.
    bytes_of_networks = n_networks * (20 + 12 * 4 + 3)
    assert header.weight_bytes == 4 * n_words + bytes_of_networks + 8 * int(is_wide[4:].sum())


def test_a_folder_is_no_path_of_a_header(tmp_path):
    refuses("path", export_estimator_header, fitted("one-pair")[0], tmp_path)


def test_estimators_without_a_form_in_c_are_refused_with_a_remedy():
    X, y = numbers(40, 1), np.arange(40.0)
    refuses("name", estimator_header, fitted("one-pair")[0], "int a")
    refuses("model", estimator_header, DummyRegressor().fit(X, y), "model", error=TypeError)
    with pytest.raises(NotFittedError):
        estimator_header(SDNNRegressor(), "model")
    for coding, values, message in (
        (Circular(period=1e200), X[:, 0], "period and an origin within"),
        (Symbolic(), np.resize([2**53 + 1, 1], 40).tolist(), "exact as floats"),
        (RandomInverse(spacing="quantile"), 5e-324 * np.arange(40), "close together"),
    ):
        table = X.astype(object)
        table[:, 2] = values
        model = SDNNRegressor([(coding, [2])], n_output_units=4, **SMALL).fit(table, y)
        with pytest.raises(ValueError, match=f"column 2 .*{message}"):
            estimator_header(model, "model")


def test_weights_beyond_the_two_bytes_of_a_header_are_refused():
    model, _ = fitted("one-pair")
    changed = copy.deepcopy(model)
    layer = model.network_.layer
    weights = layer.weights
    weights[0, 0] = 40_000  # above the limit of 127 * 256 = 32,512
    code = model.network_.input_code
    changed.network_ = Network(code, 1, weights=weights, thresholds=layer.thresholds)
    for learning in (False, True):
        with pytest.raises(ValueError, match=r"up to 32512 .* got 40000: train with a smaller max"):
            estimator_header(changed, "model", learning=learning)
