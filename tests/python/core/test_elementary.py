"""The portable elementary functions against mpmath with 200 bits.

The limits are a little above the largest errors measured (see elementary.hpp), in units of the last
place (ulp): half a unit is the error of the best rounding.
"""

import mpmath
import numpy as np
import pytest

from sdnn import _core


@pytest.fixture(autouse=True)
def precision_of_200_bits():
    with mpmath.workprec(200):
        yield


def largest_error(results, function, *arguments):
    """Return the largest error of results of a function of mpmath, in ulp of the exact value."""
    errors = []
    for result, *numbers in zip(results, *arguments, strict=True):
        exact = function(*(mpmath.mpf(float(number)) for number in numbers))
        errors.append(abs(mpmath.mpf(float(result)) - exact) / np.spacing(abs(float(exact))))
    return max(errors)


def angles_up_to(limit, n, seed):
    """Return n uniform angles, and about n / 4 doubles next to multiples of pi / 2.

    Digits cancel at these, as a sine or a cosine is almost 0.
    """
    rng = np.random.default_rng(seed)
    multiples = rng.integers(1, int(limit * 2 / np.pi) + 2, n // 4)
    neighbours = np.array([float(int(k) * mpmath.pi / 2) for k in multiples])
    return np.concatenate([rng.uniform(-limit, limit, n), neighbours[neighbours <= limit]])


@pytest.mark.parametrize("limit", [0.8, np.pi, 100.0, 1e5])
def test_sine_and_cosine_are_within_085_units_of_the_last_place(limit):
    x = angles_up_to(limit, 4000, seed=1)
    sin, cos = _core.sin_cos(x)
    assert largest_error(sin, mpmath.sin, x) < 0.85
    assert largest_error(cos, mpmath.cos, x) < 0.85


def test_sine_and_cosine_keep_the_shape_of_their_argument():
    sin, cos = _core.sin_cos(np.zeros((2, 3)))
    assert sin.shape == cos.shape == (2, 3)


def test_the_logarithm_is_within_085_units_of_the_last_place():
    rng = np.random.default_rng(2)
    x = np.concatenate(
        [
            rng.uniform(0.0, 1.0, 3000),
            rng.uniform(0.5, 2.0, 4000),
            np.exp(rng.uniform(-744.0, 709.0, 3000)),  # the whole range of doubles
            1.0 + rng.uniform(-1e-5, 1e-5, 1000),
        ]
    )
    assert largest_error(_core.log(x), mpmath.log, x) < 0.85


def test_the_exponential_is_within_07_units_of_the_last_place_or_1_where_it_is_subnormal():
    rng = np.random.default_rng(4)
    x = np.concatenate(
        [rng.uniform(-708.0, 709.7, 3000), rng.uniform(-1.0, 1.0, 4000), rng.uniform(-30, 0, 3000)]
    )
    assert largest_error(_core.exp(x), mpmath.exp, x) < 0.7
    x = rng.uniform(-745.0, -708.5, 500)  # with subnormal results, which have fewer bits
    assert largest_error(_core.exp(x), mpmath.exp, x) < 1.0


def test_powers_have_relative_errors_that_grow_with_the_logarithm_of_the_result():
    # The bound that elementary.hpp states is (2 + |y log x|) 2^-52; y log x is the logarithm of
    # the power.
    rng = np.random.default_rng(6)
    base, exponent = rng.uniform(0.0, 1.0, 4000), 10.0 ** rng.uniform(-3.0, 2.0, 4000)
    for x, y, power in zip(base, exponent, _core.power(base, exponent), strict=True):
        exact = mpmath.mpf(float(x)) ** mpmath.mpf(float(y))
        if power > 1e-300:  # not subnormal
            assert abs(float(power) / exact - 1) < (2 + abs(mpmath.log(exact))) * 2.0**-52


def test_the_arctangent_is_within_15_units_of_the_last_place():
    rng = np.random.default_rng(5)
    y, x = rng.uniform(-1.0, 1.0, (2, 6000))
    y[:2000] *= 2.0 ** rng.uniform(-300, 300, 2000)
    # Ratios around 1/2, beyond which the core uses another formula.
    y[2000:3000] = 0.5 * np.abs(x[2000:3000]) * (1.0 + rng.uniform(-1e-3, 1e-3, 1000))
    assert largest_error(_core.atan2(y, x), mpmath.atan2, y, x) < 1.5


def test_normal_quantile_inverts_the_distribution_function():
    rng = np.random.default_rng(3)
    p = np.concatenate([rng.uniform(0.0, 1.0, 300), 10.0 ** rng.uniform(-300.0, 0.0, 200)])
    for probability, quantile in zip(p, _core.normal_quantile(p), strict=True):
        # Newton's method doubles the right digits in each step, from about 15 in the result.
        exact = mpmath.mpf(float(quantile))
        for _ in range(3):
            exact -= (mpmath.ncdf(exact) - float(probability)) / mpmath.npdf(exact)
        assert abs(float(quantile) / exact - 1) < 1e-15
