"""Settings that decide a network: other values of them are refused where it learns more.

A trained network keeps its patterns, pairs and units. It could follow a change of these settings
only by beginning anew, which is for users to decide.
"""

from __future__ import annotations

import dataclasses
import functools
from collections.abc import Callable, Iterable, Iterator, Mapping
from typing import Any

import numpy as np

from sdnn.coding import Coding
from sdnn.coding.symbols import is_missing
from sdnn.estimators.columns import (
    coding_entries,
    codings_of_columns,
    field_names,
    input_pairs,
)
from sdnn.support.arguments import argument_error, shown

Estimator = Any
"""An `SDNNRegressor` or `SDNNClassifier`, whose base class imports this module."""
Settings = dict[str, object]
Meaning = Callable[[str, object], object]
"""Returns the value of a named setting in a form that is equal for all values of one meaning."""


def copied(value: object) -> object:
    """Copy the lists, arrays and sets of a setting, which users may change in place."""
    if isinstance(value, list):
        return list(map(copied, value))
    if isinstance(value, tuple):
        return tuple(map(copied, value))
    # Codings are immutable, and a user's own coding may be equal to nothing but itself.
    return value.copy() if hasattr(value, "copy") and not isinstance(value, Coding) else value


def plain(value: object) -> object:
    """Return a setting in tuples and Python's numbers, so that equal values of any types are equal.

    >>> plain([1, np.array([2.0, np.nan])]) == plain((1.0, (np.int64(2), float("nan"))))
    True
    """
    if isinstance(value, Coding) and dataclasses.is_dataclass(value):
        return type(value), *(plain(getattr(value, name)) for name in field_names(value))
    if isinstance(value, Mapping):
        return {key: plain(item) for key, item in value.items()}
    if isinstance(value, set | frozenset):
        return frozenset(value)
    if hasattr(value, "__array__"):  # arrays and numbers of NumPy, and what pandas has
        value = np.asarray(value).tolist()
    if isinstance(value, Iterable) and not isinstance(value, str | bytes | Iterator):
        return tuple(map(plain, value))
    return ("NaN",) if value is not None and is_missing(value) else value  # NaN equals nothing


def plain_setting(name: str, value: object) -> object:
    """Return a setting as `plain` does, with codings instead of their names."""
    is_coding = name.endswith("coding")  # "model.coding" of a stream
    return plain(coding_entries(value) if is_coding else value)  # type: ignore[arg-type]


def settings_of(model: Estimator) -> Settings:
    """Return copies of the settings that decide the network of an estimator."""
    return {name: copied(getattr(model, name)) for name in model._network_settings}


def setting_of_network(model: Estimator, name: str, value: Any) -> object:
    """Return a setting in plain form: that of each feature, pair or output where it has these."""
    names, n_features = model._feature_names(), model.n_features_in_
    if name == "coding":
        columns = [columns for _, columns in coding_entries(value)]
        if any(callable(chosen) or isinstance(chosen, Iterator) for chosen in columns):
            return plain_setting(name, value)  # only the samples of the first fit can resolve them
        return plain(codings_of_columns(value, names, n_features))
    if name == "pairs" and not (isinstance(value, str) and value != "all"):  # words draw or select
        return plain(sorted(input_pairs(value, names, n_features)))
    if name == "output_range" and value is not None:
        ranges = plain(value)
        is_for_all = isinstance(ranges, tuple) and not any(isinstance(r, tuple) for r in ranges)
        return (ranges,) * model.n_outputs_ if is_for_all else ranges
    return plain_setting(name, value)


def settings_in_use(model: Estimator) -> Settings:
    """Return the settings that would make a fitted network as it is, as `setting_of_network`."""
    state, code = vars(model), model.network_.input_code
    return {
        "coding": plain(code.codings),
        "pairs": plain(sorted(code.pairs)),
        "n_pattern_units": code.core.n_units,
        "n_output_units": state.get("_counts_of_range"),
        "output_range": plain(state.get("output_range_")),
        "scheme": state.get("_scheme"),
        "n_units_per_class": state.get("_n_units_each"),
    }


def changed_settings(begun_with: Settings, settings: Settings, meaning: Meaning) -> list[str]:
    """Return the names of the settings with another meaning than before."""
    return [
        name
        for name, value in begun_with.items()
        if settings[name] is not value  # fast: it is called before each sample of a stream
        and not is_equal(settings[name], value)
        and meaning(name, settings[name]) != meaning(name, value)
    ]


def is_equal(first: object, second: object) -> bool:
    """Return whether two values are equal, also arrays and lists of arrays; False if in doubt."""
    if isinstance(first, np.ndarray) and isinstance(second, np.ndarray):
        return np.array_equal(first, second)
    try:
        return bool(first == second)
    except (TypeError, ValueError):  # lists of arrays, or pandas' NA
        pass
    if isinstance(first, list | tuple) and isinstance(second, list | tuple):
        return len(first) == len(second) and all(map(is_equal, first, second))
    return False


def change_error(name: str, old: object, new: object, learner: str, remedy: str) -> Exception:
    """Make the error about a setting that was changed after a network or a stream began."""
    kept = f"must stay {shown(old)}, with which the {learner} began, got {shown(new)}"
    return argument_error(name, f"{kept}: set it back, or {remedy}")


def require_settings_of_network(model: Estimator) -> None:
    """Raise ValueError if an estimator has other settings than its network, which is to learn."""
    settings = {name: getattr(model, name) for name in model._begun_with}
    meaning = functools.partial(setting_of_network, model)
    for name in changed_settings(model._begun_with, settings, meaning):
        if meaning(name, settings[name]) != settings_in_use(model).get(name):
            remedy = "learn anew: fit with warm_start=False, or a clone of the estimator"
            raise change_error(name, model._begun_with[name], settings[name], "network", remedy)
