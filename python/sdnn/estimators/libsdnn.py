"""LIBSDNN's parameter and model files: what they say, and the same network from it."""

from __future__ import annotations

import ast
import operator
import re
import struct
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from sdnn import _core

Library = Literal["msvc", "libstdc++"]

_OPERATORS: dict[type, Callable[..., float]] = {
    ast.Add: operator.add,
    ast.Sub: operator.sub,
    ast.Mult: operator.mul,
    ast.Div: operator.truediv,
    ast.Pow: operator.pow,
    ast.UAdd: operator.pos,
    ast.USub: operator.neg,
}


@dataclass(frozen=True, kw_only=True)
class LibsdnnInput:
    """How LIBSDNN codes one input: numbers in [0, 1], or symbols that are whole numbers from 0."""

    symbolic: bool
    n_bins: int
    n_flipped: int


@dataclass(frozen=True, kw_only=True)
class LibsdnnParameters:
    """What a parameter file says. Seeds are None where it asks for hardware entropy.

    ``output_range`` and ``step_size`` mean something for regression only, ``n_classes`` and
    ``scheme`` for classification only.
    """

    task: Literal["regression", "classification"]
    n_units: int
    inputs: tuple[LibsdnnInput, ...]
    pairs: tuple[tuple[int, int], ...]
    pattern_seed: tuple[int, ...] | None
    weight_seed: tuple[int, ...] | None
    initial_range: tuple[int, int] = (-5, 5)
    output_range: tuple[float, float] = (0.0, 1.0)
    step_size: float = 0.01
    n_classes: int = 2
    scheme: Literal["one_vs_one", "one_vs_rest"] = "one_vs_one"

    @property
    def n_output_units(self) -> int:
        """Perceptrons: one per output step, per class or per pair of classes."""
        if self.task == "regression":
            low, high = self.output_range
            return int((high - low) / self.step_size)
        if self.scheme == "one_vs_rest":
            return self.n_classes
        return self.n_classes * (self.n_classes - 1) // 2

    def bins(self, inputs: npt.ArrayLike) -> npt.NDArray[np.int32]:
        """Return the bins of samples: ``int(n_bins * x)``, or ``int(x)`` of a symbol, clipped.

        Parameters
        ----------
        inputs : array of shape (n_samples, n_inputs)

        Returns
        -------
        array of int32, shape (n_samples, n_inputs)
        """
        values = np.asarray(inputs, dtype=np.float64)
        if values.ndim != 2 or values.shape[1] != len(self.inputs):
            raise ValueError(
                f"inputs must have shape (n_samples, {len(self.inputs)}), got {values.shape}"
            )
        if not np.isfinite(values).all():
            raise ValueError("inputs must be finite, got NaN or infinity")
        factors = np.array([1 if one.symbolic else one.n_bins for one in self.inputs])
        highest = np.array([one.n_bins - 1 for one in self.inputs])
        bins: npt.NDArray[np.int32] = np.clip(np.trunc(values * factors), 0, highest).astype(
            np.int32
        )
        return bins

    def make_code(self, library: Library = "msvc") -> _core.SelectiveDesensitization:
        """Return the code with LIBSDNN's own tables; needs a seed in the file."""
        if self.pattern_seed is None:
            raise ValueError("random_seed of PC must be a list of numbers, got hardware_entropy")
        sizes = [(one.n_bins, one.n_flipped) for one in self.inputs]
        pairs = np.array(self.pairs, dtype=np.int32)
        modified, modifiers = _core.libsdnn_tables(
            self.n_units, sizes, pairs, self.pattern_seed, library
        )
        return _core.SelectiveDesensitization(modified, modifiers, pairs)

    def make_layer(self, library: Library = "msvc") -> _core.PerceptronLayer:
        """Return the untrained network, bit for bit; needs seeds in the file."""
        if self.weight_seed is None:
            raise ValueError("random_seed of NN must be a list of numbers, got hardware_entropy")
        code = self.make_code(library)
        # LIBSDNN's classifiers always start from [-5, 5].
        low, high = self.initial_range if self.task == "regression" else (-5, 5)
        weights, thresholds = _core.libsdnn_weights(
            self.n_output_units, code.n_columns, low, high, self.weight_seed, library
        )
        return _core.PerceptronLayer(
            code, self.n_output_units, weights=weights, thresholds=thresholds
        )

    def make_trainer(
        self, layer: _core.PerceptronLayer, inputs: npt.ArrayLike, targets: npt.ArrayLike
    ) -> _core.PDeltaTrainer | _core.ErrorCorrectionTrainer:
        """Return a trainer whose ``epoch(np.arange(n_samples))`` is one iteration of LIBSDNN."""
        bins = self.bins(inputs)
        if self.task == "regression":
            low = self.output_range[0]
            counts = (np.asarray(targets, dtype=np.float64).reshape(-1, 1) - low) / self.step_size
            return _core.PDeltaTrainer(layer, bins, counts)
        labels = np.asarray(targets, dtype=np.int32)
        return _core.ErrorCorrectionTrainer(layer, bins, labels, self.scheme)


@dataclass(frozen=True, kw_only=True)
class LibsdnnModel:
    """A trained network from a model file."""

    parameters: LibsdnnParameters
    layer: _core.PerceptronLayer

    def predict(self, inputs: npt.ArrayLike, n_threads: int = 1) -> npt.NDArray[Any]:
        """LIBSDNN's outputs: numbers, or classes from 0.

        Parameters
        ----------
        inputs : array of shape (n_samples, n_inputs)
        n_threads : int

        Returns
        -------
        array of shape (n_samples,)
        """
        given = self.parameters
        bins = given.bins(inputs)
        if given.task == "regression":
            counts = self.layer.counts(bins, n_threads=n_threads)[:, 0]
            outputs: npt.NDArray[Any] = given.step_size * counts + given.output_range[0]
            return outputs
        potentials = self.layer.potentials(bins, n_threads=n_threads)
        if given.scheme == "one_vs_rest":  # class 0 if no unit fires
            classes: npt.NDArray[Any] = np.maximum(potentials, 0).argmax(axis=1)
            return classes
        votes = np.zeros((len(bins), given.n_classes), dtype=np.int64)
        first, second = np.triu_indices(given.n_classes, 1)
        for unit, (i, j) in enumerate(zip(first, second, strict=True)):
            firing = potentials[:, unit] > 0
            votes[:, i] += firing
            votes[:, j] += ~firing
        winners: npt.NDArray[Any] = votes.argmax(axis=1)
        return winners


def read_parameter_file(path: str | Path) -> LibsdnnParameters:
    """Read a parameter file.

    Raises
    ------
    ValueError
        If it is not one, lacks an entry, or asks for codes by correlation matrix, which cannot be
        reproduced.
    """
    path = Path(path)
    return _parameters(_entries(path.read_text("latin-1"), path), path)


def read_model_file(path: str | Path, library: Library = "msvc") -> LibsdnnModel:
    """Read a model file: the parameters as text, then thresholds and weights.

    Parameters
    ----------
    path : path
    library : {"msvc", "libstdc++"}
        The C++ library of the program that wrote it. A model file holds seeds instead of code
        tables, and the two make different tables of the same seed: LIBSDNN's own programs are
        "msvc"; built with GCC it is "libstdc++".

    Raises
    ------
    ValueError
        If it is not a model file, is cut off, or its size does not fit its parameters.
    """
    path = Path(path)
    content = path.read_bytes()
    length = struct.unpack_from("<i", content)[0] if len(content) >= 4 else -1
    if not 0 < length <= len(content) - 4:
        raise ValueError(f"{path} must begin with the length of its parameters, got {length}")
    parameters = _parameters(_entries(content[4 : 4 + length].decode("latin-1"), path), path)
    n_units = parameters.n_output_units
    n_columns = len(parameters.pairs) * parameters.n_units
    expected = 4 * n_units * (n_columns + 1)
    if len(content) - 4 - length != expected:
        raise ValueError(
            f"{path} must have {expected} bytes of weights for {n_units} units of {n_columns} "
            f"columns, got {len(content) - 4 - length}"
        )
    rows = np.frombuffer(content, "<i4", offset=4 + length).reshape(n_units, n_columns + 1)
    layer = _core.PerceptronLayer(
        parameters.make_code(library),
        n_units,
        weights=np.ascontiguousarray(rows[:, 1:], dtype=np.int32),
        thresholds=np.ascontiguousarray(rows[:, 0], dtype=np.int32),
    )
    return LibsdnnModel(parameters=parameters, layer=layer)


def _entries(text: str, path: Path) -> dict[str, str]:
    """Return the entries by their full names, such as ``SDNN/PC/n``."""
    tags: list[str] = []
    entries: dict[str, str] = {}
    for number, line in enumerate(text.splitlines(), start=1):
        stripped = re.sub(r"[\s{\0]", "", line.partition("%")[0])
        if "<" in stripped:
            tags.append(stripped.strip("<>"))
        elif "}" in stripped:
            if not tags:
                raise ValueError(f"{path}, line {number}: }} without a tag")
            tags.pop()
        elif "=" in stripped:
            name, _, value = stripped.partition("=")
            entries["/".join([*tags, name])] = value
        elif stripped:
            raise ValueError(f"{path}, line {number}: must be a tag or name = value, got {line!r}")
    return entries


def _number(text: str, what: str) -> float:
    """Return the value of a formula of numbers, ``+ - * / ^`` and parentheses."""

    def value(node: ast.expr) -> float:
        if isinstance(node, ast.Constant) and isinstance(node.value, int | float):
            return float(node.value)
        if isinstance(node, ast.UnaryOp) and type(node.op) in _OPERATORS:
            return _OPERATORS[type(node.op)](value(node.operand))
        if isinstance(node, ast.BinOp) and type(node.op) in _OPERATORS:
            left, right = float(value(node.left)), float(value(node.right))
            return _OPERATORS[type(node.op)](left, right)
        raise ValueError

    try:
        if len(text) > 1000:
            raise ValueError
        result = float(value(ast.parse(text.replace("^", "**"), mode="eval").body))
        if not np.isfinite(result):
            raise ValueError
    except (ValueError, SyntaxError, ArithmeticError, TypeError, RecursionError, MemoryError):
        raise ValueError(f"{what} must be a number, got {text[:80]!r}") from None
    return result


def _items(text: str, what: str) -> list[str]:
    """Return the items of ``[a, b:3]``, that is ``[a, b, b, b]``; not cut in parentheses."""
    if not (text.startswith("[") and text.endswith("]")):
        raise ValueError(f"{what} must be a list in brackets, got {text[:80]!r}")
    items: list[str] = []
    for item in re.split(r",(?![^(]*\))", text[1:-1]):
        content, colon, times = item.partition(":")
        repeats = _whole(times, f"repeats of {what}", 1, 100000) if colon else 1
        items += [content] * repeats
    return items


def _whole(text: str, what: str, low: int, high: int = 2**31 - 1) -> int:
    value = _number(text, what)
    if value != int(value) or not low <= value <= high:
        raise ValueError(f"{what} must be a whole number in [{low}, {high}], got {text[:80]}")
    return int(value)


def _seed(text: str, what: str) -> tuple[int, ...] | None:
    if text == "hardware_entropy":
        return None
    return tuple(_whole(item, what, 0, 2**32 - 1) for item in _items(text, what))


def _input(text: str, n_units: int) -> LibsdnnInput:
    found = re.fullmatch(r"(NUMERICAL|SYMBOLIC)\((\w+)\((.*)\)\)", text)
    if found is None:
        raise ValueError(f"input_type_and_creation_method must name a method, got {text[:80]!r}")
    kind, method, arguments = found.groups()
    if method != "RANDOM_INVERSE":
        raise ValueError(
            f"input_type_and_creation_method must be RANDOM_INVERSE to be reproduced, got {method}"
        )
    sizes = arguments.split(",")
    if len(sizes) != 2:
        raise ValueError(f"RANDOM_INVERSE must have two arguments, got {arguments[:80]!r}")
    return LibsdnnInput(
        symbolic=kind == "SYMBOLIC",
        n_bins=_whole(sizes[0], "q of RANDOM_INVERSE", 1, 2**24),
        n_flipped=_whole(sizes[1], "r of RANDOM_INVERSE", 1, n_units // 2 - 1),
    )


def _pairs(entries: dict[str, str], n_inputs: int, path: Path) -> tuple[tuple[int, int], ...]:
    method = entries.get("SDNN/SD/combination_setting", "mutual")
    if method == "mutual":
        return tuple((i, j) for i in range(n_inputs) for j in range(n_inputs) if i != j)
    if method == "saved":
        line = entries.get("SDNN/SD/line", "[(0,1),(1,0)]")
        lines = [item.strip("()") for item in _items(line, "SDNN/SD/line")]
    elif method == "file":
        file = path.parent / entries.get("SDNN/SD/filename", "")
        if not file.is_file():
            raise ValueError(f"SDNN/SD/filename must be a file beside {path}, got {file}")
        lines = [line for line in file.read_text("latin-1").split() if line]
    else:
        raise ValueError(f"combination_setting must be mutual, saved or file, got {method!r}")
    pairs = []
    for one in lines:
        inputs = one.split(",")
        if len(inputs) != 2:
            raise ValueError(f"a combination must be two inputs, got {one[:80]!r}")
        mu, nu = (_whole(item, "an input of a combination", 0, n_inputs - 1) for item in inputs)
        pairs.append((mu, nu))
    if not pairs:
        raise ValueError(f"{path} must combine at least one pair of inputs")
    return tuple(pairs)


def _parameters(entries: dict[str, str], path: Path) -> LibsdnnParameters:
    def entry(name: str, default: str | None = None) -> str:
        if name in entries:
            return entries[name]
        if default is None:
            raise ValueError(f"{path} must have the entry {name.replace('/', ' / ')}")
        return default

    task = entry("ISSUE/type", "function_approximation")
    if task not in ("function_approximation", "pattern_recognition"):
        raise ValueError(
            f"ISSUE / type must be function_approximation or pattern_recognition, got {task!r}"
        )
    n_inputs = _whole(entry("ISSUE/input_number"), "input_number", 1, 10000)
    n_units = _whole(entry("SDNN/PC/n"), "n", 2, 2**24)
    if n_units % 2 != 0:
        raise ValueError(f"n must be even, got {n_units}")
    name = "SDNN/PC/input_type_and_creation_method"
    inputs = tuple(_input(item, n_units) for item in _items(entry(name), name))
    if len(inputs) != n_inputs:
        raise ValueError(f"{name} must have input_number = {n_inputs} items, got {len(inputs)}")
    limits = _items(entry("SDNN/NN/initial_value_range", "[-5,5]"), "initial_value_range")
    if len(limits) != 2:
        raise ValueError(f"initial_value_range must be two numbers, got {len(limits)}")
    low, high = (_whole(item, "initial_value_range", -(10**6), 10**6) for item in limits)
    if low > high:
        raise ValueError(f"initial_value_range must rise, got [{low}, {high}]")
    given: dict[str, Any] = {}
    if task == "function_approximation":
        span = _items(entry("ISSUE/FA/output_range"), "output_range")
        step = _number(entry("ISSUE/FA/required_step_size"), "required_step_size")
        bounds = tuple(_number(item, "output_range") for item in span)
        if len(bounds) != 2 or not 1e-6 <= step <= bounds[1] - bounds[0]:
            raise ValueError("output_range must be two numbers, a step size at least apart")
        given |= {"task": "regression", "output_range": bounds, "step_size": step}
    else:
        schemes = {"1v1": "one_vs_one", "1vR": "one_vs_rest"}
        scheme = entry("ISSUE/PR/multi_class_recognition", "1v1")
        if scheme not in schemes:
            raise ValueError(f"multi_class_recognition must be 1v1 or 1vR, got {scheme!r}")
        n_classes = _whole(entry("ISSUE/PR/class_number"), "class_number", 2, 1024)
        given |= {"task": "classification", "n_classes": n_classes, "scheme": schemes[scheme]}
    return LibsdnnParameters(
        n_units=n_units,
        inputs=inputs,
        pairs=_pairs(entries, n_inputs, path),
        pattern_seed=_seed(entry("SDNN/PC/random_seed", "hardware_entropy"), "seed of PC"),
        weight_seed=_seed(entry("SDNN/NN/random_seed", "hardware_entropy"), "seed of NN"),
        initial_range=(low, high),
        **given,
    )
