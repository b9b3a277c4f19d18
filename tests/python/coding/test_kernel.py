"""The kernel: the limit of normalized inner products of codes with many units."""

import numpy as np
import pytest

from refusals import refuses
from sdnn import SDNNRegressor
from sdnn.coding import Anchor, Circular, RandomInverse, Symbolic, WithMissing, kernel

RANDOM = np.random.RandomState(0)
X = RANDOM.uniform(0, 1, (12, 3))


@pytest.mark.parametrize("pairs", ["all", [(0, 1), (2, None)]])
@pytest.mark.parametrize("coding", [RandomInverse(n_bins=40), Circular(period=1.0)])
def test_inner_products_of_long_codes_approach_the_kernel(coding, pairs):
    n_units = 20000
    model = SDNNRegressor(
        coding, pairs=pairs, n_pattern_units=n_units, n_output_units=1, max_iter=1, random_state=0
    )
    model.fit(X, X[:, 0])
    code = model.transform_code(X).astype(float)
    # Half the units of a pair of inputs are active, and all of an input that is without a pair.
    n_active = n_units / 2 * sum(2 if first == second else 1 for first, second in model.pairs_)
    limit = kernel.AnalyticKernel(model.codings_, pairs=model.pairs_, n_units=n_units)(X)
    # Means over 20,000 random units have a standard deviation of about 0.007.
    assert np.abs(code @ code.T / n_active - limit).max() < 0.03
    np.testing.assert_allclose(np.diag(limit), 1)
    np.testing.assert_allclose(limit, limit.T)


def test_the_kernel_of_one_and_two_inputs_is_as_worked_by_hand():
    coding = RandomInverse(n_bins=11, n_flipped=10, low=0.0, high=1.0)
    rho = 1 - 4 * 10 / 100  # correlation of neighbouring bins; of bins at distance 2, rho^2
    of_two = kernel.AnalyticKernel(coding, n_inputs=2, n_units=100)
    # The first input differs by one bin; in the second sample the other one differs by two.
    matrix = of_two(np.array([[0.05, 0.05]]), np.array([[0.15, 0.05], [0.15, 0.25]]))
    # The mean of both orders of a pair: (1 + correlation of one) / 2 * correlation of the other.
    expected = [((1 + rho) / 2 + rho) / 2, ((1 + rho) / 2 * rho**2 + (1 + rho**2) / 2 * rho) / 2]
    np.testing.assert_allclose(matrix, [expected])
    of_one = kernel.AnalyticKernel(coding, n_inputs=1, n_units=100)
    np.testing.assert_allclose(of_one([[0.05]], [[0.25]]), [[rho**2]])
    refuses("n_inputs", kernel.AnalyticKernel, "anchor")


COLUMNS = {"different": RANDOM.lognormal(0, 2, 30), "equal": np.full(30, 3.5)}


@pytest.mark.parametrize("column", COLUMNS)
@pytest.mark.parametrize(
    "coding",
    [
        RandomInverse(length_scale=0.2),
        RandomInverse(spacing="quantile"),
        Anchor(),
        WithMissing(base=RandomInverse(spacing="quantile")),
    ],
)
def test_the_kernel_and_similarities_use_fitted_codings_unchanged(coding, column):
    fitted = coding.fit(COLUMNS[column], 400)
    analytic = kernel.AnalyticKernel([fitted, fitted], n_units=400)
    assert analytic.codings == (fitted, fitted)
    samples = np.stack([COLUMNS[column]] * 2, axis=1)  # both inputs are equal
    bins = fitted.bins(COLUMNS[column])
    rho = fitted.correlations(400)[np.ix_(bins, bins)]
    np.testing.assert_allclose(analytic(samples), (1 + rho) / 2 * rho)
    assert kernel.similarity(fitted, 400).shape == (fitted.size, fitted.size)
    assert kernel.plot_similarity(fitted, 400) is not None


def test_similarities_of_drawn_patterns_are_near_the_expected_correlations():
    for coding in ("random-inverse", "anchor", "circular", Symbolic(categories=("a", "b"))):
        drawn = kernel.similarity(coding, n_units=4000, seed=1)
        expected = kernel.correlations(coding, n_units=4000)
        assert drawn.shape == expected.shape
        # Means over 4,000 random units have a standard deviation of about 0.016.
        assert np.abs(drawn - expected).max() < 0.12


@pytest.mark.parametrize("coding", ["random-inverse", Symbolic(categories=tuple("abc"))])
def test_plot_similarity_draws_a_picture(coding, tmp_path):
    figure = kernel.plot_similarity(coding, n_units=200)
    figure.savefig(tmp_path / "similarity.png")
    assert (tmp_path / "similarity.png").stat().st_size > 5000


@pytest.mark.parametrize("samples", [np.zeros((3, 1)), np.zeros((3, 3)), np.zeros(2)])
def test_samples_of_another_number_of_inputs_are_refused(samples):
    analytic = kernel.AnalyticKernel("anchor", n_inputs=2)
    refuses("X", analytic, samples)
    refuses("Y", analytic, np.zeros((1, 2)), samples)
