"""The estimators have the bits of their transcription in NumPy."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

import estimator_transcription
from sdnn import SDNNClassifier, SDNNRegressor
from sdnn.coding import RandomInverse

# Drawn inputs may have outliers, which change no comparison.
pytestmark = pytest.mark.filterwarnings("ignore::sdnn.estimators.OutlierWarning")


def transcribed(model):
    """Return the layer in NumPy, with the tables and first weights of the model's network."""
    input_code = model.network_.input_code
    code = estimator_transcription.SelectiveDesensitization(
        input_code.modified, input_code.modifiers, input_code.core_pairs
    )
    return estimator_transcription.ParallelPerceptron(code, model.weights_, model.thresholds_)


def untrained(model, X, y):
    """Return the model before its first sample, and its targets in the form of the trainer."""
    table, targets = model._check_samples(X, y, codings=None)
    model._begin(X, table, targets)
    return model, model._targets(targets)


@st.composite
def problems(draw):
    """Draw samples, some with ties and constant inputs, targets, options, and orders of epochs."""
    n_inputs = draw(st.integers(1, 4))
    n_samples = draw(st.integers(3, 14))
    values = st.integers(0, draw(st.integers(1, 9)))
    X = draw(
        st.lists(
            st.lists(values, min_size=n_inputs, max_size=n_inputs),
            min_size=n_samples,
            max_size=n_samples,
        )
    )
    y = draw(st.lists(st.integers(0, 3), min_size=n_samples, max_size=n_samples))
    y[:2] = [0, 3]  # a range of targets is not empty, and there are two classes
    options = {
        "coding": RandomInverse(n_bins=draw(st.integers(2, 20)), n_flipped=draw(st.integers(1, 4))),
        "n_pattern_units": 2 * draw(st.integers(4, 40)),
        "tables": draw(st.sampled_from(["shared", "separate"])),
        "training": draw(st.sampled_from(["auto", "dual", "block", "plain"])),
        "n_jobs": draw(st.integers(1, 2)),
        "random_state": draw(st.integers(0, 2**31 - 1)),
    }
    orders = [draw(st.permutations(range(n_samples))) for _ in range(3)]
    return np.array(X, dtype=float), np.array(y), options, orders


def assert_equal_bits(model, layer, X):
    np.testing.assert_array_equal(model.weights_, layer.weights)
    np.testing.assert_array_equal(model.thresholds_, layer.thresholds)
    bins = model.network_.input_code.bins(X)
    np.testing.assert_array_equal(model.network_.potentials(bins, 1), layer.potentials(bins))
    np.testing.assert_array_equal(model.transform_code(X), layer.code.transform(bins))


@settings(max_examples=100, deadline=None)
@given(problems(), st.integers(1, 2), st.integers(1, 30), st.sampled_from([1.0, 0.5, 0.3]))
def test_the_regressor_has_the_bits_of_its_transcription(problem, n_outputs, n_output_units, share):
    X, y, options, orders = problem
    y = np.stack([y, 2 - y * y], axis=1)[:, :n_outputs]
    model, counts = untrained(
        SDNNRegressor(n_output_units=n_output_units, correction_share=share, **options), X, y
    )
    layer = transcribed(model)
    bins = model.network_.input_code.bins(X)
    slow = estimator_transcription.PDeltaTrainer(layer, bins, counts, share)
    fast = model._trainer(bins, counts, n_epochs=3)
    for order in orders:
        assert tuple(fast.present(np.array(order, dtype=np.int32))) == slow.present(order)
    fast.synchronize()
    assert_equal_bits(model, layer, X)
    low, step = model.output_range_[:, 0], model._step()
    expected = step * layer.counts(bins, n_outputs) + low
    np.testing.assert_array_equal(model.predict(X), expected)


@settings(max_examples=100, deadline=None)
@given(problems(), st.sampled_from(["one_vs_rest", "one_vs_one"]))
def test_the_classifier_has_the_bits_of_its_transcription(problem, scheme):
    X, y, options, orders = problem
    model, labels = untrained(SDNNClassifier(scheme=scheme, n_units_per_class=1, **options), X, y)
    layer = transcribed(model)
    slow = estimator_transcription.PerceptronTrainer(
        layer, model.network_.input_code.bins(X), labels, len(model.classes_), scheme
    )
    fast = model._trainer(model.network_.input_code.bins(X), labels, n_epochs=3)
    for order in orders:
        assert tuple(fast.present(np.array(order, dtype=np.int32))) == slow.present(order)
    fast.synchronize()
    assert_equal_bits(model, layer, X)


@pytest.mark.parametrize("regression", [True, False])
def test_fit_draws_two_seeds_and_then_a_permutation_per_epoch(regression):
    # The seeds are those of code and weights.
    random = np.random.RandomState(5)
    X = random.uniform(size=(30, 2))
    y = X[:, 0] if regression else np.digitize(X[:, 0], [0.3, 0.6])
    estimator = SDNNRegressor if regression else SDNNClassifier
    options = {"n_pattern_units": 40, "random_state": 11, "max_iter": 7}
    if not regression:
        options["n_units_per_class"] = 1
    model = estimator(**options).fit(X, y)

    begun, targets = untrained(estimator(**options), X, y)
    layer = transcribed(begun)
    bins = begun.network_.input_code.bins(X)
    slow = (
        estimator_transcription.PDeltaTrainer(layer, bins, targets)
        if regression
        else estimator_transcription.PerceptronTrainer(layer, bins, targets, 3, "one_vs_rest")
    )
    orders = np.random.RandomState(11)
    orders.randint(2**31 - 1, size=2)
    corrected = [slow.present(orders.permutation(30))[0] for _ in range(model.n_iter_)]
    assert model.n_corrected_.tolist() == corrected
    assert_equal_bits(model, layer, X)
