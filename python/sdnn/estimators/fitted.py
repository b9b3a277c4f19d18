"""The attributes of a fitted estimator, and its file: arrays and a description."""

from __future__ import annotations

import contextlib
import json
from collections.abc import Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray
from sklearn.base import BaseEstimator
from sklearn.utils.validation import check_is_fitted

from sdnn import _core
from sdnn.coding import Coding, from_dict, to_dict
from sdnn.coding.symbols import Categorical, present
from sdnn.estimators.columns import Array, Codings, Floats, Ints, coding_entries
from sdnn.estimators.network import InputCode, Network, code_bytes
from sdnn.estimators.network_settings import changed_settings, plain_setting, settings_of
from sdnn.support.arguments import seed_of, whole
from sdnn.support.files import Arrays, Description, read_file, write_file

MOST_BYTES_OF_NAMES = 2**26
STEEPNESSES = (1.0, 25.0)  # bounds of a calibrated steepness of the classifier's softmax
NAMES = ("classes_", "feature_names_in_")  # arrays whose type may be text


class Learned(BaseEstimator):
    """Base of estimators: the attributes that files hold unchanged, in their order there."""

    n_corrected_: NDArray[np.int64]
    n_features_in_: int
    n_inputs_out_of_range_: int
    n_iter_: int
    n_outputs_: int
    n_outputs_out_of_range_: int
    output_range_: Floats
    training_form_: str
    training_memory_: int
    validation_scores_: Floats
    _counts_of_range: int  # units per output, which divide its range
    _flat: bool  # whether targets have one dimension
    _n_units_each: int  # units per class
    _n_weighted: int  # weighted samples that partial_fit has received
    _scheme: str
    _weight_seed: int
    held_out_counts_: Floats
    held_out_residuals_: Floats
    steepness_: float


PLAIN_TYPES = {"bool": bool, "float": float, "int": int, "str": str}
ATTRIBUTES: dict[str, type] = {
    name: PLAIN_TYPES.get(annotation, np.ndarray)
    for name, annotation in Learned.__annotations__.items()
}
"""Types that files have for the attributes of `Learned`, whose annotations are text."""


class Fitted(Learned):
    """Attributes of an estimator that holds a network, and its file."""

    coding: Codings
    memory_limit: int
    n_iter_no_change: int
    shuffle: bool
    verbose: int
    network_: Network
    _network_settings: tuple[str, ...] = ("coding", "ranges", "n_pattern_units", "pairs", "tables")
    """Settings that decide the network: it cannot follow later changes of them."""
    _begun_with: dict[str, object]
    """Values that these settings had when the network began."""
    _earlier: tuple[Network, ...] = ()
    _n_weighted = 0

    @property
    def _fitted_network(self) -> Network:
        """The network; NotFittedError before the first fit."""
        if "network_" not in self.__dict__:  # scikit-learn's check takes as long as small networks
            check_is_fitted(self, "network_")
        return self.network_

    @property
    def codings_(self) -> tuple[Coding, ...]:
        """Fitted coding of each input."""
        return self._fitted_network.input_code.codings

    @property
    def pairs_(self) -> tuple[tuple[int, int], ...]:
        """Pairs (modified, modifier) of inputs; equal numbers for the plain pattern."""
        return self._fitted_network.input_code.pairs

    @property
    def weights_(self) -> Ints:
        """Integer weights, shape (n_units, n_pairs * n_pattern_units)."""
        return self._fitted_network.layer.weights

    @property
    def thresholds_(self) -> Ints:
        """Integer thresholds, shape (n_units,)."""
        return self._fitted_network.layer.thresholds

    def _networks_for(self, n_samples: int) -> tuple[Network, ...]:
        """Return the networks to average, with weights in bytes where that predicts faster."""
        networks = (*self._earlier, self.network_)
        for network in networks:
            network.expect_few(n_samples, self.memory_limit // len(networks))
        return networks

    def _counts(self, bins: Ints, n_groups: int, n_threads: int) -> Ints:
        """Return the firing counts of averaged networks, (n_networks, n_samples, n_groups)."""
        networks = self._networks_for(len(bins))
        if all(network.predicts_in_bytes(len(bins)) for network in networks):
            return np.stack([network.counts(bins, n_groups, n_threads) for network in networks])
        layers = [network.layer for network in networks]
        return _core.counts_of_all(layers, bins, n_groups, n_threads)

    @property
    def pair_names_(self) -> list[tuple[str | int, str | int | None]]:
        """The pairs by names of the features, as ``pairs`` takes them."""
        names = getattr(self, "feature_names_in_", np.arange(len(self.codings_))).tolist()
        return [(names[mu], None if mu == nu else names[nu]) for mu, nu in self.pairs_]

    def _weight_changes(self) -> Floats:
        """Return for each feature the mean squared change of its pairs' weights by training."""
        network, code = self.network_, self.network_.input_code
        untrained = _core.ParallelPerceptron(code.core, network.n_units, seed=self._weight_seed)
        change = network.layer.weights - untrained.weights
        of_pairs = change.reshape(network.n_units, len(code.pairs), code.core.n_units)
        squares: Floats = np.square(of_pairs, dtype=np.float64).sum(axis=(0, 2))
        total, count = np.zeros((2, self.n_features_in_))
        for pair, square in zip(code.pairs, squares.tolist(), strict=True):
            for feature in set(pair):
                total[feature] += square
                count[feature] += 1
        return total / np.maximum(count, 1)

    def save(self, path: str | Path) -> None:
        """Write the fitted estimator to a safetensors file with JSON metadata, without pickle.

        Raises TypeError if a parameter cannot be written as JSON, such as a user-defined coding.
        """
        check_is_fitted(self, "network_")
        state, code = vars(self), self.network_.input_code
        tables = {id(table): table for table in (*code.modified, *code.modifiers)}
        number_of = {key: number for number, key in enumerate(tables)}
        networks = (self.network_, *self._earlier)
        fitted = {name: state[name] for name in ATTRIBUTES if name in state}
        arrays = {name: value for name, value in fitted.items() if isinstance(value, np.ndarray)}
        for number, table in enumerate(tables.values()):
            arrays[f"table.{number}"] = np.packbits(table > 0, axis=1)
        for number, network in enumerate(networks):
            arrays[f"weights.{number}"] = in_smallest_type(network.layer.weights)
            arrays[f"thresholds.{number}"] = in_smallest_type(network.layer.thresholds)
        attributes = {name: value for name, value in fitted.items() if name not in arrays}
        parameters = self.get_params(deep=False)
        description = {
            "class": type(self).__name__,
            "parameters": {name: json_value(value) for name, value in parameters.items()},
            "attributes": attributes,
            "names": {name: typed_list(state[name]) for name in NAMES if name in state},
            "codings": [description_of(index, coding) for index, coding in enumerate(code.codings)],
            "pairs": code.pairs,
            "n_units": self.network_.n_units,
            "n_networks": len(networks),
            "n_pattern_units": code.core.n_units,
            "modified": [number_of[id(table)] for table in code.modified],
            "modifiers": [number_of[id(table)] for table in code.modifiers],
        }
        changed = changed_settings(self._begun_with, settings_of(self), plain_setting)
        begun_with = {}
        for name in changed:
            with contextlib.suppress(TypeError):  # a function, which the estimator no longer has
                begun_with[name] = json_value(self._begun_with[name])
        if begun_with:
            description["begun_with"] = begun_with
        write_file(Path(path), "estimator", arrays, description)

    @classmethod
    def load(cls, path: str | Path, *, memory_limit: int = 2**27) -> Self:
        """Read an estimator that `save` has written.

        Parameters
        ----------
        path : path
        memory_limit : int
            Bytes that the patterns may take; a small file may describe large ones.

        Raises
        ------
        OSError
            If the file cannot be read or is not a regular file.
        ValueError
            If it is damaged, holds another estimator or needs more memory.
        """
        path = Path(path)
        description, arrays = read_file(path, "estimator")
        if description.get("class") != cls.__name__:
            raise ValueError(f"{path} holds an {description.get('class')}, not an {cls.__name__}")
        try:
            return cls._read(description, arrays, memory_limit)
        except (
            ArithmeticError, AttributeError, LookupError, RecursionError, TypeError, ValueError,
        ) as error:  # fmt: skip
            raise ValueError(f"{path} is damaged: {error or repr(error)}") from error

    @classmethod
    def _read(cls, description: Description, arrays: Arrays, memory_limit: int) -> Self:
        """Make the estimator with its parameters and everything it has learned."""
        parameters = {name: restored(value) for name, value in description["parameters"].items()}
        estimator = cls(**parameters)
        estimator._validate_params()
        coding_entries(estimator.coding)
        estimator._begun_with = settings_of(estimator)
        for name, value in description.get("begun_with", {}).items():
            if name not in cls._network_settings:
                raise ValueError(f"begun_with.{name} is no setting of a network")
            estimator._begun_with[name] = restored(value)
        stored = {**description["attributes"], **arrays}
        for name, expected in ATTRIBUTES.items():
            if name in stored:
                if type(stored[name]) is not expected:
                    problem = f"must be of type {expected.__name__}, got {stored[name]!r:.80}"
                    raise ValueError(f"attributes.{name} {problem}")
                setattr(estimator, name, stored[name])
        for name in NAMES:
            if name in description["names"]:
                setattr(estimator, name, array_of_names(name, description["names"][name]))
        code = read_code(description, arrays, memory_limit)
        estimator.network_, *earlier = (
            Network(
                code,
                description["n_units"],
                weights=arrays[f"weights.{number}"].astype(np.int32),
                thresholds=arrays[f"thresholds.{number}"].astype(np.int32),
            )
            for number in range(description["n_networks"])
        )
        estimator._earlier = tuple(earlier)
        require_consistent(estimator)
        return estimator


def mean_of(arrays: Sequence[Array] | Array) -> Array:
    """Return the mean of several arrays, or a single array unchanged."""
    return np.mean(arrays, axis=0) if len(arrays) > 1 else arrays[0]


def description_of(index: int, coding: Coding) -> dict[str, object]:
    """Describe the coding of an input; TypeError that names it if that is impossible."""
    try:
        description = to_dict(coding)
        json.dumps(description)
    except TypeError as error:
        raise TypeError(f"the coding of column {index} cannot be saved: {error}") from None
    return description


def json_value(value: object) -> object:
    """Turn a parameter into data that JSON can hold; TypeError if that is impossible."""
    if isinstance(value, Coding):
        return to_dict(value)
    if isinstance(value, np.ndarray | np.generic):
        return json_value(value.tolist())
    if isinstance(value, slice):
        return {"slice": [json_value(part) for part in (value.start, value.stop, value.step)]}
    if isinstance(value, Mapping):  # as a list, because keys may be numbers
        return {"dict": [[json_value(key), json_value(item)] for key, item in value.items()]}
    if isinstance(value, np.random.RandomState):
        return None  # a fitted model draws no further numbers
    if value is None or isinstance(value, str | int | float | bool):
        return value
    if hasattr(value, "__array__"):  # columns and labels of pandas
        return json_value(np.asarray(value))
    if isinstance(value, Iterable) and not isinstance(value, bytes | Iterator):
        return [json_value(item) for item in value]
    raise TypeError(f"a parameter cannot be saved: {value!r}")


def restored(value: Any) -> Any:
    """Return the parameter that `json_value` described."""
    if isinstance(value, dict):
        if "slice" in value:
            return slice(*value["slice"])
        if "dict" in value:
            return {restored(key): restored(item) for key, item in value["dict"]}
        return from_dict(value)
    return [restored(item) for item in value] if isinstance(value, list) else value


def in_smallest_type(values: Ints) -> Array:
    """Convert integers to the smallest type that holds them."""
    for integer in (np.int8, np.int16):
        if np.array_equal(narrow := values.astype(integer), values):
            return narrow
    return values


def typed_list(values: Array) -> dict[str, object]:
    """Describe an array of labels or names with its type."""
    type_name = "object" if values.dtype == object else values.dtype.str
    return {"type": type_name, "values": values.tolist()}


def array_of_names(name: str, stored: Mapping[str, Any]) -> Array:
    """Return the array that `typed_list` described."""
    values, dtype = stored["values"], np.dtype(stored["type"])
    if dtype.kind not in "biufUO" or dtype.itemsize * len(values) > MOST_BYTES_OF_NAMES:
        raise ValueError(f"names.{name}.type must be one of labels, got {stored['type']!r}")
    array = np.array(values, dtype=dtype)
    if array.ndim != 1:
        raise ValueError(f"names.{name}.values must be a list of labels")
    return array


def require_consistent(estimator: Fitted) -> None:
    """Raise ValueError unless numbers of units, inputs and bins of a loaded estimator agree."""
    attributes, network = vars(estimator), estimator.network_
    code = network.input_code
    seed_of(attributes["_weight_seed"])  # raises for a seed out of range
    if "classes_" in attributes:
        n_groups = _core.n_units_for(attributes["_scheme"], len(attributes["classes_"]))
        fits = network.n_units == n_groups * attributes["_n_units_each"]
    else:
        n_outputs = attributes["n_outputs_"]
        fits = attributes["output_range_"].shape == (n_outputs, 2) and "_flat" in attributes
        fits = fits and network.n_units == n_outputs * attributes["_counts_of_range"]
    fits = fits and len(code.codings) == attributes["n_features_in_"]
    for (mu, nu), modified, modifier in zip(code.pairs, code.modified, code.modifiers, strict=True):
        fits = fits and len(modified) == code.codings[mu].size
        fits = fits and len(modifier) == code.codings[nu].size
    if not fits:
        raise ValueError("its parts do not fit together")
    require_calibration(attributes)


def require_calibration(attributes: Mapping[str, Any]) -> None:
    """Raise ValueError for impossible held-out residuals or an impossible steepness, if any."""
    if "held_out_residuals_" in attributes or "held_out_counts_" in attributes:
        residuals, counts = attributes["held_out_residuals_"], attributes["held_out_counts_"]
        fits = residuals.dtype == counts.dtype == np.float64 and len(counts) > 0
        fits = fits and residuals.shape == (len(counts), attributes["n_outputs_"])
        fits = fits and counts.ndim == 1 and np.isfinite(counts).all() and counts.min() > 0
        if not (fits and np.isfinite(residuals).all()):
            raise ValueError("its held-out residuals must be finite, with counts above 0")
    low, high = STEEPNESSES
    steepness = attributes.get("steepness_", low)
    if not low <= steepness <= high:
        raise ValueError(f"steepness_ must be within [{low}, {high}], got {steepness}")


def require_fitted(coding: Coding, n_units: int) -> Coding:
    """Return a coding that is fitted; ValueError if it is not, or a field of it is wrong."""
    # Fitted again, to its own categories or range, a coding must not change.
    base = present(coding)
    if isinstance(base, Categorical):
        values = np.empty(base.size, object)
        values[:] = base.categories
    else:
        values = np.array(base.ends() or (0.0,))
    if coding.fit(values, n_units) != coding:
        raise ValueError(f"{coding} is not fitted")
    return coding


def read_code(description: Description, arrays: Arrays, memory_limit: int) -> InputCode:
    """Build the code of a file; ValueError before allocation if it exceeds ``memory_limit``."""
    n_units = whole("n_pattern_units", description["n_pattern_units"], 2, 2**24)
    codings = [require_fitted(from_dict(coding), n_units) for coding in description["codings"]]
    last = len(codings) - 1
    pairs = [
        (whole("pairs", mu, 0, last), whole("pairs", nu, 0, last))
        for mu, nu in description["pairs"]
    ]
    n_bytes = code_bytes(codings, pairs, n_units)
    if n_bytes > memory_limit:
        raise ValueError(
            f"its patterns need {n_bytes} bytes, more than memory_limit={memory_limit}"
        )
    tables = {}
    for number in {*description["modified"], *description["modifiers"]}:
        bits = arrays[f"table.{number}"]
        if bits.dtype != np.uint8 or bits.ndim != 2 or bits.shape[1] != -(-n_units // 8):
            raise ValueError(f"table.{number} must have the bits of patterns of {n_units} units")
        signs = np.unpackbits(bits, axis=1, count=n_units).astype(np.int8)
        tables[number] = (2 * signs - 1).astype(np.int8)
    return InputCode(
        codings,
        pairs,
        [tables[number] for number in description["modified"]],
        [tables[number] for number in description["modifiers"]],
    )
