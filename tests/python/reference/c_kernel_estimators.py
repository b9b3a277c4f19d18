"""Kernel estimators exported as C headers, with docstrings of what they cover, and checks."""

import functools
import warnings

import numpy as np

from c_estimators import PREDICT, compiled, labels, lacking, numbers, rows_in_c, targets, words
from c_policies import run
from sdnn import SDNNKernelClassifier, SDNNKernelRidge
from sdnn.coding import Circular, RandomInverse, Symbolic, WithMissing
from sdnn.estimators.input_choice import positions
from sdnn.estimators.ridge import apply_degree
from sdnn.export import export_estimator_header


def all_pairs():
    """Cover missing values, numbers as categories, two outputs, and a kernel of degree 3."""
    coding = [(WithMissing(base=Symbolic(categories=(1.0, 2.5, -4.0, 0.0))), [3])]
    model = SDNNKernelRidge(coding, inputs="all", degree=3)
    return model.fit(X := lacking(120, 1), targets(X, 2)), lacking


def listed_pairs():
    """Cover words, quantiles, an input without a partner, and an angle with uneven correlations."""
    coding = [
        (WithMissing(base=Symbolic(categories=("blue", "gr\u00fcn", "red"))), [0]),
        (RandomInverse(spacing="quantile"), [1]),
        (Symbolic(categories=tuple(range(7))), [2]),
        (Circular(period=360.0, n_anchor_patterns=5, n_interpolated=4), [3]),
    ]
    pairs = [(0, 1), (1, None), (3, 2)]
    model = SDNNKernelRidge(coding, pairs=pairs, degree=2)
    return model.fit(X := words(120, 2), targets(X, 1)), words


def directions():
    """Cover an input that is a mixture of features."""
    X = numbers(200, 3, 4)
    y = np.sin(3 * X @ [1.0, -1.0, 0.5, 0.7])
    model = SDNNKernelRidge().fit(X, y)
    assert len(model.directions_) > 0
    return model, lambda n_samples, seed: numbers(n_samples, seed, 4)


def low_rank():
    """Cover three classes, and fewer components than samples."""
    model = SDNNKernelClassifier(max_components=40, inputs="all", random_state=0)
    return model.fit(X := numbers(120, 4), labels(X, 3)), numbers


def two_inputs():
    """Cover two classes and two inputs."""
    model = SDNNKernelClassifier(inputs="all", degree=1)
    X = numbers(80, 5, 2)
    return model.fit(X, labels(X, 2)), lambda n_samples, seed: numbers(n_samples, seed, 2)


KERNEL_ESTIMATORS = {
    "all-pairs": all_pairs, "listed-pairs": listed_pairs, "directions": directions,
    "low-rank": low_rank, "two-inputs": two_inputs,
}  # fmt: skip


@functools.cache
def fitted_kernel(name):
    """Return an estimator of `KERNEL_ESTIMATORS`, and a function that draws samples."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return KERNEL_ESTIMATORS[name]()


def outputs_in_order(model, X):
    """Return outputs whose sums have the order of the C code, and so its bits, unlike NumPy's."""
    inputs = model._inputs
    table = X[:, inputs.features]
    if len(inputs.directions):
        terms = positions(X, model.codings_)[:, None] * inputs.directions
        table = np.hstack([table, np.cumsum(terms, axis=2)[..., -1]])
    kernel = apply_degree(model.kernel_(table, model.X_fit_), model.degree_)
    terms = kernel[:, :, None] * model.dual_coef_
    return np.cumsum(terms, axis=1)[:, -1] + model.intercept_


def check_kernel(name, target, folder, n_samples, *options):
    """Check that outputs in C have the bits of sums in order, and are close to predictions."""
    model, draw = fitted_kernel(name)
    header = export_estimator_header(model, folder / "model.h")
    X = draw(n_samples, 11)
    written = run(*compiled(folder, PREDICT, target, *options), input=rows_in_c(model, X).tobytes())
    outputs = outputs_in_order(model, X)
    results = np.frombuffer(written, np.float64).reshape(n_samples, -1)
    assert header.ram_bytes < 512
    if isinstance(model, SDNNKernelClassifier):
        winners, scores = results[:, 0].astype(int), results[:, 1:]
        np.testing.assert_array_equal(scores, outputs)
        np.testing.assert_array_equal(model.classes_[winners], model.predict(X))
        assert len(np.unique(winners)) > 1
        return
    np.testing.assert_array_equal(results.view(np.int64), outputs.view(np.int64))
    expected = model.predict(X).reshape(outputs.shape)
    np.testing.assert_allclose(results, expected, rtol=1e-9, atol=1e-9 * np.abs(expected).max())
