"""Cells (a name, and a function that returns a fault) about missing numbers and weights of 0."""

import itertools
import pickle
import warnings
from pathlib import Path

import numpy as np
import pandas as pd
from sklearn.base import clone

from bad_values import judged
from public_cells import ESTIMATORS
from sdnn.coding import RandomInverse, WithMissing, coding_named
from sdnn.estimators import SDNNClassifier, SDNNKernelClassifier, SDNNRegressor

RANDOM = np.random.default_rng(1)
X = np.column_stack([RANDOM.uniform(-1, 1, (40, 2)), RANDOM.integers(0, 4, 40)])
SUMS, WEIGHTS = X.sum(axis=1), np.repeat([1.0, 0.5, 1.0, 2.5], 10)
LETTERS = np.array([*"abc"])[np.digitize(SUMS, [1, 2])]
CLASSIFIERS, NETWORKS = (SDNNClassifier, SDNNKernelClassifier), (SDNNRegressor, SDNNClassifier)
TARGETS = {
    False: {"numbers": SUMS, "two outputs": np.column_stack([SUMS, X[:, 0]])},
    True: {"whole numbers": np.digitize(SUMS, [1.5]), "letters": LETTERS},
}
"""Targets of regressors, and labels of classifiers."""

SYMBOLS = {"coding": [("symbolic", [2])]}
SETTINGS = {
    True: [{}, {"early_stopping": True}, {"pairs": "auto"}, {"shuffle": False}, SYMBOLS],
    False: [{}, {"degree": 2}, {"alpha": 0.1}, {"pairs": [(0, 1)]}, SYMBOLS],
}
"""Settings of networks, and of kernels."""

FAR = {int: 7, str: "z", float: 1e6}
ABSENT = {
    "equal": lambda X, y: (X, y),
    "far": lambda X, y: (X + 1e6, y),
    "with another target": lambda X, y: (X, np.full_like(y, FAR[type(y.flat[0].item())])),
    "with missing values": lambda X, y: (X * np.nan, y),
}
PLACES = {"first": [0, 0], "inside": [5, 20, 20], "last": [40], "many": [*range(0, 41, 2)]}
SCALES = {"first": 1.0, "inside": 0.1, "last": 1e-3, "many": 10.0}
"""Where rows of weight 0 are inserted among the 40 samples, and factors of all weights."""


def _table(values):
    return pd.DataFrame(values, columns=[*"abc"])


def _learned(model, X, y, weights):
    """Call partial_fit with the classes of present rows."""
    classes = {"classes": np.unique(y[weights > 0])} if isinstance(model, CLASSIFIERS) else {}
    return model.partial_fit(X, y, sample_weight=weights, **classes)


WAYS_TO_LEARN = {
    "fit": lambda model, *data: model.fit(*data),
    "fit of tables": lambda model, X, *data: model.fit(_table(X), *data),
    "fit twice": lambda model, *data: model.fit(*data).set_params(warm_start=True).fit(*data),
    "partial_fit": _learned,
    "partial_fit twice": lambda model, *data: _learned(_learned(model, *data), *data),
}


def weight_cells():
    """Yield cells: a model with rows of weight 0 has the bits of one without, and no warning."""
    for cls in ESTIMATORS:
        tasks = TARGETS[cls in CLASSIFIERS]
        ways = list(WAYS_TO_LEARN)[: 5 if cls in NETWORKS else 2]  # kernels learn by `fit` only
        for task, rows, place, way in itertools.product(tasks, ABSENT, PLACES, ways):
            learn = WAYS_TO_LEARN[way]
            for setting in SETTINGS[cls in NETWORKS] if way == "fit" else [{}]:
                cell = _weight_cell(cls, setting, tasks[task], ABSENT[rows], place, learn)
                yield f"{cls.__name__}({setting}) of {task}: rows {rows} {place}, {way}", cell


def _weight_cell(cls, setting, y, change, place, learn):
    def run():
        indices, weights = PLACES[place], SCALES[place] * WEIGHTS
        rows, targets = change(X[: len(indices)], y[: len(indices)])
        data = np.insert(X, indices, rows, 0), np.insert(y, indices, targets, 0)
        settings = ESTIMATORS[cls][1] | setting
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            expected = learn(cls(**settings), X, y, weights)
            model = learn(cls(**settings), *data, np.insert(weights, indices, 0.0))
        return "" if _state(model) == _state(expected) else "another model was learned"

    return run


def _state(model):
    """Return predictions and all that was learned."""
    predicted = model.predict(_table(X) if hasattr(model, "feature_names_in_") else X).tolist()
    if not isinstance(model, NETWORKS):
        return predicted, model.dual_coef_.tolist(), model.alpha_, model.leave_one_out_error_
    model.save("model")
    return predicted, Path("model").read_bytes()


def _objects(values):
    return np.where(np.isnan(values), None, values.astype(object))


FORMS = {
    "an array": np.asarray,
    "objects": _objects,
    "lists": lambda values: _objects(values).tolist(),
    "a table": _table,
    "a table with NA": lambda values: _table(values).convert_dtypes(),
    "a table with None": lambda values: _table(_objects(values)),
}
CODINGS = ["random-inverse", "anchor", "circular", RandomInverse(low=-3.0, high=5.0)]
GAPS = {"first": [0], "whole numbers": [2], "two": [0, 1], "all": [0, 1, 2]}


def missing_cells():
    """Yield cells: numbers missing from the start are learned, later ones refused by column."""
    for cls in ESTIMATORS:
        occasions = list(OCCASIONS)[: 4 if cls in NETWORKS else 2]
        for coding, gaps, form, occasion in itertools.product(CODINGS, GAPS, FORMS, occasions):
            cell = _missing_cell(cls, coding, GAPS[gaps], FORMS[form], OCCASIONS[occasion])
            yield f"{cls.__name__}({coding}): {gaps} missing in {form}, {occasion}", cell


def _missing_cell(cls, coding, columns, form, occasion):
    def run():
        holes = X.copy()
        for column in columns:  # about every fifth number
            holes[column :: 5 + column, column] = np.nan
        y = next(iter(TARGETS[cls in CLASSIFIERS].values()))
        model = cls(**ESTIMATORS[cls][1], coding=coding)
        return occasion(model, columns, form(X), form(holes), y)

    return run


def _in_fit(model, columns, full, holes, y):
    """Fit with missing numbers; compare with the coding WithMissing for their columns."""
    missing = WithMissing(base=coding_named(model.coding))
    each = [(missing if column in columns else model.coding, [column]) for column in range(3)]
    expected = clone(model).set_params(coding=each).fit(holes, y)
    model.fit(holes, y)
    if any((model.predict(rows) != expected.predict(rows)).any() for rows in (full, holes)):
        return "predicts otherwise than with a coding for missing values"
    row = holes.iloc[0].to_dict() if hasattr(holes, "iloc") else holes[0]
    is_same = not isinstance(model, NETWORKS) or model.predict_one(row) == model.predict(holes)[0]
    return "" if is_same else "predict_one differs from predict"


def _refused(columns, full, call):
    name = full.columns[columns[0]] if hasattr(full, "columns") else columns[0]
    return judged(f"column '?{name}", lambda: f"was not refused: {call()}")


def _in_predict(model, columns, full, holes, y):
    model.fit(full, y)
    return _refused(columns, full, lambda: model.predict(holes))


def _in_first_part(model, columns, full, holes, y):
    for rows in (holes, full, holes):
        _learned(model, rows, y, WEIGHTS)
    return "predicts NaN" if pd.isna(model.predict(holes)).any() else ""


def _in_later_part(model, columns, full, holes, y):
    before = pickle.dumps(vars(_learned(model, full, y, WEIGHTS)))
    fault = _refused(columns, full, lambda: model.partial_fit(holes, y))
    return fault or ("" if pickle.dumps(vars(model)) == before else "a part was learned")


OCCASIONS = {
    "in fit": _in_fit,
    "in predict alone": _in_predict,
    "in the first part": _in_first_part,
    "in a later part alone": _in_later_part,
}
