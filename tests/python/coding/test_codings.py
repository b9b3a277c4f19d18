"""Codings: values have bins, bins have patterns of signs, patterns have correlations."""

import dataclasses
import json

import numpy as np
import pandas as pd
import pytest
from hypothesis import example, given, settings, strategies as st

from refusals import refuses
from sdnn.coding import (
    CODINGS,
    Anchor,
    Circular,
    CorrelationMatrix,
    RandomInverse,
    Symbolic,
    WithMissing,
    coding_named,
    from_dict,
    to_dict,
)
from sdnn.coding.numeric import MAX_KNOTS, quantile_knots

UNIT = np.array([0.0, 1.0])
LETTERS = np.array(["c", "a", "b", "a"])
CORRELATIONS = np.array([[1.0, 0.5, 0.0], [0.5, 1.0, 0.5], [0.0, 0.5, 1.0]])

FITTED = {
    "random-inverse": RandomInverse(length_scale=0.2).fit(UNIT, 400),
    "quantile": RandomInverse(spacing="quantile").fit(np.arange(30.0) ** 2, 400),
    "anchor": Anchor(n_anchor_patterns=5, n_interpolated=9).fit(UNIT, 400),
    "circular": Circular(n_anchor_patterns=5, n_interpolated=9).fit(UNIT, 400),
    "circular of two": Circular(n_anchor_patterns=3, n_interpolated=9).fit(UNIT, 400),
    "circular of one": Circular(n_anchor_patterns=2, n_interpolated=9).fit(UNIT, 400),
    "symbolic": Symbolic().fit(LETTERS, 400),
    "correlation-matrix": CorrelationMatrix(matrix=CORRELATIONS).fit(LETTERS, 400),
    "with missing": WithMissing(base=RandomInverse(length_scale=0.2)).fit(UNIT, 400),
    "letters with missing": WithMissing(base=Symbolic()).fit(LETTERS, 400),
}


@pytest.mark.parametrize("name", FITTED)
def test_patterns_are_signs_determined_by_the_seed(name):
    coding = FITTED[name]
    patterns = coding.patterns(400, seed=7)
    assert patterns.shape == (coding.size, 400)
    assert set(np.unique(patterns)) == {-1, 1}
    np.testing.assert_array_equal(patterns, coding.patterns(400, seed=7))
    assert not np.array_equal(patterns, coding.patterns(400, seed=8))


@pytest.mark.parametrize("name", FITTED)
def test_drawn_patterns_have_the_expected_correlations_up_to_chance(name):
    n_units = 10000
    coding = FITTED[name]
    if isinstance(coding, RandomInverse):  # with fewer bins than for 10,000 units
        coding = dataclasses.replace(coding, n_flipped=100, n_bins=40)
    drawn = coding.patterns(n_units, seed=3).astype(float)
    expected = coding.correlations(n_units)
    # Correlations of 10,000 random signs have a standard deviation of 0.01.
    assert np.abs(drawn @ drawn.T / n_units - expected).max() < 0.05
    np.testing.assert_allclose(np.diag(expected), 1)
    assert np.linalg.eigvalsh(expected).min() > -1e-9, "no negative eigenvalue, up to rounding"


def test_bins_are_half_open_and_clipped_or_circular():
    anchor = Anchor(n_anchor_patterns=3, n_interpolated=1, low=0.0, high=4.0).fit(UNIT, 8)
    column = np.array([-1, 0, 0.99, 1, 2.5, 3.999, 4, 99])
    # Four bins of width 1, from 0 to 4.
    assert anchor.bins(column).tolist() == [0, 0, 0, 1, 2, 3, 3, 3]
    circle = Circular(period=4.0, origin=1.0, n_anchor_patterns=5, n_interpolated=0).fit(UNIT, 8)
    # Four bins of a circle that begins at 1 and repeats after 4.
    assert circle.bins(np.array([1, 2, 3, 4, 5, 0.99, -3, 1 - 1e-18])).tolist() == [
        0, 1, 2, 3, 0, 3, 0, 0,
    ]  # fmt: skip
    assert FITTED["symbolic"].categories == ("a", "b", "c")
    assert FITTED["symbolic"].bins(LETTERS).tolist() == [2, 0, 1, 0]


def test_quantile_bins_hold_equal_shares_of_samples():
    column = np.random.RandomState(0).lognormal(0, 3, 4000)
    coding = RandomInverse(spacing="quantile", n_bins=10).fit(column, 400)
    shares = np.bincount(coding.bins(column), minlength=10) / 4000
    np.testing.assert_allclose(shares, 0.1, atol=0.01)
    assert len(coding.knots) <= MAX_KNOTS


def test_a_value_between_subnormal_knots_has_the_bin_of_the_next_knot():
    # Knots have the ranks 0, 1/2 and 1; the slope between the first two, 0.5 / 1e-323, is no float.
    coding = RandomInverse(spacing="quantile", n_bins=4).fit(np.array([-5e-324, 5e-324, 1.0]), 400)
    assert coding.bins(np.array([-1.0, -5e-324, 0.0, 5e-324, 0.5, 1.0])).tolist() == [
        0, 0, 2, 2, 3, 3,
    ]  # fmt: skip


@settings(max_examples=100, deadline=None)
@given(
    st.lists(st.floats(allow_nan=False, allow_infinity=False), min_size=1, max_size=30),
    st.sampled_from(["even", "quantile", "anchor"]),
)
@example([1.0, 5e-324, -5e-324], "quantile")
def test_bins_are_within_the_table_and_monotonic(values, spacing):
    column = np.array(values)
    coding = Anchor() if spacing == "anchor" else RandomInverse(spacing=spacing)
    fitted = coding.fit(column, 64)
    order = np.sort(np.concatenate([column, [-np.finfo(float).max, 0, np.finfo(float).max]]))
    bins = fitted.bins(order)
    assert bins.min() >= 0
    assert bins.max() < fitted.size
    assert np.all(np.diff(bins) >= 0)


@pytest.mark.parametrize("period", [24.0, 7.0, 2 * np.pi, 0.1])
def test_circular_bins_repeat_with_the_period_also_at_edges(period):
    coding, edges = Circular(period=period), np.arange(360) * period / 360  # of 360 bins
    for turns in (-1000, -1, 1, 2, 365):
        np.testing.assert_array_equal(coding.bins(edges + turns * period), np.arange(360))


@pytest.mark.filterwarnings("ignore::sdnn.coding.CoarseCodeWarning")
@settings(max_examples=100, deadline=None)
@given(st.integers(1, 4000), st.floats(0.01, 3))
def test_the_correlation_at_the_length_scale_is_one_over_e(half_of_units, length_scale):
    n_units = 2 * half_of_units
    coding = RandomInverse(length_scale=length_scale).fit(UNIT, n_units)
    correlation = 1 - 4 * coding.n_flipped / n_units  # of neighbouring bins
    if correlation > 0.5 and coding.size > 20 and length_scale < 1:  # else bins are too coarse
        n_bins = length_scale * coding.size  # of the column's range from 0 to 1
        assert abs(correlation**n_bins - np.exp(-1)) < 0.1


@pytest.mark.parametrize("name", FITTED)
def test_codings_read_from_json_equal_those_that_were_written(name):
    coding = FITTED[name]
    assert from_dict(json.loads(json.dumps(to_dict(coding)))) == coding


def test_codings_are_found_by_name():
    assert set(CODINGS) == {
        "random-inverse", "anchor", "circular", "symbolic", "correlation-matrix", "with-missing",
    }  # fmt: skip
    assert coding_named("symbolic") == Symbolic()
    assert coding_named(Anchor()) == Anchor()
    refuses("coding", coding_named, "sine")


@pytest.mark.parametrize(
    ("coding", "setting"),
    [
        (RandomInverse(n_flipped=33), "n_flipped"),
        (RandomInverse(spacing="quantile", low=0.0), "spacing"),
        (RandomInverse(low=2.0, high=1.0), "low"),
        (Anchor(n_anchor_patterns=2000, n_interpolated=99), "n_interpolated"),
        (Symbolic(categories=("a", "a")), "categories"),
        (Symbolic(categories=()), "categories"),
        (CorrelationMatrix(matrix=[[1, 0.5], [0.4, 1]]), "symmetric"),
        (CorrelationMatrix(matrix=[[0.5]]), "diagonal"),
        (CorrelationMatrix(matrix=[1.0, 2.0]), "square"),
        (CorrelationMatrix(matrix=np.eye(3)), "row"),
        (CorrelationMatrix(matrix=np.eye(2), categories=("a", "b", "c")), "row"),
    ],
)
def test_impossible_settings_are_refused_with_their_name(coding, setting):
    refuses(setting, coding.fit, UNIT, 64, error=(ValueError, TypeError))


def test_mixed_missing_and_unknown_symbols_and_unfitted_codings_are_refused():
    refuses("words", Symbolic().fit, np.array(["a", 1], dtype=object), 64)
    refuses("NaN", Symbolic().fit, np.array([1.0, np.nan]), 64)
    refuses("'d', 'e'", FITTED["symbolic"].bins, np.array(["a", "d", "e", "d"]))
    refuses("fitted", RandomInverse().bins, UNIT)


def test_nan_infinity_and_texts_are_refused_as_numbers_but_infinity_is_clipped_to_ranges():
    for coding in (RandomInverse(), Anchor(), Circular(period=1.0)):
        with pytest.raises(ValueError, match="contains NaN"):
            coding.fit(UNIT, 64).bins(np.array([0.5, np.nan]))
        refuses("column", coding.fit(UNIT, 64).bins, np.array(["a"]))
    with pytest.raises(ValueError, match=r"0\.0 and inf"):
        Anchor().fit(np.array([0.0, np.inf]), 64)
    refuses("infinity", Circular().bins, np.array([np.inf]))
    assert Anchor(low=0.0, high=1.0).bins(np.array([-np.inf, np.inf])).tolist() == [0, 359]


@pytest.mark.parametrize(
    "column", [np.arange(30.0) ** 2, np.full(5, 2.5), np.array([-1e308, 1e308])]
)
@pytest.mark.parametrize(
    "coding", [RandomInverse(), RandomInverse(spacing="quantile"), Anchor(), WithMissing()]
)
def test_fitting_a_fitted_coding_does_not_change_it(coding, column):
    fitted = coding.fit(column, 400)
    assert not fitted.learns
    assert fitted.fit(np.array(fitted.ends()), 400) == fitted
    if column[0] < column[-1]:  # other columns are outside a range of no width
        assert fitted.fit(np.array([7.0, 8.0]), 400) == fitted


@pytest.mark.parametrize(
    "knots",
    [
        ((0.0, 0.0), (2.0, 1.0)),
        ((0.0, 0.0), (0.5, 0.8), (0.4, 0.9), (1.0, 1.0)),
        ((0.0, 0.0), (0.5, 0.9), (0.6, 0.8), (1.0, 1.0)),
        ((0.0, 0.1), (1.0, 1.0)),
        ((0.0,), (1.0, 1.0)),
        (0.0, 1.0),
        (("a", 0.0), (1.0, 1.0)),
        5,
    ],
)
def test_impossible_knots_are_refused_by_name(knots):
    for fields in ({"low": 0.0, "high": 1.0}, {}, {"spacing": "even"}):
        coding = RandomInverse(**{"spacing": "quantile", "knots": knots, **fields})
        refuses("knots", coding.fit, UNIT, 400)


def test_knots_of_quantiles_rise_from_rank_0_to_1():
    assert quantile_knots(np.array([5.0])) == ((5.0, 0.0),)
    knots = quantile_knots(np.random.RandomState(0).normal(size=5000))
    assert len(knots) <= MAX_KNOTS
    values, levels = np.array(knots).T
    assert np.all(np.diff(values) > 0)
    assert np.all(np.diff(levels) > 0)
    assert (levels[0], levels[-1]) == (0, 1)


def test_missing_values_and_unknown_symbols_have_an_additional_last_bin():
    numbers = np.array([4.0, None, 0.0, np.nan, pd.NA], dtype=object)
    coding = WithMissing(base=Anchor(n_anchor_patterns=3, n_interpolated=1)).fit(numbers, 8)
    assert (coding.base.low, coding.base.high, coding.size) == (0.0, 4.0, 4 + 1)
    assert coding.ends() == (0.0, 4.0)
    # Four bins from 0 to 4, and bin 4 for missing values.
    assert coding.bins(numbers).tolist() == [3, 4, 0, 4, 4]
    assert coding.bins(np.array([2.0, np.nan])).tolist() == [2, 4]
    np.testing.assert_array_equal(coding.patterns(8, seed=5)[:-1], coding.base.patterns(8, seed=5))
    letters = WithMissing(base=Symbolic()).fit(np.array(["b", None, "a"], dtype=object), 8)
    assert letters.bins(np.array(["a", "b", "new", None, ["a"]], dtype=object)).tolist() == [
        0, 1, 2, 2, 2,
    ]  # fmt: skip


@pytest.mark.parametrize(
    ("coding", "column", "named"),
    [
        (WithMissing(unknown="ignore"), UNIT, "unknown"),
        (WithMissing(base=WithMissing()), UNIT, "base"),
        (WithMissing(base="anchor"), UNIT, "base"),
        (WithMissing(), np.array([np.nan, np.nan]), "missing"),
        (WithMissing(), np.array([1.0, np.inf]), "infinity"),
        (WithMissing(), np.array(["a", None], dtype=object), "convert"),
    ],
)
def test_impossible_codings_with_missing_values_are_refused(coding, column, named):
    refuses(named, coding.fit, column, 8)


def test_with_unknown_error_unknown_categories_are_refused():
    strict = WithMissing(base=Symbolic(), unknown="error").fit(LETTERS, 8)
    refuses("categories", strict.bins, np.array(["z"]))


def test_patterns_of_12_000_symbols_are_balanced_and_extend_those_of_fewer():
    coding = Symbolic(categories=tuple(range(12_000))).fit(np.arange(12_000), 20)
    patterns = coding.patterns(20, seed=3)
    assert patterns.shape == (12_000, 20)
    assert (patterns.sum(axis=1) == 0).all()
    fewer = Symbolic(categories=(0, 1, 2)).patterns(20, seed=3)
    np.testing.assert_array_equal(patterns[:3], fewer)
