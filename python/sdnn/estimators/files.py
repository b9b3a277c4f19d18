"""A fitted estimator in a file: arrays, and a description of all else."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from pathlib import Path
from typing import Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from sdnn import _core
from sdnn.arguments import seed_of
from sdnn.coding import Coding, from_dict, to_dict
from sdnn.estimators.network import InputCode, Network
from sdnn.files import Arrays, Description, read_file, write_file

__all__ = ["Saved", "load", "save"]

ATTRIBUTES = (
    "n_corrected_",
    "n_features_in_",
    "n_inputs_out_of_range_",
    "n_iter_",
    "n_outputs_",
    "n_outputs_out_of_range_",
    "output_range_",
    "training_form_",
    "training_memory_",
    "validation_scores_",
    "_counts_of_range",
    "_flat",
    "_n_units_each",
    "_scheme",
    "_weight_seed",
)
NAMES = ("classes_", "feature_names_in_")
"""Arrays whose type may be text."""


class Saved(Protocol):
    """What is saved: parameters, the network, and those of the attributes above that are there."""

    network_: Network

    def __init__(self, **parameters: Any) -> None:
        """Take the parameters as `get_params` gave them."""

    def get_params(self, deep: bool = True) -> dict[str, Any]:
        """Return the parameters by name."""


Estimator = TypeVar("Estimator", bound=Saved)


def plain(value: Any) -> Any:
    """Turn a parameter into data that JSON can hold.

    Raises
    ------
    TypeError
        For anything else than words, numbers, codings, and lists and dictionaries of them.
    """
    if isinstance(value, Coding):
        return to_dict(value)
    if isinstance(value, np.ndarray | np.generic):
        return plain(value.tolist())
    if isinstance(value, slice):
        return {"slice": [plain(end) for end in (value.start, value.stop, value.step)]}
    if isinstance(value, Mapping):  # whose keys may be numbers, which those of JSON are not
        return {"dict": [[plain(key), plain(item)] for key, item in value.items()]}
    if isinstance(value, np.random.RandomState):
        return None  # a fitted model draws no more
    if value is None or isinstance(value, str | int | float | bool):
        return value
    if hasattr(value, "__array__"):  # columns and labels of pandas
        return plain(np.asarray(value))
    if isinstance(value, Iterable) and not isinstance(value, bytes | Iterator):
        return [plain(item) for item in value]
    raise TypeError(f"a parameter cannot be saved: {value!r}")


def restored(value: Any) -> Any:
    """Undo `plain`."""
    if isinstance(value, dict):
        if "slice" in value:
            return slice(*value["slice"])
        if "dict" in value:
            return {restored(key): restored(item) for key, item in value["dict"]}
        return from_dict(value)
    return [restored(item) for item in value] if isinstance(value, list) else value


def narrowed(values: NDArray[np.int32]) -> NDArray[Any]:
    """Hold whole numbers in the smallest type that has room for them."""
    for kind in (np.int8, np.int16):
        info = np.iinfo(kind)
        if values.size == 0 or (values.min() >= info.min and values.max() <= info.max):
            return values.astype(kind)
    return values


def named(values: NDArray[Any]) -> dict[str, Any]:
    """Describe an array of labels or names, whose type matters."""
    kind = "object" if values.dtype == object else values.dtype.str
    return {"type": kind, "values": values.tolist()}


def save(estimator: Saved, path: str | Path) -> None:
    """Write a fitted estimator; see `BaseSDNN.save`."""
    held = vars(estimator)
    code = estimator.network_.input_code
    tables = {id(table): table for table in (*code.modified, *code.modifiers)}
    number_of = {key: number for number, key in enumerate(tables)}
    networks = (estimator.network_, *held.get("_earlier", ()))
    arrays = {name: held[name] for name in ATTRIBUTES if isinstance(held.get(name), np.ndarray)}
    for number, table in enumerate(tables.values()):
        arrays[f"table.{number}"] = np.packbits(table > 0, axis=1)
    for number, network in enumerate(networks):
        arrays[f"weights.{number}"] = narrowed(network.weights)
        arrays[f"thresholds.{number}"] = narrowed(network.thresholds)
    attributes = {name: held[name] for name in ATTRIBUTES if name in held and name not in arrays}
    parameters = estimator.get_params(deep=False)
    description = {
        "class": type(estimator).__name__,
        "parameters": {name: plain(value) for name, value in parameters.items()},
        "attributes": attributes,
        "names": {name: named(held[name]) for name in NAMES if name in held},
        "codings": [to_dict(coding) for coding in code.codings],
        "pairs": code.pairs,
        "n_units": estimator.network_.n_units,
        "n_networks": len(networks),
        "n_pattern_units": code.n_units,
        "modified": [number_of[id(table)] for table in code.modified],
        "modifiers": [number_of[id(table)] for table in code.modifiers],
    }
    write_file(Path(path), "estimator", arrays, description)


def load(path: str | Path, kind: type[Estimator]) -> Estimator:
    """Read an estimator; see `BaseSDNN.load`."""
    path = Path(path)
    description, arrays = read_file(path, "estimator")
    if description.get("class") != kind.__name__:
        raise ValueError(f"{path} holds an {description.get('class')}, not an {kind.__name__}")
    try:
        return read_estimator(description, arrays, kind)
    except (
        AttributeError, IndexError, KeyError, OverflowError, RecursionError, TypeError, ValueError,
    ) as error:  # fmt: skip
        raise ValueError(f"{path} is damaged: {error!r}") from error


def read_estimator(description: Description, arrays: Arrays, kind: type[Estimator]) -> Estimator:
    """Make the estimator with its parameters and all it has learned."""
    estimator = kind(**{name: restored(value) for name, value in description["parameters"].items()})
    held = vars(estimator)
    held |= {name: arrays[name] for name in ATTRIBUTES if name in arrays}
    attributes = description["attributes"]
    held |= {name: attributes[name] for name in ATTRIBUTES if name in attributes}
    for name in NAMES:
        if name in description["names"]:
            told = description["names"][name]
            held[name] = np.array(told["values"], dtype=told["type"])
    estimator.network_, *earlier = read_networks(description, arrays)
    if "n_outputs_" in held:
        held["_earlier"] = tuple(earlier)
    require_consistent(estimator)
    return estimator


def require_consistent(estimator: Saved) -> None:
    """ValueError if the parts of a loaded estimator do not fit together."""
    held = vars(estimator)
    seed_of(held["_weight_seed"])
    network = estimator.network_
    code = network.input_code
    if "classes_" in held:
        n_units = _core.n_units_for(held["_scheme"], len(held["classes_"])) * held["_n_units_each"]
        fits = network.n_units == n_units
    else:
        n_outputs = held["n_outputs_"]
        fits = held["output_range_"].shape == (n_outputs, 2) and network.n_units == (
            n_outputs * held["_counts_of_range"]
        )
        fits = fits and isinstance(held["_flat"], bool)
    fits = fits and len(code.codings) == held["n_features_in_"]
    for (mu, nu), modified, modifier in zip(code.pairs, code.modified, code.modifiers, strict=True):
        fits = fits and len(modified) == code.codings[mu].size
        fits = fits and len(modifier) == code.codings[nu].size
    if not fits:
        raise ValueError("its parts do not fit together")


def read_networks(description: Description, arrays: Arrays) -> Iterator[Network]:
    """Build the code and the layers on it; equal tables are shared again."""
    n_units = description["n_pattern_units"]
    numbers = {*description["modified"], *description["modifiers"]}
    bits = {i: np.unpackbits(arrays[f"table.{i}"], axis=1, count=n_units) for i in numbers}
    tables = {i: (2 * table.astype(np.int8) - 1).astype(np.int8) for i, table in bits.items()}
    code = InputCode(
        [from_dict(coding) for coding in description["codings"]],
        [(mu, nu) for mu, nu in description["pairs"]],
        [tables[number] for number in description["modified"]],
        [tables[number] for number in description["modifiers"]],
    )
    for number in range(description["n_networks"]):
        yield Network(
            code,
            description["n_units"],
            weights=arrays[f"weights.{number}"].astype(np.int32),
            thresholds=arrays[f"thresholds.{number}"].astype(np.int32),
        )
