"""Codings of columns, pairs, tables, and columns of words."""

import numpy as np
import pandas as pd
import pytest
from sklearn.base import clone

from refusals import refuses
from sdnn import SDNNClassifier, SDNNKernelClassifier, SDNNKernelRidge, SDNNRegressor
from sdnn.coding import Circular, CorrelationMatrix, RandomInverse, Symbolic, WithMissing
from sdnn.estimators import OutOfRangeWarning
from sdnn.estimators.columns import codings_of_columns, column_indices, input_pairs
from sdnn.estimators.network import draw_input_code

RANDOM = np.random.RandomState(0)
HOURS = RANDOM.uniform(0, 24, 200)
COLORS = RANDOM.choice(["red", "green", "blue"], 200)
SIZES = RANDOM.uniform(1, 9, 200)
TABLE = pd.DataFrame({"hour": HOURS, "color": COLORS, "size": SIZES})
TARGETS = np.cos(HOURS * np.pi / 12) * np.where(COLORS == "red", 2.0, 1.0) + SIZES / 9
CODING = [(Circular(period=24.0), "hour"), ("symbolic", ["color"])]
SMALL = {"n_pattern_units": 256, "random_state": 0}


def test_columns_are_selected_as_in_a_column_transformer():
    names = ["a", "b", "c"]
    for columns, expected in [
        (1, [1]),
        (-1, [2]),
        ("b", [1]),
        (["c", "a"], [2, 0]),
        ([2, 0], [2, 0]),
        (np.array([0, 2]), [0, 2]),
        (slice(1, None), [1, 2]),
        (slice("b", "c"), [1, 2]),
        (slice(None, "b"), [0, 1]),
        ([True, False, True], [0, 2]),
        (lambda table: [table.shape[1] - 1], [2]),
    ]:
        assert column_indices(columns, names, 3, np.zeros((4, 3))) == expected


def test_columns_that_do_not_exist_or_are_not_given_are_refused():
    names = ["a", "b", "c"]
    for bad, error in [(3, "3"), ("d", "'d'"), (1.5, "1.5")]:
        refuses(error, column_indices, bad, names, 3)
    refuses("mask", column_indices, [True], names, 3)
    refuses("coding", codings_of_columns, [("anchor",)], None, 3)


def test_pairs_may_be_names_and_a_single_input_has_a_plain_pattern():
    assert input_pairs("all", None, 1) == [(0, 0)]
    assert input_pairs([("b", "a"), (-1, None)], ["a", "b"], 2) == [(1, 0), (1, 1)]
    refuses("pair", input_pairs, [(0, 1, 2)], None, 3)


@pytest.mark.parametrize("tables", ["shared", "separate"])
def test_circular_symbolic_and_numeric_inputs_are_learned_together(tables):
    model = SDNNRegressor(CODING, tables=tables, max_iter=200, **SMALL)
    model.fit(TABLE, TARGETS)
    assert [coding.name for coding in model.codings_] == ["circular", "symbolic", "random-inverse"]
    assert model.codings_[1].categories == ("blue", "green", "red")
    assert model.score(TABLE, TARGETS) > 0.99
    day_later = TABLE.assign(hour=TABLE["hour"] + 24)
    np.testing.assert_allclose(model.predict(day_later), model.predict(TABLE), atol=0.1)


LISTED = TABLE[["color", "size"]].values.tolist()
WORDS = [("symbolic", [0])]


@pytest.mark.parametrize("estimator", [SDNNRegressor, SDNNKernelRidge])
def test_lists_with_words_have_the_bits_of_arrays(estimator):
    options = SMALL if estimator is SDNNRegressor else {}
    listed = estimator(WORDS, **options).fit(LISTED, TARGETS)
    other = estimator(WORDS, **options).fit(TABLE[["color", "size"]].to_numpy(), TARGETS)
    np.testing.assert_array_equal(listed.predict(LISTED[:9]), other.predict(LISTED[:9]))


def test_numbers_in_lists_with_words_remain_numbers():
    rows = [[color, size > 5, int(size)] for color, size in LISTED]  # sizes are below 9
    model = SDNNRegressor([("symbolic", [0, 1, 2])], **SMALL).fit(rows, TARGETS)
    assert [coding.categories for coding in model.codings_] == [
        ("blue", "green", "red"), (False, True), tuple(range(1, 9)),
    ]  # fmt: skip
    assert model.predict_one(rows[0]) == model.predict(rows[:1])[0]
    assert model.predict_one(["red", True, 3]) == model.predict([["red", True, 3]])[0]
    refuses("words", model.fit, [["red", True, 3], ["blue", True, "4"]], [0, 1])


@pytest.mark.parametrize("missing", [float("nan"), np.nan, None])
def test_missing_values_in_lists_of_words_are_recognized(missing):
    gaps = [[missing, size] if size > 8 else [color, size] for color, size in LISTED]
    refuses("missing", SDNNRegressor(WORDS, **SMALL).fit, gaps, TARGETS)
    model = SDNNRegressor([(WithMissing(base=Symbolic()), [0])], **SMALL).fit(gaps, TARGETS)
    assert model.codings_[0].base.categories == ("blue", "green", "red")
    assert model.predict([[missing, 9.0]]) == model.predict([["pink", 9.0]])
    refuses("inhomogeneous", model.fit, [["red", 1.0], ["blue"]], [0, 1])


def test_unknown_categories_and_missing_values_are_refused():
    model = SDNNRegressor(CODING, **SMALL).fit(TABLE, TARGETS)
    refuses("pink", model.predict, TABLE.assign(color="pink"))
    refuses("NaN", model.fit, TABLE.assign(color=None), TARGETS)
    refuses("infinity", model.partial_fit, TABLE.assign(size=np.inf), TARGETS)


def test_missing_values_and_unknown_categories_can_have_separate_patterns(tmp_path):
    coding = [("with-missing", ["hour", "size"]), (WithMissing(base=Symbolic()), "color")]
    holes = TABLE.copy()
    holes.loc[::5, "size"] = np.nan
    holes.loc[1::5, "color"] = None
    model = SDNNRegressor(coding, max_iter=100, **SMALL).fit(holes, TARGETS)
    assert model.score(TABLE, TARGETS) > 0.9
    unknown = model.predict(holes.assign(color="pink"))  # coded as a missing color
    np.testing.assert_array_equal(unknown, model.predict(holes.assign(color=pd.NA)))
    assert np.isfinite(unknown).all()
    model.save(tmp_path / "model")
    again = SDNNRegressor.load(tmp_path / "model")
    assert again.codings_ == model.codings_
    np.testing.assert_array_equal(again.predict(holes), model.predict(holes))
    with pytest.warns(OutOfRangeWarning, match="column 2"):
        model.partial_fit(holes.assign(size=1e3), TARGETS)


def test_columns_of_words_without_a_coding_are_refused():
    refuses("coding", SDNNRegressor().fit, TABLE, TARGETS)
    coding = [(Circular(period=24.0), "hour"), ("symbolic", ["size"])]
    assert "'color'" in str(refuses("coding", SDNNRegressor(coding).fit, TABLE, TARGETS))
    words = np.full(len(SIZES), "red")
    assert "coding" not in str(refuses("y", SDNNRegressor().fit, SIZES[:, None], words))


def test_an_unseen_category_is_predicted_like_a_correlated_one():
    # No raven is among the samples; its pattern is correlated with that of crows.
    animals = np.array(["crow"] * 60 + ["cat"] * 60)
    light = RANDOM.uniform(0, 1, 120)
    table = np.array([[animal, x] for animal, x in zip(animals, light, strict=True)], dtype=object)
    likeness = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.9], [0.0, 0.9, 1.0]]
    coding = CorrelationMatrix(matrix=likeness, categories=("cat", "crow", "raven"))
    model = SDNNClassifier([(coding, 0)], n_pattern_units=1000, random_state=0)
    model.fit(table, animals == "crow")
    ravens = np.array([["raven", x] for x in np.linspace(0, 1, 20)], dtype=object)
    assert model.predict(ravens).all()


def test_a_single_input_has_its_plain_pattern_as_code():
    x = np.linspace(0, 1, 101)[:, None]
    y = np.sin(7 * x[:, 0])
    coding = RandomInverse(length_scale=0.1)
    model = SDNNRegressor(coding, n_pattern_units=1000, max_iter=300, random_state=0)
    model.fit(x[::2], y[::2])
    assert model.pairs_ == ((0, 0),)
    assert set(np.unique(model.transform_code(x))) == {-1, 1}
    assert model.score(x[1::2], y[1::2]) > 0.97


def test_inputs_in_no_pair_do_not_change_predictions():
    x = np.random.RandomState(0).uniform(size=(50, 3))
    model = SDNNRegressor(pairs=[(0, 1), (1, None)], max_iter=3, **SMALL).fit(x, x[:, 0])
    other = x.copy()
    other[:, 2] = 0.5
    np.testing.assert_array_equal(model.predict(x), model.predict(other))
    assert model.transform_code(x).shape == (50, 2 * 256)  # samples, units of two pairs


def test_shared_tables_are_permutations_and_separate_ones_differ():
    codings = [RandomInverse(low=0, high=1).fit(np.array([0.0, 1.0]), 64)] * 3
    pairs = input_pairs("all", None, 3)
    shared = draw_input_code(codings, pairs, 64, "shared", 1)
    assert len({id(table) for table in shared.modified}) == len(codings)
    # A pair (mu, nu) is the pattern of input mu, modified by that of input nu.
    table_of_input = {mu: table for (mu, _), table in zip(pairs, shared.modified, strict=True)}
    for (_, nu), modifier in zip(pairs, shared.modifiers, strict=True):
        table = table_of_input[nu]
        assert not np.array_equal(table, modifier)
        assert sorted(table.T.tolist()) == sorted(modifier.T.tolist()), "the same units, reordered"
    separate = draw_input_code(codings, pairs, 64, "separate", 1)
    tables = [*separate.modified, *separate.modifiers]
    assert len({table.tobytes() for table in tables}) == 2 * len(pairs), "two for each pair"


def test_a_single_symbolic_input_learns_a_lookup_table():
    words = np.array([["a"], ["b"], ["c"], ["d"]], dtype=object)
    model = SDNNClassifier("symbolic", n_pattern_units=100, random_state=0).fit(words, [0, 1, 1, 0])
    assert model.predict(words).tolist() == [0, 1, 1, 0]
    assert Symbolic().fit(words[:, 0], 100).size == 4


def test_pandas_categories_and_nullable_numbers_have_the_bits_of_objects():
    random = np.random.RandomState(4)
    frame = pd.DataFrame(
        {
            "kind": pd.Categorical(random.choice(["u", "v"], 40)),
            "open": random.uniform(size=40) > 0.5,
            "count": pd.array(random.randint(0, 5, 40), dtype="Int64"),
            "wind": pd.array(random.uniform(size=40), dtype="Float64"),
        }
    )
    y = random.uniform(size=40)
    options = {"coding": [("symbolic", ["kind"])], "n_pattern_units": 32, "random_state": 0}
    model = SDNNRegressor(**options).fit(frame, y)
    types = {name: str if name == "kind" else float for name in frame}
    objects = frame.astype(types).astype(object)
    np.testing.assert_array_equal(model.predict(frame), model.predict(objects))
    np.testing.assert_array_equal(model.weights_, SDNNRegressor(**options).fit(objects, y).weights_)
    row = frame.iloc[0].to_dict()
    assert model.predict_one(row) == model.predict(frame)[0]


def test_dates_are_refused_by_name():
    days = pd.date_range("2024-01-01", periods=10)
    y = np.arange(10.0)
    frames = [
        pd.DataFrame({"wind": y, "when": days}),
        pd.DataFrame({"wind": y, "when": days.tz_localize("UTC")}),
        pd.DataFrame({"when": days}),
        pd.DataFrame({"wind": y, "when": days - days[0]}),
    ]
    for frame in frames:
        for coding in ("random-inverse", [("symbolic", ["when"])]):
            refuses("when", SDNNRegressor(coding, **SMALL).fit, frame, y)
    refuses("0", SDNNRegressor(**SMALL).fit, days.to_numpy()[:, None], y)  # number of the column
    objects = np.array([[1.0, day] for day in days.to_pydatetime()], dtype=object)
    refuses("1", SDNNRegressor(**SMALL).fit, objects, y)


def test_set_params_reaches_listed_codings_by_number_or_all_at_once():
    model = SDNNRegressor([("anchor", [0]), (WithMissing(base=Circular()), [1]), ("circular", [2])])
    model.set_params(coding__period=24.0, coding__1__base__period=7.0, coding__0__n_interpolated=8)
    first, second, third = (coding for coding, _ in model.coding)
    assert (first.n_interpolated, second.base.period, third.period) == (8, 7.0, 24.0)
    parameters = model.get_params()
    assert parameters["coding__2__period"] == 24.0
    of_codings = {name: parameters[name] for name in parameters if name.startswith("coding__")}
    clone(model).set_params(**of_codings)  # raises an error if one of them is unknown
    assert SDNNRegressor("circular").get_params()["coding__period"] == Circular().period
    assert "coding__period" not in SDNNRegressor("circular").get_params(deep=False)
    refuses("coding__rho", model.set_params, coding__rho=0.5)
    refuses("coding__3__period", model.set_params, coding__3__period=0.5)
    refuses("period", SDNNRegressor("anchor").set_params, coding__period=24.0)


@pytest.mark.parametrize("estimator", [SDNNRegressor, SDNNKernelRidge])
def test_categorical_columns_are_symbols_without_a_coding(estimator):
    options = SMALL if estimator is SDNNRegressor else {}
    typed = TABLE.astype({"color": "category"})
    expected_model = estimator([(WithMissing(base=Symbolic()), ["color"])], **options).fit(
        TABLE, TARGETS
    )
    for coding in ("random-inverse", [("random-inverse", ["hour"])]):
        model = estimator(coding, **options).fit(typed, TARGETS)
        np.testing.assert_array_equal(model.predict(typed), expected_model.predict(TABLE))
        # Columns of the type category and of strings are the same inputs.
        np.testing.assert_array_equal(model.predict(TABLE), expected_model.predict(TABLE))
    without_red = typed.assign(color=typed["color"].cat.remove_categories(["red"]))  # missing now
    assert np.isfinite(model.predict(without_red)).all()
    numbers = TABLE.assign(color=pd.Categorical(TABLE["color"].map({"red": 1, "blue": 2})))
    assert np.isfinite(estimator(**options).fit(numbers, TARGETS).predict(numbers)).all()


def test_categorical_columns_survive_selection_of_pairs_and_saving(tmp_path):
    typed = TABLE.astype({"color": "category"})
    model = SDNNRegressor(pairs="auto", **SMALL).fit(typed, TARGETS)
    model.partial_fit(typed, TARGETS)
    model.save(tmp_path / "model")
    loaded = SDNNRegressor.load(tmp_path / "model")
    np.testing.assert_array_equal(loaded.predict(typed), model.predict(TABLE))


@pytest.mark.parametrize("estimator", [SDNNClassifier, SDNNKernelClassifier])
@pytest.mark.parametrize("labels", [[1, "a"], [None, "a"], [None, 1]])
def test_labels_of_mixed_types_are_refused(estimator, labels):
    mixed = np.array(labels * 20, dtype=object)
    refuses("labels", estimator().fit, np.arange(40.0)[:, None], mixed)


def test_errors_of_unsupported_columns_name_them():
    frame = TABLE.assign(when=pd.period_range("2020", periods=len(TABLE), freq="D"))
    refuses("when", SDNNRegressor(**SMALL).fit, frame, TARGETS)
    refuses("color", SDNNRegressor(**SMALL).fit, TABLE, TARGETS)
    mixed = np.array([[0.0, "a"], [1.0, 2.0]] * 9, dtype=object)
    refuses("column", SDNNRegressor([("symbolic", [1])], **SMALL).fit, mixed, np.arange(18.0))


def test_saving_categories_of_bytes_is_refused_with_the_column(tmp_path):
    table = np.array([[0.0, b"a"], [1.0, b"b"]] * 9, dtype=object)
    model = SDNNRegressor([("symbolic", [1])], **SMALL).fit(table, np.arange(18.0))
    with pytest.raises(TypeError, match="column 1"):
        model.save(tmp_path / "model")


@pytest.mark.parametrize("coding", ["random-inverse", "anchor", RandomInverse(spacing="quantile")])
@pytest.mark.parametrize("end", [1e306, 5e-324])
def test_extreme_ranges_are_learned(coding, end):
    X = np.random.RandomState(0).uniform(-1, 1, (40, 2)) * [1, end]
    X[:2, 1] = -end, end
    for model in (SDNNRegressor(coding, **SMALL), SDNNKernelRidge(coding)):
        assert np.isfinite(model.fit(X, X[:, 0]).predict(X)).all()
