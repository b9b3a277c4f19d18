"""The estimators keep scikit-learn's rules."""

import dataclasses
import inspect

import numpy as np
import pandas as pd
import pytest
from scipy import sparse
from sklearn.base import clone
from sklearn.exceptions import NotFittedError
from sklearn.model_selection import GridSearchCV, cross_val_score
from sklearn.pipeline import make_pipeline
from sklearn.preprocessing import StandardScaler
from sklearn.utils.estimator_checks import check_estimator

from processes import python
from refusals import refuses
from sdnn import SDNNClassifier, SDNNKernelClassifier, SDNNKernelRidge, SDNNRegressor, _core
from sdnn.coding import CoarseCodeWarning, RandomInverse

RANDOM = np.random.RandomState(0)
X = RANDOM.uniform(-2, 3, (120, 3))
Y = np.sin(X[:, 0]) + X[:, 1] * X[:, 2]
LABELS = np.array(["low", "middle", "high"])[np.digitize(Y, [-0.5, 1.0])]

SMALL = {"n_pattern_units": 64, "max_iter": 5, "random_state": 0}


@pytest.fixture(params=[SDNNRegressor, SDNNClassifier])
def estimator(request):
    return request.param(**SMALL)


def targets_of(estimator):
    return Y if isinstance(estimator, SDNNRegressor) else LABELS


@pytest.mark.filterwarnings("ignore")
@pytest.mark.parametrize(
    "model",
    [
        SDNNRegressor(),
        SDNNClassifier(),
        SDNNClassifier(scheme="one_vs_one", n_pattern_units=100),
        SDNNRegressor(
            "anchor", early_stopping=True, tables="separate", n_pattern_units=100, n_output_units=70
        ),
        SDNNClassifier(RandomInverse(spacing="quantile"), early_stopping=True, n_pattern_units=100),
    ],
    ids=["regressor", "classifier", "one-versus-one", "regressor-options", "classifier-options"],
)
def test_scikit_learns_check_estimator_finds_no_fault(model):
    results = check_estimator(model, on_skip=None, on_fail=None)
    not_passed = {r["check_name"]: r["status"] for r in results if r["status"] != "passed"}
    # The first, of newer versions, needs an environment variable that is read when SciPy is
    # imported. The second cannot hold where the order of samples matters; scikit-learn's
    # Perceptron fails it too.
    assert not_passed.pop("check_array_api_input", "skipped") == "skipped"
    assert not_passed == {"check_sample_weight_equivalence_on_dense_data": "failed"}
    assert len(results) > 45, "nearly all checks were run"


def test_importing_sdnn_imports_no_scikit_learn():
    code = (
        "import sys, sdnn, sdnn.coding, sdnn.coding.kernel, sdnn.estimators\n"
        "assert not {'sklearn', 'joblib', 'safetensors', 'scipy', 'matplotlib'} & set(sys.modules)"
    )
    python("-c", code, check=True)


def test_a_missing_scikit_learn_is_named_with_its_installation():
    code = (
        "import sys\nsys.modules['sklearn'] = None; sys.modules['joblib'] = None\nimport sdnn\n"
        "try: sdnn.SDNNRegressor\n"
        "except ImportError as error: print(error)"
    )
    assert "pip install scikit-learn" in python("-c", code, check=True).stdout


def test_sparse_samples_are_refused(estimator):
    refuses("dense", estimator.fit, sparse.csr_matrix(X), targets_of(estimator), error=TypeError)
    estimator.fit(X, targets_of(estimator))
    refuses("dense", estimator.predict, sparse.csr_matrix(X), error=TypeError)


def test_unfitted_estimators_and_wrong_features_are_refused(estimator):
    for use in (
        lambda: estimator.predict(X),
        lambda: estimator.transform_code(X),
        lambda: estimator.save("model.safetensors"),
        lambda: estimator.codings_,
        lambda: estimator.weights_,
    ):
        with pytest.raises(NotFittedError):
            use()
    assert not hasattr(estimator, "thresholds_")
    estimator.fit(X, targets_of(estimator))
    refuses("features", estimator.predict, X[:, :2])


def test_invalid_targets_are_refused():
    refuses("NaN", SDNNRegressor(**SMALL).fit, X, np.full(len(X), np.nan))
    refuses("y", SDNNRegressor(**SMALL).fit, X, LABELS)
    refuses("label", SDNNClassifier(**SMALL).fit, X, Y)
    refuses("class", SDNNClassifier(**SMALL).fit, X, np.zeros(len(X)))


@pytest.mark.parametrize(
    ("parameters", "error"),
    [
        ({"n_pattern_units": 63}, "n_pattern_units"),
        ({"pairs": []}, "pairs"),
        ({"pairs": [(0, 0)]}, "(0, 0)"),
        ({"pairs": [(0, 3)]}, "3"),
        ({"pairs": [("a", "b")]}, "feature"),
        ({"pairs": [0, 1]}, "pair"),
        ({"coding": "correlation-matrix"}, "matrix"),
        ({"coding": ("anchor", [0, 1])}, "anchor"),
        ({"coding": [("anchor", [0, 1]), ("circular", 1)]}, "coding"),
        ({"n_pattern_units": 2**24}, "memory_limit=1073741824"),
        ({"coding": RandomInverse(low=1.0, high=1.0)}, "low"),
    ],
)
def test_impossible_parameters_are_refused_by_name(estimator, parameters, error):
    refuses(error, estimator.set_params(**parameters).fit, X, targets_of(estimator))


@pytest.mark.parametrize(
    "estimator_class", [SDNNRegressor, SDNNClassifier, SDNNKernelRidge, SDNNKernelClassifier]
)
def test_every_parameter_is_checked_by_learn_one(estimator_class):
    names = set(estimator_class().get_params(deep=False))
    assert names == set(estimator_class()._parameter_constraints)
    options = {"classes": [0, 1]} if estimator_class is SDNNClassifier else {}
    for name in names if hasattr(estimator_class, "learn_one") else ():
        for bad in (object(), "unheard"):
            refuses(name, estimator_class(**{name: bad}).learn_one, X[0], 1, **options)


def test_subclasses_can_add_parameters_and_change_defaults():
    @dataclasses.dataclass(kw_only=True, eq=False, repr=False)
    class Mine(SDNNRegressor):
        correction_share: float = 0.5
        note: str = ""

    assert clone(Mine(**SMALL, note="x")).fit(X, Y).note == "x"


def test_a_memory_error_states_the_size_of_the_network(monkeypatch):
    def no_memory(*_arguments, **_options):
        raise MemoryError("std::bad_alloc")

    monkeypatch.setattr(_core, "ParallelPerceptron", no_memory)
    # 4 bytes for each weight of 280 output units, the default, with 64 columns for each of 6 pairs.
    refuses(str(4 * 280 * 6 * 64), SDNNRegressor(**SMALL).fit, X, Y, error=MemoryError)


def test_feature_names_are_stored_and_compared(estimator):
    table = pd.DataFrame(X, columns=["a", "b", "c"])
    estimator.fit(table, targets_of(estimator))
    assert estimator.feature_names_in_.tolist() == ["a", "b", "c"]
    assert estimator.n_features_in_ == 3
    refuses("names", estimator.predict, table[["c", "b", "a"]])


def test_a_constant_feature_does_not_change_predictions(estimator):
    table = np.column_stack([X, np.full(len(X), 7.0)])
    estimator.fit(table, targets_of(estimator))
    changed = table + np.array([0, 0, 0, 5.0])
    np.testing.assert_array_equal(estimator.predict(table), estimator.predict(changed))


def test_parameters_are_stored_unchanged(estimator):
    parameters = {
        "pairs": np.array([(0, 1), (1, 2)]),
        "coding": [("anchor", [0])],
        "max_iter": "many",
    }
    model = type(estimator)(**parameters)
    assert all(getattr(model, name) is value for name, value in parameters.items())
    read_once = type(estimator)(pairs=iter([(0, 1)]))
    refuses("pairs", read_once.fit, X, targets_of(estimator))


def test_docstrings_name_every_parameter(estimator):
    documented = inspect.getdoc(estimator).partition("Attributes\n")[0]
    for name in estimator.get_params(deep=False):
        assert documented.count(f"\n{name} : ") == 1, name


@pytest.mark.parametrize("docstring", [None, "My estimator."])
def test_subclasses_need_no_docstring(estimator, docstring):
    subclass = type("Mine", (type(estimator),), {"__doc__": docstring})
    assert subclass.__doc__ == docstring
    assert subclass().get_params() == type(estimator)().get_params()


def test_pipelines_cross_validation_and_grid_search_accept_the_estimators(estimator):
    targets = targets_of(estimator)
    pipeline = make_pipeline(StandardScaler(), estimator)
    assert cross_val_score(pipeline, X, targets, cv=3).shape == (3,)
    grid = {"coding": [RandomInverse(length_scale=0.5), "anchor"]}
    assert GridSearchCV(estimator, grid, cv=3).fit(X, targets).best_params_["coding"] is not None
    grid = {"coding__length_scale": [0.1, 0.7]}
    search = GridSearchCV(estimator, grid, cv=3).fit(X, targets)
    assert search.best_estimator_.coding.length_scale in grid["coding__length_scale"]
    assert {fitted.length_scale for fitted in search.best_estimator_.codings_} == {
        search.best_params_["coding__length_scale"]
    }
    refuses("length", estimator.set_params, coding__length=0.1)
    listed = estimator.set_params(coding=[("anchor", [0])])
    refuses("coding", listed.set_params, coding__length_scale=0.1)


def test_verbose_prints_progress(estimator, capsys):
    estimator.set_params(verbose=1).fit(X, targets_of(estimator))
    assert "training" in capsys.readouterr().out
    estimator.set_params(verbose=0).fit(X, targets_of(estimator))
    assert capsys.readouterr().out == ""


def test_one_hundred_features_have_500_pairs_within_16_000_columns(estimator):
    table = RANDOM.uniform(size=(20, 100))
    options = {"n_pattern_units": None, "max_iter": 1}
    estimator.set_params(**options).fit(table, targets_of(estimator)[:20])
    assert estimator.weights_.shape[1] == 500 * 32  # pairs, and the units of each pattern
    modified, modifiers = np.array(estimator.pairs_).T
    # 500 pairs of 100 features: each is modified by five others, and modifies five.
    np.testing.assert_array_equal(np.bincount(modified), 5)
    np.testing.assert_array_equal(np.bincount(modifiers), 5)
    assert len(set(estimator.pairs_)) == 500
    again = clone(estimator).fit(table, targets_of(estimator)[:20])
    assert again.pairs_ == estimator.pairs_
    narrow = clone(estimator).fit(table[:, :22], targets_of(estimator)[:20])
    assert len(narrow.pairs_) == 22 * 21, "all ordered pairs, since they are fewer than 500"


def test_a_coding_with_few_bins_warns(estimator):
    estimator.set_params(coding=RandomInverse(length_scale=3.0), n_pattern_units=32)
    with pytest.warns(CoarseCodeWarning, match="length_scale"):
        estimator.fit(X, targets_of(estimator))
